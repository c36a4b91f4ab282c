//! Lower bounds of the distances of pairs of primitives, eight pairs at once.
//!
//! Closest points in `f32`, from corners relative to a common origin. What is found is the distance of two
//! points of the primitives, or of a point and a plane: the former may be too large, as rounding moves the
//! parameters of nearly parallel edges and of slivers. With parameters from quantities that are exact to
//! a few ε, the square of that distance is too large by at most some ε times the squares of the lengths
//! involved: [`ROUNDING`] of them is subtracted.

use super::closest::Kind;
use crate::lanes::{Instructions, Lanes, SimdWork};
use fearless_simd::{f32x8, prelude::*};
use glam::Vec3A;

/// Number of pairs that are computed at once.
const WIDTH: usize = 8;

/// What rounding may add to the square of a distance, as a fraction of the squares of lengths: 64 ε.
const ROUNDING: f32 = 4e-6;

/// Triangles with a smaller square of the sine of an angle have no plane.
const FLAT: f32 = 1e-9;

/// A point is above a triangle also if it lies beyond an edge by this fraction of the height: its distance
/// to the plane is a lower bound all the same.
const BESIDE: f32 = 1e-3;

/// Smallest divisor.
const TINY: f32 = 1e-30;

/// Coordinates of eight pairs [m], by corner and axis.
type Eight = [[[f32; WIDTH]; 3]; 4];

/// Pairs of primitives of one kind.
#[derive(Debug, Default)]
pub struct Pairs {
    eights: Vec<Eight>,
    count: usize,
    bounds: Vec<[f32; WIDTH]>,
}

impl Pairs {
    /// Removes all pairs.
    pub fn clear(&mut self) {
        self.eights.clear();
        self.count = 0;
    }

    /// Adds a pair with these corners, those of the second primitive displaced [m].
    #[inline]
    pub fn push(&mut self, kind: Kind, mut corners: [Vec3A; 4], displaced: Vec3A) {
        for corner in &mut corners[kind.split()..] {
            *corner += displaced;
        }
        // Vertices are edges without length, where no triangle is involved.
        let [a, b, c, _] = corners;
        let corners = match kind {
            Kind::VertexTriangle | Kind::EdgeEdge => corners,
            Kind::VertexEdge => [a, a, b, c],
            Kind::VertexVertex => [a, a, b, b],
        };
        let lane = self.count % WIDTH;
        if lane == 0 {
            self.eights.push([[[0.0; WIDTH]; 3]; 4]);
        }
        if let Some(eight) = self.eights.last_mut() {
            for (columns, corner) in eight.iter_mut().zip(corners) {
                for (column, x) in columns.iter_mut().zip(corner.to_array()) {
                    column[lane] = x;
                }
            }
        }
        self.count += 1;
    }

    /// A lower bound of the distance of each pair [m], but for the rounding of its coordinates.
    pub fn lower_bounds(&mut self, kind: Kind, instructions: Instructions) -> &[f32] {
        self.bounds.clear();
        self.bounds.resize(self.eights.len(), [0.0; WIDTH]);
        instructions.run(Distances {
            kind,
            eights: &self.eights,
            bounds: &mut self.bounds,
        });
        &self.bounds.as_flattened()[..self.count]
    }
}

struct Distances<'a> {
    kind: Kind,
    eights: &'a [Eight],
    bounds: &'a mut [[f32; WIDTH]],
}

impl SimdWork for Distances<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        for (eight, bounds) in self.eights.iter().zip(self.bounds) {
            let corners = [
                Point::load(simd, &eight[0]),
                Point::load(simd, &eight[1]),
                Point::load(simd, &eight[2]),
                Point::load(simd, &eight[3]),
            ];
            let [square, scale] = match self.kind {
                Kind::VertexTriangle => to_triangle(simd, corners),
                _ => of_edges(simd, corners),
            };
            let zero = f32x8::splat(simd, 0.0);
            let least = square - scale * f32x8::splat(simd, ROUNDING);
            least.max(zero).sqrt().store_slice(bounds);
        }
    }
}

