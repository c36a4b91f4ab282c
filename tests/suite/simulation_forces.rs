//! Forces and impulses that an app applies.

use crate::{
    support::{assert_follows, body, cube, pinned, settings, stretch, world},
    support_app::{app_of, cubes, deterministic},
};
use bevy::prelude::*;
use glam::DVec3;
use pliant::{
    effect::{ExternalForce, ExternalImpulse, Grabs, PinTargets},
    mesh,
    simulation::{
        Asleep, EnergyLedger, Sleep, SoftBody, SolvePhase, SolveSchedule, SolverThreads,
        state_hash, tick,
    },
    solver::{
        self, Body, Coefficient, Compliance, Contact, Controls, Drag, Grab, Grains, Order,
        ParticleIndex, Particles, RestShape, Sink, Stretch, SurfacePoint, Threads, VertexIndex,
        measure, reference,
    },
};

fn particles(app: &App, body: Entity) -> &Particles {
    app.world().get::<Particles>(body).expect("a body")
}

/// A block of 0.4 m and 64 kg, without gravity.
fn block() -> Body {
    let mut block = body("block", cube(0.4, 2), 1000.0);
    block.effects.stretch = stretch(1e-6);
    block
}

fn point(particle: u32) -> SurfacePoint {
    SurfacePoint::new(&[(ParticleIndex(particle), 1.0)]).expect("a point")
}

/// However many iterations, substeps: v = Ft/m, and a force at a point has the same on the momentum,
/// and its moment on the angular momentum.
#[test]
fn a_force_accelerates_a_body_by_newtons_laws() {
    for (substeps, iterations, order) in [(1, 1, 1), (10, 4, 1), (10, 1, 2)] {
        let mut start = world(settings(0.0, 60.0, substeps, iterations), block());
        start.settings.order = Order::new(order).expect("1 or 2");
        for at_point in [false, true] {
            let (mut app, bodies, _) = app_of(&start);
            let force = Vec3::new(32.0, 0.0, -8.0);
            let load = match at_point {
                false => ExternalForce::on_whole(force),
                true => ExternalForce::at(point(0), force),
            };
            let arm = particles(&app, bodies[0]).position(0);
            app.world_mut().entity_mut(bodies[0]).insert(load);
            // For a tick only, in which the arm hardly turns.
            tick(app.world_mut());
            let now = particles(&app, bodies[0]);
            let (seconds, force) = (1.0 / 60.0, force.as_dvec3());
            let momentum = measure::momentum(now);
            // Displacements are rounded to 24 bits in each substep.
            let off = momentum.distance(force * seconds);
            assert!(off < 1e-5 * force.length() * seconds, "{momentum}");
            let moment = if at_point {
                arm.cross(force)
            } else {
                DVec3::ZERO
            };
            let found = measure::angular_momentum(now);
            // The point moves by less than 1 mm of its arm of 0.35 m; implicit Euler loses rotation.
            let off = found.distance(moment * seconds);
            assert!(
                off < 0.003 * force.length() * seconds * arm.length(),
                "{found}"
            );
        }
    }
}

/// Under drag c, F/(mc), whatever the substeps: drag knows of the force of the same substep.
#[test]
fn a_force_and_drag_reach_the_terminal_speed_at_any_substeps() {
    let (c, force) = (20.0_f32, 320.0_f32);
    for substeps in [1, 3, 10, 40] {
        let mut start = world(settings(0.0, 60.0, substeps, 1), block());
        start.bodies[0].effects.drag = Some(Drag {
            linear: Coefficient::of(c),
            ..Drag::default()
        });
        let (mut app, bodies, _) = app_of(&start);
        let load = ExternalForce::on_whole(Vec3::X * force);
        app.world_mut().entity_mut(bodies[0]).insert(load);
        // A second: e^−20 = 2e-9 of the speed is missing, with implicit drag at most (1 + c/60)⁻⁶⁰ = 3e-8.
        for _ in 0..60 {
            tick(app.world_mut());
        }
        let speed = measure::momentum(particles(&app, bodies[0])).x / 64.0;
        let right = f64::from(force / 64.0 / c);
        // Displacements are rounded to 24 bits in each substep.
        assert!((speed / right - 1.0).abs() < 1e-5, "{speed} for {right}");
    }
}

