//! Volume: tetrahedra resist a change of volume.

use super::{Effect, Figures, Parameter, Scale, component, parameter};
use crate::{
    simulation::{
        Active, CurrentSubstep, EffectSystems, Profile, SoftBody, SolvePhase, SolveSchedule,
        StepSchedule, StepSystems,
    },
    solver::{
        Compliance, Damping, Particles, Stiffness, Volume,
        constraint::{Multipliers, volume},
        measure,
    },
};
use bevy::{
    prelude::*,
    reflect::{ReflectDeserialize, ReflectSerialize, impl_reflect},
};

component!(Volume);
impl_reflect!(
    #[reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize)]
    #[type_path = "pliant::effect"]
    struct Volume {
        compliance: Compliance,
        bulk_modulus: Stiffness,
        damping: Damping,
    }
);

/// λ of every tetrahedron after the last substep of a tick [Pa·s²]; λ/h² is a pressure.
#[derive(Component, Debug, Clone, Default, Deref, DerefMut)]
pub struct VolumeMultipliers(pub Vec<f32>);

impl Effect for Volume {
    const NAME: &'static str = "volume";
    const TITLE: &'static str = "Volume";
    const SUMMARY: &'static str = "Tetrahedra resist a change of volume.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            compliance: Compliance, "Compliance", "m⁵/N",
            "How much a tetrahedron gives under a pascal [m³/Pa]; 0 is incompressible.",
            (1e-14, 1e-4), Scale::LogarithmicFromZero
        ),
        parameter!(
            bulk_modulus: Stiffness, "Bulk modulus", "Pa",
            "K of the material: pressure over change of volume, however finely it is divided; ∞ adds nothing.",
            (1e2, 1e10), Scale::LogarithmicToInfinity
        ),
        parameter!(
            damping: Damping, "Damping", "s",
            "The time over which a change of volume dies away; 0 is none but the integrator's own.",
            (1e-4, 0.03), Scale::LogarithmicFromZero
        ),
    ];

    type State = VolumeMultipliers;

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
        let multipliers = body.get::<VolumeMultipliers>().map_or(&[][..], |m| &m.0);
        Figures {
            elements: topology.tetrahedra.corners.len(),
            energy: Some(measure::volume_energy(topology, positions, self)),
            residual: measure::volume_residual(topology, positions, self, multipliers, h),
        }
    }
}

/// One multiplier for each tetrahedron.
fn make_room(mut bodies: Query<(&SoftBody, &mut VolumeMultipliers)>) {
    for (body, mut multipliers) in &mut bodies {
        let count = body.tetrahedra.corners.len();
        if multipliers.len() != count {
            multipliers.0 = vec![0.0; count];
        }
    }
}

/// One sweep over the tetrahedra of every body.
pub fn solve(
    current: Res<CurrentSubstep>,
    mut profile: ResMut<Profile>,
    mut bodies: Query<(&SoftBody, &mut Particles, &Volume, &mut VolumeMultipliers), Active>,
) {
    profile.time(Volume::NAME, || {
        for (body, mut particles, volume, mut multipliers) in &mut bodies {
            // A body that came in the middle of a tick has no room yet, and waits for the next.
            if multipliers.len() != body.tetrahedra.corners.len() {
                continue;
            }
            let Particles {
                positions,
                previous,
                ..
            } = &mut *particles;
            volume::solve(
                positions,
                previous,
                &body.tetrahedra,
                &body.rest,
                volume.coefficients(current.step.h),
                Multipliers::of_sweep(&mut multipliers, current.sweep()),
            );
        }
    });
}
