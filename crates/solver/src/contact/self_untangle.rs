//! Separates a surface that crosses itself.
//!
//! The crossing edges divide a surface into regions. Of the two regions that a crossing edge
//! connects, the smaller one is on the wrong side: its end of the edge is moved through the crossed
//! triangle to the side of the other end. The intersection that ends inside the surface divides
//! nothing; there, the edge moves so that the intersection becomes shorter. In both cases, with the
//! weights b of the crossing point in edge and triangle and the direction n of the edge,
//!
//! C = n·Σbᵢ(xᵢ − xᵢⁿ) − fvh ≥ 0 [m], W = Σbᵢ²wᵢ, with the recovery speed v and a fraction f: 1 between
//! regions, otherwise the length of the gradient, if below 1.
//!
//! Sources: Baraff, Witkin and Kass, *Untangling Cloth* (2003), for the regions; Volino and
//! Magnenat-Thalmann, *Resolving Surface Collisions through Intersection Contour Minimization*
//! (2006), for intersections without regions.

use super::{
    bounds::Bounds,
    contacts::{Contacts, Owner},
    crossing::{Crossing, Regions},
    tangible::Tangible,
    tangle::{Extent, Tangle},
};
use glam::DVec3;

impl Contacts {
    /// Finds in which direction each crossing of a member with itself is resolved.
    pub(super) fn orient(&self, crossings: &mut [Crossing], regions: &mut Regions) {
        let Some(first) = crossings.first() else {
            return;
        };
        let member = &self.members[first.members[0] as usize];
        let of_surface = |v: u32| v - member.first as u32;
        regions.cut.clear();
        for crossing in &*crossings {
            let [a, b] = crossing.edge.map(of_surface);
            regions.cut.push([a.min(b), a.max(b)]);
        }
        regions.divide(&member.surface);
        for crossing in crossings {
            let Some([normal, along]) = crossing.locate(&self.starts, &self.inverse_masses) else {
                continue;
            };
            let towards_end = normal * normal.dot(along).signum();
            let direction = match regions.is_smaller(crossing.edge.map(of_surface)) {
                Some(true) => towards_end,
                Some(false) => -towards_end,
                None => {
                    let first = member.first as u32;
                    let thirds = regions.thirds(crossing.edge.map(of_surface));
                    self.shorten(crossing.edge, thirds.map(|v| v + first), [normal, along])
                }
            };
            crossing.fraction = direction.length().min(1.0);
            crossing.direction = direction.normalize_or_zero();
        }
    }

    /// Direction in which an edge shortens the intersection: Σ (R − 2 (E·R)/(E·N) N) over its
    /// triangles, with its direction E, the normal N of the crossed triangle, and R along the
    /// intersection into the triangle.
    fn shorten(
        &self,
        edge: [u32; 2],
        thirds: impl Iterator<Item = u32>,
        [normal, along]: [DVec3; 2],
    ) -> DVec3 {
        let at = |v: u32| self.starts[v as usize];
        let mut sum = DVec3::ZERO;
        for third in thirds {
            let inwards = at(third) - at(edge[0]);
            let line = normal.cross(along.cross(inwards)).normalize_or_zero();
            let inwards = inwards - along * inwards.dot(along);
            let line = line * line.dot(inwards).signum();
            sum += line - normal * (2.0 * along.dot(line) / along.dot(normal));
        }
        sum
    }

    /// Moves the edges that cross a triangle of their surface or of a collider, after an iteration.
    pub(super) fn separate_crossings(&mut self, bodies: &mut [impl Tangible]) {
        let mut crossings = std::mem::take(&mut self.crossings);
        for crossing in &mut crossings {
            let [edge, triangle] = crossing.members.map(|it| &self.members[it as usize]);
            let Some(between) = edge.between(triangle) else {
                continue;
            };
            let Some(pair) = edge.pair_params(triangle, between, self.h) else {
                continue;
            };
            if crossing.inverse_mass == 0.0 {
                continue;
            }
            // The two of the edge come first.
            let corners = crossing
                .vertices()
                .into_iter()
                .zip([edge, edge, triangle, triangle, triangle]);
            let displacements =
                corners
                    .clone()
                    .zip(crossing.weights)
                    .map(|((v, member), weight)| {
                        let v = v as usize;
                        let now = match member.owner {
                            Owner::Body(body) => bodies[body].now(member.particle(v)),
                            Owner::Collider(_) => self.ends[v],
                        };
                        (now - self.starts[v]) * weight
                    });
            let displacement: DVec3 = displacements.sum();
            let error = crossing.direction.dot(displacement) - crossing.fraction * pair.recovery;
            if !error.is_finite() {
                continue;
            }
            let change = (-error / crossing.inverse_mass).max(-crossing.multiplier);
            crossing.multiplier += change;
            for ((v, member), weight) in corners.zip(crossing.weights) {
                let by = change * weight * self.inverse_masses[v as usize];
                if let Owner::Body(body) = member.owner
                    && by != 0.0
                {
                    bodies[body].shift(member.particle(v as usize), crossing.direction * by);
                    bodies[body].touch();
                }
            }
        }
        self.crossings = crossings;
    }

    /// The intersections of a member with itself: crossings whose boxes, grown by a margin, overlap
    /// belong to one.
    pub(super) fn tangles_of_itself(
        &self,
        crossings: &[Crossing],
    ) -> impl Iterator<Item = Tangle> + use<> {
        let mut boxes: Vec<([u32; 2], Bounds)> = Vec::new();
        for crossing in crossings {
            let member = &self.members[crossing.members[0] as usize];
            let margin = 2.0 * member.half_thickness() + member.surface.mean_edge;
            let mut all = crossing.bounds(&self.starts).grown(margin);
            while let Some(place) = boxes.iter().position(|(_, it)| it.meets(&all)) {
                all = all.with(boxes.swap_remove(place).1);
            }
            boxes.push((crossing.members, all));
        }
        boxes.into_iter().map(|(members, bounds)| Tangle {
            members,
            extent: Extent::Box(bounds),
            direction: DVec3::ZERO,
            multiplier: 0.0,
        })
    }
}
