//! The hand: it takes a body by the point under the pointer and pulls it about.
//!
//! A press grabs the surface point that the eye sees (triangle and weights), a move pulls it
//! in the plane parallel to the screen through that point, the wheel moves it nearer and
//! farther, and letting go leaves it its speed. Everything goes through [`Actions`], so that
//! it is applied between ticks and can be recorded; this module never touches a particle.

use crate::{
    render::Drawn,
    sandbox::{
        input::{
            pick::Hit,
            pointer::{Pointer, PointerOwner, PointerSystems},
        },
        render::camera::{CameraSystems, OrbitCamera},
        state::view::{GrabbedPoint, LastGrab},
    },
    scene::BodySkin,
    simulation::{Action, Actions, SoftBody},
    solver::{ParticleIndex, SurfacePoint, numbering::Numbering},
};
use bevy::prelude::*;

/// Factor of depth per wheel step.
const STEP: f32 = 1.06;
/// The least depth [m]; nearer, the pointer's ray tells nothing.
const NEAREST: f32 = 0.05;

/// What the pointer holds.
#[derive(Resource, Debug, Default)]
pub struct Drag {
    /// The body and the point of it, while one is held.
    pub held: Option<Held>,
}

/// A held body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    /// The body.
    pub body: Entity,
    /// The point of it that is held.
    pub point: SurfacePoint,
    /// Where it is pulled to [m].
    pub target: Vec3,
    /// Distance of the target from the eye along the view [m].
    pub depth: f32,
}

/// Systems that grab, pull and let go, in `Update`.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct DragSystems;

/// Lets the user drag bodies.
pub struct DragPlugin;

impl Plugin for DragPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Drag>().add_systems(
            Update,
            (forget_gone, (take, pull, release).chain())
                .chain()
                .in_set(DragSystems)
                .after(PointerSystems)
                .before(CameraSystems),
        );
    }
}

/// A body that went (the scene changed) is neither held nor remembered.
fn forget_gone(mut drag: ResMut<Drag>, mut last: ResMut<LastGrab>, bodies: Query<(), With<Drawn>>) {
    if drag.held.is_some_and(|held| !bodies.contains(held.body)) {
        drag.held = None;
    }
    if last.0.is_some_and(|grab| !bodies.contains(grab.body)) {
        last.0 = None;
    }
}

fn take(
    pointer: Res<Pointer>,
    camera: Single<&GlobalTransform, With<OrbitCamera>>,
    bodies: Query<(&SoftBody, &Drawn, Option<&BodySkin>)>,
    mut drag: ResMut<Drag>,
    mut last: ResMut<LastGrab>,
    mut actions: ResMut<Actions>,
) {
    let (PointerOwner::Body(body), None) = (pointer.owner, drag.held) else {
        return;
    };
    // The hit is there only in the frame of the press: a hold that ended is not taken up again.
    let (Some((hit_body, hit)), Some(ray)) = (pointer.hit, pointer.ray) else {
        return;
    };
    let Ok((topology, drawn, skin)) = bodies.get(body) else {
        return;
    };
    let numbering = &topology.numbering;
    let Some(point) = held_point(&hit, skin, numbering)
        .filter(|p| hit_body == body && p.fits(drawn.particles.len()))
    else {
        return;
    };
    let target = ray.get_point(hit.distance);
    let depth = (target - camera.translation()).dot(camera.forward().as_vec3());
    drag.held = Some(Held {
        body,
        point,
        target,
        depth,
    });
    last.0 = Some(GrabbedPoint {
        body,
        vertex: numbering.vertex(point.nearest()),
        held: true,
    });
    actions.push(Action::Grab {
        body,
        point,
        target,
    });
}

