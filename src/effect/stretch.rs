//! Stretch: edges resist a change of length.

use super::{
    Effect, Figures, Parameter, Scale, component,
    elastic::{self, Elastic},
    parameter,
};
use crate::{
    simulation::SoftBody,
    solver::{
        Compliance, Damping, Effects, Particles, Stiffness, Stretch, Topology, advance::Stage,
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
        let multipliers = body.get::<StretchMultipliers>().map_or(&[][..], |m| &m.0);
        Figures {
            elements: topology.edges.ends().len(),
            energy: Some(measure::stretch_energy(topology, positions, self)),
            residual: measure::stretch_residual(topology, positions, self, multipliers, h),
        }
    }
}

impl Elastic for Stretch {
    type Multipliers = StretchMultipliers;
    const SWEEP: Stage = Stage::Stretch;

    fn count(topology: &Topology) -> usize {
        topology.edges.ends().len()
    }

    fn alone(self) -> Effects {
        Effects {
            stretch: Some(self),
            ..Effects::default()
        }
    }
}
