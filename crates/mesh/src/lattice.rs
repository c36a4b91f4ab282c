//! Fills an implicit solid with tetrahedra: isosurface stuffing on a body-centered cubic lattice.
//!
//! After Labelle & Shewchuk, "Isosurface Stuffing: Fast Tetrahedral Meshes with Good Dihedral
//! Angles" (2007), with a uniform cell size. The solid is given by one value per lattice point:
//! positive inside, negative outside, zero on the surface. A lattice edge is cut where the value
//! changes sign; a point too close to a cut is moved onto it; the inside parts of the cut
//! tetrahedra are meshed.
//!
//! Independent of surfaces and primitives. Invariant for any input: no tetrahedron is inverted or
//! flat. Element quality depends only on the two warping thresholds.

use glam::{DVec3, UVec3};
use rayon::prelude::*;

use super::{MeshError, TetMesh, limits::MAX_TETRAHEDRA};

/// Minimum distance of a cut from an end of a long edge (edge of a cube), as a fraction of its
/// length.
const WARP_LONG: f64 = 0.24999;
/// The same for a short edge (from a corner of a cube to its center). Both values are from the
/// paper, table 1: the pair with proven dihedral angles between 10.7° and 164.8°.
const WARP_SHORT: f64 = 0.41189;

/// A grid of cubes; its points are the corners and centers of the cubes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lattice {
    /// The lowest corner.
    pub origin: DVec3,
    /// Edge length of a cube.
    pub spacing: f64,
    /// The number of cubes along each axis.
    pub cubes: UVec3,
}

impl Lattice {
    /// A lattice that covers a box around the origin with a margin of at least half a cube, aligned
    /// so that the faces of the box lie on cube corners if its sides are multiples of the spacing.
    pub fn around(half_extent: DVec3, spacing: f64) -> Self {
        let inner = (half_extent * 2.0 / spacing - 1e-9).ceil().max(DVec3::ONE);
        let cubes = inner.as_uvec3() + 2;
        Self {
            origin: cubes.as_dvec3() * (-0.5 * spacing),
            spacing,
            cubes,
        }
    }

    fn corner_count(&self) -> u32 {
        (self.cubes + 1).element_product()
    }

    fn corner(&self, at: UVec3) -> u32 {
        at.x + (self.cubes.x + 1) * (at.y + (self.cubes.y + 1) * at.z)
    }

    fn center(&self, at: UVec3) -> u32 {
        self.corner_count() + at.x + self.cubes.x * (at.y + self.cubes.y * at.z)
    }

    /// All points: corners first, then centers, each in rows along x.
    pub fn points(&self) -> Vec<DVec3> {
        let grid = |count: UVec3, shift: f64| {
            cells(count).map(move |at| self.origin + (at.as_dvec3() + shift) * self.spacing)
        };
        grid(self.cubes + 1, 0.0)
            .chain(grid(self.cubes, 0.5))
            .collect()
    }

    /// The same, row by row.
    pub fn rows<'a>(&self, points: &'a [DVec3]) -> impl ParallelIterator<Item = &'a [DVec3]> {
        let (corners, centers) = points.split_at(self.corner_count() as usize);
        let corners = corners.par_chunks(self.cubes.x as usize + 1);
        corners.chain(centers.par_chunks(self.cubes.x as usize))
    }

    /// Lattice point nearest to a position, which must be within the lattice.
    pub fn nearest(&self, place: DVec3) -> u32 {
        let place = (place - self.origin) / self.spacing;
        let corner = place.round();
        let center = place.floor() + 0.5;
        if place.distance_squared(corner) <= place.distance_squared(center) {
            self.corner(corner.as_uvec3().min(self.cubes))
        } else {
            self.center(center.as_uvec3().min(self.cubes - 1))
        }
    }

    /// Visits each edge of the lattice tetrahedra; some edges are visited more than once.
    pub fn for_each_edge(&self, mut visit: impl FnMut(u32, u32)) {
        self.for_each_tetrahedron(|t| {
            for k in 0..4 {
                for l in k + 1..4 {
                    visit(t[k], t[l]);
                }
            }
        });
    }

    /// Visits each tetrahedron of the lattice, with positive volume: the centers of two cubes that
    /// share a face, and an edge of that face.
    fn for_each_tetrahedron(&self, mut visit: impl FnMut([u32; 4])) {
        const AXES: [[UVec3; 3]; 3] = [
            [UVec3::X, UVec3::Y, UVec3::Z],
            [UVec3::Y, UVec3::Z, UVec3::X],
            [UVec3::Z, UVec3::X, UVec3::Y],
        ];
        for cube in cells(self.cubes) {
            for [along, u, v] in AXES {
                let next = cube + along;
                if next.cmpge(self.cubes).any() {
                    continue;
                }
                let (a, b) = (self.center(cube), self.center(next));
                let ring = [next, next + u, next + u + v, next + v].map(|at| self.corner(at));
                for k in 0..4 {
                    visit([a, b, ring[k], ring[(k + 1) % 4]]);
                }
            }
        }
    }

    /// Tie-break between two points of one sublattice when a quadrilateral is split. Neighbors
    /// differ by one in one coordinate, so the parity of the coordinate sum decides without a
    /// preferred direction.
    fn parity(&self, point: u32) -> u32 {
        let corners = self.corner_count();
        let (index, size) = if point < corners {
            (point, self.cubes + 1)
        } else {
            (point - corners, self.cubes)
        };
        (index % size.x + index / size.x % size.y + index / (size.x * size.y)) % 2
    }
}

