//! Passes bodies from the ECS to the solver and back.
//!
//! The solver steps a [`Body`]; here its parts are components. What is large is exchanged with an empty
//! body of the same number, which costs no copy; no other system runs meanwhile.

use super::{
    AddedMass, Asleep, BodyContacts, BodyDensity, BodyDirectWorkspace, BodySleep, CurrentSubstep,
    Pins, Profile, Quarantined, RecordContacts, RestTimer, SoftBody, SolverThreads, SpawnOrder,
    TickStart, carried::Carried, profile::StageWatch,
};
use crate::solver::{
    Body, Controls, Cut, Density, EffectStates, ExternalForce, ExternalImpulse, Grab, Grabs,
    Particles, PinTargets, Quarantine, RestShape, Stitches, Substep, Topology,
    advance::{Stage, StepContext, Watch},
    ledger::Ledger,
    rest::SleepSettings,
    tick::{self, Member, Tick, TickReport, TornBody, Work},
};
use bevy::{
    ecs::{component::Mutable, entity::EntityHashSet, query::QueryData, system::SystemParam},
    prelude::*,
};
use std::{
    mem::{replace, swap, take},
    ops::Range,
    sync::{Arc, LazyLock},
    time::Instant,
};

/// The components of a body that a tick changes, and what it reads.
#[derive(QueryData)]
#[query_data(mutable)]
struct Parts {
    body: &'static mut SoftBody,
    particles: &'static mut Particles,
    start: &'static mut TickStart,
    states: &'static mut EffectStates,
    stitches: Option<&'static mut Stitches>,
    direct: Option<&'static mut BodyDirectWorkspace>,
    force: Option<&'static mut ExternalForce>,
    impulse: Option<&'static mut ExternalImpulse>,
    targets: Option<&'static mut PinTargets>,
    grabs: Option<&'static mut Grabs>,
    density: &'static BodyDensity,
    added: &'static mut AddedMass,
    pins: &'static mut Pins,
    rest: &'static mut RestTimer,
    sleep: Option<&'static BodySleep>,
    is_asleep: Has<Asleep>,
    quarantine: Option<&'static Quarantined>,
    carried: Carried,
}

impl PartsItem<'_, '_> {
    /// Exchanges what is large with a body. Nothing of it counts as a change, which would wake the body.
    fn exchange(&mut self, body: &mut Body) {
        swap(
            &mut self.body.bypass_change_detection().0,
            &mut body.topology,
        );
        swap(
            self.particles.bypass_change_detection(),
            &mut body.particles,
        );
        swap(
            &mut self.start.bypass_change_detection().0,
            &mut body.tick_start,
        );
        swap(self.states.bypass_change_detection(), &mut body.states);
        swap(
            &mut self.added.bypass_change_detection().0,
            &mut body.added_mass,
        );
        swap(&mut self.pins.bypass_change_detection().0, &mut body.pins);
        if let Some(stitches) = &mut self.stitches {
            swap(stitches.bypass_change_detection(), &mut body.stitches);
        }
        if let Some(direct) = &mut self.direct {
            swap(&mut direct.bypass_change_detection().0, &mut body.direct);
        }
        if let Some(controls) = &mut body.controls {
            let Controls {
                force,
                impulse,
                targets,
                grabs,
            } = &mut **controls;
            exchange(&mut self.force, force);
            exchange(&mut self.impulse, impulse);
            exchange(&mut self.targets, targets);
            exchange(&mut self.grabs, grabs);
        }
    }

    /// Whether an app does something to the body.
    fn is_controlled(&self) -> bool {
        self.force.is_some()
            || self.impulse.is_some()
            || self.targets.is_some()
            || self.grabs.is_some()
    }

    /// Lends everything to an empty body.
    fn lend(&mut self, body: &mut Body) {
        match self.is_controlled() {
            true => *body.control() = Controls::default(),
            false => body.controls = None,
        }
        self.exchange(body);
        body.effects = self.carried.effects();
        body.density = self.density.0;
        body.rest = self.rest.0;
        body.sleep = self.sleep.map(|it| it.0);
        body.asleep = self.is_asleep;
        body.quarantine = self.quarantine.map(|it| it.0.clone());
    }

    /// Takes everything back. Returns whether the tick has applied an impulse.
    fn take_back(&mut self, body: &mut Body) -> bool {
        let is_left = body
            .controls
            .as_ref()
            .is_some_and(|it| it.impulse.is_some());
        let is_struck = self.impulse.is_some() && !is_left;
        self.exchange(body);
        self.rest.bypass_change_detection().0 = body.rest;
        if body.is_active() {
            self.particles.set_changed();
            self.states.set_changed();
        }
        is_struck
    }
}

/// Exchanges a component with a part of a body. It does not count as a change, which would wake the body.
fn exchange<C: Component<Mutability = Mutable> + Default>(
    own: &mut Option<Mut<C>>,
    other: &mut Option<C>,
) {
    if let Some(own) = own {
        let lent = other.take().unwrap_or_default();
        *other = Some(replace(own.bypass_change_detection(), lent));
    }
}

