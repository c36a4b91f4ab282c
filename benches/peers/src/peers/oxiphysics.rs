//! The XPBD body of OxiPhysics' soft-body crate.

use crate::{
    machine::locked_version,
    peer::{Counts, Peer, PeerError, Report, Run},
    scenes::{GRAVITY, RATE, SUBSTEPS, Scene},
};
use glam::Vec3;
use oxiphysics_core::math::Vec3 as OxiVec3;
use oxiphysics_softbody::xpbd::XpbdBody;

/// OxiPhysics.
pub struct OxiPhysics;

impl Peer for OxiPhysics {
    fn name(&self) -> &'static str {
        "OxiPhysics"
    }

    fn version(&self) -> String {
        locked_version("oxiphysics-softbody")
    }

    fn settings(&self) -> &'static str {
        "`XpbdBody::step`, in f64, its only precision. One thread; bodies one after the other. A \
         volume that is off by less than 10⁻¹⁴ m³ is not projected."
    }

    fn is_parallel(&self) -> bool {
        false
    }

    fn build(&self, scene: &Scene, _threads: usize) -> Result<Box<dyn Run>, PeerError> {
        let body = |offset: &Vec3| {
            let shape = &scene.shape;
            let mut body = XpbdBody::new(shape.vertices.len());
            for (&vertex, &inverse) in shape.vertices.iter().zip(&scene.inverse_masses) {
                let x = (vertex + *offset).as_dvec3();
                let mass = if inverse > 0.0 {
                    1.0 / f64::from(inverse)
                } else {
                    0.0
                };
                body.add_particle(OxiVec3::new(x.x, x.y, x.z), mass);
            }
            let compliance = f64::from(scene.edge_compliance);
            for &[a, b] in &shape.edges {
                body.add_distance_constraint(a as usize, b as usize, compliance);
            }
            for corners in &shape.tetrahedra {
                body.add_volume_constraint(corners.map(|corner| corner as usize), 0.0);
            }
            body
        };
        Ok(Box::new(Running(scene.offsets.iter().map(body).collect())))
    }
}

struct Running(Vec<XpbdBody>);

impl Run for Running {
    fn tick(&mut self) -> Result<(), PeerError> {
        let gravity = OxiVec3::new(0.0, f64::from(GRAVITY), 0.0);
        for body in &mut self.0 {
            body.step(1.0 / f64::from(RATE), gravity, SUBSTEPS as usize, 1);
        }
        Ok(())
    }

    fn report(&mut self) -> Result<Report, PeerError> {
        let mut counts = Counts {
            per_tetrahedron: 1,
            ..Counts::default()
        };
        let mut positions = Vec::new();
        for body in &self.0 {
            counts.edges += body.distance_constraints.len() as u64;
            counts.tetrahedra += body.volume_constraints.len() as u64;
            positions.extend(
                body.positions
                    .iter()
                    .map(|x| Vec3::new(x.x as f32, x.y as f32, x.z as f32)),
            );
        }
        Ok(Report { counts, positions })
    }
}
