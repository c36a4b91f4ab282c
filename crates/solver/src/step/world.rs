//! A world without Bevy: the whole method in one loop. What the Bevy schedules do equals this to
//! the bit.

use crate::{
    Body, Collider, Load, Settings, Threads,
    advance::Means,
    contact::collider::{Sweep, Swept},
    lanes::Instructions,
    rest::{SleepSettings, disturbed, written},
};

/// Bodies and colliders that are stepped together.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct World {
    /// Gravity, rate, substeps, iterations.
    pub settings: Settings,
    /// When bodies fall asleep.
    pub sleep: SleepSettings,
    /// The soft bodies.
    pub bodies: Vec<Body>,
    /// The rigid ones.
    pub colliders: Vec<Collider>,
    /// Time since the start [s].
    pub time: f64,
    /// Ticks since the start.
    pub tick: u64,
    /// Threads to step with; one by default. They change no bit.
    pub threads: Threads,
    /// Instructions to step with; by default the best that this machine has. They change no bit.
    pub instructions: Instructions,
    /// What the colliders do in the tick under way: room that is kept, no part of the state.
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
            ..
        } = self;
        let seconds = settings.tick_seconds();
        swept.fill(colliders.iter(), settings, self.time);
        let means = Means {
            settings,
            time: self.time,
            swept,
            threads,
            instructions: *instructions,
            watch: None,
        };
        let step = |body: &mut Body, threads: &Threads| {
            if body.asleep && wakes(body, swept.whole()) {
                body.asleep = false;
                body.rest.reset();
            }
            body.begin_tick();
            if body.is_active() {
                body.advance(&Means { threads, ..means });
            }
            if body.is_active() {
                body.end_tick(seconds as f32, settings.gravity, sleep);
            }
        };
        let sweeps = settings.substeps.get() as usize * settings.substep(0).sweeps() as usize;
        let load = |body: &Body| match body.is_active() {
            true => body.effects.load(&body.topology, sweeps),
            false => Load::default(),
        };
        threads.for_each(bodies, load, &step);
        self.time += seconds;
        self.tick += 1;
    }

    /// The most substeps a tick that single precision [resolves](crate::resolution) here; `None` if any
    /// number.
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

fn wakes(body: &Body, colliders: &[Sweep]) -> bool {
    body.effects.grab.is_some()
        || written(&body.particles, &body.tick_start.positions)
        || body.stitches.are_pulled(colliders)
        || (body.effects.collide.is_some() && disturbed(&body.particles.positions, colliders))
}

impl Body {
    /// Whether it is stepped: neither asleep nor in quarantine.
    #[must_use]
    pub fn is_active(&self) -> bool {
        !self.asleep && self.quarantine.is_none()
    }
}
