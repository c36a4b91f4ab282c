//! Passes bodies from the ECS to the solver, which steps them on any number of threads.

use super::{
    Asleep, BodyDirectWorkspace, BodyPair, CurrentSubstep, Profile, Quarantined, SoftBody,
    SolverThreads, SpawnOrder, SurfaceContact, carried::Carried, profile::StageWatch,
};
use crate::solver::{
    ContactCounts, Contacts, EffectStates, Effects, ExternalForce, Particles, Settings, Stitches,
    Substep, Threads, WorkEstimate,
    advance::{NotFinite, Stage, StepContext, Stepper, Watch},
    copies::{self, Candidate},
    direct::DirectWorkspace,
    joints::Joined,
    ledger::{self, Ledger},
    together::{self, COLLIDE, GroupedBody, must_step_together},
};
use bevy::{
    ecs::{entity::EntityHashSet, system::SystemParam},
    prelude::*,
};
use std::{collections::BTreeMap, mem::take, ops::Range, time::Instant};

/// The components that [`Stepper`] needs.
type Parts = (
    Entity,
    &'static SpawnOrder,
    Has<Asleep>,
    Has<Quarantined>,
    &'static mut SoftBody,
    &'static mut Particles,
    &'static mut EffectStates,
    Option<&'static mut Stitches>,
    Option<&'static mut BodyDirectWorkspace>,
    Option<&'static ExternalForce>,
    Carried,
);

/// Bodies that stitches join to others.
#[derive(Debug, Default)]
struct Joints {
    /// All bodies of the world, sorted; empty if none are joined.
    orders: Vec<SpawnOrder>,
    joined: Joined,
}

impl Joints {
    /// Those of all bodies.
    fn of<'a>(bodies: impl Iterator<Item = (SpawnOrder, Option<&'a Stitches>)> + Clone) -> Self {
        let has_joints = |it: &Stitches| it.intact_joints().next().is_some();
        if !bodies.clone().any(|(_, it)| it.is_some_and(has_joints)) {
            return Self::default();
        }
        let mut all: Vec<_> = bodies.collect();
        all.sort_unstable_by_key(|(order, _)| *order);
        let numbered = (0..)
            .zip(&all)
            .filter_map(|(number, (_, it))| Some((number, (*it)?)));
        Self {
            joined: Joined::of(numbered, all.len()),
            orders: all.iter().map(|(order, _)| *order).collect(),
        }
    }

    /// Number of a body among those of the world; `None` if none are joined.
    fn number(&self, order: SpawnOrder) -> Option<u32> {
        let place = self.orders.binary_search(&order).ok()?;
        Some(place as u32)
    }

    /// Whether a body is joined to another.
    fn contain(&self, order: SpawnOrder) -> bool {
        let number = self.number(order);
        number.is_some_and(|number| self.joined.contains(number))
    }
}

/// A body to be stepped, or one that acts on others.
struct Job<'a> {
    entity: Entity,
    order: SpawnOrder,
    is_active: bool,
    /// Whether it is stepped together with others, if any are.
    is_grouped: bool,
    body: Mut<'a, SoftBody>,
    particles: Mut<'a, Particles>,
    states: Mut<'a, EffectStates>,
    stitches: Option<Mut<'a, Stitches>>,
    direct: Option<Mut<'a, BodyDirectWorkspace>>,
    force: Option<&'a ExternalForce>,
    effects: Effects,
    absent: (Stitches, DirectWorkspace),
    outcome: Result<Ledger, NotFinite>,
}

