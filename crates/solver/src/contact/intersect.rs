//! Whether a segment and a triangle meet, exactly (Shewchuk 1997), and boxes around both.

use super::{bounds::Bounds, closest::Kind, row::NO_GAP};
use glam::{DVec3, Vec3A};
use robust::{Coord3D, orient3d};

/// Margin of the boxes, as a fraction of the largest coordinate: a few ε of `f32`.
const SLACK: f64 = 1e-6;

/// Whether a segment passes through a triangle.
pub(super) fn crosses([p, q]: [DVec3; 2], [a, b, c]: [DVec3; 3]) -> bool {
    let [first, last] = [side(a, b, c, p), side(a, b, c, q)];
    if !(first > 0.0 && last < 0.0 || first < 0.0 && last > 0.0) {
        return false;
    }
    let turns = [side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)];
    turns.iter().all(|turn| *turn > 0.0) || turns.iter().all(|turn| *turn < 0.0)
}

/// Whether the distance of a segment and a triangle that do not cross is 0, up to rounding: it has no
/// direction.
pub(super) fn touches([p, q]: [DVec3; 2], [a, b, c]: [DVec3; 3]) -> bool {
    let of_ends = [p, q].map(|end| Kind::VertexTriangle.distance([end, a, b, c]));
    let of_edges = [[a, b], [b, c], [c, a]].map(|[a, b]| Kind::EdgeEdge.distance([p, q, a, b]));
    of_ends.into_iter().chain(of_edges).any(|gap| gap <= NO_GAP)
}

/// On which side of the plane through three points a fourth lies: its sign is exact, and above 0 where
/// they turn clockwise, seen from there.
fn side(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> f64 {
    let [a, b, c, d] = [a, b, c, d].map(|DVec3 { x, y, z }| Coord3D { x, y, z });
    orient3d(a, b, c, d)
}

/// Box around points [m], with a margin for rounding.
pub(super) fn around(points: &[DVec3]) -> Bounds {
    points.iter().fold(Bounds::EMPTY, |all, point| {
        let slack = (point.abs().max_element() * SLACK) as f32;
        let at: Vec3A = point.as_vec3a();
        all.with(Bounds::around(at, at).grown(slack))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_segment_crosses_a_triangle_only_inside_of_it() {
        let triangle = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let through = |x: f64, y: f64| {
            let at = DVec3::new(x, y, 0.0);
            crosses([at - DVec3::Z, at + DVec3::Z], triangle)
        };
        assert!(through(0.2, 0.2));
        assert!(!through(0.6, 0.6), "beside it");
        assert!(!through(0.5, 0.0), "on its border");
        let above = [DVec3::new(0.2, 0.2, 1.0), DVec3::new(0.2, 0.2, 1e-300)];
        assert!(!crosses(above, triangle), "above it");
    }

    #[test]
    fn a_segment_touches_a_triangle_where_it_ends_on_it_or_meets_its_border() {
        let triangle = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let at = DVec3::new;
        let from = at(0.2, 0.2, 1.0);
        assert!(touches([from, at(0.2, 0.3, 0.0)], triangle), "an end");
        assert!(touches([from, at(0.2, 0.3, 1e-17)], triangle), "rounding");
        assert!(!touches([from, at(0.2, 0.3, 1e-9)], triangle), "above it");
        assert!(!touches([from, at(0.6, 0.6, 0.0)], triangle), "beside it");
        let across = [at(0.5, -1.0, -1.0), at(0.5, 1.0, 1.0)];
        assert!(touches(across, triangle), "an edge");
    }
}
