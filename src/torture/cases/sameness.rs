//! Invariance: the result must not depend on orientation, position, size, or the order of vertices
//! and constraints.

use super::common::*;
use crate::solver::{Direct, RestShape, VertexIndex, deform::Random};
use glam::{Mat3, Vec3};

/// A rotation whose matrix has no zeros and no simple ratios: (2, 3, 6)/7 and its permutations.
const TURN: Mat3 = Mat3::from_cols(
    Vec3::new(2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0),
    Vec3::new(3.0 / 7.0, -6.0 / 7.0, 2.0 / 7.0),
    Vec3::new(6.0 / 7.0, 2.0 / 7.0, -3.0 / 7.0),
);

/// Translation [m at 1 m].
const AWAY: Vec3 = Vec3::new(1.0, -2.0, 0.5);

/// A permutation of the vertices: `new_of[old]`.
fn renumbering(count: usize, seed: u32) -> Vec<u32> {
    let mut order: Vec<u32> = (0..count as u32).collect();
    shuffle(&mut order, seed);
    order
}

fn shuffle<T>(items: &mut [T], seed: u32) {
    let mut random = Random::new(seed);
    for last in (1..items.len()).rev() {
        let other = (random.next() * (last + 1) as f32) as usize;
        items.swap(last, other.min(last));
    }
}

fn renumbered(shape: &RestShape, new_of: &[u32]) -> RestShape {
    let mut vertices = shape.vertices.clone();
    for (old, &new) in new_of.iter().enumerate() {
        vertices[new as usize] = shape.vertices[old];
    }
    let map = |i: u32| new_of[i as usize];
    RestShape {
        vertices,
        edges: shape.edges.iter().map(|e| e.map(map)).collect(),
        tetrahedra: shape.tetrahedra.iter().map(|t| t.map(map)).collect(),
        triangles: shape.triangles.iter().map(|t| t.map(map)).collect(),
        ..RestShape::default()
    }
}

/// The unchanged body, held by one side.
fn plain(member: &Member) -> Result<World, TortureError> {
    let mut world = Member {
        scale: 1.0,
        ..*member
    }
    .world()?;
    pin(&mut world.bodies[0], |x| x.x <= -0.4999);
    converge(member, &mut world);
    let down = Member::of(member.shape).gravity();
    world.settings.set_gravity(down)?;
    Ok(world)
}

/// Uses the direct solver for renumbered bodies, so that the order of the constraints has no
/// influence.
fn converge(member: &Member, world: &mut World) {
    if member.variant == "renumbered" && member.shape.kind() != Kind::Rope {
        world.bodies[0].effects.direct = Some(Direct);
    }
}

/// The vertex of the changed body for each vertex of the unchanged one.
fn partner(member: &Member, count: usize) -> Vec<u32> {
    match member.variant {
        "renumbered" => renumbering(count, member.seed),
        _ => (0..count as u32).collect(),
    }
}

fn changed(member: &Member, x: Vec3) -> Vec3 {
    match member.variant {
        "turned" => TURN * x,
        "moved" => x + AWAY,
        _ => x * member.scale,
    }
}

fn undone(member: &Member, x: Vec3) -> Vec3 {
    match member.variant {
        "turned" => TURN.transpose() * x,
        "moved" => x - AWAY,
        _ => x / member.scale,
    }
}

