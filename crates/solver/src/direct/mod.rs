//! Direct solver for a substep of a body, instead of Gauss–Seidel: for slender and stiff bodies,
//! through which Gauss–Seidel propagates a load by about one element per iteration.
//!
//! A substep of XPBD solves
//!
//! M (x − y) = Σ ∇Cᵀλ,  C(x) + α̃λ + γ∇C·(x − p) = 0,  α̃ = α/h², γ = τ/h,
//!
//! with the prediction y and the start p of the substep. Eliminating λ gives a Newton step as a
//! symmetric positive definite system with a 3 × 3 block for each particle and each pair of
//! neighbors,
//!
//! (M + Σ (1 + γ)/α' ∇Cᵀ∇C) Δx = M (y − x) + Σ ∇Cᵀ (λ − (C + α̃λ + γ∇C·(x − p))/α'),
//!
//! which a sparse Cholesky factorization solves exactly, anew in every iteration. α' is α̃, with a
//! lower bound of a small fraction of Σ w‖∇C‖², so that rigid constraints are stiff without loss of
//! precision. Everything is in `f64` and starts from the positions alone: no state outlives the tick.
//!
//! - The first step does not start at y but where the body would be if its forces balanced gravity and
//!   its [uniform](super::Uniform) force, at y − gh². At rest they do, the step is zero, and the rest shape
//!   is that of the equations, however coarse the linear system is; from y, its error would be of second
//!   order in gh², as it is in the displacement by other force fields. In motion, the solution is about as
//!   far from one as from the other.
//! - An edge under tension also resists rotation, with force over length; without that a light rope
//!   under a heavy weight flutters. The first tension is that of its length at the start of the
//!   substep, or 0 in second-order steps. Where that of the solution differs by a relevant amount, as
//!   after a collision, the system is assembled and solved again with it.
//! - An iteration is a Newton step in place of a Gauss–Seidel pass. Everything else that moves
//!   particles acts between iterations, as between Gauss–Seidel passes: strain limits, pressure,
//!   tethers, grabs, ground and colliders. Their displacements are added to the y of a particle, so
//!   that the next step solves the whole body under these loads. Without them, one step is nearly
//!   always enough; with them, each further step reduces the remaining error by about the fraction
//!   of the mass that they do not touch.
//! - A step that does not decrease its merit function, an augmented Lagrangian, is shortened. If no
//!   step length helps, or if the body is far from its rest shape (squashed flat or inverted), the
//!   iteration falls back to Gauss–Seidel, which can recover such a body where a linear system
//!   cannot.
//! - [Neo-Hookean](super::NeoHookean) tetrahedra enter with the second derivatives of their energy,
//!   as ∇C of their equations in one direction carries no information about the stiffness in others.
//!   If the matrix is not positive definite, that part of them which may be negative is left out.
//! - A large system is factored in dense fronts, on all threads, with the same bits on any number of them. Later
//!   ones of the tick are solved with its factor by conjugate gradients, to rounding, while that takes less time.
//! - It requires XPBD: other [methods](super::Method) use Gauss–Seidel. So do strain limits, most of
//!   which are inactive at any time.
//! - Smoothing iterations skip directly solved effects.

#[cfg(test)]
mod arbitrary;
mod assemble;
mod column;
mod elements;
mod fronts;
mod known;
pub(super) mod matrix;
mod merit;
mod multifrontal;
mod ordering;
mod panel;
pub(super) mod plan;
mod reuse;
mod tension;

use super::elastic::Elastic as _;
use super::{
    Effects, ElasticKind, Finite, Method, Threads, Topology, TopologyId, WorkEstimate,
    effects::Multipliers, effects::kinds::iterate_kind, lanes::Instructions, particles::Part,
};
use assemble::{Assemble, Positions};
use column::{Column, Columns, Links, Prepare};
use glam::{DVec3, Vec3, Vec4};
use matrix::{Matrix, add_unit};
use merit::{ForeseenMerit, Merit};
use ordering::{Elimination, eliminate};
use plan::{LARGE, Order, Plan, TooLarge, work_of};
use reuse::{Outcome, Reuse};
use std::fmt;
use tension::Tensions;

/// Maximum number of multiplications of a factorization: about 0.3 s on one thread of a cloud AMD EPYC.
pub const MAX_WORK: u64 = 5_000_000_000;

