//! One mesh a body, brought to where the body is between two ticks.
//!
//! The simulation knows nothing of it: when a body appears it is given a mesh and a material,
//! and each frame its surface is interpolated, given normals, and written in place. A body
//! that did not move since the last frame (asleep, or paused) costs nothing.

use super::{
    drawn::{Drawn, Outline},
    material::{Finish, SkinMaterial, linear, palette},
    pointer::Pointer,
    stage::FloorHeight,
    surface::{CREASE, ROUND},
};
use crate::{
    scene::{BodySkin, Look},
    simulation::{Asleep, SimulationClock, SoftBody, SoftBodySystems, TickStart},
    solver::{Particles, Topology, topology::Dimension},
};
use bevy::{
    camera::{primitives::Aabb, visibility::NoAutoAabb},
    prelude::*,
};
use std::sync::Arc;

/// Thickness of a rope as a share of its length, and at most of a segment.
const ROPE: (f32, f32) = (0.012, 0.45);
/// How fast a highlight comes and goes: all but 1/e of it in this time [s].
const FADE: f32 = 0.06;

/// Draws the soft bodies.
pub struct BodiesPlugin;

/// Systems that bring the drawn bodies up to date, in `PostUpdate` before anything is culled.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct BodySystems;

impl Plugin for BodiesPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Pointer>()
            .add_systems(Update, highlight)
            .add_systems(
                PostUpdate,
                (dress, interpolate, upload)
                    .chain()
                    .in_set(BodySystems)
                    .after(SoftBodySystems::Last)
                    .before(TransformSystems::Propagate)
                    .before(bevy::camera::visibility::VisibilitySystems::CalculateBounds),
            );
    }
}

/// What was drawn last, so that a body that stands still is left alone.
#[derive(Component, Debug, Default)]
struct Shown {
    /// Share of the tick that it was drawn at.
    share: Option<f32>,
    /// It was asleep already.
    asleep: bool,
}

/// Gives a new body its mesh and material.
fn dress(
    mut commands: Commands,
    new: Query<(Entity, &SoftBody, Option<&BodySkin>, Option<&Look>), Without<Drawn>>,
    dressed: Query<(), With<Drawn>>,
    floor: Res<FloorHeight>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<SkinMaterial>>,
) {
    let first = dressed.iter().count();
    for (n, (entity, body, skin, look)) in new.iter().enumerate() {
        let topology = &body.0;
        let outline = Arc::new(outline(topology, skin));
        let named = look.and_then(|look| look.colour);
        let colour = named.map_or_else(|| palette(first + n), linear);
        let finish = match topology.dimension {
            Dimension::Solid => Finish::jelly(colour),
            Dimension::Sheet => Finish::cloth(colour),
            Dimension::Line => Finish::cord(colour),
        };
        let finish = Finish {
            floor: floor.0.unwrap_or(f32::MIN),
            ..finish
        };
        commands.entity(entity).insert((
            Mesh3d(meshes.add(outline.mesh())),
            MeshMaterial3d(materials.add(SkinMaterial { finish })),
            (Drawn::new(outline), Shown::default()),
            (Aabb::default(), NoAutoAabb),
        ));
    }
}

/// A cube of fewer triangles than this has cells too large to be rounded by.
const FINE: usize = 96;

/// What never changes of a body's form: its skin, its coarse surface, or its edges.
fn outline(topology: &Topology, skin: Option<&BodySkin>) -> Outline {
    if let Some(BodySkin(skin)) = skin {
        let mut points = Vec::new();
        skin.deform(|i| topology.rest[i as usize], &mut points);
        return Outline::surface(&points, skin.triangles.clone(), true, CREASE);
    }
    if !topology.triangles.is_empty() {
        let triangles = topology.triangles.clone();
        let closed = topology.dimension == Dimension::Solid;
        let crease = if closed && triangles.len() >= FINE {
            ROUND
        } else {
            CREASE
        };
        return Outline::surface(&topology.rest, triangles, closed, crease);
    }
    let shortest = topology
        .edges
        .rest_length
        .iter()
        .copied()
        .fold(f32::MAX, f32::min);
    let radius = (ROPE.0 * topology.size).min(ROPE.1 * shortest);
    Outline::rope(topology.edges.ends().collect::<Vec<_>>(), radius)
}

/// Brings points and normals to where the body is at this instant.
fn interpolate(
    clock: Res<SimulationClock>,
    mut bodies: Query<(
        &SoftBody,
        Ref<Particles>,
        &TickStart,
        Option<&BodySkin>,
        Has<Asleep>,
        &mut Drawn,
        &mut Shown,
    )>,
) {
    let share = clock.overstep();
    bodies.par_iter_mut().for_each(
        |(body, particles, start, skin, asleep, mut drawn, mut shown)| {
            let still = shown.share == Some(share) || (asleep && shown.asleep);
            if still && !particles.is_changed() {
                return;
            }
            let between = start.positions.iter().zip(&particles.positions);
            let between = between.map(|(a, b)| a.lerp(*b, share));
            place(&mut drawn, body, skin, between);
            *shown = Shown {
                share: Some(share),
                asleep,
            };
        },
    );
}

/// Brings a form to where the particles of its body are.
pub fn place(
    drawn: &mut Drawn,
    body: &SoftBody,
    skin: Option<&BodySkin>,
    particles: impl Iterator<Item = Vec4>,
) {
    let Drawn {
        particles: now,
        points,
        ..
    } = drawn;
    now.clear();
    now.extend(particles);
    let numbering = &body.numbering;
    let at = |vertex: u32| now[numbering.particle(vertex) as usize].truncate();
    match skin {
        Some(BodySkin(skin)) => skin.deform(at, points),
        None => {
            points.clear();
            points.extend(now.iter().map(|x| x.truncate()));
        }
    }
    drawn.refresh();
}

/// Copies what was interpolated into the meshes.
fn upload(
    mut bodies: Query<(&Drawn, &Mesh3d, &mut Aabb), Changed<Drawn>>,
    mut meshes: ResMut<Assets<Mesh>>,
) {
    for (drawn, mesh, mut bounds) in &mut bodies {
        if let Some(mut mesh) = meshes.get_mut(&mesh.0) {
            *bounds = drawn.write(&mut mesh);
        }
    }
}

/// Lights the rim of the body under the pointer.
fn highlight(
    pointer: Res<Pointer>,
    time: Res<Time<Real>>,
    bodies: Query<(Entity, &MeshMaterial3d<SkinMaterial>), With<Drawn>>,
    mut materials: ResMut<Assets<SkinMaterial>>,
) {
    let share = 1.0 - (-time.delta_secs() / FADE).exp();
    for (body, material) in &bodies {
        let goal = if pointer.hovered == Some(body) {
            1.0
        } else {
            0.0
        };
        let now = materials
            .get(&material.0)
            .map_or(goal, |m| m.finish.highlight);
        if now == goal {
            continue;
        }
        let next = now + (goal - now) * share;
        // The last hundredth is not worth another upload a frame.
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
