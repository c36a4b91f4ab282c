//! What contacts need of a body.

use crate::{Effects, Topology};
use glam::DVec3;

/// A body as contacts see it.
pub(crate) trait Tangible {
    /// Its elements.
    fn topology(&self) -> &Topology;
    /// What it carries.
    fn effects(&self) -> &Effects;
    /// Whether it can be touched: not once it is no longer finite.
    fn takes_part(&self) -> bool;
    /// Whether it is stepped. A body that sleeps is in the way, and does not move.
    fn is_stepped(&self) -> bool;
    /// Inverse mass of a particle [1/kg].
    fn inverse_mass(&self, i: usize) -> f64;
    /// Where it is before a substep [m].
    fn start(&self, i: usize) -> DVec3;
    /// Where it is in the course of a substep [m].
    fn now(&self, i: usize) -> DVec3;
    /// How far its velocity takes it in a substep [m].
    fn motion(&self, i: usize) -> DVec3;
    /// Moves it in the course of a substep [m].
    fn shift(&mut self, i: usize, by: DVec3);
    /// Whether something of it is under repair, which moves particles before a substep.
    fn is_repaired(&self) -> bool;
    /// Where the substep under way began for it, after repair [m].
    fn began(&self, i: usize) -> DVec3;
    /// Moves that [m].
    fn shift_start(&mut self, i: usize, by: DVec3);
    /// Changes its velocity after a substep, by a way in a substep [m].
    fn accelerate(&mut self, i: usize, by: DVec3);
    /// A contact has acted.
    fn touch(&mut self);
}
