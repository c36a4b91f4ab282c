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
//! that a sparse Cholesky factorization solves to the end, anew in every substep. α' is α̃, but never
//! less than a small share of Σ w‖∇C‖², so that what is rigid is stiff enough and still has digits.
//! Everything is in `f64` and starts from nothing, so that no state outlives the substep.
//!
//! - An edge under tension also resists being turned, with force over length; without that a light
//!   rope under a heavy weight flutters. Where that matters, a second step is taken that knows the
//!   tensions of the first.
//! - **Contacts** are rows of the same system: which act, stick or slide is found by a search over
//!   sets that act. What they do to a particle is taken off again, and left to the stages of ground
//!   and colliders, which follow and push just as far. So each stage moves what it answers for, as
//!   with sweeps. Where the search finds nothing that will hold, no contact is foreseen. A hand pulls after all that,
//!   and the body follows in the next substep.
//! - A step that does not lower what it minimises is shortened. Where none helps, and where a body
//!   is far from its rest shape, as one squashed flat or turned inside out is, the substep is swept:
//!   a linear system knows nothing of where such a body should go, and sweeps recover.
//! - Iterations are Newton steps; one is nearly always enough. Strain limits are no equations and are
//!   swept afterwards, as are tethers.

mod assemble;
mod contact;
mod matrix;
mod plan;

use super::{
    Effects, ElasticKind, Topology, constraint::Multipliers, contact::collider::Sweep, elastic,
    lanes::Instructions, particles::Part,
};
use assemble::{Advance, Assemble, Column, Columns, Links, Merit, Places, Prepare};
use contact::Contact;
use glam::{DVec3, Vec3};
use matrix::{Block, Matrix, add_unit};
use plan::{Plan, TooLarge};
use serde::{Deserialize, Serialize};

/// A body is solved directly, not by sweeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Direct {}

/// Multiplications of a factorization at most: some 5 ms.
pub const MOST_WORK: u64 = 20_000_000;

/// Passes of the search for the contacts that act, at most.
const PASSES: usize = 4;

/// Shorter steps that are tried, and by how much each is.
const TRIALS: usize = 5;
const SHORTER: f64 = 0.4;

/// What is minimised may rise by this share: sliding contacts have no potential.
const SLACK: f64 = 1e-3;

/// The plan of a body that is solved directly, and the room that it works in. It follows from the
/// topology and the effects, and is no part of the state.
#[derive(Debug, Clone, Default)]
pub struct Factors {
    /// Which effects of how many particles `plan` is for.
    planned: Option<(u32, usize)>,
    plan: Option<Plan>,
    columns: Columns,
    matrix: Matrix,
    /// The matrix without contacts.
    elastic: (Vec<Block>, Vec<Block>),
    right: Vec<DVec3>,
    step: Vec<DVec3>,
    w: Vec<f64>,
    x: Vec<DVec3>,
    predicted: Vec<DVec3>,
    previous: Vec<DVec3>,
    before: Vec<DVec3>,
    /// What contacts have moved particles by [m].
    pushed: Vec<DVec3>,
    contacts: Vec<Contact>,
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
    /// It was swept, because the body was far from its rest shape or no step helped.
    Swept,
    /// It was swept, because a factorization would take more than [`MOST_WORK`].
    TooLarge,
}

impl Done {
    /// Why it was not solved, in a sentence.
    #[must_use]
    pub const fn why_swept(self) -> Option<&'static str> {
        match self {
            Self::Nothing | Self::Solved => None,
            Self::Swept => Some(
                "Swept, not solved: the body is far from its rest shape, or no step brought it nearer \
                 to what its effects ask for.",
            ),
            Self::TooLarge => Some(
                "Swept, not solved: to factor it would take more than 20 million multiplications. Use \
                 fewer cells.",
            ),
        }
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
pub(super) struct Given<'a> {
    pub topology: &'a Topology,
    pub effects: &'a Effects,
    /// All particles of the body, predicted.
    pub part: Part<'a>,
    /// Where λ is to be told; empty where nobody asks.
    pub lambdas: [&'a mut [f32]; ElasticKind::COUNT],
    /// What colliders do in the substep.
    pub colliders: &'a [Sweep],
    pub gravity: Vec3,
    /// Length of the substep [s].
    pub h: f32,
    /// Newton steps.
    pub iterations: u32,
    pub instructions: Instructions,
}

/// How a Newton step went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    /// Done; whether edges have got so much tighter that another is needed.
    Taken {
        tighter: bool,
    },
    Refused,
}

