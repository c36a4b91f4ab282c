//! Bodies that are partly inside a collider: the side to which they leave it.
//!
//! Each particle by itself would leave through the nearest surface, and a block that sits deep in a
//! plate would be torn apart or fall out below. So all particles that are deep inside leave in one
//! direction, of the faces of a box or the axes of a round shape: where the way is shortest, and where the
//! rest of the body is. A body that is on several sides, as a cloth around a bar, has none of them, and
//! neither have grains.

use super::{bounds::SweptBounds, collider::SweptCollider};
use crate::{ColliderShape, Topology};
use glam::{DVec3, Vec4};

/// The side to which a body leaves a collider that some of its particles are in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WayOut {
    /// Number of the collider.
    pub collider: u32,
    /// Direction in the frame of the collider, a unit vector.
    pub direction: DVec3,
}

/// The way to a side counts this many times as long if none of the rest of the body is there.
const THROUGH: f64 = 5.0;

/// Depth [m] from which a particle is inside, as a fraction of the size of the collider: more than what
/// contact and rounding leave.
const INSIDE: f64 = 1e-4;

/// Writes the sides of a body that begins a tick with its particles at these positions [m].
pub(crate) fn find_sides(
    sides: &mut Vec<WayOut>,
    topology: &Topology,
    positions: &[Vec4],
    colliders: &[SweptCollider],
) {
    sides.clear();
    if !topology.radii.is_empty() {
        return;
    }
    for (number, collider) in (0..).zip(colliders) {
        let bounds = SweptBounds::of(collider, 0.0);
        let moving = positions.iter().filter(|x| x.w > 0.0);
        if moving.clone().any(|x| bounds.may_touch(*x, Vec4::ZERO)) {
            let local = moving.map(|x| collider.from.undo(x.truncate().as_dvec3()));
            let direction = side(&collider.shape, local);
            sides.extend(direction.map(|direction| WayOut {
                collider: number,
                direction,
            }));
        }
    }
}

/// Depth [m] from which a particle is deep inside a shape.
pub(crate) fn deep(shape: &ColliderShape) -> f64 {
    INSIDE * f64::from(shape.reach())
}

/// The side to which particles at these places in the frame of a shape [m] leave it; `None` if none of them
/// is inside, or the others are on several sides.
pub(crate) fn side(
    shape: &ColliderShape,
    particles: impl Iterator<Item = DVec3> + Clone,
) -> Option<DVec3> {
    let is_inside = |x: &DVec3| shape.distance(*x) < -deep(shape);
    let inside = particles.clone().filter(is_inside);
    inside.clone().next()?;
    let mut outside = 0_u32;
    let mut on_side = [0_u32; ColliderShape::SIDES.len()];
    let half = shape.half_extent();
    for x in particles.filter(|x| !is_inside(x)) {
        outside += 1;
        for (count, side) in on_side.iter_mut().zip(ColliderShape::SIDES) {
            *count += u32::from(side.dot(x) >= half.dot(side.abs()));
        }
    }
    let all = ColliderShape::SIDES.into_iter().zip(on_side);
    let candidates = all.filter(|(_, count)| 2 * count >= outside);
    let ways = candidates.map(|(side, count)| {
        let ways = inside.clone().map(|x| shape.depth_along(x, side, 0.0));
        let way = ways.fold(0.0, f64::max);
        let beyond = if outside == 0 {
            1.0
        } else {
            f64::from(count) / f64::from(outside)
        };
        (way * (THROUGH - (THROUGH - 1.0) * beyond), side)
    });
    ways.reduce(|best, it| if it.0 < best.0 { it } else { best })
        .map(|(_, side)| side)
}