fn cells(count: UVec3) -> impl Iterator<Item = UVec3> {
    (0..count.z).flat_map(move |z| {
        (0..count.y).flat_map(move |y| (0..count.x).map(move |x| UVec3::new(x, y, z)))
    })
}

/// Which points are inside and far enough from all cuts to stay in place during stuffing. The
/// tetrahedra that they span are always part of the filling.
pub(super) fn firm_points(lattice: &Lattice, field: &[f64]) -> Vec<bool> {
    let warped = warp(lattice, &mut lattice.points(), field);
    warped.into_iter().map(|value| value > 0.0).collect()
}

/// Fills the solid whose `field` is positive (one value per lattice point, ideally signed
/// distances).
///
/// # Errors
/// [`MeshError::TooLarge`] beyond [`MAX_TETRAHEDRA`]. A solid without a point inside yields no
/// tetrahedra and no error.
pub(super) fn stuff(lattice: &Lattice, field: &[f64]) -> Result<TetMesh, MeshError> {
    let mut points = lattice.points();
    let warped = warp(lattice, &mut points, field);
    let stuffing = Stuffing {
        lattice,
        cuts: cuts(lattice, &warped),
        field: &warped,
    };
    for &[inside, outside] in &stuffing.cuts {
        let (a, b) = (points[inside as usize], points[outside as usize]);
        points.push(a.lerp(b, crossing(&warped, inside, outside)));
    }
    let mut tetrahedra = Vec::new();
    lattice.for_each_tetrahedron(|corners| {
        if tetrahedra.len() <= MAX_TETRAHEDRA {
            stuffing.cut_tetrahedron(corners, |t| tetrahedra.push(t));
        }
    });
    if tetrahedra.len() > MAX_TETRAHEDRA {
        return Err(MeshError::TooLarge {
            what: "tetrahedra or more",
            count: tetrahedra.len() as u64,
            limit: MAX_TETRAHEDRA as u64,
            remedy: "use fewer cells",
        });
    }
    for t in &mut tetrahedra {
        let [a, b, c, d] = t.map(|i| points[i as usize]);
        if (b - a).cross(c - a).dot(d - a) < 0.0 {
            t.swap(2, 3);
        }
    }
    Ok(TetMesh {
        vertices: points,
        tetrahedra,
        notes: Vec::new(),
    })
}

/// Position of the linear zero of the field between `a` (0) and `b` (1).
fn crossing(field: &[f64], a: u32, b: u32) -> f64 {
    let (a, b) = (field[a as usize].abs(), field[b as usize].abs());
    a / (a + b)
}

/// Both points on one sublattice: a long edge.
fn is_long(lattice: &Lattice, a: u32, b: u32) -> bool {
    (a < lattice.corner_count()) == (b < lattice.corner_count())
}

/// Moves each point that is too close to a cut onto the nearest cut, and returns the field with
/// zeros there. A cut is too close to at most one end of its edge, so the order does not matter.
fn warp(lattice: &Lattice, points: &mut [DVec3], field: &[f64]) -> Vec<f64> {
    let mut nearest: Vec<Option<(f64, u32)>> = vec![None; points.len()];
    let consider = |a: u32, b: u32| {
        if field[a as usize] * field[b as usize] >= 0.0 {
            return;
        }
        let (threshold, length) = if is_long(lattice, a, b) {
            (WARP_LONG, 1.0)
        } else {
            (WARP_SHORT, 0.75_f64.sqrt())
        };
        for (point, other) in [(a, b), (b, a)] {
            let fraction = crossing(field, point, other);
            let candidate = (fraction * length, other);
            if fraction < threshold && nearest[point as usize].is_none_or(|best| candidate < best) {
                nearest[point as usize] = Some(candidate);
            }
        }
    };
    lattice.for_each_edge(consider);
    let from = points.to_vec();
    let mut warped = field.to_vec();
    for (point, nearest) in nearest.iter().enumerate() {
        if let Some((_, other)) = *nearest {
            let fraction = crossing(field, point as u32, other);
            points[point] = from[point].lerp(from[other as usize], fraction);
            warped[point] = 0.0;
        }
    }
    warped
}