impl ElasticKind {
    /// Whether its equations are solved directly in a body that carries [`Direct`]. Limits are not:
    /// most of them hold at any time, and say nothing.
    #[must_use]
    pub const fn is_solved_directly(self) -> bool {
        !matches!(self, Self::StrainLimit)
    }
}

/// Multiplications that a factorization of a body with these effects takes; `None` if they are more
/// than [`MOST_WORK`], so that the body is swept.
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
    Plan::new(topology.particles(), links.found.into_iter(), MOST_WORK)
}

impl Factors {
    /// What became of the last substep.
    #[must_use]
    pub const fn done(&self) -> Done {
        self.done
    }

    /// Bytes of memory.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let columns = [
            &self.right,
            &self.step,
            &self.x,
            &self.predicted,
            &self.previous,
            &self.before,
            &self.pushed,
        ];
        let columns: usize = columns.iter().map(|all| size_of_val(&all[..])).sum();
        self.plan.as_ref().map_or(0, Plan::bytes)
            + self.columns.iter().map(Column::bytes).sum::<usize>()
            + self.matrix.bytes()
            + size_of_val(&self.elastic.0[..])
            + size_of_val(&self.elastic.1[..])
            + columns
            + size_of_val(&self.w[..])
            + size_of_val(&self.contacts[..])
            + self
                .swept
                .iter()
                .map(|all| size_of_val(&all[..]))
                .sum::<usize>()
    }

    /// Moves the particles of a body to where its elastic effects bring them in the substep, and tells
    /// their multipliers.
    pub(super) fn solve(&mut self, mut given: Given) {
        self.prepare(given.topology, given.effects);
        self.done = if self.plan.is_none() {
            Done::TooLarge
        } else if self.solve_directly(&mut given) {
            Done::Solved
        } else {
            Done::Swept
        };
        if self.done != Done::Solved {
            self.sweep(&mut given);
        }
    }

    /// Makes a plan, if there is none for these effects.
    fn prepare(&mut self, topology: &Topology, effects: &Effects) {
        let kinds = ElasticKind::ALL.into_iter();
        let kinds = kinds.filter(|kind| effects.has(*kind) && kind.is_solved_directly());
        let kinds = kinds.fold(0, |all, kind| all | 1 << kind as u32);
        let wanted = Some((kinds, topology.particles()));
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
    fn solve_directly(&mut self, given: &mut Given) -> bool {
        self.begin(given);
        let mut steps = given.iterations;
        let mut taken = 0;
        while taken < steps {
            match self.newton(given) {
                Step::Refused if taken == 0 => return false,
                Step::Refused => break,
                // One more, if it would have been the last.
                Step::Taken { tighter } => steps = steps.max(1 + u32::from(tighter)),
            }
            taken += 1;
        }
        for (i, x) in given.part.positions.iter_mut().enumerate() {
            if x.w > 0.0 {
                *x = (self.x[i] - self.pushed[i]).as_vec3().extend(x.w);
            }
        }
        for (told, column) in given.lambdas.iter_mut().zip(&self.columns) {
            for (told, lambda) in told.iter_mut().zip(&column.lambdas) {
                *told = *lambda as f32;
            }
        }
        true
    }

    /// Reads the state, and finds what is touched.
    fn begin(&mut self, given: &Given) {
        let part = &given.part;
        let wide = |to: &mut Vec<DVec3>, from: &[glam::Vec4]| {
            to.clear();
            to.extend(from.iter().map(|x| x.truncate().as_dvec3()));
        };
        wide(&mut self.x, &*part.positions);
        wide(&mut self.previous, &*part.previous);
        self.predicted.clone_from(&self.x);
        let count = self.x.len();
        self.w.clear();
        self.w.extend(part.positions.iter().map(|x| f64::from(x.w)));
        for column in [&mut self.right, &mut self.step, &mut self.pushed] {
            column.clear();
            column.resize(count, DVec3::ZERO);
        }
        for column in &mut self.columns {
            column.begin();
        }
        contact::find(
            &mut self.contacts,
            given.effects,
            (&*part.positions, &*part.previous, &*part.velocities),
            given.colliders,
            given.h,
            given.gravity,
        );
    }

    /// One Newton step.
    fn newton(&mut self, given: &Given) -> Step {
        let Self {
            plan: Some(plan),
            columns,
            matrix,
            elastic,
            right,
            step,
            w,
            x,
            predicted,
            previous,
            before,
            pushed,
            contacts,
            ..
        } = self
        else {
            return Step::Refused;
        };
        let plan = &*plan;
        let (topology, effects) = (given.topology, given.effects);
        matrix.reset(plan);
        for (i, &w) in w.iter().enumerate() {
            let place = plan.place[i] as usize;
            let mass = if w > 0.0 { 1.0 / w } else { 1.0 };
            add_unit(&mut matrix.diagonal[place], mass);
            right[place] = (predicted[i] - x[i]) * mass;
        }
        let mut assemble = Assemble {
            places: Places {
                topology,
                w,
                x,
                p: previous,
                h: f64::from(given.h),
            },
            plan,
            columns,
            matrix,
            right,
            merit: 0.0,
            far: false,
        };
        effects.visit(&mut assemble);
        let (mut start, far) = (assemble.merit, assemble.far);
        if far {
            return Step::Refused;
        }
        if !contacts.is_empty() {
            elastic.0.clone_from(&matrix.diagonal);
            elastic.1.clone_from(&matrix.lower);
        }
        for pass in 0..PASSES {
            if pass > 0 {
                matrix.diagonal.clone_from(&elastic.0);
                matrix.lower.clone_from(&elastic.1);
            }
            step.clone_from(right);
            for contact in contacts.iter_mut() {
                let i = contact.particle;
                contact.add(x[i], w[i], plan.place[i] as usize, matrix, step);
            }
            matrix.factor(plan, given.instructions);
            matrix.solve(plan, step);
            let mut changed = false;
            for contact in contacts.iter_mut() {
                let i = contact.particle;
                changed |= contact.revise(x[i] + step[plan.place[i] as usize], w[i]);
            }
            if !changed {
                break;
            }
        }
        let holds = |c: &Contact| {
            c.holds(
                x[c.particle] + step[plan.place[c.particle] as usize],
                w[c.particle],
            )
        };
        if !contacts.iter().all(holds) {
            // Nothing foreseen is better than what will not be.
            contacts.iter_mut().for_each(Contact::drop);
            matrix.diagonal.clone_from(&elastic.0);
            matrix.lower.clone_from(&elastic.1);
            step.clone_from(right);
            matrix.factor(plan, given.instructions);
            matrix.solve(plan, step);
        }
        let rest = |x: &[DVec3]| {
            let ways = x
                .iter()
                .zip(&*predicted)
                .zip(&*w)
                .filter(|(_, w)| **w > 0.0);
            let inertia: f64 = ways
                .map(|((x, y), w)| 0.5 * x.distance_squared(*y) / w)
                .sum();
            let contacts = contacts.iter();
            let held: f64 = contacts
                .map(|contact| contact.merit(x[contact.particle], w[contact.particle]))
                .sum();
            inertia + held
        };
        start += rest(x);
        before.clone_from(x);
        let mut share = 1.0;
        for _ in 0..TRIALS {
            for (i, x) in x.iter_mut().enumerate() {
                *x = before[i] + step[plan.place[i] as usize] * share;
            }
            let mut merit = Merit {
                places: Places {
                    topology,
                    w,
                    x,
                    p: previous,
                    h: f64::from(given.h),
                },
                columns,
                sum: rest(x),
            };
            effects.visit(&mut merit);
            if merit.sum <= start * (1.0 + SLACK) {
                for pushed in pushed.iter_mut() {
                    *pushed *= 1.0 - share;
                }
                for contact in &*contacts {
                    let i = contact.particle;
                    let end = before[i] + step[plan.place[i] as usize];
                    pushed[i] += contact.moves(before[i], end, w[i]) * share;
                }
                let mut advance = Advance {
                    topology,
                    plan,
                    columns,
                    step,
                    share,
                    w: &*w,
                    tighter: false,
                };
                effects.visit(&mut advance);
                return Step::Taken {
                    tighter: advance.tighter,
                };
            }
            share *= SHORTER;
        }
        x.clone_from(before);
        Step::Refused
    }

    /// Sweeps over all constraints that are else solved directly.
    fn sweep(&mut self, given: &mut Given) {
        let sweeps = given.iterations;
        let Part {
            positions,
            previous,
            ..
        } = &mut given.part;
        for sweep in 0..sweeps {
            for kind in ElasticKind::ALL {
                if !given.effects.has(kind) || !kind.is_solved_directly() {
                    continue;
                }
                let lambdas = &mut self.swept[kind as usize];
                lambdas.resize(kind.multipliers(given.topology), 0.0);
                let multipliers = Multipliers::of_sweep(lambdas, (sweep, sweeps, true));
                let state = (&mut **positions, &**previous);
                elastic::sweep(
                    (given.effects, kind),
                    given.topology,
                    given.h,
                    state,
                    multipliers,
                );
            }
        }
        for (told, swept) in given.lambdas.iter_mut().zip(&self.swept) {
            for (told, lambda) in told.iter_mut().zip(swept) {
                *told = *lambda;
            }
        }
    }
}
