//! Strain limit: an upper limit on the strain of edges.

use super::{Effect, Parameter, Scale, elastic::elastic, parameter};
use crate::solver::{Strain, StrainLimit};

impl Effect for StrainLimit {
    const NAME: &'static str = "strain_limit";
    const TITLE: &'static str = "Strain limit";
    const SUMMARY: &'static str = "Upper limit on the strain of edges, whatever the load.";
    const PARAMETERS: &'static [Parameter<Self>] = &[parameter!(
        limit: Strain, "Max. strain", "",
        "Largest strain of an edge: 0.1 allows an extension of 10 %.",
        (0.0, 1.0), Scale::Linear
    )];

    elastic!(2, 1);
}
