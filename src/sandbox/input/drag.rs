//! Grabbing: drags a body by the point under the pointer.
//!
//! A press grabs the visible surface point (triangle and weights), a move pulls it in the plane
//! parallel to the screen through that point, the wheel moves it along the view direction, and a
//! release keeps the velocity. Everything goes through [`Actions`], so that it is applied between
//! ticks and can be recorded; this module never changes a particle itself.

use crate::{
    render::Drawn,
    sandbox::{
        input::pointer::{Pointer, PointerOwner, PointerSystems},
        render::camera::{CameraSystems, OrbitCamera},
        state::{
            hands::Hands,
            request::{Request, Requested},
            selection::Selection,
            view::{GrabbedPoint, HoveredPin, LastGrab},
        },
    },
    simulation::{Action, Actions, SimulationClock, SoftBody},
    solver::{Grab, Particles, SurfacePoint, Topology},
};
use bevy::prelude::*;

/// Factor of depth per wheel step.
const STEP: f32 = 1.06;
/// Longest simulated time in which dragged pins and colliders follow the pointer [s].
const LONGEST: f32 = 0.25;
/// Minimum depth [m]; below it, the ray of the pointer is not meaningful.
const NEAREST: f32 = 0.05;

/// The body that is dragged.
#[derive(Resource, Debug, Default)]
pub struct Drag {
    /// The grabbed body and point, while dragging.
    pub held: Option<Held>,
}

/// A grabbed body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    /// The body.
    pub body: Entity,
    /// The grabbed point.
    pub point: SurfacePoint,
    /// Target of the grabbed point [m].
    pub target: Vec3,
    /// Depth of the target along the view direction [m].
    pub depth: f32,
    /// Offset of the weighted mean of the grabbed patch from the point [m].
    pub offset: Vec3,
    /// Whether pins are dragged.
    pub pins: bool,
    /// Whether the body has the grab: it waits for the end of a tick.
    pub taken: bool,
}

/// Systems that grab, drag and release, in `Update`.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct DragSystems;

/// Lets the user drag bodies.
pub struct DragPlugin;

impl Plugin for DragPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Drag>()
            .init_resource::<Selection>()
            .add_message::<Requested>()
            .init_resource::<Hands>()
            .add_systems(
                Update,
                (forget_gone, follow_grab, (take, pull, release).chain())
                    .chain()
                    .in_set(DragSystems)
                    .after(PointerSystems)
                    .before(CameraSystems),
            );
    }
}

/// Clears the grab of a body that was removed, for example by a scene change, and the last one of a
/// body whose grains appear and disappear: it may be another grain.
fn forget_gone(
    mut drag: ResMut<Drag>,
    mut last: ResMut<LastGrab>,
    bodies: Query<(), With<Drawn>>,
    topologies: Query<&SoftBody>,
) {
    if drag.held.is_some_and(|held| !bodies.contains(held.body)) {
        drag.held = None;
    }
    let is_gone = |grab: GrabbedPoint| {
        let renewed = topologies.get(grab.body).is_ok_and(|it| it.is_renewed());
        !bodies.contains(grab.body) || (renewed && !grab.held)
    };
    if last.0.is_some_and(is_gone) {
        last.0 = None;
    }
}

/// Follows the grabbed point where a body tears or its grains change, and clears a grab whose grain
/// has disappeared.
fn follow_grab(
    mut drag: ResMut<Drag>,
    mut last: ResMut<LastGrab>,
    bodies: Query<(Option<Ref<Grab>>, &SoftBody)>,
) {
    let drag = drag.bypass_change_detection();
    let Some(held) = drag.held.as_mut().filter(|held| !held.pins) else {
        return;
    };
    let Ok((grab, body)) = bodies.get(held.body) else {
        return;
    };
    match grab {
        Some(grab) => {
            // A new one; the last one may not have been released yet.
            held.taken |= grab.is_added();
            if held.taken && grab.point != held.point {
                held.point = grab.point;
                if let Some(last) = &mut last.0 {
                    last.vertex = body.numbering.vertex(grab.point.nearest());
                }
            }
        }
        None if held.taken => {
            drag.held = None;
            last.0 = None;
        }
        None => {}
    }
}

