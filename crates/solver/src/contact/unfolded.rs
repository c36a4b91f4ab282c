//! Patches of a surface that are too little folded to touch each other.
//!
//! Half way through the motion of a substep, a surface is a map of its chart (`topology/chart.rs`), with one
//! derivative on each triangle. Each piece has a matrix R that turns it into the plane, the smallest
//! d·R Dx d of its triangles, and a bound of their |Dx|. With the mean of the matrices of two pieces, which is off
//! by a known norm from that of each piece between them, follows a bound of the distance of their elements. Where
//! it is so large that no contact could act, no candidates are looked for. The bits are those with them.

use super::gaps::Point;
use crate::{
    lanes::{Instructions, Lanes, SimdWork},
    topology::chart::{Chart, ChartPatch, EightTriangles},
};
use fearless_simd::{f32x8, prelude::*};
use glam::Vec3A;

/// Margin of the bounds against rounding, as a fraction. Charts may be off by 4e-6 of the size of two patches, some
/// 25 heights, which derivatives can enlarge by the ratio of `most` to `least`.
const MARGIN: f32 = 1e-3;

/// √(x² + y²) ≤ max + this · min, for x, y ≥ 0: √2 − 1, rounded up.
const LENGTH: f32 = 0.4143;

/// How a piece lies in space half way through the motion of the substep, over its chart.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bend {
    /// The rows of R, and those of the one to measure with next.
    turn: [Vec3A; 2],
    next: [Vec3A; 2],
    /// The smallest d·R Dx d of a unit vector, and a bound of |Dx|.
    least: f32,
    most: f32,
    /// Reach of its corners from there [m].
    pub reach: f32,
}

impl Default for Bend {
    /// Not known.
    fn default() -> Self {
        Self {
            turn: [Vec3A::ZERO; 2],
            next: [Vec3A::ZERO; 2],
            least: f32::NEG_INFINITY,
            most: 0.0,
            reach: 0.0,
        }
    }
}

impl Bend {
    /// Bounds the derivatives of a patch with these places of its vertices [m], with a matrix found before.
    pub fn update(
        &mut self,
        patch: &ChartPatch,
        at: &[Vec3A],
        reach: f32,
        instructions: Instructions,
    ) {
        let turn = self.next;
        let mut found = Found::default();
        instructions.run(Derivatives {
            patch,
            at,
            turn,
            found: &mut found,
        });
        *self = Self {
            turn,
            next: nearest(found.sum),
            least: found.least,
            most: found.most.sqrt(),
            reach,
        };
    }
}

/// What is found of the derivatives of a patch.
#[derive(Default)]
struct Found {
    least: f32,
    /// The largest square of a norm.
    most: f32,
    /// Sum of their columns.
    sum: [Vec3A; 2],
}

/// Bounds the derivatives of eight triangles at once.
struct Derivatives<'a> {
    patch: &'a ChartPatch,
    at: &'a [Vec3A],
    turn: [Vec3A; 2],
    found: &'a mut Found,
}

impl SimdWork for Derivatives<'_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self {
            patch,
            at,
            turn,
            found,
        } = self;
        let number = |it: f32| f32x8::splat(simd, it);
        let (half, length) = (number(0.5), number(LENGTH));
        let rows = turn.map(|row| Point::splat(simd, row));
        let mut least = number(f32::INFINITY);
        let mut most = number(0.0);
        let mut sums = [Point::splat(simd, Vec3A::ZERO); 2];
        for EightTriangles { corners, inverse } in &patch.eights {
            let [a, b, c] = [
                Point::gather(simd, at, &corners[0]),
                Point::gather(simd, at, &corners[1]),
                Point::gather(simd, at, &corners[2]),
            ];
            let (u, v) = (b.from(a), c.from(a));
            let [p, q, r, s] = [
                f32x8::from_slice(simd, &inverse[0]),
                f32x8::from_slice(simd, &inverse[1]),
                f32x8::from_slice(simd, &inverse[2]),
                f32x8::from_slice(simd, &inverse[3]),
            ];
            let (x, y) = (u.times(p).along(v, r), u.times(q).along(v, s));
            let one = number(1.0);
            sums = [sums[0].along(x, one), sums[1].along(y, one)];
            let (xx, xy) = (rows[0].dot(x), rows[0].dot(y));
            let (yx, yy) = (rows[1].dot(x), rows[1].dot(y));
            let difference = (half * (xx - yy)).abs();
            let shear = (half * (xy + yx)).abs();
            // At least the length of the two, without a root.
            let apart = difference.max(shear) + length * difference.min(shear);
            least = least.min(half * (xx + yy) - apart);
            most = most.max(x.dot(x).max(y.dot(y)) + x.dot(y).abs());
        }
        let each = |numbers: f32x8<L>| {
            let mut all = [0.0; 8];
            numbers.store_slice(&mut all);
            all
        };
        let sum = |it: Point<L>| Vec3A::from_array(it.0.map(|axis| each(axis).iter().sum()));
        *found = Found {
            least: each(least).into_iter().fold(f32::INFINITY, f32::min),
            most: each(most).into_iter().fold(0.0, f32::max) * (1.0 + MARGIN),
            sum: sums.map(sum),
        };
    }
}

