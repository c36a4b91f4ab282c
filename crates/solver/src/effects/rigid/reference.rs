//! Ground and colliders of the [reference](crate::reference), which share only their parameters
//! with those of the fast solver.

use crate::{
    ColliderShape,
    colliders::{collider::SweptCollider, inside::deep},
    effects::body_effect::{ReferenceParticles, ReferencePass},
};
use glam::DVec3;

/// The same as in the fast solver.
const RISE_TIME: f64 = 0.4;
const LAST: f64 = 0.1;
const NEARLY: f64 = 0.999;

/// Contact displacements of a particle in the current substep.
#[derive(Debug, Clone, Copy, Default)]
pub struct ContactDisplacement {
    /// Displacement by the normal force [m].
    pub normal: f64,
    /// Displacement by friction [m].
    pub friction: DVec3,
    /// Displacement of the surface of a grain by the torque of rolling resistance [m].
    torque: DVec3,
    /// Number of the collider.
    surface: usize,
}

/// Begins a substep of a body with this number of particles.
pub(super) fn begin(pushed: &mut Vec<ContactDisplacement>, particles: usize) {
    pushed.clear();
    pushed.resize(particles, ContactDisplacement::default());
}

/// A pass over a ground of this height [m]; friction µ and restitution e.
pub(super) fn ground(
    mut body: ReferenceParticles,
    height: f64,
    surface: (f64, f64),
    pushed: &mut [ContactDisplacement],
    pass: &ReferencePass,
) {
    let ReferencePass { h, gravity, .. } = *pass;
    for (i, pushed) in pushed.iter_mut().enumerate() {
        let height = height + f64::from(body.topology.radius(i));
        let approach = (body.x[i] - body.p[i]).y / h;
        let bounces = surface.1 > 0.0 && approach < -2.0 * h * gravity.length();
        let below = if bounces {
            0.0
        } else {
            (height - body.from[i].y).max(0.0)
        };
        let remaining = below * (1.0 - (h / RISE_TIME).min(1.0));
        let depth = height - remaining - body.x[i].y;
        if (depth > 0.0 || pushed.normal > 0.0) && body.w[i] > 0.0 {
            respond(
                &mut body,
                i,
                surface,
                (DVec3::Y, depth),
                DVec3::ZERO,
                pushed,
                pass,
            );
        }
    }
}

/// A pass over collider number `number`; friction µ and restitution e.
pub(super) fn collide(
    body: &mut ReferenceParticles,
    (number, SweptCollider { shape, from, to }): (usize, &SweptCollider),
    surface: (f64, f64),
    all: &mut [ContactDisplacement],
    pass: &ReferencePass,
) {
    for (i, kept) in all.iter_mut().enumerate() {
        if body.w[i] == 0.0 {
            continue;
        }
        let (start, end) = (from.undo(body.p[i]), to.undo(body.x[i]));
        let radius = f64::from(body.topology.radius(i));
        let mut pushed = *kept;
        let began = from.undo(body.from[i]);
        let is_inside = |x| distance(shape, x) < radius;
        let is_pushed = pushed.surface == number && pushed.normal > 0.0;
        let mut raised = 0.0;
        let found = if is_inside(start) && is_inside(began) {
            let side = body.sides.iter().find(|it| it.collider as usize == number);
            let side = side.filter(|_| distance(shape, began) < -deep(shape));
            let (normal, depth) = match side.map(|it| it.direction) {
                Some(normal) => (normal, way_out(shape, began, normal, radius)),
                None => deepest(shape, began, radius),
            };
            let [low, high] = body.topology.bounds;
            let size = f64::from((high - low).max_element());
            let most = if size > 0.0 { size } else { f64::INFINITY };
            let counted = depth.max(LAST * size).min(most);
            raised = (counted * (pass.h / RISE_TIME).min(1.0)).min(NEARLY * depth);
            let depth = normal.dot(began - end) + raised;
            (depth > 0.0 || is_pushed).then_some((normal, depth))
        } else {
            let lifted = || is_pushed.then(|| gradient(shape, end, radius));
            exit(shape, start, end, radius).or_else(lifted)
        };
        if let Some((normal, depth)) = found {
            if pushed.surface != number {
                pushed = ContactDisplacement {
                    surface: number,
                    ..ContactDisplacement::default()
                };
            }
            let touched = end + normal * (depth - radius);
            let carried = to.apply(touched) - from.apply(touched);
            let normal = to.rotation * normal;
            let left = raised - (body.p[i] - body.from[i]).dot(normal);
            let before = body.p[i];
            respond(
                body,
                i,
                surface,
                (normal, depth),
                carried,
                &mut pushed,
                pass,
            );
            // It rises without a velocity.
            if body.p[i] == before && left > 0.0 {
                body.p[i] += normal * left.min(raised);
            }
            *kept = pushed;
        }
    }
}