/// Lattice edges that are still cut, inner end first, sorted.
fn cuts(lattice: &Lattice, field: &[f64]) -> Vec<[u32; 2]> {
    let mut cuts = Vec::new();
    lattice.for_each_tetrahedron(|t| {
        for a in t.into_iter().filter(|i| field[*i as usize] > 0.0) {
            for b in t.into_iter().filter(|i| field[*i as usize] < 0.0) {
                cuts.push([a, b]);
            }
        }
    });
    cuts.sort_unstable();
    cuts.dedup();
    cuts
}

struct Stuffing<'a> {
    lattice: &'a Lattice,
    /// Edge of each cut; the points of the cuts follow the lattice points, in this order.
    cuts: Vec<[u32; 2]>,
    /// Field after warping.
    field: &'a [f64],
}

impl Stuffing<'_> {
    fn cut(&self, inside: u32, outside: u32) -> u32 {
        let place = self.cuts.partition_point(|cut| *cut < [inside, outside]);
        (self.field.len() + place) as u32
    }

    /// Whether `a` takes the diagonal of the quadrilateral that remains of the face `a`, `b`, `out`
    /// when `out` is cut off (from `a` to the cut on the edge of `b`) rather than `b`. Both
    /// tetrahedra of a face must agree, so the result depends on the face alone.
    fn goes_first(&self, a: u32, b: u32, out: u32) -> bool {
        let (long_a, long_b) = (is_long(self.lattice, a, out), is_long(self.lattice, b, out));
        if long_a == long_b {
            self.lattice.parity(a) < self.lattice.parity(b)
        } else {
            long_b
        }
    }

    /// Emits the inside part of one lattice tetrahedron, of either orientation.
    fn cut_tetrahedron(&self, corners: [u32; 4], mut emit: impl FnMut([u32; 4])) {
        let sign = |i: u32| self.field[i as usize].partial_cmp(&0.0);
        let of = |wanted: std::cmp::Ordering| {
            corners
                .into_iter()
                .filter(move |&i| sign(i) == Some(wanted))
        };
        let mut inner: Vec<u32> = Vec::with_capacity(4);
        inner.extend(of(std::cmp::Ordering::Greater));
        let zero: Vec<u32> = of(std::cmp::Ordering::Equal).collect();
        let outer: Vec<u32> = of(std::cmp::Ordering::Less).collect();
        match (inner.as_slice(), zero.as_slice(), outer.as_slice()) {
            ([], ..) => {}
            (_, _, []) => emit(corners),
            (&[a], _, _) => emit(corners.map(|i| {
                if self.field[i as usize] < 0.0 {
                    self.cut(a, i)
                } else {
                    i
                }
            })),
            (&[a, b], &[z], &[m]) => {
                let (a, b) = if self.goes_first(a, b, m) {
                    (a, b)
                } else {
                    (b, a)
                };
                let (cut_a, cut_b) = (self.cut(a, m), self.cut(b, m));
                emit([a, b, cut_b, z]);
                emit([a, cut_b, cut_a, z]);
            }
            (&[a, b], _, &[m, n]) => self.cut_wedge([a, b], [m, n], emit),
            (&[_, _, _], _, &[m]) => {
                inner.sort_by(|&a, &b| self.goes_first(b, a, m).cmp(&self.goes_first(a, b, m)));
                let [a, b, c] = [inner[0], inner[1], inner[2]];
                let [cut_a, cut_b, cut_c] = [a, b, c].map(|i| self.cut(i, m));
                emit([a, b, c, cut_c]);
                emit([a, b, cut_b, cut_c]);
                emit([a, cut_a, cut_b, cut_c]);
            }
            _ => unreachable!("a tetrahedron has four corners"),
        }
    }

    /// Two corners inside, two outside: a wedge with a triangle at `a` and one at `b`.
    fn cut_wedge(&self, [a, b]: [u32; 2], [m, n]: [u32; 2], mut emit: impl FnMut([u32; 4])) {
        let (am, an, bm, bn) = (
            self.cut(a, m),
            self.cut(a, n),
            self.cut(b, m),
            self.cut(b, n),
        );
        match (self.goes_first(a, b, m), self.goes_first(a, b, n)) {
            // Both diagonals start at one corner; no other tetrahedron shares the cut
            // quadrilateral.
            (true, true) => {
                emit([a, b, bm, bn]);
                emit([a, am, an, bn]);
                emit([a, am, bm, bn]);
            }
            (false, false) => {
                emit([b, a, am, an]);
                emit([b, bm, bn, an]);
                emit([b, bm, am, an]);
            }
            (true, false) => {
                emit([a, am, an, bm]);
                emit([a, an, b, bm]);
                emit([b, bm, bn, an]);
            }
            (false, true) => {
                emit([a, an, am, bn]);
                emit([a, am, b, bn]);
                emit([b, bn, bm, am]);
            }
        }
    }
}
