//! Bodies as systems hand them to the solver, which steps them on any number of threads.

use super::{
    Asleep, CurrentSubstep, DirectFactors, Profile, Quarantined, SoftBody, SolverThreads,
    SpawnOrder, carried::Carried, profile::StageWatch,
};
use crate::solver::{
    Contact, ContactCounts, Contacts, EffectStates, Effects, Factors, Ledger, Particles,
    SelfContact, Stitches, Substep, Threads, WorkEstimate,
    advance::{NotFinite, Stage, StepContext, Stepper, Watch},
    ledger,
    step::together::{self, Companion, are_needed},
};
use bevy::{ecs::system::SystemParam, prelude::*};
use std::{mem::take, ops::Range, time::Instant};

/// All that [`Stepper`] needs of a body.
type Parts = (
    Entity,
    &'static SpawnOrder,
    Has<Asleep>,
    Has<Quarantined>,
    &'static mut SoftBody,
    &'static mut Particles,
    &'static mut EffectStates,
    Option<&'static mut Stitches>,
    Option<&'static mut DirectFactors>,
    Carried,
);

/// Bodies that are stepped, and those that are only in the way.
type Present = (
    With<SoftBody>,
    Or<(
        (Without<Asleep>, Without<Quarantined>),
        With<Contact>,
        With<SelfContact>,
    )>,
);

/// A body to be stepped, or in the way of others.
struct Job<'a> {
    entity: Entity,
    order: SpawnOrder,
    is_active: bool,
    body: Mut<'a, SoftBody>,
    particles: Mut<'a, Particles>,
    states: Mut<'a, EffectStates>,
    stitches: Option<Mut<'a, Stitches>>,
    factors: Option<Mut<'a, DirectFactors>>,
    effects: Effects,
    absent: (Stitches, Factors),
    outcome: Result<Ledger, NotFinite>,
}

