//! The segments and joints of a body of edges, with their rest shape.
//!
//! Edges that are connected form an open chain, or a network with branches and rings. Both are
//! walked from a root, so that a segment points away from it and has a joint with the one before.
//! At a branch, all segments that leave a node have a joint with the one that reached it; a segment
//! that closes a ring has another one at its far end.

use crate::{ParticleIndex, Topology, VertexIndex, fit::MassFit};
use glam::{DQuat, DVec3};
use std::{collections::BTreeMap, ops::Range};

/// Maximum number of edges that meet in a vertex of a rod. All of them are coupled with each other.
pub const MAX_MEETING_EDGES: usize = 12;

/// Maximum number of rings of a rod, without the first one of each connected part. A single ring is
/// solved in O(n), a net of many meshes is not: with 968 of them, it takes 55 times as long per
/// segment as a tree.
pub const MAX_RINGS: usize = 1000;

/// Reason why a body cannot be a rod.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NotARod {
    /// The body has triangles or tetrahedra.
    #[error("a rod needs a body of edges alone, such as a rope; this one has a surface")]
    Surface,
    /// More than [`MAX_MEETING_EDGES`] edges meet in a vertex.
    #[error(
        "{edges} edges meet in vertex {vertex}, but at most {MAX_MEETING_EDGES} of a rod may; use \
         fewer branches, or `stretch`"
    )]
    Meeting {
        /// The vertex.
        vertex: VertexIndex,
        /// Its edges.
        edges: usize,
    },
    /// The body has more than [`MAX_RINGS`] rings beside the first one of each connected part.
    #[error(
        "the network of edges has {rings} loops, but `rod` supports at most {MAX_RINGS}; use a coarser \
         network, or `stretch`"
    )]
    Rings {
        /// Number of rings.
        rings: usize,
    },
}

/// The curve of a rod at rest, relative to that of its mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RestCurve {
    /// Fraction of the curvature.
    pub curl: f64,
    /// Additional twist [rad/m].
    pub twist: f64,
}

impl RestCurve {
    /// That of the mesh.
    pub const OF_MESH: Self = Self {
        curl: 1.0,
        twist: 0.0,
    };
}

impl Default for RestCurve {
    fn default() -> Self {
        Self::OF_MESH
    }
}

/// A joint of two segments that meet in a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RestJoint {
    /// The segment before.
    pub before: usize,
    /// Constant rotation of the frame of the segment behind, and the rotation Ω₀ at rest from the
    /// segment before to that frame. In chains the former is the identity. In networks the latter
    /// is: a joint loses stiffness with its rotation at rest, which is large at branches.
    pub offset: DQuat,
    pub turn: DQuat,
    /// Mean length l̄ of both segments [m].
    pub length: f64,
}

/// A segment: an edge, from the root on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RestSegment {
    /// Particles at its ends, that toward the root first.
    pub nodes: [u32; 2],
    /// Length l [m].
    pub length: f64,
    /// Lengths of all segments at either end, added up [m].
    pub around: [f64; 2],
    /// Orientation: it turns the z axis to the direction of the segment. Frames have no twist along
    /// the chain (Bishop 1975).
    pub orientation: DQuat,
    /// The joint with the segment before; `None` for the first one.
    pub joint: Option<RestJoint>,
}

/// Segments and joints.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Rest {
    pub segments: Vec<RestSegment>,
    /// The second joints of segments that close a ring, with these segments.
    pub closing: Vec<(usize, RestJoint)>,
    /// The segments of each part that is connected.
    pub ranges: Vec<Range<usize>>,
}

/// The segments of a body.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RodShape {
    /// Open chains, from root to tip.
    pub(super) chains: Rest,
    /// The chains of each [partition](crate::partitions), and those that extend beyond the next
    /// one.
    pub(super) parts: Vec<ChainRange>,
    /// Networks. Their segments follow those of the chains.
    pub(super) networks: Rest,
}

/// Consecutive chains.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct ChainRange {
    pub chains: Range<usize>,
    pub segments: Range<usize>,
}

/// An edge that has been walked.
#[derive(Debug, Clone, Copy)]
struct Step {
    nodes: [u32; 2],
    /// The step before.
    before: Option<usize>,
    /// The step with which it closes a ring.
    closes: Option<usize>,
}

