//! Stitches: two points are held together until the force exceeds their strength.

use crate::{
    support::{
        G, assert_relative, bits, body, body_of_masses, chain, cube, damping, elastic_on_ground,
        point, random_vector, run, settings, stretch, volume, with, world,
    },
    support_app::{app_of, app_with, ticks},
};
use bevy::prelude::{IntoScheduleConfigs, World as App};
use glam::{DVec3, Vec3};
use pliant::{
    recording::{About, Snapshot},
    scene::{Scene, run::headless},
    simulation::{SolvePhase, SolveSchedule, plain},
    solver::{
        Body, Coefficient, Collider, ColliderShape, Compliance, ContactThickness, Drag, Effects,
        Force, Mass, ParticleIndex, Pose, RestShape, SelfContact, Stitch, StitchEnd, StitchError,
        Stitches, Stretch, SurfacePoint, Threads, Toughness, VertexIndex, World, deform::Random,
        reference,
    },
};

fn at(terms: &[(u32, f32)]) -> SurfacePoint {
    let terms = terms
        .iter()
        .map(|&(particle, weight)| (ParticleIndex(particle), weight));
    SurfacePoint::new(&terms.collect::<Vec<_>>()).expect("a point")
}

fn stitch(point: SurfacePoint, to: StitchEnd, compliance: f32, strength: f32) -> Stitch {
    Stitch {
        point,
        to,
        compliance: Compliance::new(compliance).expect("sound"),
        strength: Force::new(strength).expect("sound"),
        broken: false,
    }
}

fn stitched(mut body: Body, stitches: &[Stitch]) -> Body {
    let all = stitches.to_vec();
    body.stitches = Stitches::new(all, body.particles.len()).expect("sound");
    body
}

fn hook() -> Collider {
    let shape = ColliderShape::Sphere { radius: 0.01 };
    Collider::new(shape, Pose::default()).expect("sound")
}

/// A mass of 1 kg on a stitch to a collider at the origin.
fn hung(compliance: f32, strength: f32) -> World {
    let to = StitchEnd::Collider {
        number: 0,
        place: Vec3::ZERO,
    };
    let mass = body_of_masses(point(), &[1.0]);
    let mass = stitched(mass, &[stitch(at(&[(0, 1.0)]), to, compliance, strength)]);
    let mut world = world(settings(G, 60.0, 20, 1), mass);
    world.colliders.push(hook());
    world
}

/// A rigid stitch carries the weight; a compliant one, released at zero extension, oscillates up to
/// twice that.
#[test]
fn a_stitch_breaks_at_its_force() {
    // The weight is accurate to the rounding of y = gh² = 7e-6 m near 0: to 1e-6 of it.
    for (compliance, peak) in [(0.0, G), (1e-3, 2.0 * G)] {
        for (strength, breaks) in [(0.99, true), (1.01, false)] {
            let mut world = hung(compliance, (strength * peak) as f32);
            run(&mut world, 1.0);
            let broken = world.bodies[0].stitches.broken() == 1;
            // Implicit Euler damps an oscillation of ω = 31.6/s within half a period by
            // πωh/4 = 2 %: the compliant one only needs to hold above its peak, and to break below
            // 0.97 of it.
            if compliance == 0.0 || !breaks {
                assert_eq!(broken, breaks, "{compliance} m/N, {strength} of {peak} N");
            }
        }
    }
    let mut world = hung(1e-3, (0.97 * 2.0 * G) as f32);
    run(&mut world, 1.0);
    assert_eq!(world.bodies[0].stitches.broken(), 1);
    assert!(world.bodies[0].particles.positions[0].y < -1.0, "it falls");
}

