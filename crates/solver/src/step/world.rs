//! A world without Bevy: the whole method in one loop. The Bevy schedules are bitwise equivalent to
//! it.

use super::{
    body::Quarantine,
    copies::{self, Candidate},
    emission::{self, Slept, Template, around, meet, spread},
    joints::{self, Joined},
    together::{self, GroupedBody, must_step_together},
};
use crate::{
    Body, Collider, Contacts, Cut, Settings, Threads, WorkEstimate,
    advance::StepContext,
    colliders::collider::{Swept, SweptCollider},
    contact::{Outline, Overlapped, crossings, overlaps},
    lanes::Instructions,
    rest::{SleepSettings, Wakefulness, disturbed, settle, written},
};

/// Bodies and colliders that are stepped together.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct World {
    /// Gravity, rate, substeps, iterations.
    pub settings: Settings,
    /// Sleep settings.
    pub sleep: SleepSettings,
    /// The soft bodies.
    pub bodies: Vec<Body>,
    /// The rigid colliders.
    pub colliders: Vec<Collider>,
    /// Time since the start [s].
    pub time: f64,
    /// Ticks since the start.
    pub tick: u64,
    /// Threads for stepping; one by default. They do not affect results.
    pub threads: Threads,
    /// Instruction set for stepping; by default the best of this machine. It does not affect
    /// results.
    pub instructions: Instructions,
    /// Contacts between bodies: a cache, not part of the state.
    pub contacts: Contacts,
    /// Motion of the colliders in the current tick: a cache, not part of the state.
    pub swept: Swept,
}

impl World {
    /// A tick of 1/rate seconds.
    pub fn tick(&mut self) {
        let Self {
            settings,
            sleep,
            bodies,
            colliders,
            threads,
            swept,
            instructions,
            contacts,
            ..
        } = self;
        contacts.begin_tick();
        let seconds = settings.tick_seconds();
        swept.fill(colliders.iter(), settings, self.time);
        let context = StepContext {
            settings,
            time: self.time,
            swept,
            threads,
            instructions: *instructions,
            watch: None,
        };
        if bodies.iter().any(|body| body.asleep) {
            let is_woken = |body: &Body| body.asleep && wakes(body, swept.whole_tick());
            let woken: Vec<bool> = bodies.iter().map(is_woken).collect();
            wake_with_neighbors(bodies, woken);
        }
        for body in bodies.iter_mut().filter(|body| body.is_active()) {
            body.choose_solver(settings);
        }
        let has_meshes = swept.has_meshes();
        let stitches = (0..).zip(bodies.iter().map(|body| &body.stitches));
        let joined = Joined::of(stitches, bodies.len());
        let all = bodies.iter().map(|body| (&body.effects, body.is_active()));
        let together = must_step_together(all, &joined, has_meshes);
        if together {
            let members = (0..).zip(&mut *bodies).map(|(number, body)| Member {
                number,
                is_grouped: body.effects.touches_surfaces(has_meshes) || joined.contains(number),
                body,
            });
            let mut members: Vec<_> = members.collect();
            step_alone(&mut members, &context, sleep);
            members.retain(|it| it.is_grouped);
            advance_together(&mut members, contacts, &context);
            for place in 0..members.len() {
                let Member { number, body, .. } = &mut members[place];
                if body.is_active() {
                    let number = *number;
                    let torn = body.tear(settings);
                    let renewed = body.renew(settings);
                    let stitches = members.iter_mut().map(|it| &mut it.body.stitches);
                    joints::follow(stitches, number, torn.as_ref(), renewed.as_ref());
                }
            }
            end_tick_together(&mut members, (contacts, &joined), &context, sleep);
        } else {
            step_alone(bodies, &context, sleep);
            contacts.clear();
        }
        self.emit();
        self.time += seconds;
        self.tick += 1;
    }

    /// Adds the copies that leave an emitter at the end of a tick, and removes what disappears.
    fn emit(&mut self) {
        if !self.bodies.iter().any(|it| it.effects.changes_bodies()) {
            return;
        }
        let gone = emission::gone(&self.bodies, &self.settings);
        let mut changes = !gone.is_empty();
        for number in gone.into_iter().rev() {
            self.remove(number as usize);
        }
        for number in 0..self.bodies.len() {
            let births = emission::births(&mut self.bodies, number, &self.settings);
            let source = &self.bodies[number];
            let template = Template {
                name: &source.name,
                topology: &source.topology,
                density: source.density,
                added_mass: &source.added_mass,
                stitches: &source.stitches,
                effects: source.effects,
                sleep: source.sleep,
            };
            let flow = source.particles.emission.copies;
            let copies: Vec<_> = template.copies(number as u32, &flow, &births).collect();
            changes |= !copies.is_empty();
            self.bodies.extend(copies);
        }
        if changes {
            self.contacts.invalidate();
        }
    }

