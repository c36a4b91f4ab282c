//! Stretch: edges resist changes of length.

use super::{Effect, Parameter, Scale, elastic::elastic, parameter};
use crate::{
    simulation::SoftBody,
    solver::{Compliance, Damping, RepairTime, Stiffness, Stretch, topology::Dimension},
};
use bevy::prelude::EntityRef;

impl Effect for Stretch {
    const NAME: &'static str = "stretch";
    const TITLE: &'static str = "Stretch";
    const SUMMARY: &'static str = "Edges resist changes of length.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            compliance: Compliance, "Compliance", "m/N",
            "Extension of an edge per newton of force. 0: rigid.",
            (1e-8, 1e-2), Scale::LogarithmicFromZero
        ),
        parameter!(
            axial_stiffness: Stiffness, "Axial stiffness", "N",
            "Axial stiffness EA of a rope: force over strain, independent of the mesh. ∞: adds no compliance.",
            (1.0, 1e7), Scale::LogarithmicToInfinity
        ),
        parameter!(
            damping: Damping, "Damping", "s",
            "Damping time constant. 0 leaves only numerical damping.",
            (1e-4, 1.0), Scale::LogarithmicFromZero
        ),
        parameter!(
            repair: RepairTime, "Repair time", "s",
            "Time constant for recovering crushed or tangled cloth without adding velocity; ∞ disables recovery. Ropes and solids ignore it.",
            (0.01, 1.0), Scale::LogarithmicToInfinity
        ),
    ];

    elastic!(2, 1);

    fn matters(parameter: &str, body: &EntityRef) -> bool {
        let dimension = body.get::<SoftBody>().map(|body| body.dimension);
        match parameter {
            "axial_stiffness" => dimension == Some(Dimension::Line),
            "repair" => dimension == Some(Dimension::Sheet),
            _ => true,
        }
    }
}
