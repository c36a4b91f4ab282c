//! Steps copies of a body side by side: one per lane where constraints are solved and, if nothing else
//! acts but ground and colliders, where a substep ends and the next begins; one after the other in all
//! other tasks. Results are
//! those of each body alone, bit by bit.

#![allow(unsafe_code, reason = "tasks borrow the bodies as pieces")]

use super::{
    advance::{Acting, Friction, NotFinite, StepContext, Stepper, TaskContext, tasks},
    kernels::CopiesPass,
    phases::{Phase, Phases, Task},
    shared_body::SharedBody,
    spin,
    strips::has_several_substeps,
};
use crate::{
    BodyEffectKind, Effects, ElasticKind, Outside, Settings, Stitches, Topology,
    effects::{
        free::Free,
        workspace::{Columns, Workspace},
    },
    kernel::{
        lanes::{Instructions, MAX_WIDTH, WIDTH},
        moments::Turn,
    },
    particles::Part,
    partitions::Piece,
};
use glam::Vec3;
use std::{array, mem::take, ops::Range, sync::Arc};

/// What decides whether a body is a copy of another.
#[derive(Debug, Clone, Copy)]
pub struct Candidate<'a> {
    /// Its topology.
    pub topology: &'a Arc<Topology>,
    /// Its effects.
    pub effects: &'a Effects,
    /// Its stitches.
    pub stitches: Option<&'a Stitches>,
}

impl Candidate<'_> {
    /// Whether the two bodies can be stepped side by side: with nothing between their substeps, and
    /// constraints that are solved one after the other.
    #[must_use]
    pub fn is_copy_of(&self, other: &Self, settings: &Settings) -> bool {
        let any = settings.substep(0);
        let method = settings.method;
        Arc::ptr_eq(self.topology, other.topology)
            && self.topology.partitions.count() == 1
            && [self, other]
                .iter()
                .all(|it| it.stitches.is_none_or(Stitches::is_empty))
            && !settings.begins_each_substep()
            && !self.effects.acts_between_substeps()
            && !self.effects.is_direct(method)
            && method.relaxation() >= 1.0
            && any.averaging(any.total_iterations() - 1).is_none()
            && ElasticKind::ALL
                .into_iter()
                .any(|kind| self.effects.iterates(kind, method))
            && self.effects == other.effects
    }
}

/// Size of the groups in which a number of copies of a body is best stepped on a number of threads, at
/// least one: at most [`MAX_WIDTH`], and 1 for each alone.
#[must_use]
pub fn group_size(
    topology: &Topology,
    copies: usize,
    threads: usize,
    instructions: Instructions,
) -> usize {
    let (copies, threads) = (copies.max(1), threads.max(1));
    let alone = cost_alone(topology, instructions);
    let mut best = (copies.div_ceil(threads) as f32 * alone, 1);
    let widths = [WIDTH, MAX_WIDTH].into_iter();
    for lanes in widths.filter(|&lanes| lanes <= instructions.widest()) {
        // As many groups for each thread, or full ones and a last one.
        let turns = copies.div_ceil(lanes).div_ceil(threads);
        for size in [copies.div_ceil(turns * threads), lanes] {
            let (full, last) = (copies / size, copies % size);
            let mut time = full.div_ceil(threads) as f32 * cost_of_group(topology, size, alone);
            if full % threads == 0 {
                time += cost_of_group(topology, last, alone);
            }
            if size > 1 && time < best.0 {
                best = (time, size);
            }
        }
    }
    best.1
}

/// Time of a tick of a group of this size, in the lanes that are best for it.
fn cost_of_group(topology: &Topology, size: usize, alone: f32) -> f32 {
    cost(topology, lanes_for(size)).min(size as f32 * alone)
}

/// The least number of lanes for a group of this size.
fn lanes_for(size: usize) -> usize {
    if size > WIDTH { MAX_WIDTH } else { WIDTH }
}

