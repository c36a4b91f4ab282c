//! The drawn form of a triangle surface: shared vertices, split along creases.
//!
//! Splitting is decided once, at rest: each face gets its own vertices along edges where two faces
//! meet at more than the crease angle, so that these stay sharp while a ball is smooth. Normals are
//! recomputed from the deformed points, weighted by area.

use bevy::prelude::*;
use std::collections::BTreeMap;

/// Crease angle of an imported surface [rad]: sharper edges are taken as intended.
pub const CREASE: f32 = 50.0 * std::f32::consts::PI / 180.0;
/// Crease angle of jelly [rad]: even the edges of a cube are rounded, over the width of a cell.
pub const ROUND: f32 = 100.0 * std::f32::consts::PI / 180.0;

/// A drawn surface, whose vertices are copies of the surface's points.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surface {
    /// For each drawn vertex, the point that it copies.
    pub source: Vec<u32>,
    /// Triangles over the drawn vertices, in the order of the input.
    pub triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// Splits `triangles` over `points` at rest along creases sharper than `crease` [rad].
    #[must_use]
    pub fn new(points: &[Vec3], triangles: &[[u32; 3]], crease: f32) -> Self {
        let normals: Vec<Vec3> = triangles
            .iter()
            .map(|&t| area_vector(t, points).normalize_or_zero())
            .collect();
        let flattest = crease.cos();
        let mut groups = Groups::new(3 * triangles.len());
        // Corner k of triangle t is 3t + k. Two triangles that share a smooth edge share the
        // vertices at both its ends.
        let mut edges: BTreeMap<[u32; 2], [usize; 3]> = BTreeMap::new();
        for (t, &triangle) in triangles.iter().enumerate() {
            for k in 0..3 {
                let (here, there) = (3 * t + k, 3 * t + (k + 1) % 3);
                let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
                let (key, ends) = if a < b {
                    ([a, b], [here, there])
                } else {
                    ([b, a], [there, here])
                };
                let &mut [other, low, high] = edges.entry(key).or_insert([t, ends[0], ends[1]]);
                if other != t && normals[other].dot(normals[t]) >= flattest {
                    groups.join(low, ends[0]);
                    groups.join(high, ends[1]);
                }
            }
        }
        let mut surface = Self::default();
        let mut drawn = vec![u32::MAX; 3 * triangles.len()];
        for (t, &triangle) in triangles.iter().enumerate() {
            let vertices = [0, 1, 2].map(|k| {
                let group = groups.find(3 * t + k);
                if drawn[group] == u32::MAX {
                    drawn[group] = surface.source.len() as u32;
                    surface.source.push(triangle[k]);
                }
                drawn[group]
            });
            surface.triangles.push(vertices);
        }
        surface
    }

    /// Writes positions and normals of the drawn vertices for the given points.
    pub fn draw(&self, points: &[Vec3], positions: &mut [[f32; 3]], normals: &mut [[f32; 3]]) {
        for (position, &source) in positions.iter_mut().zip(&self.source) {
            *position = points[source as usize].to_array();
        }
        normals.fill([0.0; 3]);
        for triangle in &self.triangles {
            let corners = triangle.map(|v| self.source[v as usize]);
            let area = area_vector(corners, points);
            for &vertex in triangle {
                let normal = &mut normals[vertex as usize];
                *normal = (Vec3::from_array(*normal) + area).to_array();
            }
        }
        for normal in normals {
            // The normals at this vertex cancel out: any direction will do.
            let unit = Vec3::from_array(*normal).try_normalize().unwrap_or(Vec3::Y);
            *normal = unit.to_array();
        }
    }
}

/// Twice a triangle's area, along its normal [m²].
fn area_vector(triangle: [u32; 3], points: &[Vec3]) -> Vec3 {
    let [a, b, c] = triangle.map(|i| points[i as usize]);
    (b - a).cross(c - a)
}

/// Disjoint sets of corners.
struct Groups(Vec<usize>);

impl Groups {
    fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    fn find(&mut self, mut at: usize) -> usize {
        while self.0[at] != at {
            self.0[at] = self.0[self.0[at]];
            at = self.0[at];
        }
        at
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b)] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two unit squares that share the edge from 0 to 1, the second raised by `angle`.
    fn hinge(angle: f32) -> ([Vec3; 6], [[u32; 3]; 4]) {
        let raised = Vec3::new(0.0, angle.sin(), -angle.cos());
        let points = [
            Vec3::ZERO,
            Vec3::X,
            Vec3::Z,
            Vec3::X + Vec3::Z,
            raised,
            Vec3::X + raised,
        ];
        (points, [[0, 2, 3], [0, 3, 1], [0, 1, 5], [0, 5, 4]])
    }

    fn draw(surface: &Surface, points: &[Vec3]) -> Vec<Vec3> {
        let mut positions = vec![[0.0; 3]; surface.source.len()];
        let mut normals = positions.clone();
        surface.draw(points, &mut positions, &mut normals);
        normals.into_iter().map(Vec3::from_array).collect()
    }

    #[test]
    fn a_gentle_bend_shares_its_vertices_and_a_sharp_one_does_not() {
        let (points, triangles) = hinge(0.5);
        assert_eq!(Surface::new(&points, &triangles, CREASE).source.len(), 6);
        let (points, triangles) = hinge(1.5);
        assert_eq!(Surface::new(&points, &triangles, CREASE).source.len(), 8);
    }

    #[test]
    fn every_drawn_corner_copies_the_corner_that_was_given() {
        let (points, triangles) = hinge(1.5);
        let surface = Surface::new(&points, &triangles, CREASE);
        let copied: Vec<_> = surface
            .triangles
            .iter()
            .map(|t| t.map(|v| surface.source[v as usize]))
            .collect();
        assert_eq!(copied, triangles);
    }

    #[test]
    fn normals_of_a_sheet_point_out_of_its_counter_clockwise_side() {
        let (points, triangles) = hinge(0.0);
        let surface = Surface::new(&points, &triangles, CREASE);
        // Unit squares in a plane: sums and lengths are exact.
        assert!(draw(&surface, &points).iter().all(|&n| n == Vec3::Y));
    }

    #[test]
    fn normals_follow_the_deformed_points_not_the_rest() {
        let (points, triangles) = hinge(0.0);
        let surface = Surface::new(&points, &triangles, CREASE);
        let turned = points.map(|p| Vec3::new(p.y, p.x, p.z));
        assert!(draw(&surface, &turned).iter().all(|&n| n == Vec3::NEG_X));
    }

    #[test]
    fn a_surface_squeezed_to_a_point_still_has_unit_normals() {
        let (points, triangles) = hinge(0.0);
        let surface = Surface::new(&points, &triangles, CREASE);
        let normals = draw(&surface, &[Vec3::ONE; 6]);
        assert!(normals.iter().all(|n| n.is_normalized()));
    }
}
