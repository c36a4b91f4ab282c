//! A closed surface: what it encloses, and the way out.

use super::{
    bounds::Bounds,
    closest::on_triangle,
    intersect::{around, crosses},
    tangle::UNDECIDED,
};
use crate::Topology;
use glam::DVec3;

/// Number of particles of a part that decide to which side it leaves.
const SAMPLES: usize = 32;

/// Slopes of the line that counts the triangles around a point: with those of no mesh, so that it meets
/// no edges.
const SLOPES: [f64; 2] = [0.013_757, 0.029_113];

/// The triangles of a closed surface [m], with their boxes and the box around all.
#[derive(Debug)]
pub(super) struct ClosedMesh {
    triangles: Vec<[DVec3; 3]>,
    boxes: Vec<Bounds>,
    bounds: Bounds,
}

impl ClosedMesh {
    pub fn new(triangles: Vec<[DVec3; 3]>) -> Self {
        let boxes: Vec<Bounds> = triangles.iter().map(|corners| around(corners)).collect();
        let bounds = boxes.iter().fold(Bounds::EMPTY, |all, it| all.with(*it));
        Self {
            triangles,
            boxes,
            bounds,
        }
    }

    /// How often the triangles enclose a point, 1 within a simple surface that faces outwards: of the
    /// triangles that a line from the point to the outside crosses, those that it leaves through less
    /// those that it enters through.
    fn encloses(&self, point: DVec3) -> i32 {
        if !self.bounds.contains(point.as_vec3a()) {
            return 0;
        }
        let length = f64::from(self.bounds.high.x) - point.x + 1.0;
        let [y, z] = SLOPES;
        let along = DVec3::new(1.0, y, z) * length;
        let line = [point, point + along];
        let near = around(&line);
        let triangles = self.triangles.iter().zip(&self.boxes);
        let met =
            triangles.filter(|(corners, bounds)| bounds.meets(&near) && crosses(line, **corners));
        met.map(|([a, b, c], _)| {
            let leaves = (*b - *a).cross(*c - *a).dot(along) > 0.0;
            if leaves { 1 } else { -1 }
        })
        .sum()
    }

    /// The connected parts of a body with particles at these positions [m] that begin within, and are
    /// wholly within if none of them crosses; particles in ascending order.
    pub fn parts_within(&self, topology: &Topology, at: impl Fn(u32) -> DVec3) -> Vec<Vec<u32>> {
        let components = topology.components();
        let is_within = |part: &&[u32]| self.encloses(at(part[0])) > 0;
        let parts = components.parts().filter(is_within);
        let mut found: Vec<Vec<u32>> = parts.map(<[u32]>::to_vec).collect();
        if components.members().len() < topology.particles() {
            let mut is_alone = vec![true; topology.particles()];
            for &i in components.members() {
                is_alone[i as usize] = false;
            }
            let alone = (0..).zip(is_alone).filter(|it| it.1).map(|(i, _)| [i]);
            let within = alone.filter(|part| is_within(&&part[..]));
            found.extend(within.map(|part| part.to_vec()));
        }
        found
    }

    /// Direction in which a part of a body leaves, a unit vector: the mean of the normals where its
    /// particles are nearest to the surface.
    pub fn way_out(&self, part: &[u32], at: impl Fn(u32) -> DVec3) -> DVec3 {
        let count = part.len().min(SAMPLES);
        let (mut sum, mut mean) = (DVec3::ZERO, DVec3::ZERO);
        for sample in 0..count {
            let x = at(part[sample * part.len() / count]);
            mean += x / count as f64;
            sum += self.normal_near(x);
        }
        if sum.length() < UNDECIDED * count as f64 {
            sum = mean - self.bounds.center().as_dvec3();
        }
        sum.try_normalize().unwrap_or(DVec3::Y)
    }

    /// Unit normal of the triangle nearest to a point.
    fn normal_near(&self, point: DVec3) -> DVec3 {
        let squared = |corners: &[DVec3; 3]| {
            let nearest = on_triangle(point, *corners).into_iter().zip(corners);
            let nearest: DVec3 = nearest.map(|(weight, corner)| *corner * weight).sum();
            point.distance_squared(nearest)
        };
        let distances = self.triangles.iter().map(|it| (squared(it), it));
        let nearest = distances.reduce(|best, it| if it.0 < best.0 { it } else { best });
        nearest.map_or(DVec3::ZERO, |(_, [a, b, c])| {
            (*b - *a).cross(*c - *a).normalize_or_zero()
        })
    }
}
