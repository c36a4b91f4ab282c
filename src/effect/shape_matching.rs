//! Shape matching: particles are drawn to where the rest shape would have them.

use super::{Effect, Figures, Parameter, Scale, parameter};
use crate::{
    simulation::{
        Active, CurrentSubstep, EffectSystems, Multipliers, Profile, SoftBody, SolvePhase,
        SolveSchedule, SolverThreads,
    },
    solver::{
        Damping, Effects, Frequency, Matching, Particles, RegionSize, ShapeMatching,
        advance::{Spare, Stage, Stepper},
        constraint::shape_matching::Place,
    },
};
use bevy::prelude::*;
use std::sync::Arc;

impl Effect for ShapeMatching {
    const NAME: &'static str = "shape_matching";
    const TITLE: &'static str = "Shape matching";
    const SUMMARY: &'static str =
        "Particles are drawn to where the rest shape would have them, as a whole or in regions.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            frequency: Frequency, "Frequency", "Hz",
            "How often a second a deformed body swings about its shape; ∞ is rigid.",
            (0.1, 100.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            region: RegionSize, "Region", "m",
            "Size of the overlapping parts whose shapes are matched: small ones let a body bend; ∞ is the whole body.",
            (0.01, 10.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            damping: Damping, "Damping", "s",
            "The time over which a deformation dies away; 0 is none but the integrator's own.",
            (1e-4, 1.0), Scale::LogarithmicFromZero
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

    fn when_removed(body: &mut EntityWorldMut) {
        if let Some(mut multipliers) = body.get_mut::<Multipliers>() {
            multipliers.0.matching = None;
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
        let h = particles.history.seconds(h.into());
        let at = || Place::among(particles);
        let known = multipliers.0.matching.as_deref();
        let known = known.filter(|known| known.is_of(topology, self));
        let found;
        // Before the first substep after a change nobody has looked for them.
        let matching = if let Some(known) = known {
            known
        } else {
            found = Matching::of(topology, self);
            &found
        };
        Figures {
            elements: matching.regions().count(),
            energy: Some(matching.energy(topology, self, at())),
            residual: matching.residual(topology, self, h, at()),
            ..Figures::default()
        }
    }
}

/// One sweep over the regions of all bodies.
fn solve(
    current: Res<CurrentSubstep>,
    threads: Res<SolverThreads>,
    mut profile: ResMut<Profile>,
    mut bodies: Query<(&SoftBody, &mut Particles, &ShapeMatching, &mut Multipliers), Active>,
) {
    let means = current.means(&threads);
    profile.time(ShapeMatching::NAME, || {
        for (body, mut particles, &effect, mut multipliers) in &mut bodies {
            let mut topology = Arc::clone(&body.0);
            let mut spare = Spare::of(Effects {
                shape_matching: Some(effect),
                ..Effects::default()
            });
            let mut stepper = Stepper {
                lambdas: &mut multipliers.0,
                ..spare.stepper(&mut topology, &mut particles)
            };
            stepper.act(
                Stage::ShapeMatching,
                &current.step,
                current.iteration,
                &means,
            );
        }
    });
}
