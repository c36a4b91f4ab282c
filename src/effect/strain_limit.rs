//! Strain limit: no edge gets longer than a limit.

use super::{Effect, Parameter, Scale, elastic::elastic, parameter};
use crate::solver::{Strain, StrainLimit};

impl Effect for StrainLimit {
    const NAME: &'static str = "strain_limit";
    const TITLE: &'static str = "Strain limit";
    const SUMMARY: &'static str = "No edge gets longer than a limit, however heavy the load.";
    const PARAMETERS: &'static [Parameter<Self>] = &[parameter!(
        limit: Strain, "Limit", "",
        "The largest strain of an edge: 0.1 is a tenth longer than at rest.",
        (0.0, 1.0), Scale::Linear
    )];

    elastic!(2, 1);
}