fn take(
    pointer: Res<Pointer>,
    keys: Res<ButtonInput<KeyCode>>,
    selection: Res<Selection>,
    mut requests: MessageWriter<Requested>,
    camera: Single<&GlobalTransform, With<OrbitCamera>>,
    bodies: Query<(&SoftBody, &Particles)>,
    (hands, hovered_pin): (Res<Hands>, Res<HoveredPin>),
    mut drag: ResMut<Drag>,
    mut last: ResMut<LastGrab>,
    mut actions: ResMut<Actions>,
) {
    let (PointerOwner::Body(body), None) = (pointer.owner, drag.held) else {
        return;
    };
    // The hit exists only in the frame of the press: a grab that has ended does not start again.
    let Some(hit) = pointer.hit.filter(|hit| hit.body == body) else {
        return;
    };
    let Ok((topology, particles)) = bodies.get(body) else {
        return;
    };
    // The press selects or deselects the body, and drags nothing.
    if keys.any_pressed([KeyCode::ControlLeft, KeyCode::ControlRight]) {
        let scope = selection.0.toggled(body.to_bits());
        requests.write(Requested(Request::Show(scope)));
        return;
    }
    let (point, target) = (hit.point, hit.position);
    let depth = (target - camera.translation()).dot(camera.forward().as_vec3());
    let pin = hovered_pin.0.filter(|(pinned, _)| *pinned == body);
    let offset = match pin {
        Some(_) => Vec3::ZERO,
        None => offset(point, hands.radius, topology, particles),
    };
    drag.held = Some(Held {
        body,
        point,
        target,
        depth,
        offset,
        pins: pin.is_some(),
        taken: false,
    });
    let vertex = topology.numbering.vertex(point.nearest());
    last.0 = Some(GrabbedPoint {
        body,
        vertex,
        held: true,
    });
    actions.push(match pin {
        Some((_, vertex)) => Action::GrabPins { body, vertex },
        None if hands.is_point() => Action::Grab {
            body,
            point,
            target,
        },
        None => Action::Brush {
            body,
            point,
            target: target + offset,
            radius: hands.radius,
            stiffness: hands.stiffness,
        },
    });
}

fn pull(
    pointer: Res<Pointer>,
    camera: Single<&GlobalTransform, With<OrbitCamera>>,
    (time, clock): (Res<Time<Real>>, Res<SimulationClock>),
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
        let body = held.body;
        actions.push(if held.pins {
            Action::MovePins {
                body,
                target,
                seconds: simulated(time.delta_secs(), &clock),
            }
        } else {
            let target = target + held.offset;
            Action::MoveGrab { body, target }
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

/// Simulated time of a frame [s], in which what is dragged follows the pointer.
pub(super) fn simulated(frame: f32, clock: &SimulationClock) -> f32 {
    (frame * clock.speed as f32).clamp(0.0, LONGEST)
}

/// Offset of the weighted mean of a patch with a radius [m] around a point of a body [m].
fn offset(point: SurfacePoint, radius: f32, topology: &Topology, particles: &Particles) -> Vec3 {
    if radius == 0.0 {
        return Vec3::ZERO;
    }
    let grab = Grab::on(point, Vec3::ZERO, 1.0, 1.0, 1.0).of_patch(radius, 1.0);
    let mean = grab.mean(topology, |i| particles.position(i)).as_vec3();
    mean - point.position(&particles.positions)
}

/// Depth [m] after a number of wheel steps; positive steps increase it.
fn deepened(depth: f32, steps: f32) -> f32 {
    (depth * STEP.powf(steps.clamp(-20.0, 20.0))).max(NEAREST)
}

/// The point of a ray at a depth [m] along the view direction, if the ray points that way.
pub(super) fn at_depth(ray: Ray3d, forward: Vec3, depth: f32) -> Option<Vec3> {
    let cosine = ray.direction.dot(forward);
    (cosine > 1e-3).then(|| ray.get_point(depth / cosine))
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
}
