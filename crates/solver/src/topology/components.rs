//! Connected parts of a body.

use super::union::root;

/// The parts of a body whose particles are connected by edges, triangles or tetrahedra: one of most
/// bodies, several of one that has torn, of strands, and of a mesh file with several parts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Components {
    /// Start of each part among the members, and the end of the last.
    starts: Vec<usize>,
    /// Particles of all parts, ascending within a part.
    members: Vec<u32>,
}

impl Components {
    /// Connects the particles `0..count` by these elements.
    pub(super) fn of(
        count: usize,
        edges: impl Iterator<Item = [u32; 2]>,
        triangles: &[[u32; 3]],
        tetrahedra: impl Iterator<Item = [u32; 4]>,
    ) -> Self {
        let mut parents: Vec<u32> = (0..count as u32).collect();
        let mut join = |a: u32, b: u32| {
            let (a, b) = (root(&mut parents, a), root(&mut parents, b));
            // The lowest particle is the root.
            parents[a.max(b) as usize] = a.min(b);
        };
        edges.for_each(|[a, b]| join(a, b));
        for &[a, b, c] in triangles {
            join(a, b);
            join(a, c);
        }
        for [a, b, c, d] in tetrahedra {
            join(a, b);
            join(a, c);
            join(a, d);
        }
        let mut members: Vec<(u32, u32)> = (0..count as u32)
            .map(|i| (root(&mut parents, i), i))
            .collect();
        members.sort_unstable();
        let mut components = Self {
            starts: vec![0],
            members: Vec::with_capacity(count),
        };
        for part in members.chunk_by(|a, b| a.0 == b.0) {
            if part.len() > 1 {
                components.members.extend(part.iter().map(|(_, i)| i));
                components.starts.push(components.members.len());
            }
        }
        components
    }

    /// Number of parts of several particles.
    #[must_use]
    pub fn count(&self) -> usize {
        self.starts.len() - 1
    }

    /// The particles of a part, ascending.
    ///
    /// # Panics
    /// If there are not as many parts.
    #[must_use]
    pub fn part(&self, number: usize) -> &[u32] {
        &self.members[self.starts[number]..self.starts[number + 1]]
    }

    /// The particles of all parts.
    #[must_use]
    pub fn members(&self) -> &[u32] {
        &self.members
    }

    /// All parts.
    pub fn parts(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        (0..self.count()).map(|number| self.part(number))
    }
}
