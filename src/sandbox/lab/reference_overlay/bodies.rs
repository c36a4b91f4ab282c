//! The reference overlays themselves: a reference in f64 for each body, which goes through the same ticks.

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
    /// The bodies that have a reference overlay.
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

/// Where reference overlays are after a tick.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Comparison {
    /// Ticks since the scene began.
    pub tick: u64,
    /// The reference overlays' substeps a tick.
    pub substeps: u32,
    /// For each body with a reference overlay, how far each particle's reference overlay is from it [m].
    pub gaps: Vec<(Entity, Vec<Vec3>)>,
    /// How far bodies and reference overlays are from each other.
    pub distance: Distance,
    /// References that were given up since they began, because they were no longer finite.
    pub lost: usize,
}

/// ReferenceBodies of some bodies.
#[derive(Debug)]
pub struct ReferenceBodies {
    references: Vec<ReferenceBody>,
    sleep: SleepSettings,
    lost: usize,
}

#[derive(Debug)]
struct ReferenceBody {
    body: Entity,
    /// The body's size [m].
    size: f64,
    /// A world of its own: bodies do not touch, and this one may sleep while others do not.
    world: reference::World,
    rest: RestTimer,
    still: bool,
}

impl ReferenceBody {
    fn positions(&self) -> Vec<Vec4> {
        let body = &self.world.bodies[0];
        let places = body.x.iter().zip(&body.w);
        places.map(|(x, w)| x.as_vec3().extend(*w as f32)).collect()
    }

    fn finite(&self) -> bool {
        self.world.bodies[0].x.iter().all(|x| x.is_finite())
    }
}

impl ReferenceBodies {
    /// Begins where the bodies of a world are, moved to where nothing is violated that is rigid for
    /// the references' substeps: what a solver that does too little leaves violated, theirs would turn
    /// into speed.
    #[must_use]
    pub fn begin(world: &World, entities: &[Entity], settings: Settings) -> Self {
        let reference = |(body, &entity): (&crate::solver::Body, &Entity)| {
            let alone = World {
                bodies: vec![body.clone()],
                settings,
                colliders: world.colliders.clone(),
                time: world.time,
                ..World::default()
            };
            let mut reference = reference::World::of(&alone);
            reference.project(PROJECTIONS);
            ReferenceBody {
                body: entity,
                size: body.topology.size.into(),
                world: reference,
                rest: RestTimer::default(),
                still: false,
            }
        };
        Self {
            references: world.bodies.iter().zip(entities).map(reference).collect(),
            sleep: world.sleep,
            lost: 0,
        }
    }

    /// Does a tick after the bodies did it, with `settings` of the references' own. Those of bodies that
    /// are gone are gone too. Returns whether any was stepped.
    pub fn follow(&mut self, moment: &Moment, settings: Settings) -> bool {
        let mut stepped = false;
        let seen = |body| moment.bodies.iter().find(|seen| seen.body == body);
        self.references
            .retain(|reference| seen(reference.body).is_some());
        for reference in &mut self.references {
            let Some(seen) = seen(reference.body) else {
                continue;
            };
            if seen.asleep && reference.still {
                reference.world.time += settings.tick_seconds();
                continue;
            }
            stepped = true;
            reference.world.settings = settings;
            reference.world.colliders.clone_from(&moment.colliders);
            let body = &mut reference.world.bodies[0];
            body.carry(&seen.effects);
            for (w, x) in body.w.iter_mut().zip(&seen.positions) {
                *w = f64::from(x.w);
            }
            let gravity = reference.world.settings.gravity.length();
            let before = reference.positions();
            reference.world.tick();
            let seconds = settings.tick_seconds() as f32;
            let after = reference.positions();
            reference.still =
                reference
                    .rest
                    .observe((&before[..], &after[..]), seconds, gravity, &self.sleep);
        }
        let before = self.references.len();
        self.references.retain(ReferenceBody::finite);
        self.lost += before - self.references.len();
        stepped
    }

    /// How far they are from their bodies, which are at `bodies`.
    #[must_use]
    pub fn compare(&self, tick: u64, substeps: u32, bodies: &[Seen]) -> Comparison {
        let mut sum = Sum::default();
        let mut gaps = Vec::with_capacity(self.references.len());
        for reference in &self.references {
            let Some(seen) = bodies.iter().find(|seen| seen.body == reference.body) else {
                continue;
            };
            let places = reference.world.bodies[0].x.iter().zip(&seen.positions);
            let gap = places.map(|(reference_overlay, body)| {
                let gap = *reference_overlay - body.truncate().as_dvec3();
                sum.add(gap.length(), reference.size);
                gap.as_vec3()
            });
            gaps.push((reference.body, gap.collect()));
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
