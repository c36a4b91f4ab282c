//! Steps a body: all substeps of a tick at once, or stage by stage.
//!
//! Both produce the same bits, on any number of threads. Work is divided by the body, into
//! [partitions](crate::partitions): threads take pieces that share no particle, and the tasks of a
//! particle run in the same order as if each task were completed on the whole body before the next
//! begins.

#![allow(unsafe_code, reason = "threads borrow disjoint pieces")]

pub use super::{
    stage::Stage,
    stepper::{NotFinite, StepContext, Stepper, Watch},
};

use super::kernels::{ElasticPass, Kernels, halves_of};
pub(crate) use super::stage::{Acting, Solve};
use crate::{
    BodyEffectKind, Effects, ElasticKind, ForceKind, Grains, Settings, Substep, Threads, Topology,
    colliders::inside::{WayOut, find_sides},
    direct::Iteration,
    effects::{
        body_effect::{BodyPass, Resting},
        controls::ByParticle,
        free::Free,
        rod,
        workspace::Workspace,
    },
    executor::PhaseExecutor,
    force::{ForcedBody, Moment},
    kernel::{
        block::Put,
        copies::Copies,
        each::{InLanes, pass_over},
        moments::moments,
        strips::StripRows,
    },
    layout::strips::Strips,
    parallel::scope::Side,
    particles::Part,
    partitions::Piece,
    phases::{Phase, Phases, Task},
    shared_body::SharedBody,
    stages,
    step::{
        spin,
        strips::{InStrips, Moving},
    },
};
use std::{iter, ops::Range, sync::Arc};

/// Friction on ground and colliders. The energy ledger performs a pass without it, to separate its
/// work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Friction {
    /// With the friction of the effects.
    Included,
    /// Normal forces only.
    Omitted,
}

/// Fewest partitions of a body of which one thread has several phases in work at once: a smaller one,
/// of 4000 particles, stays in the cache from one phase to the next.
const MIN_PARTITIONS: usize = 16;

/// Tasks with their sides: at most four per stage, and four more around internal constraints.
type Tasks = iter::Flatten<std::array::IntoIter<Option<(Task, Side)>, 8>>;

impl Stage {
    /// Tasks of the stage on a body on which these effects act, with what keeps its [angular
    /// momentum](crate::spin).
    fn tasks(self, topology: &Topology, acting: Acting, step: &Substep, iteration: u32) -> Tasks {
        let stage = self;
        let own = self.own_tasks(topology, acting, step, iteration);
        let [begins, ends] = acting.bounds(stage, step, iteration);
        let keep = begins.then_some((Task::Keep { stage }, Side::Any));
        let is_whole = acting.free == Free::Whole;
        let sum = (ends && is_whole).then_some((Task::Sum { stage }, Side::Even));
        let find = ends.then_some((Task::FindTurn { stage }, Side::Whole));
        let turn = (ends && is_whole).then_some((Task::TurnBack { stage }, Side::Any));
        let [a, b, c, d] = own;
        [keep, a, b, c, d, sum, find, turn].into_iter().flatten()
    }

    fn own_tasks(
        self,
        topology: &Topology,
        acting: Acting,
        step: &Substep,
        iteration: u32,
    ) -> [Option<(Task, Side)>; 4] {
        let Acting {
            effects, outside, ..
        } = acting;
        let pass = (iteration, step.total_iterations(), step.is_last());
        let substep = step.index;
        let single = |task, side| [Some((task, side)), None, None, None];
        match self {
            // Not a task on pieces: kernels borrow rest values while tasks run. Contacts of bodies
            // act between tasks.
            Self::Flow
            | Self::Tear
            | Self::Renew
            | Self::Contact
            | Self::SelfContact
            | Self::Joints => [None; 4],
            _ if !self.acts(effects, outside, step.method) => [None; 4],
            Self::External => single(Task::Push, Side::Any),
            Self::Pins => single(Task::MovePins { substep }, Side::Any),
            Self::Grabs => single(Task::Grabs { substep, iteration }, Side::Whole),
            Self::Force(kind) => {
                let side = match effects.pushes_in_lanes(kind) {
                    true => Side::Any,
                    false => Side::Whole,
                };
                single(Task::Force { kind, substep }, side)
            }
            Self::Presolve if step.method.keeps_speed().is_some() => {
                let tasks = [Task::DampVelocity, Task::Begin].map(|task| Some((task, Side::Any)));
                [tasks[0], tasks[1], None, None]
            }
            Self::Presolve => single(Task::Begin, Side::Any),
            Self::Elastic(kind) => {
                let direction = step.direction(iteration);
                let [first, second, overflow] =
                    halves_of(kind, topology, Task::Elastic { kind, pass }, direction);
                let average = step
                    .averaging(iteration)
                    .map(|_| (Task::Average { kind, iteration }, Side::Any));
                [first, second, overflow, average]
            }
            Self::Body(kind) => {
                let task = Task::Body {
                    kind,
                    substep,
                    iteration,
                };
                let [first, second, third] = kind.sides().map(|side| side.map(|side| (task, side)));
                let is_cut = topology.partitions.count() > 1;
                [
                    first,
                    second.filter(|_| is_cut),
                    third.filter(|_| is_cut),
                    None,
                ]
            }
            Self::Direct => match step.ends_iteration(iteration) {
                Some(iteration) => single(Task::Direct { substep, iteration }, Side::Whole),
                None => [None; 4],
            },
            Self::Postsolve => single(Task::End { substep }, Side::Any),
        }
    }
}

