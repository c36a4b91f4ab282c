//! The energy ledger: its rows add up, each row has its physical value, and tracking it changes no
//! bit.

use crate::{
    all_effects,
    solver_tangles::{jelly, sheet},
    support::{
        assert_relative, body, body_of_masses, chain, cube, damping, elastic_on_ground, pinned,
        point, settings, stretch, with, world,
    },
    support_app::{app_of, app_with, cubes, push, set, ticks},
};
use bevy::prelude::*;
use pliant::{
    scene::{Scene, run::headless},
    simulation::{Action, EnergyLedger, SolvePhase, SolveSchedule, Statistics, plain},
    solver::{
        self, Direct, Effects, Friction, Ground, ParticleIndex, Restitution, SurfacePoint, World,
        ledger::Ledger,
    },
};

fn track(app: &mut App) {
    app.insert_resource(EnergyLedger::kept(true));
}

fn ledger(app: &App) -> &EnergyLedger {
    app.world().resource::<EnergyLedger>()
}

/// The ledger of a world after some ticks.
pub fn kept(world: &World, count: usize) -> EnergyLedger {
    let (mut app, ..) = app_of(world);
    track(&mut app);
    ticks(&mut app, count);
    ledger(&app).clone()
}

/// The largest term of a ledger [J].
pub fn largest(ledger: &EnergyLedger) -> f64 {
    let held = [&ledger.start, &ledger.now].into_iter().flat_map(|held| {
        let elastic = held.elastic.values().copied();
        [held.kinetic, held.potential].into_iter().chain(elastic)
    });
    let rows = ledger.solver.rows().map(|(_, energy)| energy);
    held.chain(rows)
        .chain([ledger.torn, ledger.other])
        .fold(0.0, |largest, energy| largest.max(energy.abs()))
}

/// Energy and residual of a restored state are those of the state that was captured, and the balance holds
/// from there: the segments of a rod are part of it.
#[test]
fn a_restored_state_has_the_energy_of_the_captured_one() {
    for name in ["twisted_ring", "tree", "jelly_cube"] {
        let built = Scene::load(name).expect("built in").scene.build();
        let mut app = headless(&built.expect("sound"));
        ticks(&mut app, 60);
        let energy = |app: &mut App| Statistics::measure(app.world_mut()).energy();
        let expected = energy(&mut app);
        let (captured, places) = (
            plain::capture(app.world_mut()),
            plain::places(app.world_mut()),
        );
        let (mut other, ..) = app_of(&World::default());
        plain::restore(other.world_mut(), &captured, &places);
        let found = energy(&mut other);
        // The same sums of the same values.
        assert_eq!(found, expected, "{name}");
    }
}

/// A cube with the direct solver slides to rest.
#[test]
fn the_ledger_separates_the_work_of_the_direct_solver_by_cause() {
    let effects = Effects {
        direct: Some(Direct),
        ..elastic_on_ground()
    };
    let mut cube = with(body("cube", cube(0.3, 3), 300.0), effects);
    cube.translate(Vec3::new(0.0, 0.16, 0.0));
    cube.set_velocity(Vec3::new(0.5, 0.0, 0.0));
    let ledger = kept(&world(settings(9.81, 60.0, 4, 4), cube), 60);
    let gap = ledger.gap().abs() / largest(&ledger);
    assert!(gap < 1e-4, "{gap:e}: {ledger:?}");
    // Of ½ · 8.1 kg · (0.5 m/s)² most goes to friction. Rigid constraints dissipate the rest: they
    // drag along the layer on the ground, which friction has slowed down.
    let friction = -ledger.solver.friction / ledger.start.kinetic;
    assert!((0.5..1.0).contains(&friction), "{friction}: {ledger:?}");
}