/// Time of a tick of one body alone, as a multiple of that with gathers: less in strips. Measured on an
/// AMD EPYC (Zen 5), with AVX-512 and AVX2: 0.46 and 0.68 for a sheet of 441 particles, which fill 0.93 of
/// the lanes, 0.53 and 0.97 for a cube of 729, which fill 0.74.
fn cost_alone(topology: &Topology, instructions: Instructions) -> f32 {
    const WIDE: f32 = 0.41;
    const NARROW: f32 = 0.67;
    let (edges, tetrahedra) = (&topology.edges.elements, &topology.tetrahedra.elements);
    let patterns = edges.pattern_count() + tetrahedra.pattern_count();
    if patterns == 0 {
        return 1.0;
    }
    let constraints = edges.corners().len() + tetrahedra.corners().len();
    let fill = constraints as f32 / (MAX_WIDTH * patterns) as f32;
    let full = match instructions.widest() {
        MAX_WIDTH => WIDE,
        _ if instructions.expands() => NARROW,
        _ => 1.0,
    };
    (full / fill).min(1.0)
}

/// Time of a tick of copies side by side, whether all lanes have one or not, as a multiple of that of
/// one alone with gathers. Measured on an AMD EPYC, in eight and sixteen lanes: 3.9 and 5.6 for a bunny of 332
/// particles, 3.0 and 4.4 for a cube of 125, 1.4 and 2.0 for one of 27, whose colors do not fill the
/// lanes when it is alone, 4.1 and 6.4 for a sheet of 441.
fn cost(topology: &Topology, lanes: usize) -> f32 {
    const FULL: f32 = 3.7;
    const OTHER: f32 = 0.6;
    const WIDE: f32 = 1.4;
    let (edges, tetrahedra) = (&topology.edges.elements, &topology.tetrahedra.elements);
    let constraints = edges.corners().len() + tetrahedra.corners().len();
    let alone = WIDTH * (edges.blocks() + tetrahedra.blocks());
    let cost = OTHER + FULL * constraints as f32 / alone.max(1) as f32;
    if lanes > WIDTH { cost * WIDE } else { cost }
}

/// Performs some substeps of a tick for up to [`MAX_WIDTH`] bodies, each of which is [a
/// copy](Candidate::is_copy_of) of the one before. All must have been [prepared](Stepper::prepare) in
/// the same way. Those beyond are not stepped. More than [`WIDTH`] are stepped side by side only where
/// the instruction set has as many lanes.
pub fn advance<'a>(
    bodies: impl Iterator<Item = Stepper<'a>>,
    substeps: &Range<u32>,
    context: &StepContext,
) -> [Result<(), NotFinite>; MAX_WIDTH] {
    let mut results = [Ok(()); MAX_WIDTH];
    // The bodies that take part are in the first lanes.
    let mut together: [Option<Stepper>; MAX_WIDTH] = [const { None }; MAX_WIDTH];
    let mut numbers = [0; MAX_WIDTH];
    let mut count = 0;
    for (number, mut body) in bodies.take(MAX_WIDTH).enumerate() {
        let first = together[0].as_ref();
        let starts = body.start(substeps, context);
        let fits = first.is_none_or(|first| first.free() == body.free());
        if starts && !fits {
            results[number] = body.advance_together(substeps.clone(), context);
        } else if starts {
            together[count] = Some(body);
            numbers[count] = number;
            count += 1;
        } else {
            results[number] = body.advance_one_by_one(substeps.clone(), context);
        }
    }
    let lanes = lanes_for(count);
    let first = together[0].as_ref();
    let pays = first.is_some_and(|body| {
        let alone = cost_alone(body.topology, context.instructions);
        cost(body.topology, lanes) < count as f32 * alone
    });
    let mut done = [Ok(()); MAX_WIDTH];
    if pays && lanes <= context.instructions.widest() {
        advance_lanes(&mut together, &mut done, lanes, substeps, context);
    } else {
        for (body, result) in together.iter_mut().flatten().zip(&mut done) {
            *result = body.advance_together(substeps.clone(), context);
        }
    }
    for (number, result) in numbers.into_iter().zip(done).take(count) {
        results[number] = result;
    }
    results
}

