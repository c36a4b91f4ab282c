//! Grabs of patches and pins, and colliders that are moved by hand.

use crate::{
    support,
    support_app::{app_of, cubes, done, push, ticks},
};
use bevy::prelude::*;
use pliant::{
    effect::Collide,
    mesh::Primitive,
    recording::{About, Recorder, Snapshot, replay},
    scene::{Scene, run::headless},
    simulation::{
        Action, EnergyLedger, Pins,
        plain::{self, bodies_in_order, colliders_in_order},
        state_hash,
    },
    solver::{
        self, ColliderShape, Grab, ParticleIndex, Particles, Pose, SurfacePoint, Threads,
        VertexIndex, contact::rotation, ledger::Ledger, reference,
    },
};

fn app(scene: &str) -> App {
    let scene = Scene::load(scene).expect("a built-in scene").scene;
    headless(&scene.build().expect("it builds"))
}

fn first(app: &mut App) -> Entity {
    bodies_in_order(app.world_mut())[0]
}

fn position(app: &App, body: Entity, vertex: VertexIndex) -> Vec3 {
    let entity = app.world().entity(body);
    let topology = entity
        .get::<pliant::simulation::SoftBody>()
        .expect("a body");
    let particles = entity.get::<Particles>().expect("a body");
    particles.position(topology.particle(vertex)).as_vec3()
}

fn brush(body: Entity, radius: f32, target: Vec3) -> Action {
    Action::Brush {
        body,
        point: SurfacePoint::new(&[(ParticleIndex(0), 1.0)]).expect("sound"),
        target,
        radius,
        stiffness: 1.0,
    }
}

fn pull(app: &mut App, action: Action) {
    let errors = done(app, action);
    assert!(errors.is_empty(), "{errors:?}");
}

/// Number of particles that are more than half as far from where they were as the farthest.
fn moved(app: &App, body: Entity, before: &[Vec3]) -> usize {
    let particles = app.world().get::<Particles>(body).expect("a body");
    let ways = before.iter().enumerate();
    let ways: Vec<f32> = ways
        .map(|(i, x)| particles.position(i).as_vec3().distance(*x))
        .collect();
    let farthest = ways.iter().copied().fold(0.0, f32::max);
    assert!(farthest > 0.01, "{farthest}");
    ways.iter().filter(|way| **way > 0.5 * farthest).count()
}

/// A cloth of 21 × 21 particles without weight, pulled up at one of them.
#[test]
fn a_brush_with_a_radius_moves_a_patch_and_not_a_spike() {
    let cloth = Primitive::Cloth {
        size: Vec2::ONE,
        cells: UVec2::splat(20),
        diagonals: Default::default(),
        shear: true,
    };
    let shape = cloth.build().expect("sound").shape;
    let mut body = support::body("cloth", shape, 0.2);
    body.effects.stretch = support::stretch(1e-3);
    let world = solver::World {
        settings: support::settings(0.0, 60.0, 4, 2),
        bodies: vec![body],
        ..solver::World::default()
    };
    let counts = [0.0, 0.25].map(|radius| {
        let (mut app, bodies, _) = app_of(&world);
        let before: Vec<Vec3> = {
            let particles = app.world().get::<Particles>(bodies[0]).expect("a body");
            (0..particles.len())
                .map(|i| particles.position(i).as_vec3())
                .collect()
        };
        let target = before[0] + Vec3::Y * 0.2;
        push(&mut app, brush(bodies[0], radius, target));
        ticks(&mut app, 2);
        moved(&app, bodies[0], &before)
    });
    // The weights (1 − r²/R²)² are above one half where r < 0.54 R: 0.135 m or 2.7 cells, which is at
    // least the quarter disk of a corner with 8 particles. Elasticity and one tick of motion take
    // from its rim, so that half of them is asked for.
    assert!(counts[0] <= 2 && counts[1] >= 4, "{counts:?}");
}

#[test]
fn a_brush_of_no_radius_and_usual_stiffness_is_a_grab_to_the_bit() {
    let hashes = [true, false].map(|brushes| {
        let (mut app, bodies, _) = app_of(&cubes());
        let target = Vec3::new(0.2, 1.0, 0.3);
        let action = match brush(bodies[0], 0.0, target) {
            action if brushes => action,
            Action::Brush {
                body,
                point,
                target,
                ..
            } => Action::Grab {
                body,
                point,
                target,
            },
            other => other,
        };
        pull(&mut app, action);
        ticks(&mut app, 60);
        state_hash(app.world_mut())
    });
    assert_eq!(hashes[0], hashes[1]);
}

