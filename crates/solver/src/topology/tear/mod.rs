//! Tearing: particles are split into copies, so that elements that shared them come apart.
//!
//! The elements that carry the mass of a body (tetrahedra, triangles of a sheet, edges of a rope)
//! all remain: mass and rest volume are exact. An element belongs to one side of a crack; its
//! particle there is replaced by a copy. Edges of a solid or a sheet follow the elements that
//! contain them, and are doubled where a crack runs along them; edges and hinges across a crack are
//! removed. Each copy is numbered next to its particle, so that partitions stay valid, and
//! elements with different particles still have different ones, so that colors stay valid.

mod attached;
mod fan;
mod order;
mod torn;

pub use order::TornOrder;
pub use torn::Torn;

use super::Dimension;
use crate::Topology;
use fan::Fans;
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};

/// A topology that is being torn.
#[derive(Debug)]
pub struct Tearing<'a> {
    topology: &'a Topology,
    carriers: Carriers,
    /// For each copy, the particle of the topology that it copies.
    roots: Vec<u32>,
    smallest_piece: usize,
}

/// The elements that carry the mass, in their order, with copies as they arise.
#[derive(Debug)]
enum Carriers {
    Solid(Mesh<4>),
    Sheet(Mesh<3>),
    Line(Mesh<2>),
}

macro_rules! with_mesh {
    ($carriers:expr, $mesh:ident => $then:expr) => {
        match $carriers {
            Carriers::Solid($mesh) => $then,
            Carriers::Sheet($mesh) => $then,
            Carriers::Line($mesh) => $then,
        }
    };
}
/// Number of elements up to which a list of them is searched from its beginning.
const LIST: usize = 32;

/// Elements of one kind.
#[derive(Debug)]
struct Mesh<const N: usize> {
    corners: Vec<[u32; N]>,
    fans: Fans,
}

impl<'a> Tearing<'a> {
    /// Begins. No split leaves a connected piece of fewer than `smallest_piece` elements. `None`
    /// for grains, which have no elements.
    #[must_use]
    pub fn of(topology: &'a Topology, smallest_piece: usize) -> Option<Self> {
        let count = topology.particles();
        let carriers = match topology.dimension {
            Dimension::Solid => {
                Carriers::Solid(Mesh::new(topology.tetrahedra.corners().collect(), count))
            }
            Dimension::Sheet => Carriers::Sheet(Mesh::new(topology.triangles.to_vec(), count)),
            Dimension::Line => Carriers::Line(Mesh::new(topology.edges.ends().collect(), count)),
            Dimension::Grains => return None,
        };
        Some(Self {
            topology,
            carriers,
            roots: Vec::new(),
            smallest_piece,
        })
    }

    /// Number of carrying elements.
    #[must_use]
    pub fn elements(&self) -> usize {
        with_mesh!(&self.carriers, mesh => mesh.corners.len())
    }

    /// Numbers of the elements around a particle or a copy.
    #[must_use]
    pub fn around(&self, particle: u32) -> &[u32] {
        with_mesh!(&self.carriers, mesh => mesh.fans.of_particle(particle))
    }

    /// Particles of an element, as those of the topology.
    pub fn corners(&self, element: u32) -> impl Iterator<Item = u32> {
        let count = self.topology.particles() as u32;
        let now = with_mesh!(&self.carriers, mesh => mesh.corners[element as usize].as_slice());
        now.iter().map(move |&corner| self.root_of(corner, count))
    }

    /// Center of an element at rest [m].
    #[must_use]
    pub fn center(&self, element: u32) -> DVec3 {
        let rest = self.corners(element);
        let (sum, count) = rest.fold((DVec3::ZERO, 0.0), |(sum, count), corner| {
            let x = self.topology.rest[corner as usize].as_dvec3();
            (sum + x, count + 1.0)
        });
        sum / count
    }

    /// A particle and its copies so far.
    #[must_use]
    pub fn copies_of(&self, particle: u32) -> Vec<u32> {
        let copies = (self.topology.particles() as u32..).zip(&self.roots);
        let own = copies.filter(|(_, root)| **root == particle);
        std::iter::once(particle)
            .chain(own.map(|(copy, _)| copy))
            .collect()
    }

    /// Whether nothing was split.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.roots.is_empty()
    }

    /// Splits a particle, or a copy: the elements `beyond` a plane get a copy of it, and then
    /// particles around, where nothing but they connected two parts. Does nothing and returns
    /// false if all its elements are on one side, or if a piece would be too small.
    pub fn split(&mut self, particle: u32, beyond: &[u32]) -> bool {
        let first_copy = self.topology.particles() + self.roots.len();
        let mut copies = Vec::new();
        let smallest = self.smallest_piece;
        with_mesh!(&mut self.carriers, mesh => {
            mesh.split(particle, beyond, smallest, first_copy as u32, &mut copies)
        });
        let count = self.topology.particles() as u32;
        for &of in &copies {
            let root = self.root_of(of, count);
            self.roots.push(root);
        }
        !copies.is_empty()
    }

    fn root_of(&self, particle: u32, count: u32) -> u32 {
        match particle.checked_sub(count) {
            Some(copy) => self.roots[copy as usize],
            None => particle,
        }
    }

    /// All copies by the particle of the topology, itself first.
    fn family(&self) -> BTreeMap<u32, Vec<u32>> {
        let mut family = BTreeMap::<u32, Vec<u32>>::new();
        for (copy, &root) in (self.topology.particles() as u32..).zip(&self.roots) {
            family.entry(root).or_insert_with(|| vec![root]).push(copy);
        }
        family
    }
}

