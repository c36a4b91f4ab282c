//! Bodies as systems hand them to the solver, which steps them on any number of threads.

use super::{
    CurrentSubstep, DirectFactors, Multipliers, Profile, SoftBody, SolverThreads, TetherLeads,
    body::Active, carried::Carried, profile::StageWatch,
};
use crate::solver::{
    Effects, Factors, Grab, Leads, Ledger, Particles, Stitches, Substep, Threads,
    advance::{Means, NotFinite, Stage, Stepper, Watch},
    ledger,
};
use bevy::{ecs::system::SystemParam, prelude::*};
use std::{mem::take, ops::Range, time::Instant};

/// All that [`Stepper`] needs of a body.
type Parts = (
    Entity,
    &'static mut SoftBody,
    &'static mut Particles,
    &'static mut Multipliers,
    Option<&'static mut TetherLeads>,
    Option<&'static mut Stitches>,
    Option<&'static mut DirectFactors>,
    Option<&'static mut Grab>,
    Carried,
);

/// A body to be stepped.
struct Job<'a> {
    entity: Entity,
    body: Mut<'a, SoftBody>,
    particles: Mut<'a, Particles>,
    multipliers: Mut<'a, Multipliers>,
    leads: Option<Mut<'a, TetherLeads>>,
    stitches: Option<Mut<'a, Stitches>>,
    factors: Option<Mut<'a, DirectFactors>>,
    grab: Option<Mut<'a, Grab>>,
    effects: Effects,
    absent: (Leads, Stitches, Factors),
    outcome: Result<Ledger, NotFinite>,
}

impl Job<'_> {
    fn stepper(&mut self) -> Stepper<'_> {
        let (leads, stitches, factors) = &mut self.absent;
        Stepper {
            // That it is stepped is no change that wakes a body, or for which it is drawn anew.
            topology: &mut self.body.bypass_change_detection().0,
            particles: &mut self.particles,
            effects: &mut self.effects,
            lambdas: &mut self.multipliers.0,
            leads: self.leads.as_mut().map_or(leads, |leads| &mut leads.0),
            stitches: match &mut self.stitches {
                Some(stitches) => stitches.bypass_change_detection(),
                None => stitches,
            },
            factors: self
                .factors
                .as_mut()
                .map_or(factors, |factors| &mut factors.0),
        }
    }
}

/// Result of stepping a body.
#[derive(Debug)]
pub(super) struct Outcome {
    pub entity: Entity,
    /// The energy ledger of the substeps, empty unless it is kept, or the failure.
    pub result: Result<Ledger, NotFinite>,
}

/// All bodies, for a system that hands them to the solver.
#[derive(SystemParam)]
pub(super) struct Bodies<'w, 's> {
    current: Res<'w, CurrentSubstep>,
    threads: Res<'w, SolverThreads>,
    profile: ResMut<'w, Profile>,
    bodies: Query<'w, 's, Parts, Active>,
    room: Local<'s, Vec<Job<'static>>>,
    outcomes: Local<'s, Vec<Outcome>>,
}

impl Bodies<'_, '_> {
    /// Whether a body is under repair.
    pub fn are_repaired(&self) -> bool {
        let mut bodies = self.bodies.iter();
        bodies.any(|(_, _, particles, ..)| !particles.repair.is_empty())
    }

    /// Begins a tick, or goes on with one, and begins a substep. Multipliers are kept where they are `read`.
    pub fn begin(&mut self, step: &Substep, read: bool) {
        self.work(
            1,
            |_, _| true,
            |stepper, means| {
                stepper.prepare(read);
                stepper.begin(step, means);
                Ok(Ledger::default())
            },
        );
    }

    /// Does some substeps of a tick, with an account of the energy if it is `booked`.
    pub fn advance(
        &mut self,
        substeps: &Range<u32>,
        (read, booked): (bool, bool),
    ) -> impl Iterator<Item = Outcome> {
        let means = self.current.means(&self.threads);
        let sweeps = substeps.len() * means.settings.substep(0).sweeps() as usize;
        self.work(
            sweeps,
            |_, _| true,
            |stepper, means| {
                stepper.prepare(read);
                if booked {
                    ledger::advance(stepper, substeps.clone(), means)
                } else {
                    stepper.advance(substeps.clone(), means)?;
                    Ok(Ledger::default())
                }
            },
        );
        self.outcomes.drain(..)
    }

    /// Does one stage of the substep under way with every body that has it. Only the last stage looks for what is
    /// not finite.
    pub fn stage(&mut self, stage: Stage) -> impl Iterator<Item = Outcome> {
        let (step, iteration) = (self.current.step, self.current.iteration);
        let has_it = |effects: &Effects, stitched| stage.acts(effects, stitched, step.method);
        self.work(1, has_it, |stepper, means| {
            stepper.stage(stage, &step, iteration, means)?;
            if stage == Stage::Postsolve {
                stepper.end();
            }
            Ok(Ledger::default())
        });
        self.outcomes.drain(..)
    }

    /// Does `work`, as so many sweeps over constraints, with every body that is `wanted` by its effects and by
    /// whether it has stitches.
    fn work(
        &mut self,
        sweeps: usize,
        wanted: impl Fn(&Effects, bool) -> bool,
        work: impl Fn(&mut Stepper, &Means) -> Result<Ledger, NotFinite> + Sync,
    ) {
        let mut jobs = reused(take(&mut *self.room));
        for (entity, body, particles, multipliers, leads, stitches, factors, grab, carried) in
            &mut self.bodies
        {
            let effects = carried.effects(grab.as_deref().copied());
            if wanted(&effects, stitches.as_ref().is_some_and(|it| !it.is_empty())) {
                jobs.push(Job {
                    entity,
                    body,
                    particles,
                    multipliers,
                    leads,
                    stitches,
                    factors,
                    grab,
                    effects,
                    absent: Default::default(),
                    outcome: Ok(Ledger::default()),
                });
            }
        }
        let watch = self.profile.by_part.then(StageWatch::default);
        let means = Means {
            watch: watch.as_ref().map(|watch| watch as &dyn Watch),
            ..self.current.means(&self.threads)
        };
        let started = Instant::now();
        let load = |job: &Job| job.effects.load(&job.body.0, sweeps);
        self.threads
            .for_each(&mut jobs, load, &|job: &mut Job, threads: &Threads| {
                job.outcome = work(&mut job.stepper(), &Means { threads, ..means });
            });
        if let Some(watch) = &watch {
            self.profile.share_out(started.elapsed(), watch);
        }
        self.outcomes.clear();
        self.outcomes.extend(jobs.drain(..).map(|mut job| {
            if let (Some(grab), Some(held)) = (&mut job.grab, job.effects.grab) {
                // The multiplier is state: its change is no change of a parameter.
                *grab.bypass_change_detection() = held;
            }
            Outcome {
                entity: job.entity,
                result: job.outcome,
            }
        }));
        *self.room = reused(jobs);
    }
}

/// The allocation of a list, for other elements of the same layout.
fn reused<'a>(mut jobs: Vec<Job<'_>>) -> Vec<Job<'a>> {
    jobs.clear();
    jobs.into_iter()
        .map(|_| unreachable!("the list is empty"))
        .collect()
}
