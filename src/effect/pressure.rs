//! Pressure: a gas or liquid inside a closed surface.

use super::{
    Effect, Figures, Parameter, Scale,
    elastic::{body_elements, body_figures},
    parameter,
};
use crate::{
    simulation::SoftBody,
    solver::{BodyEffectKind, Filling, Pressure, Settings, Stiffness, advance::Stage},
};
use bevy::prelude::*;

impl Effect for Pressure {
    const NAME: &'static str = "pressure";
    const TITLE: &'static str = "Pressure";
    const SUMMARY: &'static str = "Gas or liquid inside the closed surface.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            factor: Filling, "Fill ratio", "×",
            "Unpressurized volume of the filling over the rest volume of the surface. Above 1 it inflates the body.",
            (0.1, 10.0), Scale::Linear
        ),
        parameter!(
            bulk_modulus: Stiffness, "Bulk modulus", "Pa",
            "Bulk modulus K of the filling: 101 325 Pa for a gas at atmospheric pressure (pV = nRT), ∞ for an incompressible liquid.",
            (1.0, 1e9), Scale::LogarithmicToInfinity
        ),
    ];

    type State = ();
    const STAGES: &'static [Stage] = &[Stage::Body(BodyEffectKind::Pressure)];

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }

    fn unfit(body: &EntityRef, _: &Settings) -> Option<String> {
        let topology = &body.get::<SoftBody>()?.0;
        topology.enclosure().err().map(|reason| reason.to_string())
    }

    fn elements(&self, body: &EntityRef) -> usize {
        body_elements(BodyEffectKind::Pressure, body)
    }

    fn figures(&self, body: &EntityRef, h: f32) -> Figures {
        body_figures(BodyEffectKind::Pressure, body, h)
    }
}
