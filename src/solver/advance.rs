//! Steps a body: all substeps of a tick at once, or stage by stage.
//!
//! Both give the same bits, on any number of threads. Work is cut by the body, into
//! [bands](super::bands): threads take pieces that share no particle, and a particle meets its
//! tasks in the same order as if each task were done on all of the body before the next begins.

#![allow(unsafe_code, reason = "pieces are handed out by hand")]

use super::{
    Collide, Effects, Ground, Particles, Settings, StickyGround, Substep, Threads, Topology,
    bands::Piece,
    constraint::{Multipliers, block::solve_batch, stretch, volume},
    contact::{
        collider::{self, Swept},
        ground,
    },
    crew::Crew,
    lanes::Instructions,
    order::Elements,
    particles::Part,
    phases::{Phase, Phases, Side, Task},
    share::Shared,
    stages,
};
use std::{fmt, iter, ops::Range};

/// What is stepped, wherever its parts are kept.
#[derive(Debug)]
pub struct Stepper<'a> {
    /// The immutable part.
    pub topology: &'a Topology,
    /// The state.
    pub particles: &'a mut Particles,
    /// What acts; the hold of a hand changes.
    pub effects: &'a mut Effects,
    /// λ of the edges; as many as there are if they are to be kept.
    pub stretch_multipliers: &'a mut [f32],
    /// λ of the tetrahedra; as many as there are if they are to be kept.
    pub volume_multipliers: &'a mut [f32],
}

/// What all bodies are stepped with.
#[derive(Debug, Clone, Copy)]
pub struct Means<'a> {
    /// Gravity, rate, substeps, iterations.
    pub settings: &'a Settings,
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
    /// Positions are predicted.
    Presolve,
    /// Sticky ground, at the end of the first stage.
    StickyGround,
    /// Edges.
    Stretch,
    /// Tetrahedra.
    Volume,
    /// The hold of a hand.
    Grab,
    /// The ground.
    Ground,
    /// Colliders.
    Collide,
    /// Velocities are taken from positions.
    Postsolve,
}

impl Stage {
    /// What takes part in the second stage, in its order: what holds the body together, then
    /// hands, then contacts.
    pub const SOLVE: [Self; 5] = [
        Self::Stretch,
        Self::Volume,
        Self::Grab,
        Self::Ground,
        Self::Collide,
    ];

    /// All of them, in the order of a substep.
    pub const ALL: [Self; 8] = [
        Self::Presolve,
        Self::StickyGround,
        Self::Stretch,
        Self::Volume,
        Self::Grab,
        Self::Ground,
        Self::Collide,
        Self::Postsolve,
    ];

    /// The name of the stage or effect.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Presolve => "presolve",
            Self::StickyGround => "sticky_ground",
            Self::Stretch => "stretch",
            Self::Volume => "volume",
            Self::Grab => "grab",
            Self::Ground => "ground",
            Self::Collide => "collide",
            Self::Postsolve => "postsolve",
        }
    }
}

/// Tasks with their sides: at most three of a stage.
type Tasks = iter::Flatten<std::array::IntoIter<Option<(Task, Side)>, 3>>;

impl Stage {
    /// What it does to a body that carries these effects.
    fn tasks(
        self,
        topology: &Topology,
        effects: &Effects,
        step: &Substep,
        iteration: u32,
    ) -> Tasks {
        let sweep = (iteration, step.iterations, step.is_last());
        let substep = step.index;
        let one = |present: bool, task, side| [present.then_some((task, side)), None, None];
        match self {
            Self::Presolve => one(true, Task::Begin, Side::Any),
            Self::StickyGround => one(effects.sticky_ground.is_some(), Task::Stick, Side::Any),
            Self::Stretch if effects.stretch.is_some() => {
                halves(&topology.edges.elements, Task::Stretch { sweep })
            }
            Self::Volume if effects.volume.is_some() => {
                halves(&topology.tetrahedra.elements, Task::Volume { sweep })
            }
            Self::Stretch | Self::Volume => [None; 3],
            Self::Grab => one(
                effects.grab.is_some(),
                Task::Grab { substep, iteration },
                Side::Whole,
            ),
            Self::Ground => one(effects.ground.is_some(), Task::Ground, Side::Any),
            Self::Collide => one(
                effects.collide.is_some(),
                Task::Collide { substep },
                Side::Any,
            ),
            Self::Postsolve => one(true, Task::End { substep }, Side::Any),
        }
        .into_iter()
        .flatten()
    }
}