/// Moves the particle to the surface, reduces its tangential displacement by at most µ times the
/// depth (both accumulated over the substep), and applies restitution.
fn respond(
    body: &mut ReferenceParticles,
    i: usize,
    (friction, restitution): (f64, f64),
    (normal, depth): (DVec3, f64),
    carried: DVec3,
    pushed: &mut ContactDisplacement,
    ReferencePass { h, gravity, .. }: &ReferencePass,
) {
    *body.touched = true;
    let approach = (body.x[i] - body.p[i] - carried).dot(normal) / h;
    let normal_before = pushed.normal;
    pushed.normal = (pushed.normal + depth).max(0.0);
    body.x[i] += normal * (pushed.normal - normal_before);
    let slip = (body.x[i] - body.p[i] - carried).reject_from_normalized(normal);
    let before = pushed.friction.reject_from_normalized(normal);
    let limit = friction * pushed.normal;
    let rolling = body.rolling_resistance;
    if let Some(spin) = body.spins.get_mut(i) {
        // A ball of mass 1 and radius 1, whose surface moves with its rotation: I = ⅖. Friction that
        // takes the slip and a torque that ends the rotation, or the largest torque and friction that
        // takes the slip of a ball that rotates.
        let inertia = 0.4;
        let turn = *spin * *h;
        let stopping = (before + slip).clamp_length_max(limit) - before;
        let stopped = normal.cross(stopping) / inertia;
        let held = pushed.torque;
        pushed.torque = (held - turn - stopped).clamp_length_max(rolling * pushed.normal / inertia);
        let turn = turn + (pushed.torque - held);
        let taken = (slip - turn.cross(normal)) / (1.0 + 1.0 / inertia);
        pushed.friction = (before + taken).clamp_length_max(limit);
        let turn = turn + normal.cross(pushed.friction - before) / inertia;
        *spin = turn / *h;
    } else {
        pushed.friction = (before + slip).clamp_length_max(limit);
    }
    body.x[i] -= pushed.friction - before;
    if restitution > 0.0 && approach < -2.0 * h * gravity.length() {
        let leave = -restitution * approach * h + carried.dot(normal);
        let now = (body.x[i] - body.p[i]).dot(normal);
        body.p[i] += normal * (now - leave);
        *pushed = ContactDisplacement::default();
    }
}

/// Normal of a shape towards the center of a ball outside of it, and the depth of the ball.
fn gradient(shape: &ColliderShape, x: DVec3, radius: f64) -> (DVec3, f64) {
    let distance = distance(shape, x);
    if distance <= 0.0 {
        return (nearest_exit(shape, x).0, radius);
    }
    let outward = match *shape {
        ColliderShape::Box { size } => {
            let half = size.as_dvec3() / 2.0;
            x - x.clamp(-half, half)
        }
        ColliderShape::Sphere { .. } => x,
        ColliderShape::Capsule { length, .. } => x - on_axis(x, length),
        ColliderShape::Mesh(_) => DVec3::Y,
    };
    (outward.normalize(), radius - distance)
}

/// Normal and depth for a ball of `radius` [m] that moved from `from` to `to`, in the collider's
/// frame; see [`ColliderShape::exit`] for the choice of the surface.
pub fn exit(shape: &ColliderShape, from: DVec3, to: DVec3, radius: f64) -> Option<(DVec3, f64)> {
    let step = to - from;
    let nearest_exit = |x| deepest(shape, x, radius);
    let nearest = (distance(shape, to) < radius).then(|| nearest_exit(to));
    if nearest.is_some_and(|(normal, _)| normal.dot(step) <= 0.0) {
        return nearest;
    }
    let entry = if distance(shape, from) < radius {
        let (normal, depth) = nearest_exit(from);
        Some((from + normal * depth, normal))
    } else {
        enter(shape, from, step, radius)
            .filter(|&t| t <= 1.0)
            .map(|t| from + step * t)
            .map(|entry| (entry, nearest_exit(entry).0))
    };
    let entered = entry
        .filter(|(_, normal)| normal.dot(step) < 0.0)
        .map(|(entry, normal)| (normal, normal.dot(entry - to)))
        .filter(|&(_, depth)| depth > 0.0);
    entered.or(nearest)
}

/// Normal of the nearest surface and depth of a ball.
fn deepest(shape: &ColliderShape, x: DVec3, radius: f64) -> (DVec3, f64) {
    if distance(shape, x) > 0.0 && radius > 0.0 {
        return gradient(shape, x, radius);
    }
    let (normal, depth) = nearest_exit(shape, x);
    (normal, depth + radius)
}