/// A pushed body runs whole ticks, stage by stage, on one thread and on two, and with its energy ledger, to
/// the same bits: alone, where it touches, is joined, under a field, or with steps of second order.
#[test]
fn a_pushed_body_has_the_same_bits_however_it_is_stepped() {
    for case in 0..6 {
        let mut start = cubes();
        for body in &mut start.bodies {
            body.effects.drag = Some(Drag::default());
            if case % 2 == 1 {
                body.effects.contact = Some(Contact::default());
            }
        }
        start.bodies[1].translate(Vec3::new(-1.5, 0.1, 0.0));
        start.settings.order = Order::new(1 + u32::from(case >= 4)).expect("1 or 2");
        let apps = [0, 1, 2, 3].map(|way| {
            let (mut app, bodies, _) = app_of(&start);
            if case >= 2 {
                let load = ExternalForce::on_whole(Vec3::new(40.0, 20.0, 0.0));
                app.world_mut().entity_mut(bodies[1]).insert(load);
            }
            let load = ExternalForce::at(point(1), Vec3::new(60.0, 0.0, -30.0));
            app.world_mut().entity_mut(bodies[0]).insert(load);
            match way {
                1 => {
                    // It may act on any body.
                    app.add_systems(SolveSchedule, (|| ()).in_set(SolvePhase::User));
                }
                2 => {
                    let two = Threads::new(2).expect("two threads");
                    app.insert_resource(SolverThreads(two));
                }
                3 => app.world_mut().resource_mut::<EnergyLedger>().on = true,
                _ => {}
            }
            app
        });
        let mut apps = apps;
        for tick in 1..=60 {
            let hashes = apps.each_mut().map(|app| {
                pliant::simulation::tick(app.world_mut());
                state_hash(app.world_mut())
            });
            assert!(
                hashes.iter().all(|hash| *hash == hashes[0]),
                "case {case}, tick {tick}: {hashes:x?}"
            );
        }
        let mut without = app_of(&start).0;
        for _ in 0..60 {
            tick(without.world_mut());
        }
        assert_ne!(
            state_hash(without.world_mut()),
            state_hash(apps[0].world_mut())
        );
    }
}

/// A pinned edge of a spring is longer by αF.
#[test]
fn a_force_at_a_point_is_held_by_a_spring() {
    let chain = crate::support::chain(1, 1.0);
    let mut rope = pinned(body("rope", chain, 1.0), &[0]);
    rope.effects.stretch = Some(Stretch {
        compliance: Compliance::of(1e-3),
        damping: crate::support::damping(0.02),
        ..Stretch::default()
    });
    let free = rope.topology.numbering.particle(VertexIndex(1));
    let (mut app, bodies, _) = app_of(&world(settings(0.0, 60.0, 10, 2), rope));
    let pull = SurfacePoint::new(&[(free, 1.0)]).expect("a point");
    let load = ExternalForce::at(pull, Vec3::NEG_Y * 20.0);
    app.world_mut().entity_mut(bodies[0]).insert(load);
    for _ in 0..300 {
        tick(app.world_mut());
    }
    let tip = particles(&app, bodies[0]).position(free.index());
    // Rounding of a meter to f32.
    assert!((tip.y + 1.02).abs() < 1e-6, "{tip}");
    // Without it, the spring goes back.
    app.world_mut()
        .entity_mut(bodies[0])
        .remove::<ExternalForce>();
    for _ in 0..300 {
        tick(app.world_mut());
    }
    let left = particles(&app, bodies[0]).position(free.index());
    assert!((left.y + 1.0).abs() < 1e-6, "{left}");
}

