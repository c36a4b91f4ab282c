//! How much memory bodies take.

use crate::{Body, Particles, Topology};
use glam::{Vec3, Vec4};
use std::{collections::BTreeSet, sync::Arc};

/// Bytes that the solver holds for bodies: state, constraints with their order, rest shape and
/// numbering. What several bodies share counts once; surfaces to draw do not count.
#[must_use]
pub fn solver_bytes(bodies: &[Body]) -> usize {
    let mut seen = BTreeSet::new();
    bodies
        .iter()
        .map(|body| {
            let new = seen.insert(Arc::as_ptr(&body.topology));
            let shared = if new { topology(&body.topology) } else { 0 };
            let original = match body.topology.original() {
                Some(original) if seen.insert(Arc::as_ptr(original)) => topology(original),
                _ => 0,
            };
            shared
                + original
                + state(&body.particles)
                + body.tick_start.len() * size_of::<Vec4>()
                + body.tether_targets.bytes()
                + body.lambdas.bytes()
                + body.stitches.bytes()
                + body.factors.bytes()
        })
        .sum()
}

fn state(particles: &Particles) -> usize {
    3 * particles.len() * size_of::<Vec4>() + particles.history.bytes() + particles.repair.bytes()
}

fn topology(topology: &Topology) -> usize {
    let particle = size_of::<Vec3>();
    let edge = size_of::<f32>();
    let tetrahedron = 2 * size_of::<f32>();
    topology.rest.len() * particle
        + topology.numbering.bytes()
        + topology.edges.ends().len() * edge
        + topology.tetrahedra.corners().len() * tetrahedron
        + topology.edges.elements.bytes()
        + topology.tetrahedra.elements.bytes()
        + topology.lazy_bytes()
}
