//! Grab: the mouse spring. A body carries it only while it is dragged.

use super::{Effect, Figures, Parameter, Scale, parameter};
use crate::solver::{BodyEffectKind, Compliance, Force, Grab, advance::Stage};
use bevy::prelude::*;

impl Effect for Grab {
    const NAME: &'static str = "grab";
    const TITLE: &'static str = "Grab";
    const SUMMARY: &'static str = "Mouse spring between the pointer and a point of the body.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            compliance: Compliance, "Compliance", "m/N",
            "Extension of the mouse spring per newton of force.",
            (1e-6, 1.0), Scale::LogarithmicFromZero
        ),
        parameter!(
            max_force: Force, "Force limit", "N",
            "Largest force of the mouse spring.",
            (1.0, 1e6), Scale::LogarithmicToInfinity
        ),
    ];

    type State = ();
    const STAGES: &'static [Stage] = &[Stage::Body(BodyEffectKind::Grab)];

    fn figures(&self, _body: &EntityRef, _h: f32) -> Figures {
        Figures {
            elements: 1,
            ..Figures::default()
        }
    }
}