impl Job<'_> {
    fn load(&self, iterations: usize) -> WorkEstimate {
        let direct = self
            .direct
            .as_ref()
            .map_or(&self.absent.1, |direct| &direct.0);
        direct.load(&self.effects, &self.body.0, iterations)
    }

    /// Whether the two are stepped, and can be side by side.
    fn is_copy_of(&self, other: &Self, settings: &Settings) -> bool {
        let is_pushed = self.force.is_some() || other.force.is_some();
        if is_pushed || !(self.is_active && other.is_active) {
            return false;
        }
        let [body, other] = [self, other].map(|it| Candidate {
            topology: &it.body.0,
            effects: &it.effects,
            stitches: it.stitches.as_deref(),
        });
        body.is_copy_of(&other, settings)
    }

    fn stepper(&mut self) -> Stepper<'_> {
        let (stitches, direct) = &mut self.absent;
        Stepper {
            // Stepping does not count as a change, which would wake the body and redraw it.
            topology: &mut self.body.bypass_change_detection().0,
            particles: &mut self.particles,
            effects: &self.effects,
            states: &mut self.states,
            stitches: match &mut self.stitches {
                Some(stitches) => stitches.bypass_change_detection(),
                None => stitches,
            },
            direct: self.direct.as_mut().map_or(direct, |direct| &mut direct.0),
            force: self.force,
        }
    }
}

/// What is kept of a substep to be read later.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kept {
    /// Multipliers of elastic effects, for later iterations or statistics.
    pub multipliers: bool,
    /// Multipliers of ground and colliders, for [`RecordContacts`](super::RecordContacts).
    pub contacts: bool,
}

impl Kept {
    fn prepare(self, stepper: &mut Stepper) {
        stepper.states.records_contacts = self.contacts;
        stepper.prepare(self.multipliers);
    }
}

/// Result of stepping a body.
#[derive(Debug)]
pub(super) struct Outcome {
    pub entity: Entity,
    /// The energy ledger of the substeps, empty unless it is on; or the error.
    pub result: Result<Ledger, NotFinite>,
}

/// Contacts between bodies, and forces of colliders and the ground.
#[derive(Resource, Debug, Default)]
pub struct BodyContacts {
    contacts: Contacts,
    /// The bodies that can touch, by their places.
    bodies: Vec<Entity>,
    touching: Vec<[Entity; 2]>,
    /// Pairs that touched in the tick so far, with sums of their forces over these substeps.
    pairs: BTreeMap<[SpawnOrder; 2], BodyPair>,
    substeps: u32,
    /// Bodies that stitches joined at the start of the tick, by their numbers and as entities.
    joints: Joints,
    joined: Vec<[Entity; 2]>,
    /// The colliders of the tick, by their numbers, and what bodies touched that are no bodies; empty
    /// unless contacts are recorded.
    pub(super) colliders: Vec<Entity>,
    pub(super) surfaces: Vec<SurfaceContact>,
}

/// A contact that pushes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct BodyContact {
    /// The bodies, equal for a contact of a body with itself; `None` for a collider.
    pub bodies: [Option<Entity>; 2],
    /// The middle of the gap [m].
    pub point: Vec3,
    /// Direction of the force on the first one, a unit vector.
    pub normal: Vec3,
    /// Normal force, not negative [N].
    pub normal_force: f32,
    /// Friction force on the first one, perpendicular to the normal [N].
    pub friction: Vec3,
}

impl BodyContacts {
    /// Bodies were added or removed.
    pub(super) fn invalidate(&mut self) {
        self.contacts.invalidate();
    }

    /// Contact counts of the last substep.
    #[must_use]
    pub fn counts(&self) -> ContactCounts {
        self.contacts.counts()
    }

    /// Smallest distance of two surfaces in contact at the start of the last substep [m]; `None`
    /// without a pair near enough for a constraint.
    #[must_use]
    pub fn smallest_gap(&self) -> Option<f64> {
        self.contacts.smallest_gap()
    }

    /// The contacts that pushed in the last substep, with their forces.
    pub fn forces(&self) -> impl Iterator<Item = BodyContact> {
        self.contacts.forces().map(|it| BodyContact {
            bodies: it.bodies.map(|place| Some(self.bodies[place? as usize])),
            point: it.point.as_vec3(),
            normal: it.normal.as_vec3(),
            normal_force: it.normal_force as f32,
            friction: it.friction.as_vec3(),
        })
    }

