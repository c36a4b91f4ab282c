//! Cuts: a body is split where a wedge crosses it, as with scissors.

use crate::{
    Topology,
    topology::{Dimension, Tearing, Torn},
};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// A cut along the wedge between two rays from a point: what a stroke on a screen covers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Cut {
    /// Where the rays start [m].
    pub eye: Vec3,
    /// Directions of the rays, not parallel.
    pub rays: [Vec3; 2],
}

impl Cut {
    /// Whether all numbers are finite and the rays are not parallel.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let [a, b] = self.rays;
        self.eye.is_finite() && a.cross(b).is_finite() && a.cross(b).length_squared() > 0.0
    }

    fn normal(&self) -> DVec3 {
        let [a, b] = self.rays.map(Vec3::as_dvec3);
        a.cross(b)
    }

    /// Side of its plane on which a point lies: its distance times the length of the normal.
    fn side(&self, x: DVec3) -> f64 {
        (x - self.eye.as_dvec3()).dot(self.normal())
    }

    /// Whether the line between two points [m] crosses the wedge.
    #[must_use]
    pub fn crosses(&self, [a, b]: [DVec3; 2]) -> bool {
        let (from, to) = (self.side(a), self.side(b));
        if (from > 0.0) == (to > 0.0) {
            return false;
        }
        let hit = a.lerp(b, from / (from - to)) - self.eye.as_dvec3();
        let ([first, second], normal) = (self.rays.map(Vec3::as_dvec3), self.normal());
        hit.cross(second).dot(normal) >= 0.0 && first.cross(hit).dot(normal) >= 0.0
    }

    /// Splits a body with particles `at` positions [m]; `None` if the wedge misses it.
    pub(crate) fn split(&self, topology: &Topology, at: impl Fn(u32) -> DVec3) -> Option<Torn> {
        let mut tearing = Tearing::of(topology, 1)?;
        let mut crossed = vec![false; topology.particles()];
        let mut cross = |corners: &[u32]| {
            for (i, &a) in corners.iter().enumerate() {
                for &b in &corners[..i] {
                    if self.crosses([at(a), at(b)]) {
                        crossed[a as usize] = true;
                        crossed[b as usize] = true;
                    }
                }
            }
        };
        match topology.dimension {
            Dimension::Solid => topology.tetrahedra.corners().for_each(|it| cross(&it)),
            Dimension::Sheet => topology.triangles.iter().for_each(|it| cross(it)),
            _ => topology.edges.ends().for_each(|it| cross(&it)),
        }
        for particle in (0..).zip(crossed).filter(|(_, it)| *it).map(|(it, _)| it) {
            for copy in tearing.copies_of(particle) {
                let fan = tearing.around(copy).iter();
                let beyond: Vec<u32> = fan
                    .copied()
                    .filter(|&element| {
                        let corners: Vec<DVec3> = tearing.corners(element).map(&at).collect();
                        let sum = corners.iter().sum::<DVec3>();
                        self.side(sum / corners.len() as f64) > 0.0
                    })
                    .collect();
                tearing.split(copy, &beyond);
            }
        }
        tearing.finish()
    }
}
