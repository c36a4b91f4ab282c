//! The energy ledger: sources and sinks of the energy of a body, substep by substep.
//!
//! In a substep a particle's velocity changes from v₀ to v₁ by contributions that each have a
//! cause: Δv = hg + Σ Δ(x − p)/h, summed over all parts of the second stage that moved it. With the
//! mean v̄ = (v₀ + v₁)/2 the contributions to its kinetic energy add up without remainder,
//!
//! ½m(v₁² − v₀²) = Σ m Δvₛ·v̄,
//!
//! so the work of contact, friction, truncation, recovery and grabs is known exactly. The work of gravity and of the
//! elastic effects is compared with their stored energies; the remainder is split into
//!
//! - **damping**: −(τ/α) ΔC²/h, the dissipation of a dashpot with the given τ at the rate of change
//!   ΔC/h, and the velocity that particles lose by the setting of a [`Method`](crate::Method);
//! - **integrator**: −½ Σ m (hg + Δvₑ)·Δv − ½ Σ ΔC²/α, with Δvₑ the contribution of the elastic
//!   effects. It is the dissipation of fully converged implicit Euler: forces at the end of the
//!   substep work over its whole displacement;
//! - **convergence**: the remainder, which more iterations and shorter substeps reduce. It is the
//!   residual of the constraint equations, and the curvature of C within a substep.
//!
//! A second-order substep has one more contribution to Δv, the change of v at its start by the last
//! two states. It belongs to the integrator.
//!
//! Energy from [repair](crate::repair) of collapsed elements has its own row.
//!
//! Displacements are rounded when constraints move them; the resulting energy is **rounding**,
//! separate from all of these.
//!
//! Rigid effects (α = 0) store no energy; their work belongs to convergence.

use crate::{
    BodyEffectKind, ForceKind, Grabs, Hold, Particles, Substep,
    advance::{Friction, NotFinite, Solve, Stage, StepContext, Stepper},
    contact::ContactPart,
    effects::body_effect::{Store, WorkOf},
    elastic::{Elastic, Visit},
    measure::{gravitational_energy, kinetic_energy, rotational_energy},
};
use glam::{DVec3, Vec4};
use std::ops::{AddAssign, Range};

/// Energy changes of bodies by cause [J]; negative is a loss.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct Ledger {
    /// By damping of the effects.
    pub damping: f64,
    /// By friction and rolling resistance.
    pub friction: f64,
    /// By contact, except friction: loss in impacts, gain from moving colliders.
    pub contact: f64,
    /// By truncation of motion that would let surfaces cross, and by returning its momentum.
    pub truncation: f64,
    /// By the separation of surfaces that overlap or cross.
    pub recovery: f64,
    /// By grabs, and by clamps that turn [rods](crate::Rod).
    pub grab: f64,
    /// By plastic flow.
    pub plastic: f64,
    /// By external forces: wind, drag, and other forces of a scene except gravity.
    pub forces: f64,
    /// By the time integrator.
    pub integrator: f64,
    /// By incomplete convergence of the iterations.
    pub convergence: f64,
    /// By rounding to `f32`.
    pub rounding: f64,
    /// By [repair](crate::repair) of collapsed or inverted elements.
    pub repair: f64,
}

impl Ledger {
    /// The rows with their names, in display order.
    #[must_use]
    pub const fn rows(&self) -> [(&'static str, f64); 12] {
        [
            ("damping", self.damping),
            ("friction", self.friction),
            ("contact", self.contact),
            ("truncation", self.truncation),
            ("recovery", self.recovery),
            ("grab", self.grab),
            ("plastic", self.plastic),
            ("forces", self.forces),
            ("integrator", self.integrator),
            ("convergence", self.convergence),
            ("rounding", self.rounding),
            ("repair", self.repair),
        ]
    }

    /// Sum of all rows [J]: the change of kinetic, potential and elastic energy together.
    #[must_use]
    pub fn sum(&self) -> f64 {
        self.rows().iter().map(|(_, energy)| energy).sum()
    }
}

impl AddAssign for Ledger {
    fn add_assign(&mut self, other: Self) {
        let Self {
            damping,
            friction,
            contact,
            truncation,
            recovery,
            grab,
            plastic,
            forces,
            integrator,
            convergence,
            rounding,
            repair,
        } = other;
        self.damping += damping;
        self.friction += friction;
        self.contact += contact;
        self.truncation += truncation;
        self.recovery += recovery;
        self.grab += grab;
        self.plastic += plastic;
        self.forces += forces;
        self.integrator += integrator;
        self.convergence += convergence;
        self.rounding += rounding;
        self.repair += repair;
    }
}

/// Causes of particle motion in the second stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Cause {
    Elastic,
    Grab,
    Contact,
    Friction,
    Truncation,
    Recovery,
}

