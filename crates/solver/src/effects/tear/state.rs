//! Limits of the elements of a body, kept between ticks.

use super::Tear;
use crate::{ElasticKind, Membrane, NeoHookean, Stretch, TopologyId, Weave};

/// Limits of the elements of a body: a cache, derived from its topology and its effects.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TearState {
    pub(super) made_for: Option<Key>,
    /// Tension at which each edge breaks [N]; empty without springs.
    pub(super) strengths: Vec<f32>,
    pub(super) triangles: Limits,
    pub(super) tetrahedra: Limits,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Key {
    pub(super) topology: TopologyId,
    pub(super) tear: Tear,
    pub(super) stretch: Option<Stretch>,
    pub(super) membrane: Option<Membrane>,
    pub(super) weave: Option<Weave>,
    pub(super) neo_hookean: Option<NeoHookean>,
}

/// Limits of triangles or tetrahedra.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Limits {
    /// Compliances of each kind of elastic effect on them, in the order of its multipliers.
    pub(super) compliances: Vec<(ElasticKind, Vec<f32>)>,
    /// Least energy at which each may break [J].
    pub(super) least: Vec<f32>,
}

impl TearState {
    /// Memory use in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&self.strengths[..]) + self.triangles.bytes() + self.tetrahedra.bytes()
    }
}

impl Limits {
    fn bytes(&self) -> usize {
        let columns = self.compliances.iter();
        let columns: usize = columns.map(|(_, column)| size_of_val(&column[..])).sum();
        columns + size_of_val(&self.least[..])
    }
}
