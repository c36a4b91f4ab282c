//! The schedule is the scene: systems of an effect are present while a body carries it, and only
//! then. Read from the schedules' own lists of systems.

use crate::{
    support::tetrahedron,
    support_app::{app, app_of, cubes, systems, systems_of_iteration, ticks},
};
use bevy::prelude::*;
use pliant::{
    effect::{
        Effect, EffectRegistry, ExternalForce, ExternalImpulse, Grab, Grabs, PinTargets, Sink,
        Stitches, Stretch,
    },
    simulation::{SoftBody, SolveSchedule, StepSchedule, SubstepSchedule, state_hash},
    solver::{Effects, Finite, ForceKind, ParticleIndex, Particles, SurfacePoint, deform::Random},
};

/// All effects that stay, in order of registration: impulses are removed by the tick that applies
/// them.
fn effects(app: &App) -> Vec<&'static str> {
    let registry = app.world().resource::<EffectRegistry>();
    let names = registry.iter().map(|effect| effect.name);
    names
        .filter(|name| *name != ExternalImpulse::NAME)
        .collect()
}

fn insert(app: &mut App, body: Entity, effect: &str) {
    let registry = app.world().resource::<EffectRegistry>();
    let default = registry.get(effect).expect("known").insert_default;
    let mut body = app.world_mut().entity_mut(body);
    match default {
        // Where nothing falls into it.
        _ if effect == Sink::NAME => {
            body.insert(Sink {
                y: Finite::of(-1000.0),
                ..Sink::default()
            });
        }
        Some(insert) => insert(&mut body),
        None if effect == Stitches::NAME => {
            body.insert(Stitches::default());
        }
        None if effect == ExternalForce::NAME => {
            body.insert(ExternalForce::default());
        }
        None if effect == PinTargets::NAME => {
            body.insert(PinTargets::default());
        }
        None if effect == Grabs::NAME => {
            body.insert(Grabs::default());
        }
        None => {
            let point = SurfacePoint::new(&[(ParticleIndex(0), 1.0)]).expect("sound");
            body.insert(Grab::on(point, Vec3::ZERO, 1.0, 1.0, 9.81));
        }
    }
}

fn remove(app: &mut App, body: Entity, effect: &str) {
    let registry = app.world().resource::<EffectRegistry>();
    let remove = registry.get(effect).expect("known").remove;
    remove(&mut app.world_mut().entity_mut(body));
}

/// The effect that runs at the end of the first stage instead of in the iteration.
const STICKY: &str = "sticky_ground";
/// The effect that runs at the end of a substep.
const PLASTIC: &str = "plasticity";
/// The effect with two systems.
const STITCHES: &str = "stitches";
/// The effect without a system: forces read it.
const MASK: &str = "force_mask";
/// They act between ticks, in systems that are always there.
const BETWEEN_TICKS: [&str; 4] = ["tear", "emitter", "body_emitter", "sink"];

