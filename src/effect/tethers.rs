//! Tethers: long-range attachments to the nearest pin.

use super::{
    Effect, Figures, Parameter, Scale,
    elastic::{body_elements, body_figures},
    parameter,
};
use crate::{
    simulation::Pins,
    solver::{BodyEffectKind, Settings, Slack, Tethers, advance::Stage},
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

    type State = ();
    const STAGES: &'static [Stage] = &[Stage::Body(BodyEffectKind::Tethers)];

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }

    fn elements(&self, body: &EntityRef) -> usize {
        body_elements(BodyEffectKind::Tethers, body)
    }

    fn note(&self, body: &EntityRef, _: &Settings) -> Option<String> {
        let is_pinned = body.get::<Pins>().is_some_and(|pins| !pins.is_empty());
        (!is_pinned).then(|| "Tethers begin at pins, and the body has none.".to_owned())
    }

    fn figures(&self, body: &EntityRef, h: f32) -> Figures {
        Figures {
            energy: None,
            ..body_figures(BodyEffectKind::Tethers, body, h)
        }
    }
}
