//! A world without Bevy: the whole method in one loop. The Bevy schedules are bitwise equivalent to
//! it.

use super::{
    body::{CONTACT, restore_at_rest},
    together::{self, GroupedBody, must_step_together},
};
use crate::{
    Body, Collider, Contacts, Settings, Threads, WorkEstimate,
    advance::StepContext,
    contact::{
        collider::{Swept, SweptCollider},
        pairs::{Outline, crossings},
    },
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
        for body in bodies.iter_mut().filter(|body| body.asleep) {
            if wakes(body, swept.whole_tick()) {
                body.wake();
            }
        }
        let has_meshes = swept.has_meshes();
        let all = bodies.iter().map(|body| (&body.effects, body.is_active()));
        let together = must_step_together(all, has_meshes);
        let is_alone = |body: &Body| {
            body.is_active() && !(together && body.effects.touches_surfaces(has_meshes))
        };
        let step = |body: &mut Body, threads: &Threads| {
            body.begin_tick();
            if is_alone(body) {
                body.advance(&StepContext { threads, ..context });
                body.tear(settings);
                body.renew(settings);
            }
            if is_alone(body) && body.end_tick(seconds, settings.gravity, sleep) {
                body.fall_asleep();
            }
        };
        let iterations =
            settings.substeps.get() as usize * settings.substep(0).total_iterations() as usize;
        let estimate = |body: &Body| match is_alone(body) {
            true => body.effects.load(&body.topology, iterations),
            false => WorkEstimate::default(),
        };
        threads.for_each(bodies, estimate, &step);
        if together {
            advance_together(bodies, contacts, &context);
            let touching = bodies
                .iter_mut()
                .filter(|body| body.is_active() && body.effects.touches_surfaces(has_meshes));
            for body in touching {
                body.tear(settings);
                body.renew(settings);
            }
            end_tick_together(bodies, contacts, &context, sleep);
        } else {
            contacts.clear();
        }
        self.time += seconds;
        self.tick += 1;
    }

    /// Number of edge–triangle [crossings].
    #[must_use]
    pub fn crossings(&self) -> usize {
        let outlines = self.bodies.iter().map(|body| Outline {
            effects: &body.effects,
            topology: &body.topology,
            stitches: Some(&body.stitches),
            particles: &body.particles,
        });
        let meshes = self.colliders.iter().filter_map(|it| it.mesh_at(self.time));
        crossings(outlines, &meshes.collect::<Vec<_>>())
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

/// Performs all substeps of a tick for the bodies with contact.
fn advance_together(bodies: &mut [Body], contacts: &mut Contacts, context: &StepContext) {
    let substeps = 0..context.settings.substeps.get();
    let has_meshes = context.swept.has_meshes();
    let mut group = group(bodies, has_meshes);
    together::advance(&mut group, contacts, substeps, false, context);
    let results: Vec<_> = group.into_iter().map(|it| it.result).collect();
    let touching = bodies
        .iter_mut()
        .filter(|body| body.effects.touches_surfaces(has_meshes));
    for (body, result) in touching.zip(results) {
        if let Err(error) = result {
            body.quarantine = Some(body.find_cause(error, CONTACT, context));
            restore_at_rest(&mut body.particles, &body.tick_start.positions);
        }
    }
}

/// Ends a tick of the bodies with contact: those that touch each other fall asleep and wake
/// together.
fn end_tick_together(
    bodies: &mut [Body],
    contacts: &Contacts,
    context: &StepContext,
    sleep: &SleepSettings,
) {
    let seconds = context.settings.tick_seconds();
    let has_meshes = context.swept.has_meshes();
    let can_touch = |body: &&mut Body| body.effects.touches_surfaces(has_meshes);
    let mut group: Vec<Wakefulness> = bodies
        .iter_mut()
        .filter(can_touch)
        .map(|body| match body.is_active() {
            true if body.end_tick(seconds, context.settings.gravity, sleep) => Wakefulness::Still,
            true => Wakefulness::Awake,
            false => Wakefulness::Asleep,
        })
        .collect();
    settle(&mut group, contacts.touching());
    for (body, rest) in bodies.iter_mut().filter(can_touch).zip(group) {
        match rest {
            Wakefulness::Asleep if body.is_active() => body.fall_asleep(),
            Wakefulness::Awake if body.asleep => body.wake(),
            _ => {}
        }
    }
}

/// The bodies with contact.
fn group(bodies: &mut [Body], has_meshes: bool) -> Vec<GroupedBody<'_>> {
    let touching = bodies
        .iter_mut()
        .filter(|body| body.effects.touches_surfaces(has_meshes));
    touching
        .map(|body| {
            let is_active = body.is_active();
            GroupedBody::new(body.stepper(), is_active)
        })
        .collect()
}

fn wakes(body: &Body, colliders: &[SweptCollider]) -> bool {
    body.effects.grab.is_some()
        || written(&body.particles, &body.tick_start.positions)
        || body.stitches.are_pulled(colliders)
        || (body.effects.collide.is_some()
            && disturbed(
                &body.particles.positions,
                body.topology.largest_radius(),
                colliders,
            ))
}

impl Body {
    /// Whether it is stepped: neither sleeping nor in quarantine.
    #[must_use]
    pub fn is_active(&self) -> bool {
        !self.asleep && self.quarantine.is_none()
    }
}
