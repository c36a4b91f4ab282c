//! Bodies that appear and disappear between ticks: copies from [emitters of bodies](BodyEmitter), and
//! bodies in a [sink](crate::Sink).
//!
//! The plain world, the reference and the ECS keep their bodies differently. They share what is decided
//! here: which bodies disappear, and which copies appear where.

use crate::{
    Body, BodyEmitter, Capacity, Density, Effects, Emission, Emitter, Mass, Settings, StitchEnd,
    Stitches, Topology, VertexIndex,
    effects::emitter::Origin,
    topology::{Birth, Dimension},
};
use glam::DVec3;
use std::sync::Arc;

/// Largest number of particles of all copies of an emitter.
const MAX_PARTICLES: usize = 4_000_000;

/// A body that is present at the end of a tick.
pub trait Present {
    /// Its effects.
    fn effects(&self) -> Effects;
    /// Its topology.
    fn topology(&self) -> &Topology;
    /// What it has emitted, and where it comes from.
    fn emission(&self) -> &Emission;
    /// The same, to be changed.
    fn emission_mut(&mut self) -> &mut Emission;
    /// Position of a particle [m].
    fn at(&self, particle: usize) -> DVec3;
}

impl Present for Body {
    fn effects(&self) -> Effects {
        self.effects
    }

    fn topology(&self) -> &Topology {
        &self.topology
    }

    fn emission(&self) -> &Emission {
        &self.particles.emission
    }

    fn emission_mut(&mut self) -> &mut Emission {
        &mut self.particles.emission
    }

    fn at(&self, particle: usize) -> DVec3 {
        self.particles.position(particle)
    }
}

impl Effects {
    /// Whether bodies with these effects can appear or disappear between ticks.
    #[must_use]
    pub fn changes_bodies(&self) -> bool {
        self.body_emitter.is_some() || self.sink.is_some()
    }
}

/// Ends a tick of copies and sinks: the numbers of the bodies that disappear, in ascending order.
pub fn gone(bodies: &mut [impl Present], settings: &Settings) -> Vec<u32> {
    let lifetime = |body: &_| {
        let emitter: Option<BodyEmitter> = Present::effects(body).body_emitter;
        emitter.map(|it| f64::from(it.lifetime.get()))
    };
    let lifetimes: Vec<Option<f64>> = bodies.iter().map(lifetime).collect();
    let is_gone = |body: &mut _| {
        let origin = &mut Present::emission_mut(body).origin;
        let is_old = origin.as_mut().is_some_and(|origin| {
            let lifetime = lifetimes.get(origin.source as usize).copied().flatten();
            // Without its emitter, it does not age.
            lifetime.is_some_and(|lifetime| {
                origin.age = origin.age.saturating_add(1);
                f64::from(origin.age) * settings.tick_seconds() >= lifetime
            })
        });
        is_old || is_sunk(body)
    };
    let gone: Vec<bool> = bodies.iter_mut().map(is_gone).collect();
    (0..)
        .zip(gone)
        .filter_map(|(number, gone)| gone.then_some(number))
        .collect()
}

/// Whether a body is in its sink; not if it is of grains, or has an emitter.
fn is_sunk(body: &impl Present) -> bool {
    let effects = body.effects();
    let Some(sink) = effects.sink.filter(|_| effects.body_emitter.is_none()) else {
        return false;
    };
    let particles = body.topology().particles();
    let sum: DVec3 = (0..particles).map(|i| body.at(i)).sum();
    body.topology().radii.is_empty() && sink.contains(sum / particles as f64)
}

/// The copies of body `number` that leave its emitter at the end of a tick.
pub fn births(bodies: &mut [impl Present], number: usize, settings: &Settings) -> Vec<Birth> {
    let own = &bodies[number];
    let Some(emitter) = own.effects().body_emitter else {
        return Vec::new();
    };
    let mut emitter = Emitter::from(emitter);
    let most = MAX_PARTICLES / own.topology().particles();
    let capacity = (emitter.capacity.get() as usize).min(most).max(1);
    emitter.capacity = Capacity::of(capacity as u32);
    let mut emission = own.emission().clone();
    let is_copy = |body: &&_| Present::emission(*body).source() == Some(number as u32);
    let present = bodies.iter().filter(is_copy).count();
    let mut space = None;
    let births = emitter.births(&mut emission, present, settings, |birth| {
        let space = space.get_or_insert_with(|| Space::of(bodies, number));
        space.take(birth.position)
    });
    *bodies[number].emission_mut() = emission;
    births
}

