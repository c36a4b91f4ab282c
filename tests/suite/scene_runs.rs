//! Contracts of every built-in scene when it runs: it is accepted, it is the same with and without
//! Bevy, and its energy ledger adds up.

use crate::{simulation_ledger::largest, support::state_bits};
use pliant::{
    scene::{
        Scene,
        registry::{self, SCENES},
        run::{RunOptions, headless, prepare, run, run_in},
    },
    simulation::{EnergyLedger, Statistics, plain},
    solver::{Body, Substeps, World, topology::bounds},
};
use rayon::prelude::*;
use std::{env, ops::ControlFlow};

#[cfg(feature = "window")]
use pliant::simulation::SimulationClock;

/// Runs a check on every scene, on all cores, and fails with all problems found.
fn in_every_scene(find: impl Fn((usize, &str), &Scene) -> Vec<String> + Sync) {
    let scenes = SCENES.par_iter().enumerate().with_max_len(1);
    let found = scenes.flat_map_iter(|(number, builtin)| {
        let scene = Scene::load(builtin.name).expect("a sound scene").scene;
        let reasons = find((number, builtin.name), &scene).into_iter();
        reasons.map(|reason| format!("{}: {reason}", builtin.name))
    });
    let found: Vec<String> = found.collect();
    assert!(found.is_empty(), "\n{}\n", found.join("\n"));
}

/// For how many ticks one looks at a scene: eight seconds of most.
#[cfg(feature = "window")]
const LOOKED: u64 = 480;

/// One run of each scene with Bevy, and its first half second without:
///
/// - Its acceptance holds.
/// - Bevy's schedules and the plain loop are one method: positions and velocities of all bodies are
///   bit-identical after half a second, and the same bodies sleep. So a run depends neither on time,
///   nor on addresses, nor on the order of a hash map.
/// - The energy ledger, which the run with Bevy keeps for so long, changes no bit, and its rows add
///   up.
/// - For its first eight seconds most of its bodies are in view, and what has left it has a mark.
#[test]
fn every_scene_is_accepted_the_same_to_the_bit_with_bevy_and_without_and_in_view() {
    in_every_scene(|_, scene| {
        let built = scene.build().expect("a sound scene");
        let options = RunOptions {
            ledger: true,
            ..scene.run_options()
        };
        let mut app = headless(&built);
        prepare(&mut app, &options).expect("nothing is overridden");
        let mut alone = plain::capture(app.world_mut());
        let mut problems = Vec::new();
        let mut left = 30;
        #[cfg(feature = "window")]
        let mut view = crate::sandbox_framing::View::opening(scene, &built);
        let done = run_in(&mut app, &options, |fraction, world| {
            #[cfg(feature = "window")]
            match world.resource::<SimulationClock>().tick() {
                tick if tick == LOOKED || tick < LOOKED && fraction == 1.0 => {
                    view.see_last(&plain::capture(world));
                }
                tick if tick < LOOKED && tick % 30 == 0 => view.see(&plain::capture(world)),
                _ => (),
            }
            if left > 0 {
                alone.tick();
                left -= 1;
                if left == 0 || fraction == 1.0 {
                    let now = plain::capture(world);
                    let bodies = differing(&now, &alone).into_iter();
                    let at = |body| format!("{body} differs without Bevy after {} s", alone.time);
                    problems.extend(bodies.map(at));
                    problems.extend(unexplained(world, built.world.bodies.len(), &now));
                    world.insert_resource(EnergyLedger::kept(false));
                }
            }
            ControlFlow::Continue(())
        });
        #[cfg(feature = "window")]
        problems.extend(view.problems);
        // Pieces of a torn body may fly apart.
        let whole = done.world.bodies.iter().filter(|body| is_whole(body));
        let large = whole.filter(|body| growth(body) > MAX_GROWTH);
        let large =
            large.map(|body| format!("{} has {:.1} times its size", body.name, growth(body)));
        problems.extend(large);
        problems.extend(done.reasons);
        problems
    });
}

/// Whether a body has neither torn nor emitted.
pub fn is_whole(body: &Body) -> bool {
    body.topology.splits() == 0 && !body.topology.is_renewed()
}

/// What the rows of the energy ledger do not explain, in a run that began with this number of bodies:
/// sums are in f64, of the stored velocities, so that only their rounding remains.
fn unexplained(bevy: &mut bevy::prelude::World, bodies: usize, now: &World) -> Option<String> {
    let ledger = bevy.resource::<EnergyLedger>().clone();
    let scale = largest(&ledger);
    let gap = ledger.gap().abs();
    // Tears come after the tick of the ledger, and round the masses of copies anew; so do new
    // grains, which bring their energy.
    let are_whole = now.bodies.len() == bodies && now.bodies.iter().all(is_whole);
    let off = (ledger.now.sum() - Statistics::measure(bevy).energy()).abs();
    (gap > 1e-4 * scale || are_whole && off > 1e-12 * scale).then(|| {
        format!(
            "{gap:e} J of {scale:e} J in the ledger are unexplained, and it is off by {off:e} J"
        )
    })
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

/// The scenes that take more than half of the time of all.
const LONG: [&str; 9] = [
    "all_together",
    "bowl",
    "folds",
    "heap",
    "hourglass",
    "ring",
    "sheets",
    "sleeve",
    "torn_banner",
];

/// The acceptance of a scene does not depend on its settings: it also holds with 10 and with 40
/// substeps per tick. The suite runs every eighth scene, but the long ones, with one of the two by turns;
/// on demand, all with both, in some fifteen minutes:
///
/// ```sh
/// PLIANT_FUZZ=20 cargo test --release --test suite -- few_and_with_many
/// ```
#[test]
fn every_scene_is_accepted_with_few_and_with_many_substeps() {
    let runs_all = env::var_os("PLIANT_FUZZ").is_some();
    in_every_scene(|(number, name), scene| {
        if !runs_all && (number % 8 > 0 || LONG.contains(&name)) {
            return Vec::new();
        }
        let built = scene.build().expect("a sound scene");
        // With its own number, it is accepted above.
        let own = built.world.settings.substeps.get();
        let mut others = vec![10, 40];
        others.retain(|substeps| *substeps != own);
        if !runs_all {
            let other = others[number / 8 % others.len()];
            others = vec![other];
        }
        let reasons = others.into_iter().map(|substeps| {
            let mut built = built.clone();
            built.world.settings.substeps = Substeps::new(substeps).expect("a number");
            let reasons = run(&built, &scene.run_options(), |_| ())
                .expect("nothing is overridden")
                .reasons;
            let named = reasons.into_iter();
            named.map(move |reason| format!("{substeps} substeps: {reason}"))
        });
        reasons.flatten().collect()
    });
}

/// Names of the bodies whose state differs.
fn differing(one: &World, other: &World) -> Vec<String> {
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
