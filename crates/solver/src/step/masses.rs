//! Masses of particles.

use crate::{Density, Mass, Topology, VertexIndex};
use glam::Vec4;

/// What determines the masses of a body.
#[derive(Debug, Clone, Copy)]
pub struct Masses<'a> {
    /// Mass per measure.
    pub density: Density,
    /// Additional masses, by vertex.
    pub added: &'a [(VertexIndex, Mass)],
    /// Fixed vertices.
    pub pins: &'a [VertexIndex],
}

/// Writes 1/m into w: mass from density and added masses [kg], 0 for pins and for massless
/// particles.
pub fn set_inverse_masses(
    positions: &mut [Vec4],
    topology: &Topology,
    density: Density,
    added: &[(VertexIndex, Mass)],
    pins: &[VertexIndex],
) {
    for (x, measure) in positions.iter_mut().zip(topology.measure()) {
        x.w = measure * density.get();
    }
    for &(vertex, mass) in added {
        if let Some(x) = positions.get_mut(topology.particle(vertex)) {
            x.w += mass.get();
        }
    }
    for x in positions.iter_mut() {
        let inverse = 1.0 / x.w;
        x.w = if inverse.is_finite() { inverse } else { 0.0 };
    }
    for &pin in pins {
        if let Some(x) = positions.get_mut(topology.particle(pin)) {
            x.w = 0.0;
        }
    }
}
