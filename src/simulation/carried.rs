//! The effects that an entity carries, as the solver has them.

use crate::solver::{
    Attract, Bend, Collide, Direct, Drag, Effects, Grab, Ground, IsometricBend, Membrane,
    NeoHookean, Plasticity, Pressure, ShapeMatching, StickyGround, StrainLimit, Stretch, Struts,
    Tethers, Uniform, Volume, Vortex, Weave, Wind,
};
use bevy::{ecs::query::QueryData, prelude::*};

/// Takes the components of all effects of the crate together.
macro_rules! carried {
    ($($effect:ident: $component:ty,)*) => {
        /// The names of the effects of the crate, which a plain world and a snapshot have a place for.
        pub const CARRIED: &[&str] = &[$(stringify!($effect),)*];

        /// The effects of the crate that an entity carries.
        #[derive(QueryData)]
        pub(crate) struct Carried {
            $($effect: Option<&'static $component>,)*
        }

        impl CarriedItem<'_, '_> {
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

carried! {
    stretch: Stretch,
    bend: Bend,
    isometric_bend: IsometricBend,
    volume: Volume,
    neo_hookean: NeoHookean,
    uniform: Uniform,
    attract: Attract,
    vortex: Vortex,
    wind: Wind,
    drag: Drag,
    membrane: Membrane,
    weave: Weave,
    strain_limit: StrainLimit,
    shape_matching: ShapeMatching,
    tethers: Tethers,
    struts: Struts,
    pressure: Pressure,
    plasticity: Plasticity,
    direct: Direct,
    grab: Grab,
    ground: Ground,
    sticky_ground: StickyGround,
    collide: Collide,
}