/// Implicit Euler dissipates ½m(hg)² per substep of a body in free fall. Positions down to −4.9 m
/// are rounded by 2.4e-7 m, which over h = 4.2 ms is 5.7e-5 m/s of the 0.041 m/s that a substep
/// adds: 1.4e-3 of it.
#[test]
fn a_free_fall_loses_what_the_integrator_is_known_to_take() {
    let falling = body_of_masses(point(), &[2.0]);
    let ledger = kept(&world(settings(9.81, 60.0, 4, 1), falling), 60);
    let speed = 9.81 / 240.0;
    let expected = -0.5 * 2.0 * speed * speed * 240.0;
    assert_relative(ledger.solver.integrator, expected, 1.4e-3, "integrator");
    let Ledger {
        damping,
        friction,
        contact,
        grab,
        convergence,
        ..
    } = ledger.solver;
    assert_eq!([damping, friction, contact, grab, convergence], [0.0; 5]);
}

/// A body that slides to a stop has lost all of ½mv² to friction: no other force does work in its
/// plane, and nothing moves perpendicular to it.
#[test]
fn a_body_that_slides_to_a_stop_lost_its_energy_to_friction() {
    let mut sliding = body_of_masses(point(), &[2.0]);
    sliding.set_velocity(Vec3::X);
    let ground = Ground {
        friction: Friction::new(0.3).expect("sound"),
        ..Ground::default()
    };
    let effects = Effects {
        ground: Some(ground),
        ..Effects::default()
    };
    let ledger = kept(
        &world(settings(9.81, 60.0, 8, 1), with(sliding, effects)),
        60,
    );
    assert_eq!(ledger.now.kinetic, 0.0);
    // x up to 0.17 m is rounded by 7e-9 m, which over h = 2.1 ms is 4e-6 m/s of 1 m/s.
    assert_relative(ledger.solver.friction, -1.0, 1e-5, "friction");
    assert!(ledger.solver.contact.abs() < 1e-5, "{:?}", ledger.solver);
}

/// The rows add up to the change as closely as documented.
fn assert_balanced(ledger: &EnergyLedger) {
    let gap = ledger.gap() / largest(ledger);
    assert!(gap.abs() < 1e-7, "{gap} of the largest term: {ledger:?}");
}

/// Two cubes of 27 kg that overlap separate at 0.5 m/s: their relative motion has ½ · 13.5 kg ·
/// (0.5 m/s)² = 1.7 J, and deformation at least part of that. Nothing else adds energy.
#[test]
fn the_energy_of_overlapping_bodies_that_separate_is_in_the_row_of_recovery() {
    let mut world = world(settings(0.0, 60.0, 10, 1), jelly(Vec3::Y));
    world.bodies.push(jelly(Vec3::new(0.07, 1.15, 0.03)));
    let ledger = kept(&world, 60);
    assert_balanced(&ledger);
    let Ledger {
        contact, recovery, ..
    } = ledger.solver;
    assert!((1.0..10.0).contains(&recovery), "{:?}", ledger.solver);
    assert!(contact < 1e-3 * recovery, "{:?}", ledger.solver);
}

/// Two sheets of 0.108 kg that meet at 300 m/s have 9.7 kJ. Truncation cuts most of their motion in
/// the substep in which they meet.
#[test]
fn the_energy_of_motion_that_is_cut_is_in_the_row_of_truncation() {
    let mut world = world(settings(0.0, 60.0, 1, 1), sheet(Vec3::Y));
    world.bodies.push(sheet(Vec3::new(0.0, 4.0, 0.0)));
    for (body, speed) in world.bodies.iter_mut().zip([300.0, -300.0]) {
        body.set_velocity(Vec3::Y * speed);
    }
    let ledger = kept(&world, 4);
    assert_balanced(&ledger);
    assert!(ledger.solver.truncation < -1e3, "{:?}", ledger.solver);
}

