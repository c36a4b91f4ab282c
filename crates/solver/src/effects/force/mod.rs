//! External forces of a body. They act before the first stage, each changing velocities by its
//! acceleration over a substep: v += h a(x, v, t), with v at the end of the substep where it depends on
//! that, times the weight of the particle where the body
//! carries a [`ForceMask`](crate::ForceMask).
//!
//! Each has one formula, shared by the fast solver and the reference; tests compare it with closed forms.
//! A [`Field`], whose force on a particle depends on this one alone, acts in lanes, in single precision, and
//! wind on triangles does. The others are evaluated in double precision, on one thread. Gusts are dear: they are evaluated per triangle and substep, though
//! they remember the cells of their noise.

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

pub use law::{Field, Force, ForcedBody, Moment, Mote, VisitForces};

use crate::{
    Attract, Axis, Drag, Effects, ForceKind, Instructions, Stream, Topology, Turbulence, Uniform,
    Vortex, Wind, kernel::each::InLanes, particles::Part,
};

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

            /// Whether the force acts on each particle by itself, also [in
            /// lanes](Self::push_in_lanes).
            pub(crate) fn pushes_in_lanes(&self, kind: ForceKind) -> bool {
                self.force_mask.is_none_or(|mask| mask.is_whole()) && match kind {
                    $(ForceKind::$force => <$force as Force>::IS_FIELD,)*
                }
            }

            /// Applies such a force to particles in lanes.
            pub(crate) fn push_in_lanes(
                &self,
                kind: ForceKind,
                moment: &Moment,
                particles: &mut impl InLanes,
                instructions: Instructions,
            ) {
                match kind {
                    $(ForceKind::$force => if let Some(force) = &self.$field {
                        force.act_in_lanes(moment, particles, instructions);
                    },)*
                }
            }

            /// Applies such a force to the particles of a piece.
            pub(crate) fn push_on(
                &self,
                kind: ForceKind,
                moment: &Moment,
                part: Part,
                instructions: Instructions,
            ) {
                match kind {
                    $(ForceKind::$force => if let Some(force) = &self.$field {
                        force.act_on(moment, part, instructions);
                    },)*
                }
            }

            /// Applies one of the other forces to the whole body.
            pub(crate) fn push(
                &self,
                kind: ForceKind,
                body: ForcedBody,
            ) {
                match kind {
                    $(ForceKind::$force => match (&self.$field, &self.force_mask) {
                        (Some(force), None) => force.act_on_body(|_| 1.0, body),
                        (Some(force), Some(mask)) => {
                            force.act_on_body(mask.weights(body.topology), body);
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
