//! External forces of a body. They act before the first stage, each changing velocities by its
//! acceleration over a substep: v += h a(x, v, t), with v at the end of the substep where it depends on
//! that, times the weight of the particle where the body
//! carries a [`ForceMask`](crate::ForceMask).
//!
//! Each has one formula, in `f64`, shared by the fast solver and the reference; tests compare it
//! with closed forms. A body is processed on one thread. Most forces are cheap compared with
//! constraints. Gusts are not: they are evaluated per triangle and substep, though they remember
//! the cells of their noise.

pub(crate) mod attract;
pub(crate) mod axis;
pub(crate) mod drag;
pub(crate) mod law;
pub(crate) mod mask;
mod noise;
pub(crate) mod stream;
pub(crate) mod turbulence;
pub(crate) mod uniform;
pub(crate) mod vortex;
pub(crate) mod wind;

pub use law::{Force, Load, Moment, Mote, VisitForces};

use crate::{
    Attract, Axis, Drag, Effects, ForceKind, Stream, Topology, Turbulence, Uniform, Vortex, Wind,
    particles::Part,
};
use glam::Vec4;
use std::cell::Cell;

/// Applies a force to the particles of a body, each by its weight from 0 to 1.
fn on_particles(
    force: &impl Force,
    weight: impl Fn(u32) -> f64,
    (topology, moment): (&Topology, Moment),
    loads: &mut Vec<Load>,
    part: Part,
) {
    let Part {
        positions,
        displacements,
        carry,
        ..
    } = part;
    let wide = |x: Vec4| x.truncate().as_dvec3();
    let displacements = Cell::from_mut(displacements).as_slice_of_cells();
    let carry = Cell::from_mut(carry).as_slice_of_cells();
    let at = |i: u32| {
        let i = i as usize;
        let (x, c) = (positions[i], wide(carry[i].get()));
        Mote {
            x: wide(x) + c,
            v: (wide(displacements[i].get()) - c) / moment.h,
            w: x.w.into(),
        }
    };
    force.act(topology, moment, at, loads, |i, change| {
        let weight = weight(i);
        if positions[i as usize].w > 0.0 && weight > 0.0 {
            let (u, c) = (&displacements[i as usize], &carry[i as usize]);
            let now = wide(u.get()) + change * weight * moment.h;
            u.set(now.as_vec3().extend(0.0));
            // The rounding error of u is not lost to the velocity, as in the first stage.
            let lost = now - wide(u.get());
            c.set((wide(c.get()) - lost).as_vec3().extend(0.0));
        }
    });
}

impl Effects {
    /// Weight with which force fields act on each particle, from 0 to 1: that of the
    /// [`ForceMask`](crate::ForceMask), 1 without one.
    pub(crate) fn force_weights<'a>(
        &self,
        topology: &'a Topology,
    ) -> impl Fn(u32) -> f64 + use<'a> {
        let mask = self.force_mask.map(|mask| mask.weights(topology));
        move |i| mask.as_ref().map_or(1.0, |weight| weight(i))
    }
}

/// Generates the code for forces.
macro_rules! forces {
    (
        { forces { $($force:ident $field:ident $does:literal;)* } $($others:tt)* }
        $($rest:tt)*
    ) => {
        impl Effects {
            /// Whether the force acts on the body.
            #[must_use]
            pub fn has_force(&self, kind: ForceKind) -> bool {
                match kind {
                    $(ForceKind::$force => self.$field.is_some(),)*
                }
            }

            /// Visits all forces in order.
            pub fn visit_forces(&self, visitor: &mut impl VisitForces) {
                $(if let Some(force) = &self.$field {
                    visitor.visit(force);
                })*
            }

            /// Applies one of the forces.
            pub(crate) fn push(
                &self,
                kind: ForceKind,
                at: (&Topology, Moment),
                loads: &mut Vec<Load>,
                part: Part,
            ) {
                match kind {
                    $(ForceKind::$force => match (&self.$field, &self.force_mask) {
                        (Some(force), None) => on_particles(force, |_| 1.0, at, loads, part),
                        (Some(force), Some(mask)) => {
                            on_particles(force, mask.weights(at.0), at, loads, part);
                        }
                        (None, _) => {}
                    },)*
                }
            }
        }

        $(impl From<$force> for Effects {
            fn from(force: $force) -> Self {
                Self {
                    $field: Some(force),
                    ..Self::default()
                }
            }
        })*
    };
}

crate::effects!(forces);