/// A body without anything.
fn empty() -> Body {
    static POINT: LazyLock<Arc<Topology>> = LazyLock::new(|| {
        let point = RestShape {
            vertices: vec![Vec3::ZERO],
            ..RestShape::default()
        };
        Arc::new(Topology::new(point).expect("a point is a shape"))
    });
    let mut body = Body::new("", Arc::clone(&POINT), Density::default());
    body.particles = Particles::default();
    body.tick_start = Particles::default();
    body
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

/// A body that the solver has woken, put to sleep or into quarantine, to which it has applied an impulse, or of
/// which it has moved the grab: as it is now.
#[derive(Debug)]
pub(super) struct Turned {
    pub body: Entity,
    pub is_asleep: bool,
    pub quarantine: Option<Quarantine>,
    pub grab: Option<Grab>,
    pub is_struck: bool,
}

/// What the solver needs beside the bodies.
struct Lent<'a> {
    context: &'a StepContext<'a>,
    /// All bodies, by their numbers.
    bodies: &'a [(SpawnOrder, Entity)],
}

/// Room for the bodies while the solver has them, by their numbers.
#[derive(Resource, Debug, Default)]
pub(super) struct Room(Vec<Body>);

/// All bodies, as a system parameter.
#[derive(SystemParam)]
pub(super) struct Bodies<'w, 's> {
    staged: Res<'w, Staged>,
    current: Res<'w, CurrentSubstep>,
    threads: Res<'w, SolverThreads>,
    profile: ResMut<'w, Profile>,
    contacts: ResMut<'w, BodyContacts>,
    room: ResMut<'w, Room>,
    all: Query<'w, 's, (&'static SpawnOrder, Entity), With<SoftBody>>,
    bodies: Query<'w, 's, Parts, With<SoftBody>>,
    records: Res<'w, RecordContacts>,
}

impl Bodies<'_, '_> {
    /// Numbers all bodies in the order in which they were spawned; returns whether that is another than
    /// before.
    pub fn number(&mut self) -> bool {
        let mut all = take(&mut self.contacts.bodies);
        let before = all.len();
        let is_same = before == self.all.iter().len()
            && all
                .iter()
                .all(|(order, body)| self.all.get(*body).is_ok_and(|(own, _)| own == order));
        if !is_same {
            all.clear();
            all.extend(self.all.iter().map(|(order, body)| (*order, body)));
            all.sort_unstable();
            self.room.0.resize_with(all.len(), empty);
        }
        self.contacts.bodies = all;
        !is_same
    }

    /// Lets the solver have the bodies that are `wanted`. Returns what it says, and the bodies that it has
    /// turned.
    fn lend<T>(
        &mut self,
        wanted: impl Fn(&Staged, Entity) -> bool,
        act: impl FnOnce(&mut Tick, &mut [Member], &Lent) -> T,
    ) -> (T, Vec<Turned>) {
        let watch = self.profile.by_part.then(StageWatch::default);
        let context = StepContext {
            watch: watch.as_ref().map(|watch| watch as &dyn Watch),
            ..self.current.context(&self.threads)
        };
        let started = Instant::now();
        let BodyContacts { tick, bodies, .. } = &mut *self.contacts;
        let mut members = tick.list();
        for (number, (body, (_, entity))) in (0..).zip(self.room.0.iter_mut().zip(&*bodies)) {
            if wanted(&self.staged, *entity)
                && let Ok(mut parts) = self.bodies.get_mut(*entity)
            {
                parts.lend(body);
                body.states.records_contacts = self.records.0;
                members.push(Member::new(number, body));
            }
        }
        let lent = Lent {
            context: &context,
            bodies,
        };
        let said = act(tick, &mut members, &lent);
        let mut turned = Vec::new();
        for Member { number, body, .. } in &mut members {
            let (_, entity) = bodies[*number as usize];
            let Ok(mut parts) = self.bodies.get_mut(entity) else {
                continue;
            };
            let is_struck = parts.take_back(body);
            let grab = body.effects.grab;
            let is_turned = is_struck
                || parts.is_asleep != body.asleep
                || parts.quarantine.is_some() != body.quarantine.is_some()
                || parts.carried.grab.copied() != grab;
            if is_turned {
                turned.push(Turned {
                    body: entity,
                    is_asleep: body.asleep,
                    quarantine: body.quarantine.take(),
                    grab,
                    is_struck,
                });
            }
        }
        tick.put_back(members);
        if let Some(watch) = &watch {
            self.profile.distribute(started.elapsed(), watch);
        }
        (said, turned)
    }

