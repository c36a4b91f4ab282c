//! Cloth and rope: shapes without volume.

use glam::{UVec2, Vec2, Vec3};

use super::Diagonals;
use crate::mesh::edges;
use crate::solver::RestShape;

/// A rectangular cloth. The triangles face up.
pub(super) fn cloth(size: Vec2, cells: UVec2, diagonals: Diagonals, shear: bool) -> RestShape {
    let particle = |i: u32, j: u32| j * (cells.x + 1) + i;
    let mut vertices = Vec::new();
    for j in 0..=cells.y {
        for i in 0..=cells.x {
            let share = Vec2::new(i as f32, j as f32) / cells.as_vec2();
            let place = (share - 0.5) * size;
            vertices.push(Vec3::new(place.x, 0.0, place.y));
        }
    }
    let mut triangles = Vec::new();
    let mut edges_across = Vec::new();
    for j in 0..cells.y {
        for i in 0..cells.x {
            let [a, b] = [particle(i, j), particle(i + 1, j)];
            let [c, d] = [particle(i, j + 1), particle(i + 1, j + 1)];
            if diagonals == Diagonals::Alternating && (i + j) % 2 == 1 {
                triangles.extend([[a, c, d], [a, d, b]]);
                edges_across.push([b, c]);
            } else {
                triangles.extend([[a, c, b], [b, c, d]]);
                edges_across.push([a, d]);
            }
        }
    }
    let mut edges = edges(&[], &triangles);
    if shear {
        edges.extend(edges_across);
        edges.sort_unstable();
    }
    RestShape {
        vertices,
        edges,
        tetrahedra: Vec::new(),
        triangles,
    }
}

/// A straight rope.
pub(super) fn rope(length: f32, segments: u32) -> RestShape {
    RestShape {
        vertices: (0..=segments)
            .map(|i| Vec3::X * (length * (i as f32 / segments as f32 - 0.5)))
            .collect(),
        edges: (0..segments).map(|i| [i, i + 1]).collect(),
        ..RestShape::default()
    }
}
