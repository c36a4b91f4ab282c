//! Wind on surfaces: drag and lift of every triangle.

use super::{
    law::{Force, ForceKind, ForcedBody, Moment, Mote},
    noise::Noise,
};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Coefficient, Finite, Length, Topology,
    kernel::{
        arithmetic::{Number, constants, cross, dot, exact_sum, minus},
        lanes::{Lanes, MAX_WIDTH, SimdWork, Vectors},
    },
    particles::Part,
};
use fearless_simd::{f32x4, prelude::*};
use glam::{DVec3, Vec4};
use serde::{Deserialize, Serialize};

/// Wind on the surface of the body: cloth, and the boundary of a solid. Ropes are not affected.
///
/// The force on a triangle of area A and leeward normal n, in air with the relative velocity u, is
///
/// F = ½ρA (u·n) ((C_D − C_L) u + C_L ‖u‖ n),
///
/// as for the plates of Ling, Damodaran and Gay (*Aerodynamic Force Models for Animating Cloth
/// Motion in Air Flow*, 1996): C_D across the flow, and lift for oblique plates.
///
/// ```
/// use pliant_solver::{Coefficient, Finite, Wind};
///
/// // A breeze along z with gusts of half its speed.
/// let breeze = Wind {
///     x: Finite::of(0.0),
///     z: Finite::of(4.0), // m/s
///     turbulence: Coefficient::of(2.0), // m/s
///     ..Wind::default()
/// };
/// # assert_ne!(breeze, Wind::default());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Wind {
    /// Mean wind along x [m/s]; default 5.
    pub x: Finite,
    /// Mean wind along y [m/s]; default 0.
    pub y: Finite,
    /// Mean wind along z [m/s]; default 0.
    pub z: Finite,
    /// Largest gust along each axis [m/s]; default 0. Gusts are frozen in the air and move with the
    /// mean wind (Taylor's hypothesis).
    pub turbulence: Coefficient,
    /// Gust size [m]; default 0.5.
    pub scale: Length,
    /// Air density ρ [kg/m³]; default 1.2.
    pub density: Coefficient,
    /// Drag coefficient C_D of a plate across the flow; default 1.2.
    pub drag: Coefficient,
    /// Lift coefficient C_L; default 0.6.
    pub lift: Coefficient,
}

impl Default for Wind {
    fn default() -> Self {
        Self {
            x: Finite::of(5.0),
            y: Finite::ZERO,
            z: Finite::ZERO,
            turbulence: Coefficient::default(),
            scale: Length::of(0.5),
            density: Coefficient::of(1.2),
            drag: Coefficient::of(1.2),
            lift: Coefficient::of(0.6),
        }
    }
}

impl Wind {
    /// Velocity of the air at a position and a time [m/s].
    #[must_use]
    pub fn air(&self, place: DVec3, time: f64) -> DVec3 {
        self.air_by(&mut Noise::default(), place, time)
    }

    fn air_by(&self, noise: &mut Noise, place: DVec3, time: f64) -> DVec3 {
        let mean = Finite::vector([self.x, self.y, self.z]);
        let gusts = f64::from(self.turbulence.get());
        if gusts == 0.0 {
            return mean;
        }
        mean + noise.at((place - mean * time) / f64::from(self.scale.get())) * gusts
    }

    /// Force on a third of a triangle [N], and by how much it decreases with the velocity [N·s/m]: with two of its
    /// sides [m], in air with the velocity u relative to it [m/s].
    #[inline(always)]
    fn load<N: Number>(&self, [ab, ac]: [[N; 3]; 2], u: [N; 3]) -> ([N; 3], N) {
        let like = u[0];
        let (drag, lift) = (f64::from(self.drag), f64::from(self.lift));
        let across = cross(&ab, &ac);
        // Twice the area; a triangle without area has no normal.
        let twice_area = dot(&across, &across).root().or_more(like.of(1e-30));
        let flow = dot(&u, &across);
        let size = flow.or_more(like.of(0.0) - flow);
        let third = f64::from(self.density) / 12.0;
        let along = like.of(third * (drag - lift)) * size;
        let out = like.of(third * lift) * flow * (dot(&u, &u).root() / twice_area);
        let force = [
            along * u[0] + out * across[0],
            along * u[1] + out * across[1],
            along * u[2] + out * across[2],
        ];
        (force, like.of(third * drag.max(lift)) * size)
    }
}

impl Force for Wind {
    const KIND: ForceKind = ForceKind::Wind;

    fn act_on_body(&self, weight: impl Fn(u32) -> f64, body: ForcedBody) {
        let ForcedBody {
            topology,
            moment,
            loads,
            part,
            instructions,
        } = body;
        loads.clear();
        loads.resize(topology.particles(), Vec4::ZERO);
        instructions.run(Blow {
            wind: *self,
            triangles: &topology.triangles,
            moment,
            part: &part,
            loads,
        });
        let h = moment.h as f32;
        let fall = (moment.gravity * moment.h).as_vec3();
        for (i, load) in (0..).zip(&*loads) {
            let place = i as usize;
            let weight = weight(i) as f32;
            let response = h * part.positions[place].w;
            if response == 0.0 || weight == 0.0 {
                continue;
            }
            // Implicit, so that it is stable for any wind and light cloth, in the change of the velocity by
            // the force and by gravity.
            let change = load.truncate() - fall * load.w;
            let push = change * (weight * h * response / (1.0 + load.w * response));
            let (u, c) = (&mut part.displacements[place], &mut part.carry[place]);
            let (next, lost) = exact_sum(*u, push.extend(0.0));
            (*u, *c) = (next, *c - lost);
        }
    }

