//! A change of a component takes effect at the next tick, and nothing else is rebuilt.

use crate::{
    support::{
        self, G, assert_relative, body_of_masses, chain, damping, pinned, settings, stretch,
    },
    support_app::{app_of, cubes, systems_of_iteration, ticks},
};
use bevy::{ecs::reflect::ReflectComponent, prelude::*};
use pliant::{
    effect::{Collide, PinTargets, Stretch, Volume},
    simulation::{
        AddedMass, BodyDensity, Pins, SimulationSettings, SoftBody, plain, state_hash, tick,
    },
    solver::{
        self, Collider, ColliderShape, Compliance, Density, EffectStates, Effects, ElasticKind,
        Particles, Pose, VertexIndex,
    },
};
use std::{any::TypeId, sync::Arc};

/// A kilogram that hangs from an edge of a millimeter.
fn hanging() -> solver::World {
    let effects = Effects {
        stretch: Some(Stretch {
            damping: damping(0.02),
            ..stretch(1e-4).expect("given")
        }),
        ..Effects::default()
    };
    let body = body_of_masses(chain(1, 1e-3), &[1.0, 1.0]);
    let body = pinned(support::with(body, effects), &[0]);
    support::world(settings(G, 60.0, 10, 1), body)
}

fn extension(app: &App, body: Entity) -> f64 {
    let particles = app.world().get::<Particles>(body).expect("a body");
    f64::from(-particles.positions[1].y) - 1e-3
}

#[test]
fn a_compliance_that_is_written_holds_from_the_next_tick() {
    let (mut app, bodies, _) = app_of(&hanging());
    ticks(&mut app, 300);
    assert_relative(extension(&app, bodies[0]), 1e-4 * G, 1e-3, "extension");
    let topology = Arc::as_ptr(&app.world().get::<SoftBody>(bodies[0]).expect("a body").0);
    app.world_mut()
        .get_mut::<Stretch>(bodies[0])
        .expect("carried")
        .compliance = Compliance::new(3e-4).expect("sound");
    let before = extension(&app, bodies[0]);
    ticks(&mut app, 1);
    assert!(
        extension(&app, bodies[0]) > before + 1e-5,
        "it gives at once"
    );
    ticks(&mut app, 300);
    assert_relative(extension(&app, bodies[0]), 3e-4 * G, 1e-3, "extension");
    let after = Arc::as_ptr(&app.world().get::<SoftBody>(bodies[0]).expect("a body").0);
    assert_eq!(topology, after, "nothing was rebuilt");
}

#[test]
fn pins_and_densities_that_are_written_change_masses_at_the_next_tick() {
    let (mut app, bodies, _) = app_of(&cubes());
    let weight = |app: &App| {
        app.world()
            .get::<Particles>(bodies[0])
            .expect("a body")
            .positions[1]
            .w
    };
    let before = weight(&app);
    app.world_mut()
        .entity_mut(bodies[0])
        .insert(BodyDensity(Density::new(2000.0).expect("sound")));
    ticks(&mut app, 1);
    assert_eq!(weight(&app), before / 2.0);
    app.world_mut()
        .get_mut::<Pins>(bodies[0])
        .expect("has them")
        .0
        .push(VertexIndex(1));
    ticks(&mut app, 1);
    assert_eq!(weight(&app), 0.0);
    app.world_mut()
        .get_mut::<Pins>(bodies[0])
        .expect("has them")
        .0
        .clear();
    ticks(&mut app, 1);
    assert_eq!(weight(&app), before / 2.0);
}

#[test]
fn settings_that_are_written_hold_from_the_next_tick() {
    let mut expected = cubes();
    let (mut app, ..) = app_of(&expected);
    ticks(&mut app, 5);
    (0..5).for_each(|_| expected.tick());
    let other = settings(1.6, 120.0, 7, 3);
    app.world_mut().insert_resource(SimulationSettings(other));
    expected.settings = other;
    ticks(&mut app, 20);
    (0..20).for_each(|_| expected.tick());
    assert_eq!(state_hash(app.world_mut()), expected.state_hash());
}

#[test]
fn an_effect_that_came_and_went_without_acting_leaves_no_trace() {
    let mut expected = cubes();
    let (mut app, bodies, _) = app_of(&expected);
    for round in 0..10 {
        // Nothing to collide with.
        app.world_mut()
            .entity_mut(bodies[round % 2])
            .insert(Collide::default());
        ticks(&mut app, 3);
        app.world_mut()
            .entity_mut(bodies[round % 2])
            .remove::<Collide>();
        ticks(&mut app, 3);
    }
    (0..60).for_each(|_| expected.tick());
    assert_eq!(state_hash(app.world_mut()), expected.state_hash());
    assert_eq!(systems_of_iteration(&app), ["stretch", "volume", "ground"]);
}

#[test]
fn an_effect_that_was_taken_away_and_given_back_acts_as_before() {
    let mut expected = cubes();
    let (mut app, bodies, _) = app_of(&expected);
    ticks(&mut app, 20);
    (0..20).for_each(|_| expected.tick());
    let volume = app.world_mut().entity_mut(bodies[0]).take::<Volume>();
    let kept = expected.bodies[0].effects.volume.take();
    ticks(&mut app, 20);
    (0..20).for_each(|_| expected.tick());
    app.world_mut()
        .entity_mut(bodies[0])
        .insert(volume.expect("it was carried"));
    expected.bodies[0].effects.volume = kept;
    ticks(&mut app, 20);
    (0..20).for_each(|_| expected.tick());
    assert_eq!(state_hash(app.world_mut()), expected.state_hash());
}

