//! Steps a body: all substeps of a tick at once, or stage by stage.
//!
//! Both give the same bits, on any number of threads. Work is cut by the body, into
//! [bands](super::bands): threads take pieces that share no particle, and a particle meets its
//! tasks in the same order as if each task were done on all of the body before the next begins.

#![allow(unsafe_code, reason = "pieces are handed out by hand")]

use super::{
    Collide, Effects, ElasticKind, ForceKind, Lambdas, Leads, Particles, Settings, Stitches,
    Substep, Tethers, Threads, Topology,
    bands::Piece,
    contact::{
        collider::{self, Swept},
        ground,
    },
    crew::Crew,
    elastic::{Kernels, Work},
    force::Moment,
    lanes::Instructions,
    particles::Part,
    phases::{Phase, Phases, Side, Task},
    share::Shared,
    stages,
};
use std::{fmt, iter, ops::Range, sync::Arc};

/// What is stepped, wherever its parts are kept.
#[derive(Debug)]
pub struct Stepper<'a> {
    /// The immutable part, unless the body flows.
    pub topology: &'a mut Arc<Topology>,
    /// The state.
    pub particles: &'a mut Particles,
    /// What acts; the hold of a hand changes.
    pub effects: &'a mut Effects,
    /// λ of the constraints of elastic effects; as many as there are if they are to be kept.
    pub lambdas: &'a mut Lambdas,
    /// Its tethers; none if it has none.
    pub leads: &'a Leads,
    /// Its stitches; which are broken changes.
    pub stitches: &'a mut Stitches,
}

/// What all bodies are stepped with.
#[derive(Debug, Clone, Copy)]
pub struct Means<'a> {
    /// Gravity, rate, substeps, iterations.
    pub settings: &'a Settings,
    /// Start of the tick [s].
    pub time: f64,
    /// What the colliders do in the tick.
    pub swept: &'a Swept,
    /// Threads to work on pieces with.
    pub threads: &'a Threads,
    /// Instructions to use.
    pub instructions: Instructions,
    /// Who wants to know how long the stages take; nobody by default, as it is not free.
    pub watch: Option<&'a dyn Watch>,
}

/// Sees each piece of work on its way, to time it: the solver has no clock.
pub trait Watch: fmt::Debug + Sync {
    /// Does `work`, which is a part of `stage`, on the thread that it is called on.
    fn see(&self, stage: Stage, work: &mut dyn FnMut());
}

/// A part of a substep that can be ordered against.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// A force from outside, before the first stage.
    Force(ForceKind),
    /// Positions are predicted.
    Presolve,
    /// Sticky ground, at the end of the first stage.
    StickyGround,
    /// The constraints of an elastic effect.
    Elastic(ElasticKind),
    /// Stitches between points of the body, and to colliders.
    Stitches,
    /// Tethers to pins.
    Tethers,
    /// The hold of a hand.
    Grab,
    /// The ground.
    Ground,
    /// Colliders.
    Collide,
    /// Velocities are taken from positions.
    Postsolve,
    /// What is strained too far flows.
    Flow,
}

/// What takes part in the second stage after the elastic effects.
const AFTER: [Stage; 5] = [
    Stage::Stitches,
    Stage::Tethers,
    Stage::Grab,
    Stage::Ground,
    Stage::Collide,
];

impl Stage {
    /// What takes part in the second stage, in its order: what holds the body together, then
    /// hands, then contacts.
    pub const SOLVE: [Self; ElasticKind::COUNT + AFTER.len()] = {
        let mut all = [Self::Presolve; ElasticKind::COUNT + AFTER.len()];
        let mut place = 0;
        while place < all.len() {
            all[place] = if place < ElasticKind::COUNT {
                Self::Elastic(ElasticKind::ALL[place])
            } else {
                AFTER[place - ElasticKind::COUNT]
            };
            place += 1;
        }
        all
    };

    /// All of them, in the order of a substep.
    pub const ALL: [Self; ForceKind::COUNT + Self::SOLVE.len() + 4] = {
        let mut all = [Self::Presolve; ForceKind::COUNT + Self::SOLVE.len() + 4];
        let mut place = 0;
        while place < ForceKind::COUNT {
            all[place] = Self::Force(ForceKind::ALL[place]);
            place += 1;
        }
        all[place + 1] = Self::StickyGround;
        while place < ForceKind::COUNT + Self::SOLVE.len() {
            all[place + 2] = Self::SOLVE[place - ForceKind::COUNT];
            place += 1;
        }
        all[place + 2] = Self::Postsolve;
        all[place + 3] = Self::Flow;
        all
    };