/// A sweep: the constraints of one side, those of the other, and the loose ones.
fn halves<const N: usize>(elements: &Elements<N>, task: Task) -> [Option<(Task, Side)>; 3] {
    let odd = elements.odd_first();
    let half = |odd: bool| {
        let side = if odd { Side::Odd } else { Side::Even };
        (!elements.half(odd).is_empty()).then_some((task, side))
    };
    let loose = elements.loose().map(|_| (task, Side::Whole));
    [half(odd), half(!odd), loose]
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
        let (topology, effects, settings) = (self.topology, *self.effects, means.settings);
        let first = substeps.start;
        let watched = means.watch.is_some();
        let tasks = substeps.clone().flat_map(|index| {
            let step = settings.substep(index);
            // Two stages in one pass cannot be told apart by who watches.
            let before = index.checked_sub(1).filter(|_| index > first);
            let turn = before.filter(|_| !watched);
            let end = before.filter(|_| watched);
            let end = end.map(|substep| (Task::End { substep }, Side::Any));
            let start = turn.map_or(Task::Begin, |substep| Task::Turn { substep });
            let of_stage =
                move |stage: Stage, iteration| stage.tasks(topology, &effects, &step, iteration);
            let sweeps = (0..step.iterations).flat_map(move |iteration| {
                Stage::SOLVE
                    .into_iter()
                    .flat_map(move |stage| of_stage(stage, iteration))
            });
            end.into_iter()
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
        let tasks = stage.tasks(self.topology, self.effects, step, iteration);
        let sweeps = usize::from(matches!(stage, Stage::Stretch | Stage::Volume));
        self.run(tasks, sweeps, means)
    }

    fn run(
        &mut self,
        tasks: impl Iterator<Item = (Task, Side)> + Clone + Send + Sync,
        sweeps: usize,
        means: &Means,
    ) -> Result<(), NotFinite> {
        let bands = &self.topology.bands;
        let projections = self.effects.constraints(self.topology) * sweeps;
        let phases = Phases::new(tasks, bands);
        let context = Context::new(self, means);
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
    means: &'a Means<'a>,
    h: f32,
    stretch: Option<stretch::Kernel<'a>>,
    volume: Option<volume::Kernel<'a>>,
    ground: Option<Ground>,
    sticky_ground: Option<StickyGround>,
    collide: Option<Collide>,
}

impl<'a> Context<'a> {
    fn new(body: &Stepper<'a>, means: &'a Means<'a>) -> Self {
        let Stepper {
            topology, effects, ..
        } = body;
        let h = means.settings.substep_seconds() as f32;
        Self {
            topology,
            means,
            h,
            stretch: effects.stretch.map(|stretch| stretch::Kernel {
                edges: &topology.edges,
                rest: &topology.rest,
                coefficients: stretch.coefficients(h),
            }),
            volume: effects.volume.map(|volume| volume::Kernel {
                tetrahedra: &topology.tetrahedra,
                rest: &topology.rest,
                coefficients: volume.coefficients(h),
            }),
            ground: effects.ground,
            sticky_ground: effects.sticky_ground,
            collide: effects.collide,
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
            Task::Begin => stages::presolve(part, self.h, settings.gravity, instructions),
            Task::Stick => {
                if let Some(sticky) = &self.sticky_ground {
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
            Task::Stretch { sweep } => {
                let elements = &self.topology.edges.elements;
                let batch = batch(elements, piece.band, phase.is_whole());
                if let (Some(kernel), Some(index)) = (&self.stretch, batch) {
                    let constraints = elements.batches()[index].constraints();
                    // SAFETY: a constraint is in one batch, a batch on one piece.
                    let column = unsafe { shared.stretch(constraints) };
                    let multipliers = Multipliers::of_sweep(column, sweep);
                    let particles = (part.positions, &*part.previous, first);
                    solve_batch(kernel, index, particles, multipliers, instructions);
                }
            }
            Task::Volume { sweep } => {
                let elements = &self.topology.tetrahedra.elements;
                let batch = batch(elements, piece.band, phase.is_whole());
                if let (Some(kernel), Some(index)) = (&self.volume, batch) {
                    let constraints = elements.batches()[index].constraints();
                    // SAFETY: as above.
                    let column = unsafe { shared.volume(constraints) };
                    let multipliers = Multipliers::of_sweep(column, sweep);
                    let particles = (part.positions, &*part.previous, first);
                    solve_batch(kernel, index, particles, multipliers, instructions);
                }
            }
            Task::Grab { substep, iteration } => {
                // SAFETY: a hand is on the whole body, which is one piece.
                if let Some(grab) = unsafe { shared.grab() } {
                    let place = (substep, settings.substeps.get());
                    grab.solve(part.positions, part.previous, self.h, place, iteration);
                }
            }
            Task::Ground => {
                if let Some(ground) = &self.ground {
                    ground::solve(part, ground, self.h, settings.gravity);
                }
            }
            Task::Collide { substep } => {
                if let Some(collide) = &self.collide {
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

/// Number of the batch that is solved on a piece: that of its band, or the loose one on the whole.
fn batch<const N: usize>(
    elements: &Elements<N>,
    band: Option<usize>,
    whole: bool,
) -> Option<usize> {
    if whole {
        elements.loose()
    } else {
        band.map(|band| elements.batch_of(band))
    }
}