/// Number of causes.
const CAUSES: usize = 6;

/// Performs some substeps of a tick with the same bits as [`Stepper::advance`], and records the
/// energy.
///
/// It proceeds stage by stage and inspects every particle after each, which takes about three
/// times as long.
///
/// # Stores
/// As [`Stepper::advance`]; the ledger of earlier substeps is replaced.
pub fn advance(
    body: &mut Stepper,
    substeps: Range<u32>,
    context: &StepContext,
) -> Result<Ledger, NotFinite> {
    let mut ledger = Ledger::default();
    let mut tracker = EnergyTracker::of(body, context);
    for index in substeps {
        let step = context.settings.substep(index);
        ledger += tracker.substep(body, &step, context)?;
        ledger.plastic += tracker.flow(body, &step, context)?;
    }
    Ok(ledger)
}

/// Buffers for one body, reused by every substep.
#[derive(Debug, Default)]
pub(crate) struct EnergyTracker {
    /// Energy change of the body by repair [J].
    drawn: f64,
    /// C of the constraints at the start of the substep.
    stores: Stores,
    /// The state at the start of the substep.
    start: Particles,
    /// Velocities at the beginning of the substep [m/s].
    leapt: Vec<DVec3>,
    /// Velocities after external forces [m/s].
    forced: Vec<DVec3>,
    /// Velocities before rolling resistance [m/s].
    rolled: Vec<DVec3>,
    /// Carry before and after contacts [m].
    carry: [Vec<Vec4>; 2],
    /// Displacements x − p of the particles before the current part [m].
    before: Vec<DVec3>,
    /// Displacements by cause [m].
    causes: [Vec<DVec3>; CAUSES],
    /// The state before a contact, for the same contact without friction.
    smooth: Particles,
}

/// Energy that the effects of a body store at one time.
#[derive(Debug, Default)]
struct Stores(Vec<Store>);

impl Stores {
    fn of(body: &Stepper) -> Self {
        struct Collect<'a>(Vec<Store>, &'a Stepper<'a>);
        impl Visit for Collect<'_> {
            fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
                let damping = f64::from(effect.damping().get());
                let rows = effect.rows_of(self.1.topology, self.1.particles);
                let rows = rows.flat_map(|(_, rows)| rows);
                self.0.extend(rows.map(|row| Store::Spring {
                    error: row.error,
                    compliance: row.compliance,
                    damping,
                }));
            }
        }
        let mut collect = Collect(Vec::new(), body);
        body.effects.visit(&mut collect);
        let Collect(mut all, _) = collect;
        let at = |i: u32| {
            let i = i as usize;
            let w = f64::from(body.particles.positions[i].w);
            (body.particles.position(i), w)
        };
        let states = &body.states.others;
        for &kind in BodyEffectKind::ALL {
            states.stores((body.effects, kind), body.topology, &at, &mut |store| {
                all.push(store);
            });
        }
        Self(all)
    }
}

/// Stored and dissipated energy of the elastic effects of a body in a substep [J].
#[derive(Debug, Clone, Copy, Default)]
struct Stored {
    /// ΔE.
    change: f64,
    /// −½ Σ ΔC²/α.
    integrator: f64,
    /// −Σ (τ/α) ΔC²/h.
    damping: f64,
}

impl Stored {
    fn add(&mut self, before: f64, after: f64, compliance: f64, tau: f64, h: f64) {
        if compliance > 0.0 {
            let change = after - before;
            self.change += 0.5 * change * (after + before) / compliance;
            self.integrator -= 0.5 * change * change / compliance;
            self.damping -= tau * change * change / (compliance * h);
        }
    }