    /// Its place in [`Stage::ALL`].
    #[must_use]
    pub fn place(self) -> usize {
        Self::ALL
            .iter()
            .position(|stage| *stage == self)
            .unwrap_or(0)
    }

    /// The name of the stage or effect.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Force(kind) => kind.name(),
            Self::Presolve => "presolve",
            Self::StickyGround => "sticky_ground",
            Self::Elastic(kind) => kind.name(),
            Self::Stitches => "stitches",
            Self::Tethers => "tethers",
            Self::Grab => "grab",
            Self::Ground => "ground",
            Self::Collide => "collide",
            Self::Postsolve => "postsolve",
            Self::Flow => "plasticity",
        }
    }
}

/// Tasks with their sides: at most three of a stage.
type Tasks = iter::Flatten<std::array::IntoIter<Option<(Task, Side)>, 3>>;

impl Stage {
    /// Whether it does anything to a body that carries these effects.
    fn acts(self, effects: &Effects, stitched: bool) -> bool {
        match self {
            Self::Presolve | Self::Postsolve => true,
            Self::Force(kind) => effects.has_force(kind),
            Self::StickyGround => effects.sticky_ground.is_some(),
            Self::Elastic(kind) => effects.has(kind),
            Self::Stitches => stitched,
            Self::Tethers => effects.tethers.is_some(),
            Self::Grab => effects.grab.is_some(),
            Self::Ground => effects.ground.is_some(),
            Self::Collide => effects.collide.is_some(),
            Self::Flow => effects.plasticity.is_some(),
        }
    }

    /// What it does to a body that carries these effects.
    fn tasks(
        self,
        topology: &Topology,
        (effects, stitched): (&Effects, bool),
        step: &Substep,
        iteration: u32,
    ) -> Tasks {
        let sweep = (iteration, step.iterations, step.is_last());
        let substep = step.index;
        let one = |task, side| [Some((task, side)), None, None];
        match self {
            // It is no task on pieces: kernels hold on to rest values for as long as those run.
            Self::Flow => [None; 3],
            _ if !self.acts(effects, stitched) => [None; 3],
            Self::Force(kind) => one(Task::Force { kind, substep }, Side::Whole),
            Self::Presolve => one(Task::Begin, Side::Any),
            Self::StickyGround => one(Task::Stick, Side::Any),
            Self::Elastic(kind) => kind.halves(topology, Task::Elastic { kind, sweep }),
            Self::Stitches => {
                let sweep = (iteration, step.iterations);
                one(Task::Stitch { substep, sweep }, Side::Whole)
            }
            Self::Tethers => one(Task::Tether, Side::Any),
            Self::Grab => one(Task::Grab { substep, iteration }, Side::Whole),
            Self::Ground => one(Task::Ground, Side::Any),
            Self::Collide => one(Task::Collide { substep }, Side::Any),
            Self::Postsolve => one(Task::End { substep }, Side::Any),
        }
        .into_iter()
        .flatten()
    }
}

/// A body turned non-finite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotFinite {
    /// The first particle found.
    pub particle: usize,
    /// The substep after which it was found.
    pub substep: u32,
}

