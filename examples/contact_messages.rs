//! A jelly cube falls on a table, slides off it and lands on the ground: messages and forces.
//! `cargo run --release --example contact_messages`

use bevy::{prelude::*, time::TimeUpdateStrategy};
use pliant::{
    prelude::*,
    simulation::{
        BodyContacts, ContactSurface, RecordContacts, SoftBodySystems, SurfaceContactEnded,
        SurfaceContactStarted,
    },
    solver::{Collider, ColliderShape, Pose, contact::rotation},
};
use std::time::Duration;

#[derive(Component)]
struct Table;

fn main() {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, SoftBodyPlugins::default()))
        .insert_resource(RecordContacts(true))
        .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f64(
            1.0 / 60.0,
        )))
        .add_systems(PostUpdate, hear.after(SoftBodySystems::Step));
    let size = Vec3::new(1.0, 0.1, 1.0); // m
    let pose = Pose {
        rotation: rotation(Vec3::Z.as_dvec3(), -0.7), // rad
        translation: Vec3::Y.as_dvec3(),
    };
    let table = Collider::new(ColliderShape::Box { size }, pose).expect("a size above 0");
    app.world_mut().spawn((Table, table));
    let jelly = SoftBody::cuboid(Vec3::splat(0.2), UVec3::splat(2)) // m
        .at(Vec3::Y * 1.5)
        .density(Density::of(1000.0)); // kg/m³
    app.world_mut().spawn((
        jelly.build(),
        Stretch::default(),
        Volume::default(),
        Ground::default(),
        Collide::default(),
    ));
    (0..120).for_each(|_| app.update());
}

fn hear(
    mut started: MessageReader<SurfaceContactStarted>,
    mut ended: MessageReader<SurfaceContactEnded>,
    contacts: Res<BodyContacts>,
    table: Single<Entity, With<Table>>,
    time: Res<Time>,
) {
    let name = |surface| match surface {
        ContactSurface::Collider(entity) if entity == *table => "table",
        ContactSurface::Collider(_) => "another collider",
        ContactSurface::Ground => "ground",
    };
    let time = time.elapsed_secs();
    for hit in started.read() {
        let mut forces = contacts.surfaces();
        if let Some(it) = forces.find(|it| (it.body, it.surface) == (hit.body, hit.surface)) {
            let (name, force) = (name(hit.surface), it.normal_force);
            println!("{time:.2} s: hits the {name} with {force:.0} N");
        }
    }
    for left in ended.read() {
        println!("{time:.2} s: leaves the {}", name(left.surface));
    }
}
