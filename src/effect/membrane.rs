//! Membrane: isotropic in-plane elasticity of the surface triangles.

use super::{Effect, Parameter, Scale, elastic::elastic, parameter};
use crate::solver::{Damping, Membrane, PoissonRatio, Thickness, YoungsModulus};

impl Effect for Membrane {
    const NAME: &'static str = "membrane";
    const TITLE: &'static str = "Membrane";
    const SUMMARY: &'static str = "Isotropic in-plane elasticity of the surface triangles.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            youngs_modulus: YoungsModulus, "Young's modulus", "Pa",
            "Young's modulus E of the sheet: stress over strain in tension. ∞: rigid.",
            (1e3, 1e10), Scale::LogarithmicToInfinity
        ),
        parameter!(
            poisson_ratio: PoissonRatio, "Poisson's ratio ν", "",
            "Transverse contraction over axial extension.",
            (0.0, 0.499), Scale::Linear
        ),
        parameter!(
            thickness: Thickness, "Thickness", "m",
            "Thickness of the sheet. The stiffness is proportional to it; the mass does not change.",
            (1e-5, 1e-2), Scale::Linear
        ),
        parameter!(
            damping: Damping, "Damping", "s",
            "Damping time constant of in-plane strain. 0 leaves only numerical damping.",
            (1e-4, 1.0), Scale::LogarithmicFromZero
        ),
    ];

    elastic!(3, 3);
}
