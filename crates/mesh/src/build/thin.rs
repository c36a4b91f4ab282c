//! Preserves parts of a solid that are too thin for its lattice: ears, handles, tails.
//!
//! A part that lies between lattice points has no point inside, so it would be missing or
//! disconnected. The lattice points nearest to the surface follow it everywhere without a gap. They
//! are marked as inside where they are needed: where no inside point is near, and where they
//! connect pieces that would be separate. Elsewhere they stay unchanged, and the filling keeps to
//! the surface.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::{
    elements::Pieces,
    lattice::{Lattice, firm_points},
};

/// Depth, in cells, assigned to a point outside that is needed inside.
const DEEP: f64 = 0.36;
/// Maximum distance assigned to its neighbors outside, in cells. Its edges are then cut at
/// DEEP / (DEEP + NEAR) = 0.419 of their length or farther: far enough for the point to stay in
/// place (see `WARP_SHORT`).
const NEAR: f64 = 0.5;

/// Adjusts the signed distances of the lattice points so that the filling is connected wherever the
/// surface is, and covers all of it.
pub(super) fn keep_thin_parts(
    lattice: &Lattice,
    distances: &mut [f64],
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
) {
    let needed = missing_points(lattice, distances, vertices, triangles);
    let is_needed = |point: u32| needed.binary_search(&point).is_ok();
    let (deep, near) = (DEEP * lattice.spacing, NEAR * lattice.spacing);
    lattice.for_each_edge(|a, b| {
        for (point, neighbor) in [(a, b), (b, a)] {
            if is_needed(point) {
                let distance = &mut distances[neighbor as usize];
                *distance = distance.max(-near);
            }
        }
    });
    for &point in &needed {
        let distance = &mut distances[point as usize];
        *distance = distance.max(deep);
    }
}

/// Lattice points not firmly inside that must count as inside for the filling to be connected and
/// to cover the whole surface. Sorted.
fn missing_points(
    lattice: &Lattice,
    distances: &[f64],
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
) -> Vec<u32> {
    let mut inside = firm_points(lattice, distances);
    let candidates = points_on_surface(lattice, &inside, vertices, triangles);
    let is_candidate = |point: u32| candidates.binary_search(&point).is_ok();

    let mut pieces = Pieces::new(distances.len());
    let mut neighbors: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    lattice.for_each_edge(|a, b| {
        if inside[a as usize] && inside[b as usize] {
            pieces.join(a, b);
        }
        for (a, b) in [(a, b), (b, a)] {
            if is_candidate(a) && (inside[b as usize] || is_candidate(b)) {
                neighbors.entry(a).or_default().push(b);
            }
        }
    });
    let neighbors = |point: u32| neighbors.get(&point).into_iter().flatten().copied();

    // Far from all inside points: always needed.
    let far: Vec<u32> = candidates
        .iter()
        .copied()
        .filter(|point| !neighbors(*point).any(|other| inside[other as usize]))
        .collect();
    let mut needed = far;
    for &point in &needed {
        inside[point as usize] = true;
    }
    for &point in &needed {
        for other in neighbors(point).filter(|other| inside[*other as usize]) {
            pieces.join(point, other);
        }
    }

    // Bridges between pieces, deepest first, skipped where the pieces are already connected. Each
    // point on the surface now touches a piece, so a bridge has at most two points.
    let mut by_depth = candidates.clone();
    by_depth.sort_by(|a, b| distances[*b as usize].total_cmp(&distances[*a as usize]));
    let mut add = |point: u32, inside: &mut [bool], pieces: &mut Pieces| {
        inside[point as usize] = true;
        needed.push(point);
        for other in neighbors(point).filter(|other| inside[*other as usize]) {
            pieces.join(point, other);
        }
    };
    for &point in &by_depth {
        let mut touched = neighbors(point)
            .filter(|other| inside[*other as usize])
            .map(|other| pieces.first_of(other));
        let first = touched.next();
        if !inside[point as usize] && touched.any(|other| Some(other) != first) {
            add(point, &mut inside, &mut pieces);
        }
    }
    for &point in &by_depth {
        for other in neighbors(point) {
            let touched = |point: u32, pieces: &mut Pieces| {
                if inside[point as usize] {
                    return Some(pieces.first_of(point));
                }
                let piece = neighbors(point).find(|other| inside[*other as usize]);
                piece.map(|other| pieces.first_of(other))
            };
            if touched(point, &mut pieces) != touched(other, &mut pieces) {
                for point in [point, other] {
                    if !inside[point as usize] {
                        add(point, &mut inside, &mut pieces);
                    }
                }
            }
        }
    }
    needed.sort_unstable();
    needed
}

/// Lattice points that are nearest to some point of the surface, except firm ones. Sorted.
fn points_on_surface(
    lattice: &Lattice,
    firm: &[bool],
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
) -> Vec<u32> {
    let mut points = Vec::new();
    for triangle in triangles {
        let [a, b, c] = triangle.map(|i| vertices[i as usize]);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        // Two samples per cell, so that no point is missed.
        let steps = (2.0 * longest / lattice.spacing).ceil().max(1.0) as u32;
        for i in 0..=steps {
            for j in 0..=steps - i {
                let (u, v) = (
                    f64::from(i) / f64::from(steps),
                    f64::from(j) / f64::from(steps),
                );
                let point = lattice.nearest(a + (b - a) * u + (c - a) * v);
                if !firm[point as usize] && points.last() != Some(&point) {
                    points.push(point);
                }
            }
        }
    }
    points.sort_unstable();
    points.dedup();
    points
}