fn start_same(member: &Member, world: &mut World) -> Result<(), TortureError> {
    let base = plain(member)?;
    let (base_gravity, pins) = (base.settings.gravity, base.bodies[0].pins.clone());
    let mut shape = member.shape.build(member.scale)?;
    if member.variant == "turned" {
        shape.vertices.iter_mut().for_each(|x| *x = TURN * *x);
    }
    let partner = partner(member, shape.vertices.len());
    world.bodies = vec![member.body_of(renumbered(&shape, &partner))?];
    converge(member, world);
    let (body, base) = (&mut world.bodies[0], &base.bodies[0]);
    for (old, &new) in (0..).zip(&partner) {
        let from = base.particles.positions[base.topology.particle(VertexIndex(old))];
        let to = body.topology.particle(VertexIndex(new));
        let w = body.particles.positions[to].w;
        body.particles.positions[to] = changed(member, from.truncate()).extend(w);
    }
    place(body, |x| x);
    let held = (0..).zip(&partner);
    let held = held.filter(|(old, _)| pins.contains(&VertexIndex(*old)));
    body.pins = held.map(|(_, &new)| VertexIndex(new)).collect();
    body.update_masses();
    let down = base_gravity * member.scale;
    let turned = member.variant == "turned";
    world
        .settings
        .set_gravity(if turned { TURN * down } else { down })?;
    Ok(())
}

fn judge_same(run: &Run) -> Result<Vec<Figure>, TortureError> {
    let mut base = plain(run.member)?;
    catch_up(&mut base, &run.end);
    let (body, base) = (&run.end.bodies[0], &base.bodies[0]);
    let pairs = (0..).zip(partner(run.member, body.particles.len()));
    let off = pairs.map(|(old, new)| {
        let expected = base.particles.positions[base.topology.particle(VertexIndex(old))];
        let x = body.particles.positions[body.topology.particle(VertexIndex(new))];
        undone(run.member, x.truncate()).distance(expected.truncate())
    });
    let most = f64::from(off.fold(0.0, f32::max)) / f64::from(base.topology.size);
    // As in `time::fall`: the rounding error of a substep persists as a velocity.
    let n = run.end.tick as f64 * f64::from(run.end.settings.substeps.get());
    let limit = 1e-4 + ROUNDING * n;
    Ok(vec![Figure::new(
        "difference of motion",
        most * 100.0,
        limit * 100.0,
        "% of size",
    )])
}

pub const SAME: Case = Case {
    name: "same",
    title: "Invariance",
    about: "A body pinned at one side falls. Rotated, moved by 2.3 m, a thousand times smaller or larger, it moves the same way for 0.25 s, within 0.01 % of its size and f32 rounding. So does one with renumbered vertices, with the direct solver and 4 iterations per substep or, for a rope, with 1024 iterations.",
    seconds: |_| 0.25,
    family: |times| {
        let members = |shapes| {
            Axes {
                scales: &[1.0],
                materials: &[(1e-4, 0.0), (0.0, 0.0), (1e-5, 0.02), (1e-3, 0.0)],
                steps: &[(4, 1), (1, 1), (10, 1), (4, 4)],
                seeds: &[1, 2],
                mixtures: 6,
                ..Axes::all(shapes)
            }
            .members(times)
        };
        let members: Vec<Member> = [family::SOLIDS, family::CLOTHS, family::ROPES]
            .into_iter()
            .flat_map(members)
            .collect();
        let mut all = family::variants(&members, &["turned", "moved"]);
        let converging = members
            .iter()
            .filter(|m| m.compliance > 0.0 && m.iterations == 1);
        let renumbered = |member: &Member| Member {
            iterations: match member.shape.kind() {
                Kind::Rope => 1024,
                _ => 4,
            },
            variant: "renumbered",
            quick: member.quick && member.substeps < 10,
            ..*member
        };
        all.extend(converging.map(renumbered));
        for scale in [1e-3, 1e-2, 0.1, 10.0, 100.0, 1e3] {
            let scaled = members.iter().map(|m| Member {
                scale,
                variant: "scaled",
                ..*m
            });
            all.extend(scaled);
        }
        all
    },
    start: Start::Make(start_same),
    during: nothing,
    judge: judge_same,
    outside: Outside::Nothing,
    any_body: false,
};

