//! Grains that rotate.

use crate::support::{body, pinned, settings, with, world as world_of};
use glam::{DVec3, Vec3};
use pliant::{
    mesh::{GrainRegion, Primitive},
    solver::{
        Body, Capacity, Coefficient, Collide, Collider, ColliderShape, Effects, Emitter, Finite,
        Friction, GrainRadius, GrainRolling, Grains, Ground, Pose, RestShape, Settings, Threads,
        World, measure, reference,
    },
};

const RADIUS: f32 = 0.01;
const GRAVITY: f64 = 9.81;

fn rolling(friction: f64, resistance: f64) -> Option<Grains> {
    Some(Grains {
        friction: Friction::try_from(friction).expect("valid"),
        rolling_resistance: GrainRolling::try_from(resistance).expect("valid"),
        ..Grains::default()
    })
}

/// Grains at these places [m], of 1000 kg/m³.
fn at(places: &[(Vec3, f32)], effect: Option<Grains>) -> Body {
    let shape = RestShape {
        vertices: places.iter().map(|it| it.0).collect(),
        radii: places.iter().map(|it| it.1).collect(),
        ..RestShape::default()
    };
    let effects = Effects {
        grains: effect,
        ..Effects::default()
    };
    with(body("grains", shape, 1000.0), effects)
}

fn floor(friction: f64) -> Option<Ground> {
    Some(Ground {
        friction: Friction::try_from(friction).expect("valid"),
        ..Ground::default()
    })
}

/// A world with gravity along a slope of this angle that goes down along x.
fn slope(tangent: f64, substeps: u32, body: Body) -> World {
    let along = DVec3::new(tangent, -1.0, 0.0).normalize() * GRAVITY;
    let settings = Settings {
        gravity: along.as_vec3(),
        ..settings(0.0, 60.0, substeps, 1)
    };
    world_of(settings, body)
}

fn run(world: &mut World, seconds: f64) {
    for _ in 0..(seconds * 60.0).round() as u32 {
        world.tick();
        assert!(world.bodies.iter().all(|it| it.quarantine.is_none()));
    }
}

fn velocity(world: &World, i: usize) -> DVec3 {
    world.bodies[0].particles.velocity_f64(i)
}

fn spin(world: &World, i: usize) -> DVec3 {
    world.bodies[0].particles.spins[i].truncate().as_dvec3()
}

