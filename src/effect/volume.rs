//! Volume: tetrahedra resist a change of volume.

use super::{
    Effect, Figures, Parameter, Scale, component,
    elastic::{self, Elastic},
    parameter,
};
use crate::{
    simulation::SoftBody,
    solver::{
        Compliance, Damping, Effects, Particles, Stiffness, Topology, Volume, advance::Stage,
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
    const IN_PLAN: bool = true;

    fn add_systems(schedules: &mut Schedules) {
        elastic::add_systems::<Self>(schedules);
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
            elements: topology.tetrahedra.corners().len(),
            energy: Some(measure::volume_energy(topology, positions, self)),
            residual: measure::volume_residual(topology, positions, self, multipliers, h),
        }
    }
}

impl Elastic for Volume {
    type Multipliers = VolumeMultipliers;
    const SWEEP: Stage = Stage::Volume;

    fn count(topology: &Topology) -> usize {
        topology.tetrahedra.corners().len()
    }

    fn alone(self) -> Effects {
        Effects {
            volume: Some(self),
            ..Effects::default()
        }
    }
}
