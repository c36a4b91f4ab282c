//! Tethers.

use super::body_effect::{BodyEffect, BodyPass, ReferenceParticles, ReferencePass};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Particles, Slack, Topology, TopologyId, kernel::sum::SquareSum, parallel::scope::ReadOnly,
    particles::Part,
};
use glam::{DVec3, Vec4};
use serde::{Deserialize, Serialize};
use std::{cmp::Reverse, collections::BinaryHeap};

/// Limits each particle's distance from its nearest pin to the geodesic rest distance (long-range
/// attachments).
///
/// Tethers: limit each particle's distance from its nearest pin to the geodesic rest distance.
///
/// Long-range attachments (Kim, Chentanez and Müller, *Long Range Attachments*, 2012): a particle
/// that is farther than (1 + slack) L from the pin is projected onto that sphere, with L the
/// shortest path along edges of the rest shape to the nearest pinned particle. A long hanging cloth
/// or rope therefore does not get longer, however few the iterations, although its constraints pass
/// on its weight edge by edge. Tethers only pull, and only on particles that are too far: slack
/// ones are bitwise unaffected.
///
/// The path along edges is never shorter than the one through the cloth, so that no particle is
/// pulled closer than at rest. Across a grid of triangles it is up to a twelfth longer, which makes
/// the tether looser by the same amount.
///
/// ```
/// use pliant_solver::{Slack, Tethers};
///
/// // A flag no point of which is more than 2 % farther from its pole than at rest.
/// let flag = Tethers { slack: Slack::of(0.02) };
/// # assert_ne!(flag, Tethers::default());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Tethers {
    /// Additional distance, as a fraction of the geodesic rest distance; default 0.
    pub slack: Slack,
}

/// The tethers of a body: derived from its topology and its pins, and recomputed when pins change.
#[derive(Debug, Clone, Default)]
pub struct TetherTargets {
    /// Topology for which they were found.
    found_in: Option<TopologyId>,
    /// The pinned particles.
    pins: Vec<u32>,
    /// The nearest pin of each particle.
    nearest: Vec<u32>,
    /// Position of that pin [m], and the geodesic rest distance to it [m]: ∞ for pins and for
    /// particles without a pin.
    places: Vec<Vec4>,
}

/// Derived data does not take part in comparisons.
impl PartialEq for TetherTargets {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl TetherTargets {
    /// For a body in its current state.
    #[must_use]
    pub fn of(topology: &Topology, positions: &[Vec4]) -> Self {
        let mut targets = Self::default();
        targets.update(topology, positions);
        targets
    }

    /// Updates them for the pins of a body and their positions; must be called before a tick.
    pub fn update(&mut self, topology: &Topology, positions: &[Vec4]) {
        let pins = (0..).zip(positions).filter(|(_, x)| x.w == 0.0);
        let pins = pins.map(|(particle, _)| particle);
        let found_in = Some(topology.id());
        let same = self.found_in == found_in && pins.clone().eq(self.pins.iter().copied());
        if !same {
            self.found_in = found_in;
            self.pins = pins.collect();
            self.find(topology);
        }
        for (target, &nearest) in self.places.iter_mut().zip(&self.nearest) {
            *target = positions[nearest as usize].truncate().extend(target.w);
        }
    }

    /// Finds the nearest pin of each particle along edges, and the distance to it (Dijkstra).
    fn find(&mut self, topology: &Topology) {
        let count = topology.particles();
        let neighbors = Neighbors::of(topology);
        let mut ways = vec![f64::INFINITY; count];
        self.nearest = (0..count as u32).collect();
        let mut open = BinaryHeap::new();
        for &pin in &self.pins {
            ways[pin as usize] = 0.0;
            open.push(Reverse((0.0_f64.to_bits(), pin)));
        }
        // The bits of nonnegative numbers are in the order of the numbers.
        while let Some(Reverse((bits, particle))) = open.pop() {
            let way = f64::from_bits(bits);
            if way > ways[particle as usize] {
                continue;
            }
            for &(neighbor, length) in neighbors.of_particle(particle) {
                let through = way + length;
                if through < ways[neighbor as usize] {
                    ways[neighbor as usize] = through;
                    self.nearest[neighbor as usize] = self.nearest[particle as usize];
                    open.push(Reverse((through.to_bits(), neighbor)));
                }
            }
        }
        for &pin in &self.pins {
            ways[pin as usize] = f64::INFINITY;
        }
        let places = ways.iter().map(|&way| Vec4::W * way as f32);
        self.places.clear();
        self.places.extend(places);
    }

