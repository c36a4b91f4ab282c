//! Large mass and stiffness ratios, fully rigid and very soft bodies, infeasible constraints.

use super::{common::*, time};
use crate::solver::{
    Compliance, Iterations, Mass, SmoothingIterations, Stiffness, Stretch, VertexIndex, Volume,
};
use glam::Vec3;

/// Limit on the constraint iterations per substep.
const MAX_ITERATIONS: u32 = 8192;

/// Largest strain of an edge.
fn max_strain(world: &World) -> f64 {
    let (edges, _) = strains(&world.bodies[0]);
    edges.iter().fold(0.0, |most, s| most.max(s.abs()))
}

pub const MASSES: Case = Case {
    name: "masses",
    title: "High mass ratio",
    about: "A rigid rope carries a load of 1000 and 50 000 times the mass of one of its particles. Its edges stretch by at most 1 %; the figures give the cost.",
    seconds: |_| 1.0,
    family: |times| {
        let axes = Axes {
            scales: &[1.0, 0.1, 10.0],
            materials: &[(0.0, 0.0)],
            steps: &[(16, 1), (4, 1), (32, 1)],
            seeds: &[1],
            mixtures: 0,
            ..Axes::all(&[Shape::Rope(4), Shape::Rope(1), Shape::Rope(16)])
        };
        family::values(&axes.members(times), &[1e3, 5e4])
    },
    start: Start::Make(|member, world| {
        let body = &mut world.bodies[0];
        stand_up(member, body);
        let link = 1.0 / body.particles.positions[1].w;
        body.added_mass = vec![(VertexIndex(0), Mass::new(link * member.value as f32)?)];
        pin_top(body);
        world.settings.set_gravity(member.gravity())?;
        // The fewest iterations that hold the load.
        let mut iterations = 1;
        loop {
            world.settings.iterations = Iterations::new(iterations)?;
            let mut trial = world.clone();
            let mut most: f64 = 0.0;
            while trial.time < 1.0 && most <= 0.01 {
                trial.tick();
                most = most.max(max_strain(&trial));
            }
            if most <= 0.01 || iterations >= MAX_ITERATIONS {
                return Ok(());
            }
            iterations *= 2;
        }
    }),
    during: nothing,
    judge: |run| {
        let settings = run.end.settings;
        let edges = run.end.bodies[0].topology.edges.ends().len() as f64;
        let iterations = f64::from(settings.substeps.get()) * f64::from(settings.iterations.get());
        Ok(vec![
            Figure::new("stretch of an edge", max_strain(&run.end) * 100.0, 1.0, "%"),
            Figure::new(
                "cost",
                iterations * edges,
                f64::INFINITY,
                "projections a tick",
            ),
        ])
    },
    outside: Outside::Nothing,
    any_body: false,
};

/// Alternating links of 1 m and of 0.1 mm with the same axial stiffness [N]: the short ones are 10⁴
/// times as stiff.
const SHORT: f32 = 1e-4;
const AXIAL: f32 = 2e3;
const WEIGHT: f32 = 2.0;

pub const STIFFNESSES: Case = Case {
    name: "stiffnesses",
    title: "High stiffness ratio",
    about: "A chain of alternating links with a stiffness ratio of 10⁴ carries 2 kg. The stretch of each soft link matches its load within 2 %.",
    seconds: |_| 6.0,
    family: |times| {
        let axes = Axes {
            scales: &[1.0],
            materials: &[(0.0, 0.05)],
            steps: &[(10, 512), (10, 256), (20, 256)],
            seeds: &[1],
            mixtures: 0,
            ..Axes::all(&[Shape::Rope(4), Shape::Rope(2), Shape::Rope(8)])
        };
        axes.members(times)
    },
    start: Start::Make(|member, world| {
        let Shape::Rope(links) = member.shape else {
            return Ok(());
        };
        let mut shape = member.shape.build(1.0)?;
        let mut height = 0.0;
        shape.vertices.clear();
        shape.vertices.push(Vec3::ZERO);
        for link in 0..links {
            height -= if link % 2 == 0 { 1.0 } else { SHORT };
            shape.vertices.push(Vec3::new(0.0, height, 0.0));
        }
        let mut body = member.body_of(shape)?;
        body.added_mass = vec![(VertexIndex(links), Mass::new(WEIGHT)?)];
        if let Some(stretch) = &mut body.effects.stretch {
            stretch.axial_stiffness = Stiffness::new(AXIAL)?;
        }
        pin_top(&mut body);
        world.bodies = vec![body];
        world.settings.set_gravity(member.gravity())?;
        Ok(())
    }),
    during: nothing,
    judge: |run| {
        let body = &run.end.bodies[0];
        let gravity = f64::from(-run.end.settings.gravity.y);
        let errors = measure::edge_errors(&body.topology, &body.particles.positions);
        let soft = body
            .topology
            .edges
            .ends()
            .zip(errors)
            .zip(&body.topology.edges.rest_length);
        let off = soft
            .filter(|(_, rest)| **rest > 0.5)
            .map(|(([a, b], error), &rest)| {
                let lower = a.max(b) as usize;
                let carried = body.particles.positions[lower..].iter();
                let carried: f64 = carried.map(|x| 1.0 / f64::from(x.w)).sum();
                let expected = carried * gravity * f64::from(rest) / f64::from(AXIAL);
                (error / expected - 1.0).abs()
            });
        let most = off.fold(0.0, f64::max);
        Ok(vec![Figure::new(
            "error of a soft link's stretch",
            most * 100.0,
            2.0,
            "%",
        )])
    },
    outside: Outside::Nothing,
    any_body: false,
};

