//! Bodies that appear and disappear between ticks: copies from [emitters of bodies](crate::BodyEmitter), and
//! bodies in a [sink](crate::Sink).
//!
//! The plain world, the reference and the ECS keep their bodies differently. They share what is decided
//! here: which bodies disappear, and which copies appear where.

use crate::{
    Body, Capacity, Density, Effects, Emission, Emitter, Finite, Flow, Mass, Particles, Settings,
    StitchEnd, Stitches, Topology, VertexIndex,
    particles::emission::Origin,
    rest::SleepSettings,
    topology::{Birth, Dimension},
};
use glam::DVec3;
use std::sync::Arc;

/// Largest number of particles of all copies of an emitter.
const MAX_PARTICLES: usize = 4_000_000;

/// A body and where it is.
pub trait Placed {
    /// Its effects.
    fn effects(&self) -> Effects;
    /// Its topology.
    fn topology(&self) -> &Topology;
    /// Position of a particle [m].
    fn at(&self, particle: usize) -> DVec3;
}

/// A body that is present at the end of a tick.
pub trait Present: Placed {
    /// What it has emitted, and where it comes from.
    fn emission(&self) -> &Emission;
    /// The same, to be changed.
    fn emission_mut(&mut self) -> &mut Emission;
}

impl Placed for Body {
    fn effects(&self) -> Effects {
        self.effects
    }

    fn topology(&self) -> &Topology {
        &self.topology
    }

    fn at(&self, particle: usize) -> DVec3 {
        self.particles.position(particle)
    }
}

impl Present for Body {
    fn emission(&self) -> &Emission {
        &self.particles.emission
    }

    fn emission_mut(&mut self) -> &mut Emission {
        &mut self.particles.emission
    }
}

impl Effects {
    /// Whether bodies with these effects can appear or disappear between ticks.
    #[must_use]
    pub fn changes_bodies(&self) -> bool {
        self.body_emitter.is_some() || self.sink.is_some()
    }
}

/// The numbers of the bodies that disappear at the end of a tick, in ascending order.
#[must_use]
pub fn gone(bodies: &[impl Present], settings: &Settings) -> Vec<u32> {
    let is_old = |origin: &Origin| {
        let source = bodies.get(origin.source as usize)?;
        // Without its emitter, a copy does not age.
        let lifetime = source.effects().body_emitter?.lifetime;
        let ticks = (source.emission().copies.ticks + 1).saturating_sub(origin.birth);
        Some(ticks as f64 * settings.tick_seconds() >= f64::from(lifetime.get()))
    };
    let is_gone = |body: &&_| {
        let origin = Present::emission(*body).origin.as_ref();
        origin.and_then(is_old).unwrap_or(false) || is_sunk(*body)
    };
    let numbered = (0..).zip(bodies);
    let gone = numbered.filter(|(_, body)| is_gone(body));
    gone.map(|(number, _)| number).collect()
}

/// Whether a body is in its sink; not if it is of grains, or has an emitter.
fn is_sunk(body: &impl Placed) -> bool {
    let effects = body.effects();
    let sinks = effects.body_emitter.is_none() && body.topology().radii.is_empty();
    let Some(sink) = effects.sink.filter(|_| sinks) else {
        return false;
    };
    let particles = body.topology().particles();
    let sum: DVec3 = (0..particles).map(|i| body.at(i)).sum();
    sink.contains(sum / particles as f64)
}

/// Lowest and highest corner of the box around a body with contact, with its thickness [m]: what rested
/// on a body that disappears meets its box. `None` without contact.
#[must_use]
pub fn around(body: &impl Placed) -> Option<[DVec3; 2]> {
    Some(grown(body, thickness(body)?))
}

/// A body where it fell asleep.
#[derive(Debug)]
pub struct Slept<'a> {
    /// Its topology.
    pub topology: &'a Topology,
    /// Its effects now.
    pub effects: Effects,
    /// Its particles when it fell asleep.
    pub start: &'a Particles,
}

/// The box around a body that sleeps, with its contact [m], and that of its contact alone if it has any.
pub type Boxes = ([DVec3; 2], Option<[DVec3; 2]>);

impl Slept<'_> {
    /// The boxes in which others may have rested on it, also if it has no contact any more, and in which it
    /// may rest on others.
    #[must_use]
    pub fn boxes(&self) -> Boxes {
        let own = around(self);
        let any = own.unwrap_or_else(|| {
            let mean_edge = self.topology.surface().mean_edge;
            grown(self, self.effects.collider_distance(mean_edge).into())
        });
        (any, own)
    }
}

impl Placed for Slept<'_> {
    fn effects(&self) -> Effects {
        self.effects
    }

    fn topology(&self) -> &Topology {
        self.topology
    }

    fn at(&self, particle: usize) -> DVec3 {
        let slept = &self.start.positions;
        let x = slept.get(particle).or(slept.last());
        x.map_or(DVec3::ZERO, |x| x.truncate().as_dvec3())
    }
}

/// Marks those of the sleeping bodies with these boxes that may have rested on one that is marked as
/// woken, and so on.
pub fn spread(sleepers: &[Option<Boxes>], woken: &mut [bool]) {
    let marked = (0..woken.len()).filter(|&place| woken[place]);
    let mut left: Vec<usize> = marked.collect();
    while let Some(place) = left.pop() {
        let Some((gone, _)) = sleepers[place] else {
            continue;
        };
        for (other, boxes) in sleepers.iter().enumerate() {
            let own = boxes.and_then(|(_, own)| own).filter(|_| !woken[other]);
            if own.is_some_and(|own| meet(own, gone)) {
                woken[other] = true;
                left.push(other);
            }
        }
    }
}

