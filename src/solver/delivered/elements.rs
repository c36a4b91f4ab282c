//! Strain, rate of strain and rounding of each element, in f64.

use crate::solver::{Particles, Topology, reference::volume_gradients, topology::volume};
use glam::DVec3;

/// One element as it is after a substep.
#[derive(Debug, Clone, Copy)]
pub struct Element {
    /// C [m or m³].
    pub error: f64,
    /// ∇C·v, how fast C grows [m/s or m³/s].
    pub speed: f64,
    /// How far C may be off as positions are rounded to f32 [m or m³].
    pub rounding: f64,
}

/// Half of the last digit of an f32, relative to it.
const HALF_ULP: f64 = 0.5 * f32::EPSILON as f64;

/// Position [m], velocity [m/s], and how far the position may be off [m].
fn corner(particles: &Particles, i: u32) -> (DVec3, DVec3, f64) {
    let x = particles.positions[i as usize].truncate().as_dvec3();
    let v = particles.velocities[i as usize].truncate().as_dvec3();
    (x, v, HALF_ULP * x.abs().max_element())
}

/// The edges, in the order of the topology.
pub fn edges(topology: &Topology, particles: &Particles) -> impl Iterator<Item = Element> {
    let edges = &topology.edges;
    let rest_lengths = edges.rest_length.iter().copied().map(f64::from);
    edges.ends().zip(rest_lengths).map(|(ends, rest)| {
        let [(a, va, ra), (b, vb, rb)] = ends.map(|i| corner(particles, i));
        let length = a.distance(b);
        Element {
            error: length - rest,
            speed: (b - a).normalize_or_zero().dot(vb - va),
            rounding: ra + rb + HALF_ULP * rest,
        }
    })
}

/// The tetrahedra, in the order of the topology.
pub fn tetrahedra(topology: &Topology, particles: &Particles) -> impl Iterator<Item = Element> {
    let tetrahedra = &topology.tetrahedra;
    let rest_volumes = tetrahedra.rest_volume.iter().copied().map(f64::from);
    tetrahedra
        .corners()
        .zip(rest_volumes)
        .map(|(corners, rest)| {
            let corners = corners.map(|i| corner(particles, i));
            let x = corners.map(|(x, ..)| x);
            let gradients = volume_gradients(x);
            let over_corners = |term: &dyn Fn(DVec3, (DVec3, DVec3, f64)) -> f64| -> f64 {
                gradients
                    .iter()
                    .zip(corners)
                    .map(|(&g, c)| term(g, c))
                    .sum()
            };
            Element {
                error: volume(x) - rest,
                speed: over_corners(&|gradient, (_, v, _)| gradient.dot(v)),
                rounding: over_corners(&|gradient, (.., r)| gradient.length() * r)
                    + HALF_ULP * rest.abs(),
            }
        })
}