impl RodShape {
    /// The segments of a body: those of open chains by partition. Each connected part is walked
    /// from the free end whose edge has the lowest vertex, or from its lowest vertex; parts are in the
    /// order of these, those without a free end last. A tear gives copies of a vertex high numbers: a
    /// piece of a chain begins at the same side as the chain.
    ///
    /// # Errors
    /// [`NotARod`] for a body with a surface, too many edges at a vertex or too many rings.
    pub fn of(topology: &Topology) -> Result<Self, NotARod> {
        if !topology.triangles.is_empty() || topology.tetrahedra.corners().len() > 0 {
            return Err(NotARod::Surface);
        }
        let vertex = |particle: u32| topology.numbering.vertex(ParticleIndex(particle));
        let mut edges: Vec<Vec<(u32, usize)>> = vec![Vec::new(); topology.particles()];
        for (edge, [a, b]) in topology.edges.ends().enumerate() {
            edges[a as usize].push((b, edge));
            edges[b as usize].push((a, edge));
        }
        let mut order: Vec<u32> = (0..topology.particles() as u32).collect();
        order.sort_by_key(|&particle| vertex(particle));
        let crowded = order
            .iter()
            .find(|&&i| edges[i as usize].len() > MAX_MEETING_EDGES);
        if let Some(&particle) = crowded {
            return Err(NotARod::Meeting {
                vertex: vertex(particle),
                edges: edges[particle as usize].len(),
            });
        }
        let is_free = |&&i: &&u32| edges[i as usize].len() == 1;
        let is_inside = |&&i: &&u32| edges[i as usize].len() > 1;
        let mut walk = Walk {
            edges: &edges,
            hubs: vec![None; topology.particles()],
            is_done: vec![false; topology.edges.ends().len()],
        };
        let (mut chains, mut networks, mut rings) = (Vec::new(), Rest::default(), 0);
        let mut ends: Vec<u32> = order.iter().filter(is_free).copied().collect();
        ends.sort_by_key(|&end| {
            let near = edges[end as usize].iter().map(|(near, _)| vertex(*near));
            near.chain([vertex(end)]).min()
        });
        for &root in ends.iter().chain(order.iter().filter(is_inside)) {
            let steps = walk.from(root);
            if steps.is_empty() {
                continue;
            }
            let is_inner = |step: &Step| edges[step.nodes[0] as usize].len() == 2;
            if edges[root as usize].len() == 1 && steps.iter().skip(1).all(is_inner) {
                chains.push(steps);
            } else {
                let closing = steps.iter().filter(|step| step.closes.is_some());
                rings += closing.count().saturating_sub(1);
                networks.push(&steps, topology, true);
            }
        }
        if rings > MAX_RINGS {
            return Err(NotARod::Rings { rings });
        }
        let mut all = Self::sorted(chains, topology);
        all.networks = networks;
        all.chains.measure();
        all.networks.measure();
        Ok(all)
    }

    /// Open chains with these edges.
    fn sorted(mut chains: Vec<Vec<Step>>, topology: &Topology) -> Self {
        let partitions = &topology.partitions;
        let part_of = |chain: &Vec<Step>| {
            let nodes = || chain.iter().flat_map(|step| step.nodes);
            let [low, high] = [nodes().min(), nodes().max()].map(Option::unwrap_or_default);
            let partition = partitions.partition_of(&[low, high]);
            partition.unwrap_or(partitions.count())
        };
        chains.sort_by_cached_key(part_of);
        let mut parts = vec![ChainRange::default(); partitions.count() + 1];
        let mut rest = Rest::default();
        for (number, part) in parts.iter_mut().enumerate() {
            let first = (rest.ranges.len(), rest.segments.len());
            while let Some(chain) = chains.get(rest.ranges.len())
                && part_of(chain) == number
            {
                rest.push(chain, topology, false);
            }
            *part = ChainRange {
                chains: first.0..rest.ranges.len(),
                segments: first.1..rest.segments.len(),
            };
        }
        Self {
            chains: rest,
            parts,
            networks: Rest::default(),
        }
    }

    /// Changes the curve at rest.
    pub(super) fn curl(&mut self, curve: RestCurve) {
        if curve != RestCurve::OF_MESH {
            self.chains.curl(curve, false);
            self.networks.curl(curve, true);
        }
    }