    /// Forces of the contacts that pushed in the last substep on particles: body, particle, and
    /// magnitude [N]. A contact acts on up to four particles, by the weights of its points.
    pub fn particle_forces(&self) -> impl Iterator<Item = (Entity, usize, f64)> {
        let forces = self.contacts.particle_forces();
        forces.map(|(body, particle, force)| (self.bodies[body as usize], particle as usize, force))
    }

    /// Pairs of bodies that touched at the start of the last substep, without duplicates.
    #[must_use]
    pub fn touching(&self) -> &[[Entity; 2]] {
        &self.touching
    }

    /// The pairs of bodies that touched in the last tick, with the force between them. There are none
    /// in a tick in which all bodies sleep. Contacts of a body with itself are not among them; those
    /// with colliders and the ground are in [`surfaces`](Self::surfaces).
    pub fn pairs(&self) -> impl Iterator<Item = BodyPair> {
        let part = 1.0 / self.substeps.max(1) as f32;
        self.pairs.values().map(move |pair| BodyPair {
            force: pair.force * part,
            normal_force: pair.normal_force * part,
            ..*pair
        })
    }

    /// The colliders and grounds that bodies touched in the last tick, with their forces, while
    /// [`RecordContacts`](super::RecordContacts) is on: sorted by body in spawn order, then the ground
    /// before colliders in spawn order. There are none of bodies that sleep, and none between the
    /// substeps of a tick.
    pub fn surfaces(&self) -> impl Iterator<Item = SurfaceContact> {
        self.surfaces.iter().copied()
    }

    /// Whether stitches joined a body to another at the start of the tick.
    pub(super) fn joins(&self, body: SpawnOrder) -> bool {
        self.joints.contain(body)
    }

    /// Pairs of bodies that touched or that stitches joined, which sleep and wake together.
    pub(super) fn islands(&self) -> impl Iterator<Item = [Entity; 2]> + '_ {
        self.touching.iter().chain(&self.joined).copied()
    }
}

/// The bodies that the schedules of a substep step, stage by stage; the others run whole ticks in the solver.
#[derive(Resource, Debug, Default, Clone, PartialEq, Eq)]
pub(super) enum Staged {
    /// Not one: the schedules hold nothing but the plan of the solver.
    #[default]
    None,
    /// Those that carry an effect with systems of its own.
    Some {
        /// They, and the bodies that are stepped together with one of them.
        bodies: EntityHashSet,
        /// Whether the bodies that are stepped together are among them.
        group: bool,
    },
    /// All: a system that belongs to no effect may act on each.
    All,
}

/// How a body is stepped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stepping {
    /// Through some substeps at once.
    Whole,
    /// Stage by stage.
    Staged,
}

impl Staged {
    /// Whether a body is stepped so.
    fn takes(&self, body: Entity, stepping: Stepping) -> bool {
        let is_staged = match self {
            Self::None => false,
            Self::Some { bodies, .. } => bodies.contains(&body),
            Self::All => true,
        };
        is_staged == (stepping == Stepping::Staged)
    }

    /// Whether bodies that touch or are joined are stepped so.
    fn groups_take(&self, stepping: Stepping) -> bool {
        let is_staged = match self {
            Self::None => false,
            Self::Some { group, .. } => *group,
            Self::All => true,
        };
        is_staged == (stepping == Stepping::Staged)
    }
}

/// All bodies, as a system parameter.
#[derive(SystemParam)]
pub(super) struct Bodies<'w, 's> {
    staged: Res<'w, Staged>,
    current: Res<'w, CurrentSubstep>,
    threads: Res<'w, SolverThreads>,
    profile: ResMut<'w, Profile>,
    contacts: ResMut<'w, BodyContacts>,
    bodies: Query<'w, 's, Parts, With<SoftBody>>,
    room: Local<'s, Vec<Job<'static>>>,
    outcomes: Local<'s, Vec<Outcome>>,
}

