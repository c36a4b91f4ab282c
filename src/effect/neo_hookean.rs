//! Neo-Hookean elasticity: tetrahedra of rubber.

use super::{Effect, Parameter, Scale, elastic::elastic, parameter};
use crate::solver::{Damping, NeoHookean, PoissonRatio, YoungsModulus};

impl Effect for NeoHookean {
    const NAME: &'static str = "neo_hookean";
    const TITLE: &'static str = "Neo-Hookean";
    const SUMMARY: &'static str =
        "Tetrahedra resist changes of shape and of volume as rubber does.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            youngs_modulus: YoungsModulus, "Young's modulus E", "Pa",
            "Tension over strain of a bar that is pulled, however finely it is divided: jelly has some 1e4, soft rubber 1e6; ∞ is rigid.",
            (1e3, 1e8), Scale::LogarithmicToInfinity
        ),
        parameter!(
            poisson_ratio: PoissonRatio, "Poisson's ratio ν", "",
            "By how much of its strain a bar that is pulled narrows: 0 not at all, 0.499 keeps its volume.",
            (0.0, 0.499), Scale::Linear
        ),
        parameter!(
            damping: Damping, "Damping", "s",
            "The time over which a strain dies away; 0 is none but the integrator's own.",
            (1e-4, 1.0), Scale::LogarithmicFromZero
        ),
    ];

    elastic!(4, 2);
}
