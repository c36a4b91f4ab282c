//! Tethers: hanging bodies do not get longer, and slack tethers have no effect.

use crate::support::{
    G, body, body_of_masses, chain, pinned, random_vector, run, settings, state_bits, stretch,
    topology, with, world,
};
use glam::{UVec2, Vec2, Vec3};
use pliant::{
    mesh::Primitive,
    solver::{
        Body, Effects, Slack, TetherTargets, Tethers, Threads, VertexIndex, deform::Random,
        reference,
    },
};

fn tethers(slack: f32) -> Option<Tethers> {
    Some(Tethers {
        slack: Slack::new(slack).expect("sound"),
    })
}

fn rigid(tethers: Option<Tethers>) -> Effects {
    Effects {
        stretch: stretch(0.0),
        tethers,
        ..Effects::default()
    }
}

/// A cloth of 0.5 × 2 m of `cells` along its length, held by its short upper edge.
fn banner(cells: u32) -> Body {
    let across = cells / 4;
    let primitive = Primitive::Cloth {
        size: Vec2::new(0.5, 2.0),
        cells: UVec2::new(across, cells),
        diagonals: Default::default(),
        shear: false,
    };
    let mut shape = primitive.build().expect("sound").shape;
    for x in &mut shape.vertices {
        *x = Vec3::new(x.x, -x.z, 0.0);
    }
    let pins: Vec<u32> = (0..=across).collect();
    pinned(body("banner", shape, 0.3), &pins)
}

/// Elongation of a hanging body relative to its size, after 10 s at one iteration per tick.
fn sag(body: &Body, tethers: Option<Tethers>) -> f64 {
    let lowest = |x: &mut dyn Iterator<Item = f32>| f64::from(x.fold(f32::INFINITY, f32::min));
    let rest = lowest(&mut body.topology.rest.iter().map(|x| x.y));
    let mut world = world(settings(G, 60.0, 1, 1), with(body.clone(), rigid(tethers)));
    run(&mut world, 10.0);
    let now = lowest(&mut world.bodies[0].particles.positions.iter().map(|x| x.y));
    (rest - now) / f64::from(body.topology.size)
}

#[test]
fn a_long_rope_or_cloth_does_not_get_longer_at_one_iteration_a_tick() {
    let mut masses = [0.01; 51];
    masses[50] = 0.5;
    let rope = pinned(body_of_masses(chain(50, 0.04), &masses), &[0]);
    for body in [rope, banner(50)] {
        let (with, without) = (sag(&body, tethers(0.0)), sag(&body, None));
        // The limit of the method: 2 %. Tethers themselves only leave rounding errors, as no other
        // constraint follows them.
        assert!(with < 1e-5, "with tethers: {with}");
        assert!(without > 0.2, "one iteration alone would do: {without}");
        let slack = sag(&body, tethers(0.1));
        // Slightly less where the cloth gets narrower: diagonal tethers reach that far.
        assert!((0.095..0.1001).contains(&slack), "with slack: {slack}");
    }
}

#[test]
fn slack_tethers_change_no_bit() {
    let swing = |tethers, pins: &[u32]| {
        let mut world = world(
            settings(G, 60.0, 4, 2),
            with(
                pinned(body("rope", chain(30, 0.05), 0.1), pins),
                rigid(tethers),
            ),
        );
        world.bodies[0].set_velocity(Vec3::new(0.3, 0.0, -0.2));
        run(&mut world, 2.0);
        state_bits(&world.bodies[0].particles)
    };
    for pins in [&[0][..], &[], &[3, 30]] {
        assert_eq!(swing(None, pins), swing(tethers(50.0), pins));
    }
    assert_ne!(swing(None, &[0]), swing(tethers(0.0), &[0]));
}

