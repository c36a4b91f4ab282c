//! The chains of a body of edges, with the rest shape of their segments and joints.

use crate::{ParticleIndex, Topology, VertexIndex, fit::MassFit};
use glam::{DQuat, DVec3};
use std::ops::Range;

/// Reason why a body is not a set of open chains.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NotChains {
    /// The body has triangles or tetrahedra.
    #[error("a rod needs a body of edges alone, such as a rope; this one has a surface")]
    Surface,
    /// More than two edges meet in a vertex.
    #[error("a rod needs open chains of edges; {edges} edges meet in vertex {vertex}")]
    Branch {
        /// The vertex.
        vertex: VertexIndex,
        /// Its edges.
        edges: usize,
    },
    /// A chain is closed.
    #[error("a rod needs open chains of edges; the one through vertex {vertex} is closed")]
    Ring {
        /// One of its vertices.
        vertex: VertexIndex,
    },
}

/// A segment: the edge between two consecutive nodes of a chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RestSegment {
    /// Particles at its ends, from the root to the tip.
    pub nodes: [u32; 2],
    /// Length l [m].
    pub length: f64,
    /// Orientation: it turns the z axis to the direction of the segment. Frames have no twist along
    /// the chain (Bishop 1975).
    pub orientation: DQuat,
    /// Rotation Ω₀ from this segment to the next, in its frame, and the mean l̄ of their lengths
    /// [m]; `None` for the last one.
    pub joint: Option<(DQuat, f64)>,
}

/// The chains of a body.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Chains {
    /// The segments of all chains, from root to tip.
    pub(super) segments: Vec<RestSegment>,
    /// The segments of each chain.
    pub(super) ranges: Vec<Range<usize>>,
    /// The chains of each [partition](crate::partitions), and those that extend beyond the next
    /// one.
    pub(super) parts: Vec<ChainRange>,
}

/// Consecutive chains.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct ChainRange {
    pub chains: Range<usize>,
    pub segments: Range<usize>,
}

impl Chains {
    /// The chains of a body by partition, each from the end with the lower vertex, and in the order
    /// of these.
    ///
    /// # Errors
    /// [`NotChains`] for a surface, a branch or a ring.
    pub fn of(topology: &Topology) -> Result<Self, NotChains> {
        if !topology.triangles.is_empty() || topology.tetrahedra.corners().len() > 0 {
            return Err(NotChains::Surface);
        }
        let vertex = |particle: u32| topology.numbering.vertex(ParticleIndex(particle));
        let mut neighbors: Vec<Vec<u32>> = vec![Vec::new(); topology.particles()];
        for [a, b] in topology.edges.ends() {
            neighbors[a as usize].push(b);
            neighbors[b as usize].push(a);
        }
        let mut order: Vec<u32> = (0..topology.particles() as u32).collect();
        order.sort_by_key(|&particle| vertex(particle));
        if let Some(&branch) = order.iter().find(|&&i| neighbors[i as usize].len() > 2) {
            return Err(NotChains::Branch {
                vertex: vertex(branch),
                edges: neighbors[branch as usize].len(),
            });
        }
        let mut chains: Vec<Vec<u32>> = Vec::new();
        let mut known = vec![false; topology.particles()];
        for &root in &order {
            if neighbors[root as usize].len() == 1 && !known[root as usize] {
                let mut nodes = vec![root];
                known[root as usize] = true;
                let mut last = root;
                while let Some(&next) = neighbors[last as usize]
                    .iter()
                    .find(|&&next| !known[next as usize])
                {
                    known[next as usize] = true;
                    nodes.push(next);
                    last = next;
                }
                chains.push(nodes);
            }
        }
        let ring = order
            .iter()
            .find(|&&i| !known[i as usize] && !neighbors[i as usize].is_empty());
        match ring {
            Some(&particle) => Err(NotChains::Ring {
                vertex: vertex(particle),
            }),
            None => Ok(Self::sorted(chains, topology)),
        }
    }

    /// Chains with these nodes.
    fn sorted(mut nodes: Vec<Vec<u32>>, topology: &Topology) -> Self {
        let partitions = &topology.partitions;
        let part_of = |chain: &Vec<u32>| {
            let low = chain.iter().copied().min().unwrap_or(0);
            let high = chain.iter().copied().max().unwrap_or(0);
            let partition = partitions.partition_of(&[low, high]);
            partition.unwrap_or(partitions.count())
        };
        nodes.sort_by_cached_key(part_of);
        let mut all = Self {
            parts: vec![ChainRange::default(); partitions.count() + 1],
            ..Self::default()
        };
        for part in 0..all.parts.len() {
            let first = (all.ranges.len(), all.segments.len());
            while let Some(chain) = nodes.get(all.ranges.len())
                && part_of(chain) == part
            {
                all.push(chain, topology);
            }
            all.parts[part] = ChainRange {
                chains: first.0..all.ranges.len(),
                segments: first.1..all.segments.len(),
            };
        }
        all
    }

