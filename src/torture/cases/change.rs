//! Bodies whose structure changes: they tear, and grains appear.

use super::common::*;
use crate::{
    mesh::{GrainRegion, Primitive},
    solver::{
        BreakingStrain, Capacity, Contact, Density, Emitter, Finite, GrainRadius, Grains, Ground,
        PieceSize, Tear, Topology,
    },
};
use std::sync::Arc;

const MATERIALS: &[(f32, f32)] = &[(1e-5, 0.02), (0.0, 0.0), (1e-6, 0.02), (1e-4, 0.02)];
const SCALES: &[f32] = &[1.0, 1e-2, 0.1, 10.0, 1e3];
const STEPS: &[(u32, u32)] = &[(10, 1), (1, 1), (4, 1), (32, 1), (4, 4)];

const fn axes(shapes: &'static [Shape], mixtures: u32) -> Axes {
    Axes {
        scales: SCALES,
        materials: MATERIALS,
        steps: STEPS,
        seeds: &[1],
        mixtures,
        ..Axes::all(shapes)
    }
}

/// A body of grains that fills a box of this size, in lengths.
fn grains(member: &Member, size: Vec3, radius: f32) -> Result<Body, TortureError> {
    let primitive = Primitive::Grains {
        size: size * member.scale,
        region: GrainRegion::Box,
        radius: radius * member.scale,
        variation: 0.2,
    };
    let topology = Topology::new(primitive.build()?.shape)?;
    let mut body = Body::new("grains", Arc::new(topology), Density::new(1600.0)?);
    body.effects.grains = Some(Grains::default());
    body.effects.contact = Some(Contact::default());
    body.effects.ground = Some(Ground::default());
    Ok(body)
}

pub const TORN: Case = Case {
    name: "torn",
    title: "Torn everywhere at once",
    about: "A free body starts at one and a half times its length and tears at a strain of 5 %: all of it comes apart within a few ticks. No mass is lost, no energy is gained, and momentum is constant.",
    seconds: |_| 1.0,
    family: |times| {
        let solids = axes(&[Shape::Cube(3), Shape::Cube(2), Shape::Ball(4)], 8);
        let cloths = axes(&[Shape::Cloth(10), Shape::Cloth(3), Shape::Cloth(20)], 8);
        let ropes = axes(&[Shape::Rope(16), Shape::Rope(64)], 8);
        family::of(times, &[solids, cloths, ropes])
    },
    start: Start::Make(|_, world| {
        let body = &mut world.bodies[0];
        place(body, |x| (x.truncate() * 1.5).extend(x.w));
        body.effects.tear = Some(Tear {
            strain: BreakingStrain::new(0.05)?,
            smallest_piece: PieceSize::new(1)?,
            ..Tear::default()
        });
        Ok(())
    }),
    during: nothing,
    judge: |run| {
        let body = &run.end.bodies[0];
        let whole = run
            .member
            .body_of(run.member.shape.build(run.member.scale)?)?;
        let mass = |body: &Body| -> f64 {
            let all = body.particles.positions.iter().filter(|x| x.w > 0.0);
            all.map(|x| 1.0 / f64::from(x.w)).sum()
        };
        let lost = (mass(body) / mass(&whole) - 1.0).abs();
        // Rigid edges spring back within the first tick, after which tearing looks at them.
        let is_whole = body.topology.splits() == 0 && run.member.compliance > 0.0;
        Ok(vec![
            Figure::new("mass lost", lost * 1e6, 1.0, "ppm"),
            Figure::none("bodies that did not tear", usize::from(is_whole), "bodies"),
        ])
    },
    outside: Outside::Nothing,
    any_body: false,
};

pub const BURIED: Case = Case {
    name: "buried",
    title: "A weight falls into sand",
    about: "A body of 1 m falls from 2 m into a heap of sand. No grain ends below the ground, and the energy does not rise.",
    seconds: |_| 2.0,
    family: |times| {
        Axes {
            steps: &[(20, 2), (10, 1), (4, 4), (40, 1)],
            ..axes(&[Shape::Cube(3), Shape::Cube(1), Shape::Ball(4)], 8)
        }
        .members(times)
    },
    start: Start::Make(|member, world| {
        world.settings.set_gravity(member.gravity())?;
        let s = member.scale;
        let weight = &mut world.bodies[0];
        place(weight, |x| Vec4::new(x.x, x.y + 2.5 * s, x.z, x.w));
        weight.effects.contact = Some(Contact::default());
        weight.effects.ground = Some(Ground::default());
        let mut sand = grains(member, Vec3::new(1.2, 0.4, 1.2), 0.06)?;
        sand.translate(Vec3::Y * (0.21 * s));
        world.bodies.push(sand);
        Ok(())
    }),
    during: nothing,
    judge: |run| {
        let sand = &run.end.bodies[1];
        let scale = f64::from(run.member.scale);
        let depths = (0..sand.particles.len()).map(|i| {
            let radius = f64::from(sand.topology.radius(i));
            (radius - sand.particles.position(i).y) / scale
        });
        Ok(vec![Figure::new(
            "depth below the ground, over the length",
            depths.fold(0.0, f64::max) * 100.0,
            // A tenth of a radius: grains under a load sink by what the passes do not resolve.
            0.6,
            "%",
        )])
    },
    outside: Outside::Nothing,
    any_body: false,
};

/// Grains that the emitter of the case can have.
const EMITTED: u32 = 1500;

pub const SPRAYED: Case = Case {
    name: "sprayed",
    title: "A hundred thousand grains per second",
    about: "An emitter shoots grains at 20 lengths per second onto a body on the ground, 100 000 per second until there are 1500. All are counted, and stay finite.",
    seconds: |_| 0.5,
    family: |times| axes(&[Shape::Cube(3), Shape::Cube(1), Shape::Cloth(10)], 4).members(times),
    start: Start::Make(|member, world| {
        world.settings.set_gravity(member.gravity())?;
        let s = member.scale;
        let target = &mut world.bodies[0];
        place(target, |x| Vec4::new(x.x, x.y + 0.6 * s, x.z, x.w));
        target.effects.contact = Some(Contact::default());
        target.effects.ground = Some(Ground::default());
        let mut own = grains(member, Vec3::splat(0.05), 0.02)?;
        own.translate(Vec3::Y * (3.0 * s));
        own.effects.emitter = Some(Emitter {
            rate: Coefficient::new(1e5)?,
            capacity: Capacity::new(EMITTED)?,
            speed: Coefficient::new(20.0 * s)?,
            opening: Coefficient::new(0.4 * s)?,
            radius: GrainRadius::new(0.02 * s)?,
            y: Finite::new(2.0 * s)?,
            ..Emitter::default()
        });
        world.bodies.push(own);
        Ok(())
    }),
    during: nothing,
    judge: |run| {
        let grains = &run.end.bodies[1];
        let emission = &grains.particles.emission.grains;
        // 60 ticks per second.
        let due = (run.end.tick as f64 * 1e5 / 60.0).floor();
        let counted = (emission.emitted() + emission.waiting()) as f64;
        let present = emission.emitted() + 1;
        Ok(vec![
            Figure::new("grains not counted", (counted - due).abs(), 0.0, "grains"),
            Figure::new(
                "grains that differ from those emitted",
                (grains.particles.len() as f64 - present as f64).abs(),
                0.0,
                "grains",
            ),
            Figure::new(
                "grains above the capacity",
                (grains.particles.len() as f64 - f64::from(EMITTED)).max(0.0),
                0.0,
                "grains",
            ),
        ])
    },
    outside: Outside::Work,
    any_body: false,
};
