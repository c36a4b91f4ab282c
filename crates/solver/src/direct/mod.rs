//! Direct solution of a body's substep, instead of sweeps: for slender and stiff bodies, through which
//! sweeps pass a load on but slowly.
//!
//! A substep of XPBD asks for
//!
//! M (x − y) = Σ ∇Cᵀλ,  C(x) + α̃λ + γ∇C·(x − p) = 0,  α̃ = α/h², γ = τ/h,
//!
//! y being the prediction and p the start of the substep. With λ eliminated, a Newton step of it is a
//! symmetric positive definite system of a 3 × 3 block for each particle and each pair of neighbours,
//!
//! (M + Σ (1 + γ)/α' ∇Cᵀ∇C) Δx = M (y − x) + Σ ∇Cᵀ (λ − (C + α̃λ + γ∇C·(x − p))/α'),
//!
//! that a sparse Cholesky factorization solves to the end, anew in every iteration. α' is α̃, but never
//! less than a small share of Σ w‖∇C‖², so that what is rigid is stiff enough and still has digits.
//! Everything is in `f64` and starts from nothing, so that no state outlives the substep.
//!
//! - An edge under tension also resists being turned, with force over length; without that a light
//!   rope under a heavy weight flutters. Where that matters, the system is made and solved once more,
//!   with the tensions that the first solution has found.
//! - An iteration is a Newton step, in the place of a sweep. All else that moves particles acts between
//!   them as it does between sweeps: strain limits, pressure, tethers, hands, ground and colliders. What
//!   they do to a particle is added to its y, so that the next step is of the whole body under these
//!   pushes. Without them, one step is nearly always enough; with them, more bring the body nearer to
//!   where it bears them, by about the share of its mass that they do not touch.
//! - A step that does not lower what it minimises, an augmented Lagrangian, is shortened. Where none helps, and where a body
//!   is far from its rest shape, as one squashed flat or turned inside out is, the iteration is a sweep:
//!   a linear system knows nothing of where such a body should go, and sweeps recover.
//! - It is XPBD: other [methods](super::Method) sweep. So are the equations of
//!   [neo-Hookean](super::NeoHookean) tetrahedra, whose ∇C of one direction says nothing of how stiff
//!   they are in the others, and strain limits, most of which say nothing at any time.
//! - Smoothing iterations leave alone what is solved directly.

mod assemble;
pub(super) mod matrix;
pub(super) mod plan;

use super::{
    Effects, ElasticKind, Method, Topology, TopologyId, effects::Multipliers,
    effects::kinds::sweep_kind, lanes::Instructions, particles::Part,
};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use assemble::{Assemble, Column, Columns, ForeseenMerit, Links, Merit, Positions, Prepare};
use glam::{DVec3, Vec4};
use matrix::{Matrix, add_unit};
use plan::{Plan, TooLarge};
use serde::{Deserialize, Serialize};
use std::fmt;

/// A body is solved directly, not by sweeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Direct {}

/// Multiplications of a factorization at most: some 5 ms.
pub const MAX_WORK: u64 = 20_000_000;

/// Systems of an iteration at most, each with the tensions that the one before has found.
const PASSES: usize = 3;

/// Shorter steps that are tried, and by how much each is.
const TRIALS: usize = 5;
const SHORTER: f64 = 0.4;

/// What is minimised may rise by this share, as rounding.
const SLACK: f64 = 1e-6;

/// The plan of a body that is solved directly, and the room that it works in; nothing for other bodies.
/// It follows from the topology and the effects, and is no part of the state.
#[derive(Debug, Clone, Default)]
pub struct Factors(Option<Box<Workspace>>);

#[derive(Debug, Clone, Default)]
struct Workspace {
    /// Which effects of how many particles `plan` is for.
    planned: Option<(u32, TopologyId)>,
    plan: Option<Plan>,
    columns: Columns,
    matrix: Matrix,
    right: Vec<DVec3>,
    step: Vec<DVec3>,
    w: Vec<f64>,
    x: Vec<DVec3>,
    predicted: Vec<DVec3>,
    previous: Vec<DVec3>,
    before: Vec<DVec3>,
    /// Displacements that the last iteration left [m].
    left: Vec<Vec4>,
    /// λ of sweeps.
    swept: [Vec<f32>; ElasticKind::COUNT],
    done: Done,
}

