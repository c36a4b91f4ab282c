//! Interface of external forces.

use crate::{
    Topology,
    kernel::{
        arithmetic::{Number, constants},
        each::{InLanes, ParticlePass, pass_over, push_free},
        lanes::{Columns, Instructions, Lanes, MAX_WIDTH, Vectors, WIDTH},
    },
    particles::{Part, accelerated, wide},
};
use fearless_simd::prelude::*;
use glam::{DVec3, Vec4};
use std::cell::Cell;

/// A particle on which a force acts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mote {
    /// Position [m].
    pub x: DVec3,
    /// Velocity [m/s].
    pub v: DVec3,
    /// Inverse mass [1/kg]; 0 for fixed particles.
    pub w: f64,
}

/// Time of a force evaluation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Start of the substep [s].
    pub time: f64,
    /// Length of the substep [s].
    pub h: f64,
    /// Gravity [m/s²], which the first stage adds to velocities after the forces.
    pub gravity: DVec3,
}

impl Moment {
    /// Velocity that a particle with the velocity `v` would have at the end of the substep without the
    /// force [m/s]. A force that depends on the velocity is implicit in that, so that it balances
    /// gravity exactly at terminal speed, however long the substep is.
    pub(super) fn coasting(&self, v: DVec3) -> DVec3 {
        v + self.gravity * self.h
    }
}

/// Fraction of the difference u − v to the velocity of the air that a particle takes in a substep of
/// dv/dt = c (u − v): implicit, so that it is stable for any coupling c [1/s].
pub(super) fn approach(coupling: f64, moment: &Moment) -> f64 {
    let way = coupling * moment.h;
    way / (1.0 + way)
}

/// A force on each particle by itself, by a formula of its position and velocity. It acts in lanes, in single
/// precision: a change of velocity is then exact to some units in its last place, as that by gravity.
pub trait Field: Copy {
    /// Kind of the force.
    const KIND: ForceKind;

    /// Change of the velocity [m/s] of a particle at a position [m] with the velocity `coasting` that it would
    /// have at the end of the substep without the force [m/s], as gravity alone would give it.
    fn change<N: Number>(&self, moment: &Moment, position: [N; 3], coasting: [N; 3]) -> [N; 3];
}

/// An external force.
pub trait Force: Copy {
    /// Kind of the force.
    const KIND: ForceKind;
    /// Whether it acts on each particle by itself, also [in lanes](Self::act_in_lanes).
    const IS_FIELD: bool = false;

    /// Acts on particles in lanes, if it [can](Self::IS_FIELD).
    fn act_in_lanes(&self, _: &Moment, _: &mut impl InLanes, _: Instructions) {}

    /// The same on those of a piece.
    fn act_on(&self, _: &Moment, _: Part, _: Instructions) {}

    /// Acts on all particles of a body, each by its weight from 0 to 1; by default in double precision.
    fn act_on_body(&self, weight: impl Fn(u32) -> f64, body: ForcedBody) {
        on_particles(self, weight, body);
    }

    /// Calls `push` with the velocity changes of particles [m/s]. `at(i)` is the state of a
    /// particle of the body, including earlier calls. Fixed particles may be included.
    fn act(
        &self,
        topology: &Topology,
        moment: Moment,
        at: impl Fn(u32) -> Mote,
        push: impl FnMut(u32, DVec3),
    );
}

impl<F: Field> Force for F {
    const KIND: ForceKind = F::KIND;
    const IS_FIELD: bool = true;

    fn act_in_lanes(&self, moment: &Moment, lanes: &mut impl InLanes, instructions: Instructions) {
        lanes.pass(FieldPass::of(*self, *moment), instructions);
    }

    fn act_on(&self, moment: &Moment, part: Part, instructions: Instructions) {
        pass_over(part, FieldPass::of(*self, *moment), instructions);
    }

    fn act_on_body(&self, weight: impl Fn(u32) -> f64, body: ForcedBody) {
        let ForcedBody {
            moment,
            part,
            instructions,
            ..
        } = body;
        let (mut rest, mut first) = (part, 0);
        while !rest.positions.is_empty() {
            let count = rest.positions.len().min(WIDTH);
            let (some, others) = rest.split_at(count);
            let mut weights = [0.0; MAX_WIDTH];
            for (i, own) in (first..).zip(&mut weights[..count]) {
                *own = weight(i) as f32;
            }
            let pass = FieldPass {
                weights: Some(weights),
                ..FieldPass::of(*self, moment)
            };
            pass_over(some, pass, instructions);
            (rest, first) = (others, first + WIDTH as u32);
        }
    }