#[test]
fn an_absent_effect_has_no_memory() {
    let (mut app, bodies, _) = app_of(&cubes());
    ticks(&mut app, 1);
    let column = |app: &App| {
        app.world()
            .get::<EffectStates>(bodies[0])
            .map(|states| states.multipliers(ElasticKind::Stretch).len())
    };
    assert!(column(&app).is_some_and(|length| length > 0));
    app.world_mut().entity_mut(bodies[0]).remove::<Stretch>();
    ticks(&mut app, 1);
    assert_eq!(column(&app), Some(0));
}

#[test]
fn colliders_come_and_go_and_move() {
    let mut world = cubes();
    for body in &mut world.bodies {
        body.effects.ground = None;
        body.effects.collide = Some(Collide::default());
    }
    let (mut app, bodies, _) = app_of(&world);
    let shape = ColliderShape::Box {
        size: Vec3::new(10.0, 1.0, 10.0),
    };
    let floor =
        Collider::new(shape, Pose::at(Vec3::new(0.0, -0.5, 0.0).as_dvec3())).expect("sound");
    let floor = app.world_mut().spawn(floor).id();
    let lowest = |app: &App| {
        let particles = app.world().get::<Particles>(bodies[0]).expect("a body");
        particles
            .positions
            .iter()
            .map(|x| x.y)
            .fold(f32::INFINITY, f32::min)
    };
    ticks(&mut app, 300);
    assert!(lowest(&app).abs() < 1e-5, "it lies at {}", lowest(&app));
    app.world_mut()
        .get_mut::<Collider>(floor)
        .expect("it is one")
        .start
        .translation
        .y = -0.75;
    ticks(&mut app, 300);
    assert!(
        (lowest(&app) + 0.25).abs() < 1e-5,
        "it lies at {}",
        lowest(&app)
    );
    app.world_mut().despawn(floor);
    ticks(&mut app, 60);
    assert!(lowest(&app) < -2.0, "it falls");
}

#[test]
fn the_order_of_bodies_is_that_in_which_they_came_whatever_they_carry() {
    let world = cubes();
    let (mut app, bodies, _) = app_of(&world);
    // Moves it to another table of the ECS.
    app.world_mut()
        .entity_mut(bodies[0])
        .insert(Collide::default());
    ticks(&mut app, 1);
    assert_eq!(plain::bodies_in_order(app.world_mut()), bodies);
}

macro_rules! types {
    (
        { $($first:ident { $($kind1:ident $field1:ident $(($($numbers:tt)*))? $does1:literal;)* })* }
        $stitches:ident $stitched:ident
        { $($second:ident { $($kind2:ident $field2:ident $does2:literal;)* })* }
        $grab:ident $grabbed:ident
        { $($third:ident { $($kind3:ident $field3:ident $does3:literal;)* })* }
    ) => {
        /// The types of all effects.
        fn types_of_effects() -> Vec<TypeId> {
            vec![
                $($(TypeId::of::<solver::$kind1>(),)*)*
                $($(TypeId::of::<solver::$kind2>(),)*)*
                $($(TypeId::of::<solver::$kind3>(),)*)*
                TypeId::of::<solver::$stitches>(),
                TypeId::of::<solver::$grab>(),
            ]
        }
    };
}

pliant::solver::effects!(types);

/// Inspectors, remote protocols and scenes of Bevy find the components by their types.
#[test]
fn components_are_registered_and_can_be_read_and_written_by_reflection() {
    let (mut app, bodies, _) = app_of(&cubes());
    let registry = app.world().resource::<AppTypeRegistry>().clone();
    let registry = registry.read();
    let mut types = types_of_effects();
    types.extend([
        TypeId::of::<SoftBody>(),
        TypeId::of::<BodyDensity>(),
        TypeId::of::<Pins>(),
        TypeId::of::<AddedMass>(),
        TypeId::of::<PinTargets>(),
    ]);
    for id in types {
        let known = registry.get_type_data::<ReflectComponent>(id);
        assert!(known.is_some(), "{:?}", registry.get_type_info(id));
    }
    let density = registry
        .get_type_data::<ReflectComponent>(TypeId::of::<BodyDensity>())
        .expect("registered");
    let body = app.world().entity(bodies[0]);
    let read = density.reflect(body).expect("a body has a density");
    let read: &BodyDensity = read.as_any().downcast_ref().expect("its type");
    assert_eq!(read.get(), 1000.0);
    let denser = BodyDensity(Density::of(500.0));
    let mut body = app.world_mut().entity_mut(bodies[0]);
    density.apply(&mut body, &denser);
    tick(app.world_mut());
    let particles = app.world().get::<Particles>(bodies[0]).expect("a body");
    let mass: f64 = particles
        .positions
        .iter()
        .map(|x| 1.0 / f64::from(x.w))
        .sum();
    // 0.4³ m³; eight roundings to f32.
    assert_relative(mass, 0.064 * 500.0, 1e-6, "mass in kg");
}
