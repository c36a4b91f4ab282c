//! The linking number of a closed rod.

use super::RodShape;
use crate::{ParticleIndex, SegmentState, Topology};
use glam::{DQuat, DVec3};
use std::f64::consts::TAU;

/// Half a turn about x: it reverses z.
const HALF_TURN: DQuat = DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0);

/// How often a closed rod is twisted and wound around itself, in turns.
///
/// The sum of both, the linking number of the rod with a line on its surface, stays the same whatever
/// the rod does, unless a strand passes through another, which changes it by 2 (Călugăreanu 1959;
/// Fuller, *The writhing number of a space curve*, 1971). It is known as long as neighboring segments are
/// twisted against each other by less than half a turn: a turn more between them is not seen.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[non_exhaustive]
pub struct RodLink {
    /// Turns of the material around the curve.
    pub twist: f64,
    /// Turns of the curve around itself.
    pub writhe: f64,
}

impl RodLink {
    /// The link of a rod that is one ring, for the positions of its particles [m] and its
    /// [segments](crate::Particles::segments); where there are none yet, those with which the rod starts at
    /// these positions. `None` for other bodies. The time grows with the square of the number of segments.
    ///
    /// # Panics
    /// If a particle has no position.
    #[must_use]
    pub fn of(topology: &Topology, positions: &[DVec3], segments: &[SegmentState]) -> Option<Self> {
        let shape = RodShape::of(topology).ok()?;
        let ring = ring(&shape)?;
        let orientations: Vec<DQuat> = match segments.len() == shape.segments().count() {
            true => segments.iter().map(|it| it.orientation).collect(),
            false => shape.fit(|i| positions[i as usize]),
        };
        let points: Vec<DVec3> = ring
            .iter()
            .map(|step| positions[step.node.index()])
            .collect();
        let frames: Vec<DQuat> = ring
            .iter()
            .map(|step| match step.backward {
                true => orientations[step.segment] * HALF_TURN,
                false => orientations[step.segment],
            })
            .collect();
        Some(Self {
            twist: twist(&points, &frames),
            writhe: writhe(&points),
        })
    }

    /// The linking number.
    #[must_use]
    pub fn total(self) -> f64 {
        self.twist + self.writhe
    }
}

/// A segment of a ring, with the node where it begins.
#[derive(Debug, Clone, Copy)]
struct Step {
    node: ParticleIndex,
    segment: usize,
    /// Whether the z axis of the segment points to that node.
    backward: bool,
}

/// The segments in the order of the ring.
fn ring(shape: &RodShape) -> Option<Vec<Step>> {
    let ends: Vec<[ParticleIndex; 2]> = shape.ends().collect();
    let nodes = ends.iter().flatten().map(|node| node.index() + 1).max()?;
    let mut around: Vec<Vec<usize>> = vec![Vec::new(); nodes];
    for (segment, nodes) in ends.iter().enumerate() {
        for node in nodes {
            around[node.index()].push(segment);
        }
    }
    let closed = around.iter().all(|it| it.is_empty() || it.len() == 2);
    let mut steps: Vec<Step> = Vec::with_capacity(ends.len());
    let (mut node, mut segment) = (ends[0][0], 0);
    while closed && steps.len() < ends.len() {
        let backward = ends[segment][0] != node;
        steps.push(Step {
            node,
            segment,
            backward,
        });
        node = ends[segment][usize::from(!backward)];
        let next = around[node.index()].iter().find(|it| **it != segment);
        segment = *next?;
        if segment == 0 {
            break;
        }
    }
    // Fewer than all: there are several rings.
    (closed && steps.len() == ends.len()).then_some(steps)
}

/// Writhe of a closed polygon (Klenin and Langowski, *Computation of writhe in modeling of supercoiled
/// DNA*, 2000, method 1a).
fn writhe(points: &[DVec3]) -> f64 {
    let count = points.len();
    let at = |i: usize| points[i % count];
    let mut sum = 0.0;
    for j in 2..count {
        for i in 0..j - 1 {
            if i == 0 && j == count - 1 {
                continue;
            }
            let [a, b, c, d] = [at(i), at(i + 1), at(j), at(j + 1)];
            let normal = |p: DVec3, q: DVec3| p.cross(q).normalize_or_zero();
            let normals = [
                normal(c - a, d - a),
                normal(d - a, d - b),
                normal(d - b, c - b),
                normal(c - b, c - a),
            ];
            let angle = |k: usize| {
                let [p, q] = [normals[k], normals[(k + 1) % 4]];
                // The arcsine of p·q, which keeps its digits near ±1.
                libm::atan2(p.dot(q), p.cross(q).length())
            };
            let side = (d - c).cross(b - a).dot(c - a);
            sum += (0..4).map(angle).sum::<f64>() * side.signum();
        }
    }
    sum / TAU
}

/// Turns of frames, one per edge, around a closed polygon, against parallel transport.
fn twist(points: &[DVec3], frames: &[DQuat]) -> f64 {
    let count = points.len();
    let edges: Vec<DVec3> = (0..count)
        .map(|i| (points[(i + 1) % count] - points[i]).normalize_or_zero())
        .collect();
    let sides: Vec<DVec3> = (0..count)
        .map(|i| {
            let onto = DQuat::from_rotation_arc(frames[i] * DVec3::Z, edges[i]);
            onto * (frames[i] * DVec3::X)
        })
        .collect();
    let turns = (0..count).map(|i| {
        let next = (i + 1) % count;
        let carried = DQuat::from_rotation_arc(edges[i], edges[next]) * sides[i];
        let along = carried.cross(sides[next]).dot(edges[next]);
        libm::atan2(along, carried.dot(sides[next]))
    });
    turns.sum::<f64>() / TAU
}