/// A bounce with e = ½ takes three quarters of the energy of the fall. The end of the fall of 1 m
/// is known to vh = 4.4 m/s / 600 s⁻¹ = 7 mm, 0.7 % of its energy.
#[test]
fn the_energy_a_bounce_loses_is_in_the_row_of_the_contact() {
    let mut dropped = body_of_masses(point(), &[1.0]);
    dropped.translate(Vec3::Y);
    let ground = Ground {
        restitution: Restitution::new(0.5).expect("sound"),
        ..Ground::default()
    };
    let effects = Effects {
        ground: Some(ground),
        ..Effects::default()
    };
    // It lands after 0.45 s, and again after 0.9 s.
    let ledger = kept(
        &world(settings(9.81, 60.0, 10, 1), with(dropped, effects)),
        36,
    );
    assert_relative(ledger.solver.contact, -0.75 * 9.81, 7e-3, "contact");
    assert_eq!(ledger.solver.friction, 0.0);
}

/// A mass of 1 kg on a spring of 1e-3 m/N, stretched by 0.1 m: 5 J.
fn spring(tau: f32) -> World {
    let mut body = pinned(body_of_masses(chain(1, 1.0), &[1.0, 1.0]), &[0]);
    let elastic = stretch(1e-3).map(|stretch| solver::Stretch {
        damping: damping(tau),
        ..stretch
    });
    body.effects.stretch = elastic;
    let lower = &mut body.particles;
    let particle = lower
        .positions
        .iter()
        .position(|x| x.w > 0.0)
        .expect("one is free");
    lower.positions[particle].y -= 0.1;
    world(settings(0.0, 60.0, 20, 1), body)
}

/// E₂₄₀ = 5 J (1 + ω²h²)⁻²⁴⁰, and the whole loss is that of the integrator, as one iteration solves
/// a single edge exactly.
#[test]
fn a_spring_loses_its_energy_to_the_integrator_and_a_damped_one_to_its_damping() {
    let free = kept(&spring(0.0), 12);
    let h: f64 = 1.0 / 1200.0;
    let expected = 5.0 * ((1.0 + 1e3 * h * h).powi(-240) - 1.0);
    // Lengths near 1.1 m are rounded by 6e-8 m, which over h is 7e-5 m/s of 3.2 m/s: 2.2e-4 J of
    // 5 J, and 3e-4 of what is lost.
    assert_relative(free.solver.integrator, expected, 3e-4, "integrator");
    assert_relative(free.change(), expected, 3e-4, "change");
    assert_eq!(free.solver.damping, 0.0);
    let damped = kept(&spring(0.01), 120);
    let Ledger {
        damping,
        integrator,
        convergence,
        ..
    } = damped.solver;
    assert!(
        damping < 10.0 * integrator && integrator < 0.0,
        "{:?}",
        damped.solver
    );
    // Rounding when the edge moves the mass is attributed to convergence: 7e-5 m/s at up to 1 m/s
    // in each of the 200 substeps until rest, 1.4e-2 J if all have the same sign.
    assert!(
        convergence.abs() < 3e-3 * damping.abs(),
        "{:?}",
        damped.solver
    );
    assert_relative(damped.change(), -5.0, 1e-3, "change");
}

#[test]
fn a_grab_that_lifts_gives_what_the_weight_gains() {
    let lifted = body_of_masses(point(), &[1.0]);
    let (mut app, bodies, _) = app_of(&world(settings(9.81, 60.0, 10, 1), lifted));
    track(&mut app);
    let point = SurfacePoint::new(&[(ParticleIndex(0), 1.0)]).expect("a sound point");
    let body = bodies[0];
    push(
        &mut app,
        Action::Grab {
            body,
            point,
            target: Vec3::ZERO,
        },
    );
    for step in 1..=60 {
        let target = Vec3::Y * step as f32 / 60.0;
        push(&mut app, Action::MoveGrab { body, target });
        ticks(&mut app, 1);
    }
    ticks(&mut app, 120);
    let ledger = ledger(&app);
    let gained = ledger.now.potential - ledger.start.potential;
    assert!(gained > 8.0, "{ledger:?}");
    assert!(ledger.now.kinetic < 1e-4 * gained, "{ledger:?}");
    let given = ledger.solver.grab + ledger.solver.integrator + ledger.solver.rounding;
    assert_relative(given, gained, 1e-4, "grab");
    assert_eq!(ledger.solver.contact, 0.0);
}

