//! A world without Bevy: the whole method in one loop. What the Bevy schedules do equals this to
//! the bit.

use super::{
    Body, Collider, Settings,
    contact::collider::Sweep,
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
}

impl World {
    /// A tick of 1/rate seconds.
    pub fn tick(&mut self) {
        let seconds = self.settings.tick_seconds();
        let whole = sweeps(&self.colliders, self.time, self.time + seconds);
        for body in &mut self.bodies {
            if body.asleep && wakes(body, &whole) {
                body.asleep = false;
                body.rest.reset();
            }
            body.begin_tick();
        }
        let h = self.settings.substep_seconds();
        for index in 0..self.settings.substeps.get() {
            let step = self.settings.substep(index);
            let start = self.time + h * f64::from(index);
            let swept = sweeps(&self.colliders, start, start + h);
            for body in self.bodies.iter_mut().filter(|body| body.is_active()) {
                body.presolve(&step);
                for iteration in 0..step.iterations {
                    body.solve(&step, iteration, &swept);
                }
                body.postsolve(&step, &swept);
            }
        }
        for body in self.bodies.iter_mut().filter(|body| body.is_active()) {
            body.end_tick(seconds as f32, &self.sleep);
        }
        self.time += seconds;
        self.tick += 1;
    }

    /// Hash of the state of all bodies.
    #[must_use]
    pub fn state_hash(&self) -> u64 {
        super::measure::state_hash(self.bodies.iter().map(|body| &body.particles))
    }
}

/// What colliders do between two times [s].
#[must_use]
pub fn sweeps(colliders: &[Collider], from: f64, to: f64) -> Vec<Sweep> {
    colliders
        .iter()
        .map(|collider| collider.sweep(from, to))
        .collect()
}

fn wakes(body: &Body, colliders: &[Sweep]) -> bool {
    body.effects.grab.is_some()
        || written(&body.particles, &body.tick_start)
        || (body.effects.collide.is_some() && disturbed(&body.particles.positions, colliders))
}

impl Body {
    /// Whether it is stepped: neither asleep nor in quarantine.
    #[must_use]
    pub fn is_active(&self) -> bool {
        !self.asleep && self.quarantine.is_none()
    }
}
