//! Struts: springs through a body, from each point of its surface to the opposite point.
//!
//! From each vertex of the surface a ray goes inwards along the normal, tilted slightly at random
//! to avoid alignment of struts on a regular mesh. Where it leaves the body, the strut ends at the
//! nearest corner of that triangle. The tilt follows from the number of the vertex in the mesh with
//! a fixed seed: the same mesh has the same struts on every machine.

use super::Edges;
use crate::{Topology, deform::Random};
use glam::DVec3;
use std::{ops::Range, sync::Arc};

/// Maximum tilt of a ray along each axis, relative to a normal of length 1.
const TILT: f64 = 0.1;

/// Seed of the tilts.
const SEED: u32 = 1;

/// Offset of the start of a ray from its vertex, as a fraction of the body's size.
const CLEAR: f64 = 1e-6;

/// Maximum number of triangles in a leaf of the tree.
const LEAF: usize = 8;

impl Topology {
    /// Its struts, computed on first use; none where the surface is open along a ray.
    #[must_use]
    pub fn struts(&self) -> &Edges {
        let find = || {
            let ends = struts(self);
            Arc::new(Edges::new(&ends, &self.rest, &self.partitions, false))
        };
        self.struts.0.get_or_init(find)
    }
}

/// Ends of all struts, without repetition and without existing edges.
fn struts(topology: &Topology) -> Vec<[u32; 2]> {
    let tree = Tree::of(topology);
    let outward = topology
        .enclosure()
        .map_or(1.0, |enclosure| enclosure.outward);
    let mut normals = vec![DVec3::ZERO; topology.rest.len()];
    for (corners, [a, b, c]) in topology.triangles.iter().zip(tree.corners.iter().copied()) {
        for &i in corners {
            normals[i as usize] += (b - a).cross(c - a) * outward;
        }
    }
    let mut random = Random::new(SEED);
    let tilts = topology.rest.iter().map(|_| {
        let mut along = || TILT * (2.0 * f64::from(random.next()) - 1.0);
        DVec3::new(along(), along(), along())
    });
    let tilts: Vec<DVec3> = tilts.collect();
    let ordered = |a: u32, b: u32| [a.min(b), a.max(b)];
    let mut edges: Vec<[u32; 2]> = topology.edges.ends().map(|[a, b]| ordered(a, b)).collect();
    edges.sort_unstable();
    let mut found = Vec::new();
    for (i, normal) in (0_u32..).zip(&normals) {
        let (Some(normal), tilt) = (
            normal.try_normalize(),
            tilts[topology.vertex(i as usize).index()],
        ) else {
            continue;
        };
        let from = topology.rest[i as usize].as_dvec3();
        let Some(across) = tree.leaves(topology, i, (from, tilt - normal), outward) else {
            continue;
        };
        let strut = ordered(i, across);
        if edges.binary_search(&strut).is_err() {
            found.push(strut);
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// Bounding volume hierarchy of the triangles of a surface, for ray queries.
struct Tree {
    /// Corner positions of each triangle, in the order of the topology [m].
    corners: Vec<[DVec3; 3]>,
    /// Numbers of triangles; each node has a contiguous range of them.
    order: Vec<usize>,
    nodes: Vec<Node>,
}

struct Node {
    low: DVec3,
    high: DVec3,
    triangles: Range<usize>,
    children: Option<[usize; 2]>,
}

impl Tree {
    fn of(topology: &Topology) -> Self {
        let at = |i: u32| topology.rest[i as usize].as_dvec3();
        let corners: Vec<_> = topology.triangles.iter().map(|c| c.map(at)).collect();
        let mut tree = Self {
            order: (0..corners.len()).collect(),
            nodes: Vec::new(),
            corners,
        };
        if !tree.order.is_empty() {
            tree.divide(0..tree.order.len());
        }
        tree
    }

    /// Creates the node for a range of triangles and the nodes below it; returns its number.
    fn divide(&mut self, triangles: Range<usize>) -> usize {
        let run = &mut self.order[triangles.clone()];
        let points = run.iter().flat_map(|&triangle| self.corners[triangle]);
        let (low, high) = points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        let number = self.nodes.len();
        let middle = triangles.start + triangles.len() / 2;
        if triangles.len() > LEAF {
            let extent = high - low;
            let axis = if extent.x >= extent.y && extent.x >= extent.z {
                0
            } else if extent.y >= extent.z {
                1
            } else {
                2
            };
            let center = |triangle: usize| -> f64 {
                self.corners[triangle]
                    .iter()
                    .map(|corner| corner[axis])
                    .sum()
            };
            run.sort_by(|&a, &b| center(a).total_cmp(&center(b)).then(a.cmp(&b)));
        }
        self.nodes.push(Node {
            low,
            high,
            triangles: triangles.clone(),
            children: None,
        });
        if triangles.len() > LEAF {
            let children = [triangles.start..middle, middle..triangles.end];
            let children = children.map(|half| self.divide(half));
            self.nodes[number].children = Some(children);
        }
        number
    }

    /// Vertex nearest to the point where a ray from vertex `own` leaves the body.
    fn leaves(
        &self,
        topology: &Topology,
        own: u32,
        (from, direction): (DVec3, DVec3),
        outward: f64,
    ) -> Option<u32> {
        let mut nearest = f64::INFINITY;
        let mut found = None;
        let mut waiting = vec![0; usize::from(!self.nodes.is_empty())];
        while let Some(number) = waiting.pop() {
            let node = &self.nodes[number];
            if !node.is_met(from, direction, nearest) {
                continue;
            }
            if let Some(children) = node.children {
                waiting.extend(children);
                continue;
            }
            for &triangle in &self.order[node.triangles.clone()] {
                let [a, b, c] = self.corners[triangle];
                let leaves = (b - a).cross(c - a).dot(direction) * outward > 0.0;
                let far = f64::from(topology.size) * CLEAR..nearest;
                if leaves
                    && !topology.triangles[triangle].contains(&own)
                    && let Some(way) = meets([a, b, c], from, direction)
                    && far.contains(&way)
                {
                    nearest = way;
                    found = Some(triangle);
                }
            }
        }
        let triangle = found?;
        let hit = from + direction * nearest;
        let corners = self.corners[triangle]
            .iter()
            .zip(topology.triangles[triangle]);
        let distances = corners.map(|(x, i)| (x.distance_squared(hit), i));
        distances.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, i)| i)
    }
}

impl Node {
    /// Whether a ray meets its box before `nearest`.
    fn is_met(&self, from: DVec3, direction: DVec3, nearest: f64) -> bool {
        let (a, b) = (
            (self.low - from) / direction,
            (self.high - from) / direction,
        );
        let enter = a.min(b).max_element().max(0.0);
        let leave = a.max(b).min_element();
        // A ray in the plane of a side gives NaN there, and does not miss.
        let misses = enter > leave || enter >= nearest;
        !misses
    }
}

/// Distance along a ray to a triangle, in lengths of `direction` (Möller and Trumbore 1997).
fn meets([a, b, c]: [DVec3; 3], from: DVec3, direction: DVec3) -> Option<f64> {
    let (u, v, to) = (b - a, c - a, from - a);
    let across = direction.cross(v);
    let determinant = u.dot(across);
    let first = to.dot(across) / determinant;
    let turned = to.cross(u);
    let second = direction.dot(turned) / determinant;
    let inside = first >= 0.0 && second >= 0.0 && first + second <= 1.0;
    inside.then(|| v.dot(turned) / determinant)
}
