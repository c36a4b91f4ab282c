//! The schedule is the scene: systems of an effect are there while a body carries it, and only
//! then. Read from the schedules' own lists of systems.

use crate::{
    support::tetrahedron,
    support_app::{app, systems, ticks},
};
use bevy::prelude::*;
use pliant::{
    effect::{Collide, EffectRegistry, Grab, Ground, StickyGround, Stretch, Volume},
    simulation::{SoftBody, SolveSchedule, StepSchedule, SubstepSchedule},
    solver::SurfacePoint,
};

/// In the order in which they are registered.
const EFFECTS: [&str; 6] = [
    "stretch",
    "volume",
    "grab",
    "ground",
    "sticky_ground",
    "collide",
];

fn insert(body: &mut EntityWorldMut, effect: usize) {
    match EFFECTS[effect] {
        "stretch" => body.insert(Stretch::default()),
        "volume" => body.insert(Volume::default()),
        "ground" => body.insert(Ground::default()),
        "sticky_ground" => body.insert(StickyGround::default()),
        "collide" => body.insert(Collide::default()),
        _ => {
            let point = SurfacePoint::new(&[(0, 1.0)]).expect("sound");
            body.insert(Grab::on(point, Vec3::ZERO, 1.0, 1.0, 9.81))
        }
    };
}

fn remove(body: &mut EntityWorldMut, effect: usize) {
    match EFFECTS[effect] {
        "stretch" => body.remove::<Stretch>(),
        "volume" => body.remove::<Volume>(),
        "grab" => body.remove::<Grab>(),
        "ground" => body.remove::<Ground>(),
        "sticky_ground" => body.remove::<StickyGround>(),
        _ => body.remove::<Collide>(),
    };
}

/// What the sweep must hold, in this order: every effect but the ground that acts in presolve.
fn expected_sweep(present: &[bool; 6]) -> Vec<&'static str> {
    let acts = |&i: &usize| present[i] && EFFECTS[i] != "sticky_ground";
    (0..6).filter(acts).map(|i| EFFECTS[i]).collect()
}

fn expected_substep(present: &[bool; 6]) -> Vec<&'static str> {
    let mut systems = vec!["presolve", "solve", "postsolve"];
    if present[4] {
        systems.insert(1, EFFECTS[4]);
    }
    systems
}

/// What a tick must hold beside its own: each effect wakes sleepers when it changes, and two keep
/// multipliers.
fn expected_in_step(present: &[bool; 6]) -> Vec<&'static str> {
    let mut systems: Vec<_> = (0..6).filter(|&i| present[i]).map(|i| EFFECTS[i]).collect();
    systems.extend((0..2).filter(|&i| present[i]).map(|i| EFFECTS[i]));
    systems.sort_unstable();
    systems
}

#[track_caller]
fn assert_systems(app: &App, present: &[bool; 6], own: usize) {
    assert_eq!(systems(app, SolveSchedule), expected_sweep(present));
    assert_eq!(systems(app, SubstepSchedule), expected_substep(present));
    let mut in_step = systems(app, StepSchedule);
    // Bevy's own points of synchronisation between systems come and go with them.
    let others = in_step.iter().filter(|name| *name == "other").count();
    assert!(present.contains(&true) || others == own);
    in_step.retain(|name| name != "other");
    in_step.sort_unstable();
    assert_eq!(in_step, expected_in_step(present));
    for effect in app.world().resource::<EffectRegistry>().iter() {
        let index = EFFECTS.iter().position(|name| *name == effect.name);
        assert_eq!(effect.runs, present[index.expect("a known effect")]);
    }
}

/// From an empty app: effects come one by one and go one by one, in two orders.
fn come_and_go(subset: usize, order: impl Fn(usize) -> usize) {
    let mut app = app();
    ticks(&mut app, 1);
    let own = systems(&app, StepSchedule).len();
    let mut present = [false; 6];
    assert_systems(&app, &present, own);
    let topology = crate::support::topology(tetrahedron());
    let body = app.world_mut().spawn(SoftBody(topology)).id();
    let chosen: Vec<usize> = (0..6)
        .map(order)
        .filter(|i| subset & (1 << i) != 0)
        .collect();
    for &effect in &chosen {
        insert(&mut app.world_mut().entity_mut(body), effect);
        ticks(&mut app, 1);
        present[effect] = true;
        assert_systems(&app, &present, own);
    }
    for &effect in &chosen {
        remove(&mut app.world_mut().entity_mut(body), effect);
        ticks(&mut app, 1);
        present[effect] = false;
        assert_systems(&app, &present, own);
    }
}

#[test]
fn an_effect_that_nobody_carries_has_no_system_for_every_subset_of_effects() {
    for subset in 0..64 {
        come_and_go(subset, |i| i);
        come_and_go(subset, |i| 5 - i);
        come_and_go(subset, |i| (i * 5 + 2) % 6);
    }
}

#[test]
fn systems_stay_until_the_last_body_that_carries_the_effect_has_gone() {
    let mut app = app();
    let topology = crate::support::topology(tetrahedron());
    let body = (SoftBody(topology), Stretch::default());
    let bodies = [0, 1].map(|_| app.world_mut().spawn(body.clone()).id());
    ticks(&mut app, 1);
    app.world_mut().despawn(bodies[0]);
    ticks(&mut app, 1);
    assert_eq!(systems(&app, SolveSchedule), ["stretch"]);
    app.world_mut().despawn(bodies[1]);
    ticks(&mut app, 1);
    assert!(systems(&app, SolveSchedule).is_empty());
}

#[test]
fn an_effect_that_came_before_its_body_runs_with_it() {
    let mut app = app();
    let entity = app.world_mut().spawn(Stretch::default()).id();
    ticks(&mut app, 1);
    assert!(
        systems(&app, SolveSchedule).is_empty(),
        "an effect without a body"
    );
    let topology = crate::support::topology(tetrahedron());
    app.world_mut()
        .entity_mut(entity)
        .insert(SoftBody(topology));
    ticks(&mut app, 1);
    assert_eq!(systems(&app, SolveSchedule), ["stretch"]);
    app.world_mut().entity_mut(entity).remove::<SoftBody>();
    ticks(&mut app, 1);
    assert!(systems(&app, SolveSchedule).is_empty(), "no body any more");
}