/// Tasks of some substeps without plastic flow or second-order steps.
pub(super) fn tasks<'a>(
    topology: &'a Topology,
    acting: Acting<'a>,
    substeps: &Range<u32>,
    context: &StepContext<'a>,
) -> impl Iterator<Item = (Task, Side)> + Clone + Send + Sync + use<'a> {
    let settings = context.settings;
    let effects = acting.effects;
    let solve = Solve::of(effects, acting.outside, settings.method);
    let first = substeps.start;
    let mut forces = ForceKind::ALL
        .into_iter()
        .filter(|kind| effects.has_force(*kind));
    let forces: [_; ForceKind::COUNT] = std::array::from_fn(|_| forces.next());
    // A `Watch` cannot distinguish two stages in one pass, and forces act between them.
    let damps = settings.method.keeps_speed().is_some();
    let separate = context.watch.is_some() || forces[0].is_some() || damps;
    let tasks = substeps.clone().flat_map(move |index| {
        let step = settings.substep(index);
        let before = index.checked_sub(1).filter(|_| index > first);
        let previous = before.filter(|_| !separate);
        let end = before.filter(|_| separate);
        let end = end.map(|substep| (Task::End { substep }, Side::Any));
        let start = previous.map_or(Task::Begin, |substep| Task::EndAndBegin { substep });
        let damping = damps.then_some((Task::DampVelocity, Side::Any));
        let of_stage =
            move |stage: Stage, iteration| stage.tasks(topology, acting, &step, iteration);
        // `EndAndBegin` pushes, too.
        let push = of_stage(Stage::External, 0).filter(move |_| previous.is_none());
        let iterations = solve
            .stages(step)
            .flat_map(move |(stage, iteration)| of_stage(stage, iteration));
        let forces = forces.into_iter().flatten();
        end.into_iter()
            .chain(push)
            .chain(forces.flat_map(move |kind| of_stage(Stage::Force(kind), 0)))
            .chain(damping)
            .chain(iter::once((start, Side::Any)))
            .chain(Stage::prediction().flat_map(move |stage| of_stage(stage, 0)))
            .chain(iterations)
    });
    let end = substeps
        .clone()
        .last()
        .map(|substep| (Task::End { substep }, Side::Any));
    tasks.chain(end)
}

