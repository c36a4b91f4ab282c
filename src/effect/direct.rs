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
        Some(Self)
    }

    fn unfit(body: &EntityRef, settings: &Settings) -> Option<String> {
        let topology = &body.get::<SoftBody>()?.0;
        let effects = plain::effects(*body);
        let workspace = body.get::<BodyDirectWorkspace>();
        if settings.method.has_direct()
            && workspace.is_some_and(|it| it.0.has_plan(topology, &effects))
        {
            return None;
        }
        direct::unfit(topology, &effects, settings.method).map(|reason| reason.to_string())
    }

    fn note(&self, body: &EntityRef, settings: &Settings) -> Option<String> {
        if !settings.method.has_direct() {
            let reason = "Fell back to Gauss–Seidel: the direct solver needs the method XPBD.";
            return Some(reason.to_owned());
        }
        let workspace = &body.get::<BodyDirectWorkspace>()?.0;
        workspace.status().explanation().map(str::to_owned)
    }
}