/// Root mean square strain of a rigid cloth of n cells that hangs by a side, with one iteration per
/// substep. Gravity lengthens a column by gh² per particle and substep. The link that carries k of
/// n particles must transmit the force k m g: λ = −C/(2w) of a projection that divides C between
/// two particles, over h², is that force at C = 2kgh². Relative to its length L/n that is a strain
/// of 2kngh²/L; the root mean square over a column is 2n²gh²/(√3 L), and over all edges it is
/// smaller by √3, because two thirds of them carry almost no load.
fn sag(run: &Run) -> f64 {
    let Shape::Cloth(cells) = run.member.shape else {
        return 0.0;
    };
    let (n, h) = (f64::from(cells), run.end.settings.substep_seconds());
    let gravity = f64::from(-run.end.settings.gravity.y) / f64::from(run.member.scale);
    2.0 * gravity * n * n * h * h / 3.0
}

pub const ORDER: Case = Case {
    name: "order",
    title: "Constraint order",
    about: "A rigid cloth of 21² to 200² particles hangs by one side, with its edges in the given order, sorted by vertex, reversed or shuffled, and one iteration per substep. After 60 frames the strain of edges is below 2 % or, if that is larger, below 2gn²h²/(3L), the sag of n links of total length L with one iteration per substep.",
    seconds: |_| 1.0,
    family: |times| {
        const SHAPES: &[Shape] = &[
            Shape::Cloth(20),
            Shape::Cloth(40),
            Shape::Cloth(63),
            Shape::Cloth(100),
            Shape::Cloth(199),
        ];
        let axes = Axes {
            scales: &[1.0],
            materials: &[(0.0, 0.0)],
            steps: &[(10, 1), (16, 1), (32, 1)],
            seeds: &[1],
            mixtures: 0,
            ..Axes::all(SHAPES)
        };
        family::variants(
            &axes.members(times),
            &["given", "sorted", "reversed", "shuffled"],
        )
    },
    start: Start::Make(|member, world| {
        let mut shape = member.shape.build(member.scale)?;
        match member.variant {
            "sorted" => shape.edges.sort_unstable(),
            "reversed" => shape.edges.reverse(),
            "shuffled" => shuffle(&mut shape.edges, member.seed),
            _ => {}
        }
        let mut body = member.body_of(shape)?;
        stand_up(member, &mut body);
        pin_top(&mut body);
        world.bodies = vec![body];
        world.settings.set_gravity(member.gravity())?;
        Ok(())
    }),
    during: nothing,
    judge: |run| {
        let limit = sag(run).max(0.02);
        Ok(vec![edge_strain(&run.end.bodies[0], limit)])
    },
    outside: Outside::Nothing,
    any_body: false,
};

pub const FAR: Case = Case {
    name: "far",
    title: "Far from the origin",
    about: "A body lies at 1 km or 10 km from the origin, with its shape rounded to f32 there. Its jitter stays below twice the rounding of lengths of its size per substep, ε·size/h, independent of the distance.",
    seconds: |_| 2.0,
    family: |times| {
        let members = |shapes| Axes {
            scales: &[1.0, 10.0],
            seeds: &[1],
            mixtures: 8,
            ..Axes::all(shapes)
        };
        let members = family::of(
            times,
            &[
                members(family::SOLIDS),
                members(family::CLOTHS),
                members(family::ROPES),
            ],
        );
        family::values(&members, &[1e3, 1e4])
    },
    start: Start::Make(|member, world| {
        world.bodies[0].translate(Vec3::splat(member.value as f32));
        Ok(())
    }),
    during: nothing,
    judge: |run| {
        let h = run.end.settings.substep_seconds();
        let body = &run.end.bodies[0];
        let quantum = 2.0 * ROUNDING * f64::from(body.topology.size) / h;
        let speed = measure::rms_speed(&body.particles) / quantum;
        Ok(vec![Figure::new("jitter", speed, 2.0, "ε·size/h")])
    },
    outside: Outside::Nothing,
    any_body: false,
};
