//! Contact between bodies and self-contact: separate surfaces never cross, friction is Coulomb
//! friction for any number of iterations, and momentum is conserved.

use crate::{
    support::{
        body, body_of_masses, cube, damping, elastic, elastic_on_ground, pinned, point, settings,
        state_bits, stretch, volume, with,
    },
    support_app::{app_of, deterministic, ticks},
};
use bevy::{
    app::App,
    ecs::{entity::Entity, message::Messages},
};
use glam::{DVec3, EulerRot, Quat, UVec2, Vec2, Vec3};
use pliant::{
    mesh::Primitive,
    simulation::{Asleep, BodyContacts, ContactEnded, ContactStarted, state_hash},
    solver::{
        Bend, Body, Contact, ContactThickness, Effects, Frequency, Friction, Grains, Particles,
        Pressure, RepairTime, RestShape, Restitution, Rod, RodRadius, SelfContact, ShapeMatching,
        World, ledger, measure, reference,
    },
};

fn contact(friction: f32) -> Option<Contact> {
    Some(Contact {
        friction: Friction::new(friction).expect("sound"),
        ..Contact::default()
    })
}

fn sheet(side: f32, cells: u32) -> RestShape {
    let cloth = Primitive::Cloth {
        size: Vec2::splat(side),
        cells: UVec2::splat(cells),
        diagonals: Default::default(),
        shear: false,
    };
    cloth.build().expect("a sound cloth").shape
}

/// A cloth with contact and self-contact.
fn cloth(side: f32, cells: u32) -> Body {
    let effects = Effects {
        stretch: stretch(0.0),
        bend: Some(Bend::default()),
        contact: contact(0.3),
        self_contact: Some(SelfContact::default()),
        ..Effects::default()
    };
    with(body("cloth", sheet(side, cells), 0.2), effects)
}

/// Two cubes above each other, the lower one on the ground, rotated so that edges touch as well.
fn two_cubes() -> World {
    let mut world = World::default();
    for (place, height) in [0.2, 0.65].into_iter().enumerate() {
        let effects = Effects {
            contact: contact(0.5),
            ..elastic_on_ground()
        };
        let mut cube = with(body("cube", cube(0.3, 2), 1000.0), effects);
        cube.translate(Vec3::new(0.03 * place as f32, height, 0.02));
        world.bodies.push(cube);
    }
    world
}

/// Runs ticks and counts crossings after each; also returns the largest number of active contacts.
fn max_crossings(world: &mut World, count: usize) -> (usize, usize) {
    (0..count).fold((0, 0), |(crossings, acting), _| {
        world.tick();
        let acts = world.contacts().counts().acting;
        (crossings.max(world.crossings()), acting.max(acts))
    })
}

/// Far from the origin, bodies find no more that may touch than near it; beyond the largest coordinate,
/// they find nothing.
#[test]
fn finding_contacts_costs_the_same_anywhere() {
    let candidates = |place: f32| {
        let mut world = World::default();
        for height in [0.0, 0.01] {
            let mut cloth = cloth(1.0, 32);
            cloth.translate(Vec3::new(place, height, 0.0));
            world.bodies.push(cloth);
        }
        world.tick();
        world.contacts().counts().candidates
    };
    let near = candidates(0.0);
    assert!(near > 0, "two sheets on each other");
    // The same claims, with positions of 48 bits: 0.4 nm there.
    assert!(candidates(9.9e4).abs_diff(near) <= near / 100);
    assert_eq!(candidates(1.1e5), 0);
    // What reaches farther out still touches near the origin.
    let mut world = World::default();
    let mut small = cloth(1.0, 4);
    small.translate(Vec3::Y * 0.01);
    world.bodies.extend([cloth(4e5, 1), small]);
    world.tick();
    assert!(world.contacts().counts().candidates > 0);
}

