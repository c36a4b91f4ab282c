//! Moves, turns and resizes colliders with the pointer.
//!
//! A press on a collider selects it and drags it in the plane parallel to the screen. The selected
//! collider has handles: arrows move it along an axis of the world, arcs turn it about one, and
//! squares resize it about its center. Everything goes through [`Actions`]; during a drag, the
//! collider moves at the mean velocity of the pointer, so that it pushes bodies.

use super::{
    drag::{at_depth, simulated},
    pointer::{HoveredHandle, LocateSystems, OwnSystems, Pointer, PointerOwner, PointerSystems},
};
use crate::{
    sandbox::{
        render::{
            camera::{CameraSystems, OrbitCamera},
            orbit::FIELD_OF_VIEW,
            overlay::{OverlaySystems, Screen, painter},
        },
        state::{collider::shown_pose, view::SelectedCollider},
    },
    simulation::{Action, Actions, SimulationClock},
    solver::{Collider, ColliderShape, Pose, contact::rotation},
};
use bevy::{math::DVec3, prelude::*, window::PrimaryWindow};
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{Color32, Pos2, Rect, Stroke, StrokeKind, vec2},
};

/// Length of the arrows [logical px].
const ARM: f32 = 90.0;
/// Radius of the arcs, as a fraction of it.
const ARC: f32 = 0.62;
/// Gap between a face and its square, as a fraction of it.
const GAP: f32 = 0.16;
/// Distance within which a handle is under the pointer [logical px].
const REACH: f32 = 9.0;
/// Limits of lengths [m].
const LENGTHS: (f32, f32) = (0.01, 100.0);
const COLORS: [Color32; 3] = [
    Color32::from_rgb(222, 70, 66),
    Color32::from_rgb(86, 170, 74),
    Color32::from_rgb(66, 122, 222),
];

/// A part of a collider by which it is dragged. Numbers are axes: 0 is x.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Handle {
    /// The collider itself.
    Free,
    /// Moves along an axis of the world.
    Move(usize),
    /// Turns about an axis of the world.
    Turn(usize),
    /// Resizes along an axis of the collider.
    Size(usize),
}

/// The collider that is dragged, and the handle under the pointer.
#[derive(Resource, Debug, Default)]
struct ColliderDrag {
    hovered: Option<Handle>,
    held: Option<Held>,
}

/// A dragged collider.
#[derive(Debug, Clone, PartialEq)]
struct Held {
    collider: Entity,
    handle: Handle,
    /// Shape and pose at the press.
    start: (ColliderShape, Pose),
    /// Shape and pose that were last set.
    now: (ColliderShape, Pose),
    /// The pointer at the press.
    press: Ray3d,
    /// Depth of the point under it along the view direction [m].
    depth: f32,
}

/// Lets the user move colliders.
pub struct GizmoPlugin;

impl Plugin for GizmoPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<ColliderDrag>()
            .init_resource::<SelectedCollider>()
            .add_systems(
                Update,
                (
                    hover.after(LocateSystems).before(OwnSystems),
                    (select, pull)
                        .chain()
                        .after(PointerSystems)
                        .before(CameraSystems),
                ),
            )
            .add_systems(EguiPrimaryContextPass, paint.in_set(OverlaySystems));
    }
}

/// The handles of a shape with their places [m], for arrows of a length [m].
fn handles(shape: &ColliderShape, pose: &Pose, arm: f32) -> Vec<(Handle, Vec3)> {
    let center = pose.translation.as_vec3();
    let mut all = Vec::new();
    for axis in 0..3 {
        all.push((Handle::Move(axis), center + Vec3::AXES[axis] * arm));
        let [a, b] = others(axis);
        let diagonal = (a + b).normalize();
        all.push((Handle::Turn(axis), center + diagonal * (ARC * arm)));
    }
    for axis in 0..3 {
        if let Some(half) = half_length(shape, axis) {
            let way = outward(pose, axis) * (reach(shape, axis, half) + GAP * arm);
            all.push((Handle::Size(axis), center + way));
        }
    }
    all
}

/// The other two axes, so that a rotation by the right-hand rule takes the first to the second.
fn others(axis: usize) -> [Vec3; 2] {
    [Vec3::AXES[(axis + 1) % 3], Vec3::AXES[(axis + 2) % 3]]
}

/// Direction in which a size is dragged: against the axis of the collider, so that the squares are
/// not below the arrows.
fn outward(pose: &Pose, axis: usize) -> Vec3 {
    (pose.rotation * -DVec3::AXES[axis]).as_vec3()
}

