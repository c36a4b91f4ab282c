//! The f64 references of the bodies, stepped through the same ticks.

use super::distance::{Distance, Sum};
use crate::{
    solver::{
        Collider, Effects, Settings, World, reference,
        rest::{Calm, RestTimer, SleepSettings},
    },
    study::PROJECTIONS,
};
use bevy::{
    ecs::entity::Entity,
    math::{Vec3, Vec4},
};

/// The inputs of a tick, and the state of the bodies after it.
#[derive(Debug, Clone)]
pub struct Moment {
    /// Ticks since the start of the scene, including this one.
    pub tick: u64,
    /// Gravity, rate, substeps, iterations.
    pub settings: Settings,
    /// The colliders.
    pub colliders: Vec<Collider>,
    /// Real time available per tick [s].
    pub room: f64,
    /// The bodies that have a reference.
    pub bodies: Vec<Seen>,
}

/// State of a body after a tick.
#[derive(Debug, Clone)]
pub struct Seen {
    /// The body.
    pub body: Entity,
    /// The effects that acted on it, including the grab.
    pub effects: Effects,
    /// Positions of its particles [m]; w is the inverse mass [1/kg].
    pub positions: Vec<Vec4>,
    /// Whether it is asleep and was not stepped.
    pub asleep: bool,
}

/// Distances between bodies and references after a tick.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Comparison {
    /// Ticks since the start of the scene.
    pub tick: u64,
    /// Substeps per tick of the references.
    pub substeps: u32,
    /// For each body with a reference, the offset of the reference from each particle [m].
    pub gaps: Vec<(Entity, Vec<Vec3>)>,
    /// Distances between bodies and references.
    pub distance: Distance,
    /// References that were removed because they diverged.
    pub lost: usize,
}

/// The f64 references of some bodies.
#[derive(Debug)]
pub struct ReferenceBodies {
    references: Vec<ReferenceBody>,
    sleep: SleepSettings,
    lost: usize,
}

#[derive(Debug)]
struct ReferenceBody {
    body: Entity,
    /// Size of the body [m].
    size: f64,
    /// A separate world for each body: bodies do not touch, and each can sleep on its own.
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

    /// Whether the body has not been torn since.
    fn is_of(&self, seen: &Seen) -> bool {
        self.world.bodies[0].x.len() == seen.positions.len()
    }

    fn finite(&self) -> bool {
        self.world.bodies[0].x.iter().all(|x| x.is_finite())
    }
}

impl ReferenceBodies {
    /// Starts from the state of the bodies, projected so that constraints that are rigid at the
    /// references' step size are satisfied. Otherwise the references would turn constraint errors
    /// of an unconverged solver into velocity.
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

    /// Steps the references through a tick that the bodies have done, with the references' own
    /// `settings`. Drops the references of bodies that were removed. Returns whether any reference
    /// was stepped.
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
            // A reference that tears elsewhere could not be compared, so a torn body loses it. It is
            // alone, and nothing comes or goes.
            body.carry(&Effects {
                tear: None,
                emitter: None,
                body_emitter: None,
                sink: None,
                ..seen.effects
            });
            for (w, x) in body.w.iter_mut().zip(&seen.positions) {
                *w = f64::from(x.w);
            }
            let gravity = reference.world.settings.gravity.length();
            let before = reference.positions();
            reference.world.tick();
            let seconds = settings.tick_seconds() as f32;
            let after = reference.positions();
            let body = &reference.world.bodies[0];
            let calm = Calm {
                topology: &body.topology,
                effects: &body.effects,
                is_touched: body.is_touched(),
                gravity,
            };
            let ways = (&before[..], &after[..]);
            let calm = |speed| calm.holds(ways, seconds, speed);
            let rest = &mut reference.rest;
            reference.still = rest.observe(ways, (seconds, gravity), calm, &self.sleep);
        }
        let before = self.references.len();
        self.references.retain(|reference| {
            let whole = seen(reference.body).is_none_or(|seen| reference.is_of(seen));
            whole && reference.finite()
        });
        self.lost += before - self.references.len();
        stepped
    }

    /// Compares the references with their bodies, which are at `bodies`.
    #[must_use]
    pub fn compare(&self, tick: u64, substeps: u32, bodies: &[Seen]) -> Comparison {
        let mut sum = Sum::default();
        let mut gaps = Vec::with_capacity(self.references.len());
        for reference in &self.references {
            let Some(seen) = bodies.iter().find(|seen| seen.body == reference.body) else {
                continue;
            };
            if !reference.is_of(seen) {
                continue;
            }
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