    /// The bodies that are stepped stage by stage if these `carriers` are: all that may touch or are joined,
    /// if one of them is a carrier.
    pub fn staged_with(&self, carriers: EntityHashSet) -> Staged {
        let has_meshes = self.current.has_meshes();
        let joined = self.contacts.tick.joined();
        let together = (0..)
            .zip(&self.contacts.bodies)
            .filter(|(number, (_, body))| {
                let parts = self.bodies.get(*body);
                joined.contains(*number)
                    || parts.is_ok_and(|it| it.carried.effects().touches_surfaces(has_meshes))
            });
        let together: Vec<_> = together.map(|(_, (_, body))| *body).collect();
        let group = together.iter().any(|body| carriers.contains(body));
        let mut bodies = carriers;
        bodies.extend(together.into_iter().filter(|_| group));
        Staged::Some { bodies, group }
    }

    /// Begins a tick of all bodies.
    pub fn begin_tick(&mut self, keeps_multipliers: bool) -> Vec<Turned> {
        self.number();
        self.contacts.begin_tick();
        let work = self.work_of((keeps_multipliers, false), Stepping::Whole);
        let ((), turned) = self.lend(
            |_, _| true,
            |tick, bodies, lent| tick.begin(bodies, work, lent.context),
        );
        turned
    }

    /// Goes on with a tick in another frame: bodies may have been added or removed.
    pub fn resume(&mut self) {
        if self.number() {
            self.contacts.tick.contacts.clear();
            self.lend(|_, _| true, |tick, bodies, _| tick.join(bodies));
        }
    }

    fn work_of(&self, (keeps_multipliers, is_tracked): (bool, bool), stepping: Stepping) -> Work {
        Work {
            keeps_multipliers,
            is_tracked,
            has_group: self.staged.groups_take(stepping),
        }
    }

    /// Begins or continues a tick of the bodies that are stepped stage by stage, and begins a substep, unless
    /// it is not the first of some and none of them needs that.
    pub fn begin(&mut self, step: &Substep, keeps_multipliers: bool, is_first: bool) {
        let work = self.work_of((keeps_multipliers, false), Stepping::Staged);
        self.lend(
            |staged, body| staged.takes(body, Stepping::Staged),
            |tick, bodies, lent| {
                if is_first || tick.begins_each_substep(bodies, lent.context) {
                    tick.begin_substep(bodies, step, work, lent.context);
                }
            },
        );
    }

    /// Runs some substeps of a tick, which `begins` with them or has begun, and tracks the energy if
    /// `is_tracked`. Returns the ledger of all bodies, or `None` if one has failed.
    pub fn advance(
        &mut self,
        substeps: &Range<u32>,
        (keeps_multipliers, is_tracked): (bool, bool),
        begins: bool,
    ) -> (Option<Ledger>, Vec<Turned>) {
        if begins {
            self.number();
            self.contacts.begin_tick();
        }
        let work = self.work_of((keeps_multipliers, is_tracked), Stepping::Whole);
        let done = self.lend(
            |staged, body| staged.takes(body, Stepping::Whole),
            |tick, bodies, lent| {
                if begins {
                    tick.begin(bodies, work, lent.context);
                }
                tick.advance(bodies, substeps, work, lent.context)
            },
        );
        self.contacts.collect();
        done
    }

    /// Runs one stage of the substep under way on all bodies that have it. Only the last stage
    /// checks for non-finite values, and turns bodies.
    pub fn stage(&mut self, stage: Stage) -> Vec<Turned> {
        let at = (self.current.step, self.current.iteration);
        let work = self.work_of((false, false), Stepping::Staged);
        let ((), turned) = self.lend(
            |staged, body| staged.takes(body, Stepping::Staged),
            |tick, bodies, lent| tick.stage(bodies, stage, (&at.0, at.1), work, lent.context),
        );
        if stage == Stage::Postsolve {
            self.contacts.collect();
        }
        turned
    }

    /// Ends a tick of which this number of substeps was computed. `see` is called with each body between the
    /// end of its motion and its sleep.
    pub fn end_tick(
        &mut self,
        substeps: u32,
        sleep: &SleepSettings,
        mut see: impl FnMut(Entity, &Body),
    ) -> (TickReport, Vec<Turned>) {
        let mut slept = take(&mut self.contacts.slept);
        slept.clear();
        let done = self.lend(
            |_, _| true,
            |tick, bodies, lent| {
                let report = tick.end(bodies, substeps, lent.context);
                for it in &*bodies {
                    let (_, entity) = lent.bodies[it.number as usize];
                    see(entity, it.body);
                    slept.extend(it.body.asleep.then_some(entity));
                }
                tick.settle(bodies, substeps, sleep, lent.context);
                report
            },
        );
        self.contacts.slept = slept;
        done
    }

    /// Cuts a body between ticks; returns what has become of it, if the cut hits it.
    pub fn cut(&mut self, body: Entity, cut: &Cut) -> (Option<TornBody>, Vec<Turned>) {
        if self.number() {
            self.contacts.tick.contacts.clear();
        }
        let mut all = self.contacts.bodies.iter();
        let number = all.position(|(_, it)| *it == body).map(|it| it as u32);
        self.lend(|_, _| true, |_, bodies, _| tick::cut(bodies, number?, cut))
    }
}