/// What became of the last substep.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Done {
    /// Nothing yet.
    #[default]
    Nothing,
    /// It was solved.
    Solved,
    /// An iteration was a sweep, because the body was far from its rest shape or no step helped.
    Swept,
    /// It was swept, because a factorization would take more than [`MAX_WORK`].
    TooLarge,
}

impl Done {
    /// Why it was not solved, in a sentence.
    #[must_use]
    pub const fn why_swept(self) -> Option<&'static str> {
        match self {
            Self::Nothing | Self::Solved => None,
            Self::Swept => Some(
                "Fell back to Gauss–Seidel: the body is far from its rest shape, or no direct step \
                 reduced the residual.",
            ),
            Self::TooLarge => Some(
                "Fell back to Gauss–Seidel: the factorization would take more than 20 million \
                 multiplications. Use fewer cells.",
            ),
        }
    }
}

/// Why a body should not carry [`Direct`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unfit {
    /// The method is not XPBD.
    Method,
    /// It carries neo-Hookean tetrahedra.
    NeoHookean,
    /// A factorization would take more than [`MAX_WORK`]; how many particles there are.
    TooLarge(usize),
}

impl fmt::Display for Unfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Method => write!(
                f,
                "the direct solver needs the method XPBD, but the world uses another; choose XPBD"
            ),
            Self::NeoHookean => write!(
                f,
                "the direct solver does not support neo-Hookean tetrahedra; use stretch and volume instead"
            ),
            Self::TooLarge(particles) => write!(
                f,
                "a factorization of its {particles} particles would take more than {} million \
                 multiplications per substep; use fewer cells",
                MAX_WORK / 1_000_000
            ),
        }
    }
}

/// Why a body with these effects should not be solved directly, if it should not.
#[must_use]
pub fn unfit(topology: &Topology, effects: &Effects, method: Method) -> Option<Unfit> {
    if !method.has_direct() {
        Some(Unfit::Method)
    } else if effects.neo_hookean.is_some() {
        Some(Unfit::NeoHookean)
    } else {
        let fits = work(topology, effects).is_some();
        (!fits).then(|| Unfit::TooLarge(topology.particles()))
    }
}

/// They follow from what a body is compared by.
impl PartialEq for Factors {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// What a substep of a body is solved with.
#[derive(Debug)]
pub(super) struct Iteration<'a> {
    pub topology: &'a Topology,
    pub effects: &'a Effects,
    /// All particles of the body, predicted.
    pub part: Part<'a>,
    /// Where λ is to be told; empty where nobody asks.
    pub lambdas: [&'a mut [f32]; ElasticKind::COUNT],
    /// Length of the substep [s].
    pub h: f32,
    /// Which of how many iterations.
    pub iteration: (u32, u32),
    pub instructions: Instructions,
}

impl ElasticKind {
    /// Whether its equations are solved directly, by XPBD, in a body that carries [`Direct`].
    #[must_use]
    pub const fn is_solved_directly(self) -> bool {
        !matches!(self, Self::StrainLimit | Self::NeoHookean)
    }
}

/// Multiplications that a factorization of a body with these effects takes; `None` if they are more
/// than [`MAX_WORK`], so that the body is swept.
#[must_use]
pub fn work(topology: &Topology, effects: &Effects) -> Option<u64> {
    plan(topology, effects).ok().map(|plan| plan.work)
}

fn plan(topology: &Topology, effects: &Effects) -> Result<Plan, TooLarge> {
    let mut links = Links {
        topology,
        found: Vec::new(),
    };
    effects.visit(&mut links);
    Plan::new(topology.particles(), links.found.into_iter(), MAX_WORK)
}

impl Factors {
    /// What became of the last substep.
    #[must_use]
    pub fn done(&self) -> Done {
        self.0
            .as_ref()
            .map_or(Done::Nothing, |workspace| workspace.done)
    }