/// A grain on a slope with tan θ = 0.3, on the ground and on a box.
fn on_each_surface(effect: Option<Grains>, friction: f64) -> [(&'static str, World); 2] {
    let ball = (Vec3::Y * RADIUS, RADIUS);
    let mut on_ground = at(&[ball], effect);
    on_ground.effects.ground = floor(friction);
    let mut on_box = at(&[ball], effect);
    on_box.effects.collide = Some(Collide {
        friction: Friction::try_from(friction).expect("valid"),
        ..Collide::default()
    });
    let shape = ColliderShape::Box {
        size: Vec3::new(100.0, 1.0, 100.0),
    };
    let table = Collider::new(shape, Pose::at(DVec3::Y * -0.5));
    let mut on_box = slope(0.3, 20, on_box);
    on_box.colliders = vec![table.expect("valid")];
    [("ground", slope(0.3, 20, on_ground)), ("box", on_box)]
}

/// On a slope with tan θ = 0.3: with I = ⅖mr², a ball rolls by (sin θ − µᵣ cos θ)g/1.4 where that needs
/// no more friction than µ; it stays where tan θ ≤ µᵣ, and slides by (sin θ − µ cos θ)g where friction
/// is too small.
#[test]
fn a_grain_rolls_down_a_slope_stays_or_slides_as_a_ball_does() {
    let (sine, cosine) = (0.3 / 1.09_f64.sqrt(), 1.0 / 1.09_f64.sqrt());
    let cases = [
        (0.5, 0.0, sine / 1.4, true),
        (0.5, 0.1, (sine - 0.1 * cosine) / 1.4, true),
        (0.5, 0.31, 0.0, true),
        (0.05, 0.0, sine - 0.05 * cosine, false),
        // More resistance than friction: it slides without rotating.
        (0.05, 0.31, sine - 0.05 * cosine, false),
        (0.0, 0.1, sine, false),
    ];
    for (friction, resistance, acceleration, rolls) in cases {
        for (name, mut world) in on_each_surface(rolling(0.9, resistance), friction) {
            run(&mut world, 1.0);
            let expected = acceleration * GRAVITY;
            let found = velocity(&world, 0).x;
            // Contact begins in the first substep, 1/1200 of the time. Rounding of f32.
            assert!(
                (found - expected).abs() < 2e-3 * expected + 1e-4,
                "{name}, µ {friction}, µᵣ {resistance}: {found} m/s for {expected}"
            );
            let turn = spin(&world, 0);
            let rim = -turn.cross(DVec3::Y).x;
            let expected = match rolls {
                true => -expected,
                // 5/2 (µ − µᵣ) cos θ g.
                false => -2.5 * (friction - resistance).max(0.0) * cosine * GRAVITY,
            };
            assert!(
                (rim - expected).abs() < 3e-3 * expected.abs() + 1e-4,
                "{name}, µ {friction}, µᵣ {resistance}: turns by {turn}"
            );
        }
    }
}

/// A ball that is thrown without rotation along level ground slides, and then rolls with 5/7 of its
/// speed; µᵣ = 0.02 stops it by 0.02 g/1.4 from then on.
#[test]
fn a_thrown_grain_slides_then_rolls_and_comes_to_rest() {
    for resistance in [0.0, 0.02] {
        let mut ball = at(&[(Vec3::Y * RADIUS, RADIUS)], rolling(0.5, resistance));
        ball.effects.ground = floor(0.4);
        ball.particles.set_velocity(0, Vec3::X);
        let mut world = slope(0.0, 20, ball);
        run(&mut world, 1.0);
        // With resistance r, sliding ends at t = 2/7 / (µ g) (1 + small): friction µ brakes the ball
        // and speeds its rotation up by 5/2 (µ − r).
        let (mu, g) = (0.4, GRAVITY);
        let until = 1.0 / (g * (mu + 2.5 * (mu - resistance)));
        let at_roll = 1.0 - mu * g * until;
        let expected = at_roll - resistance * g / 1.4 * (1.0 - until);
        let found = velocity(&world, 0).x;
        assert!(
            (found - expected).abs() < 2e-3,
            "{resistance}: {found} for {expected}"
        );
        if resistance > 0.0 {
            run(&mut world, 6.0);
            let left = velocity(&world, 0).length() + spin(&world, 0).length();
            assert!(left < 1e-5, "{left} m/s");
        }
    }
}

/// Two balls of masses m₁ and m₂ that touch and pass each other at a speed along their surfaces:
/// friction takes the slip where it suffices, and then 1/3.5 of the relative velocity of their
/// centers. Momentum and angular momentum are kept.
#[test]
fn balls_that_graze_each_other_exchange_spin() {
    for radius in [RADIUS, 2.0 * RADIUS] {
        let gap = RADIUS + radius;
        let mut pair = at(
            &[(Vec3::ZERO, RADIUS), (Vec3::X * gap, radius)],
            rolling(5.0, 0.0),
        );
        // Toward each other along x at 1 m/s, and past each other at 0.5 m/s.
        pair.particles.set_velocity(0, Vec3::new(1.0, 0.5, 0.0));
        let mut world = world_of(settings(0.0, 6000.0, 1, 1), pair);
        let particles = &world.bodies[0].particles;
        let before = (
            measure::momentum(particles),
            measure::angular_momentum(particles),
        );
        world.tick();
        let particles = &world.bodies[0].particles;
        let after = (
            measure::momentum(particles),
            measure::angular_momentum(particles),
        );
        assert!(before.0.distance(after.0) < 1e-6 * before.0.length());
        // About the point of contact nothing is lost; about the centers, what both move while they
        // touch, a fraction of a substep.
        let scale = before.0.length() * f64::from(RADIUS);
        assert!(
            before.1.distance(after.1) < 2e-3 * scale,
            "{before:?} {after:?}"
        );
        // In the first substep, at rest before, the line of centers is along x.
        let apart = velocity(&world, 0) - velocity(&world, 1);
        assert!((apart.y / 0.5 - 5.0 / 7.0).abs() < 2e-3, "{apart}");
    }
}

fn column(friction: f64, resistance: f64) -> World {
    let shape = Primitive::Grains {
        size: Vec3::new(0.24, 0.4, 0.24),
        region: GrainRegion::Cylinder,
        radius: RADIUS,
        variation: 0.2,
    };
    let mut sand = body("sand", shape.build().expect("valid").shape, 1600.0);
    sand.translate(Vec3::Y * 0.2);
    sand.effects.grains = rolling(friction, resistance);
    sand.effects.ground = floor(0.5);
    let mut world = world_of(settings(GRAVITY, 60.0, 20, 4), sand);
    world.sleep.enabled = true;
    world
}

fn height(world: &World) -> f64 {
    let particles = &world.bodies[0].particles;
    (0..particles.len())
        .map(|i| particles.position(i).y)
        .fold(0.0, f64::max)
}

/// Rolling resistance makes piles steeper; energy only falls.
#[test]
fn marbles_spread_and_rough_grains_pile_up() {
    let mut heights = Vec::new();
    for resistance in [0.01, 0.2, f64::INFINITY] {
        let mut world = column(0.3, resistance);
        let energy = |world: &World| {
            let particles = &world.bodies[0].particles;
            measure::kinetic_energy(particles)
                + measure::gravitational_energy(particles, world.settings.gravity)
        };
        let mut before = energy(&world);
        for _ in 0..40 {
            run(&mut world, 0.1);
            let now = energy(&world);
            // Grains that overlap are pushed apart: a ten-thousandth of the energy of the column.
            assert!(now < before * 1.0001, "{before} J, then {now} J");
            before = now;
        }
        heights.push(height(&world));
    }
    assert!(
        heights[0] < 0.7 * heights[1] && heights[1] < heights[2],
        "{heights:?} m"
    );
}

#[test]
fn rotation_has_the_same_bits_on_any_number_of_threads() {
    let state = |threads: usize| {
        let mut world = column(0.3, 0.05);
        world.threads = Threads::new(threads).expect("some");
        run(&mut world, 0.5);
        let particles = &world.bodies[0].particles;
        (particles.positions.clone(), particles.spins.clone())
    };
    let one = state(1);
    assert!(one.1.iter().any(|spin| spin.truncate().length() > 0.1));
    for threads in [2, 8] {
        assert_eq!(one, state(threads));
    }
}

/// Rotation ends with the resistance, and begins again at rest.
#[test]
fn grains_stop_rotating_when_they_may_not() {
    let mut world = column(0.3, 0.05);
    run(&mut world, 0.3);
    world.bodies[0].effects.grains = rolling(0.3, f64::INFINITY);
    world.tick();
    assert!(world.bodies[0].particles.spins.is_empty());
    world.bodies[0].effects.grains = rolling(0.3, 0.05);
    world.settings.gravity = Vec3::ZERO;
    let before = measure::rotational_energy(&world.bodies[0].particles);
    world.tick();
    assert_eq!(before, 0.0);
    assert_eq!(
        world.bodies[0].particles.spins.len(),
        world.bodies[0].particles.len()
    );
}

/// A ball rolls down a slope of fixed grains, and two touch.
#[test]
fn the_reference_rolls_as_the_solver_does() {
    let places = [
        (Vec3::new(0.0, 0.0, 0.0), 0.02),
        (Vec3::new(0.03, -0.01, 0.005), 0.02),
        (Vec3::new(0.004, 0.0302, 0.001), 0.01),
    ];
    for resistance in [0.0, 0.3] {
        let heap = pinned(at(&places, rolling(0.6, resistance)), &[0, 1]);
        let settings: Settings = settings(GRAVITY, 60.0, 10, 60);
        let mut world = world_of(settings, heap.clone());
        let mut exact = reference::World::of(&world_of(settings, heap));
        for _ in 0..6 {
            world.tick();
            exact.tick();
        }
        for (i, expected) in exact.bodies[0].x.iter().enumerate() {
            let found = world.bodies[0].particles.position(i);
            // 60 iterations leave 1e-3 of what a tick moves, 2.7 mm.
            let off = found.distance(*expected);
            assert!(off < 3e-6, "µᵣ {resistance}, {i}: {found} {expected}");
        }
        let off = spin(&world, 2).distance(exact.bodies[0].spins[2]);
        assert!(off < 3e-4, "µᵣ {resistance}: {off} m/s");
        if resistance == 0.0 {
            assert!(spin(&world, 2).length() > 0.05);
        }
    }
}

/// A square silo with a square hole of a side [m] in its flat bottom.
fn silo(hole: f32, effect: Option<Grains>) -> World {
    let (side, fill, wall) = (0.36_f32, 0.3_f32, 0.2_f32);
    let shape = Primitive::Grains {
        size: Vec3::new(side, fill, side),
        region: GrainRegion::Box,
        radius: RADIUS,
        variation: 0.2,
    };
    let mut sand = body("sand", shape.build().expect("valid").shape, 1600.0);
    sand.translate(Vec3::Y * (0.5 * fill));
    sand.effects.grains = effect;
    sand.effects.collide = Some(Collide::default());
    let mut world = world_of(settings(GRAVITY, 60.0, 20, 4), sand);
    let boxes = |size: Vec3, place: Vec3| {
        Collider::new(ColliderShape::Box { size }, Pose::at(place.as_dvec3())).expect("valid")
    };
    let plate = 0.5 * (side - hole) + wall;
    for sign in [-1.0, 1.0] {
        for along_x in [true, false] {
            let turn = |v: Vec3| if along_x { v } else { Vec3::new(v.z, v.y, v.x) };
            let upright = Vec3::new(wall, 1.0, side + 2.0 * wall);
            let place = Vec3::new(sign * 0.5 * (side + wall), 0.5, 0.0);
            world.colliders.push(boxes(turn(upright), turn(place)));
            let length = if along_x { 1.0 } else { hole };
            let floor = Vec3::new(plate, wall, length);
            let place = Vec3::new(sign * 0.5 * (hole + plate), -0.5 * wall, 0.0);
            world.colliders.push(boxes(turn(floor), turn(place)));
        }
    }
    world
}

/// Beverloo (1961): the flow through a hole of a side D is Q = C ρ √g (D − kd)^(5/2) with k from 1.3 to 1.6; C is 0.55 to 0.65 for a round hole, and 4/π times as
/// much for a square one of the same D, by the area. Grains that may not rotate clog it.
#[test]
fn grains_flow_through_a_hole_by_the_law_of_beverloo() {
    let bulk = 0.58 * 1600.0;
    let mean_diameter = 2.0 * 0.9 * f64::from(RADIUS);
    let flow = |hole: f32, resistance: f64| {
        let mut world = silo(hole, rolling(0.5, resistance));
        let left = |world: &World| {
            let positions = &world.bodies[0].particles.positions;
            let fallen = positions.iter().filter(|x| x.y < -0.1);
            fallen.map(|x| 1.0 / f64::from(x.w)).sum::<f64>()
        };
        run(&mut world, 0.5);
        let before = left(&world);
        run(&mut world, 0.75);
        (left(&world) - before) / 0.75
    };
    let holes = [0.12, 0.15_f32];
    let free = holes.map(|hole| f64::from(hole) - 1.6 * mean_diameter);
    let flows = holes.map(|hole| flow(hole, 0.1));
    let exponent = (flows[1] / flows[0]).ln() / (free[1] / free[0]).ln();
    let factors = [0, 1].map(|i| flows[i] / (bulk * GRAVITY.sqrt() * free[i].powf(2.5)));
    // Some 800 and 1500 grains pass, in clusters of about ten: the flows are uncertain by a tenth,
    // the exponent by 0.14/ln(1.33).
    assert!((exponent - 2.5).abs() < 0.5, "{exponent} {flows:?} kg/s");
    let [low, high] = [0.55, 0.65].map(|round| round * 4.0 / std::f64::consts::PI);
    for factor in factors {
        assert!((0.85 * low..1.15 * high).contains(&factor), "{factors:?}");
    }
    let clogged = flow(0.12, f64::INFINITY);
    assert!(clogged < 0.4 * flows[0], "{clogged} kg/s of {flows:?}");
}

/// A heap that an emitter pours keeps the slope of sand with µ = 0.5, arctan 0.5 ± 5°, and sleeps. It must
/// not creep meanwhile: friction acts on what iterations have found of the load.
#[test]
fn a_poured_heap_holds_the_slope_of_its_friction() {
    let mut sand = at(&[(Vec3::new(0.0, RADIUS, 0.0), RADIUS)], rolling(0.5, 0.2));
    sand.effects.ground = floor(0.5);
    sand.effects.emitter = Some(Emitter {
        rate: Coefficient::of(400.0),
        capacity: Capacity::of(1200),
        speed: Coefficient::of(0.2),
        opening: Coefficient::of(0.05),
        radius: GrainRadius::of(RADIUS),
        y: Finite::of(0.25),
        ..Emitter::default()
    });
    let mut world = world_of(settings(GRAVITY, 60.0, 40, 8), sand);
    world.sleep.enabled = true;
    // It is poured for 3 s; then single grains roll down for a while.
    for _ in 0..20 {
        run(&mut world, 1.0);
        if world.bodies[0].asleep {
            break;
        }
    }
    assert_eq!(world.bodies[0].particles.len(), 1200);
    let particles = &world.bodies[0].particles;
    let middle = measure::center_of_mass(particles);
    let mean = |of: &dyn Fn(DVec3) -> f64| {
        let all = (0..particles.len()).map(|i| of(particles.position(i)));
        all.sum::<f64>() / particles.len() as f64
    };
    // Of a cone: tan θ = 2⟨z⟩/⟨ρ⟩, with the lowest grains at the height of their mean radius.
    let height = mean(&|x| x.y) - 0.9 * f64::from(RADIUS);
    let radius = mean(&|x| (x - middle).with_y(0.0).length());
    let slope = (2.0 * height / radius).atan().to_degrees();
    let expected = 0.5_f64.atan().to_degrees();
    assert!((slope - expected).abs() < 5.0, "{slope}°, not {expected}°");
    assert!(world.bodies[0].asleep, "{slope}°");
}

/// The radius that a collapsed column of grains reaches, as a multiple of what it had, depends on
/// nothing but its height over its radius a (Lube, Huppert, Sparks and Hallworth 2004): 1 + 1.24 a up to
/// a = 1.7, then 1 + 1.6 √a. Grains that may not rotate reach a third of the way.
#[test]
fn a_column_runs_out_as_far_as_columns_of_sand_do() {
    let runout = |(radius, tall): (f32, f32), resistance: f64| {
        let shape = Primitive::Grains {
            size: Vec3::new(2.0 * radius, tall, 2.0 * radius),
            region: GrainRegion::Cylinder,
            radius: 0.008,
            variation: 0.2,
        };
        let mut sand = body("sand", shape.build().expect("valid").shape, 1600.0);
        sand.translate(Vec3::Y * 0.5 * tall);
        sand.effects.grains = rolling(0.5, resistance);
        sand.effects.ground = floor(0.5);
        let mut world = world_of(settings(GRAVITY, 60.0, 20, 4), sand);
        run(&mut world, 3.0);
        let particles = &world.bodies[0].particles;
        let middle = measure::center_of_mass(particles);
        let off = |i: usize| (particles.position(i) - middle).with_y(0.0).length();
        let mut distances: Vec<f64> = (0..particles.len()).map(off).collect();
        distances.sort_by(f64::total_cmp);
        // The radius of a cone with this mean distance from its axis, and that of 95 %.
        let mean = distances.iter().sum::<f64>() / distances.len() as f64;
        let most = distances[distances.len() * 95 / 100];
        [2.0 * mean, most].map(|reached| reached / f64::from(radius) - 1.0)
    };
    for (size, law) in [((0.16, 0.16), 1.24), ((0.12, 0.36), 1.6 * 3.0_f64.sqrt())] {
        // The law is that of columns of many more grains; these have radii of 20 and 15 grains.
        let [found, most] = runout(size, 0.1);
        assert!((found / law - 1.0).abs() < 0.2, "{found} for {law}");
        assert!(most > 0.8, "{most}");
    }
    let [_, stiff] = runout((0.16, 0.16), f64::INFINITY);
    assert!(stiff < 0.3, "{stiff}");
}
