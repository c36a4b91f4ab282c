//! Index types for vertices and particles.

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
            /// Index into a column.
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

        /// The number alone, as in files.
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
    /// A vertex of the source mesh of a body, in file numbering, from 0.
    ///
    /// ```
    /// use glam::Vec3;
    /// use pliant_solver::{RestShape, Topology, TopologyError, VertexIndex};
    ///
    /// let rope = RestShape {
    ///     vertices: vec![Vec3::ZERO, Vec3::X, Vec3::X * 2.0],
    ///     edges: vec![[0, 1], [1, 2]],
    ///     ..RestShape::default()
    /// };
    /// let topology = Topology::new(rope)?;
    /// let particle = topology.numbering.particle(VertexIndex(2));
    /// assert_eq!(topology.numbering.vertex(particle), VertexIndex(2));
    /// # Ok::<(), TopologyError>(())
    /// ```
    VertexIndex
);
index!(
    /// A particle of a body, in solver numbering, from 0. The [numbering](crate::numbering) maps it
    /// to its vertex.
    ParticleIndex
);