#[test]
fn a_brush_out_of_range_is_refused_with_the_range() {
    let (mut app, bodies, _) = app_of(&cubes());
    for (radius, stiffness, word) in [
        (-1.0, 1.0, "grab radius"),
        (f32::NAN, 1.0, "grab radius"),
        (0.1, 0.0, "grab stiffness"),
    ] {
        let mut action = brush(bodies[0], radius, Vec3::Y);
        if let Action::Brush { stiffness: it, .. } = &mut action {
            *it = stiffness;
        }
        let errors = done(&mut app, action);
        assert!(errors[0].to_string().contains(word), "{errors:?}");
    }
    assert!(app.world().get::<Grab>(bodies[0]).is_none());
    let vertex = VertexIndex(0);
    let body = bodies[0];
    let errors = done(&mut app, Action::GrabPins { body, vertex });
    assert!(errors[0].to_string().contains("not pinned"), "{errors:?}");
}

/// Fast solver and reference differ by rounding alone: 20 substeps of a cube at 1 m.
#[test]
fn patches_and_pins_equal_the_reference() {
    let (mut app, bodies, _) = app_of(&cubes());
    let [body, other] = [bodies[0], bodies[1]];
    pull(&mut app, brush(body, 0.3, Vec3::new(0.3, 1.0, 0.2)));
    let vertex = VertexIndex(1);
    pull(
        &mut app,
        Action::Pin {
            body: other,
            vertex,
        },
    );
    ticks(&mut app, 1);
    pull(
        &mut app,
        Action::GrabPins {
            body: other,
            vertex,
        },
    );
    let target = position(&app, other, vertex) + Vec3::new(0.02, 0.05, 0.01);
    pull(
        &mut app,
        Action::MovePins {
            body: other,
            target,
            seconds: 0.03,
        },
    );
    let mut plain = plain::capture(app.world_mut());
    let mut reference = reference::World::of(&plain);
    for _ in 0..2 {
        ticks(&mut app, 1);
        plain.tick();
        reference.tick();
    }
    assert_eq!(plain.state_hash(), state_hash(app.world_mut()));
    for (body, exact) in plain.bodies.iter().zip(&reference.bodies) {
        for (i, x) in exact.x.iter().enumerate() {
            let off = body.particles.position(i).distance(*x);
            assert!(off < 2e-5, "{}: particle {i} is {off} m off", body.name);
        }
    }
}

#[test]
fn a_pin_is_dragged_at_constant_velocity_and_stays_where_it_is_put() {
    let (mut app, bodies, _) = app_of(&cubes());
    let (body, vertex) = (bodies[0], VertexIndex(3));
    pull(&mut app, Action::Pin { body, vertex });
    ticks(&mut app, 10);
    pull(&mut app, Action::GrabPins { body, vertex });
    let start = position(&app, body, vertex);
    let target = start + Vec3::new(0.3, 0.12, 0.0);
    let seconds = 6.0 / 60.0;
    push(
        &mut app,
        Action::MovePins {
            body,
            target,
            seconds,
        },
    );
    for step in 1..=6 {
        ticks(&mut app, 1);
        let expected = start.lerp(target, step as f32 / 6.0);
        let off = position(&app, body, vertex).distance(expected);
        assert!(off < 1e-5, "{off} m off after {step} ticks");
    }
    pull(&mut app, Action::Release { body });
    ticks(&mut app, 30);
    assert!(position(&app, body, vertex).distance(target) < 1e-5);
    let pins = app.world().get::<Pins>(body).expect("it has them");
    assert_eq!(pins.0, [vertex]);
}