impl Stepper<'_> {
    /// Does some substeps of a tick.
    ///
    /// # Errors
    /// [`NotFinite`] when a position no longer is; the body is then as it was left at that place,
    /// `previous` holding finite positions.
    pub fn advance(&mut self, substeps: Range<u32>, means: &Means) -> Result<(), NotFinite> {
        if self.effects.plasticity.is_none() {
            return self.advance_together(substeps, means);
        }
        for index in substeps {
            self.advance_together(index..index + 1, means)?;
            self.flow(&means.settings.substep(index), means);
        }
        Ok(())
    }

    /// Does substeps between which nothing flows.
    fn advance_together(&mut self, substeps: Range<u32>, means: &Means) -> Result<(), NotFinite> {
        let shape = Arc::clone(self.topology);
        let topology: &Topology = &shape;
        let (effects, settings) = (*self.effects, means.settings);
        let stitched = !self.stitches.is_empty();
        // What is absent is not asked for again in every sweep.
        let mut stages = Stage::SOLVE
            .into_iter()
            .filter(|stage| stage.acts(&effects, stitched));
        let present: [_; Stage::SOLVE.len()] = std::array::from_fn(|_| stages.next());
        let first = substeps.start;
        let mut forces = ForceKind::ALL
            .into_iter()
            .filter(|kind| effects.has_force(*kind));
        let forces: [_; ForceKind::COUNT] = std::array::from_fn(|_| forces.next());
        // Two stages in one pass cannot be told apart by who watches, and forces act between them.
        let apart = means.watch.is_some() || forces[0].is_some();
        let tasks = substeps.clone().flat_map(|index| {
            let step = settings.substep(index);
            let before = index.checked_sub(1).filter(|_| index > first);
            let turn = before.filter(|_| !apart);
            let end = before.filter(|_| apart);
            let end = end.map(|substep| (Task::End { substep }, Side::Any));
            let start = turn.map_or(Task::Begin, |substep| Task::Turn { substep });
            let of_stage = move |stage: Stage, iteration| {
                stage.tasks(topology, (&effects, stitched), &step, iteration)
            };
            let sweeps = (0..step.iterations).flat_map(move |iteration| {
                let stages = present.into_iter().flatten();
                stages.flat_map(move |stage| of_stage(stage, iteration))
            });
            let forces = forces.into_iter().flatten();
            end.into_iter()
                .chain(forces.flat_map(move |kind| of_stage(Stage::Force(kind), 0)))
                .chain(iter::once((start, Side::Any)))
                .chain(of_stage(Stage::StickyGround, 0))
                .chain(sweeps)
        });
        let sweeps = substeps.len() * settings.iterations.get() as usize;
        let end = substeps
            .last()
            .map(|substep| (Task::End { substep }, Side::Any));
        self.run(tasks.chain(end), sweeps, means)
    }

    /// Does one stage of a substep.
    ///
    /// # Errors
    /// [`NotFinite`] from the last stage.
    pub fn stage(
        &mut self,
        stage: Stage,
        step: &Substep,
        iteration: u32,
        means: &Means,
    ) -> Result<(), NotFinite> {
        if stage == Stage::Flow {
            self.flow(step, means);
            return Ok(());
        }
        let shape = Arc::clone(self.topology);
        let stitched = !self.stitches.is_empty();
        let tasks = stage.tasks(&shape, (self.effects, stitched), step, iteration);
        let sweeps = usize::from(matches!(stage, Stage::Elastic(_)));
        self.run(tasks, sweeps, means)
    }

    /// Lets rest values flow at the end of a substep, if it is time to.
    fn flow(&mut self, step: &Substep, means: &Means) {
        let h = means.settings.substep_seconds();
        let end = means.time + h * f64::from(step.index + 1);
        if let Some(plasticity) = self.effects.plasticity
            && let Some(seconds) = plasticity.due(end, h)
        {
            let mut flow = || plasticity.flow(self.effects, self.topology, self.particles, seconds);
            match means.watch {
                Some(watch) => watch.see(Stage::Flow, &mut flow),
                None => flow(),
            }
        }
    }

    fn run(
        &mut self,
        tasks: impl Iterator<Item = (Task, Side)> + Clone + Send + Sync,
        sweeps: usize,
        means: &Means,
    ) -> Result<(), NotFinite> {
        let topology = Arc::clone(self.topology);
        let bands = &topology.bands;
        let projections = self.effects.constraints(&topology) * sweeps;
        let phases = Phases::new(tasks, bands);
        let context = Context::new(&topology, self, means);
        let shared = Shared::new(self);
        // SAFETY: pieces of a phase share no particle and no constraint, and a phase begins when
        // all pieces of the one before are done.
        let work = |phase: &Phase, piece: usize| unsafe { context.work(&shared, phase, piece) };
        if bands.count() > 1 && means.threads.pays(projections) {
            let crew = Crew::new();
            crew.work(means.threads, phases, &work)
        } else {
            for phase in phases {
                for piece in 0..phase.pieces.len() {
                    work(&phase, piece)?;
                }
            }
            Ok(())
        }
    }
}

/// What the tasks on all pieces have in common.
struct Context<'a> {
    topology: &'a Topology,
    effects: Effects,
    means: &'a Means<'a>,
    h: f32,
    kernels: Kernels<'a>,
    tethers: Option<(Tethers, &'a Leads)>,
}