    fn act(
        &self,
        topology: &Topology,
        moment: Moment,
        at: impl Fn(u32) -> Mote,
        mut push: impl FnMut(u32, DVec3),
    ) {
        for i in 0..topology.particles() as u32 {
            let Mote { x, v, .. } = at(i);
            let coasting = moment.coasting(v);
            push(i, self.change(&moment, x.into(), coasting.into()).into());
        }
    }
}

/// A body on which a force acts as a whole.
#[derive(Debug)]
pub struct ForcedBody<'a> {
    /// Its topology.
    pub topology: &'a Topology,
    /// Time.
    pub moment: Moment,
    /// Memory for what acts on its elements: force [N], and by how much it decreases with the velocity
    /// [N·s/m] in w.
    pub loads: &'a mut Vec<Vec4>,
    /// All its particles.
    pub part: Part<'a>,
    /// The instruction set for lanes.
    pub instructions: Instructions,
}

/// Applies a force to the particles of a body in double precision, each by its weight from 0 to 1.
fn on_particles(force: &impl Force, weight: impl Fn(u32) -> f64, body: ForcedBody) {
    let ForcedBody {
        topology,
        moment,
        part,
        ..
    } = body;
    let Part {
        positions,
        displacements,
        carry,
        ..
    } = part;
    let displacements = Cell::from_mut(displacements).as_slice_of_cells();
    let carry = Cell::from_mut(carry).as_slice_of_cells();
    let at = |i: u32| {
        let i = i as usize;
        let (x, c) = (positions[i], wide(carry[i].get()));
        Mote {
            x: wide(x) + c,
            v: (wide(displacements[i].get()) - c) / moment.h,
            w: x.w.into(),
        }
    };
    force.act(topology, moment, at, |i, change| {
        let weight = weight(i);
        if positions[i as usize].w > 0.0 && weight > 0.0 {
            let (u, c) = (&displacements[i as usize], &carry[i as usize]);
            let by = change * weight * moment.h;
            let [next, carried] = accelerated([u.get(), c.get()], by);
            u.set(next);
            c.set(carried);
        }
    });
}

/// A field on particles in lanes.
#[derive(Clone, Copy)]
struct FieldPass<F> {
    field: F,
    moment: Moment,
    /// Of the particles, from 0 to 1; `None` where all are 1.
    weights: Option<[f32; MAX_WIDTH]>,
}

impl<F> FieldPass<F> {
    fn of(field: F, moment: Moment) -> Self {
        Self {
            field,
            moment,
            weights: None,
        }
    }
}

impl<F: Field> ParticlePass for FieldPass<F> {
    #[inline(always)]
    fn act<L: Lanes>(
        &self,
        simd: L,
        position: &Columns<L>,
        moved: &mut Vectors<L>,
        carry: &mut Vectors<L>,
    ) -> u64 {
        let Self {
            field,
            moment,
            weights,
        } = *self;
        let zero = simd.number(0.0);
        let mut free = position[3].simd_gt(zero);
        let mut h = simd.number(moment.h as f32);
        if let Some(weights) = weights {
            let weight = simd.load(&weights[..L::LANES]);
            free &= weight.simd_gt(zero);
            h *= weight;
        }
        if !free.any_true() {
            return 0;
        }
        let per_second = simd.number((1.0 / moment.h) as f32);
        let mut coasting = constants(per_second, moment.gravity * moment.h);
        for (axis, v) in coasting.iter_mut().enumerate() {
            *v += (moved[axis] - carry[axis]) * per_second;
        }
        let [x, y, z, _] = *position;
        let change = field.change(&moment, [x, y, z], coasting);
        let [x, y, z] = change;
        push_free::<L>(free, [x * h, y * h, z * h], moved, carry)
    }
}

/// A visitor of the forces on a body, generic over their types.
pub trait VisitForces {
    /// Visits one force.
    fn visit<F: Force>(&mut self, force: &F);
}

/// Generates the kinds of forces.
macro_rules! kinds {
    (
        { forces { $($force:ident $field:ident $does:literal;)* } $($others:tt)* }
        $($rest:tt)*
    ) => {
        /// The forces, in the order in which they act.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        pub enum ForceKind {
            $(#[doc = concat!("[`", stringify!($force), "`](crate::", stringify!($force), ").")] $force,)*
        }

        impl ForceKind {
            /// All of them.
            pub const ALL: [Self; [$(Self::$force),*].len()] = [$(Self::$force),*];
            /// Number of kinds.
            pub const COUNT: usize = Self::ALL.len();

            /// Its name in files and commands.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$force => stringify!($field),)*
                }
            }
        }
    };
}

crate::effects!(kinds);
