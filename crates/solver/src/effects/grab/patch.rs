//! The particles that a grab holds, with their weights.
//!
//! A cache that follows from the grab, the mesh and the pins; it is not part of the state.

use super::{Grab, Hold};
use crate::{SurfacePoint, Topology, TopologyId};

/// Particles and weights; empty for a grab of one point, which has its own. In a box, as few bodies
/// have one.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Patch(Option<Box<Found>>);

#[derive(Debug, Clone, Default, PartialEq)]
struct Found {
    terms: Vec<(usize, f64)>,
    of: Option<(TopologyId, SurfacePoint, f32)>,
}

impl Patch {
    /// Particles with their weights, which sum to 1, or with 1 for each pin.
    pub fn terms(&self) -> &[(usize, f64)] {
        self.0.as_ref().map_or(&[], |found| &found.terms)
    }

    /// Finds the particles of a grab on a body whose pins have an inverse mass of 0.
    pub fn update(&mut self, grab: &Grab, topology: &Topology, is_pinned: impl Fn(usize) -> bool) {
        match grab.hold {
            Hold::Point => self.0 = None,
            // Rest positions of emitted grains are where they were emitted.
            Hold::Patch { .. } if topology.is_renewed() => self.0 = None,
            Hold::Patch { radius } => {
                let of = Some((topology.id(), grab.point, radius));
                let found = self.0.get_or_insert_default();
                if found.of != of {
                    found.of = of;
                    found.terms = around(grab, topology, radius.into());
                }
            }
            // Pins may be added and removed while they are dragged.
            Hold::Pins => {
                let found = self.0.get_or_insert_default();
                found.of = None;
                found.terms = connected(grab.point.nearest().index(), topology, is_pinned);
            }
        }
    }

    /// Heap memory in bytes.
    pub fn bytes(&self) -> usize {
        self.0.as_ref().map_or(0, |found| {
            size_of::<Found>() + size_of_val(&found.terms[..])
        })
    }
}

/// Particles whose rest position is within a radius [m] of the grabbed point, weighted by
/// (1 − r²/R²)², and those of the point itself.
fn around(grab: &Grab, topology: &Topology, radius: f64) -> Vec<(usize, f64)> {
    let rest = |i: usize| topology.rest[i].as_dvec3();
    let center = grab.point.mean(rest);
    let mut weights = vec![0.0; topology.particles()];
    for (i, weight) in weights.iter_mut().enumerate() {
        let near = 1.0 - rest(i).distance_squared(center) / (radius * radius);
        // A radius of 0 at the center gives NaN, which is not above 0.
        if near > 0.0 {
            *weight = near * near;
        }
    }
    for (i, weight) in grab.point.terms() {
        weights[i.index()] += f64::from(weight);
    }
    let sum: f64 = weights.iter().sum();
    let held = weights.into_iter().enumerate();
    held.filter(|(_, weight)| *weight != 0.0)
        .map(|(i, weight)| (i, weight / sum))
        .collect()
}

/// The pins that are connected to `first` by edges between pins, in ascending order, with weights
/// of 1; none if that is not a pin.
fn connected(
    first: usize,
    topology: &Topology,
    is_pinned: impl Fn(usize) -> bool,
) -> Vec<(usize, f64)> {
    if !is_pinned(first) {
        return Vec::new();
    }
    let mut found = vec![false; topology.particles()];
    found[first] = true;
    let pairs: Vec<[usize; 2]> = topology
        .edges
        .ends()
        .map(|ends| ends.map(|end| end as usize))
        .filter(|&[a, b]| is_pinned(a) && is_pinned(b))
        .collect();
    let surface = topology.triangles.iter();
    let sides = surface.flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let sides = sides.map(|ends| ends.map(|end| end as usize));
    let sides: Vec<[usize; 2]> = sides
        .filter(|&[a, b]| is_pinned(a) && is_pinned(b))
        .collect();
    let mut grows = true;
    while grows {
        grows = false;
        for &[a, b] in pairs.iter().chain(&sides) {
            if found[a] != found[b] {
                (found[a], found[b]) = (true, true);
                grows = true;
            }
        }
    }
    let found = found.into_iter().enumerate();
    found.filter(|(_, it)| *it).map(|(i, _)| (i, 1.0)).collect()
}