/// The particles behind a hit: its corners, or what carries the corners of an embedded surface.
fn held_point(hit: &Hit, skin: Option<&BodySkin>, numbering: &Numbering) -> Option<SurfacePoint> {
    let corners = hit.corners.into_iter().zip(hit.weights);
    let Some(skin) = skin else {
        let corners = corners.map(|(corner, weight)| (ParticleIndex(corner), weight));
        return SurfacePoint::new(&corners.collect::<Vec<_>>());
    };
    let terms: Vec<_> = corners
        .filter_map(|(corner, weight)| skin.0.anchors.get(corner as usize).map(|a| (a, weight)))
        .flat_map(|(anchor, weight)| {
            anchor
                .vertices
                .map(|vertex| numbering.particle(vertex))
                .into_iter()
                .zip(anchor.weights.map(|w| w * weight))
        })
        .collect();
    SurfacePoint::new(&terms)
}

fn pull(
    pointer: Res<Pointer>,
    camera: Single<&GlobalTransform, With<OrbitCamera>>,
    mut drag: ResMut<Drag>,
    mut actions: ResMut<Actions>,
) {
    let Some(held) = drag.bypass_change_detection().held.as_mut() else {
        return;
    };
    if pointer.owner != PointerOwner::Body(held.body) {
        return;
    }
    held.depth = deepened(held.depth, pointer.wheel);
    let target = pointer
        .ray
        .and_then(|ray| at_depth(ray, camera.forward().as_vec3(), held.depth));
    if let Some(target) = target
        && target != held.target
    {
        held.target = target;
        actions.push(Action::MoveGrab {
            body: held.body,
            target,
        });
    }
}

fn release(
    pointer: Res<Pointer>,
    mut drag: ResMut<Drag>,
    mut last: ResMut<LastGrab>,
    mut actions: ResMut<Actions>,
) {
    let Some(held) = drag.held else {
        return;
    };
    if pointer.owner == PointerOwner::Body(held.body) {
        return;
    }
    drag.held = None;
    if let Some(grab) = &mut last.0 {
        grab.held = false;
    }
    actions.push(Action::Release { body: held.body });
}

/// A depth [m] after some wheel steps; positive steps lead away from the eye.
fn deepened(depth: f32, steps: f32) -> f32 {
    (depth * STEP.powf(steps.clamp(-20.0, 20.0))).max(NEAREST)
}

/// The point of a ray at a depth [m] along the view direction, if the ray goes that way.
fn at_depth(ray: Ray3d, forward: Vec3, depth: f32) -> Option<Vec3> {
    let share = ray.direction.dot(forward);
    (share > 1e-3).then(|| ray.get_point(depth / share))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_target_stays_in_the_plane_parallel_to_the_screen() {
        let forward = Vec3::NEG_Z;
        for x in [-0.5, 0.0, 0.7] {
            let direction = Dir3::new(Vec3::new(x, 0.2, -1.0)).expect("not zero");
            let target = at_depth(Ray3d::new(Vec3::ZERO, direction), forward, 3.0).expect("ahead");
            // One rounding in the direction's length, one in the division, at 3 m.
            assert!((target.z + 3.0).abs() < 1e-6, "{target}");
        }
    }

    #[test]
    fn a_ray_beside_or_behind_the_view_gives_no_target() {
        let aside = Ray3d::new(Vec3::ZERO, Dir3::X);
        assert_eq!(at_depth(aside, Vec3::NEG_Z, 3.0), None);
    }

    #[test]
    fn the_wheel_leads_away_and_back_and_never_behind_the_eye() {
        let back = deepened(deepened(2.0, 5.0), -5.0);
        assert!(
            (back - 2.0).abs() < 1e-5,
            "two roundings of a power: {back}"
        );
        assert!(deepened(2.0, 1.0) > 2.0);
        assert!(deepened(NEAREST, -1e9) >= NEAREST);
    }

    #[test]
    fn a_hit_without_a_skin_holds_the_corners_with_their_weights() {
        let hit = Hit {
            distance: 1.0,
            corners: [4, 2, 9],
            weights: [0.5, 0.25, 0.25],
        };
        let point = held_point(&hit, None, &Numbering::default()).expect("weights sum to 1");
        assert_eq!(
            point.terms().collect::<Vec<_>>(),
            [(4, 0.5), (2, 0.25), (9, 0.25)]
                .map(|(corner, weight)| (ParticleIndex(corner), weight))
        );
        assert_eq!(point.nearest(), ParticleIndex(4));
    }
}
