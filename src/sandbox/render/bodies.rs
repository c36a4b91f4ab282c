//! Appearance of bodies: a material for each, and a rim highlight for the body under the pointer.

use crate::sandbox::{
    render::{
        material::{Finish, NO_GRAINS, SkinMaterial, linear, palette},
        stage::FloorHeight,
    },
    state::{look::HiddenBody, view::Hovered},
};
use crate::{
    render::{Drawn, GrainPositions, MeshSystems, SoftBodyMeshPlugin},
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
                    (dress, request_positions).before(MeshSystems),
                    upload_positions.after(MeshSystems),
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

/// Lets the graphics card move the spheres of grains.
fn request_positions(
    mut commands: Commands,
    bodies: Query<(Entity, &SoftBody), (Changed<SoftBody>, Without<GrainPositions>)>,
) {
    for (entity, body) in &bodies {
        if !body.radii.is_empty() {
            commands.entity(entity).insert(GrainPositions::default());
        }
    }
}

/// Copies the positions of grains into the buffers of their materials. A buffer is replaced when its size
/// changes, as the material binds the buffer itself.
fn upload_positions(
    bodies: Query<(&GrainPositions, &MeshMaterial3d<SkinMaterial>), Changed<GrainPositions>>,
    mut materials: ResMut<Assets<SkinMaterial>>,
    mut buffers: ResMut<Assets<ShaderBuffer>>,
) {
    for (GrainPositions(grains), material) in &bodies {
        let Some(known) = materials.get(&material.0).map(|it| it.grains.clone()) else {
            continue;
        };
        if grains.is_empty() {
            continue;
        }
        let size = size_of_val(&grains[..]);
        let fits = |buffer: &ShaderBuffer| buffer.data.as_ref().is_some_and(|it| it.len() == size);
        let is_own = known != NO_GRAINS && buffers.get(&known).is_some_and(fits);
        if is_own && let Some(mut buffer) = buffers.get_mut(&known) {
            buffer.set_data(grains.clone());
        } else if let Some(mut material) = materials.get_mut(&material.0) {
            material.grains = buffers.add(grains.clone());
        }
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
