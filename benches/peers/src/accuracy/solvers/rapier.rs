//! Rapier's soft bodies, with each of its two solvers.
//!
//! Rapier gives an edge a natural frequency; its stiffness is ω²/w with w = w₀ + w₁, the inverse
//! effective mass. The frequency of each edge is set to what its compliance α requires: ω² = w/α.
//! Volumes have one frequency for the whole body, which is part of the settings: the linear system
//! of stiff ones is ill-conditioned, and iterations converge slowly. So is the damping ratio: what
//! does not converge within a substep is softer with more damping. Its neo-Hookean energy is that of Pliant.

use super::{Setting, Solver, Trial, grid};
use crate::{
    accuracy::{
        body::inverse_masses,
        problems::{Elasticity, Problem, Volumes},
    },
    peer::{Counts, PeerError},
    scenes::{GRAVITY, RATE},
};
use glam::DVec3;
use rapier3d::prelude::{
    PhysicsWorld, Real, SoftBodyBuilder, SoftBodyCellModel, SoftBodyHandle, SoftBodyMaterial,
    SoftBodySolver, SpringCoefficients, Vector,
};
use std::f32::consts::TAU;

/// Solver of Rapier.
#[derive(Clone, Copy, PartialEq)]
pub enum Rapier {
    /// Gauss–Seidel iterations over the constraints, on velocities.
    Constraints,
    /// Implicit Euler for the whole body.
    Fem,
}

/// Natural frequency of rigid volumes in the constraint solver [Hz].
const FREQUENCIES: [f32; 1] = [1e6];
/// Those that are tried with FEM; its error falls with the square of the frequency.
const FEM_FREQUENCIES: [f32; 4] = [1e3, 2e3, 4e3, 1e4];
/// Relative residuals of the linear system that are tried beside the default of 10⁻⁵: the state of
/// rest does not depend on them.
const FEM_TOLERANCES: [f32; 2] = [1e-3, 1e-1];
/// Fractions of critical damping that are tried; 1 is the default of Rapier's materials.
const DAMPING: [f32; 3] = [0.0, 0.1, 1.0];

impl Solver for Rapier {
    fn name(&self) -> &'static str {
        match self {
            Self::Constraints => "Rapier",
            Self::Fem => "Rapier FEM",
        }
    }

    fn setup(&self) -> &'static str {
        match self {
            Self::Constraints => {
                "`PhysicsWorld::step` with 1 to 256 solver iterations (its substeps) of 1 to 64 \
                 internal PGS iterations, warm started; edges with the frequency of their \
                 compliance, rigid volumes of 1000 kHz, neo-Hookean cells, damping ratio ζ of 0, \
                 0.1 or 1, its default; no collider, no sleep."
            }
            Self::Fem => {
                "the same with `SoftBodySolver::Fem`, 1 to 16 solver iterations (its substeps) of \
                 at most 20 to 1000 iterations of conjugate gradients to a relative residual ε of \
                 10⁻⁵, its default, 10⁻³ or 10⁻¹, and no factorization, which only contacts need; \
                 rigid volumes of 1, 2, 4 or 10 kHz."
            }
        }
    }

    fn refusal(&self, problem: &Problem) -> Option<&'static str> {
        match problem.elasticity {
            Elasticity::Springs {
                volumes: Volumes::Bulk(_),
                ..
            } => Some("its volumes have one frequency, and no compliance each"),
            _ => None,
        }
    }

    fn settings(&self, problem: &Problem) -> Vec<Setting> {
        let (settings, frequencies) = match self {
            Self::Constraints => (
                grid(
                    &[1, 2, 4, 8, 16, 32, 64, 128, 256],
                    &[1, 2, 4, 16, 64],
                    1024,
                ),
                &FREQUENCIES[..],
            ),
            Self::Fem => {
                let substeps = [1, 2, 4, 8, 16];
                let mut all = grid(&substeps, &[20, 320, 1000], 5120);
                for tolerance in FEM_TOLERANCES {
                    let with = |setting| Setting {
                        tolerance: Some(tolerance),
                        ..setting
                    };
                    all.extend(grid(&substeps, &[320], 5120).into_iter().map(with));
                }
                (all, &FEM_FREQUENCIES[..])
            }
        };
        let frequencies = match has_volumes(problem) {
            true => frequencies.iter().copied().map(Some).collect(),
            false => vec![None],
        };
        let mut all = Vec::new();
        for frequency in frequencies {
            for damping in DAMPING {
                let with = |&setting: &Setting| Setting {
                    frequency,
                    damping: Some(damping),
                    ..setting
                };
                all.extend(settings.iter().map(with));
            }
        }
        all
    }

    fn build(&self, problem: &Problem, setting: Setting) -> Result<Box<dyn Trial>, PeerError> {
        // Without a pool of its own, it runs in the only thread of the global one.
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::new(0.0, GRAVITY, 0.0);
        let parameters = &mut world.integration_parameters;
        parameters.dt = 1.0 / RATE;
        parameters.num_solver_iterations = setting.substeps as usize;
        parameters.num_internal_stabilization_iterations = 0;
        parameters.soft_bodies.max_extra_substeps = 0;
        parameters.soft_bodies.resweep_strain = Real::MAX;
        let iterations = setting.iterations as usize;
        match self {
            Self::Constraints => parameters.num_internal_pgs_iterations = iterations,
            Self::Fem => {
                parameters.num_internal_pgs_iterations = 1;
                parameters.soft_bodies.fem.max_linear_iterations = iterations;
                parameters.soft_bodies.fem.max_dense_dofs = 0;
                if let Some(tolerance) = setting.tolerance {
                    parameters.soft_bodies.fem.linear_tolerance = tolerance;
                }
            }
        }
        let masses = inverse_masses(problem)?;
        let body = world.insert_soft_body(self.body(problem, &masses, setting));
        Ok(Box::new(Running {
            world,
            body,
            volumes: problem.constraints().1 > 0,
        }))
    }
}

