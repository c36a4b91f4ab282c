//! Contact surface of a body.

use super::{bounds, features::Features, lazy::Lazy};
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
}

/// A compact piece of a surface.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Patch {
    /// Indices into [`Surface::vertices`]: its own ones, then those of other patches that its
    /// elements use.
    pub vertices: Vec<u32>,
    /// Number of its own vertices; each vertex belongs to one patch.
    pub own: usize,
    /// Its edges, as indices into `vertices`; each edge belongs to one patch.
    pub edges: Vec<[u32; 2]>,
    /// Its triangles, as indices into `vertices`; each triangle belongs to one patch.
    pub triangles: Vec<[u32; 3]>,
}

/// Maximum number of own vertices of a patch. Small patches follow local motion more closely; large
/// ones require fewer comparisons.
const PATCH: usize = 64;

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
        }
    }

    /// Where it can touch others first, if it is rigid.
    pub(crate) fn features(&self) -> &Features {
        self.features
            .0
            .get_or_init(|| Features::of(&self.rest, &self.edges, &self.triangles))
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
    }
}

impl Patch {
    fn bytes(&self) -> usize {
        size_of_val(&self.vertices[..])
            + size_of_val(&self.edges[..])
            + size_of_val(&self.triangles[..])
    }

    /// Index of a surface vertex in this patch; `places` are the indices of its vertices so far.
    fn place(&mut self, vertex: u32, places: &mut [u32]) -> u32 {
        let place = &mut places[vertex as usize];
        if *place == u32::MAX {
            *place = self.vertices.len() as u32;
            self.vertices.push(vertex);
        }
        *place
    }
}

/// Divides a surface into patches: bisects along the longest side of the box around the rest
/// positions until they are small enough. An element belongs to the patch of its first vertex.
fn patches(rest: &[Vec3], edges: &[[u32; 2]], triangles: &[[u32; 3]]) -> Vec<Patch> {
    let mut all: Vec<u32> = (0..rest.len() as u32).collect();
    let mut patches = Vec::new();
    cut(&mut all, rest, &mut patches);
    let mut owner = vec![0; rest.len()];
    for (number, patch) in patches.iter().enumerate() {
        for &vertex in &patch.vertices {
            owner[vertex as usize] = number;
        }
    }
    let mut places = vec![u32::MAX; rest.len()];
    let mut edges_of = vec![Vec::new(); patches.len()];
    let mut triangles_of = vec![Vec::new(); patches.len()];
    for edge in edges {
        edges_of[owner[edge[0] as usize]].push(*edge);
    }
    for triangle in triangles {
        triangles_of[owner[triangle[0] as usize]].push(*triangle);
    }
    for (patch, (edges, triangles)) in patches.iter_mut().zip(edges_of.iter().zip(&triangles_of)) {
        for (place, &vertex) in (0..).zip(&patch.vertices) {
            places[vertex as usize] = place;
        }
        for edge in edges {
            let edge = edge.map(|vertex| patch.place(vertex, &mut places));
            patch.edges.push(edge);
        }
        for triangle in triangles {
            let triangle = triangle.map(|vertex| patch.place(vertex, &mut places));
            patch.triangles.push(triangle);
        }
        for &vertex in &patch.vertices {
            places[vertex as usize] = u32::MAX;
        }
    }
    patches
}

fn cut(vertices: &mut [u32], rest: &[Vec3], patches: &mut Vec<Patch>) {
    if vertices.len() <= PATCH {
        vertices.sort_unstable();
        patches.push(Patch {
            vertices: vertices.to_vec(),
            own: vertices.len(),
            ..Patch::default()
        });
        return;
    }
    let (low, high) = bounds(vertices.iter().map(|&vertex| rest[vertex as usize]));
    let axis = (high - low).max_position();
    let along = |vertex: u32| rest[vertex as usize][axis];
    vertices.sort_unstable_by(|&a, &b| along(a).total_cmp(&along(b)).then(a.cmp(&b)));
    let (first, second) = vertices.split_at_mut(vertices.len() / 2);
    cut(first, rest, patches);
    cut(second, rest, patches);
}
