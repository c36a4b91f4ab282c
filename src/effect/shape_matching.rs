//! Shape matching: pulls particles towards the rest shape, rotated and moved to fit them best.

use super::{
    Effect, Figures, Parameter, Scale,
    elastic::{body_elements, body_figures},
    parameter,
};
use crate::solver::{
    BodyEffectKind, Damping, Frequency, RegionSize, ShapeMatching, advance::Stage,
};
use bevy::prelude::*;

impl Effect for ShapeMatching {
    const NAME: &'static str = "shape_matching";
    const TITLE: &'static str = "Shape matching";
    const SUMMARY: &'static str = "Pulls particles towards the fitted rest shape, of the whole body or of overlapping regions.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            frequency: Frequency, "Frequency", "Hz",
            "Natural frequency of the oscillation about the fitted shape. ∞: rigid.",
            (0.1, 100.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            region: RegionSize, "Region size", "m",
            "Size of the overlapping regions that are fitted. Small regions let the body bend. ∞: the whole body.",
            (0.01, 10.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            damping: Damping, "Damping", "s",
            "Damping time constant of deformation. 0 leaves only numerical damping.",
            (1e-4, 1.0), Scale::LogarithmicFromZero
        ),
    ];

    type State = ();
    const STAGES: &'static [Stage] = &[Stage::Body(BodyEffectKind::ShapeMatching)];

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }

    fn elements(&self, body: &EntityRef) -> usize {
        body_elements(BodyEffectKind::ShapeMatching, body)
    }

    fn figures(&self, body: &EntityRef, h: f32) -> Figures {
        body_figures(BodyEffectKind::ShapeMatching, body, h)
    }
}
