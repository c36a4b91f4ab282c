//! Single elements.

use super::common::*;
use crate::solver::deform::{Deformation, deform};

/// Number of iterations within which a single element must recover.
const MAX_ITERATIONS: f64 = 100.0;

fn seconds(member: &Member) -> f64 {
    let a_tick = f64::from(member.substeps) * f64::from(member.iterations);
    (MAX_ITERATIONS / a_tick).ceil() / 60.0
}

fn tiny_to_huge(shapes: &'static [Shape]) -> Axes {
    Axes {
        scales: &[1.0, 1e-5, 1e-3, 0.1, 10.0, 1e3],
        materials: &[(0.0, 0.0)],
        steps: &[(1, 1), (2, 1), (10, 1), (32, 1), (1, 10)],
        seeds: &[1],
        mixtures: 10,
        ..Axes::all(shapes)
    }
}

pub const ELEMENT: Case = Case {
    name: "element",
    title: "Single tetrahedron",
    about: "One tetrahedron, from 10 µm to 1 km, starts flat, mirrored, at −1.5 times its volume, as a line or as a point. Within 100 iterations its signed volume is correct within 1 %.",
    seconds,
    family: |times| {
        let members = tiny_to_huge(&[Shape::Tetrahedron, Shape::Sliver]).members(times);
        family::variants(
            &members,
            &["flat", "mirrored", "inside_out", "line", "point"],
        )
    },
    start: Start::Make(|member, world| {
        let how = match member.variant {
            "flat" => Deformation::Squash(0.0),
            "mirrored" => Deformation::Mirror,
            "inside_out" => Deformation::Squash(-1.5),
            "line" => Deformation::Line,
            _ => Deformation::Scale(0.0),
        };
        deform(&mut world.bodies[0].particles, how);
        Ok(())
    }),
    during: nothing,
    judge: |run| {
        let (_, volumes) = strains(&run.end.bodies[0]);
        let error = volumes.iter().fold(0.0, |most: f64, s| most.max(s.abs()));
        let inverted = volumes.iter().filter(|&&s| s <= -1.0).count();
        Ok(vec![
            Figure::none("elements inside out", inverted, "elements"),
            Figure::new("error of volume", error * 100.0, 1.0, "%"),
        ])
    },
    outside: Outside::Nothing,
    any_body: false,
};

pub const EDGE: Case = Case {
    name: "edge",
    title: "Zero-length edge",
    about: "Both ends of an edge coincide. Within 100 iterations it has its rest length within 0.001 %.",
    seconds,
    family: |times| tiny_to_huge(&[Shape::Rope(1)]).members(times),
    start: Start::Make(|_, world| {
        deform(&mut world.bodies[0].particles, Deformation::Scale(0.0));
        Ok(())
    }),
    during: nothing,
    judge: |run| Ok(vec![edge_strain(&run.end.bodies[0], 1e-5)]),
    outside: Outside::Nothing,
    any_body: false,
};
