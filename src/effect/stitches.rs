//! Stitches: breakable joints between points.

use super::{Effect, Figures, Parameter};
use crate::solver::{BodyEffectKind, Stitches, advance::Stage};
use bevy::prelude::*;

impl Effect for Stitches {
    const NAME: &'static str = "stitches";
    const TITLE: &'static str = "Stitches";
    const SUMMARY: &'static str =
        "Breakable stitches between points of the body, to colliders, and to other bodies.";
    const PARAMETERS: &'static [Parameter<Self>] = &[];

    type State = ();
    const STAGES: &'static [Stage] = &[Stage::Body(BodyEffectKind::Stitches), Stage::Joints];

    fn figures(&self, _body: &EntityRef, _h: f32) -> Figures {
        Figures {
            elements: self.all().len() - self.broken(),
            ..Figures::default()
        }
    }
}
