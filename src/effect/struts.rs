//! Struts: springs through the body hold it open.

use super::{Effect, Parameter, Scale, elastic::elastic, parameter};
use crate::solver::{Compliance, Damping, Struts};

impl Effect for Struts {
    const NAME: &'static str = "struts";
    const TITLE: &'static str = "Struts";
    const SUMMARY: &'static str = "Springs between opposite points of the surface hold it open.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            compliance: Compliance, "Compliance", "m/N",
            "How far a strut gives under a newton; 0 is rigid.",
            (1e-6, 1.0), Scale::LogarithmicFromZero
        ),
        parameter!(
            damping: Damping, "Damping", "s",
            "The time over which a change of length dies away; 0 is none but the integrator's own.",
            (1e-4, 1.0), Scale::LogarithmicFromZero
        ),
    ];

    elastic!(2, 1);
}