#[test]
fn connected_pins_move_together_and_others_stay() {
    let mut app = app("cloth_lab");
    let body = first(&mut app);
    for vertex in app.world().get::<Pins>(body).expect("pins").0.clone() {
        push(&mut app, Action::Unpin { body, vertex });
    }
    let topology = app
        .world()
        .get::<pliant::simulation::SoftBody>(body)
        .expect("a body")
        .0
        .clone();
    let [a, b] = topology.edges.ends().next().expect("edges");
    let far = (0..topology.particles())
        .max_by(|i, j| {
            let far = |i: &usize| topology.rest[*i].distance(topology.rest[a as usize]);
            far(i).total_cmp(&far(j))
        })
        .expect("particles");
    let vertices = [a as usize, b as usize, far].map(|particle| topology.vertex(particle));
    for vertex in vertices {
        push(&mut app, Action::Pin { body, vertex });
    }
    ticks(&mut app, 1);
    let before = vertices.map(|vertex| position(&app, body, vertex));
    let way = Vec3::new(0.0, 0.05, 0.02);
    pull(
        &mut app,
        Action::GrabPins {
            body,
            vertex: vertices[0],
        },
    );
    let target = before[0] + way;
    pull(
        &mut app,
        Action::MovePins {
            body,
            target,
            seconds: 0.0,
        },
    );
    ticks(&mut app, 1);
    for (vertex, (before, way)) in
        vertices
            .into_iter()
            .zip(before.into_iter().zip([way, way, Vec3::ZERO]))
    {
        let off = position(&app, body, vertex).distance(before + way);
        assert!(off < 1e-6, "vertex {vertex}: {off}");
    }
}

/// Two springs of 1 m in a row are stretched by 0.1 m at a pin: they store ½C²/α = 2.5 J, and the
/// mass between them swings with up to a quarter of that.
#[test]
fn work_of_dragged_pins_is_booked_as_work_of_the_grab() {
    let mut springs = support::body_of_masses(support::chain(2, 1.0), &[1.0, 0.01, 1.0]);
    springs.effects.stretch = support::stretch(1e-3);
    springs.pins = vec![VertexIndex(0), VertexIndex(2)];
    springs.update_masses();
    let world = solver::World {
        settings: support::settings(0.0, 60.0, 20, 1),
        bodies: vec![springs],
        ..solver::World::default()
    };
    let (mut app, bodies, _) = app_of(&world);
    let (body, vertex) = (bodies[0], VertexIndex(2));
    app.insert_resource(EnergyLedger::kept(true));
    ticks(&mut app, 1);
    push(&mut app, Action::GrabPins { body, vertex });
    let way = position(&app, body, vertex) - position(&app, body, VertexIndex(0));
    let target = position(&app, body, vertex) + 0.1 * way.normalize();
    let seconds = 0.5;
    push(
        &mut app,
        Action::MovePins {
            body,
            target,
            seconds,
        },
    );
    ticks(&mut app, 40);
    let ledger = app.world().resource::<EnergyLedger>();
    assert!(ledger.change() > 2.4, "{ledger:?}");
    let Ledger {
        grab, convergence, ..
    } = ledger.solver;
    assert!((grab / ledger.change() - 1.0).abs() < 0.1, "{ledger:?}");
    assert!(convergence.abs() < 0.1 * grab, "{ledger:?}");
}

#[test]
fn a_collider_that_is_dragged_pushes_bodies_and_does_not_tunnel() {
    let (mut app, bodies, _) = app_of(&cubes());
    let body = bodies[0];
    let effect = String::from("collide");
    pull(&mut app, Action::AddEffect { body, effect });
    assert!(app.world().get::<Collide>(body).is_some());
    ticks(&mut app, 60);
    let middle = |app: &App| {
        let particles = app.world().get::<Particles>(body).expect("a body");
        let sum: Vec3 = particles.positions.iter().map(|x| x.truncate()).sum();
        sum / particles.len() as f32
    };
    let start = middle(&app);
    let at = |x: f32| Pose::at((start + Vec3::X * x).as_dvec3());
    let size = Vec3::new(0.1, 2.0, 2.0);
    let shape = ColliderShape::Box { size };
    pull(
        &mut app,
        Action::AddCollider {
            shape,
            pose: at(-1.5),
        },
    );
    let collider = *colliders_in_order(app.world_mut()).last().expect("added");
    // A way of 2.5 m in a sixth of a second, through the body.
    let drag = Action::SetCollider {
        collider,
        shape: None,
        pose: at(1.0),
        seconds: 1.0 / 6.0,
    };
    pull(&mut app, drag);
    ticks(&mut app, 15);
    let end = middle(&app);
    assert!(end.x > start.x + 1.0, "from {start} to {end}");
}

