//! Stretch: edges resist a change of length.

use super::{Effect, Figures, Parameter, Scale, component, parameter};
use crate::{
    simulation::{
        Active, CurrentSubstep, EffectSystems, Profile, SoftBody, SolvePhase, SolveSchedule,
        StepSchedule, StepSystems,
    },
    solver::{
        Compliance, Damping, Particles, Stiffness, Stretch,
        constraint::{Multipliers, stretch},
        measure,
    },
};
use bevy::{
    prelude::*,
    reflect::{ReflectDeserialize, ReflectSerialize, impl_reflect},
};

component!(Stretch);
impl_reflect!(
    #[reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize)]
    #[type_path = "pliant::effect"]
    struct Stretch {
        compliance: Compliance,
        axial_stiffness: Stiffness,
        damping: Damping,
    }
);

/// λ of every edge after the last substep of a tick [N·s²]; λ/h² is a force.
#[derive(Component, Debug, Clone, Default, Deref, DerefMut)]
pub struct StretchMultipliers(pub Vec<f32>);

impl Effect for Stretch {
    const NAME: &'static str = "stretch";
    const TITLE: &'static str = "Stretch";
    const SUMMARY: &'static str = "Edges resist a change of length.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            compliance: Compliance, "Compliance", "m/N",
            "How far an edge gives under a newton; 0 is rigid.",
            (1e-8, 1e-2), Scale::LogarithmicFromZero
        ),
        parameter!(
            axial_stiffness: Stiffness, "Axial stiffness", "N",
            "EA of a rope: force over strain, however finely it is divided; ∞ adds nothing.",
            (1.0, 1e7), Scale::LogarithmicToInfinity
        ),
        parameter!(
            damping: Damping, "Damping", "s",
            "The time over which a stretch dies away; 0 is none but the integrator's own.",
            (1e-4, 1.0), Scale::LogarithmicFromZero
        ),
    ];

    type State = StretchMultipliers;

    fn add_systems(schedules: &mut Schedules) {
        schedules.add_systems(
            StepSchedule,
            make_room
                .in_set(EffectSystems(Self::NAME))
                .in_set(StepSystems::Ready)
                // It touches nothing but its own column.
                .ambiguous_with_all(),
        );
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

    fn figures(&self, body: &EntityRef, h: f32) -> Figures {
        let (Some(topology), Some(particles)) = (body.get::<SoftBody>(), body.get::<Particles>())
        else {
            return Figures::default();
        };
        let positions = &particles.positions;
        let multipliers = body.get::<StretchMultipliers>().map_or(&[][..], |m| &m.0);
        Figures {
            elements: topology.edges.ends.len(),
            energy: Some(measure::stretch_energy(topology, positions, self)),
            residual: measure::stretch_residual(topology, positions, self, multipliers, h),
        }
    }
}

/// One multiplier for each edge.
fn make_room(mut bodies: Query<(&SoftBody, &mut StretchMultipliers)>) {
    for (body, mut multipliers) in &mut bodies {
        let count = body.edges.ends.len();
        if multipliers.len() != count {
            multipliers.0 = vec![0.0; count];
        }
    }
}

/// One sweep over the edges of every body.
pub fn solve(
    current: Res<CurrentSubstep>,
    mut profile: ResMut<Profile>,
    mut bodies: Query<(&SoftBody, &mut Particles, &Stretch, &mut StretchMultipliers), Active>,
) {
    profile.time(Stretch::NAME, || {
        for (body, mut particles, stretch, mut multipliers) in &mut bodies {
            // A body that came in the middle of a tick has no room yet, and waits for the next.
            if multipliers.len() != body.edges.ends.len() {
                continue;
            }
            let Particles {
                positions,
                previous,
                ..
            } = &mut *particles;
            stretch::solve(
                positions,
                previous,
                &body.edges,
                &body.rest,
                stretch.coefficients(current.step.h),
                Multipliers::of_sweep(&mut multipliers, current.sweep()),
            );
        }
    });
}
