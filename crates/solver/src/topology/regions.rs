//! Regions.

use crate::Topology;
use std::{cmp::Reverse, collections::BinaryHeap};

/// Regions of a body, and the number of regions of each particle.
///
/// Regions: overlapping parts of a body for shape matching.
///
/// A region consists of all particles within half of its size from its center, measured along edges
/// of elements, and all elements that extend beyond that. The first particle is a center, and so is
/// each following one that is farther than that from all earlier centers. Every element is
/// therefore completely inside a region, and no element connects separate regions. As distances are
/// measured along the body, two fingers that are close to each other do not form one region.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Regions {
    /// Start of each region among the members, and the end of the last.
    starts: Vec<usize>,
    /// Particles of all regions, ascending within a region.
    members: Vec<u32>,
    /// One over the number of regions of each particle; 0 without any.
    weights: Vec<f64>,
}

impl Regions {
    /// Regions of the given size [m]; ∞ is one of all particles. Vertices without elements are in
    /// none.
    #[must_use]
    pub fn of(topology: &Topology, size: f32) -> Self {
        let mut regions = Self {
            starts: vec![0],
            ..Self::default()
        };
        let acts: Vec<bool> = topology.measure().iter().map(|&m| m > 0.0).collect();
        let particles = || (0..).zip(&acts).filter(|(_, acts)| **acts).map(|(i, _)| i);
        if size == f32::INFINITY {
            regions.add(particles().collect());
        } else {
            let mut search = Search::of(topology, f64::from(size) / 2.0);
            for center in particles() {
                if !search.reached[center as usize] {
                    let mut members = search.around(center);
                    members.retain(|&i| acts[i as usize]);
                    regions.add(members);
                }
            }
        }
        let mut counts = vec![0_u32; topology.particles()];
        for &member in &regions.members {
            counts[member as usize] += 1;
        }
        let weight = |count: u32| {
            if count > 0 {
                1.0 / f64::from(count)
            } else {
                0.0
            }
        };
        regions.weights = counts.into_iter().map(weight).collect();
        regions
    }

    /// A region of one particle has no shape, and is left out.
    fn add(&mut self, members: Vec<u32>) {
        if members.len() > 1 {
            self.members.extend(members);
            self.starts.push(self.members.len());
        }
    }

    /// The particles of each region.
    pub fn each(&self) -> impl Iterator<Item = &[u32]> + Clone {
        self.starts
            .windows(2)
            .map(|ends| &self.members[ends[0]..ends[1]])
    }

    /// Number of regions.
    #[must_use]
    pub fn count(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// One over the number of regions of each particle; 0 without any.
    #[must_use]
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Memory use in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&self.starts[..])
            + size_of_val(&self.members[..])
            + size_of_val(&self.weights[..])
    }
}

/// Neighborhood search.
struct Search {
    /// Start of the neighbors of each particle, and the end of those of the last.
    starts: Vec<usize>,
    /// Neighbors and their rest distances [m].
    neighbors: Vec<(u32, f64)>,
    /// Search radius [m].
    reach: f64,
    /// Distances from the center [m], ∞ where unknown.
    ways: Vec<f64>,
    /// Particles that were reached from any center.
    reached: Vec<bool>,
}

impl Search {
    fn of(topology: &Topology, reach: f64) -> Self {
        let mut pairs = Vec::new();
        let mut add = |corners: &[u32]| {
            for &a in corners {
                let others = corners.iter().filter(|&&b| b != a);
                pairs.extend(others.map(|&b| (a, b)));
            }
        };
        topology.edges.ends().for_each(|ends| add(&ends));
        topology
            .tetrahedra
            .corners()
            .for_each(|corners| add(&corners));
        topology.triangles.iter().for_each(|corners| add(corners));
        pairs.sort_unstable();
        pairs.dedup();
        let count = topology.particles();
        let mut starts = vec![0; count + 1];
        for &(a, _) in &pairs {
            starts[a as usize + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let at = |i: u32| topology.rest[i as usize].as_dvec3();
        Self {
            starts,
            neighbors: pairs
                .into_iter()
                .map(|(a, b)| (b, at(a).distance(at(b))))
                .collect(),
            reach,
            ways: vec![f64::INFINITY; count],
            reached: vec![false; count],
        }
    }

    /// Particles within reach of a center (Dijkstra), and their neighbors.
    fn around(&mut self, center: u32) -> Vec<u32> {
        let mut members = vec![center];
        let mut open = BinaryHeap::from([Reverse((0.0_f64.to_bits(), center))]);
        self.ways[center as usize] = 0.0;
        // The bits of nonnegative numbers are in the order of the numbers.
        while let Some(Reverse((bits, particle))) = open.pop() {
            let way = f64::from_bits(bits);
            if way > self.ways[particle as usize] {
                continue;
            }
            self.reached[particle as usize] = true;
            let own = self.starts[particle as usize]..self.starts[particle as usize + 1];
            for &(neighbor, length) in &self.neighbors[own] {
                members.push(neighbor);
                let through = way + length;
                if through <= self.reach && through < self.ways[neighbor as usize] {
                    self.ways[neighbor as usize] = through;
                    open.push(Reverse((through.to_bits(), neighbor)));
                }
            }
        }
        members.sort_unstable();
        members.dedup();
        for &member in &members {
            self.ways[member as usize] = f64::INFINITY;
        }
        members
    }
}