/// A limp strip that is peeled off at a right angle gives way at F = G: the end moves by as much as the seam
/// opens. Stitches that open by δ before they break carry the load with δ/l of their neighbors, and the
/// force is that of the toughness whatever their spacing l: within a tenth with 12 of them. At 1.1 of it
/// the strip peels by a spacing per second, so that 1.2 is asserted.
#[test]
fn a_strip_is_peeled_off_at_the_toughness_of_its_seam() {
    const SEAM: f64 = 10.0; // J/m
    const OPENING: f64 = 0.3; // m
    let broken = |spacing: f64, load: f64| {
        let count = (0.8 / spacing).round() as u32 + 1;
        // The free end hangs below the first stitch.
        let place = |k: u32| Vec3::new((f64::from(k) * spacing) as f32, 0.0, 0.0);
        let shape = RestShape {
            vertices: [Vec3::NEG_Y * 0.1]
                .into_iter()
                .chain((0..count).map(place))
                .collect(),
            edges: (0..count).map(|i| [i, i + 1]).collect(),
            ..RestShape::default()
        };
        let toughness = SEAM * spacing;
        let compliance = (OPENING * OPENING / (2.0 * toughness)) as f32;
        let strength =
            Stitch::strength_of(Toughness::of(toughness as f32), Compliance::of(compliance));
        // Light, beside 1 kg at its end.
        let mut strip = body("strip", shape, 1e-2);
        let stitches = (0..count).map(|k| {
            let particle = strip.topology.particle(VertexIndex(k + 1)) as u32;
            let to = StitchEnd::Collider {
                number: 0,
                place: place(k),
            };
            stitch(at(&[(particle, 1.0)]), to, compliance, strength.get())
        });
        let stitches: Vec<_> = stitches.collect();
        strip.added_mass = vec![(VertexIndex(0), Mass::of((load * SEAM / G) as f32))];
        strip.update_masses();
        strip.effects.stretch = Some(Stretch::default());
        // The weight sinks slowly, without overshoot.
        strip.effects.drag = Some(Drag {
            linear: Coefficient::of(20.0),
            ..Drag::default()
        });
        let mut world = world(settings(G, 60.0, 100, 1), stitched(strip, &stitches));
        world.colliders.push(hook());
        run(&mut world, 5.0);
        world.bodies[0].stitches.broken()
    };
    for spacing in [OPENING / 12.0, OPENING / 24.0] {
        assert_eq!(broken(spacing, 0.9), 0, "{spacing} m");
        assert!(broken(spacing, 1.2) > 3, "{spacing} m");
    }
}

#[test]
fn a_stitch_gives_by_its_compliance() {
    let mut world = hung(1e-2, f32::INFINITY);
    run(&mut world, 20.0);
    let body = &world.bodies[0];
    let h = world.settings.substep_seconds() as f32;
    let force = f64::from(body.stitches.forces(h).next().expect("one"));
    // Damped by ω²h/2 = 0.04/s for 20 s, half of the first oscillation remains.
    let place = -f64::from(body.particles.positions[0].y);
    assert!((place - 1e-2 * G).abs() < 0.5 * 1e-2 * G, "{place} m");
    // Its force and its length are reported for the same substep.
    assert_relative(force * 1e-2, place, 1e-4, "compliance times force");
}

/// Four separate particles.
fn loose() -> RestShape {
    RestShape {
        vertices: (0..4).map(|i| Vec3::X * i as f32).collect(),
        edges: vec![[0, 1], [2, 3]],
        ..RestShape::default()
    }
}

#[test]
fn two_points_meet_and_momentum_stays() {
    let mut random = Random::new(5);
    for _ in 0..100 {
        let mut body = body_of_masses(loose(), &[1.0, 2.0, 3.0, 5.0]);
        for i in 0..body.particles.len() {
            let v = random_vector(&mut random, 1.0);
            body.particles.set_velocity(i, v);
        }
        let (one, other) = (at(&[(0, 0.3), (1, 0.7)]), at(&[(2, 1.0), (3, 1.0)]));
        let positions = &mut body.particles.positions;
        let way = one.position(positions) - other.position(positions);
        for x in &mut positions[2..] {
            *x += way.extend(0.0);
        }
        let end = StitchEnd::Point(other);
        let body = stitched(body, &[stitch(one, end, 0.0, f32::INFINITY)]);
        let mut world = world(settings(0.0, 60.0, 10, 1), body);
        let momentum = |world: &World| {
            let particles = &world.bodies[0].particles;
            let each = particles.positions.iter().enumerate();
            each.fold(DVec3::ZERO, |sum, (i, x)| {
                sum + particles.velocity_f64(i) / f64::from(x.w)
            })
        };
        let before = momentum(&world);
        run(&mut world, 0.1);
        let positions = &world.bodies[0].particles.positions;
        let apart = one.position(positions).distance(other.position(positions));
        // Positions below 4 m are accurate to 2.4e-7 m each.
        assert!(apart < 2e-6, "{apart} m apart");
        // Velocities are differences of such positions over h = 1/600 s, each accurate to
        // 1.5e-4 m/s, and their error over 60 substeps grows like a random walk, to 8 times that.
        let lost = (momentum(&world) - before).length();
        assert!(lost < 8.0 * 11.0 * 1.5e-4, "{lost} kg·m/s of {before}");
    }
}