    /// Whether all parts are open chains.
    #[must_use]
    pub fn is_of_chains(&self) -> bool {
        self.networks.segments.is_empty()
    }

    /// The first `count` particles of each open chain, from its root.
    pub fn roots(&self, count: u32) -> impl Iterator<Item = ParticleIndex> + '_ {
        self.chains.ranges.iter().flat_map(move |range| {
            let segments = &self.chains.segments[range.clone()];
            let first = segments.iter().take(1).map(|segment| segment.nodes[0]);
            let others = segments.iter().map(|segment| segment.nodes[1]);
            first.chain(others).take(count as usize).map(ParticleIndex)
        })
    }

    /// Whether the first and the last segment of an open chain is clamped, at least of one chain.
    #[must_use]
    pub fn clamps(&self, is_pinned: impl Fn(ParticleIndex) -> bool) -> [bool; 2] {
        let chains = self.chains.ranges.iter();
        let is_clamped = |segment: usize| {
            let mut nodes = self.chains.segments[segment].nodes.into_iter();
            nodes.all(|node| is_pinned(ParticleIndex(node)))
        };
        [
            chains.clone().any(|range| is_clamped(range.start)),
            chains.clone().any(|range| is_clamped(range.end - 1)),
        ]
    }

    /// The particles at the ends of each segment, in the order of
    /// [`Particles::segments`](crate::Particles::segments). The z axis of a segment points from the
    /// first to the second.
    pub fn ends(&self) -> impl ExactSizeIterator<Item = [ParticleIndex; 2]> + '_ {
        self.segments()
            .map(|segment| segment.nodes.map(ParticleIndex))
    }

    /// The orientations with which the rod starts at these positions [m].
    pub(super) fn fit(&self, at: impl Fn(u32) -> DVec3) -> Vec<DQuat> {
        [self.chains.fit(&at), self.networks.fit(&at)].concat()
    }

    /// The segments of chains and networks.
    pub(super) fn segments(&self) -> impl ExactSizeIterator<Item = &RestSegment> {
        let (chains, networks) = (&self.chains.segments, &self.networks.segments);
        let all = 0..chains.len() + networks.len();
        all.map(|i| chains.get(i).unwrap_or_else(|| &networks[i - chains.len()]))
    }
}

/// Walks along edges, depth first.
struct Walk<'a> {
    /// Neighbors of each particle, with the edges to them.
    edges: &'a [Vec<(u32, usize)>],
    /// For each particle, the step that reached it, or the first one from a root.
    hubs: Vec<Option<usize>>,
    is_done: Vec<bool>,
}

impl Walk<'_> {
    /// Walks all edges that are connected with a particle and have not been walked.
    fn from(&mut self, root: u32) -> Vec<Step> {
        let mut steps = Vec::new();
        let mut path = vec![root];
        while let Some(&node) = path.last() {
            let mut left = self.edges[node as usize].iter();
            let Some(&(next, edge)) = left.find(|(_, edge)| !self.is_done[*edge]) else {
                path.pop();
                continue;
            };
            self.is_done[edge] = true;
            let known = self.hubs[next as usize];
            steps.push(Step {
                nodes: [node, next],
                before: self.hubs[node as usize],
                closes: known,
            });
            let step = steps.len() - 1;
            self.hubs[node as usize].get_or_insert(step);
            if known.is_none() {
                self.hubs[next as usize] = Some(step);
                path.push(next);
            }
        }
        steps
    }
}

