//! A tick of bodies, wherever they are kept: in a [`World`](crate::World), or as components.
//!
//! ```text
//! begin      who wakes; input is checked, and the state at the start kept
//! advance    some substeps at once, or stage by stage (see `staged`)
//! end        forces of contacts, tears, grains that appear or disappear
//! settle     who sleeps
//! ```

use super::{
    advance::{NotFinite, StepContext, Stepper},
    copies::{self, Candidate},
    emission::{Slept, spread},
    joints::{self, Joined},
    together::{self, GroupedBody, must_step_together},
};
use crate::{
    Body, Contacts, Cut, Settings, Stitches, Threads, Topology, WorkEstimate,
    colliders::collider::SweptCollider,
    ledger::{self, Ledger},
    rest::{SleepSettings, Wakefulness, disturbed, settle, written},
    step::body::Quarantine,
    topology::{Renewed, Torn},
};
use std::{ops::Range, sync::Arc};

/// What bodies have in common in a tick: a cache, and no part of the state.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tick {
    /// Contacts between bodies.
    pub contacts: Contacts,
    /// Bodies that stitches join, which are stepped together to the end of the tick, also where the last
    /// stitch between them breaks.
    joined: Joined,
    /// Numbers of the bodies that were stepped together last, by their places in `contacts`.
    group: Vec<u32>,
    room: Room,
}

/// Memory that ticks use again.
#[derive(Debug, Default)]
struct Room {
    members: Vec<Member<'static>>,
    rests: Vec<Wakefulness>,
    pairs: Vec<[u32; 2]>,
}

impl Clone for Room {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl PartialEq for Room {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// A body in a tick.
#[derive(Debug)]
pub struct Member<'a> {
    /// Its number among the bodies of the world, from 0.
    pub number: u32,
    /// The body.
    pub body: &'a mut Body,
    /// Whether it is stepped together with others, if any are.
    pub(super) is_grouped: bool,
    pub(super) outcome: Result<Ledger, NotFinite>,
    /// What has become of its particles at the end of the tick, if anything has.
    torn: Option<Box<TornBody>>,
    renewed: Option<Box<Renewed>>,
}

impl<'a> Member<'a> {
    /// The body with this number.
    #[must_use]
    pub fn new(number: u32, body: &'a mut Body) -> Self {
        Self {
            number,
            body,
            is_grouped: false,
            outcome: Ok(Ledger::default()),
            torn: None,
            renewed: None,
        }
    }
}

/// How substeps are performed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Work {
    /// Whether multipliers of elastic effects are kept, for later iterations or measurements.
    pub keeps_multipliers: bool,
    /// Whether the energy is tracked, which takes about three times as long.
    pub is_tracked: bool,
    /// Whether bodies that touch or are joined are among those given; if they are, all of them are.
    pub has_group: bool,
}

/// What has become of the bodies at the end of a tick.
#[derive(Debug, Default)]
pub struct TickReport {
    /// Bodies that were torn.
    pub torn: Vec<Box<TornBody>>,
    /// Bodies in which grains have appeared or disappeared, by their numbers.
    pub renewed: Vec<(u32, Box<Renewed>)>,
}

/// A body that was torn or cut.
#[derive(Debug)]
pub struct TornBody {
    /// Its number.
    pub number: u32,
    /// Its topology before.
    pub before: Arc<Topology>,
    /// What has become of its particles.
    pub torn: Torn,
}

/// Work on bodies that are stepped together, where it differs from that on each.
pub(super) type Together<'a> = &'a dyn Fn(&mut [GroupedBody], &mut Contacts, &StepContext);

/// Work on copies of a body that is faster than that on each.
pub(super) type OnCopies<'a> = &'a (dyn Fn(&mut [Member], &StepContext) + Sync);

impl Tick {
    /// An empty list for the bodies of a tick, which [`put_back`](Self::put_back) takes when they are not needed
    /// any more.
    pub fn list<'a>(&mut self) -> Vec<Member<'a>> {
        emptied(std::mem::take(&mut self.room.members))
    }

    /// Keeps the memory of a list.
    pub fn put_back(&mut self, list: Vec<Member<'_>>) {
        self.room.members = emptied(list);
    }

    /// Bodies were added or removed.
    pub fn invalidate(&mut self) {
        self.contacts.invalidate();
    }

    /// Number of the body at a place in the contacts.
    ///
    /// # Panics
    /// If there is none.
    #[must_use]
    pub fn number(&self, place: u32) -> u32 {
        self.group[place as usize]
    }

    /// The bodies that are joined by stitches.
    #[must_use]
    pub fn joined(&self) -> &Joined {
        &self.joined
    }

