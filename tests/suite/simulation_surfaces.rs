//! Messages when bodies begin and cease to touch colliders and the ground, and the same in runs of
//! scenes.

use crate::{
    support::{body, cube, damping, elastic, settings, stretch, with},
    support_app::{app_of, ticks},
};
use bevy::{app::App, ecs::message::Messages, prelude::Entity};
use glam::{DVec3, Vec3};
use pliant::{
    output::json,
    scene::{
        Scene,
        run::{Run, RunOptions, run},
    },
    simulation::{
        Asleep, BodyContacts, ContactSurface, Quarantined, RecordContacts, SurfaceContactEnded,
        SurfaceContactStarted,
    },
    solver::{
        Body, Collide, Collider, ColliderShape, Contact, Effects, Ground, Particles, Pose, Threads,
        World,
    },
};

/// A damped cube at a height of its center [m].
fn jelly(height: f32, effects: Effects) -> Body {
    let effects = Effects {
        stretch: stretch(1e-5),
        ..effects
    };
    let mut body = with(body("jelly", cube(0.3, 2), 1000.0), effects);
    if let Some(stretch) = &mut body.effects.stretch {
        stretch.damping = damping(0.02);
    }
    body.translate(Vec3::Y * height);
    body
}

/// A cube that falls on the ground, and one that falls on a table beside it.
fn two_landings() -> World {
    let on_table = Effects {
        collide: Some(Collide::default()),
        ..elastic()
    };
    let on_ground = Effects {
        ground: Some(Ground::default()),
        ..elastic()
    };
    let table = ColliderShape::Box {
        size: Vec3::new(2.0, 1.0, 2.0),
    };
    let table = Collider::new(table, Pose::at(DVec3::new(5.0, 0.5, 0.0))).expect("sound");
    let mut lifted = jelly(1.3, on_table);
    lifted.translate(Vec3::X * 5.0);
    World {
        settings: settings(9.81, 60.0, 10, 1),
        bodies: vec![jelly(0.3, on_ground), lifted],
        colliders: vec![table],
        ..World::default()
    }
}

type Touches = Vec<(Entity, ContactSurface)>;

/// The messages since the last call: begun and ended.
fn messages(app: &mut App) -> (Touches, Touches) {
    let world = app.world_mut();
    let mut started = world.resource_mut::<Messages<SurfaceContactStarted>>();
    let started = started.drain().map(|it| (it.body, it.surface)).collect();
    let mut ended = world.resource_mut::<Messages<SurfaceContactEnded>>();
    (
        started,
        ended.drain().map(|it| (it.body, it.surface)).collect(),
    )
}

/// An app in which both cubes lie and sleep, and what they touch.
fn asleep() -> (App, Touches) {
    let world = two_landings();
    let (mut app, bodies, colliders) = app_of(&world);
    app.insert_resource(RecordContacts(true));
    let touches = vec![
        (bodies[0], ContactSurface::Ground),
        (bodies[1], ContactSurface::Collider(colliders[0])),
    ];
    let mut open = Touches::new();
    for _ in 0..600 {
        ticks(&mut app, 1);
        let (started, ended) = messages(&mut app);
        // They may bounce.
        open.retain(|it| !ended.contains(it));
        assert!(
            started
                .iter()
                .all(|it| touches.contains(it) && !open.contains(it))
        );
        open.extend(started);
        for it in app.world().resource::<BodyContacts>().surfaces() {
            assert!(
                open.contains(&(it.body, it.surface)),
                "a force without a contact"
            );
        }
    }
    let sleeps = |body: &Entity| app.world().get::<Asleep>(*body).is_some();
    assert!(bodies.iter().all(sleeps), "at rest for 9 s");
    open.sort();
    let mut expected = touches.clone();
    expected.sort();
    assert_eq!(open, expected, "also over ticks in which they sleep");
    (app, touches)
}

#[test]
fn a_body_that_wakes_goes_on_touching_and_one_that_is_lifted_does_not() {
    let (mut app, touches) = asleep();
    let shift = |app: &mut App, body: Entity, by: f64| {
        let mut particles = app.world_mut().get_mut::<Particles>(body).expect("a body");
        for i in 0..particles.len() {
            let moved = particles.position(i) + DVec3::Y * by;
            particles.set_position(i, moved);
        }
    };
    shift(&mut app, touches[0].0, -1e-5);
    shift(&mut app, touches[1].0, 1.0);
    ticks(&mut app, 1);
    assert!(app.world().get::<Asleep>(touches[0].0).is_none());
    assert_eq!(messages(&mut app), (vec![], vec![touches[1]]));
    ticks(&mut app, 60);
    // It fell back, and may have bounced.
    let (started, ended) = messages(&mut app);
    assert!(started.iter().chain(&ended).all(|it| *it == touches[1]));
    assert_eq!(started.len(), ended.len() + 1);
}

#[test]
fn a_body_that_is_hit_in_its_sleep_goes_on_touching_the_ground() {
    let on_ground = Effects {
        ground: Some(Ground::default()),
        contact: Some(Contact::default()),
        ..elastic()
    };
    let mut beside = jelly(0.3, on_ground);
    beside.translate(Vec3::X * 5.0);
    let world = World {
        settings: settings(9.81, 60.0, 10, 1),
        bodies: vec![jelly(0.3, on_ground), beside],
        ..World::default()
    };
    let (mut app, bodies, _) = app_of(&world);
    app.insert_resource(RecordContacts(true));
    ticks(&mut app, 600);
    let sleeps = |app: &App, body: Entity| app.world().get::<Asleep>(body).is_some();
    assert!(bodies.iter().all(|body| sleeps(&app, *body)));
    messages(&mut app);

    // The other one is let go a centimeter above it.
    let mut particles = app
        .world_mut()
        .get_mut::<Particles>(bodies[1])
        .expect("a body");
    for i in 0..particles.len() {
        let above = particles.position(i) + DVec3::new(-5.0, 0.31, 0.0);
        particles.set_position(i, above);
    }
    let mut woke = None;
    for tick in 0..60 {
        ticks(&mut app, 1);
        let (started, ended) = messages(&mut app);
        if !sleeps(&app, bodies[0]) {
            woke.get_or_insert(tick);
        }
        let touches = (bodies[0], ContactSurface::Ground);
        assert!(!started.contains(&touches), "tick {tick}");
        assert!(!ended.contains(&touches), "tick {tick}");
    }
    assert!(woke.is_some(), "it was hit");
}

