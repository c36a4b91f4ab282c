//! Actions that cannot be carried out: rejected with a reason, without any change.

use crate::support_app::{app, app_of, cubes, done, set, ticks};
use bevy::{ecs::message::Messages, prelude::*};
use pliant::{
    effect::{
        Collide, Effect, EffectPlugin, EffectPlugins, EffectUnfit, Pressure, Stretch, Volume,
        needs_plugin,
    },
    mesh::Primitive,
    simulation::{Action, Asleep, SimulationPlugin, SimulationSettings, SoftBody},
    solver::{
        Body, Density, Direct, Effects, Grab, NeoHookean, ParticleIndex, SurfacePoint, Topology,
        VertexIndex, World, deform::Deformation,
    },
};
use std::sync::Arc;

/// The message of an action that must be rejected and change nothing.
#[track_caller]
fn refused(app: &mut App, action: Action) -> String {
    let before = app.world().resource::<SimulationSettings>().0;
    let errors = done(app, action);
    assert_eq!(errors.len(), 1, "{errors:?}");
    assert_eq!(app.world().resource::<SimulationSettings>().0, before);
    errors[0].to_string()
}

#[test]
fn what_cannot_be_set_is_refused_with_the_word_and_the_choices() {
    let (mut app, bodies, _) = app_of(&cubes());
    let body = bodies[0];
    let message = refused(&mut app, set(body, "strech", "compliance", 1.0));
    assert!(
        message.contains("strech") && message.contains("stretch, bend, isometric_bend"),
        "{message}"
    );
    let message = refused(&mut app, set(body, "stretch", "stiffness", 1.0));
    assert!(message.contains("stretch.stiffness"), "{message}");
    assert!(
        message.contains("stretch.compliance, stretch.axial_stiffness, stretch.damping"),
        "{message}"
    );
    let message = refused(&mut app, set(body, "stretch", "compliance", -1.0));
    assert!(
        message.contains("stretch.compliance") && message.contains("-1"),
        "{message}"
    );
    assert!(message.contains("between 0 and 1e12"), "{message}");
    let message = refused(&mut app, set(body, "collide", "friction", 1.0));
    assert!(message.contains("collide"), "{message}");
    assert!(app.world().get::<Collide>(body).is_none());
}

#[test]
fn settings_are_set_by_name_and_refused_with_the_choices() {
    let (mut app, ..) = app_of(&cubes());
    let set = |name: &str, value: f64| Action::SetSetting {
        name: name.into(),
        value,
    };
    for (name, value) in [
        ("gravity_y", -1.5),
        ("rate", 30.0),
        ("substeps", 20.0),
        ("iterations", 2.0),
    ] {
        assert!(done(&mut app, set(name, value)).is_empty());
        let settings = app.world().resource::<SimulationSettings>().0;
        assert_eq!(pliant::simulation::setting(&settings, name), Some(value));
    }
    for (name, value, words) in [
        ("substeps", 0.0, ["substeps", "between 1 and 10000"]),
        ("substeps", 2.5, ["2.5", "whole number"]),
        ("rate", f64::NAN, ["NaN", "ticks per second"]),
        ("rate", -60.0, ["-60", "ticks per second"]),
        ("gravity_x", f64::INFINITY, ["inf", "finite"]),
        (
            "gravity",
            1.0,
            ["gravity", "gravity_x, gravity_y, gravity_z, rate"],
        ),
    ] {
        let message = refused(&mut app, set(name, value));
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
    }
}

#[test]
fn a_grab_of_a_missing_particle_or_a_non_finite_target_is_refused() {
    let (mut app, bodies, _) = app_of(&cubes());
    let grab = |target: Vec3, particle: u32| Action::Grab {
        body: bodies[0],
        point: SurfacePoint::new(&[(ParticleIndex(particle), 1.0)]).expect("sound"),
        target,
    };
    refused(&mut app, grab(Vec3::ZERO, 8));
    refused(&mut app, grab(Vec3::new(f32::NAN, 0.0, 0.0), 0));
    assert!(app.world().get::<Grab>(bodies[0]).is_none());
}

#[test]
fn an_action_on_a_removed_body_is_refused() {
    let (mut app, bodies, _) = app_of(&cubes());
    let body = bodies[0];
    assert!(done(&mut app, Action::Despawn { body }).is_empty());
    let gone = [
        Action::Release { body },
        Action::Despawn { body },
        Action::Pin {
            body,
            vertex: VertexIndex(0),
        },
        set(body, "stretch", "compliance", 0.0),
        Action::Deform {
            body,
            deformation: Deformation::Mirror,
        },
    ];
    for action in gone {
        let message = refused(&mut app, action);
        assert!(message.contains("no such body"), "{message}");
    }
}

