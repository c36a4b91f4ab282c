//! Ray intersection with deformed surfaces: body, triangle, and barycentric weights.
//!
//! Plain geometry on slices. A hit has the corners of a triangle with barycentric weights (or of a
//! rope segment with two), not just the nearest vertex.

use bevy::prelude::*;

/// Intersection of a ray with a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance along the ray [m].
    pub distance: f32,
    /// Corners of the triangle; for a segment, the last is repeated.
    pub corners: [u32; 3],
    /// Weights of the corners: not negative, sum 1.
    pub weights: [f32; 3],
}

/// Whether a ray meets an axis-aligned box (slab test).
#[must_use]
pub fn meets_box(ray: Ray3d, low: Vec3, high: Vec3) -> bool {
    let inverse = ray.direction.as_vec3().recip();
    let (a, b) = ((low - ray.origin) * inverse, (high - ray.origin) * inverse);
    let enter = a.min(b).max_element();
    let leave = a.max(b).min_element();
    // A ray in the plane of a slab gives NaN, which counts as a hit; the triangles decide.
    let misses = leave < enter.max(0.0);
    !misses
}

/// The nearest triangle that the ray meets, from either side (Möller and Trumbore 1997).
#[must_use]
pub fn on_triangles(ray: Ray3d, triangles: &[[u32; 3]], points: &[Vec3]) -> Option<Hit> {
    let direction = ray.direction.as_vec3();
    let mut best: Option<Hit> = None;
    for &corners in triangles {
        let [a, b, c] = corners.map(|i| points[i as usize]);
        let (ab, ac) = (b - a, c - a);
        let across = direction.cross(ac);
        let determinant = ab.dot(across);
        if determinant == 0.0 {
            continue;
        }
        let from = ray.origin - a;
        let u = from.dot(across) / determinant;
        if !(0.0..=1.0).contains(&u) {
            continue;
        }
        let turned = from.cross(ab);
        let v = direction.dot(turned) / determinant;
        if v < 0.0 || u + v > 1.0 {
            continue;
        }
        let distance = ac.dot(turned) / determinant;
        if distance > 0.0 && best.is_none_or(|best| distance < best.distance) {
            best = Some(Hit {
                distance,
                corners,
                weights: [1.0 - u - v, u, v],
            });
        }
    }
    best
}

/// The nearest ball that the ray meets from outside; `radii` of the balls [m].
#[must_use]
pub fn on_balls(ray: Ray3d, radii: &[f32], points: &[Vec3]) -> Option<Hit> {
    let direction = ray.direction.as_vec3();
    let hits = (0..)
        .zip(points.iter().zip(radii))
        .filter_map(|(i, (&center, &radius))| {
            let to = center - ray.origin;
            let along = to.dot(direction);
            let beside = to.length_squared() - along * along;
            let half = radius * radius - beside;
            (half >= 0.0 && along > 0.0).then(|| Hit {
                distance: along - half.sqrt(),
                corners: [i; 3],
                weights: [1.0, 0.0, 0.0],
            })
        });
    hits.min_by(|a, b| a.distance.total_cmp(&b.distance))
}

/// The segment that the ray passes closest to, if it passes within `radius` [m] plus
/// `reach` [m/m] times the distance.
#[must_use]
pub fn on_segments(
    ray: Ray3d,
    reach: f32,
    radius: f32,
    segments: &[[u32; 2]],
    points: &[Vec3],
) -> Option<Hit> {
    let direction = ray.direction.as_vec3();
    let mut best: Option<(f32, Hit)> = None;
    for &[i, j] in segments {
        let (a, b) = (points[i as usize], points[j as usize]);
        let fraction = closest_fraction(ray.origin, direction, a, b);
        let point = a.lerp(b, fraction);
        let distance = (point - ray.origin).dot(direction);
        if distance <= 0.0 {
            continue;
        }
        // Distance from the axis relative to the tolerance.
        let beside = (ray.origin + direction * distance).distance(point);
        let miss = beside / (radius + reach * distance);
        if miss <= 1.0 && best.is_none_or(|(least, _)| miss < least) {
            let hit = Hit {
                distance,
                corners: [i, j, j],
                weights: [1.0 - fraction, fraction, 0.0],
            };
            best = Some((miss, hit));
        }
    }
    best.map(|(_, hit)| hit)
}