/// Whether all elements without a common vertex of two patches, a pair of the chart, are farther apart than a
/// limit [m], by how the patches of the surface lie.
pub(super) fn are_apart(chart: &Chart, pair: u32, bends: &[Bend], limit: f32) -> bool {
    let (of_chart, between) = chart.pair(pair);
    let needed = limit / (of_chart.height * (1.0 - MARGIN));
    let [a, b] = of_chart.patches.map(|patch| bends[patch as usize].turn);
    let turn = [(a[0] + b[0]) * 0.5, (a[1] + b[1]) * 0.5];
    between.iter().all(|&patch| {
        let it = &bends[patch as usize];
        let room = it.least - needed;
        let apart = [turn[0] - it.turn[0], turn[1] - it.turn[1]];
        room > 0.0 && square_of_norm(apart) * it.most * it.most < room * room
    })
}

/// Bound of the square of the norm of a matrix with these two columns, or rows.
fn square_of_norm([x, y]: [Vec3A; 2]) -> f32 {
    (x.length_squared().max(y.length_squared()) + x.dot(y).abs()) * (1.0 + MARGIN)
}

/// The matrix R with rows of unit length, at right angles, nearest to the inverse of a derivative with these columns.
fn nearest([x, y]: [Vec3A; 2]) -> [Vec3A; 2] {
    // The inverse of the root of a symmetric matrix of two rows.
    let (xx, xy, yy) = (x.dot(x), x.dot(y), y.dot(y));
    let root = (xx * yy - xy * xy).max(0.0).sqrt();
    let scale = 1.0 / (root * (xx + yy + 2.0 * root).sqrt());
    let turn = [
        (x * (yy + root) - y * xy) * scale,
        (y * (xx + root) - x * xy) * scale,
    ];
    // Its norm is at most 1, also after rounding.
    match turn.iter().all(|row| row.is_finite()) {
        true => turn.map(|row| row * (1.0 - MARGIN)),
        false => [Vec3A::ZERO; 2],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        contact::closest::Kind,
        topology::{patches::Patch, surface::Surface},
    };
    use glam::{DVec3, Quat, Vec3};

    const SIDE: u32 = 24;

    /// A sheet of square cells of 1 m in a plane that is not along an axis. `is_there` says which cells it has;
    /// along x = 12 it has a slit from y = 12 on if it is `torn`.
    fn sheet(is_there: impl Fn(u32, u32) -> bool, is_torn: bool) -> Surface {
        let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.3, 0.5, 0.7);
        let count = SIDE + 1;
        let mut points: Vec<Vec3> = (0..count * count)
            .map(|i| turn * Vec3::new((i % count) as f32, (i / count) as f32, 0.0))
            .collect();
        let mut at = |x: u32, y: u32, is_right: bool| {
            if is_torn && is_right && x == SIDE / 2 && y > SIDE / 2 {
                points.push(points[(y * count + x) as usize]);
                // Once for each height.
                let known = points.len() as u32 - 1;
                let first = count * count;
                let twin = points[known as usize];
                let found = points[first as usize..].iter().position(|it| *it == twin);
                let found = found.map_or(known, |place| first + place as u32);
                points.truncate(points.len() - usize::from(found != known));
                return found;
            }
            y * count + x
        };
        let mut triangles = Vec::new();
        for (x, y) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
            if is_there(x, y) {
                let is_right = x >= SIDE / 2;
                let [a, b, c, d] = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)]
                    .map(|(x, y)| at(x, y, is_right));
                triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
        Surface::of_triangles(&points, &triangles)
    }

    /// The smallest distance of elements of two patches that share no vertex [m].
    fn distance(surface: &Surface, [a, b]: [u32; 2], at: &[Vec3A]) -> f64 {
        let at = |vertex: u32| at[vertex as usize].as_dvec3();
        let patch = |number: u32| &surface.patches[number as usize];
        let [a, b] = [patch(a), patch(b)];
        let mut least = f64::INFINITY;
        let mut compare = |kind: Kind, corners: [u32; 4]| {
            let (one, other) = corners.split_at(kind.split());
            if !one.iter().any(|it| other.contains(it)) {
                least = least.min(kind.distance(corners.map(at)));
            }
        };
        for (a, b) in [(a, b), (b, a)] {
            let of = |patch: &Patch, place: u32| patch.vertices[place as usize];
            for triangle in &b.triangles {
                let [x, y, z] = triangle.map(|it| of(b, it));
                for &vertex in &a.vertices[..a.own] {
                    compare(Kind::VertexTriangle, [vertex, x, y, z]);
                }
            }
            for one in &a.edges {
                for other in &b.edges {
                    let ([p, q], [r, s]) = (one.map(|it| of(a, it)), other.map(|it| of(b, it)));
                    compare(Kind::EdgeEdge, [p, q, r, s]);
                }
            }
        }
        least
    }

    /// Over rolled, sheared, wrinkled and crumpled sheets, of which some have corners that point inwards, a hole
    /// or a slit: elements are farther apart than what is shown of them, and most of a smooth sheet is shown.
    #[test]
    fn what_is_shown_to_be_apart_is() {
        let whole = |_, _| true;
        let angle = |x, y| x < SIDE / 2 || y < SIDE / 2;
        let hole = |x, y| !(8..14).contains(&x) || !(8..14).contains(&y);
        let sheets = [
            sheet(whole, false),
            sheet(angle, false),
            sheet(hole, false),
            sheet(whole, true),
        ];
        let mut seed = 3_u32;
        let mut noise = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.3, 0.5, 0.7);
        for surface in &sheets {
            for (curl, shear, rough) in [
                (0.0, 0.0, 0.0),
                (0.05, 0.0, 0.02),
                (0.05, 0.3, 0.05),
                (0.2, 0.0, 0.1),
                (0.6, 0.2, 0.05),
                (0.0, 0.5, 0.4),
            ] {
                let at: Vec<Vec3A> = surface
                    .rest
                    .iter()
                    .map(|it| {
                        let flat = turn.inverse() * *it;
                        let (sine, cosine) = libm::sincosf(curl * flat.x);
                        let rolled = match curl == 0.0 {
                            true => Vec3::new(flat.x, flat.y, 0.0),
                            false => Vec3::new(sine / curl, flat.y, (1.0 - cosine) / curl),
                        };
                        let moved = rolled + Vec3::Y * (shear * flat.x);
                        (moved + rough * Vec3::new(noise(), noise(), noise())).into()
                    })
                    .collect();
                let chart = surface.chart();
                let bends = |instructions: Instructions| -> Vec<Bend> {
                    let each = surface.patches.iter().zip(&chart.patches);
                    let each = each.map(|(patch, of_chart)| {
                        let own: Vec<_> = patch.vertices.iter().map(|&v| at[v as usize]).collect();
                        let mut bend = Bend::default();
                        // Once for the matrix.
                        bend.update(of_chart, &own, 0.0, instructions);
                        bend.update(of_chart, &own, 0.0, instructions);
                        bend
                    });
                    each.collect()
                };
                for instructions in Instructions::all() {
                    let bends = bends(instructions);
                    let (mut shown, mut count) = (0, 0);
                    for pair in 0..chart.pairs() {
                        let patches = chart.pair(pair).0.patches;
                        // The largest limit that is shown, by halves.
                        let (mut low, mut high) = (0.0, 2.0);
                        while high - low > 1e-3 {
                            let middle = 0.5 * (low + high);
                            match are_apart(chart, pair, &bends, middle) {
                                true => low = middle,
                                false => high = middle,
                            }
                        }
                        count += 1;
                        shown += usize::from(low > 0.25);
                        if low > 0.0 {
                            let found = distance(surface, patches, &at);
                            assert!(found > low.into(), "{patches:?}: {found} m, {low} m shown");
                        }
                    }
                    assert!(count >= surface.patches.len(), "{count} pairs in the chart");
                    // Wrinkles of ± 0.02 m on cells of 1 m change derivatives by 0.08; rolled with a radius of 20 m,
                    // neighbors of up to twelve cells turn by 0.6, half of which counts. 1 − 0.08 − 0.06 − 0.3 of
                    // the height of 0.7 m remains, more than 0.25 m; patches at corners are larger.
                    let least = match (curl, rough) {
                        (0.0, 0.0) => count,
                        (0.05, 0.02) => count * 3 / 4,
                        _ => 0,
                    };
                    assert!(shown >= least, "{shown} of {count} shown, rolled by {curl}");
                }
            }
        }
    }

    /// A slit and a corner that points inwards part what is on either side, and a body that is no graph over a
    /// plane has no chart.
    #[test]
    fn only_convex_parts_are_pairs() {
        let whole = sheet(|_, _| true, false);
        let torn = sheet(|_, _| true, true);
        let at = |surface: &Surface, patch: u32| {
            let patch = &surface.patches[patch as usize];
            let all = patch.vertices[..patch.own].iter();
            let sum: DVec3 = all.map(|&v| surface.rest[v as usize].as_dvec3()).sum();
            let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.3, 0.5, 0.7).as_dquat();
            turn.inverse() * (sum / patch.own as f64)
        };
        let half = f64::from(SIDE / 2);
        let over_the_slit = |surface: &Surface| {
            let pairs = 0..surface.chart().pairs();
            let pairs = pairs.map(|pair| surface.chart().pair(pair).0.patches);
            let sides = pairs.map(|patches| patches.map(|it| at(surface, it)));
            // Well beyond the slit, and well above its end.
            let is_over = |[a, b]: &[DVec3; 2]| {
                (a.x - half) * (b.x - half) < -1.0 && a.y.min(b.y) > half + 3.0
            };
            sides.filter(is_over).count()
        };
        assert!(over_the_slit(&whole) > 0);
        assert_eq!(over_the_slit(&torn), 0);
        let points = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        let triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let closed = Surface::of_triangles(&points, &triangles);
        assert_eq!(closed.chart().pairs(), 0);
        // Beside a triangle, which is one.
        let points = [
            &points[..],
            &[Vec3::X * 9.0, Vec3::X * 8.0, Vec3::new(8.0, 1.0, 0.0)],
        ]
        .concat();
        let beside = [&triangles[..], &[[4, 5, 6]]].concat();
        let both = Surface::of_triangles(&points, &beside);
        assert_eq!(both.patches.len(), 1, "small enough for one patch");
        assert_eq!(both.chart().pairs(), 0, "a patch of two components");
        // A flake in the plane of a sheet, above its left side, is part of a patch there.
        let at = |surface: &Surface, pair: u32| {
            let patches = surface.chart().pair(pair).0.patches;
            let all = patches.map(|it| &surface.patches[it as usize].vertices);
            all.into_iter()
                .flatten()
                .map(|&v| surface.rest[v as usize])
                .collect::<Vec<_>>()
        };
        let up = Quat::from_euler(glam::EulerRot::XYZ, 0.3, 0.5, 0.7) * Vec3::Z;
        let across = [Vec3::ZERO, Vec3::X, Vec3::Y]
            .map(|it| Quat::from_euler(glam::EulerRot::XYZ, 0.3, 0.5, 0.7) * it + up);
        let first = whole.rest.len() as u32;
        let points = [&whole.rest[..], &across].concat();
        let flake = [&whole.triangles[..], &[[first, first + 1, first + 2]]].concat();
        let with_flake = Surface::of_triangles(&points, &flake);
        assert!(with_flake.chart().pairs() > 0);
        for pair in 0..with_flake.chart().pairs() {
            let all = at(&with_flake, pair);
            assert!(
                !across.iter().any(|it| all.contains(it)),
                "a patch with a flake"
            );
        }
    }
}
