//! Jolt.

use super::{Setting, Solver, Trial};
use crate::{
    accuracy::{
        body::inverse_masses,
        problems::{Elasticity, Problem, Volumes},
    },
    native::{Bodies, Extras, JOLT, Native},
    peer::{Counts, PeerError},
    scenes::volume,
};
use glam::{DVec3, Vec3};

/// Jolt.
pub struct Jolt;

impl Solver for Jolt {
    fn name(&self) -> &'static str {
        "Jolt"
    }

    fn setup(&self) -> &'static str {
        "`PhysicsSystem::Update` with 1 to 4096 iterations, which are its substeps: it has no \
         iterations within one. No damping, no sleep."
    }

    fn refusal(&self, problem: &Problem) -> Option<&'static str> {
        match problem.elasticity {
            Elasticity::Springs { .. } => None,
            Elasticity::NeoHookean { .. } => Some("it has no elastic tetrahedra"),
        }
    }

    fn settings(&self, _problem: &Problem) -> Vec<Setting> {
        (0..=12).map(|power| Setting::new(1 << power, 1)).collect()
    }

    fn build(&self, problem: &Problem, setting: Setting) -> Result<Box<dyn Trial>, PeerError> {
        // Peers are asked only for problems that they do not refuse.
        let Elasticity::Springs {
            compliance,
            volumes,
        } = problem.elasticity
        else {
            return Err(crate::accuracy::body::refused(
                problem,
                &"it has no elastic tetrahedra",
            ));
        };
        let mut shape = problem.shape.clone();
        if volumes == Volumes::Free {
            shape.tetrahedra.clear();
        }
        let compliances = match volumes {
            Volumes::Bulk(modulus) => Some(volume_compliances(problem, modulus)),
            Volumes::Free | Volumes::Rigid => None,
        };
        let bodies = Bodies {
            shape: &shape,
            inverse_masses: &inverse_masses(problem)?,
            offsets: &[Vec3::ZERO],
            edge_compliance: compliance,
            volume_compliances: compliances.as_deref(),
            substeps: setting.substeps,
            threads: 1,
            extras: Extras::default(),
        };
        Ok(Box::new(Running(JOLT.create(problem.name, &bodies)?)))
    }
}

/// Compliance of each tetrahedron [m⁵/N] with a bulk modulus [Pa].
fn volume_compliances(problem: &Problem, modulus: f32) -> Vec<f32> {
    let at = |corner: u32| problem.shape.vertices[corner as usize].as_dvec3();
    let all = problem.shape.tetrahedra.iter();
    all.map(|corners| volume(corners.map(at)).abs() as f32 / modulus)
        .collect()
}

struct Running(Native);

impl Trial for Running {
    fn tick(&mut self) {
        self.0.step();
    }

    fn positions(&mut self, positions: &mut Vec<DVec3>) {
        positions.clear();
        positions.extend(self.0.state().positions.iter().map(|x| x.as_dvec3()));
    }

    fn place(&mut self, positions: &[DVec3]) {
        let positions: Vec<Vec3> = positions.iter().map(|x| x.as_vec3()).collect();
        self.0.place(&positions);
    }

    fn counts(&self) -> Counts {
        self.0.state().counts
    }
}