    /// Whether a body is stepped together with others, if any are.
    #[must_use]
    pub fn groups(&self, number: u32, body: &Body, context: &StepContext) -> bool {
        body.effects.touches_surfaces(context.swept.has_meshes()) || self.joined.contains(number)
    }

    /// Begins a tick of all bodies: wakes what is disturbed, puts bodies with an input that is not sound
    /// into quarantine, and stores the state at the start.
    pub fn begin(&mut self, bodies: &mut [Member], work: Work, context: &StepContext) {
        self.contacts.begin_tick();
        wake_disturbed(bodies, context.swept.whole_tick());
        let load = |it: &Member| WorkEstimate {
            projections: it.body.particles.len(),
            pieces: 1,
        };
        context
            .threads
            .for_each(bodies, load, &|it: &mut Member, _| {
                it.body.begin_tick(work.keeps_multipliers);
            });
        self.join(bodies);
    }

    /// Finds what stitches join.
    pub fn join(&mut self, bodies: &[Member]) {
        let stitches = bodies.iter().map(|it| (it.number, &it.body.stitches));
        self.joined = Joined::of(stitches, bodies.len());
    }

    /// Performs some substeps of a tick, and returns the energy ledger of the bodies: empty unless it is
    /// tracked, `None` if one has failed. That one is in quarantine then, where it was at the start of the
    /// tick: the substeps before the failed one are finite, but usually already torn apart.
    pub fn advance(
        &mut self,
        bodies: &mut [Member],
        substeps: &Range<u32>,
        work: Work,
        context: &StepContext,
    ) -> Option<Ledger> {
        let settings = context.settings;
        let iterations = substeps.len() * settings.substep(0).total_iterations() as usize;
        // The tick has prepared them at its beginning.
        let goes_on = substeps.start > 0;
        let prepare = |body: &mut Stepper| {
            if goes_on {
                body.prepare(work.keeps_multipliers);
            }
        };
        let on_copies: OnCopies = &|copies, context| {
            for it in &mut *copies {
                prepare(&mut it.body.stepper());
            }
            let steppers = copies.iter_mut().map(|it| it.body.stepper());
            let results = copies::advance(steppers, substeps, context);
            for (it, result) in copies.iter_mut().zip(results) {
                it.outcome = result.map(|()| Ledger::default());
            }
        };
        let together: Together = &|group, contacts, context| {
            together::each(group, context, |it, _| prepare(&mut it.body));
            together::advance(group, contacts, substeps.clone(), work.is_tracked, context);
        };
        self.work(
            bodies,
            iterations,
            |body, context| {
                prepare(body);
                match work.is_tracked {
                    true => ledger::advance(body, substeps.clone(), context),
                    false => {
                        body.advance(substeps.clone(), context)?;
                        Ok(Ledger::default())
                    }
                }
            },
            Some(on_copies).filter(|_| !work.is_tracked),
            Some(together).filter(|_| work.has_group),
            context,
        );
        self.finish(bodies, context)
    }

    /// Performs `each`, with a work estimate for this number of iterations, on every body that is stepped;
    /// on copies of a body `on_copies` instead, and on bodies that touch or are joined `together`, if given.
    pub(super) fn work(
        &mut self,
        bodies: &mut [Member],
        iterations: usize,
        each: impl Fn(&mut Stepper, &StepContext) -> Result<Ledger, NotFinite> + Sync,
        on_copies: Option<OnCopies>,
        together: Option<Together>,
        context: &StepContext,
    ) {
        let has_meshes = context.swept.has_meshes();
        for it in &mut *bodies {
            it.is_grouped = self.groups(it.number, it.body, context);
        }
        let could_be_together = together.is_some();
        let together = together.filter(|_| {
            let all = bodies
                .iter()
                .map(|it| (&it.body.effects, it.body.is_active()));
            must_step_together(all, &self.joined, has_meshes)
        });
        // Copies of a body follow each other.
        bodies.sort_unstable_by_key(|it| (together.is_some() && it.is_grouped, it.number));
        let alone = match together {
            Some(_) => bodies.partition_point(|it| !it.is_grouped),
            None => bodies.len(),
        };
        let (alone, group) = bodies.split_at_mut(alone);
        let load = |it: &Member| match it.body.is_active() {
            true => it
                .body
                .direct
                .load(&it.body.effects, &it.body.topology, iterations),
            false => WorkEstimate::default(),
        };
        let are_copies = |a: &Member, b: &Member| {
            on_copies.is_some()
                && a.body.is_active()
                && b.body.is_active()
                && a.body.is_copy_of(b.body, context.settings)
        };
        let size = |first: &Member, copies, threads| {
            copies::group_size(&first.body.topology, copies, threads, context.instructions)
        };
        context.threads.for_each_group(
            alone,
            (are_copies, size),
            load,
            &|members: &mut [Member], threads: &Threads| {
                let context = StepContext {
                    threads,
                    ..*context
                };
                match (members, on_copies) {
                    ([it], _) if it.body.is_active() => {
                        it.outcome = each(&mut it.body.stepper(), &context);
                    }
                    (members, Some(on_copies)) if members.len() > 1 => on_copies(members, &context),
                    _ => {}
                }
            },
        );
        if let Some(together) = together {
            self.group.clear();
            self.group.extend(group.iter().map(|it| it.number));
            let bodies = group.iter_mut().map(|it| {
                let is_active = it.body.is_active();
                GroupedBody::new(it.number, it.body.stepper(), is_active)
            });
            let mut bodies: Vec<_> = bodies.collect();
            together(&mut bodies, &mut self.contacts, context);
            let results: Vec<_> = bodies.into_iter().map(|it| it.result).collect();
            for (it, result) in group.iter_mut().zip(results) {
                it.outcome = result;
            }
        } else if could_be_together {
            self.group.clear();
            self.contacts.clear();
        }
        bodies.sort_unstable_by_key(|it| it.number);
    }