#[test]
fn contacts_end_with_the_body_the_collider_the_effect_and_the_recording() {
    let ends = |change: &dyn Fn(&mut App, Entity, ContactSurface), number: usize| {
        let (mut app, touches) = asleep();
        let (body, surface) = touches[number];
        change(&mut app, body, surface);
        ticks(&mut app, 1);
        assert_eq!(messages(&mut app), (vec![], vec![touches[number]]));
        let left = app.world().resource::<BodyContacts>().surfaces();
        assert_eq!(left.filter(|it| it.body == body).count(), 0);
        ticks(&mut app, 5);
        assert_eq!(messages(&mut app), (vec![], vec![]));
    };
    let despawn = |app: &mut App, entity| {
        app.world_mut().despawn(entity);
    };
    ends(&|app, body, _| despawn(app, body), 0);
    let collider = |app: &mut App, _, surface| match surface {
        ContactSurface::Collider(entity) => despawn(app, entity),
        ContactSurface::Ground => panic!("it lies on a table"),
    };
    ends(&collider, 1);
    let groundless = |app: &mut App, body: Entity, _| {
        app.world_mut().entity_mut(body).remove::<Ground>();
    };
    ends(&groundless, 0);
    let diverged = |app: &mut App, body: Entity, _| {
        let mut particles = app.world_mut().get_mut::<Particles>(body).expect("a body");
        particles.set_velocity(0, Vec3::X * 1e30);
        ticks(app, 1);
        assert!(app.world().get::<Quarantined>(body).is_some());
    };
    ends(&diverged, 1);

    let (mut app, touches) = asleep();
    app.insert_resource(RecordContacts(false));
    ticks(&mut app, 1);
    let mut expected = touches;
    expected.sort();
    assert_eq!(messages(&mut app), (vec![], expected));
}

#[test]
fn nothing_is_reported_unless_contacts_are_recorded() {
    let (mut app, ..) = app_of(&two_landings());
    ticks(&mut app, 120);
    assert_eq!(messages(&mut app), (vec![], vec![]));
    assert_eq!(app.world().resource::<BodyContacts>().surfaces().count(), 0);
}

fn run_of(scene: &str, seconds: f64, contacts: bool, threads: usize) -> Run {
    let built = Scene::load(scene).expect("built in").scene.build();
    let options = RunOptions {
        seconds: Some(seconds),
        contacts,
        threads: Some(Threads::new(threads).expect("some threads")),
        ..RunOptions::default()
    };
    run(&built.expect("sound"), &options, |_| ()).expect("nothing is set")
}

/// Scenes with bodies that tear, are emitted and removed, grains that come and go, sticky ground and
/// colliders of every shape: the state is the same with and without, and the forces on two threads.
#[test]
fn recording_changes_no_bit_of_scenes_in_which_bodies_change() {
    let threads = if cfg!(feature = "parallel") { 2 } else { 1 };
    for (scene, seconds) in [
        ("dispenser", 2.0),
        ("hourglass", 0.3),
        ("sticky", 1.5),
        ("colliders", 1.0),
        ("torn_jelly", 1.0),
    ] {
        let with = run_of(scene, seconds, true, 1);
        let without = run_of(scene, seconds, false, 1);
        assert_eq!(with.state_hash, without.state_hash, "{scene}");
        assert!(without.touched_surfaces.is_empty());
        let again = run_of(scene, seconds, true, threads);
        assert_eq!(with.touched_surfaces, again.touched_surfaces, "{scene}");
        assert!(
            !with.touched_surfaces.is_empty(),
            "{scene}: nothing touched"
        );
        for it in &with.touched_surfaces {
            assert!(it.seconds > 0.0 && it.seconds <= seconds + 1e-9);
            assert!(
                0.0 < it.mean_force && it.mean_force <= it.largest_force,
                "{it:?}"
            );
        }
    }
}

/// `run --json` says which body touched what: the cubes of this scene slide on the ground.
#[test]
fn a_run_as_json_has_the_surfaces_that_bodies_touched() {
    let done = run_of("sticky", 1.5, true, 1);
    let all = json::run("sticky", &done);
    let touched = all["touched_surfaces"].as_array().expect("a list");
    assert_eq!(touched.len(), done.touched_surfaces.len());
    for (it, of_run) in touched.iter().zip(&done.touched_surfaces) {
        assert_eq!(it["body"], of_run.body.as_str());
        assert!(it["collider"].is_null());
        assert_eq!(it["mean_force_n"], of_run.mean_force);
        assert_eq!(it["largest_force_n"], of_run.largest_force);
        assert_eq!(it["seconds"], of_run.seconds);
    }
    let on_colliders = run_of("colliders", 1.0, true, 1).touched_surfaces;
    let numbers = on_colliders.iter().filter_map(|it| it.collider);
    assert!(numbers.clone().count() > 0 && numbers.min() >= Some(1));
}