#[test]
fn the_reference_holds_particles_where_the_fast_solver_does() {
    let mut random = Random::new(4);
    let mut body = with(
        pinned(banner(20), &[0, 5]),
        Effects {
            tethers: tethers(0.05),
            ..Effects::default()
        },
    );
    for x in &mut body.particles.positions {
        if x.w > 0.0 {
            *x += random_vector(&mut random, 0.5).extend(0.0);
        }
    }
    let mut world = world(settings(G, 60.0, 1, 1), body);
    let mut reference = reference::World::of(&world);
    world.tick();
    reference.tick();
    let mut held = 0;
    let ways = TetherTargets::of(
        &world.bodies[0].topology,
        &world.bodies[0].particles.positions,
    );
    for (i, pin, way) in ways.ways() {
        let x = |i: usize| world.bodies[0].particles.position(i);
        // Positions below 4 m, accurate to 2⁻²³ m, after a few operations.
        assert!(x(i).distance(reference.bodies[0].x[i]) < 2e-6);
        let far = x(i).distance(x(pin)) / (way * 1.05) - 1.0;
        assert!(far < 1e-6);
        held += usize::from(far > -1e-6);
    }
    assert!(held > 10, "only {held} tethers act");
}

/// ```text
/// 0 ── 1 ── 2 ── 3 ── 4
/// ```
#[test]
fn tethers_go_to_the_nearest_pin_and_follow_when_pins_change() {
    let mut rope = body("rope", chain(4, 0.5), 1.0);
    let ways = |rope: &Body| -> Vec<(usize, usize, f64)> {
        TetherTargets::of(&rope.topology, &rope.particles.positions)
            .ways()
            .collect()
    };
    assert!(ways(&rope).is_empty(), "nothing to hang on");
    rope = pinned(rope, &[0]);
    assert_eq!(
        ways(&rope),
        [(1, 0, 0.5), (2, 0, 1.0), (3, 0, 1.5), (4, 0, 2.0)]
    );
    rope.effects = rigid(tethers(0.0));
    let mut world = world(settings(G, 60.0, 1, 1), rope);
    world.tick();
    let found = |body: &Body| -> Vec<_> { body.states.others.tethers.ways().collect() };
    assert_eq!(found(&world.bodies[0]).len(), 4);
    let rope = &mut world.bodies[0];
    rope.pins = [0, 4].map(VertexIndex).to_vec();
    rope.update_masses();
    world.tick();
    assert_eq!(
        found(&world.bodies[0]),
        [(1, 0, 0.5), (2, 0, 1.0), (3, 4, 0.5)]
    );
}

#[test]
fn threads_change_no_bit_of_what_tethers_do() {
    let fall = |threads: usize| {
        let mut body = with(banner(160), rigid(tethers(0.0)));
        body.set_velocity(Vec3::new(0.0, 0.0, 1.0));
        let mut world = world(settings(G, 60.0, 2, 1), body);
        world.threads = Threads::new(threads).expect("a sound number");
        run(&mut world, 0.3);
        state_bits(&world.bodies[0].particles)
    };
    let one = fall(1);
    assert_eq!(one, fall(2));
    assert_eq!(one, fall(8));
}

/// Targets are recomputed for a new mesh, even if it has the same number of particles.
#[test]
fn tethers_of_another_mesh_of_as_many_particles_are_found_again() {
    let shape = chain(4, 0.25);
    let mut crooked = shape.clone();
    crooked.edges = vec![[0, 2], [2, 1], [1, 3], [3, 4]];
    let positions = pinned(body("rope", shape.clone(), 1.0), &[0])
        .particles
        .positions;
    let [straight, crooked] = [shape, crooked].map(topology);
    let mut tether_targets = TetherTargets::of(&straight, &positions);
    tether_targets.update(&crooked, &positions);
    let found: Vec<_> = tether_targets.ways().collect();
    let expected: Vec<_> = TetherTargets::of(&crooked, &positions).ways().collect();
    assert_eq!(found, expected);
    assert_ne!(
        found,
        TetherTargets::of(&straight, &positions)
            .ways()
            .collect::<Vec<_>>()
    );
}
