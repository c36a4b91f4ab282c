//! Tethers: long-range attachments to the nearest pin.

use super::{Effect, Figures, Parameter, Scale, parameter};
use crate::{
    simulation::TetherLeads,
    solver::{Particles, Slack, Tethers, advance::Stage},
};
use bevy::prelude::*;

impl Effect for Tethers {
    const NAME: &'static str = "tethers";
    const TITLE: &'static str = "Tethers";
    const SUMMARY: &'static str = "Limits each particle's distance from its nearest pin to the geodesic rest distance (long-range attachments).";
    const PARAMETERS: &'static [Parameter<Self>] = &[parameter!(
        slack: Slack, "Slack", "",
        "Slack of the tethers, as a fraction of the geodesic rest distance.",
        (0.0, 0.5), Scale::Linear
    )];

    type State = TetherLeads;
    const STAGE: Option<Stage> = Some(Stage::Tethers);

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }

    fn figures(&self, body: &EntityRef, _h: f32) -> Figures {
        let (Some(tether_targets), Some(particles)) =
            (body.get::<TetherLeads>(), body.get::<Particles>())
        else {
            return Figures::default();
        };
        Figures {
            elements: tether_targets.0.count(),
            residual: tether_targets.0.residual(&particles.positions, self),
            ..Figures::default()
        }
    }
}
