//! Weave: triangles of the surface resist being strained along warp, weft and bias.

use super::{Effect, Parameter, Scale, elastic::elastic, parameter};
use crate::solver::{Damping, MembraneCompliance, Weave};

impl Effect for Weave {
    const NAME: &'static str = "weave";
    const TITLE: &'static str = "Weave";
    const SUMMARY: &'static str =
        "Triangles of the surface resist being strained along the threads of a cloth.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            warp: MembraneCompliance, "Warp", "m/N",
            "Strain along the rest shape's x axis, for a tension of 1 N a metre of width; 0 is rigid.",
            (1e-6, 1.0), Scale::LogarithmicFromZero
        ),
        parameter!(
            weft: MembraneCompliance, "Weft", "m/N",
            "Strain across the warp, for a tension of 1 N a metre of width; 0 is rigid.",
            (1e-6, 1.0), Scale::LogarithmicFromZero
        ),
        parameter!(
            bias: MembraneCompliance, "Bias", "m/N",
            "Angle by which the threads shear, in radians, for 1 N a metre of width; 0 is rigid.",
            (1e-6, 1.0), Scale::LogarithmicFromZero
        ),
        parameter!(
            damping: Damping, "Damping", "s",
            "The time over which a strain dies away; 0 is none but the integrator's own.",
            (1e-4, 1.0), Scale::LogarithmicFromZero
        ),
    ];

    elastic!(3, 3);
}
