//! Statistics of the whole world after a tick, for the CSV, the head-up line and `run --json`.

use super::{
    BodyContacts, Profile, Quarantined, SimulationClock, SimulationSettings, SoftBody,
    plain::{self, bodies_in_order},
};
use crate::{
    effect::EffectRegistry,
    solver::{
        Effects, Particles, Pressure, Stitches, Topology,
        contact::{Outline, crossings},
        measure::{self, SquareSum},
    },
};
use bevy::{math::DVec3, prelude::*};
use std::{collections::BTreeMap, time::Instant};

/// Whether statistics are taken after every tick; default false. They cost a pass over the whole
/// state.
#[derive(Resource, Debug, Clone, Copy, Default)]
pub struct Measuring(pub bool);

/// Whether the forces of ground and colliders are recorded in every tick, for
/// [`BodyContacts::surfaces`], the messages
/// [`SurfaceContactStarted`](super::SurfaceContactStarted) and
/// [`SurfaceContactEnded`](super::SurfaceContactEnded), and on each particle for
/// [`field::contact_force`](crate::solver::field::contact_force); default false, which costs nothing.
/// It does not change the motion.
#[derive(Resource, Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct RecordContacts(pub bool);

/// Statistics after a tick, while [`Measuring`] is on; it is off by default.
#[derive(Resource, Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct Statistics {
    /// Simulated time [s].
    pub time: f64,
    /// Ticks since the start of the scene.
    pub tick: u64,
    /// Real time of the solver in the previous tick [ms].
    pub ms_per_tick: f64,
    /// Number of bodies, including sleeping ones.
    pub bodies: usize,
    /// Number of sleeping bodies.
    pub asleep: usize,
    /// Number of particles of all bodies.
    pub particles: usize,
    /// Number of constraints by effect.
    pub constraints: BTreeMap<&'static str, usize>,
    /// Kinetic energy [J].
    pub kinetic: f64,
    /// Potential energy of gravity, zero at height 0 [J].
    pub potential: f64,
    /// Elastic energy by effect [J], of the requested material at its current strain.
    pub elastic: BTreeMap<&'static str, f64>,
    /// The part of the elastic energy that the unconverged solver does not hold [J]; see
    /// [`measure::ElementFigures`].
    pub unresolved: f64,
    /// Linear momentum [kg·m/s].
    pub momentum: [f64; 3],
    /// Angular momentum about the origin [kg·m²/s].
    pub angular_momentum: [f64; 3],
    /// Largest relative change of a body's volume, signed; `None` if no body has a volume to keep.
    /// Bodies of triangles with pressure have none: they are inflated on purpose.
    pub volume_error: Option<f64>,
    /// Root mean square residual of the constraints, relative to rest lengths and volumes.
    pub residual: f64,
    /// Pressure inside a filled body above ambient [Pa], the largest by absolute value; `None` if
    /// no body is filled.
    pub overpressure: Option<f64>,
    /// Number of inverted tetrahedra.
    pub inverted: usize,
    /// Number of active contacts between bodies, and of bodies with themselves, in the last
    /// substep; `None` if no body has contacts.
    pub contacts: Option<usize>,
    /// Number of bodies with contact that no other came near in the last tick, so that they were stepped as
    /// without; `None` if no body has contacts.
    pub contacts_apart: Option<usize>,
    /// Number of ticks that were stepped again, as bodies came near each other faster than was foreseen,
    /// since contact was last inactive; `None` if no body has contacts.
    pub repeated_ticks: Option<u64>,
    /// Smallest distance of two surfaces in contact at the start of the last substep [m]; `None`
    /// without contacts.
    pub smallest_gap: Option<f64>,
    /// Number of pairs of an edge and a triangle that cross, of bodies that can touch each other or
    /// themselves; `None` if no body has contacts.
    pub crossings: Option<usize>,
    /// Whether the whole state is finite and no body is in quarantine.
    pub finite: bool,
}