#[test]
fn a_body_lies_on_another_at_the_thickness_of_their_contact() {
    let mut world = two_cubes();
    let thickness = 0.01;
    for body in &mut world.bodies {
        if let Some(contact) = &mut body.effects.contact {
            contact.thickness = ContactThickness::new(thickness).expect("sound");
        }
    }
    let (crossings, acting) = max_crossings(&mut world, 300);
    assert_eq!(crossings, 0);
    assert!(acting > 0);
    let bottom = |body: &Body| {
        let heights = body.particles.positions.iter().map(|x| x.y);
        heights.fold(f32::INFINITY, f32::min)
    };
    let top = |body: &Body| {
        let heights = body.particles.positions.iter().map(|x| x.y);
        heights.fold(f32::NEG_INFINITY, f32::max)
    };
    let [lower, upper] = &world.bodies[..] else {
        panic!("two cubes");
    };
    // A resting body still sinks by 2gh² per substep with one iteration, 5.5e-5 m; unsupported
    // corners of a soft face bend further down.
    let gap = bottom(upper) - top(lower);
    assert!((gap - thickness).abs() < 0.3 * thickness, "gap {gap} m");
}

/// The app writes one message when a cube comes to lie on another, also over ticks in which both
/// sleep, and one when it is lifted off. Meanwhile, the force of the pair is the weight.
#[test]
fn bodies_say_when_they_begin_and_cease_to_touch_and_with_which_force() {
    let world = two_cubes();
    let mass = world.bodies[1].particles.positions.iter();
    let weight: f64 = mass.map(|x| 9.81 / f64::from(x.w)).sum();
    let (mut app, bodies, _) = app_of(&world);
    let pair: [Entity; 2] = [bodies[0], bodies[1]];
    let messages = |app: &mut App| {
        let world = app.world_mut();
        let mut started = world.resource_mut::<Messages<ContactStarted>>();
        let started: Vec<_> = started.drain().map(|it| it.bodies).collect();
        let mut ended = world.resource_mut::<Messages<ContactEnded>>();
        (
            started,
            ended.drain().map(|it| it.bodies).collect::<Vec<_>>(),
        )
    };
    let mut begun = 0;
    let mut forces = Vec::new();
    let mut slept = 0;
    for _ in 0..600 {
        ticks(&mut app, 1);
        let (started, ended) = messages(&mut app);
        assert!(started.iter().all(|bodies| *bodies == pair));
        // They may bounce once.
        begun += started.len();
        begun -= ended.len();
        let contacts = app.world().resource::<BodyContacts>();
        forces.extend(
            contacts
                .pairs()
                .map(|it| (it.bodies, it.force, it.normal_force)),
        );
        slept += usize::from(app.world().get::<Asleep>(pair[0]).is_some());
    }
    assert_eq!(begun, 1);
    assert!(slept > 60, "asleep in {slept} ticks");
    let last = &forces[forces.len() - 30..];
    let mean = last.iter().map(|it| it.1).sum::<Vec3>() / 30.0;
    assert!(
        last.iter()
            .all(|it| it.0 == pair && it.2 >= it.1.y.abs() * 0.99)
    );
    // On the lower one, downwards.
    let off = f64::from(mean.y) / -weight - 1.0;
    assert!(off.abs() < 0.01, "{mean} N for {weight} N");
    let mut upper = app
        .world_mut()
        .get_mut::<Particles>(pair[1])
        .expect("a body");
    for i in 0..upper.len() {
        let lifted = upper.position(i) + DVec3::Y;
        upper.set_position(i, lifted);
    }
    ticks(&mut app, 1);
    assert_eq!(messages(&mut app), (vec![], vec![pair]));
}

/// The force between two bodies that bounce off each other is what changes their momentum, also by
/// restitution: Σ F T = Δp, soft and rigid. Each of 600 substeps rounds the velocity of a particle in
/// 24 bits, up to 20 times.
#[test]
fn the_force_between_bodies_that_bounce_changes_their_momentum() {
    let matching = ShapeMatching {
        frequency: Frequency::new(f32::INFINITY).expect("sound"),
        ..ShapeMatching::default()
    };
    for is_rigid in [false, true] {
        let thrown = |x: f32| {
            let contact = contact(0.3).map(|contact| Contact {
                restitution: Restitution::new(0.8).expect("sound"),
                ..contact
            });
            let effects = Effects {
                contact,
                stretch: stretch(1e-5).filter(|_| !is_rigid),
                shape_matching: Some(matching).filter(|_| is_rigid),
                ..Effects::default()
            };
            let mut cube = with(body("cube", cube(0.3, 2), 1000.0), effects);
            cube.translate(Vec3::new(x, 0.1 * x, 0.02));
            cube.set_velocity(Vec3::X * -x.signum());
            cube
        };
        let mut world = World {
            settings: settings(0.0, 60.0, 10, 2),
            bodies: vec![thrown(0.3), thrown(-0.3)],
            ..World::default()
        };
        let momentum = |world: &World| measure::momentum(&world.bodies[0].particles);
        let before = momentum(&world);
        let mut impulse = DVec3::ZERO;
        for _ in 0..60 {
            world.tick();
            impulse += world.contacts().pairs().map(|it| it.force).sum::<DVec3>() / 60.0;
        }
        let change = momentum(&world) - before;
        assert!(change.x > 1.2 * before.length(), "it bounces: {change}");
        let off = (change - impulse).length() / before.length();
        let rounding = 600.0 * 20.0 / f64::from(1 << 24);
        assert!(off < rounding, "rigid {is_rigid}: {impulse}, {change}");
    }
}