/// Performs substeps in which nothing happens between substeps, for bodies that fit into the first
/// `lanes` places.
fn advance_lanes(
    bodies: &mut [Option<Stepper>; MAX_WIDTH],
    results: &mut [Result<(), NotFinite>; MAX_WIDTH],
    lanes: usize,
    substeps: &Range<u32>,
    context: &StepContext,
) {
    for body in bodies.iter_mut().flatten() {
        body.prepare_together(substeps, context.settings);
    }
    // Groups change: the largest workspace is kept.
    let all = bodies.iter_mut().flatten();
    let workspaces = all.map(|body| take(&mut body.states.workspace));
    let largest = workspaces.max_by_key(Workspace::bytes);
    let mut workspace = largest.unwrap_or_default();
    let columns = workspace.columns();
    let Some(first) = bodies.iter_mut().flatten().next() else {
        return;
    };
    let (shape, effects) = (Arc::clone(first.topology), first.effects);
    let free = first.free();
    for (copied, own) in columns.multipliers.iter_mut().zip(first.states.columns()) {
        copied.resize(own.len() * lanes, 0.0);
    }
    // Nothing is kept of a single pass over contacts.
    let passes = context.settings.substep(0).contact_passes();
    let are_recorded = bodies.iter().flatten().any(|it| it.states.records_contacts);
    let is_kept = passes > 1 || are_recorded;
    let contexts = bodies.each_ref().map(|body| {
        let body = body.as_ref()?;
        Some(TaskContext::new(&shape, body, Friction::Included, context))
    });
    let shared = bodies
        .each_mut()
        .map(|body| body.as_mut().map(|body| SharedBody::new(body, false)));
    let acting = Acting::of(effects, Outside::default(), context.settings, free);
    let tasks = tasks(&shape, acting, substeps, context);
    let others_act = |(task, _)| match task {
        Task::Force { kind, .. } => !effects.pushes_in_lanes(kind),
        Task::Elastic { .. } | Task::Begin | Task::EndAndBegin { .. } | Task::End { .. } => false,
        Task::Keep { .. } | Task::Sum { .. } | Task::TurnBack { .. } => false,
        Task::FindTurn { .. } => free == Free::Parts,
        Task::Body { kind, .. } => is_kept || !kind.is_in_lanes(),
        _ => true,
    };
    let stays = has_several_substeps(tasks.clone()) && !tasks.clone().any(others_act);
    let mut work = Lanes {
        count: lanes,
        contexts: &contexts,
        shared: &shared,
        results: &mut *results,
        columns,
        stored: [false; ElasticKind::COUNT],
        are_loaded: false,
        have_moved: false,
        turns: [Turn::default(); MAX_WIDTH],
        stays,
        context,
    };
    for phase in Phases::new(tasks, &shape.partitions) {
        for &task in phase.tasks() {
            work.act(task, &phase);
        }
    }
    work.store(&shape.partitions.whole()[0]);
    work.store_multipliers();
    let found = shared.map(|shared| shared.map(|it| (it.touched(), it.longest())));
    for ((body, result), found) in bodies.iter_mut().zip(results).zip(found) {
        let (Some(body), Some((touched, longest))) = (body, found) else {
            continue;
        };
        if touched {
            body.touch();
        }
        body.set_longest(longest);
        if result.is_err() {
            body.states.clear_solutions();
        }
    }
    if let Some(first) = bodies.iter_mut().flatten().next() {
        first.states.workspace = workspace;
    }
}

/// Bodies with what their tasks need; a lane is empty where there is none, or one that does not take
/// part.
struct Lanes<'a, 'b> {
    /// Number of lanes.
    count: usize,
    contexts: &'a [Option<TaskContext<'b>>; MAX_WIDTH],
    shared: &'a [Option<SharedBody<'b>>; MAX_WIDTH],
    results: &'a mut [Result<(), NotFinite>; MAX_WIDTH],
    columns: &'a mut Columns,
    /// The effects whose multipliers were stored.
    stored: [bool; ElasticKind::COUNT],
    /// Whether the copies have the displacements of the bodies; those of the bodies are then out of
    /// date.
    are_loaded: bool,
    /// Whether they also have positions and carries that the bodies do not have.
    have_moved: bool,
    /// The rotation that takes back that of the last internal constraints.
    turns: [Turn; MAX_WIDTH],
    /// Whether nothing acts on the bodies but what may act in lanes.
    stays: bool,
    context: &'a StepContext<'a>,
}

