//! What follows from the kind of an elastic effect and its type.

use super::{
    Effects, Multipliers,
    elastic::{self, Elastic, ElasticKind, Visit},
};
use crate::{particles::Part, quantity::Damping, topology::Topology};

/// Makes what elastic effects need one line each for.
macro_rules! of_elastic_effects {
    (
        {
            forces { $($force:tt)* }
            solvers { $($solver:tt)* }
            elastic { $($effect:ident $field:ident ($corners:literal, $rows:literal) $does:literal;)* }
            $($others:tt)*
        }
        $($rest:tt)*
    ) => {
        impl ElasticKind {
            /// The unit of its compliance.
            #[must_use]
            pub const fn unit(self) -> &'static str {
                match self {
                    $(Self::$effect => <crate::$effect as Elastic<$corners, $rows>>::UNIT,)*
                }
            }

            /// How many elements it has on a body.
            #[must_use]
            pub fn elements(self, topology: &Topology) -> usize {
                match self {
                    $(Self::$effect => <crate::$effect as Elastic<$corners, $rows>>::elements(topology).corners().len(),)*
                }
            }

            /// How many multipliers it has on a body.
            #[must_use]
            pub fn multipliers(self, topology: &Topology) -> usize {
                let rows = match self {
                    $(Self::$effect => $rows,)*
                };
                rows * self.elements(topology)
            }
        }

        impl Effects {
            /// Whether the effect is carried.
            #[must_use]
            pub fn has(&self, kind: ElasticKind) -> bool {
                match kind {
                    $(ElasticKind::$effect => self.$field.is_some(),)*
                }
            }

            /// τ of an effect; `None` if it is not carried.
            #[must_use]
            pub fn damping(&self, kind: ElasticKind) -> Option<Damping> {
                match kind {
                    $(ElasticKind::$effect => self.$field.map(|effect| effect.damping()),)*
                }
            }

            /// Shows all elastic effects to a visitor, in their order.
            pub fn visit(&self, visitor: &mut impl Visit) {
                $(if let Some(effect) = &self.$field {
                    visitor.visit(effect);
                })*
            }
        }

        /// One sweep over all constraints of one elastic effect of a body, on one thread, with
        /// substeps of `h` seconds. Does nothing if it is not among the effects.
        pub(crate) fn sweep_kind(
            (effects, kind): (&Effects, ElasticKind),
            topology: &Topology,
            h: f32,
            part: Part,
            multipliers: Multipliers,
        ) {
            match kind {
                $(ElasticKind::$effect => if let Some(effect) = &effects.$field {
                    elastic::sweep(effect, topology, h, part, multipliers);
                },)*
            }
        }

        $(impl From<crate::$effect> for Effects {
            fn from(effect: crate::$effect) -> Self {
                Self {
                    $field: Some(effect),
                    ..Self::default()
                }
            }
        })*
    };
}

crate::effects!(of_elastic_effects);
