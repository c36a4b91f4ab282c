//! Stretch: edges resist a change of length.

use super::{Effect, Parameter, Scale, elastic::elastic, parameter};
use crate::solver::{Compliance, Damping, RepairTime, Stiffness, Stretch};

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
        parameter!(
            repair: RepairTime, "Repair time", "s",
            "Time constant for recovering crushed or tangled cloth without adding velocity; ∞ disables recovery. Ropes and solids ignore it.",
            (0.01, 1.0), Scale::LogarithmicToInfinity
        ),
    ];

    elastic!(2, 1);
}