    /// Bytes of memory.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let workspace = self.0.as_ref();
        workspace.map_or(0, |workspace| size_of::<Workspace>() + workspace.bytes())
    }

    /// Moves the particles of a body to where its elastic effects bring them in an iteration, and tells
    /// their multipliers.
    pub(super) fn solve(&mut self, given: Iteration) {
        self.0.get_or_insert_default().solve(given);
    }
}

impl Workspace {
    /// Bytes of memory of its columns.
    fn bytes(&self) -> usize {
        let columns = [
            &self.right,
            &self.step,
            &self.x,
            &self.predicted,
            &self.previous,
            &self.before,
        ];
        let columns: usize = columns.iter().map(|all| size_of_val(&all[..])).sum();
        self.plan.as_ref().map_or(0, Plan::bytes)
            + self.columns.iter().map(Column::bytes).sum::<usize>()
            + self.matrix.bytes()
            + columns
            + size_of_val(&self.w[..])
            + size_of_val(&self.left[..])
            + self
                .swept
                .iter()
                .map(|all| size_of_val(&all[..]))
                .sum::<usize>()
    }

    fn solve(&mut self, mut given: Iteration) {
        let first = given.iteration.0 == 0;
        if first {
            self.prepare(given.topology, given.effects);
            self.done = Done::Solved;
        }
        let solved = self.plan.is_some() && {
            if first {
                self.begin(&given);
            } else {
                self.follow(&given);
            }
            self.solve_directly(&mut given)
        };
        if !solved {
            self.done = match self.plan {
                Some(_) => Done::Swept,
                None => Done::TooLarge,
            };
            self.sweep(&mut given);
        }
        self.left.clear();
        self.left.extend_from_slice(given.part.displacements);
    }

    /// Makes a plan, if there is none for these effects.
    fn prepare(&mut self, topology: &Topology, effects: &Effects) {
        let kinds = ElasticKind::ALL.into_iter();
        let kinds = kinds.filter(|kind| effects.has(*kind) && kind.is_solved_directly());
        let kinds = kinds.fold(0, |all, kind| all | 1 << kind as u32);
        let wanted = Some((kinds, topology.id()));
        if self.planned == wanted {
            return;
        }
        *self = Self {
            planned: wanted,
            plan: plan(topology, effects).ok(),
            ..Self::default()
        };
        if let Some(plan) = &self.plan {
            effects.visit(&mut Prepare {
                topology,
                plan,
                columns: &mut self.columns,
            });
        }
    }

    /// Whether it could; if not, nothing has moved.
    fn solve_directly(&mut self, given: &mut Iteration) -> bool {
        if !self.newton(given) {
            return false;
        }
        let Part {
            positions,
            displacements,
            ..
        } = &mut given.part;
        for ((p, u), x) in positions.iter().zip(displacements.iter_mut()).zip(&self.x) {
            if p.w > 0.0 {
                *u = (*x - p.truncate().as_dvec3()).as_vec3().extend(0.0);
            }
        }
        for (told, column) in given.lambdas.iter_mut().zip(&self.columns) {
            for (told, lambda) in told.iter_mut().zip(&column.lambdas) {
                *told = *lambda as f32;
            }
        }
        true
    }

    /// Reads the state when a substep begins.
    fn begin(&mut self, given: &Iteration) {
        let part = &given.part;
        predicted(&mut self.x, part);
        started(&mut self.previous, part);
        self.predicted.clone_from(&self.x);
        let count = self.x.len();
        self.w.clear();
        self.w.extend(part.positions.iter().map(|x| f64::from(x.w)));
        for column in [&mut self.right, &mut self.step] {
            column.clear();
            column.resize(count, DVec3::ZERO);
        }
        for column in &mut self.columns {
            column.begin();
        }
    }

    /// Takes over what others have done to particles since the last iteration.
    fn follow(&mut self, given: &Iteration) {
        let part = &given.part;
        started(&mut self.previous, part);
        let since = part.displacements.iter().zip(&self.left);
        let known = self.x.iter_mut().zip(&mut self.predicted);
        for ((now, left), (x, y)) in since.zip(known) {
            let pushed = now.truncate().as_dvec3() - left.truncate().as_dvec3();
            *x += pushed;
            *y += pushed;
        }
    }

