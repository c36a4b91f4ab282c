//! The probe that steps a case's bodies, tick by tick.

use super::{Case, cases::SUBSTEPS, measure, measure::Probe};
use crate::solver::{Body, Threads, Topology, World, measure::shape_error};
use std::{sync::Arc, time::Duration};

/// Limit on the root mean square distance to the rest shape, relative to the body's size. All
/// bodies start below a thousandth.
const SOUND: f64 = 0.02;

/// Ticks after which the bodies are reset. A free flat cloth gains speed from rounding; in this
/// number of ticks it remains small.
const AGE: u32 = 50;

/// Steps bodies with each of several numbers of threads; its figures are nanoseconds per
/// projection.
#[derive(Debug)]
pub(super) struct Steps {
    pub case: Case,
    pub topology: Arc<Topology>,
    crews: Vec<Threads>,
    world: World,
    /// Initial state of every sample, so that all do the same work.
    beginning: Vec<Body>,
    sound: bool,
}

impl Steps {
    pub fn new(case: Case, topology: Arc<Topology>, crews: &[Threads]) -> Self {
        let world = case.world(&topology);
        Self {
            beginning: world.bodies.clone(),
            sound: true,
            world,
            case,
            topology,
            crews: crews.to_vec(),
        }
    }

    /// Number of active edges and tetrahedra of one body.
    pub fn constraints(&self) -> [usize; 2] {
        let effects = self.world.bodies.first().map(|body| body.effects);
        let effects = effects.unwrap_or_default();
        [
            effects
                .stretch
                .map_or(0, |_| self.topology.edges.ends().len()),
            effects
                .volume
                .map_or(0, |_| self.topology.tetrahedra.corners().len()),
        ]
    }

    /// Constraint projections per tick of all bodies.
    pub fn projections(&self) -> usize {
        let [edges, tetrahedra] = self.constraints();
        (edges + tetrahedra) * self.case.bodies * SUBSTEPS as usize
    }

    /// Memory that a substep of one body accesses [byte]: particles and rest values of each
    /// constraint; position, previous position and velocity of each particle.
    pub fn working_set(&self) -> usize {
        let [edges, tetrahedra] = self.constraints();
        let edge = size_of::<[u32; 2]>() + size_of::<f32>();
        let tetrahedron = size_of::<[u32; 4]>() + 2 * size_of::<f32>();
        let particle = 3 * size_of::<glam::Vec4>();
        edges * edge + tetrahedra * tetrahedron + self.topology.particles() * particle
    }

    /// Whether the bodies stayed near their rest shapes in every sample: timing a diverged world is
    /// meaningless.
    pub fn sound(&self) -> bool {
        self.sound
    }
}

fn is_sound(body: &Body) -> bool {
    body.quarantine.is_none() && shape_error(&body.topology, &body.particles.positions) < SOUND
}

impl Probe for Steps {
    fn sample(&mut self, slot: Duration) -> Vec<f64> {
        let projections = self.projections();
        let Self { world, sound, .. } = self;
        let figures = self.crews.iter().map(|threads| {
            world.bodies.clone_from(&self.beginning);
            world.threads = threads.clone();
            // Warm-up: replaces cache contents of other probes and wakes up the threads.
            world.tick();
            let mut age = 1;
            let rate = measure::rate(slot, || {
                if age == AGE {
                    *sound &= world.bodies.iter().all(is_sound);
                    world.bodies.clone_from(&self.beginning);
                    age = 0;
                }
                world.tick();
                age += 1;
                projections
            });
            *sound &= world.bodies.iter().all(is_sound);
            1e9 / rate
        });
        figures.collect()
    }
}
