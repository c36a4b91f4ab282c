//! Direct solution: all that holds a body together is solved as one system, not by sweeps.

use super::{Effect, Parameter};
use crate::{
    simulation::{DirectFactors, SoftBody, plain},
    solver::{Direct, NeoHookean, Settings, advance::Stage, direct},
};
use bevy::prelude::*;

impl Effect for Direct {
    const NAME: &'static str = "direct";
    const TITLE: &'static str = "Direct solution";
    const SUMMARY: &'static str = "Solves all that holds the body together as one system, for slender \
                                   and stiff bodies that sweeps leave too soft.";
    const PARAMETERS: &'static [Parameter<Self>] = &[];

    type State = DirectFactors;
    const STAGE: Option<Stage> = Some(Stage::Direct);

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
            return Some("Swept, not solved: only XPBD is solved directly.");
        }
        if body.contains::<NeoHookean>() {
            return Some("Neo-Hookean tetrahedra are swept, not solved.");
        }
        body.get::<DirectFactors>()?.0.done().why_swept()
    }
}