/// The box around a body, grown [m].
fn grown(body: &impl Placed, by: f64) -> [DVec3; 2] {
    let first = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let places = (0..body.topology().particles()).map(|i| body.at(i));
    let [low, high] = places.fold(first, |[low, high], x| [low.min(x), high.max(x)]);
    [low - by, high + by]
}

/// Whether two boxes touch.
#[must_use]
pub fn meet([from, to]: [DVec3; 2], [low, high]: [DVec3; 2]) -> bool {
    from.cmple(high).all() && to.cmpge(low).all()
}

/// Thickness of the contact of a body with others, and the radius of its largest grain [m]; `None`
/// without contact.
fn thickness(body: &impl Placed) -> Option<f64> {
    let topology = body.topology();
    let mean_edge = topology.surface().mean_edge;
    let thickness = body.effects().contact_thickness(mean_edge)?;
    Some(f64::from(thickness + topology.largest_radius()))
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
    let mut flow = own.emission().copies;
    let is_copy = |body: &&_| Present::emission(*body).source() == Some(number as u32);
    let present = bodies.iter().filter(is_copy).count();
    let mut space = None;
    let births = emitter.births(&mut flow, present, settings, |birth| {
        let space = space.get_or_insert_with(|| Space::of(bodies, number, &emitter, settings));
        space.take(birth.position)
    });
    if present + births.len() >= capacity {
        // What is due while there is no room for it would all come at once.
        flow.drop_waiting();
    }
    bodies[number].emission_mut().copies = flow;
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
    /// When it sleeps.
    pub sleep: Option<SleepSettings>,
}

impl Template<'_> {
    /// The copies of body `number` for these births, the last ones of what it has emitted.
    pub fn copies(&self, number: u32, flow: &Flow, births: &[Birth]) -> impl Iterator<Item = Body> {
        let first = flow.emitted() + 1 - births.len() as u64;
        let birth_tick = flow.ticks;
        // Without the plastic flow of the source.
        let topology = self.topology.original().unwrap_or(self.topology);
        (first..).zip(births).map(move |(copy, birth)| {
            // Bodies that users add have a number alone.
            let name = format!("{} #{copy}", self.name);
            let mut body = Body::new(name, Arc::clone(topology), self.density);
            body.added_mass = self.added_mass.to_vec();
            body.update_masses();
            body.effects = Effects {
                emitter: None,
                body_emitter: None,
                grab: None,
                ..self.effects
            };
            body.sleep = self.sleep;
            body.stitches = self.stitches.clone();
            body.stitches.retain_mut(|stitch| {
                stitch.broken = false;
                matches!(stitch.to, StitchEnd::Point(_))
            });
            let center = middle(topology);
            body.particles.translate(birth.position - center);
            body.set_velocity(birth.velocity.as_vec3());
            body.particles.emission.origin = Some(Origin {
                source: number,
                birth: birth_tick,
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
    /// Lowest and highest corner of the boxes of all copies that can leave [m].
    reach: [DVec3; 2],
    /// Those of each box in it.
    taken: Vec<[DVec3; 2]>,
}

impl Space {
    /// Around the opening of an emitter of body `number`.
    fn of(bodies: &[impl Present], number: usize, emitter: &Emitter, settings: &Settings) -> Self {
        let own = &bodies[number];
        let (low, high) = crate::topology::bounds(own.topology().rest.iter().copied());
        let half = (high.as_dvec3() - low.as_dvec3()) / 2.0 + thickness(own).unwrap_or(0.0);
        let way = emitter.way(settings);
        let center = Finite::vector([emitter.x, emitter.y, emitter.z]);
        let mut space = Self {
            blocks: own.effects().contact.is_some(),
            half,
            reach: [center - half - way, center + half + way],
            taken: Vec::new(),
        };
        if space.blocks {
            for body in bodies {
                if let Some(thickness) = thickness(body) {
                    space.add(body, thickness);
                }
            }
        }
        space
    }

    /// Adds the tetrahedra of a body with its thickness [m], or its triangles if it is a sheet, its edges
    /// if it is a rope, or its grains, as large as the largest.
    fn add(&mut self, body: &impl Placed, thickness: f64) {
        let topology = body.topology();
        let mut add = |corners: &[u32], margin: f64| {
            let first = [DVec3::INFINITY, DVec3::NEG_INFINITY];
            let [low, high] = corners.iter().fold(first, |[low, high], &corner| {
                let x = body.at(corner as usize);
                [low.min(x), high.max(x)]
            });
            let taken = [low - margin, high + margin];
            if meet(taken, self.reach) {
                self.taken.push(taken);
            }
        };
        match topology.dimension {
            Dimension::Solid => {
                let all = topology.tetrahedra.corners();
                all.for_each(|it| add(&it, thickness));
            }
            Dimension::Sheet => topology.triangles.iter().for_each(|it| add(it, thickness)),
            Dimension::Line => topology.edges.ends().for_each(|it| add(&it, thickness)),
            Dimension::Grains => {
                (0..topology.particles() as u32).for_each(|i| add(&[i], thickness))
            }
        }
    }

    /// Takes the place around a center [m], unless something is there.
    fn take(&mut self, center: DVec3) -> bool {
        let place = [center - self.half, center + self.half];
        let is_free = !self.blocks || !self.taken.iter().any(|taken| meet(*taken, place));
        self.taken.extend(is_free.then_some(place));
        is_free
    }
}