#[test]
fn a_collider_with_bad_values_is_refused() {
    let (mut app, ..) = app_of(&cubes());
    let sphere = |radius| ColliderShape::Sphere { radius };
    let add = |shape, pose| Action::AddCollider { shape, pose };
    let mut turned = Pose::default();
    turned.rotation.x_axis *= 2.0;
    let far = Pose::at(bevy::math::DVec3::splat(f64::INFINITY));
    for (action, word) in [
        (add(sphere(0.0), Pose::default()), "0"),
        (add(sphere(f32::NAN), Pose::default()), "NaN"),
        (
            add(sphere(1.0), turned),
            "deviation of the matrix from a rotation",
        ),
        (add(sphere(1.0), far), "position is inf"),
    ] {
        let errors = done(&mut app, action);
        assert!(errors[0].to_string().contains(word), "{errors:?}");
    }
    assert!(colliders_in_order(app.world_mut()).is_empty());
    let collider = app.world_mut().spawn_empty().id();
    let errors = done(&mut app, Action::RemoveCollider { collider });
    assert!(
        errors[0].to_string().contains("no such collider"),
        "{errors:?}"
    );
}

/// Does one action of each kind at its tick.
fn session(app: &mut App, from: u64, to: u64) {
    for tick in from..to {
        let body = bodies_in_order(app.world_mut())[0];
        let vertex = VertexIndex(2);
        let colliders = colliders_in_order(app.world_mut());
        let pose = |x: f64, angle: f64| Pose {
            rotation: rotation(bevy::math::DVec3::Y, angle),
            translation: bevy::math::DVec3::new(x, 0.3, 0.1),
        };
        match tick {
            2 => push(app, brush(body, 0.2, Vec3::new(0.1, 0.9, 0.1))),
            12 => push(app, Action::Release { body }),
            13 => push(app, Action::Pin { body, vertex }),
            14 => push(app, Action::GrabPins { body, vertex }),
            15..=25 => {
                let target = Vec3::new(0.1, 0.8, 0.02 * tick as f32);
                push(
                    app,
                    Action::MovePins {
                        body,
                        target,
                        seconds: 0.07,
                    },
                );
            }
            26 => push(app, Action::Release { body }),
            27 => {
                let shape = ColliderShape::Sphere { radius: 0.1 };
                push(
                    app,
                    Action::AddCollider {
                        shape,
                        pose: pose(-0.6, 0.0),
                    },
                );
            }
            28..=40 => push(
                app,
                Action::SetCollider {
                    collider: *colliders.last().expect("added"),
                    shape: (tick == 30).then_some(ColliderShape::Box {
                        size: Vec3::splat(0.2),
                    }),
                    pose: pose(-0.6 + 0.05 * (tick - 28) as f64, 0.1 * tick as f64),
                    seconds: 0.04,
                },
            ),
            42 => push(
                app,
                Action::RemoveCollider {
                    collider: colliders[0],
                },
            ),
            _ => {}
        }
        ticks(app, 1);
    }
}

#[test]
fn recordings_and_snapshots_of_hands_go_on_to_the_bit() {
    let path = std::env::temp_dir().join(format!("pliant-hands-{}", std::process::id()));
    let mut app = app("colliders");
    Recorder::create(&path).expect("a file").install(&mut app);
    Recorder::scene_opened(app.world_mut(), About::default());
    session(&mut app, 0, 60);
    Recorder::end(app.world_mut());
    let played = replay(&path, &Threads::default(), |_| ()).expect("it replays");
    let text = std::fs::read_to_string(&path).expect("text");
    std::fs::remove_file(&path).expect("removed");
    for word in [
        "Brush",
        "GrabPins",
        "MovePins",
        "AddCollider",
        "SetCollider",
        "RemoveCollider",
    ] {
        assert!(text.contains(word), "{word} is not in the recording");
    }
    assert_eq!(played.difference, None);
    assert_eq!(played.state_hash, state_hash(app.world_mut()));

    for middle in [6, 20, 33] {
        let mut whole = self::app("colliders");
        session(&mut whole, 0, middle);
        let snapshot = Snapshot::take(whole.world_mut(), About::default()).expect("between ticks");
        let bytes = snapshot.to_bytes();
        let snapshot = Snapshot::from_bytes(&bytes).expect("it is read");
        let mut again = headless(&snapshot.built);
        session(&mut whole, middle, 60);
        session(&mut again, middle, 60);
        let [a, b] = [&mut whole, &mut again].map(|app| plain::capture(app.world_mut()));
        assert_eq!(a.state_hash(), b.state_hash(), "from tick {middle}");
        assert_eq!(a.colliders, b.colliders, "from tick {middle}");
    }
}
