//! Multipliers of all effects of a body.

use super::{
    Effects, elastic::ElasticKind, pressure::PressureState, shape_matching::ShapeMatchingState,
};
use crate::{ContactMultiplier, Topology};
use glam::{Vec3, Vec4};

/// Multipliers λ of the constraints of a body, a column for each effect that it carries; empty where they are not
/// kept. λ/h² is a force.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Lambdas {
    columns: [Vec<f32>; ElasticKind::COUNT],
    /// What pressure keeps.
    pub pressure_state: PressureState,
    /// The regions whose shapes are matched, with their multipliers; none before the first substep.
    pub matching: Option<Box<ShapeMatchingState>>,
    /// Sums of the displacements of averaged passes; zeros between them.
    sums: Vec<Vec4>,
    /// Of contact with the ground and with colliders, particle by particle; empty where one pass does not need what
    /// another has done.
    pub rigid: RigidMultipliers,
}

/// Multipliers of contact with the ground and with colliders, particle by particle.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RigidMultipliers {
    /// With the ground.
    pub ground: Vec<ContactMultiplier>,
    /// With colliders, for each particle that which it has touched last.
    pub colliders: Vec<ContactMultiplier>,
}

impl RigidMultipliers {
    /// Forgets what friction has held, and keeps what has pushed.
    pub(crate) fn let_slip(&mut self) {
        for kept in self.ground.iter_mut().chain(&mut self.colliders) {
            kept.friction = Vec3::ZERO;
        }
    }

    /// Allocates what `count` particles of a body with these effects need.
    pub(crate) fn make_room(&mut self, effects: &Effects, count: usize) {
        let of = |present: bool| if present { count } else { 0 };
        let columns = [
            (&mut self.ground, of(effects.ground.is_some())),
            (&mut self.colliders, of(effects.collide.is_some())),
        ];
        for (column, count) in columns {
            if column.len() != count {
                *column = vec![ContactMultiplier::default(); count];
            }
        }
    }
}

impl Lambdas {
    /// Of one effect, element by element.
    #[must_use]
    pub fn of(&self, kind: ElasticKind) -> &[f32] {
        &self.columns[kind as usize]
    }

    /// Allocates the column of an effect, or frees it if it is not `kept`.
    pub fn make_room(&mut self, kind: ElasticKind, topology: &Topology, kept: bool) {
        let column = &mut self.columns[kind as usize];
        let count = if kept { kind.multipliers(topology) } else { 0 };
        if column.len() != count {
            *column = vec![0.0; count];
        }
    }

    /// All columns, in the order of [`ElasticKind::ALL`].
    pub(crate) fn columns(&mut self) -> &mut [Vec<f32>; ElasticKind::COUNT] {
        &mut self.columns
    }

    /// Allocates sums for `count` particles.
    pub(crate) fn make_sums(&mut self, count: usize) {
        if self.sums.len() != count {
            self.sums = vec![Vec4::ZERO; count];
        }
    }

    /// Sums of the displacements of averaged passes, by particle.
    pub(crate) fn sums(&mut self) -> &mut [Vec4] {
        &mut self.sums
    }

    /// Bytes of memory.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.count() * size_of::<f32>()
            + size_of_val(&self.sums[..])
            + size_of_val(&self.pressure_state.gradients[..])
            + size_of_val(&self.rigid.ground[..])
            + size_of_val(&self.rigid.colliders[..])
            + self
                .matching
                .as_ref()
                .map_or(0, |it| size_of::<ShapeMatchingState>() + it.bytes())
    }

    /// How many multipliers there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.columns.iter().map(Vec::len).sum()
    }
}