#[test]
fn an_entity_that_is_no_body_is_refused() {
    let mut app = app();
    let body = app.world_mut().spawn_empty().id();
    let message = refused(&mut app, Action::Release { body });
    assert!(message.contains("no such body"), "{message}");
    assert!(app.world().get::<SoftBody>(body).is_none());
}

#[test]
fn a_particle_or_an_effect_that_does_not_exist_is_refused() {
    let (mut app, bodies, _) = app_of(&cubes());
    let (body, vertex) = (bodies[0], VertexIndex(99));
    let message = refused(&mut app, Action::Pin { body, vertex });
    assert!(
        message.contains("vertex 99") && message.contains('8'),
        "{message}"
    );
    let effect = String::from("breeze");
    let message = refused(&mut app, Action::AddEffect { body, effect });
    assert!(
        message.contains("breeze") && message.contains("sticky_ground"),
        "{message}"
    );
}

/// An app with a sleeping cube of `cells`³ cells with these effects.
fn sleeping_cube(cells: u32, effects: Effects) -> (App, Entity) {
    let size = Vec3::ONE;
    let cells = UVec3::splat(cells);
    let mesh = Primitive::Box { size, cells }.build().expect("sound");
    let topology = Arc::new(Topology::new(mesh.shape).expect("sound"));
    let mut body = Body::new("cube", topology, Density::of(1000.0));
    body.effects = effects;
    body.update_masses();
    let mut world = World {
        bodies: vec![body],
        ..World::default()
    };
    world.settings.set_gravity(Vec3::ZERO).expect("finite");
    let (mut app, bodies, _) = app_of(&world);
    ticks(&mut app, 2);
    app.world_mut().entity_mut(bodies[0]).insert(Asleep);
    ticks(&mut app, 2);
    assert!(app.world().get::<Asleep>(bodies[0]).is_some(), "it sleeps");
    (app, bodies[0])
}

/// A body that carries an effect which cannot act on it is saved as a scene that does not load.
#[test]
fn a_parameter_that_stops_another_effect_is_refused_and_wakes_nothing() {
    let effects = Effects {
        neo_hookean: Some(NeoHookean::default()),
        direct: Some(Direct),
        ..Effects::default()
    };
    let (mut app, body) = sleeping_cube(2, effects);
    let modulus = |app: &App| {
        app.world()
            .get::<NeoHookean>(body)
            .map(|it| it.youngs_modulus)
    };
    let before = modulus(&app);
    let message = refused(
        &mut app,
        set(body, "neo_hookean", "youngs_modulus", f64::INFINITY),
    );
    assert!(
        message.starts_with("cannot change neo_hookean.youngs_modulus: "),
        "{message}"
    );
    assert!(
        message.contains("direct") && message.contains("finite Young's modulus"),
        "{message}"
    );
    assert_eq!(modulus(&app), before);
    ticks(&mut app, 1);
    assert!(
        app.world().get::<Asleep>(body).is_some(),
        "a refused value woke it"
    );
    // Other values, and those of a body without the direct solver, are accepted.
    assert!(done(&mut app, set(body, "neo_hookean", "youngs_modulus", 2e6)).is_empty());
    app.world_mut().entity_mut(body).remove::<Direct>();
    let rigid = set(body, "neo_hookean", "youngs_modulus", f64::INFINITY);
    assert!(done(&mut app, rigid).is_empty());
}

/// The factorization of 24 cells along each side exceeds the limit, once something couples them.
#[test]
fn an_effect_that_stops_another_one_is_not_added_and_wakes_nothing() {
    let effects = Effects {
        direct: Some(Direct),
        ..Effects::default()
    };
    let add = |body| Action::AddEffect {
        body,
        effect: "stretch".into(),
    };
    let (mut app, body) = sleeping_cube(24, effects);
    let message = refused(&mut app, add(body));
    assert!(
        message.starts_with("cannot add stretch to the body: "),
        "{message}"
    );
    assert!(
        message.contains("direct") && message.contains("use fewer cells"),
        "{message}"
    );
    assert!(app.world().get::<Stretch>(body).is_none());
    ticks(&mut app, 1);
    assert!(
        app.world().get::<Asleep>(body).is_some(),
        "a refused effect woke it"
    );

    let (mut app, body) = sleeping_cube(2, effects);
    assert!(done(&mut app, add(body)).is_empty());
    assert!(app.world().get::<Stretch>(body).is_some());
}

