//! Neo-Hookean elasticity of tetrahedra.

use super::{Effect, Parameter, Scale, elastic::elastic, parameter};
use crate::solver::{Damping, NeoHookean, PoissonRatio, YoungsModulus};

impl Effect for NeoHookean {
    const NAME: &'static str = "neo_hookean";
    const TITLE: &'static str = "Neo-Hookean";
    const SUMMARY: &'static str =
        "Hyperelastic tetrahedra, as for rubber, with Young's modulus and Poisson's ratio.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            youngs_modulus: YoungsModulus, "Young's modulus", "Pa",
            "Young's modulus E at small strain, independent of the mesh: about 1e4 for jelly, 1e6 for soft rubber. ∞: rigid.",
            (1e3, 1e8), Scale::LogarithmicToInfinity
        ),
        parameter!(
            poisson_ratio: PoissonRatio, "Poisson's ratio ν", "",
            "Transverse contraction over axial extension: 0 does not contract, 0.499 is nearly incompressible.",
            (0.0, 0.499), Scale::Linear
        ),
        parameter!(
            damping: Damping, "Damping", "s",
            "Damping time constant of strain. 0 leaves only numerical damping.",
            (1e-4, 1.0), Scale::LogarithmicFromZero
        ),
    ];

    elastic!(4, 2);
}