/// Work on bodies that are stepped together, where it differs from that on each body.
type Together<'a> = &'a dyn Fn(&mut [GroupedBody], &mut Contacts, &StepContext);

/// Work on copies of a body that is faster than that on each of them.
type OnCopies<'a> = &'a (dyn Fn(&mut [Job], &StepContext) + Sync);

impl Bodies<'_, '_> {
    /// Whether each substep of the bodies that are stepped stage by stage needs a start step: for a body
    /// under repair, or for bodies that touch.
    pub fn begin_each_substep(&self) -> bool {
        let has_meshes = self.current.has_meshes();
        let mut bodies = self.bodies.iter();
        bodies.any(|(entity, .., particles, _, _, _, _, carried)| {
            let needs =
                !particles.repair.is_empty() || carried.effects().touches_surfaces(has_meshes);
            needs && self.staged.takes(entity, Stepping::Staged)
        })
    }

    /// The bodies that are stepped stage by stage if these `carriers` are: all that may touch or are joined,
    /// if one of them is a carrier.
    pub fn staged_with(&self, carriers: EntityHashSet) -> Staged {
        let has_meshes = self.current.has_meshes();
        let together = self.bodies.iter().filter(|(_, order, .., carried)| {
            self.contacts.joins(**order) || carried.effects().touches_surfaces(has_meshes)
        });
        let together: Vec<_> = together.map(|(entity, ..)| entity).collect();
        let group = together.iter().any(|body| carriers.contains(body));
        let mut bodies = carriers;
        bodies.extend(together.into_iter().filter(|_| group));
        Staged::Some { bodies, group }
    }

    /// Begins a tick: finds the bodies that stitches join. They are stepped together to its end,
    /// also where the last stitch between them breaks.
    pub fn begin_tick(&mut self) {
        let bodies = self.bodies.iter();
        let all = bodies.map(|(entity, order, .., stitches, _, _, _)| (*order, entity, stitches));
        let joints = Joints::of(all.clone().map(|(order, _, stitches)| (order, stitches)));
        self.contacts.pairs.clear();
        self.contacts.surfaces.clear();
        self.contacts.substeps = 0;
        self.contacts.joined.clear();
        if !joints.joined.is_empty() {
            let mut sorted: Vec<_> = all.map(|(order, entity, _)| (order, entity)).collect();
            sorted.sort_unstable();
            let pairs = joints.joined.pairs().iter();
            let pairs = pairs.map(|pair| pair.map(|number| sorted[number as usize].1));
            self.contacts.joined.extend(pairs);
        }
        self.contacts.joints = joints;
    }

    /// Begins or continues a tick, and begins a substep.
    pub fn begin(&mut self, step: &Substep, kept: Kept) {
        self.work(
            (Stepping::Staged, 1),
            |_, _, _| true,
            |stepper, context| {
                kept.prepare(stepper);
                stepper.begin(step, context);
                Ok(Ledger::default())
            },
            None,
            Some(&|group, contacts, context| {
                together::each(group, context, |it, _| kept.prepare(&mut it.body));
                together::begin(group, contacts, step, context);
            }),
        );
    }

    /// Runs some substeps of a tick, and tracks the energy if `tracked`.
    pub fn advance(
        &mut self,
        substeps: &Range<u32>,
        (kept, tracked): (Kept, bool),
    ) -> impl Iterator<Item = Outcome> {
        let context = self.current.context(&self.threads);
        let iterations = substeps.len() * context.settings.substep(0).total_iterations() as usize;
        let on_copies: OnCopies = &|jobs, context| {
            for job in &mut *jobs {
                kept.prepare(&mut job.stepper());
            }
            let results = copies::advance(jobs.iter_mut().map(Job::stepper), substeps, context);
            for (job, result) in jobs.iter_mut().zip(results) {
                job.outcome = result.map(|()| Ledger::default());
            }
        };
        self.work(
            (Stepping::Whole, iterations),
            |_, _, _| true,
            |stepper, context| {
                kept.prepare(stepper);
                if tracked {
                    ledger::advance(stepper, substeps.clone(), context)
                } else {
                    stepper.advance(substeps.clone(), context)?;
                    Ok(Ledger::default())
                }
            },
            Some(on_copies).filter(|_| !tracked),
            Some(&|group, contacts, context| {
                together::each(group, context, |it, _| kept.prepare(&mut it.body));
                together::advance(group, contacts, substeps.clone(), tracked, context);
            }),
        );
        self.outcomes.drain(..)
    }

