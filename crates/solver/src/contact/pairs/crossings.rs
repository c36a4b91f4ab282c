//! Counts crossings of surfaces, as a check that there are none.

use super::{
    bounds::{Bounds, Grid},
    stitched::StitchedVertices,
};
use crate::{
    ColliderMesh, Effects, Particles, Pose, Stitches, Topology, particles::MAX_COORDINATE,
    topology::surface::Surface,
};
use glam::{DVec3, Vec3, Vec3A};
use robust::{Coord3D, orient3d};

/// Margin of the boxes, as a fraction of the largest coordinate: a few ε of `f32`.
const SLACK: f64 = 1e-6;

/// A body whose surface is checked for crossings.
#[derive(Debug, Clone, Copy)]
pub struct Outline<'a> {
    /// Effects of the body.
    pub effects: &'a Effects,
    /// Topology of the body.
    pub topology: &'a Topology,
    /// Stitches of the body, if any.
    pub stitches: Option<&'a Stitches>,
    /// Particles of the body.
    pub particles: &'a Particles,
}

/// A surface with the positions of its vertices.
struct Shape<'a> {
    surface: &'a Surface,
    /// Effects of a body; `None` for a collider.
    effects: Option<&'a Effects>,
    /// Number of the body; of no meaning for a collider.
    number: u32,
    stitched: StitchedVertices,
    x: Vec<DVec3>,
    bounds: Bounds,
}

impl<'a> Shape<'a> {
    fn new(surface: &'a Surface, effects: Option<&'a Effects>, x: Vec<DVec3>) -> Self {
        let bounds = x
            .iter()
            .fold(Bounds::EMPTY, |all, &x| all.with(around(&[x])));
        Self {
            surface,
            effects,
            number: u32::MAX,
            stitched: StitchedVertices::default(),
            x,
            bounds,
        }
    }

    /// Whether two surfaces have contact with each other.
    fn touches(&self, other: &Self) -> bool {
        match (self.effects, other.effects) {
            (Some(a), Some(b)) => a.contact.is_some() && b.contact.is_some(),
            (Some(body), None) | (None, Some(body)) => body.collide.is_some(),
            (None, None) => false,
        }
    }
}

/// Number of crossing edge–triangle pairs of all bodies of a world in order: between bodies that carry [`Contact`](crate::Contact),
/// within those that carry [`SelfContact`](crate::SelfContact), and between those that carry
/// [`Collide`](crate::Collide) and the meshes of colliders, in their poses. Exact for the given
/// positions (Shewchuk 1997). Pairs that only touch, that share a vertex or that a stitch holds together
/// do not count.
#[must_use]
pub fn crossings<'a>(
    bodies: impl Iterator<Item = Outline<'a>>,
    colliders: &[(&'a ColliderMesh, Pose)],
) -> usize {
    let touching = (0..)
        .zip(bodies)
        .filter(|(_, body)| body.effects.touches_surfaces(!colliders.is_empty()));
    let bodies = touching.map(|(number, body)| {
        let surface = body.topology.surface();
        let at = |&i: &u32| body.particles.position(i as usize);
        let x = surface.vertices.iter().map(at).collect();
        let stitched = StitchedVertices::of(body.stitches, surface);
        Shape {
            number,
            stitched,
            ..Shape::new(surface, Some(body.effects), x)
        }
    });
    let colliders = colliders.iter().map(|(mesh, pose)| {
        let at = |rest: &Vec3| pose.apply(rest.as_dvec3());
        Shape::new(
            mesh.surface(),
            None,
            mesh.vertices().iter().map(at).collect(),
        )
    });
    let shapes: Vec<Shape> = bodies.chain(colliders).collect();
    let mut count = 0;
    let mut grid = Grid::default();
    for (place, a) in shapes.iter().enumerate() {
        if a.effects.is_some_and(|it| it.self_contact.is_some()) {
            count += between(a, a, &mut grid);
        }
        for b in &shapes[place + 1..] {
            if a.touches(b) && a.bounds.meets(&b.bounds) {
                count += between(a, b, &mut grid) + between(b, a, &mut grid);
            }
        }
    }
    count
}

/// Counts edges of `a` through triangles of `b`.
fn between(a: &Shape, b: &Shape, grid: &mut Grid) -> usize {
    let is_itself = std::ptr::eq(a, b);
    let ends = |edge: [u32; 2]| edge.map(|v| a.x[v as usize]);
    // Farther out, bodies pass through each other, and boxes are so coarse that all of them overlap.
    let is_near = |at: &DVec3| at.abs().max_element() <= MAX_COORDINATE;
    let edges = a.surface.edges.iter();
    let edges = edges.filter(|edge| ends(**edge).iter().all(is_near));
    let (edges, boxes): (Vec<[u32; 2]>, Vec<Bounds>) = edges
        .map(|&edge| (edge, around(&ends(edge))))
        .filter(|(_, near)| near.meets(&b.bounds))
        .unzip();
    if edges.is_empty() {
        return 0;
    }
    let length = |bounds: &Bounds| f64::from((bounds.high - bounds.low).max_element());
    let mean = boxes.iter().map(length).sum::<f64>() / boxes.len() as f64;
    grid.fill(&boxes, mean as f32);
    let mut count = 0;
    for triangle in &b.surface.triangles {
        let corners = triangle.map(|v| b.x[v as usize]);
        let bounds = around(&corners);
        if !corners.iter().all(is_near) || !bounds.meets(&a.bounds) {
            continue;
        }
        grid.near(&bounds, |item| {
            let edge = edges[item as usize];
            let shares = if is_itself {
                edge.iter().any(|end| triangle.contains(end)) || a.stitched.hold(edge, *triangle)
            } else {
                a.stitched.join(edge, b.number) || b.stitched.join(*triangle, a.number)
            };
            if !shares && boxes[item as usize].meets(&bounds) && crosses(ends(edge), corners) {
                count += 1;
            }
        });
    }
    count
}

/// Whether a segment passes through a triangle.
pub(super) fn crosses([p, q]: [DVec3; 2], [a, b, c]: [DVec3; 3]) -> bool {
    let side = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| {
        let [a, b, c, d] = [a, b, c, d].map(|DVec3 { x, y, z }| Coord3D { x, y, z });
        orient3d(a, b, c, d)
    };
    let [first, last] = [side(a, b, c, p), side(a, b, c, q)];
    if !(first > 0.0 && last < 0.0 || first < 0.0 && last > 0.0) {
        return false;
    }
    let turns = [side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)];
    turns.iter().all(|turn| *turn > 0.0) || turns.iter().all(|turn| *turn < 0.0)
}

/// Box around points [m], with a margin for rounding.
pub(super) fn around(points: &[DVec3]) -> Bounds {
    points.iter().fold(Bounds::EMPTY, |all, point| {
        let slack = (point.abs().max_element() * SLACK) as f32;
        let at: Vec3A = point.as_vec3a();
        all.with(Bounds::around(at, at).grown(slack))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_segment_crosses_a_triangle_only_inside_of_it() {
        let triangle = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let through = |x: f64, y: f64| {
            let at = DVec3::new(x, y, 0.0);
            crosses([at - DVec3::Z, at + DVec3::Z], triangle)
        };
        assert!(through(0.2, 0.2));
        assert!(!through(0.6, 0.6), "beside it");
        assert!(!through(0.5, 0.0), "on its border");
        let above = [DVec3::new(0.2, 0.2, 1.0), DVec3::new(0.2, 0.2, 1e-300)];
        assert!(!crosses(above, triangle), "above it");
    }
}