impl Rest {
    /// Adds a connected part. The frames of joints are turned, so that they have no rotation at
    /// rest, if `turned`.
    fn push(&mut self, steps: &[Step], topology: &Topology, turned: bool) {
        let place = |i: u32| topology.rest[i as usize].as_dvec3();
        let from = self.segments.len();
        for step in steps {
            let before = step.before.map(|before| before + from);
            let (direction, last) = before.map_or((DVec3::Z, DQuat::IDENTITY), |before| {
                let RestSegment {
                    nodes: [a, b],
                    orientation,
                    ..
                } = self.segments[before];
                let along = (place(b) - place(a)).normalize_or(orientation * DVec3::Z);
                (along, orientation)
            });
            let [a, b] = step.nodes;
            let along = place(b) - place(a);
            let next = along.normalize_or(direction);
            let orientation = DQuat::from_rotation_arc(direction, next) * last;
            let segment = RestSegment {
                nodes: step.nodes,
                length: along.length(),
                around: [0.0; 2],
                orientation: orientation.normalize(),
                joint: None,
            };
            let joint = before.map(|before| self.joint(before, &segment, turned));
            self.segments.push(RestSegment { joint, ..segment });
            if let Some(other) = step.closes {
                let joint = self.joint(other + from, &segment, turned);
                self.closing.push((self.segments.len() - 1, joint));
            }
        }
        self.ranges.push(from..self.segments.len());
    }

    fn joint(&self, before: usize, behind: &RestSegment, turned: bool) -> RestJoint {
        let first = &self.segments[before];
        let turn = first.orientation.conjugate() * behind.orientation;
        let (offset, turn) = match turned {
            true => (turn.conjugate(), DQuat::IDENTITY),
            false => (DQuat::IDENTITY, turn),
        };
        RestJoint {
            before,
            offset,
            turn,
            length: 0.5 * (first.length + behind.length),
        }
    }

    /// Changes the rotations at rest of all joints but those of branches; `turned` as in
    /// [`push`](Self::push).
    fn curl(&mut self, curve: RestCurve, turned: bool) {
        let nodes = || self.segments.iter().flat_map(|segment| segment.nodes);
        let mut meeting = vec![0_u32; nodes().max().map_or(0, |last| last as usize + 1)];
        nodes().for_each(|node| meeting[node as usize] += 1);
        for row in 0..self.rows() {
            let Some((behind, &joint)) = self.joint_of(row) else {
                continue;
            };
            let [first, second] = [joint.before, behind].map(|i| self.segments[i].nodes);
            // Which way the path through the joint runs along either segment.
            let ends = [first[1], first[0]].into_iter().zip([1.0, -1.0]);
            let Some((node, along_first)) = ends.into_iter().find(|end| second.contains(&end.0))
            else {
                continue;
            };
            if meeting[node as usize] > 2 {
                continue;
            }
            let along_second = if second[0] == node { 1.0 } else { -1.0 };
            let rest = if turned {
                joint.offset.conjugate()
            } else {
                joint.turn
            };
            let tangents = [DVec3::Z * along_first, rest * (DVec3::Z * along_second)];
            let bend = DQuat::from_rotation_arc(tangents[0], tangents[1]);
            let half = 0.5 * curve.twist * joint.length;
            let rest = about_axis(half * along_first)
                * power(bend, curve.curl)
                * bend.conjugate()
                * rest
                * about_axis(half * along_second);
            let rest = rest.normalize();
            let changed = if turned {
                RestJoint {
                    offset: rest.conjugate(),
                    ..joint
                }
            } else {
                RestJoint {
                    turn: rest,
                    ..joint
                }
            };
            match row.checked_sub(self.segments.len()) {
                None => self.segments[row].joint = Some(changed),
                Some(place) => self.closing[place].1 = changed,
            }
        }
    }

    /// Adds up the lengths at the nodes.
    fn measure(&mut self) {
        let nodes = self.segments.iter().flat_map(|segment| segment.nodes);
        let mut lengths = vec![0.0; nodes.max().map_or(0, |last| last as usize + 1)];
        for segment in &self.segments {
            for node in segment.nodes {
                lengths[node as usize] += segment.length;
            }
        }
        for segment in &mut self.segments {
            segment.around = segment.nodes.map(|node| lengths[node as usize]);
        }
    }