    /// Runs one stage of the substep under way on all bodies that have it. Only the last stage
    /// checks for non-finite values.
    pub fn stage(&mut self, stage: Stage) -> impl Iterator<Item = Outcome> {
        let (step, iteration) = (self.current.step, self.current.iteration);
        let has_meshes = self.current.has_meshes();
        let is_contact =
            matches!(stage, Stage::Contact | Stage::SelfContact) || stage == COLLIDE && has_meshes;
        let is_joint = stage == Stage::Joints;
        let has_it = |effects: &Effects, stitched, is_joined| {
            let own = stage.in_its_place(effects, &step, iteration);
            // Contacts and stitches between bodies involve the whole group, in the same order.
            own.acts(effects, stitched, step.method)
                || (is_contact || is_joint) && (is_joined || effects.touches_surfaces(has_meshes))
        };
        let each = |stepper: &mut Stepper, context: &StepContext| {
            let own = stage.in_its_place(stepper.effects, &step, iteration);
            stepper.stage(own, &step, iteration, context)?;
            if stage == Stage::Postsolve {
                stepper.end();
            }
            Ok(Ledger::default())
        };
        let solve: Together = &|group, contacts, context| {
            if stage == COLLIDE {
                together::each(group, context, |it, context| {
                    if stage.acts(it.body.effects, false, step.method) {
                        it.result = each(&mut it.body, context);
                    }
                });
            }
            together::solve(group, contacts, stage, context);
        };
        let finish: Together = &|group, contacts, context| {
            together::truncate(group, contacts, &step, context);
            together::each(group, context, |it, context| {
                it.result = each(&mut it.body, context);
            });
            together::end(group, contacts, &step);
        };
        let join: Together = &|group, _, context| {
            together::solve_joints(group, &step, iteration, context);
        };
        let together = match stage {
            _ if is_joint => Some(join),
            _ if is_contact => Some(solve),
            Stage::Postsolve => Some(finish),
            _ => None,
        };
        self.work((Stepping::Staged, 1), has_it, each, None, together);
        self.outcomes.drain(..)
    }

