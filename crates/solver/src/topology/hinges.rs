//! Hinges: pairs of triangles of a surface with a common edge, for bending.

use super::{
    order::{Elements, Painting},
    partitions::Partitions,
};
use glam::{DVec3, Vec3};
use std::sync::Arc;

/// Hinges as columns in the order of their colors.
///
/// ```text
///        1
///      / | \        the common edge goes from 0 to 1, the first triangle is 0 1 2,
///    3   |   2      the second 1 0 3
///      \ | /
///        0
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Hinges {
    /// Particles of each hinge, and the order in which they are solved.
    pub elements: Elements<4>,
    /// Angle θ₀ between the normals at rest [rad], from −π to π; positive where the surface bulges
    /// to the side of its normals.
    pub rest_angle: Vec<f32>,
    /// (A₀ + A₁)/e² of each, with the areas of the triangles and the length of the edge at rest.
    pub flexibility: Arc<[f32]>,
    /// Lower bounds of the squared length of a normal [m⁴] and of an edge [m²] in the denominators
    /// of kernels.
    pub floors: [Arc<[f32]>; 2],
    /// Sum of the lengths of their common edges at rest [m].
    pub length: f64,
}

/// Below this fraction of its squared rest length, a normal or an edge is too short to divide by.
pub(crate) const FLOOR: f64 = 1e-4;

/// A triangle is flat if its area is below this fraction of the square of its longest edge: its
/// normal is then within the rounding of its coordinates.
const FLAT: f64 = 1e-6;

impl Hinges {
    /// All hinges of a surface. An edge of more than two triangles has one hinge for each triangle
    /// after the first; triangles without area have none.
    #[must_use]
    pub fn of(triangles: &[[u32; 3]], rest: &[Vec3], partitions: &Partitions) -> Self {
        let corners = pairs(triangles, rest);
        let how = Painting {
            odd_first: true,
            ..Painting::default()
        };
        let (elements, _) = Elements::new(&corners, partitions, how);
        Self::with(elements, rest)
    }

    /// With their angles at rest.
    pub(super) fn with(elements: Elements<4>, rest: &[Vec3]) -> Self {
        let at_rest = || {
            elements
                .corners()
                .map(|it| it.map(|i| rest[i as usize].as_dvec3()))
        };
        let column = |of: &dyn Fn([DVec3; 4]) -> f64| at_rest().map(|x| of(x) as f32).collect();
        let edge = |x: [DVec3; 4]| x[0].distance_squared(x[1]);
        let area = |x| normals(x).map(|n| 0.5 * n.length()).iter().sum::<f64>();
        let normal = |x| {
            normals(x)
                .map(|n| n.length_squared())
                .into_iter()
                .fold(f64::MAX, f64::min)
        };
        Self {
            rest_angle: at_rest().map(|x| angle(x) as f32).collect(),
            flexibility: column(&|x| area(x) / edge(x)),
            floors: [column(&|x| FLOOR * normal(x)), column(&|x| FLOOR * edge(x))],
            length: Self::length_of(&elements, rest),
            elements,
        }
    }

    /// Sum of the lengths of the common edges at rest [m].
    pub(super) fn length_of(elements: &Elements<4>, rest: &[Vec3]) -> f64 {
        let ends = elements
            .corners()
            .map(|[a, b, ..]| [a, b].map(|i| rest[i as usize].as_dvec3()));
        ends.map(|[a, b]| a.distance(b)).sum()
    }

    /// Memory use in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.elements.bytes() + 4 * size_of_val(&self.rest_angle[..])
    }

    /// The four particles of each hinge.
    #[must_use]
    pub fn corners(&self) -> impl ExactSizeIterator<Item = [u32; 4]> + Clone {
        self.elements.corners()
    }
}

/// Data for the quadratic bending energy of each hinge, in order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cotangents {
    /// Weights k₁, k₂, k₃ of its particles; k₀ is minus their sum.
    pub weights: [Arc<[f32]>; 3],
    /// ‖Σ kᵢxᵢ‖ at rest [m]; exactly 0 where the rest shape is flat to within rounding.
    pub rest: Vec<f32>,
    /// A₀ + A₁ at rest [m²].
    pub area: Arc<[f32]>,
    /// Rest length of the edge [m], which is C for a fold of one radian.
    pub scale: Arc<[f32]>,
}