#[test]
fn the_reference_is_stitched_too() {
    for strength in [25.0, 9.0] {
        let mut world = hung(1e-3, strength);
        world.bodies[0].particles.positions[0].x = 1e-3;
        let mut reference = reference::World::of(&world);
        for _ in 0..30 {
            world.tick();
            reference.tick();
        }
        let broken = world.bodies[0].stitches.broken();
        assert_eq!(broken, reference.bodies[0].stitches().broken());
        let place = world.bodies[0].particles.position(0);
        // A position below 2 m that is rounded by 6e-8 m adds the same error to every later one of
        // 600 substeps through its velocity: a random walk, to 600^1.5 times that.
        let apart = reference.bodies[0].x[0].distance(place);
        assert!(apart < 600.0_f64.powf(1.5) * 6e-8, "{apart} m apart");
    }
}

#[test]
fn invalid_stitches_are_refused() {
    let one = at(&[(0, 1.0)]);
    let make = |to| Stitches::new(vec![stitch(one, StitchEnd::Point(to), 0.0, 1.0)], 3);
    let missing = make(at(&[(3, 1.0)]));
    assert_eq!(
        missing,
        Err(StitchError::NoSuchParticle {
            stitch: 0,
            particles: 3
        })
    );
    let shared = make(at(&[(2, 0.5), (0, 0.5)]));
    assert_eq!(
        shared,
        Err(StitchError::SharedParticle {
            stitch: 0,
            particle: ParticleIndex(0)
        })
    );
    let text = |to: &str| {
        format!(
            "Scene(title: \"\", look_at: \"\", bodies: [(name: \"rope\", primitive: Rope(length: 1), \
             effects: (), stitches: [(point: Particle(0), to: {to})])], acceptance: (seconds: 1))"
        )
    };
    for (to, reason) in [
        (
            "Collider(1)",
            "stitch 1: unknown collider 1: the scene has no colliders",
        ),
        ("Point(Vertex(99))", "does not have"),
        ("Point(Vertex(0))", "attached to vertex 0"),
        (
            "Point(Triangle((1, 2, 3), (0, 0, 0)))",
            "is not a valid point",
        ),
    ] {
        let scene: Scene = text(to).parse().expect("it is read");
        let error = scene.build().expect_err(to).to_string();
        assert!(error.contains(reason), "{to}: {error}");
    }
}

/// Two falling blocks of one body, stitched face to face with thread that breaks.
fn blocks() -> World {
    let effects = Effects {
        stretch: stretch(1e-4),
        volume: volume(1e-9),
        ..elastic_on_ground()
    };
    let mut shape = cube(0.3, 3);
    let count = shape.vertices.len() as u32;
    let far = |i: u32| i + count;
    let other = shape.clone();
    shape
        .vertices
        .extend(other.vertices.iter().map(|&x| x + Vec3::Y * 0.3));
    shape
        .edges
        .extend(other.edges.iter().map(|ends| ends.map(far)));
    shape
        .tetrahedra
        .extend(other.tetrahedra.iter().map(|ends| ends.map(far)));
    shape
        .triangles
        .extend(other.triangles.iter().map(|ends| ends.map(far)));
    let mut both = with(body("blocks", shape, 1000.0), effects);
    let topology = both.topology.clone();
    let particle = |vertex: u32| topology.particle(VertexIndex(vertex)) as u32;
    let mut stitches = Vec::new();
    for (top, x) in (0..).zip(&other.vertices) {
        for (bottom, y) in (0..).zip(&other.vertices) {
            if x.distance(*y + Vec3::Y * 0.3) < 1e-4 {
                let end = StitchEnd::Point(at(&[(particle(far(bottom)), 1.0)]));
                // Every other one is unbreakable.
                let strength = [60.0, f32::INFINITY][stitches.len() % 2];
                stitches.push(stitch(at(&[(particle(top), 1.0)]), end, 1e-5, strength));
            }
        }
    }
    assert_eq!(stitches.len(), 16);
    both = stitched(both, &stitches);
    both.translate(Vec3::Y * 0.5);
    for (place, x) in both.particles.positions.iter_mut().enumerate() {
        x.x += if topology.vertex(place).0 < count {
            0.0
        } else {
            3e-4
        };
    }
    world(settings(G, 60.0, 10, 2), both)
}