    fn between(before: &Stores, after: &Stores, h: f64) -> Self {
        let mut all = Self::default();
        for both in before.0.iter().zip(&after.0) {
            match both {
                (
                    &Store::Spring { error: before, .. },
                    &Store::Spring {
                        error,
                        compliance,
                        damping,
                    },
                ) => all.add(before, error, compliance, damping, h),
                (
                    &Store::Potential {
                        coordinate: from,
                        energy: before,
                        ..
                    },
                    &Store::Potential {
                        coordinate,
                        energy,
                        force,
                    },
                ) => {
                    all.change += energy - before;
                    // The force at the end over the whole displacement, as −½ΔC²/α.
                    all.integrator += energy - before + force * (coordinate - from);
                }
                _ => {}
            }
        }
        all
    }
}

impl EnergyTracker {
    /// For a body at the start of some substeps.
    pub(crate) fn of(body: &mut Stepper, context: &StepContext) -> Self {
        body.prepare_effects(&context.settings.substep(0), |_| true);
        Self {
            stores: Stores::of(body),
            ..Self::default()
        }
    }

    fn substep(
        &mut self,
        body: &mut Stepper,
        step: &Substep,
        context: &StepContext,
    ) -> Result<Ledger, NotFinite> {
        self.draw(body, step, context);
        self.predict(body, step, context, false)?;
        let solve = Solve::of(body.effects, body.outside(), step.method);
        for (stage, iteration) in solve.stages(*step) {
            self.stage(body, stage, step, iteration, context)?;
        }
        self.finish(body, step, context)
    }

    /// Performs the first stage of a substep, with the steps before and after it. `is_near` tells
    /// whether another surface is near.
    pub(crate) fn predict(
        &mut self,
        body: &mut Stepper,
        step: &Substep,
        context: &StepContext,
        is_near: bool,
    ) -> Result<(), NotFinite> {
        self.start.clone_from(body.particles);
        body.begin_after_repair(step, context, is_near);
        velocities(&mut self.leapt, body.particles);
        body.stage(Stage::External, step, 0, context)?;
        for kind in ForceKind::ALL {
            body.stage(Stage::Force(kind), step, 0, context)?;
        }
        velocities(&mut self.forced, body.particles);
        body.stage(Stage::Presolve, step, 0, context)?;
        self.begin(body.particles);
        self.carry[0].clone_from(&body.particles.carry);
        Stage::prediction().try_for_each(|stage| self.stage(body, stage, step, 0, context))
    }

    /// Performs a part of the second stage.
    pub(crate) fn stage(
        &mut self,
        body: &mut Stepper,
        stage: Stage,
        step: &Substep,
        iteration: u32,
        context: &StepContext,
    ) -> Result<(), NotFinite> {
        let cause = match stage {
            Stage::Contact | Stage::SelfContact => return Ok(()),
            Stage::Body(kind) => match kind.work() {
                WorkOf::Contact => return self.contact(body, stage, step, iteration, context),
                WorkOf::Grab => Cause::Grab,
                WorkOf::Elasticity => Cause::Elastic,
            },
            Stage::Pins | Stage::Grabs => Cause::Grab,
            _ => Cause::Elastic,
        };
        body.stage(stage, step, iteration, context)?;
        self.credit(body.particles, cause);
        Ok(())
    }

    /// Credits a part of the motion by contacts [m].
    pub(crate) fn credit_part(&mut self, part: ContactPart, particle: usize, way: DVec3) {
        let cause = match part {
            ContactPart::Friction => Cause::Friction,
            ContactPart::Recovery | ContactPart::Lift => Cause::Recovery,
        };
        self.causes[Cause::Contact as usize][particle] -= way;
        self.causes[cause as usize][particle] += way;
    }