impl Cotangents {
    /// For the hinges of a surface.
    #[must_use]
    pub fn of(hinges: &Hinges, rest: &[Vec3]) -> Self {
        let mut weights = [const { Vec::new() }; 3];
        let (mut bends, mut areas, mut scales) = (Vec::new(), Vec::new(), Vec::new());
        for (corners, &angle) in hinges.corners().zip(&hinges.rest_angle) {
            let x = corners.map(|i| rest[i as usize].as_dvec3());
            let cotangent = |a: DVec3, b: DVec3| a.dot(b) / a.cross(b).length();
            let (edge, first, second) = (x[1] - x[0], x[2] - x[0], x[3] - x[0]);
            let at_0 = [cotangent(edge, first), cotangent(edge, second)];
            let at_1 = [cotangent(-edge, x[2] - x[1]), cotangent(-edge, x[3] - x[1])];
            let k = [at_0[0] + at_0[1], -at_0[0] - at_1[0], -at_0[1] - at_1[1]];
            for (column, k) in weights.iter_mut().zip(k) {
                column.push(k as f32);
            }
            let bent = edge * k[0] + first * k[1] + second * k[2];
            let flat = f64::from(angle.abs()) < FLAT_ANGLE;
            bends.push(if flat { 0.0 } else { bent.length() as f32 });
            let [n1, n2] = normals(x);
            areas.push((0.5 * (n1.length() + n2.length())) as f32);
            scales.push(edge.length() as f32);
        }
        Self {
            weights: weights.map(Into::into),
            rest: bends,
            area: areas.into(),
            scale: scales.into(),
        }
    }

    /// Memory use in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        6 * size_of_val(&self.rest[..])
    }
}

/// A hinge with a smaller rest angle [rad] is flat, within the rounding of its coordinates.
const FLAT_ANGLE: f64 = 1e-5;

/// Corners of all hinges, in the order of their second triangles.
fn pairs(triangles: &[[u32; 3]], rest: &[Vec3]) -> Vec<[u32; 4]> {
    // Sides of all triangles: ends in ascending order, number of the triangle, its corners in
    // order, and the opposite corner.
    let mut sides: Vec<([u32; 2], usize, [u32; 3])> = triangles
        .iter()
        .enumerate()
        .filter(|(_, triangle)| has_area(triangle.map(|i| rest[i as usize])))
        .flat_map(|(number, &[a, b, c])| {
            [[a, b, c], [b, c, a], [c, a, b]]
                .map(|[a, b, c]| ([a.min(b), a.max(b)], number, [a, b, c]))
        })
        .collect();
    sides.sort_unstable();
    let mut hinges: Vec<(usize, [u32; 4])> = sides
        .chunk_by(|one, other| one.0 == other.0)
        .flat_map(|around| {
            let (_, _, [a, b, first]) = around[0];
            around[1..]
                .iter()
                .map(move |&(_, number, [.., across])| (number, [a, b, first, across]))
        })
        .filter(|(_, [.., first, across])| first != across)
        .collect();
    hinges.sort_unstable();
    hinges.into_iter().map(|(_, corners)| corners).collect()
}

/// Whether a triangle has a normal.
pub(super) fn has_area(corners: [Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(|x| x.as_dvec3());
    let (u, v, w) = (b - a, c - a, c - b);
    let longest = u
        .length_squared()
        .max(v.length_squared())
        .max(w.length_squared());
    u.cross(v).length() > FLAT * longest
}

/// Normals of the two triangles of a hinge, with twice their areas as lengths [m²].
#[must_use]
pub fn normals([x0, x1, x2, x3]: [DVec3; 4]) -> [DVec3; 2] {
    let edge = x1 - x0;
    [edge.cross(x2 - x0), (x3 - x0).cross(edge)]
}

/// Angle between the normals of a hinge [rad], from −π to π.
#[must_use]
pub fn angle(x: [DVec3; 4]) -> f64 {
    let [n1, n2] = normals(x);
    let edge = (x[1] - x[0]).normalize_or_zero();
    libm::atan2(n1.cross(n2).dot(edge), n1.dot(n2))
}