/// Eight points or vectors.
#[derive(Clone, Copy)]
pub(super) struct Point<L: Lanes>(pub [f32x8<L>; 3]);

impl<L: Lanes> Point<L> {
    #[inline(always)]
    fn load(simd: L, [x, y, z]: &[[f32; WIDTH]; 3]) -> Self {
        Self([
            f32x8::from_slice(simd, x),
            f32x8::from_slice(simd, y),
            f32x8::from_slice(simd, z),
        ])
    }

    /// The same eight times.
    #[inline(always)]
    pub fn splat(simd: L, at: Vec3A) -> Self {
        Self([
            f32x8::splat(simd, at.x),
            f32x8::splat(simd, at.y),
            f32x8::splat(simd, at.z),
        ])
    }

    /// Those with these indices.
    #[inline(always)]
    pub fn gather(simd: L, all: &[Vec3A], indices: &[u32; WIDTH]) -> Self {
        let mut columns = [[0.0; WIDTH]; 3];
        for (lane, &index) in indices.iter().enumerate() {
            let [x, y, z] = all[index as usize].to_array();
            columns[0][lane] = x;
            columns[1][lane] = y;
            columns[2][lane] = z;
        }
        Self::load(simd, &columns)
    }

    #[inline(always)]
    pub fn times(self, by: f32x8<L>) -> Self {
        let Self([x, y, z]) = self;
        Self([x * by, y * by, z * by])
    }

    #[inline(always)]
    pub fn from(self, Self([u, v, w]): Self) -> Self {
        let Self([x, y, z]) = self;
        Self([x - u, y - v, z - w])
    }

    #[inline(always)]
    pub fn along(self, Self([u, v, w]): Self, by: f32x8<L>) -> Self {
        let Self([x, y, z]) = self;
        Self([x + u * by, y + v * by, z + w * by])
    }

    #[inline(always)]
    pub fn dot(self, Self([u, v, w]): Self) -> f32x8<L> {
        let Self([x, y, z]) = self;
        x * u + y * v + z * w
    }

    #[inline(always)]
    fn cross(self, Self([u, v, w]): Self) -> Self {
        let Self([x, y, z]) = self;
        Self([y * w - z * v, z * u - x * w, x * v - y * u])
    }

    #[inline(always)]
    fn square(self) -> f32x8<L> {
        self.dot(self)
    }
}

/// A quotient from 0 to 1.
#[inline(always)]
fn fraction<L: Lanes>(simd: L, of: f32x8<L>, by: f32x8<L>) -> f32x8<L> {
    let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
    let tiny = f32x8::splat(simd, TINY);
    (of / by.max(tiny)).max(zero).min(one)
}

/// Square of the distance of two edges, and the squares of the lengths involved [m²].
#[inline(always)]
fn of_edges<L: Lanes>(simd: L, [p1, q1, p2, q2]: [Point<L>; 4]) -> [f32x8<L>; 2] {
    let (d1, d2, r) = (q1.from(p1), q2.from(p2), p1.from(p2));
    let (a, e, b) = (d1.square(), d2.square(), d1.dot(d2));
    let (c, f) = (d1.dot(r), d2.dot(r));
    let s = fraction(simd, b * f - c * e, a * e - b * b);
    let t = fraction(simd, b * s + f, e);
    // The best on one edge for the other's, which is exact where the first division is not.
    let s = fraction(simd, b * t - c, a);
    let t = fraction(simd, b * s + f, e);
    let zero = f32x8::splat(simd, 0.0);
    let apart = r.along(d1, s).along(d2, zero - t);
    [apart.square(), a + e + r.square()]
}

