//! The effects of an entity, and what an app does to it, in the solver's types.

use crate::solver::{self, Controls, Effects, ExternalForce, ExternalImpulse, Grabs, PinTargets};
use bevy::{ecs::query::QueryData, prelude::*};

/// Queries the components of all built-in effects together.
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
        /// Names of the built-in effects, which plain worlds and snapshots support.
        pub const CARRIED: &[&str] = &[$(stringify!($effect),)*];

        /// The built-in effects of an entity.
        #[derive(QueryData)]
        pub(crate) struct Carried {
            $(pub(crate) $effect: Option<&'static $component>,)*
        }

        impl CarriedItem<'_, '_> {
            /// Copies of the effects.
            pub fn effects(&self) -> Effects {
                Effects {
                    $($effect: self.$effect.copied(),)*
                }
            }
        }

        /// The built-in effects of an entity.
        #[must_use]
        pub fn effects(entity: EntityRef) -> Effects {
            Effects {
                $($effect: entity.get::<$component>().copied(),)*
            }
        }

        /// Inserts these effects into an entity.
        pub(crate) fn insert_effects(entity: &mut EntityWorldMut, effects: &Effects) {
            let Effects { $($effect,)* } = *effects;
            $(if let Some(effect) = $effect {
                entity.insert(effect);
            })*
        }

        /// Gives an entity these effects, and removes all other built-in ones.
        pub(super) fn set_effects(entity: &mut EntityWorldMut, effects: &Effects) {
            let Effects { $($effect,)* } = *effects;
            $(match $effect {
                Some(effect) => entity.insert(effect),
                None => entity.remove::<$component>(),
            };)*
        }
    };
}

solver::effects!(carried);

/// What an app does to an entity.
#[must_use]
pub fn controls(entity: EntityRef) -> Controls {
    Controls {
        force: entity.get::<ExternalForce>().cloned(),
        impulse: entity.get::<ExternalImpulse>().cloned(),
        targets: entity.get::<PinTargets>().cloned(),
        grabs: entity.get::<Grabs>().cloned(),
    }
}

/// Lets an app do this to an entity, and nothing else.
pub(super) fn set_controls(entity: &mut EntityWorldMut, controls: &Controls) {
    let Controls {
        force,
        impulse,
        targets,
        grabs,
    } = controls.clone();
    set(entity, force);
    set(entity, impulse);
    set(entity, targets);
    set(entity, grabs);
}

/// Inserts a component, or removes it.
pub(super) fn set<C: Component>(entity: &mut EntityWorldMut, component: Option<C>) {
    match component {
        Some(component) => drop(entity.insert(component)),
        None if entity.contains::<C>() => drop(entity.remove::<C>()),
        None => {}
    }
}