/// The length that is changed along an axis, or half of it [m].
fn half_length(shape: &ColliderShape, axis: usize) -> Option<f32> {
    match (shape, axis) {
        (ColliderShape::Sphere { radius } | ColliderShape::Capsule { radius, .. }, 0) => {
            Some(*radius)
        }
        (ColliderShape::Capsule { length, .. }, 1) => Some(length / 2.0),
        (ColliderShape::Box { size }, axis) => Some(size[axis] / 2.0),
        _ => None,
    }
}

/// Distance of the surface along an axis from the center [m].
fn reach(shape: &ColliderShape, axis: usize, half: f32) -> f32 {
    match (shape, axis) {
        (ColliderShape::Capsule { radius, .. }, 1) => half + radius,
        _ => half,
    }
}

/// The shape with a half length [m] along an axis.
fn resized(shape: &ColliderShape, axis: usize, half: f32) -> ColliderShape {
    let half = half.clamp(LENGTHS.0 / 2.0, LENGTHS.1 / 2.0);
    let mut shape = shape.clone();
    match (&mut shape, axis) {
        (ColliderShape::Sphere { radius } | ColliderShape::Capsule { radius, .. }, 0) => {
            *radius = half;
        }
        (ColliderShape::Capsule { length, .. }, 1) => *length = 2.0 * half,
        (ColliderShape::Box { size }, axis) => size[axis] = 2.0 * half,
        _ => {}
    }
    shape
}

/// Parameter [m] of the point of a line through `center` that is nearest to a ray; `None` if they
/// are nearly parallel.
fn along(ray: Ray3d, center: Vec3, axis: Vec3) -> Option<f32> {
    let direction = ray.direction.as_vec3();
    let cosine = axis.dot(direction);
    let sine_squared = 1.0 - cosine * cosine;
    let apart = ray.origin - center;
    (sine_squared > 1e-3).then(|| (axis.dot(apart) - cosine * direction.dot(apart)) / sine_squared)
}

/// Angle about an axis through `center` at which a ray meets the plane across it [rad].
fn angle(ray: Ray3d, center: Vec3, axis: usize) -> Option<f32> {
    let normal = Vec3::AXES[axis];
    let cosine = ray.direction.dot(normal);
    if cosine.abs() < 0.02 {
        return None;
    }
    let distance = (center - ray.origin).dot(normal) / cosine;
    let way = ray.get_point(distance) - center;
    let [a, b] = others(axis);
    (distance > 0.0).then(|| way.dot(b).atan2(way.dot(a)))
}

impl Held {
    /// Shape and pose for a pointer; `None` where it has no meaning.
    fn at(&self, ray: Ray3d, forward: Vec3) -> Option<(ColliderShape, Pose)> {
        let (shape, pose) = &self.start;
        let center = pose.translation.as_vec3();
        let moved = |by: Vec3| {
            let translation = pose.translation + by.as_dvec3();
            (
                shape.clone(),
                Pose {
                    translation,
                    ..*pose
                },
            )
        };
        match self.handle {
            Handle::Free => {
                let [now, press] = [ray, self.press].map(|it| at_depth(it, forward, self.depth));
                Some(moved(now? - press?))
            }
            Handle::Move(axis) => {
                let axis = Vec3::AXES[axis];
                let way = along(ray, center, axis)? - along(self.press, center, axis)?;
                Some(moved(axis * way))
            }
            Handle::Turn(axis) => {
                let turn = angle(ray, center, axis)? - angle(self.press, center, axis)?;
                let turn = rotation(DVec3::AXES[axis], turn.into());
                let rotation = turn * pose.rotation;
                Some((shape.clone(), Pose { rotation, ..*pose }))
            }
            Handle::Size(axis) => {
                let out = outward(pose, axis);
                let way = along(ray, center, out)? - along(self.press, center, out)?;
                let half = half_length(shape, axis)? + way;
                Some((resized(shape, axis, half), *pose))
            }
        }
    }
}

/// Length of the arrows of a collider [m], which is the same on the screen everywhere.
fn arm(eye: &GlobalTransform, center: Vec3, height: f32) -> f32 {
    let depth = (center - eye.translation()).dot(eye.forward().as_vec3());
    let per_pixel = 2.0 * (FIELD_OF_VIEW / 2.0).tan() / height.max(1.0);
    depth.max(0.05) * per_pixel * ARM
}

