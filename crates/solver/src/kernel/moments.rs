//! What a pass over constraints does to the angular momentum of particles: sums about a point, and the
//! rotation that takes it back.
//!
//! Each of [`MAX_WIDTH`] lanes sums up the particles that it has in ascending order, and the lanes are
//! added pairwise: the bits are the same with any instruction set, for copies and in strips.

use super::{
    arithmetic::{cross, scaled},
    lanes::{Columns, Floats, Instructions, Lanes, MAX_WIDTH, SimdWork, Vectors},
};
use crate::{layout::strips::Strips, particles::Part};
use fearless_simd::{f32x4, prelude::*};
use glam::{DMat3, DVec3, Vec3, Vec4};

/// Number of sums.
pub(super) const COUNT: usize = 16;

/// Sums over particles of masses m at r from a point, by which a pass has moved by Δ: r × mΔ [kg·m²],
/// mΔ [kg·m], m [kg], mr [kg·m], and m times xx, yy, zz, xy, yz and zx of r [kg·m²].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Moments<F = f32>(pub [F; COUNT]);

/// The sums of particles in each lane.
pub(super) type Sums<L> = [Floats<L>; COUNT];

impl Moments<f64> {
    /// Adds those of a particle or of a piece.
    pub fn add(&mut self, other: [f64; COUNT]) {
        for (sum, own) in self.0.iter_mut().zip(other) {
            *sum += own;
        }
    }

    /// Those of one particle of a mass [kg] at r [m] that was moved by Δ [m].
    pub fn of(mass: f64, r: DVec3, moved: DVec3) -> [f64; COUNT] {
        let (mr, md) = (r * mass, moved * mass);
        let turned = r.cross(md);
        let [a, b, c] = [mr * r.x, mr * r.y, mr * r.z];
        [
            turned.x, turned.y, turned.z, md.x, md.y, md.z, mass, mr.x, mr.y, mr.z, a.x, b.y, c.z,
            a.y, b.z, c.x,
        ]
    }

    /// The small rotation about the center of mass that takes back all of the angular momentum: its
    /// angle [rad] as a vector, and the center relative to the point [m]. None of a point or if the
    /// sums are not finite.
    pub fn turn_back(&self) -> Option<(DVec3, DVec3)> {
        let [
            tx,
            ty,
            tz,
            mx,
            my,
            mz,
            mass,
            x,
            y,
            z,
            xx,
            yy,
            zz,
            xy,
            yz,
            zx,
        ] = self.0;
        let center = DVec3::new(x, y, z) / mass;
        let turned = DVec3::new(tx, ty, tz) - center.cross(DVec3::new(mx, my, mz));
        let second = DMat3::from_cols(
            DVec3::new(xx, xy, zx),
            DVec3::new(xy, yy, yz),
            DVec3::new(zx, yz, zz),
        );
        let outer = DMat3::from_cols(center * center.x, center * center.y, center * center.z);
        let about = second - outer * mass;
        let trace = about.x_axis.x + about.y_axis.y + about.z_axis.z;
        let inertia = DMat3::from_diagonal(DVec3::splat(trace * (1.0 + LINE))) - about;
        let angle = -(inertia.inverse() * turned);
        (trace > 0.0 && angle.is_finite() && angle != DVec3::ZERO).then_some((angle, center))
    }
}

/// Fraction of the second moments by which each moment of inertia is taken as larger: of a body that is
/// less than a thousandth as thick as long, the rotation about its length would be that of rounding in
/// single precision, and is taken back by a part only.
const LINE: f64 = 1e-6;

impl Moments {
    /// From the sums of each lane.
    pub(super) fn of_lanes(mut lanes: [[f32; MAX_WIDTH]; COUNT]) -> Self {
        Self(std::array::from_fn(|component| {
            let lanes = &mut lanes[component];
            let mut half = MAX_WIDTH / 2;
            while half > 0 {
                for lane in 0..half {
                    lanes[lane] += lanes[lane + half];
                }
                half /= 2;
            }
            lanes[0]
        }))
    }

    /// In double precision.
    pub fn wide(self) -> [f64; COUNT] {
        self.0.map(f64::from)
    }
}

/// A small rotation: displaces what is at r from `origin` by `angle` × r + `shift`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Turn {
    /// The point to which r is relative [m].
    pub origin: Vec3,
    /// Angle [rad].
    pub angle: Vec3,
    /// Displacement at the origin [m].
    pub shift: Vec3,
}

impl Turn {
    /// By an angle [rad] about a center that is relative to `origin` [m].
    pub fn about(origin: Vec3, angle: DVec3, center: DVec3) -> Self {
        Self {
            origin,
            angle: angle.as_vec3(),
            shift: center.cross(angle).as_vec3(),
        }
    }

    /// Whether it moves nothing.
    pub fn is_none(&self) -> bool {
        self.angle == Vec3::ZERO
    }

    /// Moves the particles of a piece.
    pub fn act(&self, part: Part) {
        let Self {
            origin,
            angle,
            shift,
        } = self;
        for (x, u) in part.positions.iter().zip(part.displacements) {
            let r = x.truncate() - *origin;
            let by = cross(&angle.to_array(), &r.to_array());
            if x.w > 0.0 {
                *u += (Vec3::from_array(by) + *shift).extend(0.0);
            }
        }
    }
}

