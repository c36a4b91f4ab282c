//! Pliant, with Gauss–Seidel and with its direct solver.

use super::{Setting, Solver, Trial, grid};
use crate::{
    accuracy::{
        body::{body, in_mesh_order, refused},
        problems::Problem,
    },
    peer::{Counts, PeerError},
    scenes::RATE,
};
use glam::DVec3;
use pliant::solver::{Direct, Iterations, Rate, Substeps, Threads, VertexIndex, World};
use std::fmt::Display;

/// Solver of Pliant.
#[derive(Clone, Copy, PartialEq)]
pub enum Pliant {
    /// Gauss–Seidel iterations of XPBD.
    GaussSeidel,
    /// The direct solver.
    Direct,
}

impl Solver for Pliant {
    fn name(&self) -> &'static str {
        match self {
            Self::GaussSeidel => "Pliant",
            Self::Direct => "Pliant direct",
        }
    }

    fn peer(&self) -> &'static str {
        "Pliant"
    }

    fn setup(&self) -> &'static str {
        match self {
            Self::GaussSeidel => {
                "XPBD with 1 to 1024 substeps of 1 to 64 iterations, no damping, sleep off."
            }
            Self::Direct => {
                "the effect `direct` with 1 to 16 substeps of 1 to 4 iterations, no damping, sleep \
                 off."
            }
        }
    }

    fn refusal(&self, _problem: &Problem) -> Option<&'static str> {
        None
    }

    fn settings(&self, _problem: &Problem) -> Vec<Setting> {
        match self {
            Self::GaussSeidel => grid(
                &[1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024],
                &[1, 2, 4, 16, 64],
                4096,
            ),
            Self::Direct => grid(&[1, 2, 4, 8, 16], &[1, 2, 4], 16),
        }
    }

    fn build(&self, problem: &Problem, setting: Setting) -> Result<Box<dyn Trial>, PeerError> {
        let refuse = |reason: &dyn Display| refused(problem, reason);
        let mut body = body(problem)?;
        if *self == Self::Direct {
            body.effects.direct = Some(Direct);
        }
        let mut world = World {
            threads: Threads::new(1).map_err(|error| refuse(&error))?,
            ..World::default()
        };
        world.sleep.enabled = false;
        let settings = &mut world.settings;
        settings.gravity = problem.gravity();
        settings.rate = Rate::new(f64::from(RATE)).map_err(|error| refuse(&error))?;
        settings.substeps = Substeps::new(setting.substeps).map_err(|error| refuse(&error))?;
        settings.iterations =
            Iterations::new(setting.iterations).map_err(|error| refuse(&error))?;
        world.bodies.push(body);
        let elastic = problem.constraints().0 == 0;
        Ok(Box::new(Running { world, elastic }))
    }
}

struct Running {
    world: World,
    /// Whether tetrahedra are elastic, and edges none.
    elastic: bool,
}

impl Trial for Running {
    fn tick(&mut self) {
        self.world.tick();
    }

    fn positions(&mut self, positions: &mut Vec<DVec3>) {
        positions.clear();
        for body in &self.world.bodies {
            let particles = &body.particles;
            let own = (0..particles.len()).map(|i| particles.position(i));
            positions.extend(in_mesh_order(body, own.collect()));
        }
    }

    fn place(&mut self, positions: &[DVec3]) {
        for body in &mut self.world.bodies {
            for (vertex, &x) in (0..).zip(positions) {
                let particle = body
                    .topology
                    .numbering
                    .particle(VertexIndex(vertex))
                    .index();
                if body.particles.positions[particle].w > 0.0 {
                    body.particles.set_position(particle, x);
                }
            }
            body.particles.stop();
        }
    }

    fn counts(&self) -> Counts {
        let mut counts = Counts {
            per_tetrahedron: 1,
            ..Counts::default()
        };
        // A body in quarantine is paused, and counts as a failure.
        for body in self.world.bodies.iter().filter(|body| body.is_active()) {
            let effects = &body.effects;
            if effects.stretch.is_some() {
                counts.edges += body.topology.edges.ends().len() as u64;
            }
            if effects.volume.is_some() || (self.elastic && effects.neo_hookean.is_some()) {
                counts.tetrahedra += body.topology.tetrahedra.corners().len() as u64;
            }
        }
        counts
    }
}
