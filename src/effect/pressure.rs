//! Pressure: what fills a closed surface pushes its walls apart.

use super::{Effect, Figures, Parameter, Scale, parameter};
use crate::{
    simulation::{
        Active, CurrentSubstep, EffectSystems, Multipliers, Profile, SoftBody, SolvePhase,
        SolveSchedule, SolverThreads,
    },
    solver::{
        Effects, Filling, Particles, Pressure, Settings, Stiffness,
        advance::{Spare, Stage, Stepper},
        constraint::pressure::Walls,
        measure,
    },
};
use bevy::prelude::*;
use std::sync::Arc;

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
    const IN_PLAN: bool = true;

    fn add_systems(schedules: &mut Schedules) {
        schedules.add_systems(
            SolveSchedule,
            solve
                .in_set(EffectSystems(Self::NAME))
                .in_set(SolvePhase::Elastic),
        );
    }

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }

    fn unfit(body: &EntityRef, _: &Settings) -> Option<String> {
        let topology = &body.get::<SoftBody>()?.0;
        topology.enclosure().err().map(|reason| reason.to_string())
    }

    fn when_removed(body: &mut EntityWorldMut) {
        if let Some(mut multipliers) = body.get_mut::<Multipliers>() {
            multipliers.0.walls = Walls::default();
        }
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

/// One sweep over the fillings of all bodies.
pub fn solve(
    current: Res<CurrentSubstep>,
    threads: Res<SolverThreads>,
    mut profile: ResMut<Profile>,
    mut bodies: Query<(&SoftBody, &mut Particles, &Pressure, &mut Multipliers), Active>,
) {
    let means = current.means(&threads);
    profile.time(Pressure::NAME, || {
        for (body, mut particles, &pressure, mut multipliers) in &mut bodies {
            let mut topology = Arc::clone(&body.0);
            let mut spare = Spare::of(Effects {
                pressure: Some(pressure),
                ..Effects::default()
            });
            let mut stepper = Stepper {
                lambdas: &mut multipliers.0,
                ..spare.stepper(&mut topology, &mut particles)
            };
            stepper.act(Stage::Pressure, &current.step, current.iteration, &means);
        }
    });
}