/// A vector in all lanes.
#[inline(always)]
pub(super) fn splat<L: Lanes>(simd: L, vector: Vec3) -> Vectors<L> {
    vector.to_array().map(
        #[inline(always)]
        |component| simd.number(component),
    )
}

/// Displacements of particles at these positions after a [`Turn`] of which the parts are given.
#[inline(always)]
pub(super) fn turned<L: Lanes>(
    simd: L,
    [origin, angle, shift]: &[Vectors<L>; 3],
    position: &Columns<L>,
    moved: &Vectors<L>,
) -> Vectors<L> {
    let zero = simd.number(0.0);
    let turns = angle[0].abs() + angle[1].abs() + angle[2].abs();
    let moves = position[3].simd_gt(zero) & turns.simd_gt(zero);
    let r = [
        position[0] - origin[0],
        position[1] - origin[1],
        position[2] - origin[2],
    ];
    let by = cross(angle, &r);
    [
        moves.select(moved[0] + (by[0] + shift[0]), moved[0]),
        moves.select(moved[1] + (by[1] + shift[1]), moved[1]),
        moves.select(moved[2] + (by[2] + shift[2]), moved[2]),
    ]
}

/// Adds the particles at these positions, which were moved by Δ, to the sums of their lanes. Those
/// without mass are left out.
#[inline(always)]
pub(super) fn add<L: Lanes>(
    simd: L,
    sums: &mut Sums<L>,
    origin: &Vectors<L>,
    position: &Columns<L>,
    by: &Vectors<L>,
) {
    let zero = simd.number(0.0);
    let inverse = position[3];
    let mass = inverse
        .simd_gt(zero)
        .select(simd.number(1.0) / inverse, zero);
    let r = [
        position[0] - origin[0],
        position[1] - origin[1],
        position[2] - origin[2],
    ];
    let (mr, md) = (scaled(&r, mass), scaled(by, mass));
    let turned = cross(&r, &md);
    for k in 0..3 {
        sums[k] += turned[k];
        sums[3 + k] += md[k];
        sums[7 + k] += mr[k];
        sums[10 + k] += mr[k] * r[k];
        sums[13 + k] += mr[k] * r[(k + 1) % 3];
    }
    sums[6] += mass;
}

/// The moments of the particles of a piece, the first of which has number `base`, that were displaced
/// by `before` [m] before a pass.
pub(crate) fn moments(
    part: &Part,
    before: &[Vec4],
    (origin, strips): (Vec3, Option<Strips>),
    base: usize,
    instructions: Instructions,
) -> Moments {
    let mut lanes = [[0.0; MAX_WIDTH]; COUNT];
    let work = Summing {
        positions: part.positions,
        displacements: part.displacements,
        before,
        origin,
        strips,
        base,
        lanes: &mut lanes,
    };
    instructions.run_in(instructions.widest(), work);
    Moments::of_lanes(lanes)
}

struct Summing<'a> {
    positions: &'a [Vec4],
    displacements: &'a [Vec4],
    before: &'a [Vec4],
    origin: Vec3,
    strips: Option<Strips>,
    base: usize,
    lanes: &'a mut [[f32; MAX_WIDTH]; COUNT],
}

impl Summing<'_> {
    /// Sums up the particles that `place` gives for each row and lane, if there is one.
    #[inline(always)]
    fn sum<L: Lanes>(
        &mut self,
        simd: L,
        rows: std::ops::Range<usize>,
        place: impl Fn(usize, usize) -> Option<usize>,
    ) {
        let origin = splat(simd, self.origin);
        for low in (0..MAX_WIDTH).step_by(L::LANES) {
            let mut sums = [simd.number(0.0); COUNT];
            for row in rows.clone() {
                let particle = |lane: usize| {
                    let i = place(row, low + lane)?;
                    Some((
                        self.positions.get(i)?,
                        self.displacements.get(i)?,
                        self.before.get(i)?,
                    ))
                };
                let positions = simd.rows(
                    #[inline(always)]
                    |lane| {
                        let own = particle(lane).map_or([0.0; 4], |(x, ..)| x.to_array());
                        f32x4::simd_from(simd, own)
                    },
                );
                let moved = simd.rows(
                    #[inline(always)]
                    |lane| {
                        let by = particle(lane).map_or(Vec4::ZERO, |(_, u, before)| *u - *before);
                        f32x4::simd_from(simd, by.to_array())
                    },
                );
                let position = simd.transpose(positions);
                let [x, y, z, _] = simd.transpose(moved);
                add(simd, &mut sums, &origin, &position, &[x, y, z]);
            }
            for (lanes, sum) in self.lanes.iter_mut().zip(sums) {
                sum.store_slice(&mut lanes[low..][..L::LANES]);
            }
        }
    }
}

impl SimdWork for Summing<'_> {
    #[inline(always)]
    fn run<L: Lanes>(mut self, simd: L) {
        let count = self.positions.len();
        match self.strips {
            None => self.sum(
                simd,
                0..count.div_ceil(MAX_WIDTH),
                #[inline(always)]
                |row, lane| Some(row * MAX_WIDTH + lane),
            ),
            Some(strips) => {
                let base = self.base;
                let rows = strips.rows(&(base..base + count));
                self.sum(
                    simd,
                    rows,
                    #[inline(always)]
                    |row, lane| Some(strips.row(row).particle(lane)? - base),
                );
            }
        }
    }
}
