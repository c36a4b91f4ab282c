//! Interface between contacts and bodies.

use crate::{Effects, Stitches, Topology, particles::surface_force::Push};
use glam::DVec3;

/// A body as contacts see it.
pub(crate) trait Tangible {
    /// Topology of the body.
    fn topology(&self) -> &Topology;
    /// Effects of the body.
    fn effects(&self) -> &Effects;
    /// Number of the body among those of the world, from 0. Bodies are sorted by it.
    fn number(&self) -> u32;
    /// Stitches of the body.
    fn stitches(&self) -> &Stitches;
    /// The same, for a pass.
    fn stitches_mut(&mut self) -> &mut Stitches;
    /// Whether it takes part in contacts: false once it is not finite.
    fn takes_part(&self) -> bool;
    /// Whether it is stepped. A sleeping body is an obstacle that does not move.
    fn is_stepped(&self) -> bool;
    /// Whether no other surface comes near it in the substeps under way.
    fn is_apart(&self) -> bool {
        false
    }
    /// Inverse mass of a particle [1/kg].
    fn inverse_mass(&self, i: usize) -> f64;
    /// Position before a substep [m].
    fn start(&self, i: usize) -> DVec3;
    /// Current position within a substep [m].
    fn now(&self, i: usize) -> DVec3;
    /// Displacement by its velocity in a substep [m].
    fn motion(&self, i: usize) -> DVec3;
    /// Moves a particle within a substep [m].
    fn shift(&mut self, i: usize, by: DVec3);
    /// Whether part of the body is under repair, which moves particles before a substep.
    fn is_repaired(&self) -> bool;
    /// Position at the start of the current substep, after repair [m].
    fn began(&self, i: usize) -> DVec3;
    /// Moves the start position [m].
    fn shift_start(&mut self, i: usize, by: DVec3);
    /// Changes the velocity after a substep, expressed as a displacement per substep [m].
    fn accelerate(&mut self, i: usize, by: DVec3);
    /// Records that a contact has acted.
    fn touch(&mut self);
    /// Whether impulses of ground and colliders are recorded.
    fn records_contacts(&self) -> bool {
        false
    }
    /// Records an impulse on a particle.
    fn record(&mut self, _particle: usize, _push: Push) {}
}
