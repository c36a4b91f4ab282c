//! Pliant, without Bevy.

use crate::{
    machine::locked_version,
    peer::{Counts, Peer, PeerError, Report, Run},
    scenes::{DENSITY, GRAVITY, RATE, SUBSTEPS, Scene},
};
use glam::Vec3;
use pliant::solver::{
    Body, Compliance, Density, Effects, Iterations, Rate, Stretch, Substeps, Threads, Topology,
    VertexIndex, Volume, World, lanes::Instructions,
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

    fn build(&self, scene: &Scene, threads: usize) -> Result<Box<dyn Run>, PeerError> {
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
        for &offset in &scene.offsets {
            let mut body = Body::new(scene.name, Arc::clone(&topology), density);
            body.pins = scene.pins.iter().copied().map(VertexIndex).collect();
            body.update_masses();
            body.translate(offset);
            body.effects = Effects {
                stretch: Some(Stretch {
                    compliance,
                    ..Stretch::default()
                }),
                volume: (!scene.shape.tetrahedra.is_empty()).then(Volume::default),
                ..Effects::default()
            };
            world.bodies.push(body);
        }
        Ok(Box::new(Running(world)))
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
