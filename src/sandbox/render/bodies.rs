//! Appearance of bodies: a material for each, and a rim highlight for the body under the pointer.

use crate::sandbox::{
    render::{
        material::{Finish, SkinMaterial, linear, palette},
        stage::FloorHeight,
    },
    state::{look::HiddenBody, view::Hovered},
};
use crate::{
    render::{Drawn, GrainBuffer, MeshSystems, SoftBodyMeshPlugin},
    scene::{Look, copy_look},
    simulation::{SoftBody, SoftBodySystems},
    solver::topology::Dimension,
};
use bevy::{
    camera::visibility::{RenderLayers, VisibilitySystems::CheckVisibility},
    prelude::*,
    render::storage::ShaderBuffer,
};

/// Time constant of the highlight [s].
const FADE: f32 = 0.06;

/// Draws the soft bodies.
pub struct BodiesPlugin;

impl Plugin for BodiesPlugin {
    fn build(&self, app: &mut App) {
        app.add_plugins(SoftBodyMeshPlugin)
            .init_resource::<Hovered>()
            .add_observer(copy_look)
            .add_systems(Update, (highlight, recolor))
            .add_systems(
                PostUpdate,
                (
                    (dress, place_grains).chain().before(MeshSystems),
                    hide.before(CheckVisibility),
                )
                    .after(SoftBodySystems::Last),
            );
    }
}

/// Adds a material to new bodies.
fn dress(
    mut commands: Commands,
    new: Query<(Entity, &SoftBody, Option<&Look>), Without<MeshMaterial3d<SkinMaterial>>>,
    dressed: Query<(), (With<SoftBody>, With<MeshMaterial3d<SkinMaterial>>)>,
    floor: Res<FloorHeight>,
    mut materials: ResMut<Assets<SkinMaterial>>,
) {
    let first = dressed.iter().count();
    for (n, (entity, body, look)) in new.iter().enumerate() {
        let named = look.and_then(|look| look.color);
        let color = named.map_or_else(|| palette(first + n), linear);
        let finish = match body.0.dimension {
            Dimension::Solid => Finish::jelly(color),
            Dimension::Sheet => Finish::cloth(color),
            Dimension::Line => Finish::cord(color),
            Dimension::Grains => Finish::grain(color),
        };
        let finish = Finish {
            floor: floor.0.unwrap_or(f32::MIN),
            ..finish
        };
        let material = MeshMaterial3d(materials.add(SkinMaterial::new(finish)));
        commands.entity(entity).insert(material);
    }
}

/// Lets the graphics card place grains. A body with another number of them, such as a restored one, gets
/// another buffer: the material binds the buffer itself, which is replaced when it grows.
fn place_grains(
    mut commands: Commands,
    bodies: Query<
        (
            Entity,
            &SoftBody,
            &MeshMaterial3d<SkinMaterial>,
            Option<&GrainBuffer>,
        ),
        Or<(Changed<SoftBody>, Changed<MeshMaterial3d<SkinMaterial>>)>,
    >,
    mut materials: ResMut<Assets<SkinMaterial>>,
    mut buffers: ResMut<Assets<ShaderBuffer>>,
) {
    for (entity, body, material, buffer) in &bodies {
        if body.radii.is_empty() {
            continue;
        }
        let size = body.particles() * size_of::<Vec4>();
        let fits = |buffer: &GrainBuffer| {
            let known = buffers.get(&buffer.0).and_then(|it| it.data.as_ref());
            known.is_some_and(|data| data.len() == size)
        };
        let buffer = match buffer {
            Some(buffer) if fits(buffer) => buffer.clone(),
            _ => GrainBuffer::new(body.particles(), &mut buffers),
        };
        if let Some(mut material) = materials.get_mut(&material.0) {
            material.grains = buffer.0.clone();
        }
        commands.entity(entity).insert(buffer);
    }
}

/// Applies a color that was changed.
fn recolor(
    bodies: Query<(&Look, &MeshMaterial3d<SkinMaterial>), (With<SoftBody>, Changed<Look>)>,
    mut materials: ResMut<Assets<SkinMaterial>>,
) {
    for (look, material) in &bodies {
        if let Some(color) = look.color
            && let Some(mut material) = materials.get_mut(&material.0)
        {
            material.finish = material.finish.colored(linear(color));
        }
    }
}

/// Takes hidden bodies, and all that is drawn over them, out of the picture. By layers and not by
/// visibility, which the solver view uses.
fn hide(
    mut commands: Commands,
    hidden: Query<(Entity, Option<&Children>), With<HiddenBody>>,
    mut shown: RemovedComponents<HiddenBody>,
    bodies: Query<Option<&Children>, With<SoftBody>>,
    layers: Query<(), With<RenderLayers>>,
) {
    for body in shown.read() {
        if let Ok(children) = bodies.get(body) {
            for entity in children.into_iter().flatten().copied().chain([body]) {
                commands.entity(entity).remove::<RenderLayers>();
            }
        }
    }
    for (body, children) in &hidden {
        for entity in children.into_iter().flatten().copied().chain([body]) {
            if !layers.contains(entity) {
                commands.entity(entity).insert(RenderLayers::none());
            }
        }
    }
}

/// Lights the rim of the body under the pointer.
fn highlight(
    hovered: Res<Hovered>,
    time: Res<Time<Real>>,
    bodies: Query<(Entity, &MeshMaterial3d<SkinMaterial>), With<Drawn>>,
    mut materials: ResMut<Assets<SkinMaterial>>,
) {
    let fraction = 1.0 - (-time.delta_secs() / FADE).exp();
    for (body, material) in &bodies {
        let goal = if hovered.0 == Some(body) { 1.0 } else { 0.0 };
        let now = materials
            .get(&material.0)
            .map_or(goal, |m| m.finish.highlight);
        if now == goal {
            continue;
        }
        let next = now + (goal - now) * fraction;
        // A change below 0.01 is not worth another upload per frame.
        let next = if (goal - next).abs() < 0.01 {
            goal
        } else {
            next
        };
        if let Some(mut material) = materials.get_mut(&material.0) {
            material.finish.highlight = next;
        }
    }
}
