//! Grains: balls that touch each other.

use super::{
    Effect, Figures, Parameter, Scale,
    elastic::{body_elements, body_figures},
    parameter,
};
use crate::{
    simulation::SoftBody,
    solver::{
        BodyEffectKind, Cohesion, Fraction, Friction, GrainRolling, Grains, RecoverySpeed,
        Settings, advance::Stage,
    },
};
use bevy::prelude::*;

impl Effect for Grains {
    const NAME: &'static str = "grains";
    const TITLE: &'static str = "Grains";
    const SUMMARY: &'static str = "Grains touch each other, with friction and cohesion.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            friction: Friction, "Friction µ", "",
            "Static friction between grains: largest tangential force over the normal force.",
            (0.0, 2.0), Scale::Linear
        ),
        parameter!(
            kinetic_fraction: Fraction, "Kinetic friction", "× static",
            "Friction while sliding, as a fraction of static friction.",
            (0.0, 1.0), Scale::Linear
        ),
        parameter!(
            cohesion: Cohesion, "Cohesion", "N",
            "Largest force with which two touching grains hold each other, as in wet sand.",
            (1e-5, 10.0), Scale::LogarithmicFromZero
        ),
        parameter!(
            rolling_resistance: GrainRolling, "Rolling resistance", "",
            "Slope above which grains roll; ∞ keeps them from rotating, 0 is smooth marbles.",
            (1e-3, 1.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            recovery_speed: RecoverySpeed, "Recovery speed", "m/s",
            "Largest speed at which overlapping grains separate.",
            (0.01, 10.0), Scale::Logarithmic
        ),
    ];

    type State = ();
    const STAGES: &'static [Stage] = &[Stage::Body(BodyEffectKind::Grains)];

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }

    fn unfit(body: &EntityRef, _: &Settings) -> Option<String> {
        let topology = &body.get::<SoftBody>()?.0;
        let is_unfit = topology.radii.is_empty();
        is_unfit.then(|| "it needs a body of grains, such as the primitive `Grains`".to_owned())
    }

    fn elements(&self, body: &EntityRef) -> usize {
        body_elements(BodyEffectKind::Grains, body)
    }

    fn figures(&self, body: &EntityRef, h: f32) -> Figures {
        body_figures(BodyEffectKind::Grains, body, h)
    }
}
