//! Compact pieces of a surface.

use super::bounds;
use glam::Vec3;

/// A compact piece of a surface.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Patch {
    /// Indices into the vertices of the surface: its own ones, then those of other patches that its elements use.
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

impl Patch {
    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
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
pub(super) fn patches(rest: &[Vec3], edges: &[[u32; 2]], triangles: &[[u32; 3]]) -> Vec<Patch> {
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
