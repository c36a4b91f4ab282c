//! An edge that crosses a triangle, and the regions into which such edges divide a surface.

use super::{bounds::Bounds, intersect::around};
use crate::topology::{surface::Surface, union::root};
use glam::DVec3;

/// An edge that crosses a triangle of the same surface, or of a closed collider.
#[derive(Debug, Clone)]
pub(super) struct Crossing {
    /// Indices of the members of the edge and of the triangle.
    pub members: [u32; 2],
    /// Surface vertices of the edge and of the triangle.
    pub edge: [u32; 2],
    pub triangle: [u32; 3],
    /// Weights of the crossing point, those of the triangle negative.
    pub weights: [f64; 5],
    /// Direction in which the edge leaves the triangle, a unit vector, and the fraction of the recovery
    /// speed.
    pub direction: DVec3,
    pub fraction: f64,
    /// W [1/kg].
    pub inverse_mass: f64,
    /// λ [kg·m].
    pub multiplier: f64,
}

/// Buffers for regions, reused.
#[derive(Debug, Default)]
pub(super) struct Regions {
    /// Parent of each vertex of the surface; roots are their own.
    parents: Vec<u32>,
    /// Number of vertices of each root.
    sizes: Vec<u32>,
    /// Crossing edges, sorted, and the third corners of the triangles of each.
    pub cut: Vec<[u32; 2]>,
    thirds: Vec<([u32; 2], u32)>,
}

impl Regions {
    /// Divides a surface by crossing edges.
    pub fn divide(&mut self, surface: &Surface) {
        let vertices = surface.vertices.len();
        let Self {
            parents,
            sizes,
            cut,
            thirds,
        } = self;
        cut.sort_unstable();
        let sides = |&[a, b, c]: &[u32; 3]| [([a, b], c), ([b, c], a), ([c, a], b)];
        let sides = surface.triangles.iter().flat_map(sides);
        let sides = sides.map(|([a, b], third)| ([a.min(b), a.max(b)], third));
        thirds.clear();
        thirds.extend(sides.filter(|(edge, _)| cut.binary_search(edge).is_ok()));
        thirds.sort_unstable();
        parents.clear();
        parents.extend(0..vertices as u32);
        for edge in &surface.edges {
            if cut.binary_search(edge).is_err() {
                let [a, b] = edge.map(|vertex| root(parents, vertex));
                parents[a.max(b) as usize] = a.min(b);
            }
        }
        sizes.clear();
        sizes.resize(vertices, 0);
        for vertex in 0..vertices as u32 {
            sizes[root(parents, vertex) as usize] += 1;
        }
    }

    /// Third corners of the triangles of a crossing edge.
    pub fn thirds(&self, [a, b]: [u32; 2]) -> impl Iterator<Item = u32> + '_ {
        let edge = [a.min(b), a.max(b)];
        let from = self.thirds.partition_point(|it| it.0 < edge);
        let of_edge = self.thirds[from..]
            .iter()
            .take_while(move |it| it.0 == edge);
        of_edge.map(|it| it.1)
    }

    /// Whether the region of the first vertex is smaller than that of the second; `None` if both are
    /// in one region, or the regions are equal.
    pub fn is_smaller(&mut self, vertices: [u32; 2]) -> Option<bool> {
        let [a, b] = vertices.map(|vertex| root(&mut self.parents, vertex));
        let [of_a, of_b] = [a, b].map(|root| self.sizes[root as usize]);
        (a != b && of_a != of_b).then_some(of_a < of_b)
    }
}

impl Crossing {
    pub fn new(members: [u32; 2], edge: [u32; 2], triangle: [u32; 3]) -> Self {
        Self {
            members,
            edge,
            triangle,
            weights: [0.0; 5],
            direction: DVec3::ZERO,
            fraction: 0.0,
            inverse_mass: 0.0,
            multiplier: 0.0,
        }
    }

    /// Box around it [m].
    pub fn bounds(&self, starts: &[DVec3]) -> Bounds {
        let at = |v: u32| starts[v as usize];
        let [p, q] = self.edge.map(at);
        let [a, b, c] = self.triangle.map(at);
        around(&[p, q, a, b, c])
    }

    pub fn vertices(&self) -> [u32; 5] {
        let ([p, q], [a, b, c]) = (self.edge, self.triangle);
        [p, q, a, b, c]
    }

    /// Finds the weights of the crossing point; its unit normal of the triangle and direction of the
    /// edge. `None` without an area.
    pub fn locate(&mut self, starts: &[DVec3], inverse_masses: &[f64]) -> Option<[DVec3; 2]> {
        let [p, q] = self.edge.map(|v| starts[v as usize]);
        let [a, b, c] = self.triangle.map(|v| starts[v as usize]);
        let area = (b - a).cross(c - a);
        let (normal, along) = (area.try_normalize()?, (q - p).try_normalize()?);
        let s = (normal.dot(a - p) / normal.dot(q - p)).clamp(0.0, 1.0);
        let point = p + (q - p) * s - a;
        let of_b = normal.dot(point.cross(c - a)) / area.length();
        let of_c = normal.dot((b - a).cross(point)) / area.length();
        self.weights = [1.0 - s, s, of_b + of_c - 1.0, -of_b, -of_c];
        let each = self.weights.iter().zip(self.vertices());
        self.inverse_mass = each.map(|(b, v)| b * b * inverse_masses[v as usize]).sum();
        Some([normal, along])
    }
}
