//! Closest points of a vertex and a triangle, and of two edges.
//!
//! Source: Ericson, *Real-Time Collision Detection* (2005), sections 5.1.5 and 5.1.9.

use glam::DVec3;

/// Two primitives with at most four corners in total; of fewer, the last one is repeated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Corner 0 is a vertex, the others a triangle.
    VertexTriangle,
    /// Corners 0 and 1 are an edge, the others another.
    EdgeEdge,
    /// Corner 0 is a vertex, 1 and 2 an edge.
    VertexEdge,
    /// Corners 0 and 1 are vertices.
    VertexVertex,
}

impl Kind {
    /// Number of corners of the first primitive.
    pub const fn split(self) -> usize {
        match self {
            Self::VertexTriangle | Self::VertexEdge | Self::VertexVertex => 1,
            Self::EdgeEdge => 2,
        }
    }

    /// Weights of the corners, Σ = 0: the closest point of the first primitive minus that of the
    /// second is the weighted sum of the corners [m].
    pub fn weights(self, x: [DVec3; 4]) -> [f64; 4] {
        match self {
            Self::VertexTriangle => {
                let [a, b, c] = on_triangle(x[0], [x[1], x[2], x[3]]);
                [1.0, -a, -b, -c]
            }
            Self::EdgeEdge => {
                let [s, t] = on_edges([x[0], x[1]], [x[2], x[3]]);
                [1.0 - s, s, t - 1.0, -t]
            }
            Self::VertexEdge => {
                let [_, t] = on_edges([x[0]; 2], [x[1], x[2]]);
                [1.0, t - 1.0, -t, 0.0]
            }
            Self::VertexVertex => [1.0, -1.0, 0.0, 0.0],
        }
    }

    /// Shortest distance of the two primitives [m].
    pub fn distance(self, x: [DVec3; 4]) -> f64 {
        weighted(self.weights(x), x).length()
    }
}

/// Σ bᵢxᵢ.
pub fn weighted(weights: [f64; 4], x: [DVec3; 4]) -> DVec3 {
    x[0] * weights[0] + x[1] * weights[1] + x[2] * weights[2] + x[3] * weights[3]
}

/// Barycentric coordinates of the point of a triangle that is closest to `p`.
#[must_use]
pub fn on_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> [f64; 3] {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = d1 / (d1 - d3);
        return [1.0 - v, v, 0.0];
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = d2 / (d2 - d6);
        return [1.0 - w, 0.0, w];
    }
    let va = d3 * d6 - d5 * d4;
    let (along, back) = (d4 - d3, d5 - d6);
    if va <= 0.0 && along >= 0.0 && back >= 0.0 {
        let w = along / (along + back);
        return [0.0, 1.0 - w, w];
    }
    let sum = va + vb + vc;
    let (v, w) = (vb / sum, vc / sum);
    [1.0 - v - w, v, w]
}

/// Parameters of the closest points of two edges, from 0 at their first ends to 1.
fn on_edges([p1, q1]: [DVec3; 2], [p2, q2]: [DVec3; 2]) -> [f64; 2] {
    let (d1, d2, r) = (q1 - p1, q2 - p2, p1 - p2);
    let (a, e, f) = (d1.dot(d1), d2.dot(d2), d2.dot(r));
    let unit = |value: f64| value.clamp(0.0, 1.0);
    if a == 0.0 && e == 0.0 {
        return [0.0, 0.0];
    }
    if a == 0.0 {
        return [0.0, unit(f / e)];
    }
    let c = d1.dot(r);
    if e == 0.0 {
        return [unit(-c / a), 0.0];
    }
    let b = d1.dot(d2);
    let denominator = a * e - b * b;
    let s = if denominator > 0.0 {
        unit((b * f - c * e) / denominator)
    } else {
        0.0
    };
    let t = (b * s + f) / e;
    if t < 0.0 {
        [unit(-c / a), 0.0]
    } else if t > 1.0 {
        [unit((b - c) / a), 1.0]
    } else {
        [s, t]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pseudo-random numbers from −1 to 1.
    fn noise(seed: &mut u64) -> f64 {
        *seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// No point of a fine grid on the two primitives is closer than the closest points, and the
    /// best grid point is farther by at most the spacing: 3/64 of the longest edge, below 4 m.
    #[test]
    fn nothing_is_closer_than_the_closest_points() {
        let mut seed = 1;
        for round in 0..400 {
            let mut x = [(); 4].map(|()| DVec3::from_array([(); 3].map(|()| noise(&mut seed))));
            if round % 4 == 0 {
                x[3] = x[2] + (x[1] - x[0]) * 0.7;
            }
            for kind in [
                Kind::VertexTriangle,
                Kind::EdgeEdge,
                Kind::VertexEdge,
                Kind::VertexVertex,
            ] {
                let found = kind.distance(x);
                let mut best = f64::INFINITY;
                for i in 0..=64 {
                    for j in 0..=64 {
                        let (s, t) = (f64::from(i) / 64.0, f64::from(j) / 64.0);
                        let weights = match kind {
                            Kind::VertexTriangle if s + t > 1.0 => continue,
                            Kind::VertexTriangle => [1.0, s + t - 1.0, -s, -t],
                            Kind::EdgeEdge => [1.0 - s, s, t - 1.0, -t],
                            Kind::VertexEdge => [1.0, t - 1.0, -t, 0.0],
                            Kind::VertexVertex => [1.0, -1.0, 0.0, 0.0],
                        };
                        best = best.min(weighted(weights, x).length());
                    }
                }
                assert!(found <= best + 1e-12, "{kind:?}: {found} above {best}");
                assert!(
                    best - found < 3.0 / 64.0 * 4.0,
                    "{kind:?}: {found}, grid {best}"
                );
                let sum: f64 = kind.weights(x).iter().sum();
                assert!(sum.abs() < 1e-15, "{kind:?}: weights add up to {sum}");
            }
        }
    }
}
