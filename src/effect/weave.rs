//! Weave: in-plane elasticity along warp, weft and bias.

use super::{Effect, Parameter, Scale, elastic::elastic, parameter};
use crate::solver::{Damping, MembraneCompliance, Weave};

impl Effect for Weave {
    const NAME: &'static str = "weave";
    const TITLE: &'static str = "Weave";
    const SUMMARY: &'static str = "In-plane elasticity of woven cloth, along warp, weft and bias.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            warp: MembraneCompliance, "Warp", "m/N",
            "Strain along the warp (x axis of the rest shape) per N/m of tension. 0: rigid.",
            (1e-6, 1.0), Scale::LogarithmicFromZero
        ),
        parameter!(
            weft: MembraneCompliance, "Weft", "m/N",
            "Strain along the weft (across the warp) per N/m of tension. 0: rigid.",
            (1e-6, 1.0), Scale::LogarithmicFromZero
        ),
        parameter!(
            bias: MembraneCompliance, "Bias", "m/N",
            "Shear angle between warp and weft, in radians, per N/m of shear force. 0: rigid.",
            (1e-6, 1.0), Scale::LogarithmicFromZero
        ),
        parameter!(
            damping: Damping, "Damping", "s",
            "Damping time constant of in-plane strain. 0 leaves only numerical damping.",
            (1e-4, 1.0), Scale::LogarithmicFromZero
        ),
    ];

    elastic!(3, 3);
}