/// Changes by users between ticks, and work of user effects, have their own rows.
#[test]
fn edits_and_user_effects_have_separate_rows() {
    let (mut app, bodies, _) = app_of(&spring(0.0));
    track(&mut app);
    ticks(&mut app, 1);
    let held = ledger(&app).now.elastic["stretch"];
    push(&mut app, set(bodies[0], "stretch", "compliance", 2e-3));
    ticks(&mut app, 1);
    assert_relative(ledger(&app).other, -0.5 * held, 1e-6, "other");

    fn shake(mut bodies: Query<&mut solver::Particles>) {
        for mut particles in &mut bodies {
            let displacements = &mut particles.displacements;
            displacements.iter_mut().for_each(|u| u.y += 1e-4);
        }
    }
    let mut app = app_with(|app| {
        app.add_systems(SolveSchedule, shake.in_set(SolvePhase::User));
    });
    plain::spawn(app.world_mut(), &cubes());
    track(&mut app);
    ticks(&mut app, 10);
    let ledger = ledger(&app);
    assert_eq!(ledger.solver, Ledger::default());
    assert_relative(ledger.other, ledger.change(), 1e-9, "other");
}

#[test]
fn a_scene_that_begins_anew_begins_a_ledger_and_one_switched_off_keeps_none() {
    let (mut app, ..) = app_of(&spring(0.0));
    ticks(&mut app, 5);
    assert_eq!(*ledger(&app), EnergyLedger::default());
    track(&mut app);
    ticks(&mut app, 5);
    assert_eq!(ledger(&app).ticks, 5);
    let mut again = spring(0.0);
    again.bodies[0].set_velocity(Vec3::Y);
    plain::spawn(app.world_mut(), &again);
    ticks(&mut app, 2);
    assert_eq!(ledger(&app).ticks, 2, "the clock began anew");
}

/// Schedules that run stage by stage cannot be tracked, and are slower.
#[test]
fn every_effect_of_the_crate_is_stepped_in_whole_ticks() {
    for body in all_effects::bodies() {
        let kept = kept(&world(settings(9.81, 60.0, 10, 1), body.clone()), 3);
        assert!(kept.solver.sum() != 0.0, "{}", body.name);
    }
}

/// Edges along a crack are doubled with their energy, folds across it disappear with theirs: the row is
/// the difference of the energies before and after. Elements all remain.
#[test]
fn tearing_has_a_row_of_its_own() {
    for name in ["torn_banner", "torn_jelly"] {
        let built = Scene::load(name).expect("built in").scene.build();
        let mut app = headless(&built.expect("sound"));
        track(&mut app);
        let (mut expected, mut pending) = (0.0, 0.0);
        let mut splits = 0;
        for _ in 0..200 {
            ticks(&mut app, 1);
            expected += pending;
            let after = Statistics::measure(app.world_mut()).energy();
            let now = plain::capture(app.world_mut());
            let all: u32 = now
                .bodies
                .iter()
                .map(|it| it.topology.splits() as u32)
                .sum();
            pending = match all > splits {
                true => after - ledger(&app).now.sum(),
                false => 0.0,
            };
            splits = all;
        }
        assert!(splits > 10, "{name}");
        let ledger = ledger(&app);
        let largest = largest(ledger);
        assert!(ledger.gap().abs() < 1e-7 * largest, "{name}");
        assert_eq!(ledger.other, 0.0, "{name}");
        assert!(
            ledger.torn.abs() > 1e-4 * largest,
            "{name}: {}",
            ledger.torn
        );
        // Sums in f64 of at most 1e5 terms.
        assert!((ledger.torn - expected).abs() < 1e-10 * largest, "{name}");
    }
}
