//! Plasticity: what is strained beyond a yield strain stays so.

use super::{Effect, Figures, Parameter, Scale, parameter};
use crate::{
    simulation::{SoftBody, plain},
    solver::{Creep, PlasticLimit, Plasticity, Yield, advance::Stage},
};
use bevy::prelude::*;

impl Effect for Plasticity {
    const NAME: &'static str = "plasticity";
    const TITLE: &'static str = "Plasticity";
    const SUMMARY: &'static str = "What is strained beyond a yield strain stays so.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            stretch_yield: Yield, "Edges yield at", "",
            "Strain of an edge beyond which it flows: 0.05 is a twentieth longer or shorter.",
            (1e-3, 1.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            bend_yield: Yield, "Bends yield at", "1/m",
            "Change of curvature of the surface beyond which it flows; a sheet of thickness t is strained by half of t times this.",
            (0.1, 100.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            volume_yield: Yield, "Volumes yield at", "",
            "Change of volume of a tetrahedron, as a share of it, beyond which it flows.",
            (1e-3, 1.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            creep: Creep, "Creep", "1/s",
            "How fast what is strained too far flows: a held strain loses all but 37 % of its excess in the inverse of this.",
            (0.01, 1e3), Scale::LogarithmicToInfinity
        ),
        parameter!(
            stretch_limit: PlasticLimit, "Edges flow up to", "",
            "By how much a rest length may change at most, as a share of what it was.",
            (1e-2, 10.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            bend_limit: PlasticLimit, "Bends flow up to", "1/m",
            "By how much the curvature at rest may change at most.",
            (0.1, 1e3), Scale::LogarithmicToInfinity
        ),
        parameter!(
            volume_limit: PlasticLimit, "Volumes flow up to", "",
            "By how much a rest volume may change at most, as a share of what it was.",
            (1e-2, 10.0), Scale::LogarithmicToInfinity
        ),
    ];

    type State = ();
    const STAGE: Option<Stage> = Some(Stage::Flow);

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