impl Job<'_> {
    fn stepper(&mut self) -> Stepper<'_> {
        let (stitches, factors) = &mut self.absent;
        Stepper {
            // That it is stepped is no change that wakes a body, or for which it is drawn anew.
            topology: &mut self.body.bypass_change_detection().0,
            particles: &mut self.particles,
            effects: &self.effects,
            states: &mut self.states,
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

/// Contacts between bodies.
#[derive(Resource, Debug, Default)]
pub struct BodyContacts {
    contacts: Contacts,
    touching: Vec<[Entity; 2]>,
}

impl BodyContacts {
    /// What contacts did in the last substep.
    #[must_use]
    pub fn counts(&self) -> ContactCounts {
        self.contacts.counts()
    }

    /// Bodies that touched where the last substep began, each pair once.
    #[must_use]
    pub fn touching(&self) -> &[[Entity; 2]] {
        &self.touching
    }
}

/// All bodies, for a system that hands them to the solver.
#[derive(SystemParam)]
pub(super) struct Bodies<'w, 's> {
    current: Res<'w, CurrentSubstep>,
    threads: Res<'w, SolverThreads>,
    profile: ResMut<'w, Profile>,
    contacts: ResMut<'w, BodyContacts>,
    bodies: Query<'w, 's, Parts, Present>,
    room: Local<'s, Vec<Job<'static>>>,
    outcomes: Local<'s, Vec<Outcome>>,
}

/// What is done with bodies that are stepped together, if it is not the same for each.
type Together<'a> = &'a dyn Fn(&mut [Companion], &mut Contacts, &StepContext);

impl Bodies<'_, '_> {
    /// Whether something is to be done where each substep begins: for a body under repair, or for bodies that touch.
    pub fn begin_each_substep(&self) -> bool {
        let mut bodies = self.bodies.iter();
        bodies.any(|(.., particles, _, _, _, carried)| {
            !particles.repair.is_empty() || carried.can_touch()
        })
    }

    /// Begins a tick, or goes on with one, and begins a substep. Multipliers are kept where they are `read`.
    pub fn begin(&mut self, step: &Substep, read: bool) {
        self.work(
            1,
            |_, _| true,
            |stepper, context| {
                stepper.prepare(read);
                stepper.begin(step, context);
                Ok(Ledger::default())
            },
            Some(&|companions, contacts, context| {
                together::each(companions, context, |it, _| it.body.prepare(read));
                together::begin(companions, contacts, step, context);
            }),
        );
    }

    /// Does some substeps of a tick, with an account of the energy if it is `booked`.
    pub fn advance(
        &mut self,
        substeps: &Range<u32>,
        (read, booked): (bool, bool),
    ) -> impl Iterator<Item = Outcome> {
        let context = self.current.context(&self.threads);
        let iterations = substeps.len() * context.settings.substep(0).sweeps() as usize;
        self.work(
            iterations,
            |_, _| true,
            |stepper, context| {
                stepper.prepare(read);
                if booked {
                    ledger::advance(stepper, substeps.clone(), context)
                } else {
                    stepper.advance(substeps.clone(), context)?;
                    Ok(Ledger::default())
                }
            },
            Some(&|companions, contacts, context| {
                together::each(companions, context, |it, _| it.body.prepare(read));
                together::advance(companions, contacts, substeps.clone(), booked, context);
            }),
        );
        self.outcomes.drain(..)
    }

    /// Does one stage of the substep under way with every body that has it. Only the last stage looks for what is
    /// not finite.
    pub fn stage(&mut self, stage: Stage) -> impl Iterator<Item = Outcome> {
        let (step, iteration) = (self.current.step, self.current.iteration);
        let is_contact = matches!(stage, Stage::Contact | Stage::SelfContact);
        let has_it = |effects: &Effects, stitched| {
            // Contacts are between all that can touch, whichever of the two effects they have.
            stage.acts(effects, stitched, step.method) || is_contact && effects.can_touch()
        };
        let each = |stepper: &mut Stepper, context: &StepContext| {
            stepper.stage(stage, &step, iteration, context)?;
            if stage == Stage::Postsolve {
                stepper.end();
            }
            Ok(Ledger::default())
        };
        let solve: Together = &|companions, contacts, context| {
            together::solve(companions, contacts, stage, context);
        };
        let finish: Together = &|companions, contacts, context| {
            together::cut(companions, contacts, &step, context);
            together::each(companions, context, |it, context| {
                it.result = each(&mut it.body, context);
            });
            together::end(companions, contacts, &step);
        };
        let together = match stage {
            Stage::Contact | Stage::SelfContact => Some(solve),
            Stage::Postsolve => Some(finish),
            _ => None,
        };
        self.work(1, has_it, each, together);
        self.outcomes.drain(..)
    }

    /// Runs `each`, with the work of this number of iterations, for every body that is `wanted` by its effects and by
    /// whether it has stitches; for those that touch `together` instead, if it is given.
    fn work(
        &mut self,
        iterations: usize,
        wanted: impl Fn(&Effects, bool) -> bool,
        each: impl Fn(&mut Stepper, &StepContext) -> Result<Ledger, NotFinite> + Sync,
        together: Option<Together>,
    ) {
        let mut jobs = reused(take(&mut *self.room));
        for (
            entity,
            order,
            is_asleep,
            is_quarantined,
            body,
            particles,
            states,
            stitches,
            factors,
            carried,
        ) in &mut self.bodies
        {
            let effects = carried.effects();
            if wanted(&effects, stitches.as_ref().is_some_and(|it| !it.is_empty())) {
                jobs.push(Job {
                    entity,
                    order: *order,
                    is_active: !is_asleep && !is_quarantined,
                    body,
                    particles,
                    states,
                    stitches,
                    factors,
                    effects,
                    absent: Default::default(),
                    outcome: Ok(Ledger::default()),
                });
            }
        }
        let watch = self.profile.by_part.then(StageWatch::default);
        let context = StepContext {
            watch: watch.as_ref().map(|watch| watch as &dyn Watch),
            ..self.current.context(&self.threads)
        };
        let started = Instant::now();
        let is_asked = together.is_some();
        let together =
            together.filter(|_| are_needed(jobs.iter().map(|job| (&job.effects, job.is_active))));
        let alone = match together {
            None => jobs.len(),
            Some(_) => {
                jobs.sort_unstable_by_key(|job| (job.effects.can_touch(), job.order));
                jobs.partition_point(|job| !job.effects.can_touch())
            }
        };
        let (alone, touching) = jobs.split_at_mut(alone);
        let load = |job: &Job| match job.is_active {
            true => job.effects.load(&job.body.0, iterations),
            false => WorkEstimate::default(),
        };
        self.threads
            .for_each(alone, load, &|job: &mut Job, threads: &Threads| {
                if job.is_active {
                    job.outcome = each(&mut job.stepper(), &StepContext { threads, ..context });
                }
            });
        if let Some(together) = together {
            let BodyContacts {
                contacts,
                touching: pairs,
            } = &mut *self.contacts;
            let mut companions: Vec<_> = touching
                .iter_mut()
                .map(|job| {
                    let is_active = job.is_active;
                    Companion::new(job.stepper(), is_active)
                })
                .collect();
            together(&mut companions, contacts, &context);
            let results: Vec<_> = companions.into_iter().map(|it| it.result).collect();
            for (job, result) in touching.iter_mut().zip(results) {
                job.outcome = result;
            }
            pairs.clear();
            let entity = |place: u32| touching[place as usize].entity;
            pairs.extend(contacts.touching().iter().map(|pair| pair.map(entity)));
        } else if is_asked {
            self.contacts.contacts.clear();
            self.contacts.touching.clear();
        }
        if let Some(watch) = &watch {
            self.profile.share_out(started.elapsed(), watch);
        }
        self.outcomes.clear();
        let stepped = jobs.drain(..).filter(|job| job.is_active);
        self.outcomes.extend(stepped.map(|job| Outcome {
            entity: job.entity,
            result: job.outcome,
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