    /// Ends some work: puts bodies that failed into quarantine. Returns the sum of the ledgers, or `None` if
    /// one failed.
    pub(super) fn finish(&self, bodies: &mut [Member], context: &StepContext) -> Option<Ledger> {
        let mut all = Some(Ledger::default());
        for it in bodies {
            match std::mem::replace(&mut it.outcome, Ok(Ledger::default())) {
                Ok(ledger) => {
                    if let Some(all) = &mut all {
                        *all += ledger;
                    }
                }
                Err(error) => {
                    all = None;
                    let has_meshes = context.swept.has_meshes();
                    let other = if it.body.effects.touches_surfaces(has_meshes) {
                        Quarantine::CONTACT
                    } else if self.joined.contains(it.number) {
                        Quarantine::JOINTS
                    } else {
                        Quarantine::USER
                    };
                    it.body.fail(error, other, context);
                }
            }
        }
        all
    }

    /// Ends a tick of which this number of substeps was computed: takes the forces of contacts, tears bodies
    /// that are above their limits, and adds and removes grains. Stitches of all bodies follow.
    pub fn end(
        &mut self,
        bodies: &mut [Member],
        substeps: u32,
        context: &StepContext,
    ) -> TickReport {
        let settings = context.settings;
        let seconds = seconds_of(substeps, settings);
        let load = |it: &Member| WorkEstimate {
            projections: match it.body.is_active() {
                true => it.body.particles.len(),
                false => 0,
            },
            pieces: 1,
        };
        context
            .threads
            .for_each(bodies, load, &|it: &mut Member, _| {
                if it.body.is_active() {
                    it.body.states.end_contacts(&it.body.particles, seconds);
                    it.torn = split(it.number, it.body, |body| body.tear(settings)).map(Box::new);
                    it.renewed = it.body.renew(settings).map(Box::new);
                }
            });
        let mut report = TickReport::default();
        for it in &mut *bodies {
            report.torn.extend(it.torn.take());
            let renewed = it.renewed.take().map(|renewed| (it.number, renewed));
            report.renewed.extend(renewed);
        }
        for it in &report.torn {
            joints::follow(stitches(bodies), it.number, Some(&it.torn), None);
        }
        for (number, renewed) in &report.renewed {
            joints::follow(stitches(bodies), *number, None, Some(renewed));
        }
        report
    }

    /// Lets bodies sleep that have been at rest for long enough, with those that they touch or are joined to,
    /// and wakes those that touch one that is awake, after a tick of which this number of substeps was
    /// computed.
    pub fn settle(
        &mut self,
        bodies: &mut [Member],
        substeps: u32,
        sleep: &SleepSettings,
        context: &StepContext,
    ) {
        let settings = context.settings;
        let (seconds, tick) = (seconds_of(substeps, settings), settings.tick_seconds());
        let all = settings.substeps.get();
        let early = (substeps < all).then(|| substeps as f32 / all as f32);
        let place = |number: u32| bodies.binary_search_by_key(&number, |it| it.number).ok();
        let touching = self.contacts.touching().iter();
        let touching = touching.map(|pair| pair.map(|place| self.group[place as usize]));
        let pairs = touching
            .chain(self.joined.pairs().iter().copied())
            .filter_map(|[a, b]| Some([place(a)? as u32, place(b)? as u32]));
        self.room.pairs.clear();
        self.room.pairs.extend(pairs);
        let rests = bodies.iter_mut().map(|Member { body, .. }| {
            if let Some(grab) = &mut body.effects.grab {
                grab.end_tick(early, tick as f32);
            }
            let controls = body.controls.as_mut();
            if let Some(grabs) = controls.and_then(|it| it.grabs.as_mut()) {
                grabs.end_tick(early, tick as f32);
            }
            match body.is_active() {
                true if body.is_still(seconds, settings.gravity, sleep) => Wakefulness::Still,
                true => Wakefulness::Awake,
                false => Wakefulness::Asleep,
            }
        });
        let Room {
            rests: all, pairs, ..
        } = &mut self.room;
        all.clear();
        all.extend(rests);
        settle(all, pairs);
        for (Member { body, .. }, rest) in bodies.iter_mut().zip(all) {
            match rest {
                Wakefulness::Asleep if body.is_active() => body.fall_asleep(),
                Wakefulness::Awake if body.asleep => body.wake(),
                _ => {}
            }
        }
    }
}

