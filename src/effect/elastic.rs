//! Common code of the elastic effects: their stage and their figures.

use super::Figures;
use crate::{
    simulation::{SoftBody, plain::effects},
    solver::{BodyEffectKind, EffectStates, Particles, advance::Stage, elastic::Elastic, measure},
};
use bevy::prelude::*;

/// One iteration over the constraints of an effect.
pub(super) const fn stage<const N: usize, const M: usize, E: Elastic<N, M>>() -> Option<Stage> {
    Some(Stage::Elastic(E::KIND))
}

/// Figures of the effect on a body, after a substep of `h` seconds.
pub(super) fn figures<const N: usize, const M: usize, E: Elastic<N, M>>(
    effect: &E,
    body: &EntityRef,
    h: f32,
) -> Figures {
    let (Some(topology), Some(particles)) = (body.get::<SoftBody>(), body.get::<Particles>())
    else {
        return Figures::default();
    };
    let h = particles.history.seconds(h.into()) as f32;
    let multipliers = body
        .get::<EffectStates>()
        .map_or(&[][..], |states| states.multipliers(E::KIND));
    Figures {
        elements: E::KIND.elements(topology),
        energy: Some(measure::elastic_energy(effect, topology, particles)),
        residual: measure::residual(effect, topology, particles, multipliers, h),
        ..Figures::default()
    }
}

/// Figures of an effect without elements on a body, after a substep of `h` seconds.
pub(super) fn body_figures(kind: BodyEffectKind, body: &EntityRef, h: f32) -> Figures {
    let (Some(topology), Some(particles), Some(states)) = (
        body.get::<SoftBody>(),
        body.get::<Particles>(),
        body.get::<EffectStates>(),
    ) else {
        return Figures::default();
    };
    let effects = effects(*body);
    let effect = (&effects, kind);
    let h = particles.history.seconds(h.into());
    Figures {
        elements: states.others.elements(effect, topology),
        energy: Some(measure::body_effect_energy(
            effect,
            topology,
            (particles, states),
        )),
        residual: states.others.residual(effect, topology, particles, h),
        overpressure: states.others.pressure.overpressure(h),
    }
}

/// The part of [`Effect`] that is common to all elastic effects with a given number of particles
/// and equations per element.
macro_rules! elastic {
    ($corners:literal, $rows:literal) => {
        type State = ();
        const STAGE: Option<crate::solver::advance::Stage> =
            super::elastic::stage::<$corners, $rows, Self>();

        fn when_added() -> Option<Self> {
            Some(Self::default())
        }

        fn figures(&self, body: &bevy::prelude::EntityRef, h: f32) -> super::Figures {
            super::elastic::figures(self, body, h)
        }
    };
}
pub(super) use elastic;