/// Finds the handle under the pointer.
fn hover(
    pointer: Res<Pointer>,
    camera: Single<(&Camera, &GlobalTransform), With<OrbitCamera>>,
    window: Single<&Window, With<PrimaryWindow>>,
    clock: Res<SimulationClock>,
    colliders: Query<&Collider>,
    mut selected: ResMut<SelectedCollider>,
    mut drag: ResMut<ColliderDrag>,
    mut hovered: ResMut<HoveredHandle>,
) {
    if selected.0.is_some_and(|it| !colliders.contains(it)) {
        selected.0 = None;
    }
    if pointer.owner != PointerOwner::None {
        return;
    }
    drag.hovered = None;
    hovered.hovered = None;
    let (Some(entity), Some(at)) = (selected.0, pointer.position) else {
        return;
    };
    let Ok(collider) = colliders.get(entity) else {
        return;
    };
    let (camera, eye) = *camera;
    let screen = Screen { camera, eye };
    let pose = shown_pose(collider, clock.time(), &clock);
    let arm = arm(eye, pose.translation.as_vec3(), window.height());
    let at = Pos2::new(at.x, at.y);
    let near = handles(&collider.shape, &pose, arm)
        .into_iter()
        .filter_map(|(handle, place)| Some((handle, screen.at(place)?.distance(at))))
        .filter(|(_, away)| *away <= REACH)
        .min_by(|a, b| a.1.total_cmp(&b.1));
    if let Some((handle, _)) = near {
        drag.hovered = Some(handle);
        hovered.hovered = Some(entity);
    }
}

/// Selects the collider that is pressed, and deselects it when anything else is.
fn select(
    pointer: Res<Pointer>,
    mouse: Res<ButtonInput<MouseButton>>,
    camera: Single<&GlobalTransform, With<OrbitCamera>>,
    clock: Res<SimulationClock>,
    colliders: Query<&Collider>,
    mut selected: ResMut<SelectedCollider>,
    mut drag: ResMut<ColliderDrag>,
) {
    if !mouse.just_pressed(MouseButton::Left) {
        return;
    }
    match pointer.owner {
        PointerOwner::Collider(collider) => {
            let (Some(press), Ok(found)) = (pointer.ray, colliders.get(collider)) else {
                return;
            };
            selected.0 = Some(collider);
            let pose = shown_pose(found, clock.time(), &clock);
            let place = pointer
                .collider
                .filter(|hit| hit.collider == collider)
                .map_or(pose.translation.as_vec3(), |hit| {
                    press.get_point(hit.distance)
                });
            let depth = (place - camera.translation()).dot(camera.forward().as_vec3());
            let start = (found.shape.clone(), pose);
            drag.held = Some(Held {
                collider,
                handle: drag.hovered.unwrap_or(Handle::Free),
                now: start.clone(),
                start,
                press,
                depth,
            });
        }
        PointerOwner::Body(_) | PointerOwner::Scissors | PointerOwner::Spent => selected.0 = None,
        PointerOwner::None | PointerOwner::Panel | PointerOwner::Camera => {}
    }
}

/// Drags the collider.
fn pull(
    pointer: Res<Pointer>,
    camera: Single<&GlobalTransform, With<OrbitCamera>>,
    (time, clock): (Res<Time<Real>>, Res<SimulationClock>),
    mut drag: ResMut<ColliderDrag>,
    mut actions: ResMut<Actions>,
) {
    let Some(held) = drag.bypass_change_detection().held.as_mut() else {
        return;
    };
    if pointer.owner != PointerOwner::Collider(held.collider) {
        drag.held = None;
        return;
    }
    let forward = camera.forward().as_vec3();
    let Some((shape, pose)) = pointer.ray.and_then(|ray| held.at(ray, forward)) else {
        return;
    };
    if (&shape, &pose) == (&held.now.0, &held.now.1) {
        return;
    }
    actions.push(Action::SetCollider {
        collider: held.collider,
        shape: (shape != held.now.0).then(|| shape.clone()),
        pose,
        seconds: simulated(time.delta_secs(), &clock),
    });
    held.now = (shape, pose);
}