    /// Removes a body. Stitches of others to it break; these and bodies that rested on it wake.
    ///
    /// # Panics
    /// If there is no body of this number, from 0.
    pub fn remove(&mut self, number: usize) -> Body {
        let gone = self.bodies.remove(number);
        let joined = gone
            .stitches
            .intact_joints()
            .map(|(_, other, _)| other as usize);
        let joined: Vec<usize> = joined.filter(|other| *other != number).collect();
        for other in joined {
            let place = other - usize::from(other > number);
            if let Some(body) = self.bodies.get_mut(place) {
                body.wake();
            }
        }
        let left = around(&gone);
        for body in &mut self.bodies {
            if body.asleep
                && left.is_some_and(|left| around(body).is_some_and(|own| meet(own, left)))
            {
                body.wake();
            }
            body.particles.emission.forget_body(number as u32);
            if body.stitches.forget_body(number as u32) {
                body.wake();
            }
        }
        gone
    }

    /// Cuts a body between ticks; returns whether the cut hit it. Stitches of other bodies follow.
    ///
    /// # Panics
    /// If there is no body of this number, from 0.
    pub fn cut(&mut self, number: usize, cut: &Cut) -> bool {
        let torn = self.bodies[number].cut(cut);
        let stitches = self.bodies.iter_mut().map(|body| &mut body.stitches);
        joints::follow(stitches, number as u32, torn.as_ref(), None);
        torn.is_some()
    }

    /// Number of edge–triangle [crossings].
    #[must_use]
    pub fn crossings(&self) -> usize {
        let meshes = self.colliders.iter().filter_map(|it| it.mesh_at(self.time));
        crossings(self.outlines(), &meshes.collect::<Vec<_>>())
    }

    /// The bodies that [overlap](overlaps) what they have contact with.
    #[must_use]
    pub fn overlaps(&self) -> Vec<(usize, Overlapped)> {
        overlaps(self.outlines(), &self.colliders, self.time)
    }

    fn outlines(&self) -> impl Iterator<Item = Outline<'_>> {
        self.bodies.iter().map(|body| Outline {
            effects: &body.effects,
            topology: &body.topology,
            stitches: Some(&body.stitches),
            particles: &body.particles,
        })
    }

    /// Maximum number of substeps per tick that single precision [resolves](crate::resolution)
    /// here; `None` if there is no limit.
    #[must_use]
    pub fn resolved_substeps(&self) -> Option<u32> {
        let gravity = self.settings.gravity.as_dvec3().length();
        crate::resolution::max_substeps(&self.bodies, self.settings.tick_seconds(), gravity)
    }

    /// Hash of the state of all bodies.
    #[must_use]
    pub fn state_hash(&self) -> u64 {
        crate::measure::state_hash(self.bodies.iter().map(|body| &body.particles))
    }
}

/// A body in a tick.
struct Member<'a> {
    /// Its number, from 0.
    number: u32,
    body: &'a mut Body,
    /// Whether it is stepped together with others.
    is_grouped: bool,
}

/// Performs all substeps of a tick for the bodies with contact, or that stitches join.
fn advance_together(bodies: &mut [Member], contacts: &mut Contacts, context: &StepContext) {
    let substeps = 0..context.settings.substeps.get();
    let group = bodies.iter_mut().map(|it| {
        let is_active = it.body.is_active();
        GroupedBody::new(it.number, it.body.stepper(), is_active)
    });
    let mut group: Vec<_> = group.collect();
    together::advance(&mut group, contacts, substeps, false, context);
    let results: Vec<_> = group.into_iter().map(|it| it.result).collect();
    for (Member { body, .. }, result) in bodies.iter_mut().zip(results) {
        if !body.is_active() {
            continue;
        }
        let other = match body.effects.touches_surfaces(context.swept.has_meshes()) {
            true => Quarantine::CONTACT,
            false => Quarantine::JOINTS,
        };
        body.end_advance(result.map(drop), other, context);
    }
}

/// A body, or one in a list.
trait Listed: Send {
    fn body(&self) -> &Body;

    fn body_mut(&mut self) -> &mut Body;

    /// Whether it is stepped together with others.
    fn is_grouped(&self) -> bool;
}

impl Listed for Body {
    fn body(&self) -> &Body {
        self
    }

    fn body_mut(&mut self) -> &mut Body {
        self
    }

    fn is_grouped(&self) -> bool {
        false
    }
}

impl Listed for Member<'_> {
    fn body(&self) -> &Body {
        self.body
    }

    fn body_mut(&mut self) -> &mut Body {
        self.body
    }

    fn is_grouped(&self) -> bool {
        self.is_grouped
    }
}