#[test]
fn threads_schedules_and_snapshots_change_no_bit_of_stitched_bodies() {
    let mut alone = blocks();
    let mut many = alone.clone();
    many.threads = Threads::new(4).expect("threads");
    let (mut app, ..) = app_of(&alone);
    let mut by_schedules = app_with(|app| {
        app.add_systems(SolveSchedule, idle.in_set(SolvePhase::User));
    });
    plain::spawn(by_schedules.world_mut(), &alone);
    ticks(&mut app, 30);
    let snapshot = |world: &mut App| {
        let snapshot = Snapshot::take(world, About::default()).expect("between ticks");
        Snapshot::from_bytes(&snapshot.to_bytes()).expect("what was written is read")
    };
    let mut restored = headless(&snapshot(app.world_mut()).built);
    ticks(&mut app, 30);
    ticks(&mut restored, 30);
    ticks(&mut by_schedules, 60);
    run(&mut alone, 1.0);
    run(&mut many, 1.0);
    let state = |world: &World| {
        let body = &world.bodies[0];
        (
            bits(&body.particles.positions),
            body.stitches.all().to_vec(),
        )
    };
    let broken = alone.bodies[0].stitches.broken();
    assert!(broken > 0 && broken < 16, "{broken} are broken");
    assert!(state(&alone) == state(&many), "by threads");
    for (app, how) in [
        (&mut app, "by Bevy"),
        (&mut by_schedules, "by its schedules"),
        (&mut restored, "from a snapshot"),
    ] {
        assert!(
            state(&alone) == state(&plain::capture(app.world_mut())),
            "{how}"
        );
    }
}

/// A user system, because of which substeps run by their schedules.
fn idle() {}

#[test]
fn removing_a_collider_releases_its_stitches() {
    let rope = body("rope", chain(1, 0.1), 1.0);
    let ends = [0, 1].map(|number| {
        let place = Vec3::Y * -0.1 * number as f32;
        let to = StitchEnd::Collider { number, place };
        stitch(at(&[(number, 1.0)]), to, 0.0, f32::INFINITY)
    });
    let mut world = world(settings(G, 60.0, 10, 1), stitched(rope, &ends));
    world.colliders = vec![hook(), hook()];
    let (mut app, bodies, colliders) = app_of(&world);
    ticks(&mut app, 5);
    app.world_mut().despawn(colliders[0]);
    ticks(&mut app, 5);
    let body = app.world().entity(bodies[0]);
    let stitches = body.get::<Stitches>().expect("it is stitched");
    let [first, second] = stitches.all() else {
        panic!("two stitches");
    };
    assert!(first.broken && !second.broken);
    assert!(matches!(second.to, StitchEnd::Collider { number: 0, .. }));
}

/// The last corner of a sheet is stitched to the middle of its first triangle. Within their
/// thickness self-contact would hold them apart, against the stitch.
#[test]
fn stitched_points_have_no_contact_until_the_stitch_breaks() {
    let mut sheet = crate::solver_tangles::sheet(Vec3::ZERO);
    let particle = |vertex: u32| sheet.topology.particle(VertexIndex(vertex)) as u32;
    let (corner, triangle) = (particle(168), [0, 1, 14].map(particle));
    let point = at(&triangle.map(|it| (it, 1.0)));
    let to = StitchEnd::Point(at(&[(corner, 1.0)]));
    sheet = stitched(sheet, &[stitch(point, to, 0.0, 1e9)]);
    sheet.effects.ground = None;
    sheet.effects.stretch.as_mut().expect("cloth").damping = damping(0.02);
    let thickness = 0.01;
    sheet.effects.self_contact = Some(SelfContact {
        thickness: ContactThickness::new(thickness as f32).expect("sound"),
        ..SelfContact::default()
    });
    let gap = |world: &World| {
        let x = &world.bodies[0].particles;
        let middle = triangle.map(|it| x.position(it as usize));
        let middle = middle.into_iter().sum::<DVec3>() / 3.0;
        middle.distance(x.position(corner as usize))
    };
    let mut world = world(settings(0.0, 60.0, 10, 1), sheet);
    // Folds beside the corner hold it off for up to 3.5 s, until they slip.
    for _ in 0..300 {
        world.tick();
        assert_eq!(world.crossings(), 0);
    }
    // The stitch is solved last but for contact: rounding of positions within 1 m.
    let held = gap(&world);
    assert!(held < 1e-6, "{held} m of {thickness} m");

    let mut broken = world.bodies[0].stitches.all()[0];
    broken.broken = true;
    let body = world.bodies.remove(0);
    world.bodies.push(stitched(body, &[broken]));
    for _ in 0..120 {
        world.tick();
    }
    assert_eq!(world.crossings(), 0);
    assert!(gap(&world) > 0.9 * thickness, "{} m", gap(&world));
}