#[test]
fn an_impulse_acts_once_and_wakes_the_body() {
    let start = world(settings(0.0, 60.0, 10, 1), block());
    let (mut app, bodies, _) = app_of(&start);
    app.world_mut().resource_mut::<Sleep>().enabled = true;
    for _ in 0..120 {
        tick(app.world_mut());
    }
    assert!(app.world().get::<Asleep>(bodies[0]).is_some());
    let impulse = ExternalImpulse::on_whole(Vec3::Y * 6.4).and_at(point(3), Vec3::X * 0.64);
    app.world_mut().entity_mut(bodies[0]).insert(impulse);
    for ticks in 1..=3 {
        tick(app.world_mut());
        assert!(app.world().get::<Asleep>(bodies[0]).is_none());
        assert!(app.world().get::<ExternalImpulse>(bodies[0]).is_none());
        let found = measure::momentum(particles(&app, bodies[0]));
        let off = found.distance(DVec3::new(0.64, 6.4, 0.0));
        assert!(off < 1e-4, "after {ticks} ticks: {found}");
    }
}

/// Points of another mesh are ignored, and pinned particles stay where they are.
#[test]
fn a_force_where_nothing_moves_does_nothing() {
    let start = world(settings(0.0, 60.0, 4, 1), pinned(block(), &[0]));
    let (mut app, bodies, _) = app_of(&start);
    let pin = start.bodies[0].topology.numbering.particle(VertexIndex(0));
    let before = particles(&app, bodies[0]).clone();
    let load = ExternalForce::at(point(10_000), Vec3::X).and_at(point(pin.0), Vec3::X * 1e6);
    app.world_mut().entity_mut(bodies[0]).insert(load);
    tick(app.world_mut());
    assert_eq!(particles(&app, bodies[0]).positions, before.positions);
}

/// Points follow their particles when grains disappear, and are gone with them.
#[test]
fn a_force_stays_on_its_grain() {
    let shape = RestShape {
        vertices: vec![Vec3::ZERO, Vec3::X, Vec3::X * 2.0],
        radii: vec![0.1; 3],
        ..RestShape::default()
    };
    let mut grains = body("grains", shape, 1000.0);
    grains.effects.grains = Some(Grains::default());
    // Around the first grain.
    grains.effects.sink = Some(Sink::default());
    let (mut app, bodies, _) = app_of(&world(settings(0.0, 60.0, 4, 1), grains));
    let load = ExternalForce::at(point(0), Vec3::Y).and_at(point(2), Vec3::Z);
    app.world_mut().entity_mut(bodies[0]).insert(load);
    tick(app.world_mut());
    let left = app
        .world()
        .get::<ExternalForce>(bodies[0])
        .expect("it is left");
    assert_eq!(left.points, [(point(1), Vec3::Z)]);
    assert_eq!(particles(&app, bodies[0]).len(), 2);
}

/// A rope whose upper end is moved at 5 m/s for some ticks, by targets or by its position.
fn dragged(by_target: bool, count: u32) -> (App, Entity) {
    let mut rope = pinned(body("rope", crate::support::chain(20, 0.05), 0.1), &[0]);
    rope.effects.stretch = stretch(1e-5);
    let (mut app, bodies, _) = app_of(&world(settings(9.81, 60.0, 10, 1), rope));
    let start = particles(&app, bodies[0]).position(0);
    for number in 1..=count {
        let goal = start + DVec3::X * (5.0 * f64::from(number) / 60.0);
        let mut entity = app.world_mut().entity_mut(bodies[0]);
        if by_target {
            entity.insert(PinTargets::of(VertexIndex(0), goal.as_vec3()));
        } else if let Some(mut particles) = entity.get_mut::<Particles>() {
            particles.set_position(0, goal);
        }
        tick(app.world_mut());
        let now = particles(&app, bodies[0]).position(0);
        // Rounding of 5 m to f32.
        assert!(now.distance(goal) < 5e-7, "{now}");
    }
    (app, bodies[0])
}

