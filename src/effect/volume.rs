//! Volume: tetrahedra resist a change of volume.

use super::{Effect, Parameter, Scale, elastic::elastic, parameter};
use crate::solver::{Compliance, Damping, RepairTime, Stiffness, Volume};

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
        parameter!(
            repair: RepairTime, "Repair time", "s",
            "Time constant for recovering collapsed or inverted tetrahedra without adding velocity; ∞ disables recovery.",
            (0.01, 1.0), Scale::LogarithmicToInfinity
        ),
    ];

    elastic!(4, 1);
}
