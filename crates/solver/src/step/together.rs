//! Steps bodies that can touch: substep by substep together, so that contacts act between them.
//!
//! ```text
//! for each substep
//!   contacts: what is near
//!   every body: forces, first stage
//!   for each iteration
//!     every body: its constraints
//!     stitches between bodies
//!     every body: grabs and rods
//!     contacts between bodies, contacts of bodies with themselves; every body: ground, colliders
//!   contacts: cut motion that would cross
//!   every body: last stage
//!   contacts: bounce
//! ```
//!
//! A body without contact goes through the same operations as one that is stepped by itself: the
//! results are bitwise equal.

use super::{
    advance::{NotFinite, Stage, StepContext, Stepper},
    apart::{self, Apart},
    joints::{self, Joined},
    stage::Solve,
};
use crate::{
    Contacts, Effects, ForceKind, Stitches, Substep, Threads, Topology, WorkEstimate,
    contact::{Between, ContactPart, Tangible},
    effects::body_kinds::BodyEffectKind,
    ledger::{Cause, EnergyTracker, Ledger},
    measure,
    particles::surface_force::Push,
};
use glam::DVec3;
use std::ops::Range;

/// A body of a group that is stepped together.
#[derive(Debug)]
pub struct GroupedBody<'a> {
    /// The body.
    pub body: Stepper<'a>,
    /// Number of the body among those of the world, from 0.
    pub number: u32,
    /// Whether it is stepped; a sleeping one is only an obstacle.
    pub is_stepped: bool,
    /// Energy ledger of the substeps, empty unless it is tracked, or the failure.
    pub result: Result<Ledger, NotFinite>,
    tracker: Option<Box<EnergyTracker>>,
    /// Whether another surface is near in the current substep, or a stitch joins it to another body.
    is_near: bool,
    /// Whether no other body and no collider that is a mesh comes near it in the substeps under way.
    pub(super) is_apart: bool,
}

impl<'a> GroupedBody<'a> {
    /// For the body with this number, which is stepped or not.
    #[must_use]
    pub fn new(number: u32, body: Stepper<'a>, is_stepped: bool) -> Self {
        Self {
            body,
            number,
            is_stepped,
            result: Ok(Ledger::default()),
            tracker: None,
            is_near: false,
            is_apart: false,
        }
    }

    fn is_active(&self) -> bool {
        self.is_stepped && self.result.is_ok() && !self.is_alone()
    }

    /// Whether it is stepped by itself: nothing comes near it, also not its own surface.
    pub(super) fn is_alone(&self) -> bool {
        self.is_apart && self.body.effects.self_contact.is_none()
    }

    /// Performs a part of a substep, unless it is not stepped or has failed.
    fn work(
        &mut self,
        work: impl FnOnce(&mut Stepper, Option<&mut EnergyTracker>) -> Result<(), NotFinite>,
    ) {
        if self.is_active()
            && let Err(error) = work(&mut self.body, self.tracker.as_deref_mut())
        {
            self.result = Err(error);
        }
    }
}

impl Tangible for GroupedBody<'_> {
    fn topology(&self) -> &Topology {
        self.body.topology
    }

    fn effects(&self) -> &Effects {
        self.body.effects
    }

    fn number(&self) -> u32 {
        self.number
    }

    fn stitches(&self) -> &Stitches {
        self.body.stitches
    }

    fn stitches_mut(&mut self) -> &mut Stitches {
        self.body.stitches
    }

    fn takes_part(&self) -> bool {
        self.result.is_ok()
    }

    fn is_stepped(&self) -> bool {
        self.is_stepped
    }

    fn is_apart(&self) -> bool {
        self.is_apart
    }

    fn inverse_mass(&self, i: usize) -> f64 {
        self.body.particles.positions[i].w.into()
    }

    fn start(&self, i: usize) -> DVec3 {
        self.body.particles.position(i)
    }

    fn now(&self, i: usize) -> DVec3 {
        self.body.particles.predicted(i)
    }

    fn motion(&self, i: usize) -> DVec3 {
        self.body.particles.motion(i)
    }

    fn shift(&mut self, i: usize, by: DVec3) {
        let u = &mut self.body.particles.displacements[i];
        *u = (u.truncate().as_dvec3() + by).as_vec3().extend(0.0);
    }

    fn is_repaired(&self) -> bool {
        !self.body.particles.repair.is_empty()
    }

    fn began(&self, i: usize) -> DVec3 {
        self.body.particles.position(i)
    }

    fn shift_start(&mut self, i: usize, by: DVec3) {
        let c = &mut self.body.particles.carry[i];
        *c = (c.truncate().as_dvec3() + by).as_vec3().extend(0.0);
    }

    fn accelerate(&mut self, i: usize, by: DVec3) {
        let h = f64::from(self.body.particles.substep_seconds());
        self.body.particles.accelerate(i, by / h);
    }

    fn touch(&mut self) {
        self.body.touch();
    }

    fn records_contacts(&self) -> bool {
        self.is_active() && self.body.states.records_contacts
    }

    fn record(&mut self, particle: usize, push: Push) {
        if let Some(pushes) = self.body.states.recorded.pushes().get_mut(particle) {
            pushes.add(push);
        }
    }
}

