//! Common code of the elastic effects: their stage and their figures.

use super::Figures;
use crate::{
    simulation::{SoftBody, plain::effects},
    solver::{
        BodyEffectKind, EffectStates, ElasticKind, Particles, advance::Stage,
        effects::elastic::Elastic, measure,
    },
};
use bevy::prelude::*;

/// One iteration over the constraints of an effect.
pub(super) const fn stages<const N: usize, const M: usize, E: Elastic<N, M>>() -> &'static [Stage] {
    const { &[Stage::Elastic(E::KIND)] }
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
    let all = measure::element_figures(effect, topology, particles, multipliers, h);
    Figures {
        elements: E::KIND.elements(topology),
        energy: Some(all.energy),
        unresolved: all.unresolved,
        residual: all.residual,
        ..Figures::default()
    }
}

/// Number of elements of an elastic effect on a body.
pub(super) fn elements(kind: ElasticKind, body: &EntityRef) -> usize {
    body.get::<SoftBody>()
        .map_or(0, |topology| kind.elements(topology))
}

/// Reason why an elastic effect cannot act on a body: it has nothing of the kind.
pub(super) fn unfit(kind: ElasticKind, body: &EntityRef) -> Option<String> {
    let topology = body.get::<SoftBody>()?;
    (kind.elements(topology) == 0).then(|| {
        format!(
            "there is nothing for it to act on; the body has {} edges, {} triangles and {} tetrahedra",
            topology.edges.ends().len(),
            topology.triangles.len(),
            topology.tetrahedra.corners().len(),
        )
    })
}

/// Number of elements of another effect on a body.
pub(super) fn body_elements(kind: BodyEffectKind, body: &EntityRef) -> usize {
    let parts = body.get::<SoftBody>().zip(body.get::<EffectStates>());
    let effects = effects(*body);
    parts.map_or(0, |(topology, states)| {
        states.others.elements((&effects, kind), topology)
    })
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
        elements: body_elements(kind, body),
        energy: Some(measure::body_effect_energy(
            effect,
            topology,
            (particles, states),
        )),
        residual: states.others.residual(effect, topology, particles, h),
        overpressure: states.others.pressure.overpressure(h),
        ..Figures::default()
    }
}

/// The part of [`Effect`] that is common to all elastic effects with a given number of particles
/// and equations per element.
macro_rules! elastic {
    ($corners:literal, $rows:literal) => {
        type State = ();
        const STAGES: &'static [crate::solver::advance::Stage] =
            super::elastic::stages::<$corners, $rows, Self>();

        fn when_added() -> Option<Self> {
            Some(Self::default())
        }

        fn unfit(body: &bevy::prelude::EntityRef, _: &crate::solver::Settings) -> Option<String> {
            use crate::solver::effects::elastic::Elastic;
            super::elastic::unfit(Self::KIND, body)
        }

        fn elements(&self, body: &bevy::prelude::EntityRef) -> usize {
            use crate::solver::effects::elastic::Elastic;
            super::elastic::elements(Self::KIND, body)
        }

        fn figures(&self, body: &bevy::prelude::EntityRef, h: f32) -> super::Figures {
            super::elastic::figures(self, body, h)
        }
    };
}
pub(super) use elastic;
