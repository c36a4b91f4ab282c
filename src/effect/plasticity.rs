//! Plasticity: strain beyond the yield strain becomes permanent.

use super::{Effect, Figures, Parameter, Scale, parameter};
use crate::{
    simulation::{SoftBody, plain},
    solver::{Creep, PlasticLimit, Plasticity, Yield, advance::Stage},
};
use bevy::prelude::*;

impl Effect for Plasticity {
    const NAME: &'static str = "plasticity";
    const TITLE: &'static str = "Plasticity";
    const SUMMARY: &'static str = "Strain beyond the yield strain becomes permanent.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            stretch_yield: Yield, "Yield (edges)", "",
            "Yield strain of edges: 0.05 is an extension or compression of 5 %.",
            (1e-3, 1.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            bend_yield: Yield, "Yield (bending)", "1/m",
            "Yield curvature of the surface. A sheet of thickness t is strained by t/2 times this value.",
            (0.1, 100.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            volume_yield: Yield, "Yield (volume)", "",
            "Yield strain of tetrahedra: relative change of volume.",
            (1e-3, 1.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            creep: Creep, "Creep rate", "1/s",
            "Rate of plastic flow: the excess of a held strain decays with the time constant 1/rate. ∞: at once.",
            (0.01, 1e3), Scale::LogarithmicToInfinity
        ),
        parameter!(
            stretch_limit: PlasticLimit, "Limit (edges)", "",
            "Max. plastic strain of edges: largest relative change of a rest length.",
            (1e-2, 10.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            bend_limit: PlasticLimit, "Limit (bending)", "1/m",
            "Max. plastic curvature: largest change of the rest curvature.",
            (0.1, 1e3), Scale::LogarithmicToInfinity
        ),
        parameter!(
            volume_limit: PlasticLimit, "Limit (volume)", "",
            "Max. plastic strain of tetrahedra: largest relative change of a rest volume.",
            (1e-2, 10.0), Scale::LogarithmicToInfinity
        ),
    ];

    type State = ();
    const STAGES: &'static [Stage] = &[Stage::Flow];

    fn when_added() -> Option<Self> {
        Some(Self::typical())
    }

    fn figures(&self, body: &EntityRef, _h: f32) -> Figures {
        let topology = body.get::<SoftBody>();
        let count = |topology: &SoftBody| self.elements(&plain::effects(*body), topology);
        Figures {
            elements: topology.map_or(0, count),
            ..Figures::default()
        }
    }
}
