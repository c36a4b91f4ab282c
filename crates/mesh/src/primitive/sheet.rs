//! Cloth, tubes, balloons and ropes: shapes without volume.

use std::{collections::BTreeMap, f64::consts::TAU};

use glam::{DVec3, UVec2, Vec2, Vec3};

use super::Diagonals;
use crate::edges;
use pliant_solver::RestShape;

/// A rectangular cloth. The triangles face up.
pub(super) fn cloth(size: Vec2, cells: UVec2, diagonals: Diagonals, shear: bool) -> RestShape {
    let particle = |i: u32, j: u32| j * (cells.x + 1) + i;
    let mut vertices = Vec::new();
    for j in 0..=cells.y {
        for i in 0..=cells.x {
            let fraction = Vec2::new(i as f32, j as f32) / cells.as_vec2();
            let place = (fraction - 0.5) * size;
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
        ..RestShape::default()
    }
}

/// An open tube around the y axis. The triangles face outwards, their diagonals alternate as far as
/// the number of cells around is even.
pub(super) fn tube(radius: f32, height: f32, cells: UVec2) -> RestShape {
    let particle = |i: u32, j: u32| j * cells.x + i % cells.x;
    let mut vertices = Vec::new();
    for j in 0..=cells.y {
        let y = (j as f32 / cells.y as f32 - 0.5) * height;
        for i in 0..cells.x {
            let angle = TAU * f64::from(i) / f64::from(cells.x);
            let [x, z] = [libm::cos(angle), -libm::sin(angle)].map(|it| it as f32 * radius);
            vertices.push(Vec3::new(x, y, z));
        }
    }
    let mut triangles = Vec::new();
    for j in 0..cells.y {
        for i in 0..cells.x {
            let [a, b] = [particle(i, j), particle(i + 1, j)];
            let [c, d] = [particle(i, j + 1), particle(i + 1, j + 1)];
            if (i + j) % 2 == 1 {
                triangles.extend([[a, d, c], [a, b, d]]);
            } else {
                triangles.extend([[a, b, c], [b, d, c]]);
            }
        }
    }
    RestShape {
        edges: edges(&[], &triangles),
        vertices,
        tetrahedra: Vec::new(),
        triangles,
        ..RestShape::default()
    }
}

/// A closed surface of triangles around the origin, facing outwards.
pub(super) fn balloon(radius: f32, cells: u32) -> RestShape {
    let corners = icosahedron();
    let mut numbers = BTreeMap::new();
    let mut vertices = Vec::new();
    // A vertex is identified by the corners that it lies between and its weights.
    let mut vertex = |weights: [(usize, u32); 3]| {
        let mut key = weights;
        key.sort_unstable();
        let key: Vec<_> = key.into_iter().filter(|(_, weight)| *weight > 0).collect();
        *numbers.entry(key).or_insert_with_key(|key| {
            let terms = key.iter();
            let sum: DVec3 = terms
                .map(|&(i, weight)| corners[i] * f64::from(weight))
                .sum();
            vertices.push((sum.normalize() * f64::from(radius)).as_vec3());
            vertices.len() as u32 - 1
        })
    };
    let mut triangles = Vec::new();
    for face in FACES {
        let mut at = |i: u32, j: u32| {
            let weights = [cells - i - j, i, j];
            vertex([0, 1, 2].map(|k| (face[k], weights[k])))
        };
        for j in 0..cells {
            for i in 0..cells - j {
                triangles.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
                if i + j + 1 < cells {
                    triangles.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
    }
    RestShape {
        edges: edges(&[], &triangles),
        vertices,
        tetrahedra: Vec::new(),
        triangles,
        ..RestShape::default()
    }
}

/// The faces of [`icosahedron`], counter-clockwise from outside.
const FACES: [[usize; 3]; 20] = [
    [0, 11, 5],
    [0, 5, 1],
    [0, 1, 7],
    [0, 7, 10],
    [0, 10, 11],
    [1, 5, 9],
    [5, 11, 4],
    [11, 10, 2],
    [10, 7, 6],
    [7, 1, 8],
    [3, 9, 4],
    [3, 4, 2],
    [3, 2, 6],
    [3, 6, 8],
    [3, 8, 9],
    [4, 9, 5],
    [2, 4, 11],
    [6, 2, 10],
    [8, 6, 7],
    [9, 8, 1],
];

/// Corners of three mutually perpendicular golden rectangles.
fn icosahedron() -> [DVec3; 12] {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    [
        (-1.0, golden, 0.0),
        (1.0, golden, 0.0),
        (-1.0, -golden, 0.0),
        (1.0, -golden, 0.0),
        (0.0, -1.0, golden),
        (0.0, 1.0, golden),
        (0.0, -1.0, -golden),
        (0.0, 1.0, -golden),
        (golden, 0.0, -1.0),
        (golden, 0.0, 1.0),
        (-golden, 0.0, -1.0),
        (-golden, 0.0, 1.0),
    ]
    .map(DVec3::from)
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

pub(super) fn coil(radius: f32, height: f32, turns: f32, segments: u32) -> RestShape {
    let place = |i: u32| {
        let part = f64::from(i) / f64::from(segments);
        let angle = f64::from(turns) * part * TAU;
        let [x, z] = [libm::cos(angle), libm::sin(angle)].map(|it| it as f32 * radius);
        Vec3::new(x, (f64::from(height) * (0.5 - part)) as f32, z)
    };
    RestShape {
        vertices: (0..=segments).map(place).collect(),
        edges: (0..segments).map(|i| [i, i + 1]).collect(),
        ..RestShape::default()
    }
}

/// A ring of edges about the z axis.
pub(super) fn hoop(radius: f32, segments: u32) -> RestShape {
    let place = |i: u32| {
        let angle = f64::from(i) / f64::from(segments) * TAU;
        let [x, y] = [libm::cos(angle), libm::sin(angle)].map(|it| it as f32 * radius);
        Vec3::new(x, y, 0.0)
    };
    RestShape {
        vertices: (0..segments).map(place).collect(),
        edges: (0..segments).map(|i| [i, (i + 1) % segments]).collect(),
        ..RestShape::default()
    }
}