/// Multiplications of a factorization that take as long as a constraint projection.
const MULTIPLICATIONS_PER_PROJECTION: u64 = 64;

/// Maximum number of systems per iteration, each with the tensions from the previous one.
const PASSES: usize = 3;

/// Maximum number of shortened trial steps, and their reduction factor.
const TRIALS: usize = 5;
const SHORTER: f64 = 0.4;

/// Relative increase of the merit function that counts as rounding.
const SLACK: f64 = 1e-6;

/// Plan and workspace of a directly solved body; empty for other bodies. Derived from the topology
/// and the effects, not part of the state.
#[derive(Debug, Clone, Default)]
pub struct DirectWorkspace(Option<Box<Workspace>>);

#[derive(Debug, Clone, Default)]
struct Workspace {
    /// Effects, whether neo-Hookean tetrahedra are rigid, and topology for which `plan` was made, as it was
    /// for the pins.
    planned: Option<(u32, bool, TopologyId)>,
    plan: Option<Plan>,
    columns: Columns,
    matrix: Matrix,
    reuse: Reuse,
    right: Vec<DVec3>,
    step: Vec<DVec3>,
    w: Vec<f64>,
    x: Vec<DVec3>,
    predicted: Vec<DVec3>,
    previous: Vec<DVec3>,
    before: Vec<DVec3>,
    /// Displacements at the end of the last iteration [m].
    left: Vec<Vec4>,
    /// λ of Gauss–Seidel iterations.
    iterated: [Vec<f32>; ElasticKind::COUNT],
    status: Status,
    known: Option<known::Known>,
}

/// Outcome of the last substep.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Status {
    /// Not solved yet.
    #[default]
    Nothing,
    /// Solved directly.
    Solved,
    /// An iteration fell back to Gauss–Seidel, because the body was far from its rest shape or no
    /// step length helped.
    FellBack,
    /// Gauss–Seidel was used, because a factorization would exceed [`MAX_WORK`].
    TooLarge,
    /// Gauss–Seidel was used, because neo-Hookean tetrahedra are rigid.
    Rigid,
}

impl Status {
    /// Reason for the fallback, in a sentence.
    #[must_use]
    pub const fn explanation(self) -> Option<&'static str> {
        match self {
            Self::Nothing | Self::Solved => None,
            Self::FellBack => Some(
                "Fell back to Gauss–Seidel: the body is far from its rest shape, or no direct step \
                 reduced the residual.",
            ),
            Self::Rigid => Some(
                "Fell back to Gauss–Seidel: neo-Hookean tetrahedra are rigid. Choose a finite \
                 Young's modulus.",
            ),
            Self::TooLarge => Some(
                "Fell back to Gauss–Seidel: the factorization would take more than 5000 million \
                 multiplications. Use fewer cells.",
            ),
        }
    }
}

/// Reasons against [`Direct`](crate::Direct) on a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Unfit {
    /// The method is not XPBD.
    Method,
    /// It has rigid neo-Hookean tetrahedra.
    RigidNeoHookean,
    /// A factorization would exceed [`MAX_WORK`]; the number of particles.
    TooLarge(usize),
}