/// Way of a ball inside in a direction until it is outside.
fn way_out(shape: &ColliderShape, x: DVec3, direction: DVec3, radius: f64) -> f64 {
    let (mut inside, mut outside) = (0.0, 2.0 * (f64::from(shape.reach()) + radius));
    while outside - inside > 1e-15 * outside {
        let middle = 0.5 * (inside + outside);
        if distance(shape, x + direction * middle) < radius {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    outside
}

fn distance(shape: &ColliderShape, x: DVec3) -> f64 {
    match *shape {
        ColliderShape::Box { size } => {
            let q = x.abs() - size.as_dvec3() / 2.0;
            q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
        }
        ColliderShape::Sphere { radius } => x.length() - f64::from(radius),
        ColliderShape::Capsule { radius, length } => {
            (x - on_axis(x, length)).length() - f64::from(radius)
        }
        ColliderShape::Mesh(_) => f64::INFINITY,
    }
}

fn nearest_exit(shape: &ColliderShape, x: DVec3) -> (DVec3, f64) {
    match *shape {
        ColliderShape::Box { size } => {
            let gaps = size.as_dvec3() / 2.0 - x.abs();
            let axis = if gaps.y <= gaps.x && gaps.y <= gaps.z {
                DVec3::Y
            } else if gaps.x <= gaps.z {
                DVec3::X
            } else {
                DVec3::Z
            };
            let side = if x.dot(axis) < 0.0 { -1.0 } else { 1.0 };
            (axis * side, gaps.dot(axis))
        }
        ColliderShape::Sphere { radius } => round_exit(x, f64::from(radius), DVec3::Y),
        ColliderShape::Capsule { radius, length } => {
            round_exit(x - on_axis(x, length), f64::from(radius), DVec3::X)
        }
        ColliderShape::Mesh(_) => (DVec3::Y, f64::NEG_INFINITY),
    }
}

fn round_exit(x: DVec3, radius: f64, any: DVec3) -> (DVec3, f64) {
    let distance = x.length();
    let normal = if distance > 0.0 { x / distance } else { any };
    (normal, radius - distance)
}

fn on_axis(x: DVec3, length: f32) -> DVec3 {
    let half = f64::from(length) / 2.0;
    DVec3::new(0.0, x.y.clamp(-half, half), 0.0)
}

fn enter(shape: &ColliderShape, from: DVec3, step: DVec3, ball: f64) -> Option<f64> {
    match *shape {
        ColliderShape::Sphere { radius } => enter_sphere(from, step, f64::from(radius) + ball),
        ColliderShape::Box { .. } if ball > 0.0 => enter_by_bisection(shape, from, step, ball),
        ColliderShape::Box { size } => enter_box(from, step, size.as_dvec3() / 2.0),
        ColliderShape::Capsule { radius, length } => {
            let (radius, half) = (f64::from(radius) + ball, f64::from(length) / 2.0);
            let flat = DVec3::new(1.0, 0.0, 1.0);
            let end = DVec3::new(0.0, half, 0.0);
            enter_sphere(from * flat, step * flat, radius)
                .filter(|t| (from.y + t * step.y).abs() <= half)
                .or_else(|| {
                    [end, -end]
                        .into_iter()
                        .filter_map(|end| enter_sphere(from - end, step, radius))
                        .reduce(f64::min)
                })
        }
        ColliderShape::Mesh(_) => None,
    }
}

/// First contact of a ball with a convex shape: the distance is convex along the path, so that its
/// minimum is found by thirds, and the contact before it by halves.
fn enter_by_bisection(shape: &ColliderShape, from: DVec3, step: DVec3, ball: f64) -> Option<f64> {
    let gap = |t: f64| distance(shape, from + step * t) - ball;
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..100 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if gap(a) < gap(b) { high = b } else { low = a }
    }
    let (mut outside, mut inside) = (0.0, low);
    if gap(inside) > 0.0 {
        return None;
    }
    for _ in 0..60 {
        let middle = 0.5 * (outside + inside);
        if gap(middle) > 0.0 {
            outside = middle
        } else {
            inside = middle
        }
    }
    Some(inside)
}

fn enter_sphere(from: DVec3, step: DVec3, radius: f64) -> Option<f64> {
    let (a, b) = (step.length_squared(), from.dot(step));
    let discriminant = b * b - a * (from.length_squared() - radius * radius);
    (a > 0.0 && discriminant >= 0.0 && b < 0.0).then(|| ((-b - discriminant.sqrt()) / a).max(0.0))
}

fn enter_box(from: DVec3, step: DVec3, half: DVec3) -> Option<f64> {
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..3 {
        if step[axis] == 0.0 {
            if from[axis].abs() > half[axis] {
                return None;
            }
        } else {
            let sides = [-half[axis], half[axis]].map(|side| (side - from[axis]) / step[axis]);
            enter = enter.max(sides[0].min(sides[1]));
            leave = leave.min(sides[0].max(sides[1]));
        }
    }
    (enter <= leave && leave >= 0.0).then_some(enter.max(0.0))
}