/// Draws the handles of the selected collider.
fn paint(
    mut contexts: EguiContexts,
    camera: Single<(&Camera, &GlobalTransform), With<OrbitCamera>>,
    window: Single<&Window, With<PrimaryWindow>>,
    clock: Res<SimulationClock>,
    selected: Res<SelectedCollider>,
    drag: Res<ColliderDrag>,
    colliders: Query<&Collider>,
) -> Result {
    let Some(collider) = selected.0.and_then(|it| colliders.get(it).ok()) else {
        return Ok(());
    };
    let painter = painter(contexts.ctx_mut()?);
    let (camera, eye) = *camera;
    let screen = Screen { camera, eye };
    let pose = shown_pose(collider, clock.time(), &clock);
    let center = pose.translation.as_vec3();
    let arm = arm(eye, center, window.height());
    let active = drag.held.as_ref().map(|held| held.handle).or(drag.hovered);
    for (handle, place) in handles(&collider.shape, &pose, arm) {
        let (Some(middle), Some(at)) = (screen.at(center), screen.at(place)) else {
            continue;
        };
        let bold = if active == Some(handle) { 2.0 } else { 0.0 };
        let edge = Stroke::new(1.5, Color32::WHITE);
        match handle {
            Handle::Free => {}
            Handle::Move(axis) => {
                painter.line_segment([middle, at], Stroke::new(2.5 + bold, COLORS[axis]));
                painter.circle(at, 6.0 + bold, COLORS[axis], edge);
            }
            Handle::Turn(axis) => {
                let [a, b] = others(axis);
                let arc = (0..=12).filter_map(|step| {
                    let angle = std::f32::consts::FRAC_PI_2 * step as f32 / 12.0;
                    screen.at(center + (a * angle.cos() + b * angle.sin()) * (ARC * arm))
                });
                let stroke = Stroke::new(2.0 + bold, COLORS[axis]);
                painter.line(arc.collect(), stroke);
                painter.circle(at, 4.5 + bold, COLORS[axis], edge);
            }
            Handle::Size(_) => {
                let square = Rect::from_center_size(at, vec2(10.0, 10.0) + vec2(bold, bold));
                painter.rect(
                    square,
                    1.0,
                    Color32::from_gray(60),
                    edge,
                    StrokeKind::Middle,
                );
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(from: Vec3, to: Vec3) -> Ray3d {
        Ray3d::new(from, Dir3::new(to - from).expect("apart"))
    }

    fn held(handle: Handle, shape: ColliderShape, press: Ray3d) -> Held {
        let start = (shape, Pose::at(DVec3::new(0.0, 1.0, 0.0)));
        Held {
            collider: Entity::from_raw_u32(3).expect("an index"),
            handle,
            now: start.clone(),
            start,
            press,
            depth: 5.0,
        }
    }

    const EYE: Vec3 = Vec3::new(0.0, 1.0, 5.0);

    #[test]
    fn a_collider_follows_the_pointer_freely_along_an_axis_and_about_one() {
        let sphere = ColliderShape::Sphere { radius: 0.5 };
        let press = ray(EYE, Vec3::new(0.0, 1.0, 0.0));
        let free = held(Handle::Free, sphere.clone(), press);
        let (_, pose) = free
            .at(ray(EYE, Vec3::new(1.0, 1.5, 0.0)), Vec3::NEG_Z)
            .expect("ahead");
        assert!(pose.translation.distance(DVec3::new(1.0, 1.5, 0.0)) < 1e-5);
        let up = held(Handle::Move(1), sphere.clone(), press);
        let (_, pose) = up
            .at(ray(EYE, Vec3::new(1.0, 1.5, 0.0)), Vec3::NEG_Z)
            .expect("ahead");
        // The point of the axis x = z = 0 nearest to the ray (t, 1 + t/2, 5 − 5t): t = 25/26.
        let nearest = DVec3::new(0.0, 1.0 + 0.5 * 25.0 / 26.0, 0.0);
        assert!(
            pose.translation.distance(nearest) < 1e-5,
            "{}",
            pose.translation
        );
        let press = ray(EYE, Vec3::new(1.0, 1.0, 0.0));
        let turn = held(Handle::Turn(2), sphere, press);
        let (_, pose) = turn
            .at(ray(EYE, Vec3::new(0.0, 2.0, 0.0)), Vec3::NEG_Z)
            .expect("ahead");
        let turned = pose.rotation * DVec3::X;
        assert!(turned.distance(DVec3::Y) < 1e-6, "{turned}");
    }

    #[test]
    fn sizes_follow_the_pointer_and_stay_positive() {
        let shape = ColliderShape::Box {
            size: Vec3::new(1.0, 2.0, 3.0),
        };
        let press = ray(EYE, Vec3::new(-0.5, 1.0, 0.0));
        let size = held(Handle::Size(0), shape, press);
        let at = |x: f32| {
            size.at(ray(EYE, Vec3::new(x, 1.0, 0.0)), Vec3::NEG_Z)
                .expect("ahead")
                .0
        };
        let ColliderShape::Box { size } = at(-0.75) else {
            panic!("a box");
        };
        assert!(size.distance(Vec3::new(1.5, 2.0, 3.0)) < 1e-5, "{size}");
        assert_eq!(at(2.0).check(), Ok(()));
    }

    #[test]
    fn every_shape_has_handles_for_its_own_sizes() {
        let count = |shape: ColliderShape| {
            let all = handles(&shape, &Pose::default(), 1.0);
            all.iter()
                .filter(|(it, _)| matches!(it, Handle::Size(_)))
                .count()
        };
        assert_eq!(count(ColliderShape::Sphere { radius: 1.0 }), 1);
        assert_eq!(
            count(ColliderShape::Capsule {
                radius: 1.0,
                length: 1.0
            }),
            2
        );
        assert_eq!(count(ColliderShape::Box { size: Vec3::ONE }), 3);
    }
}