    /// Runs `each`, with a work estimate for this number of iterations, on every body that is stepped so and
    /// `wanted` by its effects, by whether it has stitches, and by whether it is joined to another
    /// body; on copies of a body, runs `on_copies` instead, and on bodies that touch or are joined,
    /// `together`, if given.
    fn work(
        &mut self,
        (stepping, iterations): (Stepping, usize),
        wanted: impl Fn(&Effects, bool, bool) -> bool,
        each: impl Fn(&mut Stepper, &StepContext) -> Result<Ledger, NotFinite> + Sync,
        on_copies: Option<OnCopies>,
        together: Option<Together>,
    ) {
        let mut jobs = reused(take(&mut *self.room));
        let has_meshes = self.current.has_meshes();
        let joints = take(&mut self.contacts.joints);
        for (
            entity,
            order,
            is_asleep,
            is_quarantined,
            body,
            particles,
            states,
            stitches,
            direct,
            force,
            carried,
        ) in &mut self.bodies
        {
            let is_active = !is_asleep && !is_quarantined;
            let is_joined = joints.contain(*order);
            if !(is_active || carried.can_touch() || is_joined)
                || !self.staged.takes(entity, stepping)
            {
                continue;
            }
            let effects = carried.effects();
            let is_stitched = stitches.as_ref().is_some_and(|it| !it.is_empty());
            if wanted(&effects, is_stitched, is_joined) {
                jobs.push(Job {
                    entity,
                    order: *order,
                    is_active,
                    is_grouped: is_joined || effects.touches_surfaces(has_meshes),
                    body,
                    particles,
                    states,
                    stitches,
                    direct,
                    force,
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
        let can_step_together = together.is_some() && self.staged.groups_take(stepping);
        let together = together.filter(|_| {
            let all = jobs.iter().map(|job| (&job.effects, job.is_active));
            can_step_together && must_step_together(all, &joints.joined, has_meshes)
        });
        let alone = match together {
            None => {
                // Copies of a body follow each other.
                if on_copies.is_some() {
                    jobs.sort_unstable_by_key(|job| job.order);
                }
                jobs.len()
            }
            Some(_) => {
                jobs.sort_unstable_by_key(|job| (job.is_grouped, job.order));
                jobs.partition_point(|job| !job.is_grouped)
            }
        };
        let (alone, touching) = jobs.split_at_mut(alone);
        let load = |job: &Job| match job.is_active {
            true => job.load(iterations),
            false => WorkEstimate::default(),
        };
        let are_copies =
            |a: &Job, b: &Job| on_copies.is_some() && a.is_copy_of(b, context.settings);
        let size = |first: &Job, copies, threads| {
            copies::group_size(&first.body.0, copies, threads, context.instructions)
        };
        self.threads.for_each_group(
            alone,
            (are_copies, size),
            load,
            &|jobs: &mut [Job], threads: &Threads| {
                let context = StepContext { threads, ..context };
                match (jobs, on_copies) {
                    ([job], _) if job.is_active => job.outcome = each(&mut job.stepper(), &context),
                    ([_], _) => {}
                    (jobs, Some(on_copies)) => on_copies(jobs, &context),
                    (_, None) => unreachable!("nothing else has groups"),
                }
            },
        );
        if let Some(together) = together {
            let BodyContacts {
                contacts,
                bodies,
                touching: pairs,
                pairs: all_pairs,
                substeps,
                ..
            } = &mut *self.contacts;
            let group = (0..).zip(touching.iter_mut()).map(|(place, job)| {
                let is_active = job.is_active;
                let number = joints.number(job.order).unwrap_or(place);
                GroupedBody::new(number, job.stepper(), is_active)
            });
            let mut group: Vec<_> = group.collect();
            together(&mut group, contacts, &context);
            let results: Vec<_> = group.into_iter().map(|it| it.result).collect();
            for (job, result) in touching.iter_mut().zip(results) {
                job.outcome = result;
            }
            bodies.clear();
            bodies.extend(touching.iter().map(|job| job.entity));
            pairs.clear();
            let entity = |place: u32| bodies[place as usize];
            pairs.extend(contacts.touching().iter().map(|pair| pair.map(entity)));
            *substeps += contacts.take_pairs(|pair| {
                let orders = pair.bodies.map(|place| touching[place as usize].order);
                let sum = all_pairs.entry(orders).or_insert(BodyPair {
                    bodies: pair.bodies.map(entity),
                    force: Vec3::ZERO,
                    normal_force: 0.0,
                });
                sum.force += pair.force.as_vec3();
                sum.normal_force += pair.normal_force as f32;
            });
        } else if can_step_together {
            self.contacts.contacts.clear();
            self.contacts.bodies.clear();
            self.contacts.touching.clear();
        }
        self.contacts.joints = joints;
        if let Some(watch) = &watch {
            self.profile.distribute(started.elapsed(), watch);
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

/// Reuses the allocation of a list for elements of the same layout.
fn reused<'a>(mut jobs: Vec<Job<'_>>) -> Vec<Job<'a>> {
    jobs.clear();
    jobs.into_iter()
        .map(|_| unreachable!("the list is empty"))
        .collect()
}
