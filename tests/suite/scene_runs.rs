//! Contracts of every built-in scene when it runs: it is accepted, it is the same with and without
//! Bevy, and the same in two runs.

use crate::support::state_bits;
use pliant::{
    scene::{
        Scene,
        registry::{self, BuiltinScene, SCENES},
        run::{RunOptions, headless, prepare, run, run_in},
    },
    simulation::plain,
    solver::{Body, Substeps, World, topology::bounds},
};
use std::{
    ops::ControlFlow,
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

/// Runs a check on every scene, on all cores, and fails with all problems found.
fn in_every_scene(find: impl Fn(&BuiltinScene, &Scene) -> Vec<String> + Sync) {
    let next = AtomicUsize::new(0);
    let found = Mutex::new(Vec::new());
    let threads = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some(builtin) = SCENES.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let scene = Scene::load(builtin.name).expect("a sound scene").scene;
                    let reasons = find(builtin, &scene);
                    let mut found = found.lock().expect("no other thread has failed");
                    found.extend(
                        reasons
                            .iter()
                            .map(|reason| format!("{}: {reason}", builtin.name)),
                    );
                }
            });
        }
    });
    let found = found.into_inner().expect("no thread has failed");
    assert!(found.is_empty(), "\n{}\n", found.join("\n"));
}

/// The acceptance of each scene holds after it ran; and Bevy's schedules and the plain loop are one
/// method: positions and velocities of all bodies are bit-identical, and the same bodies sleep.
#[test]
fn every_scene_is_accepted_and_the_same_to_the_bit_with_bevy_and_without() {
    in_every_scene(|_, scene| {
        let built = scene.build().expect("a sound scene");
        let options = scene.run_options();
        let mut app = headless(&built);
        prepare(&mut app, &options).expect("nothing is overridden");
        let mut alone = plain::capture(app.world_mut());
        let done = run_in(&mut app, &options, |_| {
            alone.tick();
            ControlFlow::Continue(())
        });
        let differences = differences(&done.world, &alone)
            .into_iter()
            .map(|body| format!("{body} differs without Bevy after {} s", alone.time));
        // Pieces of a torn body may fly apart.
        let whole = done
            .world
            .bodies
            .iter()
            .filter(|body| body.topology.splits() == 0 && !body.topology.is_renewed());
        let large = whole.filter(|body| growth(body) > MAX_GROWTH);
        let large =
            large.map(|body| format!("{} has {:.1} times its size", body.name, growth(body)));
        done.reasons
            .into_iter()
            .chain(large)
            .chain(differences)
            .collect()
    });
}

/// A body that is larger than this multiple of its size at rest fills the picture with shards. The
/// softest hanging bodies have 2.5 times their size.
const MAX_GROWTH: f32 = 4.0;

/// Size of a body over its size at rest.
fn growth(body: &Body) -> f32 {
    let now = body.particles.positions.iter().map(|x| x.truncate());
    let [now, rest] = [bounds(now), bounds(body.topology.rest.iter().copied())]
        .map(|(low, high)| (high - low).length());
    now / rest
}

/// Volumes alone without drag: the body runs apart, which its checks notice.
#[test]
fn a_body_that_runs_apart_fails_its_acceptance() {
    let text = registry::find("edges_and_volume").expect("built in").text;
    let without = text.replace("drag: (linear: 100),", "");
    assert_ne!(text, without);
    let scene: Scene = without.parse().expect("a sound scene");
    let built = scene.build().expect("a sound scene");
    let reasons = run(&built, &scene.run_options(), |_| ())
        .expect("nothing is overridden")
        .reasons
        .join("; ");
    assert!(reasons.contains("volume alone: has"), "{reasons}");
    assert!(reasons.contains("times its size at rest"), "{reasons}");
}

/// What the panel says of an effect, a run says too, once for all bodies that it holds for.
#[test]
fn notes_of_effects_name_their_bodies() {
    let text = r#"Scene(
        title: "Notes", look_at: "", bodies: [
            (name: "a", primitive: Rope(length: 1, segments: 4), effects: (stretch: (), tethers: ())),
            (name: "b", primitive: Rope(length: 1, segments: 4), effects: (stretch: (), tethers: ())),
            (name: "c", primitive: Rope(length: 1, segments: 4), pins: [Vertex(0)],
                effects: (stretch: (), tethers: (), force_mask: ())),
        ],
        acceptance: (seconds: 1, checks: []),
    )"#;
    let scene: Scene = text.parse().expect("sound");
    let built = scene.build().expect("sound");
    let options = RunOptions {
        seconds: Some(0.05),
        ..RunOptions::default()
    };
    let done = run(&built, &options, |_| ()).expect("nothing is overridden");
    assert_eq!(
        done.notes,
        [
            "force_mask of 'c': Does nothing: the body carries no force field.",
            "tethers of 'a' and 1 more: Tethers begin at pins, and the body has none.",
        ]
    );
}

