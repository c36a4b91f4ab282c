//! Pressure: what fills a closed surface pushes its walls apart.

use super::{Effect, Figures, Parameter, Scale, parameter};
use crate::{
    simulation::{Multipliers, SoftBody},
    solver::{Filling, Particles, Pressure, Settings, Stiffness, advance::Stage, measure},
};
use bevy::prelude::*;

impl Effect for Pressure {
    const NAME: &'static str = "pressure";
    const TITLE: &'static str = "Pressure";
    const SUMMARY: &'static str = "A gas or a liquid fills the closed surface.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            factor: Filling, "Filling", "×",
            "The volume that the filling would have by itself; above 1 it pushes the walls apart.",
            (0.1, 10.0), Scale::Linear
        ),
        parameter!(
            bulk_modulus: Stiffness, "Bulk modulus", "Pa",
            "K of the filling: 101 325 Pa is a gas in the atmosphere, pV = nRT; ∞ a liquid that keeps its volume.",
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
        let walls = &multipliers.0.walls;
        let at = |i: u32| particles.position(i as usize);
        Figures {
            elements: usize::from(topology.enclosure().is_ok()),
            energy: Some(measure::pressure_energy(self, topology, at)),
            residual: measure::pressure_residual(self, topology, particles, walls, h),
            overpressure: walls.overpressure(h.into()),
        }
    }
}
