//! Bodies whose equilibrium cannot be found, and the reason.

use crate::{Body, Effects, Settings};

/// Reason why there is no equilibrium.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoEquilibrium {
    /// The method of the world has no compliances.
    #[error("the equilibrium search needs the method Xpbd")]
    Method,
    /// An effect whose force has no energy, is one-sided, or is not supported; its name.
    #[error("the effect `{0}` is not supported by the equilibrium search")]
    Effect(&'static str),
    /// The body has stitches.
    #[error("the body is stitched")]
    Stitched,
    /// The body has no pins.
    #[error("no particle is pinned")]
    Unpinned,
    /// The body has no load.
    #[error("no load acts on it")]
    Unloaded,
    /// The factorization would exceed the limit of multiplications.
    #[error("its factorization would take more than {} million multiplications", super::search::MAX_WORK / 1_000_000)]
    TooLarge,
    /// Newton's method did not converge.
    #[error("Newton's method stopped at a residual force of {residual:.1e} of the load")]
    NotFound {
        /// Residual force over applied force.
        residual: f64,
    },
    /// Rigid rows are not satisfied.
    #[error("a rigid constraint is violated by {violation:.1e} of its size")]
    Violated {
        /// Violation over rest length or volume.
        violation: f64,
    },
    /// Forces balance, but the equilibrium is unstable.
    #[error("its equilibrium is unstable")]
    Unstable,
}

/// Reason why the equilibrium of a body cannot be searched for, if any.
#[must_use]
pub fn refusal(body: &Body, settings: &Settings) -> Option<NoEquilibrium> {
    if settings.method.is_rigid() {
        return Some(NoEquilibrium::Method);
    }
    if let Some(name) = unknown(&body.effects) {
        return Some(NoEquilibrium::Effect(name));
    }
    if !body.stitches.is_empty() {
        return Some(NoEquilibrium::Stitched);
    }
    let mut weights = body.particles.positions.iter().map(|x| x.w);
    weights.all(|w| w > 0.0).then_some(NoEquilibrium::Unpinned)
}

/// An effect of the body that is not supported. The pattern names all effects, so that a new one
/// must be classified.
fn unknown(effects: &Effects) -> Option<&'static str> {
    let Effects {
        // Elastic effects with rows.
        stretch: _,
        bend: _,
        isometric_bend: _,
        volume: _,
        neo_hookean: _,
        membrane: _,
        weave: _,
        struts: _,
        // A constant force, and the part on which it acts.
        uniform: _,
        force_mask: _,
        // Solver selection.
        direct: _,
        attract,
        vortex,
        axis,
        stream,
        turbulence,
        wind,
        drag,
        strain_limit,
        shape_matching,
        rod,
        grains,
        tethers,
        pressure,
        plasticity,
        tear,
        emitter,
        body_emitter,
        sink,
        grab,
        contact,
        self_contact,
        ground,
        sticky_ground,
        collide,
    } = effects;
    let unknown = [
        (attract.is_some(), "attract"),
        (vortex.is_some(), "vortex"),
        (axis.is_some(), "axis"),
        (stream.is_some(), "stream"),
        (turbulence.is_some(), "turbulence"),
        (wind.is_some(), "wind"),
        (drag.is_some(), "drag"),
        (strain_limit.is_some(), "strain_limit"),
        (shape_matching.is_some(), "shape_matching"),
        (rod.is_some(), "rod"),
        (grains.is_some(), "grains"),
        (tethers.is_some(), "tethers"),
        (pressure.is_some(), "pressure"),
        (plasticity.is_some(), "plasticity"),
        (tear.is_some(), "tear"),
        (emitter.is_some(), "emitter"),
        (body_emitter.is_some(), "body_emitter"),
        (sink.is_some(), "sink"),
        (grab.is_some(), "grab"),
        (contact.is_some(), "contact"),
        (self_contact.is_some(), "self_contact"),
        (ground.is_some(), "ground"),
        (sticky_ground.is_some(), "sticky_ground"),
        (collide.is_some(), "collide"),
    ];
    let mut carried = unknown.into_iter().filter(|(carried, _)| *carried);
    carried.next().map(|(_, name)| name)
}