impl Lanes<'_, '_> {
    /// Performs a task on all bodies that have not failed.
    fn act(&mut self, task: Task, phase: &Phase) {
        let Some(watch) = self.context.watch else {
            return self.task(task, phase);
        };
        watch.observe(task.stage(), &mut || self.task(task, phase));
    }

    fn task(&mut self, task: Task, phase: &Phase) {
        if let Task::Elastic { kind, pass } = task {
            return self.solve(kind, pass, phase);
        }
        if self.stays && self.are_loaded && self.around(task, &phase.pieces[0]) {
            return;
        }
        if let Task::Body {
            kind,
            substep,
            iteration,
        } = task
            && self.stays
            && self.solve_body(kind, (substep, iteration), &phase.pieces[0])
        {
            return;
        }
        if self.stays && self.turn(task, &phase.pieces[0]) {
            return;
        }
        self.store(&phase.pieces[0]);
        let bodies = self.contexts.iter().zip(self.shared);
        for ((context, shared), result) in bodies.zip(&mut *self.results) {
            if let (Some(context), Some(shared), Ok(())) = (context, shared, &result) {
                let piece = &phase.pieces[0];
                // SAFETY: the bodies are borrowed, and this thread has them alone.
                *result = unsafe { context.task(task, shared, phase, piece, shared.part(piece)) };
            }
        }
    }

    /// Solves the constraints of an effect in lanes.
    fn solve(&mut self, kind: ElasticKind, pass: (u32, u32, bool), phase: &Phase) {
        let Some(context) = self.contexts.iter().flatten().next() else {
            return;
        };
        let piece = &phase.pieces[0];
        self.load(piece, context.kernels.are_damped());
        if !self.are_loaded {
            return;
        }
        let (_, count, is_last) = pass;
        self.stored[kind as usize] |= count > 1 || is_last;
        let work = CopiesPass {
            piece,
            whole: phase.is_whole(),
            copies: &mut self.columns.copies,
            multipliers: &mut self.columns.multipliers[kind as usize],
            pass,
            instructions: self.context.instructions,
        };
        context.kernels.solve_copies(kind, work);
    }

    /// Keeps the angular momentum of the copies in lanes; returns whether the task was one for that.
    fn turn(&mut self, task: Task, piece: &Piece) -> bool {
        match task {
            Task::Keep { .. } => {
                self.load(piece, true);
                self.columns.copies.keep();
            }
            Task::Sum { .. } => {
                let origins = self.shared.each_ref();
                let origins = origins.map(|it| it.as_ref().map_or(Vec3::ZERO, |it| it.origin));
                let strips = self.contexts.iter().flatten().next();
                let strips = strips.and_then(TaskContext::strips);
                let instructions = self.context.instructions;
                let sums = self.columns.copies.moments(&origins, strips, instructions);
                let bodies = origins.iter().zip(&sums).zip(&mut self.turns);
                for (((origin, sum), turn), shared) in bodies.zip(self.shared) {
                    if shared.is_some() {
                        *turn = spin::turn_back(std::slice::from_ref(sum), *origin);
                    }
                }
            }
            Task::FindTurn { .. } => {}
            Task::TurnBack { .. } => {
                let instructions = self.context.instructions;
                self.columns.copies.turn(&self.turns, instructions);
            }
            _ => return false,
        }
        true
    }

    /// Performs a task around the constraints of a substep in lanes: its end, if the copies are finite, its
    /// beginning, or a force. Returns whether it has done so.
    fn around(&mut self, task: Task, piece: &Piece) -> bool {
        let Some(context) = self.contexts.iter().flatten().next() else {
            return false;
        };
        let copies = &mut self.columns.copies;
        match task {
            Task::End { .. } => return self.end(piece, false),
            Task::EndAndBegin { .. } => return self.end(piece, true),
            Task::Begin => context.begin(copies),
            Task::Force { kind, substep } => context.push_in_lanes(kind, substep, copies),
            _ => return false,
        }
        self.have_moved = true;
        if matches!(task, Task::Begin) {
            self.begin_states(piece);
        }
        true
    }

    /// Begins a substep of the states of effects without elements.
    fn begin_states(&self, piece: &Piece) {
        for (shared, result) in self.shared.iter().zip(&*self.results) {
            if let (Some(shared), Ok(())) = (shared, result) {
                // SAFETY: the bodies are borrowed, and this thread has them alone.
                unsafe { shared.states.begin(&piece.particles) };
            }
        }
    }