/// The upper part of a rope moves with its end, as a wave of stretching runs through 20 edges of
/// √(αm) = 0.2 ms each in less than a tick. A pin that jumps by the way of a tick in its first substep,
/// and rests in the others, strikes the rope: the part next to it stands still at the end of a tick.
#[test]
fn pins_move_evenly_over_the_substeps() {
    let speeds = [true, false].map(|by_target| {
        let (app, rope) = dragged(by_target, 3);
        let now = particles(&app, rope);
        [1, 2, 3, 4].map(|i| now.velocity(i).x)
    });
    let off = speeds.map(|all| all.map(|v| (v / 5.0 - 1.0).abs()));
    assert!(off[0].iter().all(|off| *off < 0.1), "{speeds:?}");
    assert!(off[1].iter().any(|off| *off > 0.5), "{speeds:?}");
}

#[test]
fn pins_stay_at_their_targets_and_what_is_no_pin_is_not_moved() {
    let (mut app, rope) = dragged(true, 60);
    let place = particles(&app, rope).position(0);
    for _ in 0..10 {
        tick(app.world_mut());
    }
    assert!(particles(&app, rope).position(0).distance(place) < 5e-7);
    let free = particles(&app, rope).position(5);
    let targets = PinTargets::of(VertexIndex(5), Vec3::splat(100.0))
        .and(VertexIndex(999), Vec3::ZERO)
        .and(VertexIndex(0), Vec3::NAN);
    app.world_mut().entity_mut(rope).insert(targets);
    tick(app.world_mut());
    let now = particles(&app, rope);
    assert!(now.position(5).distance(free) < 0.5);
    assert!(now.position(0).distance(place) < 5e-7);
    assert!(now.first_not_finite().is_none());
}

#[test]
fn a_target_wakes_a_body_that_sleeps() {
    let mut own = pinned(block(), &[0]);
    own.effects.stretch = stretch(1e-6);
    let (mut app, bodies, _) = app_of(&world(settings(0.0, 60.0, 10, 1), own));
    app.world_mut().resource_mut::<Sleep>().enabled = true;
    for _ in 0..120 {
        tick(app.world_mut());
    }
    assert!(app.world().get::<Asleep>(bodies[0]).is_some());
    let pin = {
        let topology = app.world().get::<SoftBody>(bodies[0]).expect("a body");
        topology.particle(VertexIndex(0))
    };
    let goal = particles(&app, bodies[0]).position(pin).as_vec3() + Vec3::Y * 0.01;
    let target = PinTargets::of(VertexIndex(0), goal);
    app.world_mut().entity_mut(bodies[0]).insert(target);
    tick(app.world_mut());
    assert!(app.world().get::<Asleep>(bodies[0]).is_none());
    assert!(
        particles(&app, bodies[0])
            .position(pin)
            .as_vec3()
            .distance(goal)
            < 1e-7
    );
}

/// All that an app does, to a solid and to a cloth that is large enough to be in lanes and in partitions.
fn controlled() -> solver::World {
    let sheet = mesh::Primitive::Cloth {
        size: Vec2::splat(2.0),
        cells: UVec2::splat(40),
        diagonals: Default::default(),
        shear: true,
    };
    let sheet = sheet.build().expect("a sheet").shape;
    let mut sheet = pinned(body("sheet", sheet, 0.2), &[0, 40]);
    sheet.effects.stretch = stretch(1e-5);
    sheet.translate(Vec3::Y * 2.0);
    let mut solid = pinned(block(), &[0]);
    solid.effects.drag = Some(Drag::default());
    let mut start = world(settings(9.81, 60.0, 5, 2), solid);
    start.bodies.push(sheet);
    for body in &mut start.bodies {
        let (a, b) = (body.topology.rest[4], body.topology.rest[9]);
        *body.control() = Controls {
            force: Some(ExternalForce::on_whole(Vec3::X).and_at(point(5), Vec3::Z * 0.3)),
            impulse: Some(
                ExternalImpulse::on_whole(Vec3::Z * 0.2).and_at(point(7), Vec3::Y * 0.01),
            ),
            targets: Some(PinTargets::of(VertexIndex(0), Vec3::new(0.1, 0.2, 0.0))),
            grabs: Some(Grabs::new([grab(a + Vec3::Y * 0.1, 4), grab(b, 9)])),
        };
    }
    start
}