impl<'a> Context<'a> {
    fn new(topology: &'a Topology, body: &Stepper<'a>, means: &'a Means<'a>) -> Self {
        let Stepper { effects, leads, .. } = body;
        let h = means.settings.substep_seconds() as f32;
        Self {
            topology,
            effects: **effects,
            means,
            h,
            kernels: Kernels::new(effects, topology, h),
            tethers: effects.tethers.map(|tethers| (tethers, *leads)),
        }
    }

    /// Does the tasks of a phase on one of its pieces.
    ///
    /// # Safety
    /// Nobody else works on the piece, or on one that shares a particle with it.
    unsafe fn work(&self, shared: &Shared, phase: &Phase, piece: usize) -> Result<(), NotFinite> {
        let watch = self.means.watch;
        let piece = &phase.pieces[piece];
        // SAFETY: the caller's promise.
        let mut part = unsafe { shared.part(piece) };
        for &task in phase.tasks() {
            let Some(watch) = watch else {
                // SAFETY: the caller's promise.
                unsafe { self.task(task, shared, phase, piece, part.reborrow())? };
                continue;
            };
            let mut result = Ok(());
            watch.see(task.stage(), &mut || {
                // SAFETY: the caller's promise.
                result = unsafe { self.task(task, shared, phase, piece, part.reborrow()) };
            });
            result?;
        }
        Ok(())
    }

    /// Does one of them.
    ///
    /// # Safety
    /// As of [`work`](Self::work).
    unsafe fn task(
        &self,
        task: Task,
        shared: &Shared,
        phase: &Phase,
        piece: &Piece,
        part: Part,
    ) -> Result<(), NotFinite> {
        let Means {
            settings,
            instructions,
            ..
        } = *self.means;
        let first = piece.particles.start;
        let not_finite = |substep| {
            move |place: usize| NotFinite {
                particle: first + place,
                substep,
            }
        };
        match task {
            Task::Force { kind, substep } => {
                let h = settings.substep_seconds();
                let moment = Moment {
                    time: self.means.time + h * f64::from(substep),
                    h,
                };
                self.effects.push(kind, self.topology, moment, part);
            }
            Task::Begin => stages::presolve(part, self.h, settings.gravity, instructions),
            Task::Stick => {
                if let Some(sticky) = &self.effects.sticky_ground {
                    ground::stick(part, sticky);
                }
            }
            Task::Turn { substep } => {
                stages::turn(part, self.h, settings.gravity, instructions)
                    .map_err(not_finite(substep))?;
            }
            Task::End { substep } => {
                stages::postsolve(part, self.h, instructions).map_err(not_finite(substep))?;
            }
            Task::Elastic { kind, sweep } => {
                let work = Work {
                    piece,
                    whole: phase.is_whole(),
                    part,
                    shared,
                    sweep,
                    instructions,
                };
                // SAFETY: the caller's promise.
                unsafe { self.kernels.solve(kind, work) };
            }
            Task::Tether => {
                if let Some((tethers, leads)) = &self.tethers {
                    leads.solve(part, first, tethers);
                }
            }
            Task::Stitch { substep, sweep } => {
                let colliders = self.means.swept.of(substep);
                // SAFETY: stitches are on the whole body, which is one piece.
                let stitches = unsafe { shared.stitches() };
                stitches.solve(part.positions, colliders, self.h, sweep);
            }
            Task::Grab { substep, iteration } => {
                // SAFETY: a hand is on the whole body, which is one piece.
                if let Some(grab) = unsafe { shared.grab() } {
                    let place = (substep, settings.substeps.get());
                    grab.solve(part.positions, part.previous, self.h, place, iteration);
                }
            }
            Task::Ground => {
                if let Some(ground) = &self.effects.ground {
                    ground::solve(part, ground, self.h, settings.gravity);
                }
            }
            Task::Collide { substep } => {
                if let Some(collide) = &self.effects.collide {
                    self.collide(part, collide, substep);
                }
            }
        }
        Ok(())
    }

    fn collide(&self, mut part: Part, collide: &Collide, substep: u32) {
        for swept in self.means.swept.of(substep) {
            let gravity = self.means.settings.gravity;
            collider::solve(part.reborrow(), collide, swept, self.h, gravity);
        }
    }
}