impl fmt::Display for Unfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Method => write!(
                f,
                "the direct solver needs the method XPBD, but the world uses another; choose XPBD"
            ),
            Self::RigidNeoHookean => write!(
                f,
                "the direct solver does not support rigid neo-Hookean tetrahedra; choose a finite Young's modulus"
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

/// Reason why a body with these effects cannot be solved directly, if any.
#[must_use]
pub fn unfit(topology: &Topology, effects: &Effects, method: Method) -> Option<Unfit> {
    unfit_effects(effects, method).or_else(|| {
        let fits = work(topology, effects).is_some();
        (!fits).then(|| Unfit::TooLarge(topology.particles()))
    })
}

/// Reason against it that does not depend on the size of the body.
fn unfit_effects(effects: &Effects, method: Method) -> Option<Unfit> {
    if !method.has_direct() {
        Some(Unfit::Method)
    } else if effects.neo_hookean.is_some_and(|it| it.is_rigid()) {
        Some(Unfit::RigidNeoHookean)
    } else {
        None
    }
}

/// Derived data does not take part in comparisons.
impl PartialEq for DirectWorkspace {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// Input of an iteration.
#[derive(Debug)]
pub(super) struct Iteration<'a> {
    pub topology: &'a Topology,
    pub effects: &'a Effects,
    /// All particles of the body, predicted.
    pub part: Part<'a>,
    /// Output for λ; empty where it is not needed.
    pub lambdas: [&'a mut [f32]; ElasticKind::COUNT],
    /// Length of the substep [s].
    pub h: f32,
    /// Gravity [m/s²].
    pub gravity: Vec3,
    /// Number of the substep of the tick.
    pub substep: u32,
    /// Number of the iteration, and their count.
    pub iteration: (u32, u32),
    /// Whether the start of the substep is extrapolated, as in second-order steps: edges have other
    /// lengths there than at any time.
    pub is_extrapolated: bool,
    pub instructions: Instructions,
    pub threads: &'a Threads,
}

impl ElasticKind {
    /// Whether its equations are solved directly, by XPBD, in a body that carries [`Direct`](crate::Direct).
    #[must_use]
    pub const fn is_solved_directly(self) -> bool {
        !matches!(self, Self::StrainLimit)
    }
}

/// Multiplications that a factorization of a body with these effects needs without pins; `None` if they exceed
/// [`MAX_WORK`], in which case the body is solved by Gauss–Seidel.
#[must_use]
pub fn work(topology: &Topology, effects: &Effects) -> Option<u64> {
    let elimination = elimination(topology, effects);
    elimination.ok().map(|it| work_in(&it))
}

/// The order without pins.
fn elimination(topology: &Topology, effects: &Effects) -> Result<Elimination, TooLarge> {
    let links = links(topology, effects).into_iter();
    eliminate(topology.particles(), links, MAX_WORK)
}

/// Multiplications of a factorization in an order.
fn work_in(elimination: &Elimination) -> u64 {
    elimination
        .iter()
        .map(|(_, near)| work_of(near.len()))
        .sum()
}

/// A bit for each elastic effect that is solved directly.
fn kinds_of(effects: &Effects) -> u32 {
    let kinds = ElasticKind::ALL.into_iter();
    let kinds = kinds.filter(|kind| effects.has(*kind) && kind.is_solved_directly());
    kinds.fold(0, |all, kind| all | 1 << kind as u32)
}

/// The pairs of particles that share an element.
fn links(topology: &Topology, effects: &Effects) -> Vec<(u32, u32)> {
    let mut links = Links {
        topology,
        found: Vec::new(),
    };
    effects.visit(&mut links);
    links.found
}

impl DirectWorkspace {
    /// Outcome of the last substep.
    #[must_use]
    pub fn status(&self) -> Status {
        self.0
            .as_ref()
            .map_or(Status::Nothing, |workspace| workspace.status)
    }

    /// Whether it holds a plan for a body with these effects, which can therefore be solved directly by XPBD. Saves
    /// [`unfit`] the plan of its own.
    #[must_use]
    pub fn has_plan(&self, topology: &Topology, effects: &Effects) -> bool {
        let wanted = Some((kinds_of(effects), false, topology.id()));
        let is_rigid = effects.neo_hookean.is_some_and(|it| it.is_rigid());
        let workspace = self.0.as_ref();
        !is_rigid && workspace.is_some_and(|it| it.planned == wanted && it.plan.is_some())
    }

    /// Whether a factorization takes several threads.
    pub(super) fn is_large(&self) -> bool {
        self.fronts_work() > 0
    }

    /// Multiplications of a factorization that takes several threads, or 0.
    fn fronts_work(&self) -> u64 {
        let plan = self
            .0
            .as_ref()
            .and_then(|workspace| workspace.plan.as_ref());
        plan.filter(|plan| plan.fronts.is_some())
            .map_or(0, |plan| plan.work)
    }

    /// Work estimate of a number of iterations of the body: that of its [effects](Effects::load), and of a
    /// factorization that takes several threads.
    #[must_use]
    pub fn load(&self, effects: &Effects, topology: &Topology, iterations: usize) -> WorkEstimate {
        let mut load = effects.load(topology, iterations);
        if self.is_large() && effects.direct.is_some() {
            let each = self.fronts_work() / MULTIPLICATIONS_PER_PROJECTION;
            load.projections += each as usize * iterations;
            // Fronts are divided among threads, also those of a body in one piece.
            load.pieces = load.pieces.max(2);
        }
        load
    }

    /// Memory use in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let workspace = self.0.as_ref();
        workspace.map_or(0, |workspace| size_of::<Workspace>() + workspace.bytes())
    }

    /// Performs one iteration of the elastic effects of a body, and writes their multipliers.
    pub(super) fn solve(&mut self, given: Iteration) {
        self.0.get_or_insert_default().solve(given);
    }
}

impl Workspace {
    /// Memory use of its columns in bytes.
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
            + self.reuse.bytes()
            + self.known.as_ref().map_or(0, known::Known::bytes)
            + columns
            + size_of_val(&self.w[..])
            + size_of_val(&self.left[..])
            + self
                .iterated
                .iter()
                .map(|all| size_of_val(&all[..]))
                .sum::<usize>()
    }

    fn solve(&mut self, mut given: Iteration) {
        let first = given.iteration.0 == 0;
        if first {
            if given.substep == 0 {
                self.reuse.begin_tick();
            }
            self.prepare(&given);
            self.status = Status::Solved;
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
            self.status = match self.plan {
                Some(_) => Status::FellBack,
                None if matches!(self.planned, Some((_, true, _))) => Status::Rigid,
                None => Status::TooLarge,
            };
            self.gauss_seidel(&mut given);
        }
        self.left.clear();
        self.left.extend_from_slice(given.part.displacements);
    }

    /// Makes a plan if there is none for these effects and pins.
    fn prepare(&mut self, given: &Iteration) {
        let (topology, effects) = (given.topology, given.effects);
        let kinds = kinds_of(effects);
        let is_rigid = effects.neo_hookean.is_some_and(|it| it.is_rigid());
        let wanted = Some((kinds, is_rigid, topology.id()));
        let is_free = given.part.positions.iter().map(|x| x.w > 0.0);
        let is_known = self.planned == wanted;
        let same_pins = |plan: &Plan| plan.free().eq(is_free.clone());
        if is_known && self.plan.as_ref().is_none_or(same_pins) {
            return;
        }
        let is_free: Vec<bool> = is_free.collect();
        // The limit applies to the body without pins, so that they do not decide how it is solved.
        let ordered = match is_rigid {
            true => None,
            false => self.ordered(topology, effects),
        };
        let plan = ordered.and_then(|ordered| {
            let order = match ordered.work {
                LARGE.. => Order::Given(&ordered.order),
                _ => Order::LocalFill { max_work: u64::MAX },
            };
            Plan::new(&is_free, links(topology, effects).into_iter(), order).ok()
        });
        *self = Self {
            planned: wanted,
            plan,
            known: self.known.take(),
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

    /// Returns whether it succeeded; otherwise nothing has moved.
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
        for (out, column) in given.lambdas.iter_mut().zip(&self.columns) {
            for (out, lambda) in out.iter_mut().zip(&column.lambdas) {
                *out = *lambda as f32;
            }
        }
        true
    }

    /// Reads the state at the start of a substep.
    fn begin(&mut self, given: &Iteration) {
        let part = &given.part;
        predicted(&mut self.x, part);
        started(&mut self.previous, part);
        self.predicted.clone_from(&self.x);
        let count = self.x.len();
        self.w.clear();
        self.w.extend(part.positions.iter().map(|x| f64::from(x.w)));
        // See the documentation of the module on the start of the first step.
        let fall = (given.gravity * (given.h * given.h)).as_dvec3();
        let uniform = given.effects.uniform.unwrap_or_default();
        let h = f64::from(given.h);
        let push = Finite::vector([uniform.x, uniform.y, uniform.z]) * (h * h);
        let weight = given.effects.force_weights(given.topology);
        for (i, (x, &w)) in (0..).zip(self.x.iter_mut().zip(&self.w)) {
            if w > 0.0 {
                *x -= fall + push * weight(i);
            }
        }
        for column in [&mut self.right, &mut self.step] {
            column.clear();
            column.resize(count, DVec3::ZERO);
        }
        for column in &mut self.columns {
            column.begin();
        }
        if given.is_extrapolated {
            return;
        }
        let start = Positions {
            topology: given.topology,
            w: &self.w,
            x: &self.previous,
            p: &self.previous,
            h: f64::from(given.h),
            instructions: given.instructions,
        };
        given.effects.visit(&mut Tensions {
            places: start,
            columns: &mut self.columns,
        });
    }

    /// Applies displacements by others since the last iteration.
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

    /// Performs a Newton step; returns whether one was accepted.
    fn newton(&mut self, given: &Iteration) -> bool {
        let Self {
            plan: Some(plan),
            columns,
            matrix,
            reuse,
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
        for pass in 0..PASSES {
            let mut cautious = false;
            loop {
                matrix.reset(plan);
                for (i, &w) in w.iter().enumerate() {
                    if w > 0.0 {
                        let place = plan.place[i] as usize;
                        let mass = 1.0 / w;
                        add_unit(&mut matrix.diagonal[place], mass);
                        right[place] = (predicted[i] - x[i]) * mass;
                    }
                }
                let places = Positions {
                    topology,
                    w,
                    x,
                    p,
                    h,
                    instructions: given.instructions,
                };
                let mut assemble = Assemble {
                    places,
                    plan,
                    columns,
                    matrix,
                    right,
                    far: false,
                    cautious,
                    curved: false,
                };
                effects.visit(&mut assemble);
                let curved = assemble.curved;
                if assemble.far {
                    return false;
                }
                let (instructions, threads) = (given.instructions, given.threads);
                match reuse.solve((matrix, plan), (right, step), instructions) {
                    Outcome::Solved => break,
                    Outcome::NotDefinite if curved && !cautious => {
                        cautious = true;
                        continue;
                    }
                    Outcome::NotDefinite | Outcome::Refused => {}
                }
                matrix.factor(plan, instructions, threads);
                reuse.factored(matrix, plan);
                if cautious || !curved || matrix.was_definite() {
                    step.clone_from(right);
                    matrix.solve(plan, step, instructions);
                    break;
                }
                cautious = true;
            }
            let places = Positions {
                topology,
                w,
                x,
                p,
                h,
                instructions: given.instructions,
            };
            let mut foresee = ForeseenMerit {
                places,
                plan,
                columns,
                step,
                sum: inertia(x),
                started: pass == 0 && given.iteration.0 == 0,
                tighter: false,
            };
            effects.visit(&mut foresee);
            start = foresee.sum;
            if !foresee.tighter {
                break;
            }
        }
        before.clone_from(x);
        let mut fraction = 1.0;
        for _ in 0..TRIALS {
            for (i, x) in x.iter_mut().enumerate() {
                *x = before[i] + step[plan.place[i] as usize] * fraction;
            }
            let places = Positions {
                topology,
                w,
                x,
                p,
                h,
                instructions: given.instructions,
            };
            let mut merit = Merit {
                places,
                columns,
                sum: inertia(x),
            };
            effects.visit(&mut merit);
            if merit.sum <= start * (1.0 + SLACK) {
                for column in columns {
                    column.advance(fraction);
                }
                return true;
            }
            fraction *= SHORTER;
        }
        x.clone_from(before);
        false
    }

    /// A Gauss–Seidel iteration over all constraints that are normally solved directly.
    fn gauss_seidel(&mut self, given: &mut Iteration) {
        let (iteration, iterations) = given.iteration;
        for kind in ElasticKind::ALL {
            if !given.effects.has(kind) || !kind.is_solved_directly() {
                continue;
            }
            let iterated = &mut self.iterated[kind as usize];
            iterated.resize(kind.multipliers(given.topology), 0.0);
            let solved = &mut self.columns[kind as usize].lambdas;
            for (iterated, solved) in iterated.iter_mut().zip(&*solved) {
                *iterated = *solved as f32;
            }
            iterate_kind(
                (given.effects, kind),
                given.topology,
                given.h,
                given.part.reborrow(),
                Multipliers::of_iteration(iterated, (iteration, iterations, true)),
            );
            for (solved, iterated) in solved.iter_mut().zip(&*iterated) {
                *solved = f64::from(*iterated);
            }
            for (out, iterated) in given.lambdas[kind as usize].iter_mut().zip(&*iterated) {
                *out = *iterated;
            }
        }
        predicted(&mut self.x, &given.part);
    }
}

/// Current positions within the substep [m].
fn predicted(to: &mut Vec<DVec3>, part: &Part) {
    to.clear();
    to.extend((0..part.positions.len()).map(|i| part.predicted(i)));
}

/// Positions at the start of the substep [m].
fn started(to: &mut Vec<DVec3>, part: &Part) {
    to.clear();
    to.extend((0..part.positions.len()).map(|i| part.start(i)));
}
