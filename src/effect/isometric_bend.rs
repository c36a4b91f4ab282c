//! Isometric bend: bending stiffness by a quadratic energy.

use super::{Effect, Parameter, Scale, elastic::elastic, parameter};
use crate::solver::{Damping, FlexuralRigidity, IsometricBend};

impl Effect for IsometricBend {
    const NAME: &'static str = "isometric_bend";
    const TITLE: &'static str = "Isometric bend";
    const SUMMARY: &'static str = "Quadratic bending energy for flat, nearly inextensible cloth, at three quarters of the cost of Bend. Use one of the two.";
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
