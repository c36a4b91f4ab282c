//! Defective meshes.

use super::common::*;
use crate::solver::{
    RestShape,
    deform::{Deformation, deform},
    topology::LeftOut,
};
use glam::Vec3;

/// Adds a vertex, the tetrahedron between it and the first face of the surface, and its edges.
fn add_on_face(shape: &mut RestShape, height: f32) {
    let Some(&[a, b, c]) = shape.triangles.first() else {
        return;
    };
    let [xa, xb, xc] = [a, b, c].map(|i| shape.vertices[i as usize]);
    let normal = (xb - xa).cross(xc - xa).normalize_or_zero();
    let new = shape.vertices.len() as u32;
    // A quarter of an edge length is exact in f32, so that with zero height the four vertices are
    // coplanar.
    shape
        .vertices
        .push(xa + (xb - xa) * 0.25 + (xc - xa) * 0.25 + normal * height);
    shape.tetrahedra.push([a, b, c, new]);
    shape.edges.extend([[a, new], [b, new], [c, new]]);
}

/// A shape with a defect, and the elements that must be left out because of it.
fn flawed(member: &Member) -> Result<(RestShape, LeftOut), TortureError> {
    let mut shape = member.shape.build(member.scale)?;
    let mut left_out = LeftOut::default();
    let count = shape.vertices.len() as u32;
    match member.variant {
        "duplicate" => {
            let twin = shape.vertices[0];
            shape.vertices.push(twin);
            let mut cells = shape.tetrahedra.iter_mut();
            if let Some(cell) = cells.find(|cell| cell.contains(&0)) {
                let others = cell.iter().copied().filter(|&i| i != 0).collect::<Vec<_>>();
                cell.iter_mut()
                    .filter(|i| **i == 0)
                    .for_each(|i| *i = count);
                shape
                    .edges
                    .extend(others.into_iter().map(|other| [other, count]));
            }
            shape.edges.push([0, count]);
        }
        "unused" => {
            shape.vertices.push(Vec3::splat(2.0 * member.scale));
            left_out.unused_vertices = 1;
        }
        "repeated" => {
            let again: Vec<_> = shape.edges.iter().map(|&[a, b]| [b, a]).collect();
            left_out.repeated_edges = again.len();
            shape.edges.extend(again);
        }
        "flat" => {
            add_on_face(&mut shape, 0.0);
            // Its fourth corner belongs to no other tetrahedron, so that its three edges have a
            // massless end.
            (left_out.flat_tetrahedra, left_out.massless_edges) = (1, 3);
            left_out.unused_vertices = 1;
        }
        _ => add_on_face(&mut shape, member.value as f32 * member.scale),
    }
    Ok((shape, left_out))
}

pub const MESHES: Case = Case {
    name: "meshes",
    title: "Degenerate and tiny meshes",
    about: "A body of 1 m, 1 mm or 10 µm with two coincident vertices and a zero-length edge between them, with an unused vertex, with every edge twice, with a flat tetrahedron whose tip is in no other, or with a sliver of a hundredth to a hundred-thousandth of its size. Degenerate elements are counted; compressed to half its height, the body recovers within 2 s, with edges within 1 %.",
    seconds: |_| 2.0,
    family: |times| {
        let axes = Axes {
            scales: &[1.0, 1e-3, 1e-5],
            materials: &[(0.0, 0.0), (1e-5, 0.02)],
            steps: &[(10, 1), (1, 1), (32, 1)],
            seeds: &[1],
            mixtures: 8,
            ..Axes::all(&[
                Shape::Cube(2),
                Shape::Cube(1),
                Shape::Cube(4),
                Shape::Ball(4),
            ])
        };
        let members = axes.members(times);
        let slivers: Vec<Member> = family::variants(&members, &["sliver"]);
        let mut all = family::variants(&members, &["duplicate", "unused", "repeated", "flat"]);
        all.extend(family::values(&slivers, &[1e-2, 1e-3, 1e-5]));
        all
    },
    start: Start::Make(|member, world| {
        let mut body = member.body_of(flawed(member)?.0)?;
        deform(&mut body.particles, Deformation::Squash(0.5));
        world.bodies = vec![body];
        Ok(())
    }),
    during: nothing,
    judge: |run| {
        let body = &run.end.bodies[0];
        let (left_out, expected) = (body.topology.left_out, flawed(run.member)?.1);
        let miscounted = left_out.flat_tetrahedra.abs_diff(expected.flat_tetrahedra)
            + left_out.repeated_edges.abs_diff(expected.repeated_edges)
            + left_out.massless_edges.abs_diff(expected.massless_edges)
            + left_out.unused_vertices.abs_diff(expected.unused_vertices);
        Ok(vec![
            Figure::none("elements miscounted", miscounted, "elements"),
            edge_strain(body, 0.01),
        ])
    },
    outside: Outside::Nothing,
    any_body: false,
};