impl Rapier {
    fn body(self, problem: &Problem, inverse_masses: &[f32], setting: Setting) -> SoftBodyBuilder {
        let shape = &problem.shape;
        let at = |x: &glam::Vec3| Vector::new(x.x, x.y, x.z);
        // The mass of a pin is not used.
        let mass = |&inverse: &f32| if inverse > 0.0 { 1.0 / inverse } else { 1.0 };
        let damping = setting.damping.unwrap_or(1.0);
        let solver = match self {
            Self::Constraints => SoftBodySolver::Constraints,
            Self::Fem => SoftBodySolver::Fem,
        };
        let builder = SoftBodyBuilder::new(shape.vertices.iter().map(at).collect())
            .masses(inverse_masses.iter().map(mass).collect())
            .pinned_particles(problem.pins.iter().copied())
            .surface(shape.triangles.clone())
            .solver(solver)
            .additional_pgs_iterations(0)
            .can_sleep(false)
            .no_surface_collider();
        match problem.elasticity {
            Elasticity::Springs {
                compliance,
                volumes,
            } => {
                // Each edge has its own; without volumes, the common one is not used.
                let frequency = setting.frequency.unwrap_or_default();
                let mut builder = builder
                    .softness(SpringCoefficients::new(frequency, damping))
                    .edges(shape.edges.clone());
                builder.edge_softness = edge_softness(problem, inverse_masses, compliance, damping);
                if volumes == Volumes::Free {
                    return builder;
                }
                builder.cells(shape.tetrahedra.clone())
            }
            Elasticity::NeoHookean {
                youngs_modulus,
                poisson_ratio,
            } => builder
                .cells(shape.tetrahedra.clone())
                .cell_model(SoftBodyCellModel::NeoHookean)
                .material(SoftBodyMaterial {
                    young_modulus: youngs_modulus,
                    poisson_ratio,
                    elastic_damping_ratio: damping,
                    ..SoftBodyMaterial::default()
                }),
        }
    }
}

/// Whether tetrahedra have a volume constraint.
fn has_volumes(problem: &Problem) -> bool {
    match problem.elasticity {
        Elasticity::Springs { volumes, .. } => volumes != Volumes::Free,
        Elasticity::NeoHookean { .. } => false,
    }
}

/// Softness of each edge that gives it a compliance [m/N], with a fraction of critical damping.
fn edge_softness(
    problem: &Problem,
    inverse_masses: &[f32],
    compliance: f32,
    damping: f32,
) -> Vec<(u32, SpringCoefficients<Real>)> {
    let of = |&[a, b]: &[u32; 2]| {
        let w = inverse_masses[a as usize] + inverse_masses[b as usize];
        // An edge between pins has no frequency; 0 would not be finite without damping.
        let frequency = match w > 0.0 {
            true => (w / compliance).sqrt() / TAU,
            false => 1.0,
        };
        SpringCoefficients::new(frequency, damping)
    };
    (0..).zip(problem.shape.edges.iter().map(of)).collect()
}

struct Running {
    world: PhysicsWorld,
    body: SoftBodyHandle,
    /// Whether cells carry a constraint.
    volumes: bool,
}

impl Trial for Running {
    fn tick(&mut self) {
        self.world.step();
    }

    fn positions(&mut self, positions: &mut Vec<DVec3>) {
        positions.clear();
        if let Some(body) = self.world.soft_bodies.get(self.body) {
            let own = body.particle_positions();
            positions.extend(own.map(|x| DVec3::new(x.x.into(), x.y.into(), x.z.into())));
        }
    }

    fn place(&mut self, positions: &[DVec3]) {
        let Some(body) = self.world.soft_bodies.get_mut(self.body) else {
            return;
        };
        for (i, x) in positions.iter().enumerate() {
            if !body.particles()[i].is_pinned() {
                let x = x.as_vec3();
                body.set_particle_position(i, Vector::new(x.x, x.y, x.z));
            }
            body.set_particle_velocity(i, Vector::ZERO);
        }
    }

    fn counts(&self) -> Counts {
        let body = self.world.soft_bodies.get(self.body);
        body.filter(|body| body.is_enabled() && !body.is_sleeping())
            .map_or_else(Counts::default, |body| Counts {
                edges: body.edges().len() as u64,
                tetrahedra: if self.volumes {
                    body.cells().len() as u64
                } else {
                    0
                },
                per_tetrahedron: 1,
            })
    }
}
