//! Struts: springs through the body.

use super::{Effect, Parameter, Scale, elastic::elastic, parameter};
use crate::solver::{Compliance, Damping, Struts};

impl Effect for Struts {
    const NAME: &'static str = "struts";
    const TITLE: &'static str = "Struts";
    const SUMMARY: &'static str =
        "Springs between opposite points of the surface, which keep it from collapsing.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            compliance: Compliance, "Compliance", "m/N",
            "Extension of a strut per newton of force. 0: rigid.",
            (1e-6, 1.0), Scale::LogarithmicFromZero
        ),
        parameter!(
            damping: Damping, "Damping", "s",
            "Damping time constant. 0 leaves only numerical damping.",
            (1e-4, 1.0), Scale::LogarithmicFromZero
        ),
    ];

    elastic!(2, 1);
}
