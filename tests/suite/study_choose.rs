//! Choosing a setting for a goal, against trying all of them.

use pliant::{
    scene::Scene,
    scene::registry::SCENES,
    solver::World,
    study::{Choice, Goal, Probe, Setting, choose, choose_from},
};
use std::ops::ControlFlow;

/// Scenes that differ in what is hard about them: stiff, soft, heavy on light, contacts, no
/// volumes, no edges that matter. Not among them is `bounce`: what bounces does so at the end of a
/// substep, and whether that is near the true time is luck, so its error does not fall steadily.
const CHOSEN: [&str; 10] = [
    "jelly_cube",
    "hanging_chain",
    "rope",
    "cantilever",
    "mirrored",
    "compliance_ladder",
    "squashed",
    "slope",
    "edges_and_volume",
    "colliders",
];

/// For how long each is continued [s].
const SECONDS: f64 = 0.1;

/// Sweeps a tick of the costliest setting among all.
const MOST: u32 = 24;

/// A scene after a second, when nothing falls freely any more: there only f32 would be measured.
fn under_way(name: &str) -> World {
    let scene = SCENES.iter().find(|scene| scene.name == name);
    let scene = scene.expect("a built-in scene");
    let scene = Scene::parse(scene.name, scene.text).expect("sound");
    let mut world = scene.build().expect("sound").world;
    (0..60).for_each(|_| world.tick());
    world
}

fn probe(world: &World) -> Probe {
    let probe = Probe::new(world, SECONDS, &mut |_| ControlFlow::Continue(()));
    probe.expect("sound").expect("not stopped")
}

/// Sweeps and error of every setting of up to [`MOST`] sweeps a tick.
fn all(probe: &Probe) -> Vec<(u32, f64)> {
    let mut points = Vec::new();
    for iterations in [1, 2, 4, 8, 16] {
        for substeps in 1..=MOST / iterations {
            let point = probe.point(Setting::xpbd(substeps, iterations));
            points.push((substeps * iterations, point.expect("sound").error));
        }
    }
    points
}

fn chosen(probe: &Probe, goal: Goal) -> Choice {
    let choice = choose_from(probe, goal, |_| ControlFlow::Continue(()));
    choice.expect("sound").expect("it holds together")
}

/// What is chosen for an error costs at most 15 % more, in projections, than the best there is; what
/// is chosen for a price is within it, and at most 15 % more wrong than the best there is.
#[test]
fn what_is_chosen_is_nearly_the_best_of_all() {
    for name in CHOSEN {
        let probe = probe(&under_way(name));
        let points = all(&probe);
        let a_sweep = Setting::xpbd(1, 1).projections(probe.world());
        // Goals that can be reached: what these numbers of sweeps give.
        for price in [MOST, MOST / 3] {
            let affordable = points.iter().filter(|(sweeps, _)| *sweeps <= price);
            let least = affordable
                .map(|point| point.1)
                .fold(f64::INFINITY, f64::min);
            let choice = chosen(&probe, Goal::Projections(u64::from(price) * a_sweep));
            assert!(
                choice.projections_per_tick <= u64::from(price) * a_sweep
                    && choice.error <= 1.15 * least,
                "{name}, {price} sweeps: {least:.3e} can be had; {choice:?}"
            );

            // Not the least of all: that may be a stroke of luck.
            let plain = points.iter().filter(|(sweeps, _)| *sweeps == price);
            let plain = plain.map(|point| point.1).fold(0.0, f64::max);
            let good = points.iter().filter(|(_, error)| *error <= plain);
            let best = good.map(|point| point.0).min();
            let best = best.expect("the goal is the error of one of them");
            let choice = chosen(&probe, Goal::Error(plain));
            let sweeps = choice.setting.substeps * choice.setting.iterations;
            assert!(
                choice.met && choice.error <= plain && f64::from(sweeps) <= 1.15 * f64::from(best),
                "{name}, {plain:.3e}: {sweeps} sweeps, and the best has {best}; {choice:?}"
            );
        }
    }
}

#[test]
fn a_goal_out_of_reach_gives_the_nearest_and_says_so() {
    let probe = probe(&under_way("jelly_cube"));
    let choice = chosen(&probe, Goal::Error(1e-12));
    assert!(!choice.met && choice.error > 1e-12, "{choice:?}");
    let choice = chosen(&probe, Goal::Projections(1));
    assert!(!choice.met, "{choice:?}");
    assert_eq!(choice.setting, Setting::xpbd(1, 1));
}

#[test]
fn a_search_that_is_stopped_chooses_nothing() {
    let world = under_way("jelly_cube");
    let choice = choose(&world, SECONDS, Goal::Error(0.01), |_| {
        ControlFlow::Break(())
    });
    assert_eq!(choice.expect("sound"), None);
}