/// Whether bodies must be stepped together, given their effects and whether they are stepped: two
/// with contact between bodies, one with self-contact, a rigid one, one that collides in a world
/// where a collider is a mesh, or those that stitches join.
#[must_use]
pub fn must_step_together<'a>(
    bodies: impl Iterator<Item = (&'a Effects, bool)>,
    joined: &Joined,
    has_meshes: bool,
) -> bool {
    let mut is_any_active = false;
    let (mut others, mut is_any_stepped) = (0, false);
    let (mut touches_itself, mut touches_meshes, mut is_any_rigid) = (false, false, false);
    for (effects, is_stepped) in bodies {
        is_any_active |= is_stepped;
        others += usize::from(effects.contact.is_some());
        is_any_stepped |= is_stepped && effects.can_touch();
        touches_itself |= is_stepped && effects.self_contact.is_some();
        is_any_rigid |= is_stepped && effects.is_rigid();
        touches_meshes |= is_stepped && has_meshes && effects.collide.is_some();
    }
    is_any_stepped && (others > 1 || touches_itself)
        || touches_meshes
        || is_any_rigid
        || is_any_active && !joined.is_empty()
}

/// Performs some substeps of a tick. A failed body keeps its state, and the others continue without
/// it. Tracks energy if `tracked`. Bodies that nothing comes near are stepped as without contact.
pub fn advance(
    bodies: &mut [GroupedBody],
    contacts: &mut Contacts,
    substeps: Range<u32>,
    tracked: bool,
    context: &StepContext,
) {
    if let Some(found) = Apart::find(bodies, &substeps, context) {
        let memory = contacts.memory();
        apart::advance(bodies, &substeps, tracked, context);
        if bodies.iter().any(GroupedBody::is_active) {
            advance_grouped(bodies, contacts, substeps.clone(), tracked, context);
        } else {
            contacts.rest();
        }
        let count = found.check(bodies, &substeps, context);
        contacts.count_apart(count);
        if count.is_some() {
            return;
        }
        contacts.return_to(memory);
    } else {
        contacts.count_apart(Some(0));
    }
    advance_grouped(bodies, contacts, substeps, tracked, context);
}

/// Performs some substeps of a tick, of all bodies but those that nothing comes near.
fn advance_grouped(
    bodies: &mut [GroupedBody],
    contacts: &mut Contacts,
    substeps: Range<u32>,
    tracked: bool,
    context: &StepContext,
) {
    if tracked {
        each(bodies, context, |it, context| {
            it.tracker = Some(Box::new(EnergyTracker::of(&mut it.body, context)));
        });
    }
    for index in substeps {
        let step = context.settings.substep(index);
        predict(bodies, contacts, &step, context);
        for iteration in 0..step.total_iterations() {
            if has_joints(bodies) {
                each(bodies, context, |it, context| {
                    iterate(
                        it,
                        |stage| !stage.is_after_joints(),
                        &step,
                        iteration,
                        context,
                    );
                });
                solve_joints(bodies, &step, iteration, context);
                each(bodies, context, |it, context| {
                    iterate(it, Stage::is_after_joints, &step, iteration, context);
                });
            } else {
                each(bodies, context, |it, context| {
                    iterate(it, |_| true, &step, iteration, context);
                });
            }
            for _ in 0..step.contacts_after(iteration) {
                solve(bodies, contacts, Stage::Contact, context);
                solve(bodies, contacts, Stage::SelfContact, context);
                each(bodies, context, |it, context| {
                    solve_ground_and_colliders(it, &step, iteration, context);
                });
                solve(bodies, contacts, COLLIDE, context);
            }
        }
        finish(bodies, contacts, &step, context);
    }
}

