//! Memory use of bodies.

use crate::{Body, Particles, Topology};
use glam::{Vec3, Vec4};
use std::collections::BTreeSet;

/// Bytes that the solver uses for bodies: state, constraints with their order, rest shape and
/// numbering. Data shared between bodies counts once; render surfaces do not count.
#[must_use]
pub fn solver_bytes(bodies: &[Body]) -> usize {
    let mut seen = BTreeSet::new();
    bodies
        .iter()
        .map(|body| {
            let (mesh, own) = match body.topology.original() {
                Some(original) => (original, rest_values(&body.topology)),
                None => (&body.topology, 0),
            };
            let is_new = seen.insert(mesh.id());
            let shared = if is_new { topology(mesh) } else { 0 };
            shared
                + own
                + state(&body.particles)
                + body.tick_start.len() * size_of::<Vec4>()
                + body.states.bytes()
                + body.stitches.bytes()
                + body.controls.as_ref().map_or(0, |it| it.bytes())
                + body.direct.bytes()
        })
        .sum()
}

fn state(particles: &Particles) -> usize {
    3 * particles.len() * size_of::<Vec4>()
        + particles.history.bytes()
        + particles.repair.bytes()
        + particles.emission.bytes()
}

/// Memory of the body's own rest values after plastic flow.
fn rest_values(topology: &Topology) -> usize {
    topology.rest_values().map_or(0, |own| {
        let columns = [&own.lengths, &own.volumes, &own.angles, &own.folds];
        columns
            .into_iter()
            .map(|column| size_of_val(&column[..]))
            .sum()
    })
}

/// Bytes of a topology: constraints with their order, rest shape and numbering.
#[must_use]
pub fn topology(topology: &Topology) -> usize {
    let particle = size_of::<Vec3>();
    let edge = size_of::<f32>();
    let tetrahedron = 2 * size_of::<f32>();
    topology.rest.len() * particle
        + topology.numbering.bytes()
        + topology.groups.bytes()
        + topology.edges.ends().len() * edge
        + topology.tetrahedra.corners().len() * tetrahedron
        + topology.edges.elements.bytes()
        + topology.tetrahedra.elements.bytes()
        + topology.lazy_bytes()
}