    /// Performs the last stage and the steps after it.
    pub(crate) fn finish(
        &mut self,
        body: &mut Stepper,
        step: &Substep,
        context: &StepContext,
    ) -> Result<Ledger, NotFinite> {
        self.carry[1].clone_from(&body.particles.carry);
        body.stage(Stage::Postsolve, step, 0, context)?;
        velocities(&mut self.rolled, body.particles);
        body.resist_rolling();
        let h = body.particles.history.seconds(f64::from(step.h));
        let stores = Stores::of(body);
        let stored = Stored::between(&self.stores, &stores, h);
        self.stores = stores;
        let mut ledger = self.close(body.particles, step, stored);
        let given = self.work_on_pins(body) + work_of_clamps(body, h);
        ledger.grab += given;
        ledger.convergence -= given;
        let fast = kinetic_energy(body.particles);
        body.end_repair();
        let drawn = std::mem::take(&mut self.drawn);
        ledger.repair += drawn + kinetic_energy(body.particles) - fast;
        Ok(ledger)
    }

    /// Work of what moves pins, against the elastic effects at the end of the substep [J].
    /// Rigid effects and those without elements are left out: that work stays in convergence.
    fn work_on_pins(&self, body: &Stepper) -> f64 {
        struct Work<'a> {
            body: &'a Stepper<'a>,
            ways: &'a [DVec3],
            sum: f64,
        }
        impl Visit for Work<'_> {
            fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
                let (particles, ways) = (&*self.body.particles, self.ways);
                let is_moved = |i: usize| particles.positions[i].w == 0.0 && ways[i] != DVec3::ZERO;
                for (corners, rows) in effect.rows_of(self.body.topology, particles) {
                    for row in rows.iter().filter(|row| row.compliance > 0.0) {
                        for (&corner, gradient) in corners.iter().zip(row.gradients) {
                            let i = corner as usize;
                            if is_moved(i) {
                                self.sum += row.error / row.compliance * gradient.dot(ways[i]);
                            }
                        }
                    }
                }
            }
        }
        let controls = body.controls.as_deref();
        let grabs = controls.and_then(|it| it.grabs.as_ref());
        let grabs = grabs.into_iter().flat_map(Grabs::iter);
        let mut grabs = grabs.chain(&body.effects.grab);
        if !body.outside().steered && !grabs.any(|grab| grab.hold == Hold::Pins) {
            return 0.0;
        }
        let ways = &self.causes[Cause::Grab as usize];
        let mut work = Work {
            body,
            ways,
            sum: 0.0,
        };
        body.effects.visit(&mut work);
        work.sum
    }

    /// Begins a substep: moves particles under repair.
    pub(crate) fn draw(&mut self, body: &mut Stepper, step: &Substep, context: &StepContext) {
        let mechanical = |particles: &Particles| {
            kinetic_energy(particles) + gravitational_energy(particles, step.gravity)
        };
        let before = mechanical(body.particles);
        body.begin_repair(step, context);
        if body.particles.repair.is_empty() {
            return;
        }
        let stores = Stores::of(body);
        let stored = Stored::between(&self.stores, &stores, step.h.into());
        self.stores = stores;
        self.drawn = mechanical(body.particles) - before + stored.change;
    }

    fn begin(&mut self, particles: &Particles) {
        self.before.clear();
        self.before.extend(ways(particles));
        for column in &mut self.causes {
            column.clear();
            column.resize(particles.len(), DVec3::ZERO);
        }
    }

    /// Credits motion since the last call to a cause.
    pub(crate) fn credit(&mut self, particles: &Particles, cause: Cause) {
        let known = self.causes[cause as usize].iter_mut().zip(&mut self.before);
        for ((credited, before), way) in known.zip(ways(particles)) {
            *credited += way - *before;
            *before = way;
        }
    }

    /// Performs a contact twice, first without friction on a copy: the difference is the work of
    /// friction.
    fn contact(
        &mut self,
        body: &mut Stepper,
        stage: Stage,
        step: &Substep,
        iteration: u32,
        context: &StepContext,
    ) -> Result<(), NotFinite> {
        if !stage.acts(body.effects, body.outside(), step.method) {
            return Ok(());
        }
        let mut smooth = std::mem::take(&mut self.smooth);
        smooth.clone_from(body.particles);
        let rough = body.states.others.clone();
        std::mem::swap(body.particles, &mut smooth);
        let without = (stage, Friction::Omitted);
        let result = body.stage_with(without, step, iteration, context);
        std::mem::swap(body.particles, &mut smooth);
        body.states.others = rough;
        result?;
        self.credit(&smooth, Cause::Contact);
        self.smooth = smooth;
        body.stage(stage, step, iteration, context)?;
        self.credit(body.particles, Cause::Friction);
        Ok(())
    }

    /// Performs plastic flow, and returns the resulting change of stored energy [J].
    pub(crate) fn flow(
        &mut self,
        body: &mut Stepper,
        step: &Substep,
        context: &StepContext,
    ) -> Result<f64, NotFinite> {
        if body.effects.plasticity.is_none() {
            return Ok(0.0);
        }
        body.stage(Stage::Flow, step, 0, context)?;
        let stores = Stores::of(body);
        let both = stores.0.iter().zip(&self.stores.0);
        let change = both
            .map(|(after, before)| after.energy() - before.energy())
            .sum();
        self.stores = stores;
        Ok(change)
    }

    /// Accumulates the terms of a finished substep.
    fn close(&self, particles: &Particles, step: &Substep, stored: Stored) -> Ledger {
        let second = particles.history.is_second_order();
        let h = particles.history.seconds(f64::from(step.h));
        let gravity = step.gravity.as_dvec3();
        let fall = gravity * h;
        let lost = 1.0 - step.method.keeps_speed().map_or(1.0, f64::from);
        let mut sum = Ledger {
            damping: stored.damping,
            ..Ledger::default()
        };
        let mut elastic_work = 0.0;
        for (index, x) in particles.positions.iter().enumerate() {
            if x.w == 0.0 {
                continue;
            }
            let mass = 1.0 / f64::from(x.w);
            let start = self.start.velocity_f64(index);
            let end = particles.velocity_f64(index);
            let (mean, change) = (0.5 * (start + end), end - start);
            let [elastic, grab, contact, friction, truncation, recovery] =
                self.causes.each_ref().map(|column| column[index] / h);
            let leapt = self.leapt[index];
            let forces = self.forced[index] - leapt;
            let faded = (forces + leapt + fall) * -lost;
            let leap = leapt - start;
            let rolled = end - self.rolled[index];
            let rounding = change
                - leap
                - fall
                - forces
                - faded
                - elastic
                - grab
                - contact
                - friction
                - truncation
                - recovery
                - rolled;
            sum.damping += mass * faded.dot(mean);
            sum.forces += mass * forces.dot(mean);
            sum.grab += mass * grab.dot(mean);
            // Restitution moves the start position of the substep, a height through which the
            // particle does not fall.
            let from = self.carry[0][index] - self.carry[1][index];
            let lent = if second {
                0.0
            } else {
                gravity.dot(from.truncate().as_dvec3())
            };
            sum.contact += mass * (contact.dot(mean) + lent);
            sum.friction += mass * (friction + rolled).dot(mean);
            sum.truncation += mass * truncation.dot(mean);
            sum.recovery += mass * recovery.dot(mean);
            sum.rounding += mass * rounding.dot(mean);
            sum.integrator -= 0.5 * mass * (fall + elastic).dot(change);
            if second {
                // Gravity has acted over ⅔h along the displacement of the particle since the
                // previous substep.
                let way = particles.position(index) - self.start.position(index);
                sum.integrator += mass * (leap.dot(mean) + fall.dot(end) - gravity.dot(way));
            }
            elastic_work += mass * elastic.dot(end);
        }
        // Only friction and rolling resistance turn grains.
        sum.friction += rotational_energy(particles) - rotational_energy(&self.start);
        sum.integrator += stored.integrator;
        sum.convergence = elastic_work + stored.change - stored.integrator - stored.damping;
        sum
    }
}

/// Work in a substep of `h` seconds of clamped segments of a rod that turn [J].
fn work_of_clamps(body: &Stepper, h: f64) -> f64 {
    let w = |i: u32| f64::from(body.particles.positions[i as usize].w);
    let rod = body.states.others.rod.as_ref();
    rod.map_or(0.0, |rod| rod.work_of_clamps(h, w))
}

/// Displacements of the particles since the start of the substep [m].
fn ways(particles: &Particles) -> impl Iterator<Item = DVec3> {
    (0..particles.len()).map(|i| particles.motion(i))
}

/// Copies velocities [m/s].
fn velocities(to: &mut Vec<DVec3>, particles: &Particles) {
    to.clear();
    to.extend((0..particles.len()).map(|i| particles.velocity_f64(i)));
}