    fn act(
        &self,
        topology: &Topology,
        moment: Moment,
        at: impl Fn(u32) -> Mote,
        mut push: impl FnMut(u32, DVec3),
    ) {
        let mut noise = Noise::default();
        let mut loads = vec![(DVec3::ZERO, 0.0); topology.particles()];
        for &corners in topology.triangles.iter() {
            let [a, b, c] = corners.map(&at);
            let air = self.air_by(&mut noise, (a.x + b.x + c.x) / 3.0, moment.time);
            let u = air - (a.v + b.v + c.v) / 3.0;
            let (force, stiffness) = self.load([(b.x - a.x).into(), (c.x - a.x).into()], u.into());
            for i in corners {
                let load = &mut loads[i as usize];
                *load = (load.0 + DVec3::from(force), load.1 + stiffness);
            }
        }
        for (i, (force, stiffness)) in (0..).zip(loads) {
            let response = moment.h * at(i).w;
            let change = force - moment.gravity * moment.h * stiffness;
            push(i, change * (response / (1.0 + stiffness * response)));
        }
    }
}

/// Sums up the loads on the particles of a body, some triangles at once.
struct Blow<'a, 'b> {
    wind: Wind,
    triangles: &'a [[u32; 3]],
    moment: Moment,
    part: &'a Part<'b>,
    loads: &'a mut [Vec4],
}

impl SimdWork for Blow<'_, '_> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self {
            wind,
            triangles,
            moment,
            part,
            loads,
        } = self;
        let mut noise = Noise::default();
        let per_second = simd.number((1.0 / moment.h) as f32);
        let third = simd.number(1.0 / 3.0);
        let mean = Finite::vector([wind.x, wind.y, wind.z]);
        for some in triangles.chunks(L::LANES) {
            let first = corner(simd, part.positions, some, 0);
            let carry = corner(simd, part.carry, some, 0);
            let mut way = minus(&corner(simd, part.displacements, some, 0), &carry);
            let mut sides = [first; 2];
            for (number, side) in (1..).zip(&mut sides) {
                let (other, carried) = (
                    corner(simd, part.positions, some, number),
                    corner(simd, part.carry, some, number),
                );
                let moved = minus(&corner(simd, part.displacements, some, number), &carried);
                for axis in 0..3 {
                    side[axis] = (other[axis] - first[axis]) + (carried[axis] - carry[axis]);
                    way[axis] += moved[axis];
                }
            }
            let mut air = constants(third, mean);
            if wind.turbulence.get() != 0.0 {
                let mut gusts = [[0.0; MAX_WIDTH]; 3];
                for lane in 0..some.len() {
                    // The middle, to the same part of the triangle however far from the origin.
                    let middle = |axis: usize| {
                        let arms = f64::from(sides[0][axis][lane] + sides[1][axis][lane]);
                        let start = f64::from(first[axis][lane]) + f64::from(carry[axis][lane]);
                        start + arms / 3.0
                    };
                    let place = DVec3::new(middle(0), middle(1), middle(2));
                    let air = wind.air_by(&mut noise, place, moment.time).to_array();
                    for (gusts, air) in gusts.iter_mut().zip(air) {
                        gusts[lane] = air as f32;
                    }
                }
                for (air, gusts) in air.iter_mut().zip(&gusts) {
                    *air = simd.load(&gusts[..L::LANES]);
                }
            }
            let mut u = air;
            for (axis, u) in u.iter_mut().enumerate() {
                *u -= way[axis] * (per_second * third);
            }
            let ([x, y, z], stiffness) = wind.load(sides, u);
            let mut all = [Vec4::ZERO; MAX_WIDTH];
            for (k, rows) in simd.transpose([x, y, z, stiffness]).into_iter().enumerate() {
                simd.split(
                    rows,
                    #[inline(always)]
                    |quarter, load| {
                        all[4 * quarter + k] = Vec4::from_array(load.into());
                    },
                );
            }
            for (triangle, load) in some.iter().zip(&all) {
                for &i in triangle {
                    loads[i as usize] += *load;
                }
            }
        }
    }
}

/// A corner of some triangles in a column of particles, in lanes. Lanes without a triangle repeat the first.
#[inline(always)]
fn corner<L: Lanes>(simd: L, column: &[Vec4], triangles: &[[u32; 3]], corner: usize) -> Vectors<L> {
    let rows = simd.rows(
        #[inline(always)]
        |lane| {
            let triangle = triangles.get(lane).unwrap_or(&triangles[0]);
            let i = triangle[corner] as usize;
            f32x4::simd_from(simd, column[i].to_array())
        },
    );
    let [x, y, z, _] = simd.transpose(rows);
    [x, y, z]
}
