//! A world without Bevy: the whole method in one loop. The Bevy schedules are bitwise equivalent to
//! it.

use super::{
    emission::{self, Template, around, meet},
    tick::{self, Member, Tick, Work},
};
use crate::{
    Body, Collider, Contacts, Cut, Settings, Threads,
    advance::StepContext,
    colliders::collider::Swept,
    contact::{Outline, Overlapped, crossings, overlaps},
    lanes::Instructions,
    rest::SleepSettings,
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
    /// What bodies have in common in a tick: a cache, not part of the state.
    pub under_way: Tick,
    /// Motion of the colliders in the current tick: a cache, not part of the state.
    pub swept: Swept,
}

impl World {
    /// Contacts between bodies in the last tick.
    #[must_use]
    pub fn contacts(&self) -> &Contacts {
        &self.under_way.contacts
    }

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
            under_way,
            ..
        } = self;
        swept.fill(colliders.iter(), settings, self.time);
        let context = StepContext {
            settings,
            time: self.time,
            swept,
            threads,
            instructions: *instructions,
            watch: None,
        };
        let work = Work {
            keeps_multipliers: true,
            is_tracked: false,
            has_group: true,
        };
        let substeps = settings.substeps.get();
        let mut members = under_way.list();
        members.extend(numbered(bodies));
        under_way.begin(&mut members, work, &context);
        under_way.advance(&mut members, &(0..substeps), work, &context);
        under_way.end(&mut members, substeps, &context);
        under_way.settle(&mut members, substeps, sleep, &context);
        under_way.put_back(members);
        self.emit();
        self.time += self.settings.tick_seconds();
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
            self.under_way.invalidate();
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

    /// Cuts a body between ticks and wakes it, if the cut hits it; returns whether it did. Stitches of other
    /// bodies follow.
    ///
    /// # Panics
    /// If there is no body of this number, from 0.
    pub fn cut(&mut self, number: usize, cut: &Cut) -> bool {
        assert!(number < self.bodies.len(), "there is no body {number}");
        let mut members: Vec<_> = numbered(&mut self.bodies).collect();
        tick::cut(&mut members, number as u32, cut).is_some()
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

fn numbered(bodies: &mut [Body]) -> impl Iterator<Item = Member<'_>> {
    let numbered = (0..).zip(bodies);
    numbered.map(|(number, body)| Member::new(number, body))
}
