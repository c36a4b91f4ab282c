//! The XPBD body of OxiPhysics' soft-body crate.

use super::{Setting, Solver, Trial, grid};
use crate::{
    accuracy::{
        body::inverse_masses,
        problems::{Elasticity, Problem, Volumes},
    },
    peer::{Counts, PeerError},
    scenes::{GRAVITY, RATE, volume},
};
use glam::DVec3;
use oxiphysics_core::math::Vec3 as OxiVec3;
use oxiphysics_softbody::xpbd::XpbdBody;

/// OxiPhysics.
pub struct OxiPhysics;

impl Solver for OxiPhysics {
    fn name(&self) -> &'static str {
        "OxiPhysics"
    }

    fn setup(&self) -> &'static str {
        "`XpbdBody::step` in f64 with 1 to 1024 substeps of 1 to 64 iterations."
    }

    fn refusal(&self, problem: &Problem) -> Option<&'static str> {
        match problem.elasticity {
            Elasticity::Springs { .. } => None,
            Elasticity::NeoHookean { .. } => Some("its XPBD body has no elastic tetrahedra"),
        }
    }

    fn settings(&self, _problem: &Problem) -> Vec<Setting> {
        grid(
            &[1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024],
            &[1, 2, 4, 16, 64],
            4096,
        )
    }

    fn build(&self, problem: &Problem, setting: Setting) -> Result<Box<dyn Trial>, PeerError> {
        let shape = &problem.shape;
        let mut body = XpbdBody::new(shape.vertices.len());
        for (x, inverse) in shape.vertices.iter().zip(inverse_masses(problem)?) {
            let mass = if inverse > 0.0 {
                1.0 / f64::from(inverse)
            } else {
                0.0
            };
            body.add_particle(vector(x.as_dvec3()), mass);
        }
        if let Elasticity::Springs {
            compliance,
            volumes,
        } = problem.elasticity
        {
            for &[a, b] in &shape.edges {
                body.add_distance_constraint(a as usize, b as usize, f64::from(compliance));
            }
            for corners in &shape.tetrahedra {
                let points = corners.map(|corner| shape.vertices[corner as usize].as_dvec3());
                let compliance = match volumes {
                    Volumes::Free => continue,
                    Volumes::Rigid => 0.0,
                    Volumes::Bulk(modulus) => volume(points).abs() / f64::from(modulus),
                };
                body.add_volume_constraint(corners.map(|corner| corner as usize), compliance);
            }
        }
        Ok(Box::new(Running { body, setting }))
    }
}

fn vector(x: DVec3) -> OxiVec3 {
    OxiVec3::new(x.x, x.y, x.z)
}

struct Running {
    body: XpbdBody,
    setting: Setting,
}

impl Trial for Running {
    fn tick(&mut self) {
        let gravity = OxiVec3::new(0.0, f64::from(GRAVITY), 0.0);
        let (substeps, iterations) = (self.setting.substeps, self.setting.iterations);
        self.body.step(
            1.0 / f64::from(RATE),
            gravity,
            substeps as usize,
            iterations as usize,
        );
    }

    fn positions(&mut self, positions: &mut Vec<DVec3>) {
        positions.clear();
        let own = self.body.positions.iter();
        positions.extend(own.map(|x| DVec3::new(x.x, x.y, x.z)));
    }

    fn place(&mut self, positions: &[DVec3]) {
        for (i, &x) in positions.iter().enumerate() {
            if self.body.inv_masses[i] > 0.0 {
                self.body.positions[i] = vector(x);
                self.body.prev_positions[i] = vector(x);
            }
            self.body.velocities[i] = vector(DVec3::ZERO);
        }
    }

    fn counts(&self) -> Counts {
        Counts {
            edges: self.body.distance_constraints.len() as u64,
            tetrahedra: self.body.volume_constraints.len() as u64,
            per_tetrahedron: 1,
        }
    }
}