/// The acceptance of a scene does not depend on its settings: it also holds with 10 and with 40
/// substeps per tick.
#[test]
fn every_scene_is_accepted_with_few_and_with_many_substeps() {
    in_every_scene(|_, scene| {
        let reasons = [10, 40].map(|substeps| {
            let mut built = scene.build().expect("a sound scene");
            built.world.settings.substeps = Substeps::new(substeps).expect("a number");
            let reasons = run(&built, &scene.run_options(), |_| ())
                .expect("nothing is overridden")
                .reasons;
            let named = reasons.into_iter();
            named.map(move |reason| format!("{substeps} substeps: {reason}"))
        });
        reasons.into_iter().flatten().collect()
    });
}

/// Names of the bodies whose state differs.
fn differences(one: &World, other: &World) -> Vec<String> {
    assert_eq!(one.bodies.len(), other.bodies.len(), "bodies were lost");
    one.bodies
        .iter()
        .zip(&other.bodies)
        .filter(|(a, b)| {
            state_bits(&a.particles) != state_bits(&b.particles) || a.asleep != b.asleep
        })
        .map(|(body, _)| body.name.clone())
        .collect()
}

/// A run does not depend on time, on addresses or on the order of a hash map.
#[test]
fn every_scene_run_twice_ends_with_the_same_hash() {
    in_every_scene(|_, scene| {
        let mut options = scene.run_options();
        options.acceptance = None;
        options.seconds = Some(0.5);
        let hash = || {
            let built = scene.build().expect("a sound scene");
            run(&built, &options, |_| ())
                .expect("nothing is overridden")
                .state_hash
        };
        let (first, second) = (hash(), hash());
        if first == second {
            Vec::new()
        } else {
            vec![format!("{first:016x} and then {second:016x}")]
        }
    });
}

/// A pinned particle does not move by a bit, even in a scene that shakes it, and a run that moves
/// one is not accepted.
#[test]
fn a_moved_pin_fails_the_acceptance() {
    let scene = Scene::load("hanging_chain").expect("a sound scene").scene;
    let world = scene.build().expect("a sound scene").world;
    let mut moved = world.clone();
    moved.bodies[0].particles.positions[0].x += f32::EPSILON;
    let acceptance = pliant::scene::Acceptance {
        seconds: 1.0,
        checks: Vec::new(),
    };
    assert_eq!(acceptance.judge(&world, &world, &[]), Vec::<String>::new());
    let reasons = acceptance.judge(&world, &moved, &[]);
    assert_eq!(reasons, ["no weight: 1 pinned particle moved"]);
}

#[test]
fn the_number_of_bodies_is_checked_for_all_and_by_name() {
    use pliant::scene::{Acceptance, Check};
    let scene = Scene::load("jelly_cube").expect("a sound scene").scene;
    let mut world = scene.build().expect("a sound scene").world;
    let names = ["a", "ring", "ring #1"].map(|name| {
        let mut body = world.bodies[0].clone();
        body.name = name.to_owned();
        body
    });
    world.bodies = names.into();
    let judged = |checks: Vec<Check>| {
        let acceptance = Acceptance {
            seconds: 1.0,
            checks,
        };
        acceptance.judge(&world, &world, &[])
    };
    let of_rings = |least, most| Check::Of("ring".to_owned(), vec![Check::Bodies(least, most)]);
    assert!(judged(vec![Check::Bodies(3, 3), of_rings(2, 2)]).is_empty());
    assert_eq!(
        judged(vec![Check::Bodies(4, 9), of_rings(3, 3)]),
        [
            "the number of bodies is 3, expected 4 to 9",
            "ring: the number of bodies is 2, expected 3 to 3"
        ]
    );
}

/// A check that compares with NaN fails.
#[test]
fn a_state_that_is_not_finite_fails_every_check_of_it() {
    use pliant::scene::{Acceptance, Check};
    let scene = Scene::load("jelly_cube").expect("a sound scene").scene;
    let world = scene.build().expect("a sound scene").world;
    let mut broken = world.clone();
    for x in &mut broken.bodies[0].particles.positions {
        x.y = f32::NAN;
    }
    for check in [
        Check::Volume(1e9),
        Check::Shape(1e9),
        Check::Height(0.0, 1e9),
        Check::EdgeStrain(1e9),
    ] {
        let acceptance = Acceptance {
            seconds: 1.0,
            checks: vec![check.clone()],
        };
        assert!(
            acceptance.judge(&world, &world, &[]).is_empty(),
            "{check:?} holds at first"
        );
        assert_eq!(
            acceptance.judge(&world, &broken, &[]).len(),
            1,
            "{check:?} of NaN"
        );
    }
}
