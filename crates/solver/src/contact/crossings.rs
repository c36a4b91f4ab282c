//! Counts crossings of surfaces, as a check that there are none, and finds what overlaps.

use super::{
    bounds::{Bounds, Grid},
    closed_mesh::ClosedMesh,
    intersect::{around, crosses, touches},
    stitched::StitchedVertices,
};
use crate::{
    Collider, ColliderMesh, Effects, Particles, Pose, Stitches, Topology, colliders::inside::deep,
    particles::MAX_COORDINATE, topology::surface::Surface,
};
use glam::{DVec3, Vec3};

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

/// What a body overlaps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Overlapped {
    /// Itself.
    Itself,
    /// Another body, by its index.
    Body(usize),
    /// A collider, by its index.
    Collider(usize),
}

/// A surface with the positions of its vertices.
struct Shape<'a> {
    surface: &'a Surface,
    /// `None` for a collider.
    body: Option<Outline<'a>>,
    /// Number of the body or the collider.
    number: u32,
    stitched: StitchedVertices,
    x: Vec<DVec3>,
    bounds: Bounds,
}

impl<'a> Shape<'a> {
    fn of_body((number, body): (u32, Outline<'a>)) -> Self {
        let surface = body.topology.surface();
        let at = |&i: &u32| body.particles.position(i as usize);
        let x: Vec<DVec3> = surface.vertices.iter().map(at).collect();
        Self {
            surface,
            number,
            stitched: StitchedVertices::of(body.stitches, surface),
            bounds: around(&x),
            x,
            body: Some(body),
        }
    }

    fn of_collider(number: u32, mesh: &'a ColliderMesh, pose: &Pose) -> Self {
        let at = |rest: &Vec3| pose.apply(rest.as_dvec3());
        let x: Vec<DVec3> = mesh.vertices().iter().map(at).collect();
        Self {
            surface: mesh.surface(),
            number,
            stitched: StitchedVertices::default(),
            bounds: around(&x),
            x,
            body: None,
        }
    }

    /// Whether two surfaces have contact with each other.
    fn touches(&self, other: &Self) -> bool {
        match (&self.body, &other.body) {
            (Some(a), Some(b)) => a.effects.contact.is_some() && b.effects.contact.is_some(),
            (Some(body), None) | (None, Some(body)) => body.effects.collide.is_some(),
            (None, None) => false,
        }
    }

    /// Whether it has contact with itself.
    fn touches_itself(&self) -> bool {
        self.body
            .is_some_and(|it| it.effects.self_contact.is_some())
    }

    fn triangles(&self) -> impl Iterator<Item = [DVec3; 3]> {
        let triangles = self.surface.triangles.iter();
        triangles.map(|it| it.map(|v| self.x[v as usize]))
    }

    /// Whether a part of it is within a closed surface.
    fn is_within(&self, other: &Self) -> bool {
        let Some(body) = self.body.filter(|_| other.surface.is_closed()) else {
            return false;
        };
        let at = |i: u32| body.particles.position(i as usize);
        let mesh = ClosedMesh::new(other.triangles().collect());
        !mesh.parts_within(body.topology, at).is_empty()
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
    let bodies = touching.map(Shape::of_body);
    let colliders = (0..).zip(colliders);
    let colliders = colliders.map(|(number, (mesh, pose))| Shape::of_collider(number, mesh, pose));
    let shapes: Vec<Shape> = bodies.chain(colliders).collect();
    let mut count = 0;
    let mut grid = Grid::default();
    for (place, a) in shapes.iter().enumerate() {
        if a.touches_itself() {
            count += between(a, a, &mut grid, crosses);
        }
        for b in &shapes[place + 1..] {
            if a.touches(b) && a.bounds.meets(&b.bounds) {
                count += between(a, b, &mut grid, crosses) + between(b, a, &mut grid, crosses);
            }
        }
    }
    count
}

/// The bodies of a world, in order, that overlap what they have contact with at a time [s], by their
/// index: surfaces that cross or touch at distance 0, a body within a closed mesh, and particles in other
/// colliders.
#[must_use]
pub fn overlaps<'a>(
    bodies: impl Iterator<Item = Outline<'a>>,
    colliders: &[Collider],
    time: f64,
) -> Vec<(usize, Overlapped)> {
    let shapes: Vec<Shape> = (0..).zip(bodies).map(Shape::of_body).collect();
    let meshes = (0..).zip(colliders).filter_map(|(number, it)| {
        let (mesh, pose) = it.mesh_at(time)?;
        Some(Shape::of_collider(number, mesh, &pose))
    });
    let meshes: Vec<Shape> = meshes.collect();
    let mut grid = Grid::default();
    let mut found = Vec::new();
    for (number, a) in shapes.iter().enumerate() {
        if a.touches_itself() && between(a, a, &mut grid, crosses) > 0 {
            found.push((number, Overlapped::Itself));
        }
        for b in shapes[number + 1..].iter().chain(&meshes) {
            let meet = |grid: &mut Grid| {
                between(a, b, grid, meets) + between(b, a, grid, meets) > 0
                    || b.body.is_none() && a.is_within(b)
            };
            if a.touches(b) && a.bounds.meets(&b.bounds) && meet(&mut grid) {
                let other = b.number as usize;
                found.push(match b.body {
                    Some(_) => (number, Overlapped::Body(other)),
                    None => (number, Overlapped::Collider(other)),
                });
            }
        }
        let Some(body) = a.body.filter(|it| it.effects.collide.is_some()) else {
            continue;
        };
        for (other, collider) in colliders.iter().enumerate() {
            let pose = collider.pose_at(time);
            let is_inside = |i: usize| {
                let x = pose.undo(body.particles.position(i));
                collider.shape.distance(x) < -deep(&collider.shape)
            };
            let mut particles = 0..body.topology.particles();
            if collider.shape.mesh().is_none() && particles.any(is_inside) {
                found.push((number, Overlapped::Collider(other)));
            }
        }
    }
    found
}

/// Whether a segment crosses or touches a triangle.
fn meets(ends: [DVec3; 2], corners: [DVec3; 3]) -> bool {
    crosses(ends, corners) || touches(ends, corners)
}

/// Counts edges of `a` that meet triangles of `b`.
fn between(
    a: &Shape,
    b: &Shape,
    grid: &mut Grid,
    meet: fn([DVec3; 2], [DVec3; 3]) -> bool,
) -> usize {
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
            if !shares && boxes[item as usize].meets(&bounds) && meet(ends(edge), corners) {
                count += 1;
            }
        });
    }
    count
}