/// At rest, contacts carry the weight: Σ(λₙn + λₜ)/h² = mg on the upper of two cubes. A velocity
/// that changes by less than 1e-3 m/s in the second of the mean changes it by 1e-4 mg; forces are
/// those of the last substep of each tick, whose deviations from the mean average out to below a
/// hundredth.
#[test]
fn contact_forces_carry_the_weight() {
    let mut world = two_cubes();
    world.sleep.enabled = false;
    (0..300).for_each(|_| world.tick());
    let ticks = 60;
    let mut mean = DVec3::ZERO;
    for _ in 0..ticks {
        world.tick();
        for contact in world.contacts().forces() {
            let on_first = contact.normal * contact.normal_force + contact.friction;
            assert!(contact.normal_force > 0.0);
            assert_ne!(contact.bodies[0], contact.bodies[1]);
            let sign = if contact.bodies[0] == Some(1) {
                1.0
            } else {
                -1.0
            };
            mean += on_first * sign / f64::from(ticks);
            // Between the two cubes.
            assert!((0.2..0.4).contains(&contact.point.y), "{:?}", contact.point);
        }
    }
    let mass = world.bodies[1].particles.positions.iter();
    let mass: f64 = mass.map(|x| 1.0 / f64::from(x.w)).sum();
    let weight = mass * 9.81;
    assert!(
        (mean.y - weight).abs() < 0.01 * weight,
        "{mean} N, but {weight} N"
    );
    assert!(mean.x.hypot(mean.z) < 0.01 * weight, "{mean} N");
}

#[test]
fn nothing_crosses_at_300_m_per_s_in_a_single_substep() {
    for layers in [1, 3] {
        let mut world = World {
            settings: settings(9.81, 60.0, 1, 1),
            ..World::default()
        };
        for layer in 0..layers {
            let mut cloth = cloth(0.8, 12);
            cloth.translate(Vec3::Y * 0.05 * layer as f32);
            world.bodies.push(cloth);
        }
        let effects = Effects {
            contact: contact(0.3),
            ..elastic()
        };
        let mut ball = with(body("block", cube(0.15, 2), 1000.0), effects);
        // In one tick it could pass through all of them.
        ball.translate(Vec3::new(0.03, 2.0, 0.02));
        ball.set_velocity(Vec3::NEG_Y * 300.0);
        world.bodies.push(ball);
        let (crossings, acting) = max_crossings(&mut world, 60);
        assert_eq!(crossings, 0, "{layers} layers");
        assert!(acting > 0, "it hits");
        assert!(world.bodies.iter().all(|body| body.quarantine.is_none()));
    }
}

/// A line, which is thinner than whatever it hits, at any angle and speed.
#[test]
fn a_line_crosses_neither_cloth_nor_solids_however_fast_it_is() {
    let mut crossed = Vec::new();
    for (number, speed) in [20.0, 50.0, 100.0, 200.0, 300.0]
        .into_iter()
        .cycle()
        .take(20)
        .enumerate()
    {
        let [substeps, segments] = [[1, 4, 10, 20][number % 4], [1, 6, 24][number % 3]];
        let rope = Primitive::Rope {
            length: 0.6,
            segments,
        };
        let effects = Effects {
            contact: contact(0.3),
            ..elastic()
        };
        let mut line = with(
            body("line", rope.build().expect("sound").shape, 0.05),
            effects,
        );
        let target = match number % 2 {
            0 => cloth(0.8, 12),
            _ => with(body("block", cube(0.5, 4), 1000.0), effects),
        };
        let angle = 0.7 * number as f32;
        let turn = Quat::from_euler(EulerRot::YXZ, angle, 0.3 * angle.sin(), 0.5 * angle.cos());
        for i in 0..line.particles.len() {
            let x = line.particles.position(i).as_vec3();
            let x = turn * Vec3::new(x.y, 0.0, x.x);
            line.particles
                .set_position(i, (x + Vec3::new(0.03, 0.6, 0.02)).as_dvec3());
        }
        line.set_velocity(Vec3::new(0.1 * speed, -speed, 0.0));
        let mut world = World {
            settings: settings(9.81, 60.0, substeps, 1),
            bodies: vec![target, line],
            ..World::default()
        };
        let (crossings, _) = max_crossings(&mut world, 30);
        let line = &world.bodies[1].particles;
        let mass: f64 = line.positions.iter().map(|x| 1.0 / f64::from(x.w)).sum();
        let falls = -measure::momentum(line).y / mass / f64::from(speed);
        if crossings > 0 || falls > 0.9 {
            crossed.push(format!("{number}: {speed} m/s, {substeps} substeps, {segments} segments: {crossings} crossings, {falls}"));
        }
    }
    assert!(crossed.is_empty(), "{crossed:#?}");
}