/// What is copied, beside the effects.
#[derive(Debug)]
pub struct Template<'a> {
    /// Name of the body; the copies are numbered.
    pub name: &'a str,
    /// The rest shape.
    pub topology: &'a Arc<Topology>,
    /// Mass per measure.
    pub density: Density,
    /// Additional masses.
    pub added_mass: &'a [(VertexIndex, Mass)],
    /// Stitches; those to other bodies and to colliders are not copied.
    pub stitches: &'a Stitches,
    /// Its effects.
    pub effects: Effects,
}

impl Template<'_> {
    /// The copies of body `number` for these births, of which `emitted` were emitted up to the last.
    pub fn copies(
        &self,
        (number, emitted): (u32, u64),
        births: &[Birth],
    ) -> impl Iterator<Item = Body> {
        let first = emitted + 1 - births.len() as u64;
        (first..).zip(births).map(move |(copy, birth)| {
            let name = format!("{} {copy}", self.name);
            let mut body = Body::new(name, Arc::clone(self.topology), self.density);
            body.added_mass = self.added_mass.to_vec();
            body.update_masses();
            body.effects = Effects {
                body_emitter: None,
                grab: None,
                ..self.effects
            };
            body.stitches = self.stitches.clone();
            body.stitches
                .retain_mut(|stitch| matches!(stitch.to, StitchEnd::Point(_)));
            let center = middle(self.topology);
            body.particles.translate(birth.position - center);
            body.set_velocity(birth.velocity.as_vec3());
            body.particles.emission.origin = Some(Origin {
                source: number,
                age: 0,
            });
            body.tick_start = body.particles.only_positions();
            body
        })
    }
}

/// Center of the box around a rest shape [m].
fn middle(topology: &Topology) -> DVec3 {
    let (low, high) = crate::topology::bounds(topology.rest.iter().copied());
    (low.as_dvec3() + high.as_dvec3()) / 2.0
}

/// The boxes that copies must not meet.
struct Space {
    /// Whether anything is in the way: not for a body without contact.
    blocks: bool,
    /// Half the size of the box of a copy, with the thickness of its contact [m].
    half: DVec3,
    /// Lowest and highest corner of each box [m].
    taken: Vec<[DVec3; 2]>,
}

impl Space {
    /// Around copies of body `number`.
    fn of(bodies: &[impl Present], number: usize) -> Self {
        let own = &bodies[number];
        let (low, high) = crate::topology::bounds(own.topology().rest.iter().copied());
        let mut space = Self {
            blocks: false,
            half: (high.as_dvec3() - low.as_dvec3()) / 2.0,
            taken: Vec::new(),
        };
        let Some(contact) = own.effects().contact else {
            return space;
        };
        space.blocks = true;
        space.half += f64::from(contact.thickness.get());
        for body in bodies {
            if let Some(contact) = body.effects().contact {
                space.add(body, contact.thickness.get().into());
            }
        }
        space
    }

    /// Adds the tetrahedra of a body with its thickness [m], or its triangles if it is a sheet, its edges
    /// if it is a rope, or its grains.
    fn add(&mut self, body: &impl Present, thickness: f64) {
        let topology = body.topology();
        let mut add = |corners: &[u32], margin: f64| {
            let first = [DVec3::INFINITY, DVec3::NEG_INFINITY];
            let [low, high] = corners.iter().fold(first, |[low, high], &corner| {
                let x = body.at(corner as usize);
                [low.min(x), high.max(x)]
            });
            self.taken.push([low - margin, high + margin]);
        };
        match topology.dimension {
            Dimension::Solid => {
                let all = topology.tetrahedra.corners();
                all.for_each(|it| add(&it, thickness));
            }
            Dimension::Sheet => topology.triangles.iter().for_each(|it| add(it, thickness)),
            Dimension::Line => topology.edges.ends().for_each(|it| add(&it, thickness)),
            Dimension::Grains => {
                let radii = (0..).zip(topology.radii.iter());
                radii.for_each(|(i, radius)| add(&[i], thickness + f64::from(*radius)));
            }
        }
    }

    /// Takes the place around a center [m], unless something is there.
    fn take(&mut self, center: DVec3) -> bool {
        let [low, high] = [center - self.half, center + self.half];
        let meets = |[from, to]: &[DVec3; 2]| from.cmple(high).all() && to.cmpge(low).all();
        let is_free = !self.blocks || !self.taken.iter().any(meets);
        self.taken.extend(is_free.then_some([low, high]));
        is_free
    }
}
