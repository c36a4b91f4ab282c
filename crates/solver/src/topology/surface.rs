//! Contact surface of a body.

use super::{
    chart::Chart,
    features::Features,
    lazy::Lazy,
    patches::{Patch, patches},
};
use crate::Topology;
use glam::Vec3;

/// The vertices, edges and triangles of the surface of a body; of a rope, its particles and edges; of
/// grains, their centers.
/// Edges and triangles are indices into `vertices`.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Particles, in ascending order.
    pub vertices: Vec<u32>,
    /// Their rest positions [m].
    pub rest: Vec<Vec3>,
    /// Unique edges.
    pub edges: Vec<[u32; 2]>,
    /// As [`Topology::triangles`].
    pub triangles: Vec<[u32; 3]>,
    /// Radius of each vertex [m]; empty unless they are grains.
    pub radii: Vec<f32>,
    /// The largest radius of a vertex [m]; 0 unless they are grains.
    pub largest_radius: f32,
    /// Mean length of an edge at rest [m]; 0 without edges.
    pub mean_edge: f32,
    /// Length of the longest edge at rest [m]; 0 without edges.
    pub longest_edge: f32,
    /// The surface divided into compact pieces.
    pub patches: Vec<Patch>,
    /// Computed on first use.
    features: Lazy<Features>,
    chart: Lazy<Chart>,
}

impl Surface {
    /// For a body with triangles, these; otherwise all edges; without edges, the particles.
    pub(crate) fn of(topology: &Topology) -> Self {
        let edges = topology.edges.ends().collect();
        Self {
            // Without edges, all particles are vertices.
            radii: topology.radii.to_vec(),
            largest_radius: topology.largest_radius(),
            ..Self::new(&topology.rest, edges, topology.triangles.to_vec())
        }
    }

    /// For triangles between points [m].
    pub(crate) fn of_triangles(points: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        Self::new(points, Vec::new(), triangles.to_vec())
    }

    fn new(points: &[Vec3], mut edges: Vec<[u32; 2]>, mut triangles: Vec<[u32; 3]>) -> Self {
        if !triangles.is_empty() {
            let sides = |[a, b, c]: &[u32; 3]| [[*a, *b], [*b, *c], [*c, *a]];
            edges.clear();
            edges.extend(triangles.iter().flat_map(sides));
        }
        for [a, b] in &mut edges {
            (*a, *b) = (*a.min(b), *a.max(b));
        }
        edges.sort_unstable();
        edges.dedup();
        let mut vertices: Vec<u32> = edges.iter().flatten().copied().collect();
        if edges.is_empty() {
            vertices.extend(0..points.len() as u32);
        }
        vertices.sort_unstable();
        vertices.dedup();
        let length = |[a, b]: &[u32; 2]| (points[*a as usize] - points[*b as usize]).length();
        let sum: f64 = edges.iter().map(|edge| f64::from(length(edge))).sum();
        let mean_edge = (sum / edges.len().max(1) as f64) as f32;
        let longest_edge = edges.iter().map(length).fold(0.0, f32::max);
        let mut place = vec![0; points.len()];
        for (at, &particle) in vertices.iter().enumerate() {
            place[particle as usize] = at as u32;
        }
        let places = edges.iter_mut().flatten();
        for corner in places.chain(triangles.iter_mut().flatten()) {
            *corner = place[*corner as usize];
        }
        let rest: Vec<Vec3> = vertices.iter().map(|&i| points[i as usize]).collect();
        let patches = patches(&rest, &edges, &triangles);
        Self {
            rest,
            patches,
            vertices,
            edges,
            triangles,
            mean_edge,
            longest_edge,
            radii: Vec::new(),
            largest_radius: 0.0,
            features: Lazy::default(),
            chart: Lazy::default(),
        }
    }

    /// Where it can touch others first, if it is rigid.
    pub(crate) fn features(&self) -> &Features {
        self.features
            .0
            .get_or_init(|| Features::of(&self.rest, &self.edges, &self.triangles))
    }

    /// Its chart, for contact with itself.
    pub(crate) fn chart(&self) -> &Chart {
        let chart = || Chart::of(&self.rest, &self.triangles, &self.patches);
        self.chart.0.get_or_init(chart)
    }

    /// Whether every edge has two triangles.
    pub(crate) fn is_closed(&self) -> bool {
        3 * self.triangles.len() == 2 * self.edges.len()
    }

    /// Memory use in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&self.vertices[..])
            + size_of_val(&self.rest[..])
            + size_of_val(&self.radii[..])
            + size_of_val(&self.edges[..])
            + size_of_val(&self.triangles[..])
            + self.patches.iter().map(Patch::bytes).sum::<usize>()
            + self.features.0.get().map_or(0, Features::bytes)
            + self.chart.0.get().map_or(0, Chart::bytes)
    }
}
