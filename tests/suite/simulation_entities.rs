//! Bodies as entities of user apps: cloned, with a replaced mesh, with plugins in any order.

use crate::support_app::ticks;
use bevy::prelude::*;
use pliant::{
    SoftBodyPlugins,
    effect::{Effect, EffectPlugin, EffectRegistry, Parameter},
    prelude::*,
    solver::EffectStates,
    solver::InvalidValue,
};

fn app() -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, SoftBodyPlugins::default()));
    app
}

#[test]
fn a_clone_of_a_body_carries_the_same_effects_and_moves_the_same_way() {
    let mut app = app();
    let body = SoftBody::cuboid(Vec3::ONE, UVec3::splat(2)).at(Vec3::Y);
    let body = app
        .world_mut()
        .spawn((
            body.build(),
            Stretch {
                compliance: Compliance::of(1e-4),
                ..default()
            },
            Volume::default(),
            Ground::default(),
            Wind::default(),
        ))
        .id();
    ticks(&mut app, 5);
    let clone = app.world_mut().entity_mut(body).clone_and_spawn();
    let registry = app.world().resource::<EffectRegistry>();
    for info in registry.iter() {
        let [of_body, of_clone] = [body, clone].map(|entity| {
            let entity = app.world().entity(entity);
            let values = (0..info.parameters.len()).map(|i| (info.get)(&entity, i));
            ((info.present)(&entity), values.collect::<Vec<_>>())
        });
        assert_eq!(of_body, of_clone, "{}", info.name);
    }
    ticks(&mut app, 30);
    let positions = |entity| {
        app.world()
            .get::<Particles>(entity)
            .expect("a body")
            .positions
            .clone()
    };
    assert_eq!(positions(body), positions(clone));
}

#[test]
fn a_body_can_be_given_another_mesh() {
    let mut app = app();
    let coarse = SoftBody::cuboid(Vec3::ONE, UVec3::splat(2))
        .at(Vec3::Y * 2.0)
        .pinned([0]);
    let body = app
        .world_mut()
        .spawn((
            coarse.build(),
            Stretch::default(),
            Volume::default(),
            Tethers::default(),
            ShapeMatching::default(),
        ))
        .id();
    ticks(&mut app, 5);
    let (finer, ..) = SoftBody::cuboid(Vec3::ONE, UVec3::splat(4)).build();
    let count = finer.particles();
    app.world_mut().entity_mut(body).insert(finer);
    ticks(&mut app, 30);
    let body = app.world().entity(body);
    let particles = body.get::<Particles>().expect("a body");
    assert_eq!(particles.len(), count);
    assert_eq!(particles.first_not_finite(), None);
    assert!(body.get::<EffectStates>().is_some());
}

#[derive(Component, Debug, Clone, Copy, Default)]
struct Breeze;

impl Effect for Breeze {
    const NAME: &'static str = "breeze";
    const TITLE: &'static str = "Breeze";
    const SUMMARY: &'static str = "Nothing much.";
    const PARAMETERS: &'static [Parameter<Self>] = &[Parameter {
        name: "speed",
        title: "Speed",
        unit: "m/s",
        help: "None.",
        range: (0.0, 1.0),
        scale: pliant::effect::Scale::Linear,
        get: |_| 0.0,
        set: |_, _| Ok::<(), InvalidValue>(()),
    }];
    type State = ();
}

#[test]
fn plugins_can_be_added_in_any_order() {
    for first in [true, false] {
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
        app.world_mut().spawn((body, Stretch::default(), Breeze));
        ticks(&mut app, 3);
        let registry = app.world().resource::<EffectRegistry>();
        assert!(registry.get("breeze").is_some() && registry.get("stretch").is_some());
    }
}
