//! What follows the elements of a torn body: edges, hinges, and the surface of a solid.

use super::Mesh;
use std::collections::{BTreeMap, BTreeSet};

/// Copies of the particles that were split.
pub(super) struct Copies {
    /// All copies by the particle of the topology, itself first.
    pub family: BTreeMap<u32, Vec<u32>>,
    /// For each copy, the particle of the topology.
    pub roots: Vec<u32>,
    /// Number of particles of the topology.
    pub count: u32,
    /// For each of them, whether it was split. Asked for every element: looking it up in `family`
    /// would take a third of the time of a tear.
    pub is_split: Vec<bool>,
}

impl Copies {
    pub fn root(&self, particle: u32) -> u32 {
        match particle.checked_sub(self.count) {
            Some(copy) => self.roots[copy as usize],
            None => particle,
        }
    }

    /// A particle and its copies.
    fn of<'a>(&'a self, particle: &'a u32) -> &'a [u32] {
        let copies = self.family.get(particle);
        copies.map_or(std::slice::from_ref(particle), |copies| copies)
    }

    pub fn are_whole<const N: usize>(&self, corners: &[u32; N]) -> bool {
        corners.iter().all(|&it| !self.is_split[it as usize])
    }
}

impl<const N: usize> Mesh<N> {
    /// What an edge of the topology has become: one edge in each part of the elements that have
    /// both ends, or, for an edge across two elements with a common side, one that still connects
    /// these; none if it is torn.
    pub(super) fn edges_of(&self, [a, b]: [u32; 2], copies: &Copies) -> Vec<[u32; 2]> {
        let mut found = Vec::new();
        let ends_at_b = |corner: &&u32| copies.root(**corner) == b;
        for &from in copies.of(&a) {
            for &element in self.fans.of_particle(from) {
                let to = self.corners[element as usize].iter().find(ends_at_b);
                found.extend(to.map(|&to| [from, to]));
            }
        }
        if found.is_empty() {
            let across = copies.of(&a).iter().find_map(|&from| {
                let mut to = copies.of(&b).iter();
                let to = to.find(|&&to| self.are_across(from, to))?;
                Some([from, *to])
            });
            found.extend(across);
        }
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Whether an element with the one particle shares a side with one that has the other.
    fn are_across(&self, from: u32, to: u32) -> bool {
        let ends = self.fans.of_particle(to);
        self.fans
            .of_particle(from)
            .iter()
            .any(|&one| ends.iter().any(|&other| self.share_a_side(one, other)))
    }

    /// The elements around split particles by their particles in the topology, ascending.
    fn around_splits(&self, copies: &Copies) -> BTreeSet<u32> {
        let split = copies.family.values().flatten();
        split
            .flat_map(|&particle| self.fans.of_particle(particle))
            .copied()
            .collect()
    }
}

impl Mesh<3> {
    /// Triangles with split particles, by their particles in the topology in ascending order.
    pub(super) fn torn_triangles(&self, copies: &Copies) -> BTreeMap<[u32; 3], [u32; 3]> {
        let all = self.around_splits(copies);
        let known = |&element: &u32| {
            let corners = self.corners[element as usize];
            let mut roots = corners.map(|corner| copies.root(corner));
            roots.sort_unstable();
            (roots, corners)
        };
        all.iter().map(known).collect()
    }
}

/// The copies that `triangles` give to a triangle of the topology, in its order.
pub(super) fn now<const N: usize>(
    corners: [u32; 3],
    triangles: &BTreeMap<[u32; 3], [u32; N]>,
    copies: &Copies,
) -> Option<[u32; 3]> {
    let mut key = corners;
    key.sort_unstable();
    let now = triangles.get(&key)?;
    Some(corners.map(|corner| {
        let own = now.iter().find(|&&it| copies.root(it) == corner);
        own.copied().unwrap_or(corner)
    }))
}

/// A hinge of the topology; `None` if its triangles no longer share its edge.
pub(super) fn hinge(
    [a, b, c, d]: [u32; 4],
    triangles: &BTreeMap<[u32; 3], [u32; 3]>,
    copies: &Copies,
) -> Option<[u32; 4]> {
    let or_same = |corners: [u32; 3]| now(corners, triangles, copies).unwrap_or(corners);
    let ([a, b, c], [a_too, b_too, d]) = (or_same([a, b, c]), or_same([a, b, d]));
    (a == a_too && b == b_too).then_some([a, b, c, d])
}

impl Mesh<4> {
    /// The surface of a solid: its triangles with their copies, followed by both sides of each
    /// crack.
    pub(super) fn surface(&self, triangles: &[[u32; 3]], copies: &Copies) -> Vec<[u32; 3]> {
        /// Outward sides of a tetrahedron with positive volume.
        const SIDES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
        // All sides with a split particle, by their particles in the topology.
        let mut sides = BTreeMap::<[u32; 3], Vec<[u32; 3]>>::new();
        for element in self.around_splits(copies) {
            let corners = self.corners[element as usize];
            for side in SIDES {
                let now = side.map(|place| corners[place]);
                let mut key = now.map(|corner| copies.root(corner));
                key.sort_unstable();
                if !copies.are_whole(&key) {
                    sides.entry(key).or_default().push(now);
                }
            }
        }
        let outer: BTreeMap<[u32; 3], [u32; 3]> = sides
            .iter()
            .filter(|(_, around)| around.len() == 1)
            .map(|(key, around)| (*key, around[0]))
            .collect();
        let mut surface: Vec<[u32; 3]> = triangles
            .iter()
            .map(|&corners| now(corners, &outer, copies).unwrap_or(corners))
            .collect();
        for around in sides.values() {
            if let [one, other] = around[..] {
                let apart = |side: &[u32; 3]| {
                    let mut sorted = *side;
                    sorted.sort_unstable();
                    sorted
                };
                if apart(&one) != apart(&other) {
                    surface.extend([one, other]);
                }
            }
        }
        surface
    }
}