    /// A Newton step; whether one was taken.
    fn newton(&mut self, given: &Iteration) -> bool {
        let Self {
            plan: Some(plan),
            columns,
            matrix,
            right,
            step,
            w,
            x,
            predicted,
            previous,
            before,
            ..
        } = self
        else {
            return false;
        };
        let plan = &*plan;
        let (topology, effects) = (given.topology, given.effects);
        let inertia = |x: &[DVec3]| -> f64 {
            let ways = x.iter().zip(&*predicted).zip(&*w);
            let moving = ways.filter(|(_, w)| **w > 0.0);
            moving
                .map(|((x, y), w)| 0.5 * x.distance_squared(*y) / w)
                .sum()
        };
        let h = f64::from(given.h);
        let p = &previous[..];
        let mut start = 0.0;
        for _ in 0..PASSES {
            matrix.reset(plan);
            for (i, &w) in w.iter().enumerate() {
                let place = plan.place[i] as usize;
                let mass = if w > 0.0 { 1.0 / w } else { 1.0 };
                add_unit(&mut matrix.diagonal[place], mass);
                right[place] = (predicted[i] - x[i]) * mass;
            }
            let places = Positions {
                topology,
                w,
                x,
                p,
                h,
            };
            let mut assemble = Assemble {
                places,
                plan,
                columns,
                matrix,
                right,
                far: false,
            };
            effects.visit(&mut assemble);
            if assemble.far {
                return false;
            }
            step.clone_from(right);
            matrix.factor(plan, given.instructions);
            matrix.solve(plan, step);
            let mut foresee = ForeseenMerit {
                topology,
                plan,
                columns,
                step,
                w,
                sum: inertia(x),
                tighter: false,
            };
            effects.visit(&mut foresee);
            start = foresee.sum;
            if !foresee.tighter {
                break;
            }
        }
        before.clone_from(x);
        let mut share = 1.0;
        for _ in 0..TRIALS {
            for (i, x) in x.iter_mut().enumerate() {
                *x = before[i] + step[plan.place[i] as usize] * share;
            }
            let places = Positions {
                topology,
                w,
                x,
                p,
                h,
            };
            let mut merit = Merit {
                places,
                columns,
                sum: inertia(x),
            };
            effects.visit(&mut merit);
            if merit.sum <= start * (1.0 + SLACK) {
                for column in columns {
                    column.advance(share);
                }
                return true;
            }
            share *= SHORTER;
        }
        x.clone_from(before);
        false
    }

    /// Sweeps over all constraints that are else solved directly.
    fn sweep(&mut self, given: &mut Iteration) {
        let (iteration, iterations) = given.iteration;
        for kind in ElasticKind::ALL {
            if !given.effects.has(kind) || !kind.is_solved_directly() {
                continue;
            }
            let swept = &mut self.swept[kind as usize];
            swept.resize(kind.multipliers(given.topology), 0.0);
            let solved = &mut self.columns[kind as usize].lambdas;
            for (swept, solved) in swept.iter_mut().zip(&*solved) {
                *swept = *solved as f32;
            }
            sweep_kind(
                (given.effects, kind),
                given.topology,
                given.h,
                given.part.reborrow(),
                Multipliers::of_sweep(swept, (iteration, iterations, true)),
            );
            for (solved, swept) in solved.iter_mut().zip(&*swept) {
                *solved = f64::from(*swept);
            }
            for (told, swept) in given.lambdas[kind as usize].iter_mut().zip(&*swept) {
                *told = *swept;
            }
        }
        predicted(&mut self.x, &given.part);
    }
}

/// Where particles are in the course of the substep [m].
fn predicted(to: &mut Vec<DVec3>, part: &Part) {
    to.clear();
    to.extend((0..part.positions.len()).map(|i| part.predicted(i)));
}

/// Where they were when it began [m].
fn started(to: &mut Vec<DVec3>, part: &Part) {
    to.clear();
    to.extend((0..part.positions.len()).map(|i| part.start(i)));
}
