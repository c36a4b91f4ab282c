//! Maps kinds of elastic effects to their types.

use super::{
    Multipliers,
    elastic::{self, Elastic, Visit},
};
use crate::{Effects, ElasticKind, Topology, particles::Part, quantity::Damping};

/// Generates the code for elastic effects.
macro_rules! of_elastic_effects {
    (
        {
            forces { $($force:tt)* }
            masks { $($mask:tt)* }
            solvers { $($solver:tt)* }
            elastic { $($effect:ident $field:ident ($corners:literal, $rows:literal) $does:literal;)* }
            $($others:tt)*
        }
        $($rest:tt)*
    ) => {
        impl ElasticKind {
            /// Unit of its compliance.
            #[must_use]
            pub const fn unit(self) -> &'static str {
                match self {
                    $(Self::$effect => <crate::$effect as Elastic<$corners, $rows>>::UNIT,)*
                }
            }

            /// Number of elements on a body.
            #[must_use]
            pub fn elements(self, topology: &Topology) -> usize {
                match self {
                    $(Self::$effect => <crate::$effect as Elastic<$corners, $rows>>::elements(topology).corners().len(),)*
                }
            }

            /// Number of patterns of its elements on a body in strips.
            pub(crate) fn patterns(self, topology: &Topology) -> usize {
                match self {
                    $(Self::$effect => <crate::$effect as Elastic<$corners, $rows>>::elements(topology).pattern_count(),)*
                }
            }

            /// Number of multipliers on a body.
            #[must_use]
            pub fn multipliers(self, topology: &Topology) -> usize {
                let rows = match self {
                    $(Self::$effect => $rows,)*
                };
                rows * self.elements(topology)
            }
        }

        impl Effects {
            /// Whether the effect is present.
            #[must_use]
            pub fn has(&self, kind: ElasticKind) -> bool {
                match kind {
                    $(ElasticKind::$effect => self.$field.is_some(),)*
                }
            }

            /// τ of an effect; `None` if it is absent.
            #[must_use]
            pub fn damping(&self, kind: ElasticKind) -> Option<Damping> {
                match kind {
                    $(ElasticKind::$effect => self.$field.map(|effect| effect.damping()),)*
                }
            }

            /// Visits one elastic effect, if it is present.
            pub(crate) fn visit_one(&self, kind: ElasticKind, visitor: &mut impl Visit) {
                match kind {
                    $(ElasticKind::$effect => if let Some(effect) = &self.$field {
                        visitor.visit(effect);
                    },)*
                }
            }

            /// Visits all elastic effects, in the order of the table.
            pub fn visit(&self, visitor: &mut impl Visit) {
                $(if let Some(effect) = &self.$field {
                    visitor.visit(effect);
                })*
            }
        }

        /// One iteration over all constraints of one elastic effect of a body, on one thread, with
        /// substeps of `h` seconds. Does nothing if it is not among the effects.
        pub(crate) fn iterate_kind(
            (effects, kind): (&Effects, ElasticKind),
            topology: &Topology,
            h: f32,
            part: Part,
            multipliers: Multipliers,
        ) {
            match kind {
                $(ElasticKind::$effect => if let Some(effect) = &effects.$field {
                    elastic::iterate(effect, topology, h, part, multipliers);
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
