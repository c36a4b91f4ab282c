//! Numbers of vertices and of particles, which are not the same.

use serde::{Deserialize, Serialize};
use std::fmt;

macro_rules! index {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(
            Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize,
        )]
        #[serde(transparent)]
        #[cfg_attr(feature = "bevy", derive(bevy_reflect::Reflect))]
        pub struct $name(pub u32);

        impl $name {
            /// Its place in a column.
            #[must_use]
            pub const fn index(self) -> usize {
                self.0 as usize
            }
        }

        impl From<u32> for $name {
            fn from(number: u32) -> Self {
                Self(number)
            }
        }

        /// The number alone, as files have it.
        impl fmt::Debug for $name {
            fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
                self.0.fmt(formatter)
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
                self.0.fmt(formatter)
            }
        }
    };
}

index!(
    /// A vertex of the mesh that a body was made of, as files and users count them, from 0.
    VertexIndex
);
index!(
    /// A particle of a body, in the order in which the solver keeps them, from 0. Which vertex it is, the
    /// [numbering](crate::numbering) knows.
    ParticleIndex
);
