//! The effects that an entity carries, as the solver has them.

use crate::solver::{self, Effects};
use bevy::{ecs::query::QueryData, prelude::*};

/// Takes the components of all effects of the crate together.
macro_rules! carried {
    (
        { $($first:ident { $($kind1:ident $field1:ident $(($($numbers:tt)*))? $does1:literal;)* })* }
        $stitches:ident $stitched:ident
        { $($second:ident { $($kind2:ident $field2:ident $does2:literal;)* })* }
        $grab:ident $grabbed:ident
        { $($third:ident { $($kind3:ident $field3:ident $does3:literal;)* })* }
    ) => {
        carried! {
            $($($field1: solver::$kind1,)*)*
            $($($field2: solver::$kind2,)*)*
            $grabbed: solver::$grab,
            $($($field3: solver::$kind3,)*)*
        }
    };
    ($($effect:ident: $component:ty,)*) => {
        /// The names of the effects of the crate, which a plain world and a snapshot have a place for.
        pub const CARRIED: &[&str] = &[$(stringify!($effect),)*];

        /// The effects of the crate that an entity carries.
        #[derive(QueryData)]
        pub(crate) struct Carried {
            $($effect: Option<&'static $component>,)*
        }

        impl CarriedItem<'_, '_> {
            /// Whether the body can touch others or itself.
            pub fn can_touch(&self) -> bool {
                self.contact.is_some() || self.self_contact.is_some()
            }

            /// Copies of them.
            pub fn effects(&self) -> Effects {
                Effects {
                    $($effect: self.$effect.copied(),)*
                }
            }
        }

        /// The effects of the crate that an entity carries.
        #[must_use]
        pub fn effects(entity: EntityRef) -> Effects {
            Effects {
                $($effect: entity.get::<$component>().copied(),)*
            }
        }

        /// Gives an entity these effects.
        pub(super) fn insert_effects(entity: &mut EntityWorldMut, effects: &Effects) {
            let Effects { $($effect,)* } = *effects;
            $(if let Some(effect) = $effect {
                entity.insert(effect);
            })*
        }
    };
}

solver::effects!(carried);
