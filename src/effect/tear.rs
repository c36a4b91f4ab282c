//! Tear: splits the body where a limit is exceeded.

use super::{Effect, Parameter, Scale, parameter};
use crate::{
    simulation::SoftBody,
    solver::{
        BreakingStrain, Force, Membrane, NeoHookean, PieceSize, Rod, Settings, Stretch, Tear,
        Toughness, Weave, advance::Stage,
    },
};
use bevy::prelude::*;

impl Effect for Tear {
    const NAME: &'static str = "tear";
    const TITLE: &'static str = "Tear";
    const SUMMARY: &'static str = "Splits the body where a limit is exceeded.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            toughness: Toughness, "Toughness", "J/m²",
            "Energy per area of a crack, independent of the mesh. J/m for a sheet, J per cut of a rope. ∞: no limit.",
            (1e-3, 1e6), Scale::LogarithmicToInfinity
        ),
        parameter!(
            force: Force, "Force", "N",
            "Tension at which an edge or a rod breaks. That of an edge depends on the mesh. ∞: no limit.",
            (1e-3, 1e6), Scale::LogarithmicToInfinity
        ),
        parameter!(
            strain: BreakingStrain, "Strain", "",
            "Largest strain at which an element breaks: 0.5 is half as long again. At the tip of a crack it depends on the mesh. ∞: no limit.",
            (1e-2, 10.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            smallest_piece: PieceSize, "Smallest piece", "elements",
            "Pieces with fewer elements are not torn off.",
            (1.0, 100.0), Scale::Logarithmic
        ),
    ];

    type State = ();
    const STAGES: &'static [Stage] = &[Stage::Tear];

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }

    fn unfit(body: &EntityRef, _: &Settings) -> Option<String> {
        let has_grains = !body.get::<SoftBody>()?.radii.is_empty();
        has_grains.then(|| "grains have no elements that could tear".to_owned())
    }

    fn note(&self, body: &EntityRef, _: &Settings) -> Option<String> {
        let (stretch, rod) = (body.get::<Stretch>(), body.get::<Rod>());
        if self.force.get().is_finite() && stretch.is_none() && rod.is_none() {
            let needs = "The force limits edges and rods, and the body has neither Stretch nor Rod: set a \
                         toughness or a strain.";
            return Some(needs.to_owned());
        }
        let has_elements = rod.is_some()
            || body.contains::<Membrane>()
            || body.contains::<Weave>()
            || body.contains::<NeoHookean>();
        let rigid = stretch.is_some_and(|it| it.compliance.get() == 0.0);
        (self.toughness.get().is_finite() && rigid && !has_elements).then(|| {
            "Rigid edges store no energy that a crack could take: set a force, or a compliance."
                .to_owned()
        })
    }
}
