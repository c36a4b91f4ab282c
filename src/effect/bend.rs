//! Bend: bending stiffness by dihedral angles.

use super::{Effect, Parameter, Scale, elastic::elastic, parameter};
use crate::solver::{Bend, Damping, FlexuralRigidity};

impl Effect for Bend {
    const NAME: &'static str = "bend";
    const TITLE: &'static str = "Bend";
    const SUMMARY: &'static str = "Resists changes of the dihedral angles of the surface.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            stiffness: FlexuralRigidity, "Stiffness", "N·m",
            "Flexural rigidity B of the sheet: moment per width over curvature, independent of the mesh. ∞: rigid.",
            (1e-7, 1e2), Scale::LogarithmicToInfinity
        ),
        parameter!(
            damping: Damping, "Damping", "s",
            "Damping time constant of bending. 0 leaves only numerical damping.",
            (1e-4, 1.0), Scale::LogarithmicFromZero
        ),
    ];

    elastic!(4, 1);
}
