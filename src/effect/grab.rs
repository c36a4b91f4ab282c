//! Grab: a hand holds a body at a point. On a body only while it is held.

use super::{Effect, Figures, Parameter, Scale, parameter};
use crate::solver::{Compliance, Force, Grab, advance::Stage};
use bevy::prelude::*;

impl Effect for Grab {
    const NAME: &'static str = "grab";
    const TITLE: &'static str = "Grab";
    const SUMMARY: &'static str = "A hand pulls at a point through a compliant spring.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            compliance: Compliance, "Compliance", "m/N",
            "How far the hand's spring gives under a newton.",
            (1e-6, 1.0), Scale::LogarithmicFromZero
        ),
        parameter!(
            max_force: Force, "Strength", "N",
            "The hand never pulls harder than this.",
            (1.0, 1e6), Scale::LogarithmicToInfinity
        ),
    ];

    type State = ();
    const STAGE: Option<Stage> = Some(Stage::Grab);

    fn figures(&self, _body: &EntityRef, _h: f32) -> Figures {
        Figures {
            elements: 1,
            ..Figures::default()
        }
    }
}
