//! Stitches: breakable joints between points.

use super::{Effect, Figures, Parameter};
use crate::solver::{BodyEffectKind, Stitches, advance::Stage};
use bevy::prelude::*;

impl Effect for Stitches {
    const NAME: &'static str = "stitches";
    const TITLE: &'static str = "Stitches";
    const SUMMARY: &'static str =
        "Breakable joints between points of the body, or between points and colliders.";
    const PARAMETERS: &'static [Parameter<Self>] = &[];

    type State = ();
    const STAGE: Option<Stage> = Some(Stage::Body(BodyEffectKind::Stitches));

    fn figures(&self, _body: &EntityRef, _h: f32) -> Figures {
        Figures {
            elements: self.all().len() - self.broken(),
            ..Figures::default()
        }
    }
}