    /// The first `count` particles of each chain, from its root.
    pub fn roots(&self, count: u32) -> impl Iterator<Item = ParticleIndex> + '_ {
        self.ranges.iter().flat_map(move |range| {
            let segments = &self.segments[range.clone()];
            let first = segments.iter().take(1).map(|segment| segment.nodes[0]);
            let others = segments.iter().map(|segment| segment.nodes[1]);
            first.chain(others).take(count as usize).map(ParticleIndex)
        })
    }

    fn push(&mut self, nodes: &[u32], topology: &Topology) {
        let place = |i: u32| topology.rest[i as usize].as_dvec3();
        let from = self.segments.len();
        let mut orientation = DQuat::IDENTITY;
        let mut direction = DVec3::Z;
        for pair in nodes.windows(2) {
            let along = place(pair[1]) - place(pair[0]);
            let next = along.normalize_or(direction);
            orientation = (DQuat::from_rotation_arc(direction, next) * orientation).normalize();
            direction = next;
            self.segments.push(RestSegment {
                nodes: [pair[0], pair[1]],
                length: along.length(),
                orientation,
                joint: None,
            });
        }
        for i in from + 1..self.segments.len() {
            let (before, after) = (self.segments[i - 1], self.segments[i]);
            let turn = before.orientation.conjugate() * after.orientation;
            let mean = 0.5 * (before.length + after.length);
            self.segments[i - 1].joint = Some((turn, mean));
        }
        self.ranges.push(from..self.segments.len());
    }

    /// Orientations of the segments for particles `at` positions [m]: the rest shape of each chain,
    /// turned to fit them best, and each segment then along its edge by the shortest rotation.
    pub(super) fn fit(&self, at: impl Fn(u32) -> DVec3) -> Vec<DQuat> {
        let mut orientations = Vec::with_capacity(self.segments.len());
        for range in &self.ranges {
            let segments = &self.segments[range.clone()];
            let mut rest = DVec3::ZERO;
            let ends = segments.iter().map(|segment| {
                rest += segment.orientation * (DVec3::Z * segment.length);
                (rest, at(segment.nodes[1]), 1.0)
            });
            let mut points = vec![(DVec3::ZERO, at(segments[0].nodes[0]), 1.0)];
            points.extend(ends);
            let turn = DQuat::from_mat3(&MassFit::of(points.into_iter()).rotation);
            orientations.extend(segments.iter().map(|segment| {
                let turned = turn * segment.orientation;
                let axis = turned * DVec3::Z;
                let [a, b] = segment.nodes.map(&at);
                let along = (b - a).normalize_or(axis);
                (DQuat::from_rotation_arc(axis, along) * turned).normalize()
            }));
        }
        orientations
    }

    /// Memory use in bytes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.segments[..])
            + size_of_val(&self.ranges[..])
            + size_of_val(&self.parts[..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RestShape;
    use glam::Vec3;

    #[test]
    fn the_parts_of_a_body_have_every_chain_once_and_long_ones_at_the_end() {
        let lengths: Vec<u32> = (0..150).map(|k| 20 + k % 13).chain([1500]).collect();
        let mut shape = RestShape::default();
        for (number, &count) in lengths.iter().enumerate() {
            let first = shape.vertices.len() as u32;
            let place = |i: u32| Vec3::new(i as f32 * 0.02, 0.0, number as f32);
            shape.vertices.extend((0..count).map(place));
            shape
                .edges
                .extend((first + 1..first + count).map(|i| [i - 1, i]));
        }
        let topology = Topology::new(shape).expect("sound");
        let chains = Chains::of(&topology).expect("chains");
        assert_eq!(chains.ranges.len(), lengths.len());
        let count = topology.partitions.count();
        assert_eq!(chains.parts.len(), count + 1);
        let mut next = ChainRange::default();
        for (part, range) in chains.parts.iter().enumerate() {
            assert_eq!(range.chains.start, next.chains.end);
            assert_eq!(range.segments.start, next.segments.end);
            for chain in range.chains.clone() {
                let nodes = chains.segments[chains.ranges[chain].clone()].iter();
                let nodes: Vec<u32> = nodes.flat_map(|segment| segment.nodes).collect();
                let ends = [
                    *nodes.iter().min().expect("2"),
                    *nodes.iter().max().expect("2"),
                ];
                let own = topology.partitions.partition_of(&ends).unwrap_or(count);
                assert_eq!(own, part, "chain {chain}");
            }
            next = range.clone();
        }
        assert_eq!(next.segments.end, chains.segments.len());
        let long = next.chains;
        assert_eq!(long.len(), 1, "{long:?}");
        assert_eq!(chains.ranges[long.start].len(), 1499);
    }
}