/// Begins a substep separately, as [`advance`] does: finds near candidates, and performs the steps
/// before forces.
pub fn begin(
    bodies: &mut [GroupedBody],
    contacts: &mut Contacts,
    step: &Substep,
    context: &StepContext,
) {
    find_near(bodies, contacts, step, context);
    each(bodies, context, |it, context| {
        it.body.begin_repair(step, context);
        it.body.begin_after_repair(step, context, it.is_near);
    });
}

/// Everything up to the first iteration.
fn predict(
    bodies: &mut [GroupedBody],
    contacts: &mut Contacts,
    step: &Substep,
    context: &StepContext,
) {
    find_near(bodies, contacts, step, context);
    each(bodies, context, |it, context| {
        let is_near = it.is_near;
        it.work(|body, tracker| {
            if let Some(tracker) = tracker {
                tracker.draw(body, step, context);
                return tracker.predict(body, step, context, is_near);
            }
            body.begin_repair(step, context);
            body.begin_after_repair(step, context, is_near);
            let forces = ForceKind::ALL.map(|kind| (Stage::Force(kind), 0));
            let first = std::iter::once(Stage::Presolve).chain(Stage::prediction());
            let stages = std::iter::once((Stage::External, 0)).chain(forces);
            let stages = stages.chain(first.map(|stage| (stage, 0)));
            body.stages(stages, step, context)
        });
    });
}

/// Steps after the last iteration.
fn finish(
    bodies: &mut [GroupedBody],
    contacts: &mut Contacts,
    step: &Substep,
    context: &StepContext,
) {
    truncate(bodies, contacts, step, context);
    if bodies.iter().any(|it| it.tracker.is_some()) {
        for part in ContactPart::OF_PASSES {
            let displacements: Vec<_> = contacts.part(part, bodies).collect();
            for (body, particle, displacement) in displacements {
                if let Some(tracker) = &mut bodies[body].tracker {
                    tracker.credit_part(part, particle, displacement);
                }
            }
        }
    }
    each(bodies, context, |it, context| {
        let mut gained = Ledger::default();
        it.work(|body, tracker| {
            if let Some(tracker) = tracker {
                gained += tracker.finish(body, step, context)?;
                gained.plastic += tracker.flow(body, step, context)?;
                return Ok(());
            }
            body.stages(std::iter::once((Stage::Postsolve, 0)), step, context)?;
            body.end();
            body.flow(step, context);
            Ok(())
        });
        if let Ok(ledger) = &mut it.result {
            *ledger += gained;
        }
    });
    kinetic_change(
        bodies,
        |bodies| contacts.return_momentum(bodies),
        |ledger| &mut ledger.truncation,
    );
    kinetic_change(
        bodies,
        |bodies| contacts.drop_lift(bodies),
        |ledger| &mut ledger.recovery,
    );
    kinetic_change(
        bodies,
        |bodies| contacts.end(bodies, step),
        |ledger| &mut ledger.contact,
    );
}

/// Changes velocities, and adds the change of kinetic energy of tracked bodies to a row.
fn kinetic_change(
    bodies: &mut [GroupedBody],
    change: impl FnOnce(&mut [GroupedBody]),
    row: impl Fn(&mut Ledger) -> &mut f64,
) {
    let kinetic = |it: &GroupedBody| match it.tracker {
        Some(_) => measure::kinetic_energy(it.body.particles),
        None => 0.0,
    };
    let before: Vec<f64> = match bodies.iter().any(|it| it.tracker.is_some()) {
        true => bodies.iter().map(kinetic).collect(),
        false => Vec::new(),
    };
    change(bodies);
    for (it, before) in bodies.iter_mut().zip(before) {
        let gained = kinetic(it) - before;
        if let Ok(ledger) = &mut it.result {
            *row(ledger) += gained;
        }
    }
}

/// The constraints of an iteration in the stages that are `wanted`.
fn iterate(
    it: &mut GroupedBody,
    wanted: fn(Stage) -> bool,
    step: &Substep,
    iteration: u32,
    context: &StepContext,
) {
    it.work(|body, tracker| {
        let solve = Solve::of(body.effects, body.outside(), step.method);
        let all = solve.constraints(step.direction(iteration));
        let mut stages = all.filter(move |stage| wanted(*stage));
        if let Some(tracker) = tracker {
            return stages
                .try_for_each(|stage| tracker.stage(body, stage, step, iteration, context));
        }
        body.stages(stages.map(|stage| (stage, iteration)), step, context)
    });
}

/// Whether an intact stitch leads to another body.
fn has_joints(bodies: &[GroupedBody]) -> bool {
    let joins = |it: &GroupedBody| it.stitches().intact_joints().next().is_some();
    bodies.iter().any(joins)
}

