//! Rapier's soft bodies, with each of its two solvers.

use crate::{
    machine::locked_version,
    peer::{Counts, Peer, PeerError, Report, Run},
    scenes::{GRAVITY, RATE, SUBSTEPS, Scene},
};
use glam::Vec3;
use rapier3d::prelude::{
    ColliderBuilder, PhysicsWorld, Real, SharedShape, SoftBodyBuilder, SoftBodyHandle,
    SoftBodySolver, SpringCoefficients, Vector,
};

/// Solver of Rapier.
#[derive(Clone, Copy, PartialEq)]
pub enum Rapier {
    /// Gauss–Seidel iterations over the constraints, on velocities.
    Constraints,
    /// Implicit Euler for the whole body.
    Fem,
}

/// Natural frequency of edges and volumes [Hz]: practically rigid, as for Rapier's joints.
const FREQUENCY: Real = 1.0e6;
/// Natural frequency for the implicit solver [Hz], at which the remaining strain is about that of
/// the other peers. Stiffer bodies take the same time and have less strain; at 10⁶ Hz a cloth
/// diverges.
const FREQUENCY_FEM: Real = 240.0;

impl Peer for Rapier {
    fn name(&self) -> &'static str {
        match self {
            Self::Constraints => "Rapier",
            Self::Fem => "Rapier FEM",
        }
    }

    fn version(&self) -> String {
        format!("{} (features parallel, fem)", locked_version("rapier3d"))
    }

    fn settings(&self) -> &'static str {
        match self {
            Self::Constraints => {
                "`PhysicsWorld::step` with 16 solver iterations (its substeps) and no further \
                 iterations within one; edges and volume cells of 10⁶ Hz, damping ratio 1; no \
                 collider, no sleep. A projection is one update and velocity iteration of a \
                 constraint, warm started."
            }
            Self::Fem => {
                "The same bodies with `SoftBodySolver::Fem` and its default parameters, edges and \
                 cells of 240 Hz. It solves one linear system a substep and projects nothing: its \
                 figure is constraints times substeps over time, to be read with milliseconds a \
                 tick and strain."
            }
        }
    }

    fn is_parallel(&self) -> bool {
        true
    }

    fn has_contact(&self) -> bool {
        true
    }

    fn build(&self, scene: &Scene, threads: usize) -> Result<Box<dyn Run>, PeerError> {
        let mut world = PhysicsWorld::new();
        world
            .configure_thread_pool(threads)
            .map_err(|error| PeerError::Scene {
                scene: scene.name,
                reason: error.to_string(),
            })?;
        world.gravity = Vector::new(0.0, GRAVITY, 0.0);
        let parameters = &mut world.integration_parameters;
        parameters.dt = 1.0 / RATE;
        parameters.num_solver_iterations = SUBSTEPS as usize;
        parameters.num_internal_pgs_iterations = 1;
        parameters.num_internal_stabilization_iterations = 0;
        parameters.soft_bodies.max_extra_substeps = 0;
        parameters.soft_bodies.resweep_strain = Real::MAX;
        if scene.thickness.is_some() {
            world.insert_collider(
                ColliderBuilder::new(SharedShape::halfspace(Vector::Y)),
                None,
            );
        }
        let bodies = scene
            .offsets
            .iter()
            .map(|&offset| world.insert_soft_body(self.body(scene, offset)))
            .collect();
        Ok(Box::new(Running { world, bodies }))
    }
}

impl Rapier {
    fn body(self, scene: &Scene, offset: Vec3) -> SoftBodyBuilder {
        let shape = &scene.shape;
        let at = |x: &Vec3| Vector::new(x.x + offset.x, x.y + offset.y, x.z + offset.z);
        // The mass of a pin is not used.
        let mass = |&inverse: &f32| if inverse > 0.0 { 1.0 / inverse } else { 1.0 };
        let (solver, frequency) = match self {
            Self::Constraints => (SoftBodySolver::Constraints, FREQUENCY),
            Self::Fem => (SoftBodySolver::Fem, FREQUENCY_FEM),
        };
        let body = SoftBodyBuilder::new(shape.vertices.iter().map(at).collect())
            .masses(scene.inverse_masses.iter().map(mass).collect())
            .pinned_particles(scene.pins.iter().copied())
            .edges(shape.edges.clone())
            .cells(shape.tetrahedra.clone())
            .surface(shape.triangles.clone())
            .softness(SpringCoefficients::new(frequency, 1.0))
            .solver(solver)
            .additional_pgs_iterations(0)
            .can_sleep(false);
        match scene.thickness {
            None => body.no_surface_collider(),
            Some(thickness) => body
                .particle_radius(0.5 * thickness)
                .self_contacts(shape.tetrahedra.is_empty()),
        }
    }
}

struct Running {
    world: PhysicsWorld,
    bodies: Vec<SoftBodyHandle>,
}

impl Run for Running {
    fn tick(&mut self) -> Result<(), PeerError> {
        self.world.step();
        Ok(())
    }

    fn report(&mut self) -> Result<Report, PeerError> {
        let mut counts = Counts {
            per_tetrahedron: 1,
            ..Counts::default()
        };
        let mut positions = Vec::new();
        for body in self
            .bodies
            .iter()
            .filter_map(|&handle| self.world.soft_bodies.get(handle))
            .filter(|body| body.is_enabled() && !body.is_sleeping())
        {
            counts.edges += body.edges().len() as u64;
            counts.tetrahedra += body.cells().len() as u64;
            positions.extend(body.particle_positions().map(|x| Vec3::new(x.x, x.y, x.z)));
        }
        Ok(Report { counts, positions })
    }
}