    /// Ends a substep in lanes, if the copies are finite, and begins the next one if one follows in the same
    /// pass; returns whether it has done so.
    fn end(&mut self, piece: &Piece, begins: bool) -> bool {
        let Some(context) = self.contexts.iter().flatten().next() else {
            return false;
        };
        let is_measured = self.shared.iter().flatten().any(SharedBody::is_measured);
        let longest = is_measured.then(|| self.columns.copies.longest(self.context.instructions));
        if !context.end(&mut self.columns.copies, begins) {
            return false;
        }
        self.have_moved = true;
        for (lane, (shared, result)) in self.shared.iter().zip(&*self.results).enumerate() {
            if let (Some(shared), Ok(()), Some(longest)) = (shared, result, longest) {
                shared.measure(longest[lane]);
            }
        }
        if begins {
            self.begin_states(piece);
        }
        true
    }

    /// Performs a pass of an effect without elements in lanes, if the copies are loaded and need not
    /// leave the lanes for it; returns whether it has done so.
    fn solve_body(&mut self, kind: BodyEffectKind, pass: (u32, u32), piece: &Piece) -> bool {
        let mut bodies = self.contexts.iter().zip(self.shared);
        let Some((Some(context), Some(first))) = bodies.find(|(context, _)| context.is_some())
        else {
            return false;
        };
        if !self.are_loaded {
            return false;
        }
        let copies = &mut self.columns.copies;
        // SAFETY: the bodies are borrowed, and this thread has them alone.
        let done = unsafe { context.solve_in_lanes(kind, pass, (first, piece), copies) };
        let Some(lanes) = done else {
            return false;
        };
        // Carries may have changed.
        self.have_moved |= lanes != 0;
        for (lane, (shared, result)) in self.shared.iter().zip(&*self.results).enumerate() {
            if let (Some(shared), Ok(())) = (shared, result) {
                shared.touch(lanes >> lane & 1 != 0);
            }
        }
        true
    }

    /// Gives the bodies that have not failed their multipliers.
    fn store_multipliers(&mut self) {
        for (lane, shared) in self.shared.iter().enumerate() {
            let Some(shared) = shared.as_ref().filter(|_| self.results[lane].is_ok()) else {
                continue;
            };
            // SAFETY: the bodies are borrowed, and this thread has them alone.
            let columns = unsafe { shared.all_multipliers() };
            let copied = columns.into_iter().zip(&self.columns.multipliers);
            for ((column, copied), stored) in copied.zip(self.stored) {
                if stored {
                    for (own, copied) in column.iter_mut().zip(copied.chunks_exact(self.count)) {
                        *own = copied[lane];
                    }
                }
            }
        }
    }

    /// Particles of the bodies that have not failed.
    ///
    /// # Safety
    /// During the lifetime of the parts, no other parts are requested.
    unsafe fn parts(&self, piece: &Piece) -> [Option<Part<'_>>; MAX_WIDTH] {
        array::from_fn(|lane| {
            let shared = self.shared[lane].as_ref()?;
            // SAFETY: the caller's promise.
            self.results[lane]
                .ok()
                .map(|()| unsafe { shared.part(piece) })
        })
    }

    fn load(&mut self, piece: &Piece, damped: bool) {
        if !self.are_loaded {
            let mut copies = take(&mut self.columns.copies);
            // SAFETY: the parts are dropped before others are requested.
            let parts = unsafe { self.parts(piece) };
            if parts.iter().any(Option::is_some) {
                let carried = damped || self.stays;
                copies.load(&parts, self.count, carried, self.context.instructions);
                self.are_loaded = true;
            }
            self.columns.copies = copies;
        }
    }

    fn store(&mut self, piece: &Piece) {
        if take(&mut self.are_loaded) {
            let moved = take(&mut self.have_moved);
            // SAFETY: the parts are dropped before others are requested.
            let mut parts = unsafe { self.parts(piece) };
            let copies = &self.columns.copies;
            copies.store(&mut parts, moved, self.context.instructions);
        }
    }
}