/// Expected systems of a tick besides its own: each effect wakes sleeping bodies when it changes.
fn expected_in_step(present: &[&'static str]) -> Vec<&'static str> {
    let mut systems = present.to_vec();
    systems.sort_unstable();
    systems
}

#[track_caller]
fn assert_systems(app: &App, present: &[&'static str], own: usize) {
    let forces = ForceKind::ALL.map(ForceKind::name);
    let forces = [&forces[..], &[ExternalForce::NAME]].concat();
    let in_iteration = present
        .iter()
        .filter(|name| ![STICKY, PLASTIC, MASK].contains(name) && !BETWEEN_TICKS.contains(name))
        .filter(|name| !forces.contains(name) && **name != PinTargets::NAME);
    let mut in_iteration: Vec<_> = in_iteration.copied().collect();
    // Stitches have a second system, for those between bodies, after the last constraint.
    let constraints = in_iteration
        .iter()
        .rposition(|name| [STITCHES, "tethers"].contains(name));
    if let (true, Some(last)) = (in_iteration.contains(&STITCHES), constraints) {
        in_iteration.insert(last + 1, "joints");
    }
    // Several grabs act after stitches between bodies, before the pointer's grab.
    if let Some(place) = in_iteration.iter().position(|it| *it == Grabs::NAME) {
        in_iteration.remove(place);
        let later = [
            "grab",
            "rod",
            "contact",
            "self_contact",
            "grains",
            "ground",
            "collide",
        ];
        let next = in_iteration.iter().position(|it| later.contains(it));
        in_iteration.insert(next.unwrap_or(in_iteration.len()), Grabs::NAME);
    }
    assert_eq!(systems_of_iteration(app), in_iteration);
    let before = present.iter().filter(|name| forces.contains(name));
    let mut in_substep: Vec<_> = before.copied().collect();
    // The force of an app acts before the fields.
    in_substep.sort_by_key(|name| *name != ExternalForce::NAME);
    in_substep.push("presolve");
    in_substep.extend(
        present
            .contains(&PinTargets::NAME)
            .then_some(PinTargets::NAME),
    );
    in_substep.extend(present.contains(&STICKY).then_some(STICKY));
    in_substep.extend(["solve", "postsolve"]);
    in_substep.extend(present.contains(&PLASTIC).then_some(PLASTIC));
    assert_eq!(systems(app, SubstepSchedule), in_substep);
    let mut in_step = systems(app, StepSchedule);
    // Bevy's own synchronization points between systems vary with them.
    let others = in_step.iter().filter(|name| *name == "other").count();
    assert!(!present.is_empty() || others == own);
    in_step.retain(|name| name != "other");
    in_step.sort_unstable();
    assert_eq!(in_step, expected_in_step(present));
    for effect in app.world().resource::<EffectRegistry>().iter() {
        assert_eq!(effect.runs, present.contains(&effect.name));
    }
}

/// From an empty app: the effects with these indices are added one by one and removed one by one.
fn come_and_go(chosen: &[usize]) {
    let mut app = app();
    ticks(&mut app, 1);
    let all = effects(&app);
    let own = systems(&app, StepSchedule).len();
    let mut present = vec![false; all.len()];
    let names = |present: &[bool]| -> Vec<&'static str> {
        let both = all.iter().zip(present).filter(|(_, present)| **present);
        both.map(|(name, _)| *name).collect()
    };
    assert_systems(&app, &[], own);
    let topology = crate::support::topology(tetrahedron());
    let body = app.world_mut().spawn(SoftBody(topology)).id();
    for &effect in chosen {
        insert(&mut app, body, all[effect]);
        ticks(&mut app, 1);
        present[effect] = true;
        assert_systems(&app, &names(&present), own);
    }
    for &effect in chosen {
        remove(&mut app, body, all[effect]);
        ticks(&mut app, 1);
        present[effect] = false;
        assert_systems(&app, &names(&present), own);
    }
}

/// Each effect alone, each pair in both orders, every subset of stretch, bend and volume, and some
/// random ones.
#[test]
fn an_absent_effect_has_no_system_whichever_others_are_present() {
    let all = effects(&app());
    for one in 0..all.len() {
        for other in 0..one {
            // One order or the other.
            match (one + other) % 2 {
                0 => come_and_go(&[one, other]),
                _ => come_and_go(&[other, one]),
            }
        }
    }
    let place = |name| all.iter().position(|effect| *effect == name);
    let three = ["stretch", "bend", "volume"].map(|name| place(name).expect("known"));
    let mut random = Random::new(1);
    for subset in 0..8 {
        let chosen = |place: &usize| subset & (1 << *place) != 0;
        let mut chosen: Vec<usize> = (0..3).filter(chosen).map(|place| three[place]).collect();
        come_and_go(&chosen);
        chosen.extend((0..all.len()).filter(|place| !three.contains(place) && random.next() < 0.5));
        chosen.sort_by_key(|place| (place * 7 + 3 * subset) % 11);
        come_and_go(&chosen);
    }
}

/// Two cubes with effects, and a body without any, after some ticks; returns the entity of the
/// latter.
fn with_a_bare_cube() -> (App, Entity) {
    let mut world = cubes();
    let mut bare = world.bodies[0].clone();
    bare.name = "bare".to_owned();
    bare.effects = Effects::default();
    bare.translate(Vec3::X);
    world.bodies.push(bare);
    let (mut app, bodies, _) = app_of(&world);
    ticks(&mut app, 5);
    (app, bodies[2])
}

fn hash_later(mut app: App) -> u64 {
    ticks(&mut app, 20);
    state_hash(app.world_mut())
}

#[test]
fn an_effect_that_came_and_went_leaves_nothing_behind() {
    let state = |app: &App, body| app.world().get::<Particles>(body).expect("a body").clone();
    let (untouched, bare) = with_a_bare_cube();
    let kept = state(&untouched, bare);
    let never = hash_later(untouched);
    // Three ticks of the others, during which this one does not advance.
    let (mut held_back, bare) = with_a_bare_cube();
    ticks(&mut held_back, 3);
    held_back.world_mut().entity_mut(bare).insert(kept.clone());
    let never_acted = hash_later(held_back);
    for effect in effects(&app()) {
        let (mut app, bare) = with_a_bare_cube();
        insert(&mut app, bare, effect);
        remove(&mut app, bare, effect);
        assert_eq!(hash_later(app), never, "{effect}, between two ticks");

        let (mut app, bare) = with_a_bare_cube();
        insert(&mut app, bare, effect);
        ticks(&mut app, 3);
        remove(&mut app, bare, effect);
        app.world_mut().entity_mut(bare).insert(kept.clone());
        assert_eq!(hash_later(app), never_acted, "{effect}, for three ticks");
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
