//! Pressure: a gas or liquid inside a closed surface.

use super::{Effect, Figures, Parameter, Scale, parameter};
use crate::{
    simulation::{Multipliers, SoftBody},
    solver::{Filling, Particles, Pressure, Settings, Stiffness, advance::Stage, measure},
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
    const STAGE: Option<Stage> = Some(Stage::Pressure);

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }

    fn unfit(body: &EntityRef, _: &Settings) -> Option<String> {
        let topology = &body.get::<SoftBody>()?.0;
        topology.enclosure().err().map(|reason| reason.to_string())
    }

    fn figures(&self, body: &EntityRef, h: f32) -> Figures {
        let (Some(topology), Some(particles), Some(multipliers)) = (
            body.get::<SoftBody>(),
            body.get::<Particles>(),
            body.get::<Multipliers>(),
        ) else {
            return Figures::default();
        };
        let h = particles.history.seconds(h.into()) as f32;
        let state = &multipliers.0.pressure_state;
        let at = |i: u32| particles.position(i as usize);
        Figures {
            elements: usize::from(topology.enclosure().is_ok()),
            energy: Some(measure::pressure_energy(self, topology, at)),
            residual: measure::pressure_residual(self, topology, particles, state, h),
            overpressure: state.overpressure(h.into()),
        }
    }
}