/// Ground and collider passes after an iteration.
fn solve_ground_and_colliders(
    it: &mut GroupedBody,
    step: &Substep,
    iteration: u32,
    context: &StepContext,
) {
    it.work(|body, tracker| {
        let solve = Solve::of(body.effects, body.outside(), step.method);
        if let Some(tracker) = tracker {
            let mut stages = solve.contacts();
            return stages
                .try_for_each(|stage| tracker.stage(body, stage, step, iteration, context));
        }
        body.stages(
            solve.contacts().map(|stage| (stage, iteration)),
            step,
            context,
        )
    });
}

/// Finds near candidates, before anything moves: repair moves particles too.
fn find_near(
    bodies: &mut [GroupedBody],
    contacts: &mut Contacts,
    step: &Substep,
    context: &StepContext,
) {
    timed(context, Stage::Contact, || {
        contacts.begin(bodies, context.swept.of(step.index), step, context.threads)
    });
    if context.settings.order.get() > 1 {
        let all = bodies.iter();
        let joined = Joined::of(all.map(|it| (it.number, it.stitches())), usize::MAX);
        for (place, it) in bodies.iter_mut().enumerate() {
            it.is_near = contacts.is_near(place) || joined.contains(it.number);
        }
    }
}

/// A pass over the stitches between bodies.
pub fn solve_joints(
    bodies: &mut [GroupedBody],
    step: &Substep,
    iteration: u32,
    context: &StepContext,
) {
    timed(context, STITCHES, || joints::solve(bodies, step, iteration));
    credit(bodies, Cause::Elastic);
}

/// Stage of stitches.
pub const STITCHES: Stage = Stage::Body(BodyEffectKind::Stitches);

/// Stage of contacts with colliders.
pub const COLLIDE: Stage = Stage::Body(BodyEffectKind::Collide);

/// A pass over contacts of one kind: [`Stage::Contact`], [`Stage::SelfContact`], or [`COLLIDE`] for
/// colliders that are meshes.
pub fn solve(
    bodies: &mut [GroupedBody],
    contacts: &mut Contacts,
    stage: Stage,
    context: &StepContext,
) {
    let between = match stage {
        Stage::SelfContact => Between::Itself,
        COLLIDE => Between::Colliders,
        _ => Between::Bodies,
    };
    if between == Between::Bodies {
        timed(context, stage, || contacts.separate(bodies));
        credit(bodies, Cause::Recovery);
    }
    timed(context, stage, || contacts.solve(bodies, between));
    credit(bodies, Cause::Contact);
}

/// Separates rigid bodies from what is too close, and truncates motion that would let surfaces cross, before the
/// last stage.
pub fn truncate(
    bodies: &mut [GroupedBody],
    contacts: &mut Contacts,
    step: &Substep,
    context: &StepContext,
) {
    timed(context, Stage::Contact, || contacts.lift(bodies));
    credit(bodies, Cause::Recovery);
    timed(context, Stage::Contact, || {
        contacts.truncate(bodies, step, context.threads)
    });
    credit(bodies, Cause::Truncation);
}

/// Ends a substep, after the last stage: returns the momentum that truncation has taken, and applies
/// restitution.
pub fn end(bodies: &mut [GroupedBody], contacts: &mut Contacts, step: &Substep) {
    contacts.return_momentum(bodies);
    contacts.drop_lift(bodies);
    contacts.end(bodies, step);
}

fn credit(bodies: &mut [GroupedBody], cause: Cause) {
    for it in bodies {
        if let Some(tracker) = &mut it.tracker {
            tracker.credit(it.body.particles, cause);
        }
    }
}

fn timed(context: &StepContext, stage: Stage, mut work: impl FnMut()) {
    match context.watch {
        Some(watch) => watch.observe(stage, &mut work),
        None => work(),
    }
}

/// Performs a part of a substep for every body that is stepped, on all threads.
pub fn each(
    bodies: &mut [GroupedBody],
    context: &StepContext,
    work: impl Fn(&mut GroupedBody, &StepContext) + Sync,
) {
    let estimate = |it: &GroupedBody| match it.is_active() {
        true => it.body.direct.load(it.body.effects, it.body.topology, 1),
        false => WorkEstimate::default(),
    };
    context.threads.for_each(
        bodies,
        estimate,
        &|it: &mut GroupedBody, threads: &Threads| {
            if it.is_active() {
                work(
                    it,
                    &StepContext {
                        threads,
                        ..*context
                    },
                );
            }
        },
    );
}