impl Stepper<'_> {
    /// Records a contact in the current substep.
    pub(crate) fn touch(&mut self) {
        self.particles.touch();
        self.states.is_touched = true;
    }

    /// Sets the [largest component of a displacement](crate::effects::states::Found::longest) so far,
    /// from which it is measured.
    pub(super) fn set_longest(&mut self, longest: Option<f32>) {
        self.states.scratch.found().longest = longest;
    }

    /// The largest component of a displacement since it was set [m].
    pub(super) fn longest(&mut self) -> Option<f32> {
        self.states.scratch.found().longest
    }

    /// Begins or continues a tick: updates the states of the effects. Multipliers are stored where
    /// they are `read`, by later iterations or for measurements, and by tearing.
    pub fn prepare(&mut self, read: bool) {
        let Self {
            topology, effects, ..
        } = self;
        for kind in ElasticKind::ALL {
            let kept = (read || effects.tear.is_some()) && effects.has(kind);
            self.states.make_room(kind, topology, kept);
        }
        if let Some(effect) = &effects.rod {
            rod::place(
                effect,
                self.particles,
                topology,
                &mut self.states.others.rod,
            );
        } else {
            self.particles.segments.clear();
        }
        let rotating = effects.grains.filter(Grains::rotates);
        self.particles
            .allow_rotation(rotating.map(|_| &topology.radii[..]));
        let is_recorded = self.states.records_contacts;
        let particles = self.particles.len();
        self.states.recorded.prepare(particles, is_recorded);
        let positions = &self.particles.positions;
        self.states.others.begin_tick(effects, topology, positions);
        let controls = self.controls.as_mut();
        if let Some(grabs) = controls.and_then(|it| it.grabs.as_mut()) {
            grabs.prepare(topology, positions);
        }
    }

    /// Updates the states of those effects without elements that `act`.
    pub(crate) fn prepare_effects(&mut self, step: &Substep, act: impl Fn(BodyEffectKind) -> bool) {
        let body = Resting {
            topology: self.topology,
            step,
            records_contacts: self.states.records_contacts,
        };
        for &kind in BodyEffectKind::ALL {
            if act(kind) {
                self.states.others.prepare((self.effects, kind), &body);
            }
        }
    }

    /// Begins a substep; with second-order steps, from the last two states. Must be called before
    /// anything else in the substep; [`advance`](Self::advance) does so.
    pub fn begin(&mut self, step: &Substep, context: &StepContext) {
        self.begin_repair(step, context);
        self.begin_after_repair(step, context, false);
    }

    /// Finds damage at the beginning of a tick, and moves particles under repair.
    pub(crate) fn begin_repair(&mut self, step: &Substep, context: &StepContext) {
        self.convert_substep(context);
        if step.index == 0 {
            self.look(context);
        }
        self.move_repaired(context);
    }

    /// Finds what is found once a tick, before its first substep: damage, colliders that particles are in,
    /// on which particles an app acts, and what can rotate freely.
    fn look(&mut self, context: &StepContext) {
        self.states.is_touched = self.stitches.lead_outside();
        self.check_damage(context);
        let colliders = match self.effects.collide {
            Some(_) => context.swept.of(0),
            None => &[],
        };
        let positions = &self.particles.positions;
        let found = self.states.scratch.found();
        find_sides(&mut found.sides, self.topology, positions, colliders);
        found
            .controls
            .update(self.controls.as_deref(), self.topology, positions);
        if self.effects.wind.is_none() {
            found.loads = Vec::new();
        }
        self.begin_spin(context.settings);
    }

    /// The part of [`begin`](Self::begin) after repair. `is_near` tells whether another surface is
    /// near, in which case second-order steps restart.
    pub(crate) fn begin_after_repair(
        &mut self,
        step: &Substep,
        context: &StepContext,
        is_near: bool,
    ) {
        if context.settings.order.get() == 1 {
            self.begin_first_order(context);
            return;
        }
        let restarts = is_near || self.may_touch(step, context);
        let h = context.settings.substep_seconds();
        self.particles.begin_second_order(h, restarts);
    }

    /// Converts displacements to the length of the substep before damage is searched for: a body may
    /// be damaged where it will be after the next substep. For implicit Euler; second-order steps
    /// need the last substep as it was.
    fn convert_substep(&mut self, context: &StepContext) {
        if context.settings.order.get() == 1 {
            self.begin_first_order(context);
        }
    }

    /// Drops the history, which implicit Euler does not need.
    fn begin_first_order(&mut self, context: &StepContext) {
        self.particles.history.forget();
        let h = context.settings.substep_seconds() as f32;
        self.particles.set_substep_seconds(h);
    }

    /// Whether a particle touches the ground or a collider, or would at the end of a substep
    /// without constraints.
    fn may_touch(&self, step: &Substep, context: &StepContext) -> bool {
        let heights = [
            self.effects.ground.map(|ground| ground.height.get()),
            self.effects.sticky_ground.map(|ground| ground.height.get()),
        ];
        let height = heights.into_iter().flatten().reduce(f32::max);
        let colliders = match self.effects.collide {
            Some(_) => context.swept.of(step.index),
            None => &[],
        };
        if height.is_none() && colliders.is_empty() {
            return false;
        }
        let h = f64::from(step.h);
        let gravity = step.gravity.as_dvec3();
        let particles = &*self.particles;
        let moving = (0..particles.len()).filter(|&i| particles.positions[i].w > 0.0);
        moving.into_iter().any(|i| {
            let from = particles.position(i);
            let to = from + (particles.velocity_f64(i) + gravity * h) * h;
            let radius = f64::from(self.topology.radius(i));
            height.is_some_and(|height| from.y.min(to.y) - radius <= f64::from(height))
                || colliders.iter().any(|collider| {
                    let (from, to) = (collider.from.undo(from), collider.to.undo(to));
                    collider.shape.exit(from, to, radius).is_some()
                })
        })
    }

    /// Performs some substeps of a tick.
    ///
    /// # Errors
    /// [`NotFinite`] when a displacement is no longer finite; the body keeps the state at that
    /// point, with finite positions. Parts of a large body may then be some substeps ahead of others.
    pub fn advance(
        &mut self,
        substeps: Range<u32>,
        context: &StepContext,
    ) -> Result<(), NotFinite> {
        if self.start(&substeps, context) {
            self.advance_together(substeps, context)
        } else {
            self.advance_one_by_one(substeps, context)
        }
    }

    /// Begins some substeps of a tick; returns whether they can be performed together.
    pub(super) fn start(&mut self, substeps: &Range<u32>, context: &StepContext) -> bool {
        self.convert_substep(context);
        if substeps.start == 0 {
            self.look(context);
        }
        let begins = context.settings.begins_each_substep();
        let repaired = !self.particles.repair.is_empty();
        !begins && !repaired && !self.effects.acts_between_substeps()
    }

    /// Performs substeps with what is between them: repair, plastic flow, second-order steps.
    pub(super) fn advance_one_by_one(
        &mut self,
        substeps: Range<u32>,
        context: &StepContext,
    ) -> Result<(), NotFinite> {
        let begins = context.settings.begins_each_substep();
        for index in substeps {
            let step = context.settings.substep(index);
            self.move_repaired(context);
            if begins {
                self.begin_after_repair(&step, context, false);
            }
            self.advance_together(index..index + 1, context)?;
            self.end();
            self.flow(&step, context);
        }
        Ok(())
    }

    /// Ends a substep: the counterpart of [`begin`](Self::begin), after the last stage and before
    /// plastic flow; [`advance`](Self::advance) does so.
    pub fn end(&mut self) {
        self.resist_rolling();
        self.end_repair();
    }

    /// Performs substeps without plastic flow or second-order steps.
    pub(super) fn advance_together(
        &mut self,
        substeps: Range<u32>,
        context: &StepContext,
    ) -> Result<(), NotFinite> {
        let shape = Arc::clone(self.topology);
        let settings = context.settings;
        self.prepare_together(&substeps, settings);
        let acting = self.acting(self.effects, settings);
        let tasks = tasks(&shape, acting, &substeps, context);
        let strips = InStrips::of(&shape, acting, tasks.clone(), context);
        if strips.is_none() {
            self.states.workspace = Workspace::default();
        }
        let iterations = substeps.len() * settings.substep(0).total_iterations() as usize;
        let friction = Friction::Included;
        self.run(&shape, (tasks, friction, strips), iterations, context)
    }

    /// What acts on the body, with these effects.
    pub(super) fn acting<'a>(&self, effects: &'a Effects, settings: &Settings) -> Acting<'a> {
        Acting::of(effects, self.outside(), settings, self.free())
    }

    /// Prepares what the tasks of some substeps need.
    pub(super) fn prepare_together(&mut self, substeps: &Range<u32>, settings: &Settings) {
        self.prepare_sums(&settings.substep(0));
        self.prepare_effects(&settings.substep(substeps.start), |_| true);
    }

    /// Allocates sums if a substep has averaged passes.
    fn prepare_sums(&mut self, step: &Substep) {
        let averages = step.averaging(step.total_iterations() - 1).is_some();
        let count = if averages {
            self.topology.particles()
        } else {
            0
        };
        self.states.make_sums(count);
    }

    /// Performs one stage of a substep.
    ///
    /// # Errors
    /// [`NotFinite`] from the last stage.
    pub fn stage(
        &mut self,
        stage: Stage,
        step: &Substep,
        iteration: u32,
        context: &StepContext,
    ) -> Result<(), NotFinite> {
        self.stage_with((stage, Friction::Included), step, iteration, context)
    }

    /// Performs one stage of a substep, with or without friction on ground and colliders.
    pub(crate) fn stage_with(
        &mut self,
        (stage, friction): (Stage, Friction),
        step: &Substep,
        iteration: u32,
        context: &StepContext,
    ) -> Result<(), NotFinite> {
        if stage == Stage::Flow {
            self.flow(step, context);
            return Ok(());
        }
        let shape = Arc::clone(self.topology);
        if matches!(stage, Stage::Elastic(_)) && step.averaging(iteration).is_some() {
            self.states.make_sums(shape.particles());
        }
        self.prepare_effects(step, |kind| stage == Stage::Body(kind));
        let acting = self.acting(self.effects, context.settings);
        let tasks = stage.tasks(&shape, acting, step, iteration);
        let iterations = usize::from(matches!(stage, Stage::Elastic(_)));
        self.run(&shape, (tasks, friction, None), iterations, context)
    }

    /// Performs some stages of a substep, with the numbers of their iterations, together.
    ///
    /// # Errors
    /// [`NotFinite`] from the last stage.
    pub(crate) fn stages(
        &mut self,
        stages: impl Iterator<Item = (Stage, u32)> + Clone + Send + Sync,
        step: &Substep,
        context: &StepContext,
    ) -> Result<(), NotFinite> {
        let shape = Arc::clone(self.topology);
        let topology: &Topology = &shape;
        self.prepare_sums(step);
        self.prepare_effects(step, |kind| {
            let mut stages = stages.clone();
            stages.any(|(stage, _)| stage == Stage::Body(kind))
        });
        let acting = self.acting(self.effects, context.settings);
        let mut elastic = stages.clone();
        let iterations = usize::from(elastic.any(|(stage, _)| matches!(stage, Stage::Elastic(_))));
        let tasks = stages
            .flat_map(move |(stage, iteration)| stage.tasks(topology, acting, step, iteration));
        let friction = Friction::Included;
        let strips = InStrips::of(topology, acting, tasks.clone(), context);
        self.run(topology, (tasks, friction, strips), iterations, context)
    }

    /// Performs one stage other than the last, which alone checks for non-finite values.
    pub fn act(&mut self, stage: Stage, step: &Substep, iteration: u32, context: &StepContext) {
        let done = self.stage(stage, step, iteration, context);
        debug_assert!(done.is_ok(), "{stage:?} checks for non-finite values");
    }

    /// Applies plastic flow at the end of a substep, if it is due.
    pub(crate) fn flow(&mut self, step: &Substep, context: &StepContext) {
        let h = context.settings.substep_seconds();
        let end = context.time + h * f64::from(step.index + 1);
        if let Some(plasticity) = self.effects.plasticity
            && let Some(seconds) = plasticity.due(end, h)
        {
            let mut flow = || plasticity.flow(self.effects, self.topology, self.particles, seconds);
            match context.watch {
                Some(watch) => watch.observe(Stage::Flow, &mut flow),
                None => flow(),
            }
        }
    }

    fn run(
        &mut self,
        topology: &Topology,
        (tasks, friction, strips): (
            impl Iterator<Item = (Task, Side)> + Clone + Send + Sync,
            Friction,
            Option<InStrips>,
        ),
        iterations: usize,
        context: &StepContext,
    ) -> Result<(), NotFinite> {
        let partitions = &topology.partitions;
        // Passes over grains keep the threads awake for what is between them.
        let has_grains = self.effects.grains.is_some();
        let projections = match has_grains {
            true => self.effects.load(topology, iterations.max(1)).projections,
            false => self.effects.constraints(topology) * iterations,
        };
        // A large factorization takes the threads for itself.
        let is_large = self.effects.is_direct(context.settings.method) && self.direct.is_large();
        let pays = !is_large && partitions.count() > 1 && context.threads.pays(projections);
        if let (Some(_), Some(strips)) = (strips, partitions.strips()) {
            let is_kept = self.free() == Free::Whole;
            let columns = self.states.workspace.columns();
            columns.strips.make_room(partitions, strips, is_kept);
        }
        let phases = Phases::new(Moving::new(tasks, strips), partitions);
        let task_context = TaskContext::new(topology, self, friction, context);
        let shared = SharedBody::new(self, strips.is_some());
        // SAFETY: pieces of a phase share no particle and no constraint, and a piece begins when
        // the phase before is done on its particles, which then have all earlier ones behind them.
        let work =
            |phase: &Phase, piece: usize| unsafe { task_context.work(&shared, phase, piece) };
        let serially =
            |phase: Phase| (0..phase.pieces.len()).try_for_each(|piece| work(&phase, piece));
        let result = if pays && has_grains {
            let mut phases = phases;
            let mut result = Ok(());
            while result.is_ok() {
                let shared = phases.clone().take_while(|phase| !phase.uses_threads());
                let count = shared.clone().count();
                if count > 0 {
                    let executor = PhaseExecutor::new();
                    result = executor.work(context.threads, shared, &work);
                }
                let Some(phase) = phases.nth(count).filter(|_| result.is_ok()) else {
                    break;
                };
                result = serially(phase);
            }
            result
        } else if pays {
            PhaseExecutor::new().work(context.threads, phases, &work)
        } else if partitions.count() >= MIN_PARTITIONS && iterations > 1 {
            PhaseExecutor::new().work(&Threads::default(), phases, &work)
        } else {
            let mut phases = phases;
            phases.try_for_each(serially)
        };
        if let (Err(_), Some(strips)) = (&result, strips) {
            // SAFETY: all work is done.
            unsafe { shared.store(partitions, strips.stay(), context.instructions) };
        }
        let (touched, longest) = (shared.touched(), shared.longest());
        if touched {
            self.touch();
        }
        self.set_longest(longest);
        if result.is_err() {
            // Pieces far from the failed one may be some phases ahead of it.
            self.states.clear_solutions();
        }
        result
    }
}

