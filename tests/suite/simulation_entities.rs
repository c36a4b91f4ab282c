//! Bodies as entities of user apps: cloned, with a replaced mesh.

use crate::support_app::ticks;
use bevy::prelude::*;
use pliant::{SoftBodyPlugins, effect::EffectRegistry, prelude::*, solver::EffectStates};

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