#[test]
fn a_cloth_that_falls_on_its_edge_folds_without_crossing() {
    for substeps in [1, 10] {
        let mut cloth = cloth(0.6, 20);
        cloth.effects.ground = elastic_on_ground().ground;
        for i in 0..cloth.particles.len() {
            let x = cloth.particles.position(i);
            let wave = 0.02 * (x.z * 25.0).sin();
            let stands = DVec3::new(0.05 * x.x + wave, 0.31 + x.x, x.z);
            cloth.particles.set_position(i, stands);
        }
        let mut world = World {
            settings: settings(9.81, 60.0, substeps, 1),
            bodies: vec![cloth],
            ..World::default()
        };
        let (crossings, acting) = max_crossings(&mut world, 150);
        assert_eq!(crossings, 0, "{substeps} substeps");
        assert!(acting > 0, "it folds onto itself");
    }
}

/// Without the effect, the same bodies pass through each other: the tests above can fail.
#[test]
fn bodies_without_contact_cross() {
    let mut world = two_cubes();
    let mut crossed = 0;
    for _ in 0..60 {
        for body in &mut world.bodies {
            body.effects.contact = None;
        }
        world.tick();
        for body in &mut world.bodies {
            body.effects.contact = contact(0.5);
        }
        crossed = crossed.max(world.crossings());
    }
    assert!(crossed > 0);
}

/// A block on a fixed slab, under gravity tilted by an angle with this tangent: the distance that
/// it slid in a second, and the expected distance with friction µ, ½(g sin θ − µ g cos θ)t².
fn slid(tangent: f64, friction: f32, iterations: u32) -> (f64, f64) {
    let slab = Primitive::Box {
        size: Vec3::new(8.0, 0.2, 0.6),
        cells: glam::UVec3::new(8, 1, 1),
    };
    let slab = slab.build().expect("a sound box").shape;
    let pins: Vec<u32> = (0..slab.vertices.len() as u32).collect();
    let thickness = ContactThickness::new(0.005).expect("sound");
    let touches = |mut effects: Effects| {
        let contact = contact(friction).map(|contact| Contact {
            thickness,
            ..contact
        });
        effects.contact = contact;
        effects
    };
    let slab = pinned(
        with(body("slab", slab, 1000.0), touches(Effects::default())),
        &pins,
    );
    let mut block = with(
        body("block", cube(0.2, 1), 1000.0),
        touches(Effects {
            stretch: stretch(0.0),
            volume: volume(0.0),
            ..Effects::default()
        }),
    );
    block.translate(Vec3::new(-2.0, 0.2051, 0.0));
    let cos = 1.0 / (1.0 + tangent * tangent).sqrt();
    let g = 9.81;
    let mut world = World {
        settings: settings(g, 60.0, 10, iterations),
        bodies: vec![slab, block],
        ..World::default()
    };
    world.sleep.enabled = false;
    let gravity = DVec3::new(g * tangent * cos, -g * cos, 0.0).as_vec3();
    world.settings.set_gravity(gravity).expect("sound");
    let middle = |world: &World| measure::center_of_mass(&world.bodies[1].particles).x;
    let before = middle(&world);
    for _ in 0..60 {
        world.tick();
    }
    let pull = g * cos * (tangent - f64::from(friction)).max(0.0);
    (middle(&world) - before, 0.5 * pull)
}