/// Data that the tasks on all pieces share.
pub(super) struct TaskContext<'a> {
    topology: &'a Topology,
    effects: &'a Effects,
    context: &'a StepContext<'a>,
    /// Any substep of the tick, for the settings that all have in common.
    any: Substep,
    /// Length of a substep [s] for implicit Euler.
    h: f32,
    /// Length of a substep [s] for compliances, by the method.
    compliant: f32,
    pub kernels: Kernels<'a>,
    friction: Friction,
}

impl<'a> TaskContext<'a> {
    pub fn new(
        topology: &'a Topology,
        body: &Stepper<'a>,
        friction: Friction,
        context: &'a StepContext<'a>,
    ) -> Self {
        let Stepper { effects, .. } = body;
        let h = body
            .particles
            .history
            .seconds(context.settings.substep_seconds());
        let compliant = context.settings.method.compliant_seconds(h) as f32;
        let h = h as f32;
        Self {
            topology,
            effects,
            context,
            any: context.settings.substep(0),
            h,
            compliant,
            kernels: Kernels::new(effects, topology, compliant),
            friction,
        }
    }

    /// How the particles are placed in lanes.
    pub fn strips(&self) -> Option<Strips> {
        self.topology.partitions.strips()
    }

    /// Performs the tasks of a phase on one of its pieces.
    ///
    /// # Safety
    /// No other thread works on the piece, or on one that shares a particle with it.
    unsafe fn work(
        &self,
        shared: &SharedBody,
        phase: &Phase,
        piece: usize,
    ) -> Result<(), NotFinite> {
        let watch = self.context.watch;
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
            watch.observe(task.stage(), &mut || {
                // SAFETY: the caller's promise.
                result = unsafe { self.task(task, shared, phase, piece, part.reborrow()) };
            });
            result?;
        }
        Ok(())
    }

    /// A pass of an effect without elements on a piece whose first particle has number `first`.
    fn body_pass<'b>(
        &'b self,
        (first, sides): (usize, &'b [WayOut]),
        (substep, iteration): (u32, u32),
    ) -> BodyPass<'b> {
        let StepContext {
            settings,
            swept,
            threads,
            instructions,
            ..
        } = *self.context;
        BodyPass {
            topology: self.topology,
            first,
            colliders: swept.of(substep),
            sides,
            gravity: settings.gravity,
            seconds: settings.substep_seconds(),
            h: self.h,
            compliant: self.compliant,
            relaxation: self.any.method.relaxation(),
            substep: (substep, self.any.count),
            iteration: (iteration, self.any.total_iterations()),
            is_frictionless: self.friction == Friction::Omitted,
            rolling_resistance: self
                .effects
                .grains
                .map_or(0.0, |grains| grains.rolling_resistance.get()),
            instructions,
            threads,
        }
    }

    /// Performs a pass of an effect without elements on copies of the body in lanes, of which
    /// `shared` is one; nothing is kept of the passes of any. Returns the lanes of those that touched
    /// something, as bits, or `None`, with nothing changed, if they must leave the lanes for it.
    ///
    /// # Safety
    /// As for [`work`](Self::work).
    pub unsafe fn solve_in_lanes(
        &self,
        kind: BodyEffectKind,
        (substep, iteration): (u32, u32),
        (shared, piece): (&SharedBody, &Piece),
        copies: &mut Copies,
    ) -> Option<u64> {
        let at = (piece.particles.start, shared.sides());
        let pass = self.body_pass(at, (substep, iteration));
        let effect = (self.effects, kind);
        // SAFETY: the caller's promise.
        unsafe { shared.states.solve_in_lanes(effect, piece, copies, &pass) }
    }

    /// Ends a substep for copies of the body, and begins the next one if one follows in the same pass; returns
    /// whether they are finite, and otherwise changes nothing.
    pub fn end(&self, copies: &mut Copies, begins: bool) -> bool {
        let push = self.context.settings.gravity * (self.h * self.h);
        let pushes = [push];
        let pushes = if begins { &pushes[..] } else { &[] };
        copies.end(self.h, pushes, self.context.instructions)
    }

    /// Begins a substep for copies of the body.
    pub fn begin(&self, copies: &mut Copies) {
        let gravity = self.context.settings.gravity;
        copies.begin(self.h, gravity, self.context.instructions);
    }

    /// Applies a force that acts on each particle by itself to those in lanes.
    pub fn push_in_lanes(&self, kind: ForceKind, substep: u32, lanes: &mut impl InLanes) {
        let (moment, instructions) = (self.moment(substep), self.context.instructions);
        let effects = self.effects;
        effects.push_in_lanes(kind, &moment, lanes, instructions);
    }

    /// Time of the forces of a substep.
    fn moment(&self, substep: u32) -> Moment {
        let settings = self.context.settings;
        Moment {
            time: self.context.time + settings.substep_seconds() * f64::from(substep),
            h: self.h.into(),
            gravity: settings.gravity.as_dvec3(),
        }
    }

    /// Applies the force of an app to a piece, in lanes if it is there.
    fn push(
        &self,
        controls: &ByParticle,
        piece: &Piece,
        rows: Option<&mut StripRows>,
        mut part: Part,
    ) {
        let (all, instructions) = (controls.push_of_all(self.h), self.context.instructions);
        match rows {
            Some(rows) => {
                rows.pass(all, instructions);
                controls.push_singles(&piece.particles, rows, self.h);
            }
            None => {
                pass_over(part.reborrow(), all, instructions);
                controls.push_singles(&piece.particles, &mut part, self.h);
            }
        }
    }

    /// Performs one task.
    ///
    /// # Safety
    /// As for [`work`](Self::work).
    pub unsafe fn task(
        &self,
        task: Task,
        shared: &SharedBody,
        phase: &Phase,
        piece: &Piece,
        mut part: Part,
    ) -> Result<(), NotFinite> {
        let StepContext {
            settings,
            instructions,
            ..
        } = *self.context;
        let first = piece.particles.start;
        // SAFETY: the caller's promise.
        let (mut rows, loaded) = unsafe { shared.rows(piece) }.unzip();
        let is_loaded = loaded.as_deref().is_some_and(|it| it.contains(&true));
        if shared.is_measured() && matches!(task, Task::EndAndBegin { .. } | Task::End { .. }) {
            shared.measure(match rows.as_ref().filter(|_| is_loaded) {
                Some(rows) => rows.longest(instructions),
                None => stages::longest(&part),
            });
        }
        let not_finite = |substep| {
            move |place: usize| NotFinite {
                particle: first + place,
                substep,
            }
        };
        match task {
            Task::Push => {
                self.push(
                    shared.controls(),
                    piece,
                    rows.as_mut().filter(|_| is_loaded),
                    part,
                );
            }
            Task::MovePins { substep } => {
                let at = (substep, self.any.count);
                let controls = shared.controls();
                match rows.as_mut().filter(|_| is_loaded) {
                    Some(rows) => controls.move_pins(&piece.particles, rows, at),
                    None => controls.move_pins(&piece.particles, &mut part, at),
                }
            }
            Task::Grabs { substep, iteration } => {
                let at = ((substep, self.any.count), iteration);
                let count = self.topology.particles();
                // SAFETY: the whole body is one piece.
                if let Some(grabs) = unsafe { shared.grabs() } {
                    match rows.as_mut().filter(|_| is_loaded) {
                        Some(rows) => grabs.pull(count, rows, self.h, at),
                        None => grabs.pull(count, &mut part, self.h, at),
                    }
                }
            }
            Task::Force { kind, substep } => {
                let moment = self.moment(substep);
                if !self.effects.pushes_in_lanes(kind) {
                    // SAFETY: the whole body is one piece.
                    let loads = unsafe { shared.loads() };
                    let body = ForcedBody {
                        topology: self.topology,
                        moment,
                        loads,
                        part,
                        instructions,
                    };
                    self.effects.push(kind, body);
                } else if let Some(rows) = rows.as_mut().filter(|_| is_loaded) {
                    self.push_in_lanes(kind, substep, rows);
                } else {
                    self.effects.push_on(kind, &moment, part, instructions);
                }
            }
            Task::DampVelocity => {
                if let Some(kept) = self.any.method.keeps_speed() {
                    stages::damp_velocity(part, self.h, settings.gravity, kept);
                }
            }
            Task::Begin => {
                // SAFETY: the caller's promise.
                unsafe { shared.states.begin(&piece.particles) };
                match rows.as_mut().filter(|_| is_loaded) {
                    Some(rows) => rows.begin(self.h, settings.gravity, instructions),
                    None => stages::presolve(part, self.h, settings.gravity, instructions),
                }
            }
            Task::EndAndBegin { substep } => {
                // SAFETY: the caller's promise.
                unsafe { shared.states.begin(&piece.particles) };
                let (h, gravity) = (self.h, settings.gravity);
                let controls = shared.controls();
                if let Some(rows) = rows.as_mut().filter(|_| is_loaded) {
                    let is_apart = controls.push_single(&piece.particles);
                    let pushes = [controls.push_of_all(h).0, gravity * (h * h)];
                    let first = usize::from(!controls.push());
                    let pushes = if is_apart { &[] } else { &pushes[first..] };
                    if rows.end(h, pushes, instructions) {
                        if is_apart {
                            self.push(controls, piece, Some(rows), part);
                            rows.begin(h, gravity, instructions);
                        }
                        return Ok(());
                    }
                    rows.store(&mut part, true, instructions);
                }
                if !controls.push() {
                    return stages::end_and_begin(part, h, gravity, instructions)
                        .map_err(not_finite(substep));
                }
                stages::postsolve(part.reborrow(), h, instructions).map_err(not_finite(substep))?;
                self.push(controls, piece, None, part.reborrow());
                stages::presolve(part, h, gravity, instructions);
            }
            Task::End { substep } => {
                if let Some(rows) = rows.as_mut().filter(|_| is_loaded) {
                    if rows.end(self.h, &[], instructions) {
                        return Ok(());
                    }
                    rows.store(&mut part, true, instructions);
                }
                stages::postsolve(part, self.h, instructions).map_err(not_finite(substep))?;
            }
            Task::Load { carried } => {
                if let (Some(rows), Some(loaded)) = (&mut rows, loaded) {
                    rows.load(&part, carried, instructions);
                    loaded.fill(true);
                }
            }
            Task::Store { moved } => {
                if let (Some(rows), Some(loaded)) = (&rows, loaded) {
                    rows.store(&mut part, moved, instructions);
                    loaded.fill(false);
                }
            }
            Task::Elastic { kind, pass } => {
                let (iteration, ..) = pass;
                let put = match self.any.averaging(iteration) {
                    // SAFETY: the caller's promise.
                    Some(averaging) => Put::Sum {
                        sums: unsafe { shared.sums(piece) },
                        masses: averaging.masses,
                    },
                    None => Put::relaxed(self.any.method.relaxation()),
                };
                let work = ElasticPass {
                    piece,
                    whole: phase.is_whole(),
                    part,
                    rows: rows.filter(|_| is_loaded),
                    shared,
                    pass,
                    direction: self.any.direction(iteration),
                    put,
                    instructions,
                };
                // SAFETY: the caller's promise.
                unsafe { self.kernels.solve(kind, work) };
            }
            Task::Body {
                kind,
                substep,
                iteration,
            } => {
                let at = (first, shared.sides());
                let pass = self.body_pass(at, (substep, iteration));
                let effect = (self.effects, kind);
                let mut rows = rows.filter(|_| is_loaded);
                if let Some(rows) = &mut rows {
                    // SAFETY: the caller's promise.
                    let done = unsafe { shared.states.solve_in_lanes(effect, piece, rows, &pass) };
                    if let Some(lanes) = done {
                        shared.touch(lanes != 0);
                        return Ok(());
                    }
                    rows.store(&mut part, true, instructions);
                }
                // SAFETY: the caller's promise; an effect on the whole body has it in one piece.
                let touched = unsafe { shared.states.solve(effect, piece, part.reborrow(), &pass) };
                shared.touch(touched);
                if let Some(rows) = &mut rows {
                    rows.load(&part, true, instructions);
                }
            }
            Task::Keep { .. } => match rows.as_mut().filter(|_| is_loaded) {
                Some(rows) => rows.keep(),
                None => {
                    // SAFETY: the caller's promise.
                    let before = unsafe { shared.before(piece) };
                    before.copy_from_slice(part.displacements);
                }
            },
            Task::Sum { .. } => {
                // SAFETY: the caller's promise.
                let (before, sum) = unsafe { (shared.before(piece), shared.moments(piece)) };
                let origin = shared.origin;
                if let Some(sum) = sum {
                    *sum = match rows.filter(|_| is_loaded) {
                        Some(rows) => rows.moments(origin, instructions),
                        None => {
                            let at = (origin, self.strips());
                            moments(&part, before, at, first, instructions)
                        }
                    };
                }
            }
            Task::FindTurn { .. } => {
                // SAFETY: the whole body is one piece.
                let ((sums, turn), parts) = unsafe { (shared.turning(), shared.parts()) };
                if parts.is_empty() {
                    *turn = spin::turn_back(sums, shared.origin);
                } else {
                    // SAFETY: as above.
                    let at = (&*unsafe { shared.before(piece) }, shared.origin);
                    spin::turn_parts_back(parts, self.topology, part, at);
                }
            }
            Task::TurnBack { .. } => {
                // SAFETY: it was found in the phase before.
                let turn = unsafe { shared.turn() };
                match rows.as_mut().filter(|_| is_loaded) {
                    _ if turn.is_none() => {}
                    Some(rows) => rows.turn(&turn, instructions),
                    None => turn.act(part),
                }
            }
            Task::Direct { substep, iteration } => {
                // SAFETY: the whole body is one piece.
                let (direct, lambdas) = unsafe { (shared.direct(), shared.all_multipliers()) };
                direct.solve(Iteration {
                    topology: self.topology,
                    effects: self.effects,
                    part,
                    lambdas,
                    h: self.h,
                    gravity: settings.gravity,
                    substep,
                    iteration: (iteration, settings.iterations.get()),
                    is_extrapolated: settings.order.get() > 1,
                    instructions,
                    threads: self.context.threads,
                });
            }
            Task::Average { iteration, .. } => {
                if let Some(averaging) = self.any.averaging(iteration) {
                    // SAFETY: the caller's promise.
                    let sums = unsafe { shared.sums(piece) };
                    stages::average(part, sums, averaging.own_weight);
                }
            }
        }
        Ok(())
    }
}