/// Threads, Bevy, stages, copies and snapshots, which contain it.
#[test]
fn what_an_app_does_has_the_same_bits_in_every_way_to_run_it() {
    let (_, contacts) = deterministic(controlled(), 30);
    assert_eq!(contacts, 0);
}

/// The plain f64 solver has the same forces, impulses, pins and grabs.
#[test]
fn the_reference_does_what_an_app_does() {
    let mut fast = controlled();
    let mut exact = reference::World::of(&fast);
    for _ in 0..10 {
        fast.tick();
        exact.tick();
        // Displacements of at most 16 mm have an error of 1e-9 m in each substep; these add up as velocities,
        // to 50²/2 of it, before the sheet folds.
        assert_follows(&exact, &fast, 1e-5);
    }
    // It is more than gravity does.
    let mut free = controlled();
    free.bodies.iter_mut().for_each(|body| body.controls = None);
    let mut free = reference::World::of(&free);
    (0..10).for_each(|_| free.tick());
    let off = |body: usize| free.bodies[body].x[20].distance(exact.bodies[body].x[20]);
    assert!(off(0) > 0.01 && off(1) > 0.01, "{} {}", off(0), off(1));
}

fn grab(target: Vec3, particle: u32) -> Grab {
    // Of 64 kg and 0.4 m, under 9.81 m/s².
    Grab::on(point(particle), target, 64.0, 0.4, 9.81)
}

/// One grab among several has the same bits as that of the pointer, and two springs share the weight.
#[test]
fn several_grabs_hold_a_body_as_one_does() {
    let start = world(settings(9.81, 60.0, 10, 1), block());
    let (mut one, bodies, _) = app_of(&start);
    let (mut many, others, _) = app_of(&start);
    let here = |i: u32| particles(&one, bodies[0]).position(i as usize).as_vec3();
    let (a, b) = (here(0), here(26));
    one.world_mut().entity_mut(bodies[0]).insert(grab(a, 0));
    many.world_mut()
        .entity_mut(others[0])
        .insert(Grabs::new([grab(a, 0)]));
    for _ in 0..30 {
        let raise = Vec3::Y * 0.002;
        one.world_mut()
            .get_mut::<Grab>(bodies[0])
            .expect("grabbed")
            .target += raise;
        let mut grabs = many
            .world_mut()
            .get_mut::<Grabs>(others[0])
            .expect("grabbed");
        grabs.iter_mut().for_each(|grab| grab.target += raise);
        tick(one.world_mut());
        tick(many.world_mut());
    }
    let bits = |app: &App, body| crate::support::state_bits(particles(app, body));
    assert_eq!(bits(&one, bodies[0]), bits(&many, others[0]));

    let (mut app, bodies, _) = app_of(&start);
    app.world_mut().resource_mut::<Sleep>().enabled = true;
    let mut grabs = Grabs::default();
    grabs.add(grab(a, 0));
    assert_eq!(grabs.add(grab(b, 26)), 1);
    app.world_mut().entity_mut(bodies[0]).insert(grabs);
    for _ in 0..600 {
        tick(app.world_mut());
    }
    assert!(app.world().get::<Asleep>(bodies[0]).is_none());
    let held = app.world().get::<Grabs>(bodies[0]).expect("grabbed");
    let sum: f32 = held.forces(1.0 / 600.0).sum();
    // The weight of 64 kg; a little more where they are not vertical. A multiplier is rounded to f32.
    assert!(sum > 627.84 * (1.0 - 1e-5) && sum < 660.0, "{sum} N");
    let mut held = app
        .world_mut()
        .get_mut::<Grabs>(bodies[0])
        .expect("grabbed");
    held.remove(0);
    held.remove(5);
    assert_eq!(held.iter().count(), 1);
}