/// Coulomb's law: on a slope steeper than µ the block slides with g(sin θ − µ cos θ), on a flatter
/// one it sticks, and neither depends on the number of iterations.
#[test]
fn friction_between_bodies_is_coulombs_whatever_the_iterations() {
    for iterations in [1, 4, 16] {
        for (tangent, friction) in [(0.5, 0.3), (0.7, 0.5)] {
            let (slid, expected) = slid(tangent, friction, iterations);
            // The block settles onto the slab in its first ticks, during which friction acts on
            // less or more than its weight: 2 % of the distance in a second.
            let deviation = (slid - expected).abs() / expected;
            assert!(
                deviation < 0.02,
                "tan {tangent}, µ {friction}, {iterations}: {slid} m, {expected} m"
            );
        }
        let (crept, _) = slid(0.48, 0.5, iterations);
        assert!(
            crept.abs() < 1e-3,
            "crept by {crept} m with {iterations} iterations"
        );
    }
}

/// Two cubes that collide in free flight conserve momentum and angular momentum, and lose energy.
#[test]
fn momentum_stays_when_bodies_meet() {
    let mut world = World {
        settings: settings(0.0, 60.0, 20, 2),
        ..World::default()
    };
    for (side, speed) in [(-1.0, 1.0), (1.0, -0.5)] {
        let effects = Effects {
            stretch: stretch(1e-5),
            volume: volume(0.0),
            contact: contact(0.5),
            ..Effects::default()
        };
        let mut cube = with(body("cube", cube(0.3, 2), 1000.0), effects);
        cube.translate(Vec3::new(0.25 * side, 0.04 * side, 0.0));
        cube.set_velocity(Vec3::X * speed);
        world.bodies.push(cube);
    }
    let sum = |world: &World, of: fn(&Particles) -> DVec3| {
        world
            .bodies
            .iter()
            .map(|body| of(&body.particles))
            .sum::<DVec3>()
    };
    let energy = |world: &World| -> f64 {
        let all = world.bodies.iter();
        all.map(|body| measure::kinetic_energy(&body.particles))
            .sum()
    };
    let before = (
        sum(&world, measure::momentum),
        sum(&world, measure::angular_momentum),
    );
    let fast = energy(&world);
    let mut met = false;
    for _ in 0..60 {
        world.tick();
        let counts = world.contacts().counts();
        met |= counts.acting > 0;
        assert_eq!(counts.truncated, 0, "truncation does not keep momentum");
    }
    assert!(met);
    let scale = 27.0 * 1.5;
    let deviation = (sum(&world, measure::momentum) - before.0).length() / scale;
    assert!(deviation < 1e-5, "momentum is off by {deviation}");
    // Contacts are evaluated at the start of the substep and act at its predicted end: the lever
    // arm of 0.15 m has an error of the displacement in a substep, 1.5 m/s · 1/1200 s. Implicit
    // Euler also takes 2πhω of the angular momentum per turn: the same amount again at 2 rad/s in
    // half a second.
    let turned = (sum(&world, measure::angular_momentum) - before.1).length() / (scale * 0.15);
    assert!(turned < 1.0 / 60.0, "angular momentum is off by {turned}");
    assert!(energy(&world) <= fast, "energy rose");
}

/// A particle leaves a fixed sheet with −e times its incident velocity, and a slow one stays.
#[test]
fn restitution_returns_the_fraction_e_of_the_speed() {
    for restitution in [0.0, 0.5, 1.0] {
        let bounces = Contact {
            restitution: Restitution::new(restitution).expect("sound"),
            ..contact(0.0).expect("present")
        };
        let effects = Effects {
            contact: Some(bounces),
            ..Effects::default()
        };
        let mut held = cloth(1.0, 2);
        held.effects = effects;
        let held = pinned(held, &[0, 1, 2, 3, 4, 5, 6, 7, 8]);
        let mut particle = with(body_of_masses(point(), &[0.3]), effects);
        particle.translate(Vec3::new(0.13, 0.3, 0.07));
        particle.set_velocity(Vec3::NEG_Y * 2.0);
        let mut world = World {
            settings: settings(0.0, 60.0, 20, 1),
            bodies: vec![held, particle],
            ..World::default()
        };
        for _ in 0..20 {
            world.tick();
        }
        let leaves = f64::from(world.bodies[1].particles.velocity(0).y);
        let expected = 2.0 * f64::from(restitution);
        assert!(
            (leaves - expected).abs() < 1e-5,
            "e = {restitution}: {leaves} m/s"
        );
    }
}