    /// Number of tethered particles.
    #[must_use]
    pub fn count(&self) -> usize {
        self.places
            .iter()
            .filter(|target| target.w.is_finite())
            .count()
    }

    /// Memory use in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&self.pins[..]) + size_of_val(&self.nearest[..]) + size_of_val(&self.places[..])
    }

    /// For each tethered particle: its number, that of its pin, and the geodesic rest distance [m].
    pub fn ways(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        let both = self.nearest.iter().zip(&self.places).enumerate();
        both.filter(|(_, (_, target))| target.w.is_finite())
            .map(|(particle, (&pin, target))| (particle, pin as usize, target.w.into()))
    }
}

impl BodyEffect for Tethers {
    type State = TetherTargets;
    type Scope = ReadOnly;
    /// Particle, pin, and the maximum distance [m].
    type ReferenceState = Vec<(usize, usize, f64)>;

    fn begin_tick(&self, targets: &mut TetherTargets, topology: &Topology, positions: &[Vec4]) {
        targets.update(topology, positions);
    }

    fn solve(&self, targets: &TetherTargets, part: Part, pass: &BodyPass) -> bool {
        let Some(targets) = targets.places.get(pass.first..) else {
            return false;
        };
        let most = 1.0 + self.slack.get();
        let particles = part.positions.iter().zip(part.displacements);
        for ((p, u), target) in particles.zip(targets) {
            let d = (*p - *target).truncate() + u.truncate();
            let length = target.w * most;
            if d.length_squared() > length * length {
                // At the precision of the displacement, not of the position.
                let d = p.truncate().as_dvec3() - target.truncate().as_dvec3()
                    + u.truncate().as_dvec3();
                let back = held(d, length.into()) - d;
                *u = (u.truncate().as_dvec3() + back).as_vec3().extend(0.0);
            }
        }
        false
    }

    fn prepare_reference(
        &self,
        tethers: &mut Vec<(usize, usize, f64)>,
        topology: &Topology,
        x: &[DVec3],
        w: &[f64],
    ) {
        let places = x.iter().zip(w);
        let places: Vec<Vec4> = places.map(|(x, &w)| x.as_vec3().extend(w as f32)).collect();
        let most = 1.0 + f64::from(self.slack);
        let targets = TetherTargets::of(topology, &places);
        tethers.clear();
        tethers.extend(targets.ways().map(|(i, pin, way)| (i, pin, way * most)));
    }

    fn solve_reference(
        &self,
        tethers: &mut Vec<(usize, usize, f64)>,
        body: ReferenceParticles,
        _: &ReferencePass,
    ) {
        for &mut (i, pin, length) in tethers {
            let pin = body.x[pin];
            body.x[i] = pin + held(body.x[i] - pin, length);
        }
    }

    fn elements(&self, targets: &TetherTargets, _: &Topology) -> usize {
        targets.count()
    }

    fn residual(
        &self,
        targets: &TetherTargets,
        _: &Topology,
        particles: &Particles,
        _: f64,
    ) -> SquareSum {
        let most = 1.0 + f64::from(self.slack.get());
        let mut all = SquareSum::default();
        for (x, target) in particles.positions.iter().zip(&targets.places) {
            let length = f64::from(target.w) * most;
            if length.is_finite() {
                let far = (x.truncate() - target.truncate()).as_dvec3().length();
                let relative = (far / length - 1.0).max(0.0);
                all.sum += relative * relative;
                all.count += 1;
            }
        }
        all
    }

    fn bytes(targets: &TetherTargets) -> usize {
        targets.bytes()
    }
}

/// Limits the offset `d` of a particle from its pin to `length`.
fn held(d: DVec3, length: f64) -> DVec3 {
    let far = d.length();
    if far > length { d * (length / far) } else { d }
}

/// The particles that edges target to, and how long these are [m].
struct Neighbors {
    starts: Vec<usize>,
    all: Vec<(u32, f64)>,
}

impl Neighbors {
    fn of(topology: &Topology) -> Self {
        let edges = || topology.edges.ends().zip(&topology.edges.rest_length);
        let mut starts = vec![0; topology.particles() + 1];
        for end in edges().flat_map(|(ends, _)| ends) {
            starts[end as usize + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut all = vec![(0, 0.0); 2 * topology.edges.ends().len()];
        for ([a, b], &length) in edges() {
            for (from, to) in [(a, b), (b, a)] {
                all[next[from as usize]] = (to, f64::from(length));
                next[from as usize] += 1;
            }
        }
        Self { starts, all }
    }

    fn of_particle(&self, particle: u32) -> &[(u32, f64)] {
        let particle = particle as usize;
        &self.all[self.starts[particle]..self.starts[particle + 1]]
    }
}
