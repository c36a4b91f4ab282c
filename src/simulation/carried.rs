//! The effects that an entity carries, as the solver has them.

use crate::solver::{
    Attract, Bend, Collide, Direct, Drag, Effects, Grab, Ground, IsometricBend, Membrane,
    NeoHookean, Plasticity, Pressure, ShapeMatching, StickyGround, StrainLimit, Stretch, Struts,
    Tethers, Uniform, Volume, Vortex, Weave, Wind,
};
use bevy::{ecs::query::QueryData, prelude::*};

/// Takes the components of all effects of the crate together; `grab` apart, as the solver writes to it.
macro_rules! carried {
    ($($effect:ident: $component:ty,)*) => {
        /// The names of the effects of the crate, which a plain world and a snapshot have a place for.
        pub const CARRIED: &[&str] = &["grab", $(stringify!($effect),)*];

        /// The effects of the crate that an entity carries, but for `grab`.
        #[derive(QueryData)]
        pub(crate) struct Carried {
            $($effect: Option<&'static $component>,)*
        }

        impl CarriedItem<'_, '_> {
            /// Copies of them, with a grab if there is one.
            pub fn effects(&self, grab: Option<Grab>) -> Effects {
                Effects {
                    grab,
                    $($effect: self.$effect.copied(),)*
                }
            }
        }

        /// The effects of the crate that an entity carries.
        #[must_use]
        pub fn effects(entity: EntityRef) -> Effects {
            Effects {
                grab: entity.get::<Grab>().copied(),
                $($effect: entity.get::<$component>().copied(),)*
            }
        }

        /// Gives an entity these effects.
        pub(super) fn insert_effects(entity: &mut EntityWorldMut, effects: &Effects) {
            let Effects { grab, $($effect,)* } = *effects;
            if let Some(grab) = grab {
                entity.insert(grab);
            }
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
    ground: Ground,
    sticky_ground: StickyGround,
    collide: Collide,
}
