//! Shape matching: particles are drawn to where the rest shape would have them.

use super::{Effect, Figures, Parameter, Scale, parameter};
use crate::{
    simulation::{Multipliers, SoftBody},
    solver::{
        Damping, Frequency, Matching, Particles, RegionSize, ShapeMatching, advance::Stage,
        effects::shape_matching::Place,
    },
};
use bevy::prelude::*;

impl Effect for ShapeMatching {
    const NAME: &'static str = "shape_matching";
    const TITLE: &'static str = "Shape matching";
    const SUMMARY: &'static str =
        "Particles are drawn to where the rest shape would have them, as a whole or in regions.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            frequency: Frequency, "Frequency", "Hz",
            "How often a second a deformed body swings about its shape; ∞ is rigid.",
            (0.1, 100.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            region: RegionSize, "Region", "m",
            "Size of the overlapping parts whose shapes are matched: small ones let a body bend; ∞ is the whole body.",
            (0.01, 10.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            damping: Damping, "Damping", "s",
            "The time over which a deformation dies away; 0 is none but the integrator's own.",
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
            found = Matching::of(topology, self);
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