/// The same with the f64 reference: it uses the same contact module, so that this tests the
/// integration of contacts into a substep, and the influence of single precision.
#[test]
fn the_reference_has_the_same_contacts() {
    let mut world = two_cubes();
    world.sleep.enabled = false;
    let mut reference = reference::World::of(&world);
    for _ in 0..60 {
        world.tick();
        reference.tick();
    }
    assert!(world.contacts().counts().acting > 0);
    for (fast, slow) in world.bodies.iter().zip(&reference.bodies) {
        let deviation = (0..fast.particles.len())
            .map(|i| fast.particles.position(i).distance(slow.x[i]))
            .fold(0.0, f64::max);
        // A second with an impact, which amplifies rounding of 1e-8 m.
        assert!(deviation < 1e-4, "off by {deviation} m");
    }
}

/// With Bevy and without, by its schedules, and on any number of threads: the same bits, and the
/// same bodies sleep.
#[test]
fn contacts_have_the_same_bits_however_bodies_are_stepped() {
    let mut world = two_cubes();
    let mut sheet = cloth(0.4, 6);
    sheet.translate(Vec3::Y * 1.0);
    sheet.effects.ground = elastic_on_ground().ground;
    world.bodies.push(sheet);
    world.settings = settings(9.81, 60.0, 5, 2);
    let (_, acting) = deterministic(world, 150);
    assert!(acting > 0);
}

/// Truncation can move a particle into the path of others that were not near its own path: a stiff
/// cloth that crumples on the ground, at four substeps.
#[test]
fn truncated_motion_does_not_cross_others() {
    let mut sheet = with(body("cloth", sheet(1.0, 20), 0.2), Effects::default());
    sheet.effects = Effects {
        stretch: stretch(0.0),
        self_contact: Some(SelfContact::default()),
        ground: elastic_on_ground().ground,
        ..Effects::default()
    };
    for i in 0..sheet.particles.len() {
        let x = sheet.particles.position(i);
        let upright = DVec3::new(-x.y + 0.05 * x.x, x.x + 0.7, x.z);
        sheet.particles.set_position(i, upright);
    }
    sheet.tick_start.clone_from(&sheet.particles);
    let mut world = World {
        settings: settings(9.81, 60.0, 4, 1),
        bodies: vec![sheet],
        ..World::default()
    };
    let mut truncated = 0;
    for tick in 0..60 {
        world.tick();
        truncated += world.contacts().counts().truncated;
        assert_eq!(world.crossings(), 0, "tick {tick}");
    }
    assert!(truncated > 0);
}

/// Truncation takes momentum, and returns it to free bodies: two sheets meet at 300 m/s. Each of
/// the 600 substeps rounds the momentum of a particle in 24 bits.
#[test]
fn momentum_stays_when_motion_is_truncated() {
    let mut bodies = [1.0, -1.0].map(|sign: f32| {
        let mut sheet = cloth(0.4, 6);
        sheet.effects.stretch = stretch(1e-5);
        if let Some(stretch) = &mut sheet.effects.stretch {
            stretch.repair = RepairTime::new(f32::INFINITY).expect("sound");
        }
        sheet.translate(Vec3::new(0.07 * sign, 0.5 * sign, 0.04 * sign));
        sheet.set_velocity(Vec3::Y * (-150.0 * sign));
        sheet
    });
    for body in &mut bodies {
        body.effects.self_contact = Some(SelfContact::default());
    }
    let mut world = World {
        settings: settings(0.0, 60.0, 10, 1),
        bodies: bodies.to_vec(),
        ..World::default()
    };
    let momentum = |world: &World| {
        let each = world.bodies.iter();
        each.map(|body| measure::momentum(&body.particles))
            .sum::<DVec3>()
    };
    let carried = measure::momentum(&world.bodies[0].particles).length();
    let mut truncated = 0;
    for _ in 0..60 {
        world.tick();
        truncated += world.contacts().counts().truncated;
    }
    assert!(truncated > 0);
    let deviation = momentum(&world).length() / carried;
    assert!(
        deviation < 600.0 / f64::from(1 << 24),
        "{deviation} of the momentum of one"
    );
}

