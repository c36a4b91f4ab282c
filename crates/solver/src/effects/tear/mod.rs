//! Tear.

mod cut;
mod split;
mod state;
mod strength;
mod stretch;

pub use cut::Cut;
pub(crate) use split::Strained;
pub use state::TearState;

#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{BreakingStrain, Force, PieceSize, Toughness};
use serde::{Deserialize, Serialize};

/// Tear: splits the body where an element exceeds a limit on energy, force or strain.
///
/// **Toughness.** A crack grows when it releases more elastic energy per new area than the
/// toughness G_c (Griffith 1921). A limit on force or strain would depend on the mesh: at the tip
/// of a crack an element of size l is under a stress of about K/√(2πl). So an element breaks when
/// its elastic energy exceeds G_c times the area that it stands for,
///
/// E > G_c A, A = κV/l,
///
/// with its measure V and its extent l along the largest stretch: volume and m² for a tetrahedron,
/// area and m for a triangle. For an edge of a sheet A is κ times the sum of ⅔ of the areas of its
/// triangles over its length, for one of a solid κ times the sum of half the volumes of its cells
/// over its length; a cut through a rope counts as 1. κ is [`FRACTION`], for edges
/// [`EDGE_FRACTION`]. E = ½ Σ α(λ/h²)² is the energy of the forces that act in the last substep,
/// which are finite also where the solver is far from convergence.
///
/// An uncracked body has no crack tip: under a toughness alone it breaks at a stress that depends
/// on the mesh. Where the strength of a material is known, set a strain or a force as well.
///
/// **Split.** At the end of a tick, the elements above their limits are treated in the order of
/// their loads. Each splits one of its particles, the one whose elements are loaded most, along the
/// plane through it across the largest stretch at rest, see [`Tearing`](crate::topology::Tearing). Elements around a particle
/// that was split wait for the next tick, as they are relieved. No piece gets smaller than
/// [`Tear::smallest_piece`].
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Tear {
    /// Toughness G_c: energy per area of a crack in J/m²; for a sheet per length in J/m, for a rope
    /// per cut in J. Default 100, ∞ for no limit. Elements without compliance store no energy.
    pub toughness: Toughness,
    /// Tension of an edge at which it breaks [N]; default ∞. It depends on the mesh.
    pub force: Force,
    /// Strain at which an edge breaks, or the largest principal strain at which a triangle or a
    /// tetrahedron does; default ∞. At the tip of a crack it depends on the mesh.
    pub strain: BreakingStrain,
    /// Smallest number of connected elements that may come off; default 4.
    pub smallest_piece: PieceSize,
}