impl Statistics {
    /// Takes statistics of the current state.
    #[must_use]
    pub fn measure(world: &mut World) -> Self {
        let settings = **world.resource::<SimulationSettings>();
        let clock = world.resource::<SimulationClock>();
        let mut all = Self {
            time: clock.time(),
            tick: clock.tick(),
            ms_per_tick: world.resource::<Profile>().solver().as_secs_f64() * 1e3,
            finite: true,
            ..Self::default()
        };
        let h = settings
            .method
            .compliant_seconds(settings.substep_seconds()) as f32;
        let mut residual = SquareSum::default();
        let (mut momentum, mut angular) = (DVec3::ZERO, DVec3::ZERO);
        for entity in bodies_in_order(world) {
            let entity = world.entity(entity);
            let (Some(body), Some(particles)) =
                (entity.get::<SoftBody>(), entity.get::<Particles>())
            else {
                continue;
            };
            all.bodies += 1;
            all.asleep += usize::from(entity.contains::<super::Asleep>());
            all.particles += particles.len();
            all.finite &=
                particles.first_not_finite().is_none() && !entity.contains::<Quarantined>();
            all.kinetic += measure::kinetic_energy(particles);
            all.potential += measure::gravitational_energy(particles, settings.gravity);
            momentum += measure::momentum(particles);
            angular += measure::angular_momentum(particles);
            if has_volume(body, entity.contains::<Pressure>()) {
                let error = measure::volume_error(body, &particles.positions);
                if all.volume_error.is_none_or(|most| error.abs() > most.abs()) {
                    all.volume_error = Some(error);
                }
            }
            all.inverted += measure::inverted(body, &particles.positions);
            for effect in world.resource::<EffectRegistry>().iter() {
                if let Some(figures) = (effect.figures)(&entity, h) {
                    if figures.elements > 0 {
                        *all.constraints.entry(effect.name).or_default() += figures.elements;
                    }
                    if let Some(energy) = figures.energy {
                        *all.elastic.entry(effect.name).or_default() += energy;
                    }
                    all.unresolved += figures.unresolved;
                    residual.add(figures.residual);
                    if let Some(pressure) = figures.overpressure
                        && all
                            .overpressure
                            .is_none_or(|most| pressure.abs() > most.abs())
                    {
                        all.overpressure = Some(pressure);
                    }
                }
            }
        }
        let bodies = bodies_in_order(world);
        let carried = bodies
            .iter()
            .map(|&body| plain::effects(world.entity(body)));
        let carried: Vec<Effects> = carried.collect();
        let colliders = plain::colliders(world);
        let time = world.resource::<SimulationClock>().time();
        let meshes: Vec<_> = colliders.iter().filter_map(|it| it.mesh_at(time)).collect();
        let touches = |it: &Effects| it.touches_surfaces(!meshes.is_empty());
        if carried.iter().any(touches) {
            let contacts = world.resource::<BodyContacts>();
            let counts = contacts.counts();
            all.contacts = Some(counts.acting);
            all.contacts_apart = Some(counts.apart);
            all.repeated_ticks = Some(counts.repeated);
            all.smallest_gap = contacts.smallest_gap();
            let outlines = bodies.iter().zip(&carried).filter_map(|(&body, effects)| {
                Some(Outline {
                    effects,
                    topology: &world.get::<SoftBody>(body)?.0,
                    stitches: world.get::<Stitches>(body),
                    particles: world.get::<Particles>(body)?,
                })
            });
            all.crossings = Some(crossings(outlines, &meshes));
        }
        all.momentum = momentum.to_array();
        all.angular_momentum = angular.to_array();
        all.residual = residual.rms();
        all
    }

    /// Sum of kinetic, potential and elastic energy [J].
    #[must_use]
    pub fn energy(&self) -> f64 {
        self.kinetic + self.potential + self.elastic_sum()
    }

    /// Elastic energy of all effects [J].
    #[must_use]
    pub fn elastic_sum(&self) -> f64 {
        self.elastic.values().sum()
    }

    /// Number of constraints of all effects.
    #[must_use]
    pub fn constraint_count(&self) -> usize {
        self.constraints.values().sum()
    }
}

/// Takes statistics, if enabled.
pub(super) fn take(world: &mut World) {
    if world.resource::<Measuring>().0 {
        let started = Instant::now();
        let statistics = Statistics::measure(world);
        world.insert_resource(statistics);
        world.resource_mut::<Profile>().measure(started.elapsed());
    }
}

/// Whether a body has a volume that it should keep.
fn has_volume(topology: &Topology, is_inflated: bool) -> bool {
    !topology.tetrahedra.rest_volume.is_empty() || !is_inflated && topology.enclosure().is_ok()
}

/// Hash of the state of all bodies; the same as
/// [`solver::World::state_hash`](crate::solver::World::state_hash).
#[must_use]
pub fn state_hash(world: &mut World) -> u64 {
    let bodies = bodies_in_order(world);
    measure::state_hash(
        bodies
            .iter()
            .filter_map(|&body| world.get::<Particles>(body)),
    )
}
