//! The order of a substep, the position of a user constraint, and that an ambiguous order is an
//! error.

use crate::{
    support::tetrahedron,
    support_app::{app, app_of, app_with, cubes, systems, systems_of_iteration, ticks},
};
use bevy::{
    ecs::schedule::{ScheduleCleanupPolicy, ScheduleLabel, Schedules},
    prelude::*,
};
use pliant::{
    SoftBodyPlugins,
    effect::{Collide, Effect, EffectPlugin, Grab, Ground, Parameter, Rod, Stretch, Volume},
    simulation::{
        Active, ContactSchedule, CurrentSubstep, EffectSystems, SimulationSettings, SoftBody,
        SolvePhase, SolveSchedule, SolverSystems, SubstepSchedule,
    },
    solver::{CollisionIterations, Height, ParticleIndex, Particles, SurfacePoint},
};
use std::panic::{AssertUnwindSafe, catch_unwind};

#[test]
fn presolve_comes_before_solve_and_solve_before_postsolve() {
    let mut app = app();
    ticks(&mut app, 1);
    assert_eq!(
        systems(&app, SubstepSchedule),
        ["presolve", "solve", "postsolve"]
    );
}

/// What ran, in order.
#[derive(Resource, Default)]
struct Log(Vec<&'static str>);

fn note(word: &'static str) -> impl Fn(ResMut<Log>) + Clone {
    move |mut log: ResMut<Log>| log.0.push(word)
}

#[test]
fn a_tick_runs_its_stages_in_the_documented_order_as_often_as_asked() {
    let mut app = app();
    app.init_resource::<Log>();
    app.add_systems(
        SubstepSchedule,
        (
            note("before presolve").before(SolverSystems::Presolve),
            note("after postsolve").after(SolverSystems::Postsolve),
        ),
    );
    app.add_systems(
        SolveSchedule,
        (
            note("elastic").in_set(SolvePhase::Elastic),
            note("user").in_set(SolvePhase::User),
            note("grabs").in_set(SolvePhase::Grab),
        ),
    );
    app.add_systems(ContactSchedule, note("contacts"));
    let iteration = ["elastic", "user", "grabs"];
    // Passes over contacts after each of four iterations.
    for (passes, after) in [
        (0, [1, 1, 1, 1]),
        (1, [0, 0, 0, 1]),
        (2, [0, 1, 0, 1]),
        (6, [1, 2, 1, 2]),
    ] {
        let mut settings = crate::support::settings(9.81, 60.0, 3, 4);
        settings.collision_iterations = CollisionIterations::new(passes).expect("in range");
        app.insert_resource(SimulationSettings(settings));
        app.insert_resource(Log::default());
        ticks(&mut app, 1);
        let mut substep = vec!["before presolve"];
        for passes in after {
            substep.extend(iteration);
            substep.extend(vec!["contacts"; passes]);
        }
        substep.push("after postsolve");
        assert_eq!(app.world().resource::<Log>().0, substep.repeat(3));
    }
}

/// Moves every free particle up by a fixed distance in each iteration.
fn lift(mut bodies: Query<&mut Particles, Active>) {
    for mut particles in &mut bodies {
        let Particles {
            positions,
            displacements,
            ..
        } = &mut *particles;
        for (x, u) in positions.iter().zip(displacements) {
            if x.w > 0.0 {
                u.y += 1e-4;
            }
        }
    }
}

#[test]
fn a_users_constraint_runs_between_internal_constraints_and_contacts() {
    let mut app = app();
    app.add_systems(SolveSchedule, lift.in_set(SolvePhase::User));
    let topology = crate::support::topology(tetrahedron());
    app.world_mut().spawn((
        SoftBody(topology),
        Collide::default(),
        Ground::default(),
        Volume::default(),
        Stretch::default(),
    ));
    ticks(&mut app, 1);
    assert_eq!(
        systems_of_iteration(&app),
        ["stretch", "volume", "user", "ground", "collide"]
    );
}

#[test]
fn a_users_constraint_can_stand_between_two_effects() {
    let mut app = app();
    app.add_systems(
        SolveSchedule,
        lift.after(EffectSystems("stretch"))
            .before(EffectSystems("volume")),
    );
    let topology = crate::support::topology(tetrahedron());
    app.world_mut()
        .spawn((SoftBody(topology), Volume::default(), Stretch::default()));
    ticks(&mut app, 1);
    assert_eq!(systems(&app, SolveSchedule), ["stretch", "other", "volume"]);
}

/// The height after a tick of a tetrahedron squeezed to half its height, without gravity.
fn height_of_squeezed(change: impl Fn(&mut App)) -> f32 {
    let mut app = app();
    app.insert_resource(SimulationSettings(crate::support::settings(
        0.0, 60.0, 4, 2,
    )));
    let topology = crate::support::topology(tetrahedron());
    let body = app
        .world_mut()
        .spawn((SoftBody(topology), Stretch::default()))
        .id();
    ticks(&mut app, 1);
    let height = |app: &App| {
        let particles = app.world().get::<Particles>(body).expect("a body");
        let heights = particles.positions.iter().map(|x| x.y);
        let high = heights.clone().fold(f32::NEG_INFINITY, f32::max);
        high - heights.fold(f32::INFINITY, f32::min)
    };
    let at_rest = height(&app);
    let mut particles = app.world_mut().get_mut::<Particles>(body).expect("a body");
    for x in &mut particles.positions {
        x.y *= 0.5;
    }
    change(&mut app);
    ticks(&mut app, 1);
    height(&app) / at_rest
}

/// A user system that replaces one of the crate's is run, although the number of systems is
/// unchanged.
#[test]
fn a_stage_can_be_replaced() {
    #[derive(Resource, Default)]
    struct Substeps(u32);
    let height = height_of_squeezed(|app| {
        app.init_resource::<Substeps>();
        app.world_mut()
            .schedule_scope(SubstepSchedule, |world, schedule| {
                let removed = schedule.remove_systems_in_set(
                    SolverSystems::Solve,
                    world,
                    ScheduleCleanupPolicy::RemoveSystemsOnly,
                );
                assert_eq!(removed.expect("it has systems"), 1);
                let count = |mut substeps: ResMut<Substeps>| substeps.0 += 1;
                schedule.add_systems(count.in_set(SolverSystems::Solve));
                schedule.initialize(world).expect("it can be built");
            });
        ticks(app, 1);
        assert_eq!(
            app.world().resource::<Substeps>().0,
            4,
            "substeps of a tick"
        );
    });
    assert!((height - 0.5).abs() < 1e-6, "nothing else solves: {height}");
}

/// A run condition on the crate's systems is evaluated.
#[test]
fn an_effect_can_be_switched_off_by_a_condition() {
    let with = |runs: bool| {
        height_of_squeezed(|app| {
            app.configure_sets(SolveSchedule, EffectSystems("stretch").run_if(move || runs));
        })
    };
    assert!((with(false) - 0.5).abs() < 1e-6, "it did not act");
    assert!(with(true) > 0.9, "it did");
    assert_eq!(with(true), height_of_squeezed(|_| ()));
}

#[test]
fn an_order_that_matters_and_is_not_given_is_an_error() {
    let mut app = app();
    app.add_systems(
        SolveSchedule,
        (lift, lift.map(|()| ())).in_set(SolvePhase::User),
    );
    let topology = crate::support::topology(tetrahedron());
    app.world_mut()
        .spawn((SoftBody(topology), Stretch::default()));
    let outcome = catch_unwind(AssertUnwindSafe(|| ticks(&mut app, 1)));
    assert!(
        outcome.is_err(),
        "two systems wrote the same particles in any order"
    );
}

#[test]
fn the_inner_schedules_hold_no_ambiguity_with_everything_in_them() {
    let (mut app, bodies, _) = app_of(&cubes());
    app.world_mut().entity_mut(bodies[0]).insert((
        Collide::default(),
        pliant::effect::StickyGround {
            height: Height::of(-1.0),
        },
        Grab::on(
            SurfacePoint::new(&[(ParticleIndex(0), 1.0)]).expect("sound"),
            Vec3::ZERO,
            1.0,
            1.0,
            9.81,
        ),
    ));
    // An ambiguity would panic.
    ticks(&mut app, 2);
    let schedules = app.world().resource::<Schedules>();
    for label in [
        SubstepSchedule.intern(),
        SolveSchedule.intern(),
        ContactSchedule.intern(),
    ] {
        let schedule = schedules.get(label).expect("it exists");
        assert!(schedule.graph().conflicting_systems().is_empty());
    }
}

/// A user effect.
#[derive(Component, Clone, Default)]
struct Breeze {
    acceleration: f32,
}

impl Effect for Breeze {
    const NAME: &'static str = "breeze";
    const TITLE: &'static str = "Breeze";
    const SUMMARY: &'static str = "Pushes along x.";
    const PARAMETERS: &'static [Parameter<Self>] = &[];
    type State = ();

    fn add_systems(schedules: &mut Schedules) {
        schedules.add_systems(
            SolveSchedule,
            blow.in_set(EffectSystems(Self::NAME))
                .in_set(SolvePhase::User),
        );
    }
}

fn blow(current: Res<CurrentSubstep>, mut bodies: Query<(&mut Particles, &Breeze), Active>) {
    let h = current.step.h;
    for (mut particles, wind) in &mut bodies {
        let Particles {
            positions,
            displacements,
            ..
        } = &mut *particles;
        for (x, u) in positions.iter().zip(displacements) {
            if x.w > 0.0 {
                u.x += wind.acceleration * h * h;
            }
        }
    }
}

#[test]
fn an_effect_of_a_users_own_comes_and_goes_like_any_other() {
    let mut app = app_with(|app| {
        app.add_plugins(EffectPlugin::<Breeze>::default());
    });
    let topology = crate::support::topology(tetrahedron());
    let body = app
        .world_mut()
        .spawn((SoftBody(topology), Stretch::default()))
        .id();
    ticks(&mut app, 1);
    assert_eq!(systems(&app, SolveSchedule), ["stretch"]);
    app.world_mut()
        .entity_mut(body)
        .insert(Breeze { acceleration: 2.0 });
    ticks(&mut app, 60);
    assert_eq!(systems(&app, SolveSchedule), ["stretch", "breeze"]);
    // A constant force gives its exact acceleration: ah²n(n+1)/2 for n = 600, except for the
    // rounding of ah² = 5.6e-6 m to an ulp of a meter.
    let particles = app.world().get::<Particles>(body).expect("a body");
    assert!(
        (particles.positions[0].x - 1.001_67).abs() < 0.02,
        "{}",
        particles.positions[0]
    );
    app.world_mut().entity_mut(body).remove::<Breeze>();
    ticks(&mut app, 1);
    assert_eq!(systems(&app, SolveSchedule), ["stretch"]);
}

/// A user's effect acts between internal constraints and grabs, whichever plugin comes first.
#[test]
fn plugins_are_added_in_any_order_beside_any_effect() {
    let run = |first: bool, held: bool, stiff: bool| {
        let mut app = App::new();
        app.add_plugins(MinimalPlugins);
        if first {
            app.add_plugins((
                EffectPlugin::<Breeze>::default(),
                SoftBodyPlugins::default(),
            ));
        } else {
            app.add_plugins((
                SoftBodyPlugins::default(),
                EffectPlugin::<Breeze>::default(),
            ));
        }
        let body = SoftBody::rope(1.0, 4).build();
        let breeze = Breeze { acceleration: 2.0 };
        let body = app.world_mut().spawn((body, Stretch::default(), breeze));
        let body = body.id();
        let mut body = app.world_mut().entity_mut(body);
        if held {
            let point = SurfacePoint::new(&[(ParticleIndex(0), 1.0)]).expect("a point");
            body.insert(Grab::on(point, Vec3::Y, 1.0, 0.1, 9.81));
        }
        if stiff {
            body.insert(Rod::default());
        }
        let body = body.id();
        ticks(&mut app, 3);
        let particles = app.world().get::<Particles>(body).expect("a body");
        (systems(&app, SolveSchedule), particles.clone())
    };
    for (held, stiff) in [(false, false), (true, false), (false, true), (true, true)] {
        let one = run(true, held, stiff);
        let mut expected = vec!["stretch", "breeze"];
        expected.extend(held.then_some("grab"));
        expected.extend(stiff.then_some("rod"));
        assert_eq!(one.0, expected);
        assert_eq!(one, run(false, held, stiff));
    }
}
