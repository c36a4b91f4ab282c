//! Questions about particles and passes over them, in lanes, where each is treated by itself; and access to
//! single ones, in lanes or not.

use super::{
    arithmetic,
    lanes::{Columns, Instructions, Lanes, Mask, SimdWork, Vectors},
};
use crate::particles::{Part, accelerated};
use fearless_simd::{f32x4, prelude::*};
use glam::{DVec3, Vec4};

/// Particles in lanes, as copies of a body or in strips.
pub trait InLanes {
    /// Whether the answer to a question is yes for any particle.
    fn any(&self, question: &impl Question, instructions: Instructions) -> bool;

    /// Performs a pass over the particles, whose carries must be in lanes, too; returns the lanes in
    /// which it acted, as bits.
    fn pass(&mut self, pass: impl ParticlePass, instructions: Instructions) -> u64;

    /// Single particles, whose carries must be in lanes, too; `None` of copies of a body.
    fn singles(&mut self) -> Option<&mut impl Singles>;
}

/// Single particles of a piece of a body, by their numbers in it.
pub trait Singles {
    /// A particle.
    fn single(&self, i: usize) -> Single;

    /// Moves a particle within a substep [m].
    fn shift(&mut self, i: usize, by: DVec3);

    /// Moves a particle within a substep, by a multiplier times a direction [kg·m] and a weight.
    fn push(&mut self, i: usize, by: DVec3, weight: f64);

    /// Adds to the displacement of a particle before a substep [m]. The rounding error of the displacement
    /// is not lost to the velocity, as in the first stage.
    fn accelerate(&mut self, i: usize, by: DVec3);
}

/// A particle within a substep.
#[derive(Debug, Clone, Copy)]
pub struct Single {
    /// Inverse mass [1/kg].
    pub inverse_mass: f64,
    /// Position at the start of the substep [m]: p + c.
    pub start: DVec3,
    /// Position now [m]: p + u.
    pub predicted: DVec3,
}

impl Singles for Part<'_> {
    fn single(&self, i: usize) -> Single {
        Single {
            inverse_mass: self.positions[i].w.into(),
            start: self.start(i),
            predicted: self.predicted(i),
        }
    }

    fn shift(&mut self, i: usize, by: DVec3) {
        Part::shift(self, i, by);
    }

    fn push(&mut self, i: usize, by: DVec3, weight: f64) {
        Part::shift(self, i, by * (weight * f64::from(self.positions[i].w)));
    }

    fn accelerate(&mut self, i: usize, by: DVec3) {
        let (u, c) = (&mut self.displacements[i], &mut self.carry[i]);
        let [next, carried] = accelerated([*u, *c], by);
        (*u, *c) = (next, carried);
    }
}

/// A question about particles in lanes.
pub trait Question {
    /// Whether the answer is yes for any of the particles at these positions [m], with inverse masses
    /// in w, which are displaced by `moved` [m]. Inverse masses are 0 in lanes without a particle.
    fn holds<L: Lanes>(&self, position: &Columns<L>, moved: &Vectors<L>) -> bool;
}

/// A pass over particles in lanes.
pub trait ParticlePass: Copy {
    /// Changes the displacements and carries [m] of particles at these positions [m], with inverse
    /// masses in w. Returns the lanes in which it acted, as bits; nothing has changed in others. Inverse
    /// masses are 0 in lanes without a particle.
    fn act<L: Lanes>(
        &self,
        simd: L,
        position: &Columns<L>,
        moved: &mut Vectors<L>,
        carry: &mut Vectors<L>,
    ) -> u64;
}

/// Adds displacements by a force [m] to the `free` particles, as the first stage adds that by gravity; returns
/// their lanes as bits.
#[inline(always)]
pub(crate) fn push_free<L: Lanes>(
    free: Mask<L>,
    by: Vectors<L>,
    moved: &mut Vectors<L>,
    carry: &mut Vectors<L>,
) -> u64 {
    for (axis, by) in by.into_iter().enumerate() {
        let [next, carried] = arithmetic::begin([moved[axis], carry[axis]], by);
        moved[axis] = free.select(next, moved[axis]);
        carry[axis] = free.select(carried, carry[axis]);
    }
    free.to_bitmask()
}

/// Performs a pass over the particles of a piece; returns whether it acted on any.
pub(crate) fn pass_over(part: Part, pass: impl ParticlePass, instructions: Instructions) -> bool {
    let mut acted = false;
    let work = PassOver {
        part,
        pass,
        acted: &mut acted,
    };
    instructions.run(work);
    acted
}

struct PassOver<'a, 'b, P> {
    part: Part<'b>,
    /// By value: what it needs stays in registers.
    pass: P,
    acted: &'a mut bool,
}

impl<P: ParticlePass> SimdWork for PassOver<'_, '_, P> {
    #[inline(always)]
    fn run<L: Lanes>(self, simd: L) {
        let Self { part, pass, acted } = self;
        let positions = part.positions.chunks(L::LANES);
        let displacements = part.displacements.chunks_mut(L::LANES);
        let carries = part.carry.chunks_mut(L::LANES);
        for ((positions, displacements), carries) in positions.zip(displacements).zip(carries) {
            let position = columns(simd, positions);
            let [x, y, z, w] = columns(simd, displacements);
            let mut moved = [x, y, z];
            let [x, y, z, rest] = columns(simd, carries);
            let mut carry = [x, y, z];
            if pass.act(simd, &position, &mut moved, &mut carry) != 0 {
                *acted = true;
                let ([x, y, z], [a, b, c]) = (moved, carry);
                store(simd, [x, y, z, w], displacements);
                store(simd, [a, b, c, rest], carries);
            }
        }
    }
}

/// Components of at most as many particles as there are lanes; zeros in the other lanes.
#[inline(always)]
fn columns<L: Lanes>(simd: L, particles: &[Vec4]) -> Columns<L> {
    let rows = simd.rows(
        #[inline(always)]
        |lane| {
            let particle = particles.get(lane).map_or([0.0; 4], Vec4::to_array);
            f32x4::simd_from(simd, particle)
        },
    );
    simd.transpose(rows)
}

/// The opposite.
#[inline(always)]
fn store<L: Lanes>(simd: L, columns: Columns<L>, particles: &mut [Vec4]) {
    for (k, rows) in simd.transpose(columns).into_iter().enumerate() {
        simd.split(
            rows,
            #[inline(always)]
            |quarter, particle| {
                if let Some(into) = particles.get_mut(4 * quarter + k) {
                    *into = Vec4::from_array(particle.into());
                }
            },
        );
    }
}