/// Parameter of the point on the segment from `a` to `b` that is closest to a line, 0 to 1.
fn closest_fraction(origin: Vec3, direction: Vec3, a: Vec3, b: Vec3) -> f32 {
    // Projected along the line, this is the distance of a point to a segment in a plane.
    let flat = |v: Vec3| v - direction * v.dot(direction);
    let (edge, to_origin) = (flat(b - a), flat(origin - a));
    let length_squared = edge.length_squared();
    if length_squared == 0.0 {
        return 0.5;
    }
    (to_origin.dot(edge) / length_squared).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn down_at(x: f32, z: f32) -> Ray3d {
        Ray3d::new(Vec3::new(x, 5.0, z), Dir3::NEG_Y)
    }

    const TRIANGLE: [Vec3; 3] = [
        Vec3::new(0.0, 1.0, 0.0),
        Vec3::new(4.0, 1.0, 0.0),
        Vec3::new(0.0, 1.0, 4.0),
    ];

    #[test]
    fn weights_rebuild_the_point_that_was_hit() {
        let hit = on_triangles(down_at(1.0, 2.0), &[[0, 1, 2]], &TRIANGLE).expect("inside");
        let point: Vec3 = (0..3)
            .map(|k| TRIANGLE[hit.corners[k] as usize] * hit.weights[k])
            .sum();
        // Quarters and halves: every operation is exact.
        assert_eq!(point, Vec3::new(1.0, 1.0, 2.0));
        assert_eq!(hit.distance, 4.0);
    }

    #[test]
    fn a_ray_beside_or_away_from_a_triangle_misses() {
        assert_eq!(
            on_triangles(down_at(3.0, 3.0), &[[0, 1, 2]], &TRIANGLE),
            None
        );
        let up = Ray3d::new(Vec3::new(1.0, 5.0, 1.0), Dir3::Y);
        assert_eq!(on_triangles(up, &[[0, 1, 2]], &TRIANGLE), None);
    }

    #[test]
    fn a_triangle_is_hit_from_behind_too() {
        let hit = on_triangles(down_at(1.0, 1.0), &[[0, 2, 1]], &TRIANGLE);
        assert!(hit.is_some(), "cloth has two sides");
    }

    #[test]
    fn the_nearer_of_two_triangles_wins_whatever_their_order() {
        let points: Vec<Vec3> = TRIANGLE
            .iter()
            .copied()
            .chain(TRIANGLE.map(|p| p + Vec3::Y))
            .collect();
        for triangles in [[[0, 1, 2], [3, 4, 5]], [[3, 4, 5], [0, 1, 2]]] {
            let hit = on_triangles(down_at(1.0, 1.0), &triangles, &points).expect("both are below");
            assert_eq!(hit.corners, [3, 4, 5]);
        }
    }

    #[test]
    fn a_flat_triangle_is_never_hit() {
        let line = [Vec3::ZERO, Vec3::X, Vec3::X * 2.0];
        assert_eq!(on_triangles(down_at(0.5, 0.0), &[[0, 1, 2]], &line), None);
    }

    #[test]
    fn a_rope_is_taken_within_reach_and_not_beyond() {
        let rope = [Vec3::ZERO, Vec3::X * 4.0];
        // 5 m below the ray's origin, reach 0.1 m/m: taken up to 0.5 m beside it.
        let near = on_segments(down_at(1.0, 0.4), 0.1, 0.0, &[[0, 1]], &rope).expect("0.4 < 0.5");
        assert_eq!(near.weights, [0.75, 0.25, 0.0]);
        assert_eq!(
            on_segments(down_at(1.0, 0.6), 0.1, 0.0, &[[0, 1]], &rope),
            None
        );
    }

    #[test]
    fn a_ray_along_a_rope_takes_its_middle() {
        let rope = [Vec3::ZERO, Vec3::NEG_Y * 2.0];
        let hit = on_segments(down_at(0.0, 0.0), 0.1, 0.0, &[[0, 1]], &rope).expect("on the axis");
        assert_eq!(hit.weights, [0.5, 0.5, 0.0]);
    }

    #[test]
    fn a_box_is_met_from_outside_inside_and_along_its_faces() {
        let (low, high) = (Vec3::NEG_ONE, Vec3::ONE);
        assert!(meets_box(down_at(0.0, 0.0), low, high));
        assert!(meets_box(Ray3d::new(Vec3::ZERO, Dir3::X), low, high));
        assert!(meets_box(down_at(1.0, 1.0), low, high));
        assert!(!meets_box(down_at(2.0, 0.0), low, high));
        assert!(!meets_box(Ray3d::new(Vec3::Y * 5.0, Dir3::Y), low, high));
    }
}
