//! Direct solver: all elastic constraints of a body as one sparse system per iteration.

use super::{Effect, Parameter};
use crate::{
    simulation::{BodyDirectWorkspace, SoftBody, plain},
    solver::{Direct, Settings, advance::Stage, direct},
};
use bevy::prelude::*;

impl Effect for Direct {
    const NAME: &'static str = "direct";
    const TITLE: &'static str = "Direct solver";
    const SUMMARY: &'static str = "Solves all elastic constraints of the body as one sparse system per \
                                   iteration, for slender and stiff bodies that Gauss–Seidel leaves too soft.";
    const PARAMETERS: &'static [Parameter<Self>] = &[];

    type State = BodyDirectWorkspace;
    const STAGES: &'static [Stage] = &[Stage::Direct];

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }

    fn unfit(body: &EntityRef, settings: &Settings) -> Option<String> {
        let topology = &body.get::<SoftBody>()?.0;
        let effects = plain::effects(*body);
        direct::unfit(topology, &effects, settings.method).map(|reason| reason.to_string())
    }

    fn note(&self, body: &EntityRef, settings: &Settings) -> Option<&'static str> {
        if !settings.method.has_direct() {
            return Some("Fell back to Gauss–Seidel: the direct solver needs the method XPBD.");
        }
        body.get::<BodyDirectWorkspace>()?.0.status().explanation()
    }
}
