//! Membrane: triangles of the surface resist being strained, the same in all directions.

use super::{Effect, Parameter, Scale, elastic::elastic, parameter};
use crate::solver::{Damping, Membrane, PoissonRatio, Thickness, YoungsModulus};

impl Effect for Membrane {
    const NAME: &'static str = "membrane";
    const TITLE: &'static str = "Membrane";
    const SUMMARY: &'static str =
        "Triangles of the surface resist being strained, the same in all directions.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            youngs_modulus: YoungsModulus, "Young's modulus E", "Pa",
            "Stress over strain of the sheet where it is pulled; ∞ is rigid.",
            (1e3, 1e10), Scale::LogarithmicToInfinity
        ),
        parameter!(
            poisson_ratio: PoissonRatio, "Poisson's ratio ν", "",
            "How much narrower it gets where it is pulled, over how much longer.",
            (0.0, 0.499), Scale::Linear
        ),
        parameter!(
            thickness: Thickness, "Thickness", "m",
            "How thick the sheet is: twice as thick, twice as stiff. Its mass stays.",
            (1e-5, 1e-2), Scale::Linear
        ),
        parameter!(
            damping: Damping, "Damping", "s",
            "The time over which a strain dies away; 0 is none but the integrator's own.",
            (1e-4, 1.0), Scale::LogarithmicFromZero
        ),
    ];

    elastic!(3, 3);
}
