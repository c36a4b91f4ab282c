//! Shape matching: particles are pulled towards the rest shape, fitted to where they are.

use super::{Effect, Figures, Parameter, Scale, parameter};
use crate::{
    simulation::{Multipliers, SoftBody},
    solver::{
        Damping, Frequency, Particles, RegionSize, ShapeMatching, ShapeMatchingState,
        advance::Stage, effects::shape_matching::Place,
    },
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
    const STAGE: Option<Stage> = Some(Stage::ShapeMatching);

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }

    fn figures(&self, body: &EntityRef, h: f32) -> Figures {
        let (Some(topology), Some(particles), Some(multipliers)) = (
            body.get::<SoftBody>(),
            body.get::<Particles>(),
            body.get::<Multipliers>(),
        ) else {
            return Figures::default();
        };
        let h = particles.history.seconds(h.into());
        let at = || Place::among(particles);
        let known = multipliers.0.matching.as_deref();
        let known = known.filter(|known| known.is_of(topology, self));
        let found;
        // Before the first substep after a change nobody has looked for them.
        let matching = if let Some(known) = known {
            known
        } else {
            found = ShapeMatchingState::of(topology, self);
            &found
        };
        Figures {
            elements: matching.regions().count(),
            energy: Some(matching.energy(topology, self, at())),
            residual: matching.residual(topology, self, h, at()),
            ..Figures::default()
        }
    }
}