/// Square of the distance of a point and a triangle, and the squares of the lengths involved [m²].
#[inline(always)]
fn to_triangle<L: Lanes>(simd: L, [p, a, b, c]: [Point<L>; 4]) -> [f32x8<L>; 2] {
    let (ab, bc, ca) = (b.from(a), c.from(b), a.from(c));
    let (ap, bp, cp) = (p.from(a), p.from(b), p.from(c));
    let zero = f32x8::splat(simd, 0.0);
    let normal = ab.cross(bc);
    let area = normal.square();
    let outside = zero - area * f32x8::splat(simd, BESIDE);
    let flat = ab.square() * bc.square() * f32x8::splat(simd, FLAT);
    let is_above = ab.cross(ap).dot(normal).simd_ge(outside)
        & bc.cross(bp).dot(normal).simd_ge(outside)
        & ca.cross(cp).dot(normal).simd_ge(outside)
        & area.simd_gt(flat);
    let height = ap.dot(normal);
    let to_plane = height * height / area.max(f32x8::splat(simd, TINY));
    let to_sides = to_side(simd, ab, ap)
        .min(to_side(simd, bc, bp))
        .min(to_side(simd, ca, cp));
    let square = is_above.select(to_plane, to_sides);
    [square, ab.square() + bc.square() + ap.square()]
}

/// Square of the distance of a point from a side, given by its vector and that from its start to the point [m²].
#[inline(always)]
fn to_side<L: Lanes>(simd: L, side: Point<L>, from: Point<L>) -> f32x8<L> {
    let t = fraction(simd, side.dot(from), side.square());
    from.along(side, f32x8::splat(simd, 0.0) - t).square()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// For primitives at random, among them nearly parallel edges, slivers and points close to a surface, the
    /// bound is at most the distance, and less by no more than rounding takes: √ROUNDING of the lengths where
    /// they touch, and its half divided by the distance elsewhere; beyond an edge, the part [`BESIDE`].
    #[test]
    fn bounds_are_close_below_distances() {
        let mut seed = 5_u32;
        let mut noise = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        let kinds = [
            Kind::VertexTriangle,
            Kind::EdgeEdge,
            Kind::VertexEdge,
            Kind::VertexVertex,
        ];
        for kind in kinds {
            let mut all = Vec::new();
            for round in 0..40_000 {
                let mut x = [(); 4].map(|()| Vec3A::new(noise(), noise(), noise()));
                let little = [1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6][round % 7];
                match round % 5 {
                    // Edges that are parallel, or nearly so; a sliver.
                    1 => x[3] = x[2] + (x[1] - x[0]) * noise() + (x[3] - x[2]) * little,
                    2 => x[3] = x[1] + (x[2] - x[1]) * noise() + (x[3] - x[1]) * little,
                    // Close to a point of the other.
                    3 => x[0] = x[2] + (x[3] - x[2]) * noise().abs() + (x[0] - x[2]) * little,
                    4 => x[2] = x[1] + (x[2] - x[1]) * little,
                    _ => {}
                }
                all.push(x);
            }
            let mut pairs = Pairs::default();
            for x in &all {
                pairs.push(kind, *x, Vec3A::ZERO);
            }
            for instructions in Instructions::all() {
                let bounds = pairs.lower_bounds(kind, instructions);
                assert_eq!(bounds.len(), all.len());
                for (x, &bound) in all.iter().zip(bounds) {
                    let exact = kind.distance(x.map(|it| it.as_dvec3()));
                    // Rounding of the last steps.
                    assert!(
                        f64::from(bound) <= exact * (1.0 + 1e-6),
                        "{kind:?} {x:?}: {bound} above {exact}"
                    );
                    let lengths = x.iter().map(|it| (*it - x[0]).as_dvec3());
                    let size = lengths.map(DVec3::length_squared).fold(0.0, f64::max);
                    let rounding = f64::from(ROUNDING) * 9.0 * size;
                    let most = rounding.sqrt().min(rounding / exact.max(1e-9));
                    let beside = f64::from(BESIDE) * size.sqrt();
                    assert!(
                        exact - f64::from(bound) <= most + 4.0 * beside,
                        "{kind:?} {x:?}: {bound} far below {exact}"
                    );
                }
            }
        }
    }
}