/// Compliance of a very soft body [m/N, m⁵/N].
const LOOSE: f32 = 1e6;

pub const EXTREMES: Case = Case {
    name: "extremes",
    title: "Extreme compliances",
    about: "With compliance 0 everywhere, a body released at 0.9 of its height stays finite, and a solid returns to its rest shape within 1 s. With 10⁶ m/N and m⁵/N it falls freely, within 0.01 % of the discrete solution and f32 rounding.",
    seconds: |_| 1.0,
    family: |times| {
        let rigid = |shapes| Axes {
            materials: &[(0.0, 0.0)],
            mixtures: 8,
            ..Axes::all(shapes)
        };
        let loose = |shapes| Axes {
            scales: &[1.0],
            materials: &[(0.0, 0.0)],
            steps: &[(1, 1), (2, 1), (4, 1)],
            seeds: &[1],
            mixtures: 0,
            ..Axes::all(shapes)
        };
        let kinds = [family::SOLIDS, family::CLOTHS, family::ROPES];
        let mut all = family::variants(&family::of(times, &kinds.map(rigid)), &["rigid"]);
        all.extend(family::variants(
            &family::of(times, &kinds.map(loose)),
            &["loose"],
        ));
        all
    },
    start: Start::Make(|member, world| {
        let body = &mut world.bodies[0];
        if member.variant == "rigid" {
            stand_up(member, body);
            place(body, |x| Vec4::new(x.x, 0.9 * x.y, x.z, x.w));
            return Ok(());
        }
        let compliance = Compliance::new(LOOSE)?;
        body.effects.stretch = Some(Stretch {
            compliance,
            ..Stretch::default()
        });
        let volume = Volume {
            compliance,
            ..Volume::default()
        };
        body.effects.volume = body.effects.volume.map(|_| volume);
        world.settings.set_gravity(member.gravity())?;
        Ok(())
    }),
    during: nothing,
    judge: |run| match run.member.variant {
        // A compressed cloth or rope rotates after release.
        "rigid" if run.member.shape.kind() != Kind::Tetrahedra => Ok(Vec::new()),
        "rigid" => Ok(shape_figures(&run.end.bodies[0], 0.01)),
        _ => Ok(vec![time::fall(run, |_| 60.0)]),
    },
    outside: Outside::Nothing,
    any_body: false,
};

pub const IMPOSSIBLE: Case = Case {
    name: "impossible",
    title: "Conflicting pins",
    about: "A rigid body is pinned at both ends, at twice its length. Within 10 s it is at rest, below 1 mm/s, and the strain of a rope is uniform within 10 % with 16 smoothing iterations. (Without them, Gauss–Seidel satisfies the edge that it solves last and leaves the error to the others.)",
    seconds: |_| 10.0,
    family: |times| {
        let members = |shapes| Axes {
            materials: &[(0.0, 0.0), (0.0, 0.02)],
            seeds: &[1],
            mixtures: 8,
            ..Axes::all(shapes)
        };
        family::of(
            times,
            &[
                members(&[Shape::Cube(3), Shape::Cube(1), Shape::Bar(8)]),
                members(&[Shape::Cloth(10), Shape::Cloth(3), Shape::Cloth(20)]),
                members(&[Shape::Rope(16), Shape::Rope(2), Shape::Rope(4)]),
            ],
        )
    },
    start: Start::Make(|member, world| {
        let body = &mut world.bodies[0];
        let end = 0.4999 * member.scale;
        pin(body, |x| x.x.abs() >= end);
        place(body, |x| Vec4::new(2.0 * x.x, x.y, x.z, x.w));
        if member.shape.kind() == Kind::Rope {
            world.settings.smoothing_iterations = SmoothingIterations::new(16)?;
        }
        Ok(())
    }),
    during: nothing,
    judge: |run| {
        let body = &run.end.bodies[0];
        let speed = measure::rms_speed(&body.particles) / f64::from(run.member.scale);
        let mut figures = vec![Figure::new(
            "speed, over its length",
            speed * 1e3,
            1.0,
            "10⁻³/s",
        )];
        if run.member.shape.kind() == Kind::Rope {
            let (edges, _) = strains(body);
            let mean = edges.iter().sum::<f64>() / edges.len() as f64;
            let spread = edges.iter().map(|s| (s - mean).abs()).fold(0.0, f64::max);
            figures.push(Figure::new(
                "unevenness of stretch",
                spread / mean * 100.0,
                10.0,
                "%",
            ));
        }
        Ok(figures)
    },
    outside: Outside::Nothing,
    any_body: false,
};