/// Cuts the body of a number between ticks and wakes it, if the cut hits it; stitches of the others follow.
pub fn cut(bodies: &mut [Member], number: u32, cut: &Cut) -> Option<TornBody> {
    let it = bodies.iter_mut().find(|it| it.number == number)?;
    let torn = split(number, it.body, |body| body.cut(cut))?;
    it.body.wake();
    joints::follow(stitches(bodies), number, Some(&torn.torn), None);
    Some(torn)
}

fn split(
    number: u32,
    body: &mut Body,
    by: impl FnOnce(&mut Body) -> Option<Torn>,
) -> Option<TornBody> {
    let before = Arc::clone(&body.topology);
    by(body).map(|torn| TornBody {
        number,
        before,
        torn,
    })
}

fn stitches<'a>(bodies: &'a mut [Member]) -> impl Iterator<Item = &'a mut Stitches> {
    bodies.iter_mut().map(|it| &mut it.body.stitches)
}

/// Uses the memory of a list for bodies of another lifetime.
fn emptied<'a>(mut list: Vec<Member<'_>>) -> Vec<Member<'a>> {
    list.clear();
    list.into_iter()
        .map(|_| unreachable!("the list is empty"))
        .collect()
}

/// Simulated time of a tick of which this number of substeps was computed [s].
fn seconds_of(substeps: u32, settings: &Settings) -> f64 {
    match substeps < settings.substeps.get() {
        true => settings.substep_seconds() * f64::from(substeps),
        false => settings.tick_seconds(),
    }
}

/// Wakes bodies that are grabbed or moved, whose velocity was set, or that a collider moves past; and those
/// that rested on them: what these are about to do, they do not see otherwise.
fn wake_disturbed(bodies: &mut [Member], colliders: &[SweptCollider]) {
    if !bodies.iter().any(|it| it.body.asleep) {
        return;
    }
    let is_woken = |it: &Member| it.body.asleep && wakes(it.body, colliders);
    let mut woken: Vec<bool> = bodies.iter().map(is_woken).collect();
    if woken.contains(&true) {
        let slept = bodies.iter().map(|it| {
            let slept = Slept {
                topology: &it.body.topology,
                effects: it.body.effects,
                start: &it.body.tick_start,
            };
            it.body.asleep.then(|| slept.boxes())
        });
        spread(&slept.collect::<Vec<_>>(), &mut woken);
    }
    for (it, woken) in bodies.iter_mut().zip(woken) {
        if woken {
            it.body.wake();
        }
    }
}

fn wakes(body: &Body, colliders: &[SweptCollider]) -> bool {
    let (topology, particles) = (&body.topology, &body.particles);
    let controls = body.controls.as_ref();
    let targets = controls.and_then(|it| it.targets.as_ref());
    let is_pinned = |i: usize| particles.positions[i].w == 0.0;
    body.effects.grab.is_some()
        || controls.is_some_and(|it| it.hold_awake())
        || targets.is_some_and(|it| it.lead_away(topology, is_pinned, |i| particles.position(i)))
        || written(&body.particles, &body.tick_start.positions)
        || body.stitches.are_pulled(colliders)
        || disturbed(
            &body.topology,
            &body.effects,
            &body.particles.positions,
            colliders,
        )
}

impl Body {
    /// Whether the two can be stepped side by side.
    fn is_copy_of(&self, other: &Self, settings: &Settings) -> bool {
        let are_free = self.controls.is_none() && other.controls.is_none();
        let [body, other] = [self, other].map(|it| Candidate {
            topology: &it.topology,
            effects: &it.effects,
            stitches: Some(&it.stitches),
        });
        are_free && body.is_copy_of(&other, settings)
    }

    /// Whether it is stepped: neither sleeping nor in quarantine.
    #[must_use]
    pub fn is_active(&self) -> bool {
        !self.asleep && self.quarantine.is_none()
    }
}
