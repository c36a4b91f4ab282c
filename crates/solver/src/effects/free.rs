//! What of a body can rotate freely: the parts that keep their [angular momentum](crate::spin).

use crate::{
    Effects, ShapeMatching, Topology,
    kernel::moments::{Moments, Turn},
};
use glam::{Vec3, Vec4};
use std::borrow::Cow;

/// Which parts of a body can rotate freely.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Free {
    /// None: each has a pin, or nothing acts within them.
    #[default]
    None,
    /// The only one.
    Whole,
    /// Some of several.
    Parts,
}

/// What a body needs to keep its angular momentum in a tick.
#[derive(Debug, Clone, Default)]
pub(crate) struct SpinState {
    pub free: Free,
    /// The parts that can rotate freely, unless it is the only one.
    pub parts: Vec<u32>,
    /// A point of the body [m]: sums about it lose little to rounding.
    pub origin: Vec3,
    /// Displacements before internal constraints [m].
    pub before: Vec<Vec4>,
    /// Sums of each even piece.
    pub sums: Vec<Moments>,
    /// The rotation that takes back that of the last internal constraints.
    pub turn: Turn,
}

impl SpinState {
    /// Begins a tick of a body whose internal constraints act or not.
    pub fn begin(
        &mut self,
        acts: bool,
        topology: &Topology,
        effects: &Effects,
        positions: &[Vec4],
    ) {
        self.parts.clear();
        self.free = match acts {
            true => self.find_free(topology, effects, positions),
            false => Free::None,
        };
        let (kept, pieces) = match self.free {
            Free::None => (0, 0),
            Free::Whole => (positions.len(), topology.partitions.pieces(false).len()),
            Free::Parts => (positions.len(), 0),
        };
        self.before.resize(kept, Vec4::ZERO);
        self.sums.resize(pieces, Moments::default());
        let moving = positions.iter().find(|x| x.w > 0.0);
        self.origin = moving.map_or(Vec3::ZERO, |x| x.truncate());
    }

    fn find_free(&mut self, topology: &Topology, effects: &Effects, positions: &[Vec4]) -> Free {
        let moves = |i: u32| positions[i as usize].w > 0.0;
        let components = topology.components();
        if components.count() == 1 || effects.couples_parts(topology) {
            let members = coupled(topology);
            let movable = positions.iter().filter(|x| x.w > 0.0).count();
            // A particle with a mass and no element moves by itself.
            return match members.len() == movable && members.iter().all(|&i| moves(i)) {
                true => Free::Whole,
                false => Free::None,
            };
        }
        let is_free = |part: &[u32]| part.iter().all(|&i| moves(i));
        let parts = (0..).zip(components.parts());
        let free = parts.filter(|(_, part)| is_free(part));
        self.parts.extend(free.map(|(number, _)| number));
        match self.parts.is_empty() {
            true => Free::None,
            false => Free::Parts,
        }
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.parts[..]) + size_of_val(&self.before[..]) + size_of_val(&self.sums[..])
    }
}

/// The particles that effects connect, where they connect all parts.
fn coupled(topology: &Topology) -> Cow<'_, [u32]> {
    match topology.radii.is_empty() {
        true => Cow::Borrowed(topology.components().members()),
        false => (0..topology.particles() as u32).collect(),
    }
}

impl Effects {
    /// Whether an effect connects parts of the body that no edge, triangle or tetrahedron does: shape
    /// matching of the whole body, or struts from one part to another.
    fn couples_parts(&self, topology: &Topology) -> bool {
        let is_whole = |it: ShapeMatching| it.region.get() == f32::INFINITY;
        let components = topology.components();
        self.shape_matching.is_some_and(is_whole)
            || self.struts.is_some() && components.count() > 1 && {
                let mut part_of = vec![u32::MAX; topology.particles()];
                for (number, part) in (0..).zip(components.parts()) {
                    for &i in part {
                        part_of[i as usize] = number;
                    }
                }
                let mut struts = topology.struts().ends();
                struts.any(|[a, b]| part_of[a as usize] != part_of[b as usize])
            }
    }
}

/// The particles of the parts of a body that can rotate freely, where particles move or not.
pub(crate) fn free_parts(
    effects: &Effects,
    topology: &Topology,
    moves: impl Fn(u32) -> bool,
) -> Vec<Vec<u32>> {
    let is_free = |part: &[u32]| part.iter().all(|&i| moves(i));
    let components = topology.components();
    let parts: Vec<Cow<[u32]>> = match effects.couples_parts(topology) {
        true => vec![coupled(topology)],
        false => components.parts().map(Cow::Borrowed).collect(),
    };
    let free = parts.into_iter().filter(|part| is_free(part));
    free.map(Cow::into_owned).collect()
}