/// Where something is already unfit, its body can still be edited.
#[test]
fn an_unfit_body_can_be_changed() {
    let effects = Effects {
        stretch: Some(Stretch::default()),
        direct: Some(Direct),
        ..Effects::default()
    };
    let (mut app, body) = sleeping_cube(24, effects);
    assert!(done(&mut app, set(body, "stretch", "compliance", 1e-3)).is_empty());
    let effect = "volume".into();
    assert!(done(&mut app, Action::AddEffect { body, effect }).is_empty());
    assert!(app.world().get::<Volume>(body).is_some());
}

/// An effect that has nothing to act on is refused as an action, and as a component it says so.
#[test]
fn an_effect_that_cannot_act_on_a_body_says_so_once() {
    let mut app = app();
    let cloth = SoftBody::cloth(Vec2::ONE, UVec2::splat(3)).build();
    let body = app
        .world_mut()
        .spawn((
            cloth,
            Name::new("sheet"),
            Stretch::default(),
            Volume::default(),
        ))
        .id();
    let said = |app: &mut App| -> Vec<String> {
        let mut messages = app.world_mut().resource_mut::<Messages<EffectUnfit>>();
        messages.drain().map(|message| message.text).collect()
    };
    let mut all = Vec::new();
    for _ in 0..10 {
        ticks(&mut app, 1);
        all.extend(said(&mut app));
    }
    assert_eq!(all.len(), 1, "{all:?}");
    for word in ["volume", "“sheet”", "0 tetrahedra", "18 triangles"] {
        assert!(all[0].contains(word), "{}", all[0]);
    }
    let add = Action::AddEffect {
        body,
        effect: "neo_hookean".into(),
    };
    let message = refused(&mut app, add);
    assert!(message.contains("0 tetrahedra"), "{message}");
    // An open sheet encloses no air.
    app.world_mut().entity_mut(body).insert(Pressure::default());
    ticks(&mut app, 1);
    let all = said(&mut app);
    assert!(all.len() == 1 && all[0].contains("pressure"), "{all:?}");
}

/// A component whose plugin was left out does nothing, and says so.
#[test]
fn an_effect_without_its_plugin_says_so() {
    let mut app = App::new();
    let effects = EffectPlugins.without("volume");
    app.add_plugins((MinimalPlugins, SimulationPlugin::default(), effects));
    let cube = SoftBody::cuboid(Vec3::ONE, UVec3::ONE).build();
    app.world_mut()
        .spawn((cube, Stretch::default(), Volume::default()));
    ticks(&mut app, 2);
    let mut messages = app.world_mut().resource_mut::<Messages<EffectUnfit>>();
    let all: Vec<String> = messages.drain().map(|message| message.text).collect();
    assert_eq!(all.len(), 1, "{all:?}");
    for word in ["volume", "EffectPlugin::<Volume>::default()"] {
        assert!(all[0].contains(word), "{}", all[0]);
    }
}

/// An effect of an app, whose component asks for its plugin.
#[derive(Component, Clone, Default)]
#[component(on_add = needs_plugin::<Breeze>)]
struct Breeze;

impl Effect for Breeze {
    const NAME: &'static str = "breeze";
    const TITLE: &'static str = "Breeze";
    const SUMMARY: &'static str = "Does nothing.";
    type State = ();
}

#[test]
fn an_effect_of_an_app_without_its_plugin_says_so() {
    for has_plugin in [false, true] {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, pliant::SoftBodyPlugins::default()));
        if has_plugin {
            app.add_plugins(EffectPlugin::<Breeze>::default());
        }
        let cube = SoftBody::cuboid(Vec3::ONE, UVec3::ONE).build();
        let body = app.world_mut().spawn((cube, Breeze)).id();
        let mut messages = app.world_mut().resource_mut::<Messages<EffectUnfit>>();
        let all: Vec<EffectUnfit> = messages.drain().collect();
        assert_eq!(all.len(), usize::from(!has_plugin), "{all:?}");
        for message in all {
            assert_eq!((message.body, message.effect), (body, "breeze"));
            assert!(message.text.contains("EffectPlugin::<Breeze>::default()"));
        }
    }
}
