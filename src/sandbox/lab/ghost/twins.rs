//! The ghosts themselves: a twin in f64 for each body, which goes through the same ticks.

use super::distance::{Distance, Sum};
use crate::{
    solver::{Collider, Effects, Settings, SleepSettings, World, reference, rest::RestTimer},
    study::PROJECTIONS,
};
use bevy::{
    ecs::entity::Entity,
    math::{Vec3, Vec4},
};

/// A tick of the bodies: what was in force in it, and where it took them.
#[derive(Debug, Clone)]
pub struct Moment {
    /// Ticks since the scene began, with this one.
    pub tick: u64,
    /// Gravity, rate, substeps, iterations.
    pub settings: Settings,
    /// The colliders.
    pub colliders: Vec<Collider>,
    /// Real time that there is for a tick [s].
    pub room: f64,
    /// The bodies that have a ghost.
    pub bodies: Vec<Seen>,
}

/// A body after a tick.
#[derive(Debug, Clone)]
pub struct Seen {
    /// The body.
    pub body: Entity,
    /// The effects that acted on it, with the hand.
    pub effects: Effects,
    /// Where its particles are now [m]; w is the inverse mass [1/kg].
    pub positions: Vec<Vec4>,
    /// It is at rest, and was not stepped.
    pub asleep: bool,
}

/// Where ghosts are after a tick.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Comparison {
    /// Ticks since the scene began.
    pub tick: u64,
    /// The ghosts' substeps a tick.
    pub substeps: u32,
    /// For each body with a ghost, how far each particle's ghost is from it [m].
    pub gaps: Vec<(Entity, Vec<Vec3>)>,
    /// How far bodies and ghosts are from each other.
    pub distance: Distance,
    /// Ghosts that were given up since they began, because they were no longer finite.
    pub lost: usize,
}

/// Twins of some bodies.
#[derive(Debug)]
pub struct Twins {
    twins: Vec<Twin>,
    sleep: SleepSettings,
    lost: usize,
}

#[derive(Debug)]
struct Twin {
    body: Entity,
    /// The body's size [m].
    size: f64,
    /// A world of its own: bodies do not touch, and this one may sleep while others do not.
    world: reference::World,
    rest: RestTimer,
    still: bool,
}

impl Twin {
    fn positions(&self) -> Vec<Vec4> {
        let body = &self.world.bodies[0];
        let places = body.x.iter().zip(&body.w);
        places.map(|(x, w)| x.as_vec3().extend(*w as f32)).collect()
    }

    fn finite(&self) -> bool {
        self.world.bodies[0].x.iter().all(|x| x.is_finite())
    }
}

impl Twins {
    /// Begins where the bodies of a world are, moved to where nothing is violated that is rigid for
    /// the twins' substeps: what a solver that does too little leaves violated, theirs would turn
    /// into speed.
    #[must_use]
    pub fn begin(world: &World, entities: &[Entity], settings: Settings) -> Self {
        let twin = |(body, &entity): (&crate::solver::Body, &Entity)| {
            let alone = World {
                bodies: vec![body.clone()],
                settings,
                colliders: world.colliders.clone(),
                time: world.time,
                ..World::default()
            };
            let mut twin = reference::World::of(&alone);
            twin.project(PROJECTIONS);
            Twin {
                body: entity,
                size: body.topology.size.into(),
                world: twin,
                rest: RestTimer::default(),
                still: false,
            }
        };
        Self {
            twins: world.bodies.iter().zip(entities).map(twin).collect(),
            sleep: world.sleep,
            lost: 0,
        }
    }

    /// Does a tick after the bodies did it, with `settings` of the twins' own. Those of bodies that
    /// are gone are gone too. Returns whether any was stepped.
    pub fn follow(&mut self, moment: &Moment, settings: Settings) -> bool {
        let mut stepped = false;
        let seen = |body| moment.bodies.iter().find(|seen| seen.body == body);
        self.twins.retain(|twin| seen(twin.body).is_some());
        for twin in &mut self.twins {
            let Some(seen) = seen(twin.body) else {
                continue;
            };
            if seen.asleep && twin.still {
                twin.world.time += settings.tick_seconds();
                continue;
            }
            stepped = true;
            twin.world.settings = settings;
            twin.world.colliders.clone_from(&moment.colliders);
            let body = &mut twin.world.bodies[0];
            body.carry(&seen.effects);
            for (w, x) in body.w.iter_mut().zip(&seen.positions) {
                *w = f64::from(x.w);
            }
            let gravity = twin.world.settings.gravity.length();
            let before = twin.positions();
            twin.world.tick();
            let seconds = settings.tick_seconds() as f32;
            let after = twin.positions();
            twin.still =
                twin.rest
                    .observe((&before[..], &after[..]), seconds, gravity, &self.sleep);
        }
        let before = self.twins.len();
        self.twins.retain(Twin::finite);
        self.lost += before - self.twins.len();
        stepped
    }

    /// How far they are from their bodies, which are at `bodies`.
    #[must_use]
    pub fn compare(&self, tick: u64, substeps: u32, bodies: &[Seen]) -> Comparison {
        let mut sum = Sum::default();
        let mut gaps = Vec::with_capacity(self.twins.len());
        for twin in &self.twins {
            let Some(seen) = bodies.iter().find(|seen| seen.body == twin.body) else {
                continue;
            };
            let places = twin.world.bodies[0].x.iter().zip(&seen.positions);
            let gap = places.map(|(ghost, body)| {
                let gap = *ghost - body.truncate().as_dvec3();
                sum.add(gap.length(), twin.size);
                gap.as_vec3()
            });
            gaps.push((twin.body, gap.collect()));
        }
        Comparison {
            tick,
            substeps,
            gaps,
            distance: sum.distance(),
            lost: self.lost,
        }
    }
}