impl<const N: usize> Mesh<N> {
    fn new(corners: Vec<[u32; N]>, particles: usize) -> Self {
        Self {
            fans: Fans::of(&corners, particles),
            corners,
        }
    }

    /// Splits a particle, and then those around it that are pinched; appends what each copy is a
    /// copy of.
    fn split(
        &mut self,
        particle: u32,
        beyond: &[u32],
        smallest: usize,
        first_copy: u32,
        copies: &mut Vec<u32>,
    ) {
        let fan = self.fans.of_particle(particle);
        let (far, near): (Vec<u32>, Vec<u32>) =
            fan.iter().partition(|element| beyond.contains(element));
        if far.is_empty() || near.is_empty() {
            return;
        }
        if smallest > 1
            && !(self.all_reach((&far, &near), smallest) && self.all_reach((&near, &far), smallest))
        {
            return;
        }
        let around = |elements: &[u32]| -> Vec<u32> {
            let corners = elements.iter().flat_map(|&it| self.corners[it as usize]);
            let mut corners: Vec<u32> = corners.filter(|&corner| corner != particle).collect();
            corners.sort_unstable();
            corners.dedup();
            corners
        };
        let mut lips = around(&far);
        let other = around(&near);
        lips.retain(|lip| other.binary_search(lip).is_ok());
        let copy = self.give_copy(particle, &far, first_copy, copies);
        // A rope holds together by its particles; there is nothing else that they could pinch.
        if N > 2 {
            for pinched in [particle, copy].into_iter().chain(lips) {
                self.separate(pinched, first_copy, copies);
            }
        }
    }

    /// Replaces a particle of some of its elements by a new copy, and returns it.
    fn give_copy(
        &mut self,
        particle: u32,
        elements: &[u32],
        first_copy: u32,
        copies: &mut Vec<u32>,
    ) -> u32 {
        let copy = first_copy + copies.len() as u32;
        copies.push(particle);
        for &element in elements {
            for corner in &mut self.corners[element as usize] {
                if *corner == particle {
                    *corner = copy;
                }
            }
        }
        self.fans.give(particle, elements, copy);
        copy
    }

    /// Gives a copy of a particle to each part of its fan that is connected to the largest one by
    /// nothing else.
    fn separate(&mut self, particle: u32, first_copy: u32, copies: &mut Vec<u32>) {
        let mut parts = self.parts(particle);
        // The largest part keeps the particle; the first of equals.
        let largest = (0..parts.len()).rev().max_by_key(|&part| parts[part].len());
        if let Some(largest) = largest {
            parts.swap_remove(largest);
        }
        parts.sort_unstable();
        for part in parts {
            self.give_copy(particle, &part, first_copy, copies);
        }
    }

    /// Parts of the fan of a particle that are connected across sides of elements.
    fn parts(&self, particle: u32) -> Vec<Vec<u32>> {
        let mut open: Vec<u32> = self.fans.of_particle(particle).to_vec();
        let mut parts = Vec::new();
        while !open.is_empty() {
            let mut part = vec![open.remove(0)];
            let mut next = 0;
            while next < part.len() {
                let here = part[next];
                let (joined, rest) = open
                    .iter()
                    .partition(|&&other| self.share_a_side(here, other));
                let joined: Vec<u32> = joined;
                part.extend(joined);
                open = rest;
                next += 1;
            }
            part.sort_unstable();
            parts.push(part);
        }
        parts
    }

    /// Whether two elements have all but one particle in common.
    fn share_a_side(&self, one: u32, other: u32) -> bool {
        let other = self.corners[other as usize];
        let common = self.corners[one as usize]
            .iter()
            .filter(|corner| other.contains(corner));
        common.count() + 1 >= N
    }

    /// Whether each element of a set is connected to at least `count` across their sides, itself
    /// included, without those between the two sets.
    fn all_reach(&self, (own, cut): (&[u32], &[u32]), count: usize) -> bool {
        let mut known: Vec<u32> = Vec::new();
        own.iter().all(|&start| {
            // What is connected to one reaches what that one does.
            if known.contains(&start) {
                return true;
            }
            let found = self.connected(start, (own, cut), count);
            let reaches = found.len() >= count;
            known.extend(found);
            reaches
        })
    }

    /// The first elements that are connected to one across their sides, itself included, without
    /// those between the two sets: `count` of them, or all if there are fewer.
    fn connected(&self, start: u32, (own, cut): (&[u32], &[u32]), count: usize) -> Vec<u32> {
        let mut found = vec![start];
        // A few are found faster in a list.
        let mut known = BTreeSet::<u32>::new();
        let mut next = 0;
        while next < found.len() && found.len() < count {
            let here = found[next];
            for &corner in &self.corners[here as usize] {
                for &other in self.fans.of_particle(corner) {
                    let is_known = match found.len() <= LIST {
                        true => found.contains(&other),
                        false => known.contains(&other),
                    };
                    let crosses = || {
                        own.contains(&here) && cut.contains(&other)
                            || cut.contains(&here) && own.contains(&other)
                    };
                    if !is_known && self.share_a_side(here, other) && !crosses() {
                        found.push(other);
                        if found.len() > LIST {
                            known.extend(&found[known.len()..]);
                        }
                    }
                }
            }
            next += 1;
        }
        found
    }
}
