//! Volume: tetrahedra resist changes of volume.

use super::{Effect, Parameter, Scale, elastic::elastic, parameter};
use crate::solver::{Compliance, Damping, RepairTime, Stiffness, Volume};

impl Effect for Volume {
    const NAME: &'static str = "volume";
    const TITLE: &'static str = "Volume";
    const SUMMARY: &'static str = "Tetrahedra resist changes of volume.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            compliance: Compliance, "Compliance", "m⁵/N",
            "Change of volume per pascal of pressure [m³/Pa]. 0: incompressible.",
            (1e-14, 1e-4), Scale::LogarithmicFromZero
        ),
        parameter!(
            bulk_modulus: Stiffness, "Bulk modulus", "Pa",
            "Bulk modulus K: pressure over relative change of volume, independent of the mesh. ∞: adds no compliance.",
            (1e2, 1e10), Scale::LogarithmicToInfinity
        ),
        parameter!(
            damping: Damping, "Damping", "s",
            "Damping time constant. 0 leaves only numerical damping.",
            (1e-4, 1.0), Scale::LogarithmicFromZero
        ),
        parameter!(
            repair: RepairTime, "Repair time", "s",
            "Time constant for recovering collapsed or inverted tetrahedra without adding velocity; ∞ disables recovery.",
            (0.01, 1.0), Scale::LogarithmicToInfinity
        ),
    ];

    elastic!(4, 1);
}