/// A body with contact that touches nothing keeps the bits that it has without the effect.
#[test]
fn a_body_that_touches_nothing_keeps_its_bits() {
    let world_of = |touches: bool| {
        let mut world = World::default();
        for x in [0.0, 0.5] {
            let mut cube = with(body("cube", cube(0.3, 3), 1000.0), elastic_on_ground());
            cube.effects.contact = contact(0.5).filter(|_| touches);
            cube.effects.self_contact = touches.then(SelfContact::default);
            cube.effects.stretch = stretch(1e-4);
            cube.translate(Vec3::new(x, 0.4, 0.0));
            world.bodies.push(cube);
        }
        world
    };
    let (mut with, mut without) = (world_of(true), world_of(false));
    for tick in 1..=240 {
        with.tick();
        without.tick();
        for (a, b) in with.bodies.iter().zip(&without.bodies) {
            assert_eq!(
                state_bits(&a.particles),
                state_bits(&b.particles),
                "tick {tick}"
            );
        }
    }
    assert!(
        with.contacts().counts().detections > 0,
        "they were looked at"
    );
}

/// Touching bodies sleep together, and wake when hit.
#[test]
fn bodies_that_touch_sleep_and_wake_together() {
    let mut world = two_cubes();
    for body in &mut world.bodies {
        body.effects.stretch = stretch(1e-5);
        if let Some(stretch) = &mut body.effects.stretch {
            stretch.damping = damping(0.02);
        }
    }
    for _ in 0..900 {
        world.tick();
        let asleep = [0, 1].map(|body| world.bodies[body].asleep);
        assert_eq!(asleep[0], asleep[1], "at {} s", world.time);
    }
    assert!(world.bodies[0].asleep, "{:?}", world.contacts().counts());
    let mut third = world.bodies[1].clone();
    third.asleep = false;
    third.translate(Vec3::Y * 0.5);
    third.rest = Default::default();
    world.bodies.push(third);
    let mut woke = false;
    for _ in 0..60 {
        world.tick();
        woke |= !world.bodies[0].asleep && !world.bodies[1].asleep;
    }
    assert!(woke);
    assert_eq!(world.crossings(), 0);
}

/// The energy ledger of touching bodies adds up: contact and friction take energy, and there is no
/// remainder.
#[test]
fn the_energy_ledger_has_contacts_between_bodies() {
    use pliant::{simulation::EnergyLedger, simulation::Measuring};
    let world = two_cubes();
    let (mut app, ..) = app_of(&world);
    app.insert_resource(Measuring(true));
    app.insert_resource(EnergyLedger::kept(true));
    let (mut plain, ..) = app_of(&world);
    ticks(&mut app, 90);
    ticks(&mut plain, 90);
    assert_eq!(
        state_hash(app.world_mut()),
        state_hash(plain.world_mut()),
        "tracking energy changes no bit"
    );
    let ledger: &EnergyLedger = app.world().resource();
    let rows: ledger::Ledger = ledger.solver;
    assert!(rows.contact < -1.0, "{rows:?}");
    let scale = rows
        .rows()
        .iter()
        .map(|(_, energy)| energy.abs())
        .sum::<f64>();
    assert!(
        ledger.gap().abs() < 1e-6 * scale,
        "gap {} of {scale}",
        ledger.gap()
    );
}

/// A body that diverges during contact is quarantined; the other one stays finite and continues.
#[test]
fn a_diverged_body_does_not_affect_the_bodies_that_it_touches() {
    let mut world = two_cubes();
    world.settings = settings(9.81, 60.0, 10, 4);
    world.sleep.enabled = false;
    for _ in 0..120 {
        world.tick();
    }
    assert!(world.contacts().counts().acting > 0, "they touch");
    let upper = &mut world.bodies[1].particles;
    upper.set_velocity(0, Vec3::X * 1e30);
    world.tick();
    assert!(world.bodies[1].quarantine.is_some());
    assert!(
        world.bodies[0].quarantine.is_none(),
        "{:?}",
        world.bodies[0].quarantine
    );
    for _ in 0..60 {
        world.tick();
    }
    assert_eq!(world.bodies[0].particles.first_not_finite(), None);
}

/// A body that touched a removed body, the first or the last one, continues.
#[test]
fn bodies_can_be_removed_while_they_touch() {
    for removed in 0..2 {
        let mut world = two_cubes();
        world.settings = settings(9.81, 60.0, 10, 4);
        world.sleep.enabled = false;
        for _ in 0..120 {
            world.tick();
        }
        assert!(world.contacts().counts().acting > 0, "they touch");
        world.bodies.remove(removed);
        for _ in 0..60 {
            world.tick();
        }
        assert_eq!(world.contacts().counts().acting, 0);
        assert_eq!(world.bodies[0].particles.first_not_finite(), None);
    }
}

