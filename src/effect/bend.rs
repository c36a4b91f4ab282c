//! Bend: hinges resist a change of their angle.

use super::{Effect, Parameter, Scale, elastic::elastic, parameter};
use crate::solver::{Bend, Damping, FlexuralRigidity};

impl Effect for Bend {
    const NAME: &'static str = "bend";
    const TITLE: &'static str = "Bend";
    const SUMMARY: &'static str = "Hinges of the surface resist a change of their angle.";
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