/// Begins a tick of bodies, and performs the rest of it for those that are not stepped together with
/// others.
fn step_alone<T: Listed>(bodies: &mut [T], context: &StepContext, sleep: &SleepSettings) {
    let settings = context.settings;
    let iterations =
        settings.substeps.get() as usize * settings.substep(0).total_iterations() as usize;
    let is_stepped = |it: &T| it.body().is_active() && !it.is_grouped();
    let load = |it: &T| match (is_stepped(it), it.body()) {
        (true, body) => body.direct.load(&body.effects, &body.topology, iterations),
        (false, _) => WorkEstimate::default(),
    };
    let are_copies =
        |a: &T, b: &T| is_stepped(a) && is_stepped(b) && a.body().is_copy_of(b.body(), settings);
    context.threads.for_each_group(
        bodies,
        (are_copies, |first, copies, threads| {
            let topology = &first.body().topology;
            copies::group_size(topology, copies, threads, context.instructions)
        }),
        load,
        &|group: &mut [T], threads: &Threads| {
            let context = StepContext {
                threads,
                ..*context
            };
            group.iter_mut().for_each(|it| it.body_mut().begin_tick());
            match &mut *group {
                [it] if is_stepped(it) => it.body_mut().advance(&context),
                [_] => {}
                copies => advance_copies(copies, &context),
            }
            for it in group.iter_mut().filter(|it| is_stepped(it)) {
                let body = it.body_mut();
                body.tear(settings);
                body.renew(settings);
                if body.end_tick(settings.tick_seconds(), settings.gravity, sleep) {
                    body.fall_asleep();
                }
            }
        },
    );
}

/// Performs all substeps of a tick for bodies each of which is a copy of the one before.
fn advance_copies<T: Listed>(copies: &mut [T], context: &StepContext) {
    let substeps = 0..context.settings.substeps.get();
    let all = copies.iter_mut().map(Listed::body_mut);
    let steppers = all.filter(|it| it.is_active()).map(Body::stepper);
    let results = copies::advance(steppers, &substeps, context);
    let all = copies.iter_mut().map(Listed::body_mut);
    for (body, result) in all.filter(|it| it.is_active()).zip(results) {
        body.end_advance(result, Quarantine::USER, context);
    }
}

/// Ends a tick of bodies that were stepped together: those that touch each other or are joined fall
/// asleep and wake together.
fn end_tick_together(
    bodies: &mut [Member],
    (contacts, joined): (&Contacts, &Joined),
    context: &StepContext,
    sleep: &SleepSettings,
) {
    let seconds = context.settings.tick_seconds();
    let place = |number: u32| bodies.binary_search_by_key(&number, |it| it.number).ok();
    let joined = joined.pairs().iter().filter_map(|[a, b]| {
        let [a, b] = [place(*a)?, place(*b)?];
        Some([a as u32, b as u32])
    });
    let pairs: Vec<_> = contacts.touching().iter().copied().chain(joined).collect();
    let mut group: Vec<Wakefulness> = bodies
        .iter_mut()
        .map(|Member { body, .. }| match body.is_active() {
            true if body.end_tick(seconds, context.settings.gravity, sleep) => Wakefulness::Still,
            true => Wakefulness::Awake,
            false => Wakefulness::Asleep,
        })
        .collect();
    settle(&mut group, &pairs);
    for (Member { body, .. }, rest) in bodies.iter_mut().zip(group) {
        match rest {
            Wakefulness::Asleep if body.is_active() => body.fall_asleep(),
            Wakefulness::Awake if body.asleep => body.wake(),
            _ => {}
        }
    }
}

/// Wakes bodies, and those that rested on them: what they are about to do, these do not see otherwise.
fn wake_with_neighbors(bodies: &mut [Body], mut woken: Vec<bool>) {
    if woken.contains(&true) {
        let slept = bodies.iter().map(|body| {
            let slept = Slept {
                topology: &body.topology,
                effects: body.effects,
                start: &body.tick_start,
            };
            body.asleep.then(|| slept.boxes())
        });
        spread(&slept.collect::<Vec<_>>(), &mut woken);
    }
    for (body, woken) in bodies.iter_mut().zip(woken) {
        if woken {
            body.wake();
        }
    }
}

fn wakes(body: &Body, colliders: &[SweptCollider]) -> bool {
    body.effects.grab.is_some()
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
        let [body, other] = [self, other].map(|it| Candidate {
            topology: &it.topology,
            effects: &it.effects,
            stitches: Some(&it.stitches),
        });
        body.is_copy_of(&other, settings)
    }

    /// Whether it is stepped: neither sleeping nor in quarantine.
    #[must_use]
    pub fn is_active(&self) -> bool {
        !self.asleep && self.quarantine.is_none()
    }
}
