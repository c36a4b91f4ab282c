//! Pliant, without Bevy.

use crate::{
    machine::locked_version,
    peer::{Counts, Peer, PeerError, Report, Run},
    scenes::{DENSITY, GRAVITY, RATE, SUBSTEPS, Scene},
};
use glam::Vec3;
use pliant::solver::{
    Body, Compliance, Contact, ContactThickness, Density, Effects, Ground, Instructions,
    Iterations, Rate, SelfContact, Stretch, Substeps, Threads, Topology, VertexIndex, Volume,
    World,
};
use std::{fmt::Display, sync::Arc};

/// Pliant.
pub struct Pliant;

impl Peer for Pliant {
    fn name(&self) -> &'static str {
        "Pliant"
    }

    fn version(&self) -> String {
        format!(
            "{} ({} instructions)",
            locked_version("pliant"),
            Instructions::default().name()
        )
    }

    fn settings(&self) -> &'static str {
        "`World::tick`, sleep off, every other setting as it comes."
    }

    fn is_parallel(&self) -> bool {
        true
    }

    fn has_contact(&self) -> bool {
        true
    }

    fn build(&self, scene: &Scene, threads: usize) -> Result<Box<dyn Run>, PeerError> {
        Ok(Box::new(Running(world(scene, threads)?)))
    }
}

fn world(scene: &Scene, threads: usize) -> Result<World, PeerError> {
    let refused = |reason: &dyn Display| PeerError::Scene {
        scene: scene.name,
        reason: reason.to_string(),
    };
    let topology = Topology::new(scene.shape.clone()).map_err(|error| refused(&error))?;
    let topology = Arc::new(topology);
    let compliance = Compliance::new(scene.edge_compliance).map_err(|error| refused(&error))?;
    let density = Density::new(DENSITY).map_err(|error| refused(&error))?;
    let mut world = World {
        threads: Threads::new(threads).map_err(|error| refused(&error))?,
        ..World::default()
    };
    world.sleep.enabled = false;
    let settings = &mut world.settings;
    settings.rate = Rate::new(f64::from(RATE)).map_err(|error| refused(&error))?;
    settings.substeps = Substeps::new(SUBSTEPS).map_err(|error| refused(&error))?;
    settings.iterations = Iterations::new(1).map_err(|error| refused(&error))?;
    settings.gravity = Vec3::new(0.0, GRAVITY, 0.0);
    let effects = Effects {
        stretch: Some(Stretch {
            compliance,
            ..Stretch::default()
        }),
        volume: (!scene.shape.tetrahedra.is_empty()).then(Volume::default),
        ..Effects::default()
    };
    let effects = match scene.thickness {
        None => effects,
        Some(thickness) => {
            let thickness = ContactThickness::new(thickness).map_err(|error| refused(&error))?;
            let contact = Contact {
                thickness,
                ..Contact::default()
            };
            let itself = SelfContact {
                thickness,
                ..SelfContact::default()
            };
            Effects {
                contact: (scene.offsets.len() > 1).then_some(contact),
                self_contact: scene.shape.tetrahedra.is_empty().then_some(itself),
                ground: Some(Ground::default()),
                ..effects
            }
        }
    };
    for &offset in &scene.offsets {
        let mut body = Body::new(scene.name, Arc::clone(&topology), density);
        body.pins = scene.pins.iter().copied().map(VertexIndex).collect();
        body.update_masses();
        body.translate(offset);
        body.effects = effects;
        world.bodies.push(body);
    }
    Ok(world)
}

/// Moves the particles of a body to positions in the order of its mesh [m].
fn place(body: &mut Body, positions: impl Iterator<Item = Vec3>) {
    for (vertex, x) in (0..).zip(positions) {
        let particle = body.topology.numbering.particle(VertexIndex(vertex));
        body.particles.set_position(particle.index(), x.as_dvec3());
    }
}

/// Counts crossings of the surfaces of a scene.
pub struct CrossingCounter(World);

impl CrossingCounter {
    /// For the bodies of a scene.
    ///
    /// # Errors
    /// [`PeerError`] if the scene cannot be built.
    pub fn new(scene: &Scene) -> Result<Self, PeerError> {
        world(scene, 1).map(Self)
    }

    /// Number of crossings at positions [m], body by body.
    pub fn count(&mut self, positions: &[Vec3]) -> usize {
        let mut rest = positions;
        for body in &mut self.0.bodies {
            let own;
            (own, rest) = rest.split_at(body.particles.positions.len());
            place(body, own.iter().copied());
        }
        self.0.crossings()
    }
}

struct Running(World);

impl Run for Running {
    fn tick(&mut self) -> Result<(), PeerError> {
        self.0.tick();
        Ok(())
    }

    fn report(&mut self) -> Result<Report, PeerError> {
        let mut counts = Counts {
            per_tetrahedron: 1,
            ..Counts::default()
        };
        let mut positions = Vec::new();
        for body in &self.0.bodies {
            // A body that diverged is paused at its last finite state (quarantine). Here it counts
            // as a failure.
            if body.is_active() {
                counts.edges += body.topology.edges.ends().len() as u64;
                counts.tetrahedra += body.topology.tetrahedra.corners().len() as u64;
            }
            let numbering = &body.topology.numbering;
            let vertices = 0..body.particles.positions.len() as u32;
            positions.extend(vertices.map(|vertex| {
                let particle = numbering.particle(VertexIndex(vertex)).index();
                body.particles.positions[particle].truncate()
            }));
        }
        Ok(Report { counts, positions })
    }
}