    /// Orientations of the segments for particles `at` positions [m]: the rest shape of each part,
    /// turned to fit them best, and each segment then along its edge by the shortest rotation.
    pub fn fit(&self, at: impl Fn(u32) -> DVec3) -> Vec<DQuat> {
        let mut orientations = Vec::with_capacity(self.segments.len());
        for range in &self.ranges {
            let segments = &self.segments[range.clone()];
            let root = segments[0].nodes[0];
            let mut places = BTreeMap::from([(root, DVec3::ZERO)]);
            let mut points = vec![(DVec3::ZERO, at(root), 1.0)];
            for segment in segments {
                let [a, b] = segment.nodes;
                let rest = places[&a] + segment.orientation * (DVec3::Z * segment.length);
                if places.insert(b, rest).is_none() {
                    points.push((rest, at(b), 1.0));
                }
            }
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

    /// The segment before and that behind of a joint, and the joint: that of a segment, or one that
    /// closes a ring, behind those of all segments.
    pub fn joint_of(&self, row: usize) -> Option<(usize, &RestJoint)> {
        match self.segments.get(row) {
            Some(segment) => segment.joint.as_ref().map(|joint| (row, joint)),
            None => {
                let (behind, joint) = &self.closing[row - self.segments.len()];
                Some((*behind, joint))
            }
        }
    }

    /// Whether a segment is the first one of its part.
    pub fn is_first(&self, segment: usize) -> bool {
        self.segments[segment].joint.is_none()
    }

    /// Whether a segment is the last one of its part.
    pub fn is_last(&self, segment: usize) -> bool {
        let next = self.segments.get(segment + 1);
        next.is_none_or(|next| next.joint.is_none())
    }

    /// Number of segments and of joints that close a ring.
    pub fn rows(&self) -> usize {
        self.segments.len() + self.closing.len()
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.segments[..])
            + size_of_val(&self.closing[..])
            + size_of_val(&self.ranges[..])
    }
}

/// Rotation about the z axis [rad].
fn about_axis(angle: f64) -> DQuat {
    let (sin, cos) = libm::sincos(0.5 * angle);
    DQuat::from_xyzw(0.0, 0.0, sin, cos)
}

/// A rotation by a multiple of the angle of another.
fn power(rotation: DQuat, factor: f64) -> DQuat {
    let length = rotation.xyz().length();
    let (sin, cos) = libm::sincos(factor * libm::atan2(length, rotation.w));
    let axis = rotation.xyz().normalize_or_zero() * sin;
    DQuat::from_xyzw(axis.x, axis.y, axis.z, cos)
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
        let shape = RodShape::of(&topology).expect("edges alone");
        assert!(shape.is_of_chains());
        let (chains, parts) = (shape.chains, shape.parts);
        assert_eq!(chains.ranges.len(), lengths.len());
        let count = topology.partitions.count();
        assert_eq!(parts.len(), count + 1);
        let mut next = ChainRange::default();
        for (part, range) in parts.iter().enumerate() {
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

    /// A stem that forks into three, one of which ends in a ring.
    #[test]
    fn every_edge_of_a_network_is_a_segment_and_every_meeting_a_joint() {
        let shape = RestShape {
            vertices: [0.0, 1.0, 2.0, 2.0, 2.0, 3.0, 3.0]
                .into_iter()
                .zip([0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 1.0])
                .map(|(x, y)| Vec3::new(x, y, 0.0))
                .collect(),
            edges: vec![[0, 1], [1, 2], [1, 3], [1, 4], [3, 5], [5, 6], [6, 4]],
            ..RestShape::default()
        };
        let shape = RodShape::of(&Topology::new(shape).expect("sound")).expect("edges alone");
        assert!(!shape.is_of_chains());
        let rest = &shape.networks;
        assert_eq!((rest.segments.len(), rest.ranges.len()), (7, 1));
        // A node of d edges has d − 1 joints: 3 + 1 + 1 + 1 + 1.
        let joints: Vec<_> = (0..rest.rows())
            .filter_map(|row| rest.joint_of(row))
            .collect();
        assert_eq!(joints.len(), 7);
        assert_eq!(rest.closing.len(), 1);
        for (behind, joint) in joints {
            let [first, second] = [joint.before, behind].map(|i| &rest.segments[i]);
            assert!(first.nodes.iter().any(|node| second.nodes.contains(node)));
            let behind = second.orientation * joint.offset;
            let off = first.orientation * joint.turn - behind;
            assert!(off.length() < 1e-15, "{off}");
        }
        let fork = rest.segments.iter().find(|it| it.around[1] > 3.0);
        // 1 + √2 + 1 + √2
        let around = fork.expect("a node of four edges").around[1];
        assert!(
            (around - 2.0 - 2.0 * 2.0_f64.sqrt()).abs() < 1e-6,
            "{around}"
        );
    }
}