/// Bodies of every kind fly into each other: solids, a cloth, a balloon, a rope, a rod, hair, a rigid body and
/// grains.
/// Nothing acts on them from outside.
#[test]
fn momentum_stays_among_all_kinds_and_nothing_crosses() {
    let of = |primitive: Primitive| primitive.build().expect("sound").shape;
    let touching = Effects {
        contact: contact(0.3),
        ..Effects::default()
    };
    let solid = |compliance| Effects {
        stretch: stretch(compliance),
        volume: volume(0.0),
        ..touching
    };
    let thin = Effects {
        stretch: stretch(1e-5),
        bend: Some(Bend::default()),
        self_contact: Some(SelfContact::default()),
        ..touching
    };
    let rope = || {
        of(Primitive::Rope {
            length: 0.6,
            segments: 16,
        })
    };
    let balloon = Primitive::Balloon {
        radius: 0.15,
        cells: 4,
    };
    let sand = Primitive::Grains {
        size: Vec3::splat(0.25),
        region: Default::default(),
        radius: 0.03,
        variation: 0.2,
    };
    let hair = Primitive::Hair {
        radius: 0.08,
        coverage: 90.0,
        strands: 24,
        length: 0.12,
        segments: 8,
        curl: 0.0,
        turns: 0.0,
    };
    let kinds = [
        ("jelly", cube(0.3, 3), 300.0, solid(1e-4)),
        ("block", cube(0.25, 2), 300.0, solid(0.0)),
        ("cloth", sheet(0.5, 10), 2.0, thin),
        (
            "balloon",
            of(balloon),
            2.0,
            Effects {
                pressure: Some(Pressure::default()),
                ..thin
            },
        ),
        ("rope", rope(), 1.0, Effects { bend: None, ..thin }),
        (
            "rod",
            rope(),
            1.0,
            Effects {
                rod: Some(Rod::default()),
                contact: contact(0.3),
                ..Effects::default()
            },
        ),
        (
            "hair",
            of(hair),
            1e-3,
            Effects {
                rod: Some(Rod {
                    radius: RodRadius::of(1e-3),
                    ..Rod::default()
                }),
                self_contact: Some(SelfContact::default()),
                ..touching
            },
        ),
        (
            "stone",
            cube(0.2, 2),
            800.0,
            Effects {
                // Rigid.
                shape_matching: Some(ShapeMatching {
                    frequency: Frequency::of(f32::INFINITY),
                    ..ShapeMatching::default()
                }),
                ..touching
            },
        ),
        (
            "grains",
            of(sand),
            500.0,
            Effects {
                grains: Some(Grains::default()),
                ..touching
            },
        ),
    ];
    let mut world = World {
        settings: settings(0.0, 60.0, 20, 2),
        ..World::default()
    };
    world.sleep.enabled = false;
    for (place, (name, shape, density, effects)) in kinds.into_iter().enumerate() {
        let angle = place as f32 / 9.0 * std::f32::consts::TAU;
        let out = Vec3::new(angle.cos(), 0.13 * (place % 3) as f32 - 0.13, angle.sin());
        let mut one = with(body(name, shape, density), effects);
        one.translate(0.75 * out);
        one.set_velocity(-1.5 * out);
        world.bodies.push(one);
    }
    let momentum = |world: &World| -> DVec3 {
        let all = world.bodies.iter();
        all.map(|body| measure::momentum(&body.particles)).sum()
    };
    let carried: f64 = world
        .bodies
        .iter()
        .map(|body| measure::momentum(&body.particles).length())
        .sum();
    let before = momentum(&world);
    let mut met = [false; 9];
    for _ in 0..60 {
        world.tick();
        assert_eq!(world.crossings(), 0);
        for pair in world.contacts().touching() {
            for body in pair {
                met[*body as usize] = true;
            }
        }
    }
    assert_eq!(met, [true; 9], "who has touched another");
    assert!(world.bodies.iter().all(|body| body.quarantine.is_none()));
    let deviation = (momentum(&world) - before).length() / carried;
    assert!(deviation < 1e-5, "{deviation} of the momentum");
}
