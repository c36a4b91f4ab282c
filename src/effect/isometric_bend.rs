//! Isometric bend: hinges resist bending by a quadratic energy.

use super::{Effect, Parameter, Scale, elastic::elastic, parameter};
use crate::solver::{Damping, FlexuralRigidity, IsometricBend};

impl Effect for IsometricBend {
    const NAME: &'static str = "isometric_bend";
    const TITLE: &'static str = "Isometric bend";
    const SUMMARY: &'static str = "Bending at three quarters of the cost, for flat cloth that hardly stretches; instead of Bend.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            stiffness: FlexuralRigidity, "Stiffness", "N·m",
            "Flexural rigidity B of the sheet: moment by width over curvature, however finely it is divided; ∞ never bends.",
            (1e-7, 1e2), Scale::LogarithmicToInfinity
        ),
        parameter!(
            damping: Damping, "Damping", "s",
            "The time over which a bend dies away; 0 is none but the integrator's own.",
            (1e-4, 1.0), Scale::LogarithmicFromZero
        ),
    ];

    elastic!(4, 1);
}
