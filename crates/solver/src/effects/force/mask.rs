//! The part of a body on which its force fields act.

#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{Fraction, GroupName, Topology};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Limits all force fields of the body to a part of it: a box, given by fractions of the bounding
/// box of the body at rest, and within it a named group of its vertices. Gravity, external forces of
/// an app and effects of an app act everywhere; without a force field, the mask does nothing.
///
/// Each particle has a weight by its place at rest, so that the mask moves with the material, and
/// both copies of a particle keep theirs where a body tears:
///
/// w = 1 − t²(3 − 2t), t = min(d/f, 1),
///
/// with d the distance from the box and f the width of the transition; 1 inside. With a group, it is
/// 0 for particles that are not in it. Every change of velocity by a force is multiplied by it. What is stable and implicit, such as [`Drag`](crate::Drag),
/// remains so: the result lies between the velocities without and with the force.
///
/// The bounding box is that of all vertices, also of those that no element uses. Along an axis in which the body is flat, all of it is inside. Where a lower limit is above the
/// upper one, the part is empty and no force acts, nor where the body has no group of the name.
/// Grains have no shape at rest: forces act on all of them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct ForceMask {
    /// Lower limit along x, from 0 at the low side of the bounding box to 1 at its high side;
    /// default 0.
    pub low_x: Fraction,
    /// Lower limit along y; default 0.
    pub low_y: Fraction,
    /// Lower limit along z; default 0.
    pub low_z: Fraction,
    /// Upper limit along x; default 1.
    pub high_x: Fraction,
    /// Upper limit along y; default 1.
    pub high_y: Fraction,
    /// Upper limit along z; default 1.
    pub high_z: Fraction,
    /// Name of the group of vertices on which the forces act; default empty, the whole body.
    pub group: GroupName,
    /// Width of the transition outside of the box, as a fraction of the longest side of the
    /// bounding box; default 0, a sharp edge.
    pub fade: Fraction,
}

impl Default for ForceMask {
    fn default() -> Self {
        let [none, all] = [0.0, 1.0].map(Fraction::of);
        Self {
            low_x: none,
            low_y: none,
            low_z: none,
            high_x: all,
            high_y: all,
            high_z: all,
            group: GroupName::default(),
            fade: none,
        }
    }
}

/// What is nearer to the part than this fraction of the longest side, and the rounding of a coordinate to
/// f32, is inside: places at rest and fractions are rounded, so that vertices on an edge would be inside by
/// chance.
const MARGIN: f64 = 1e-5;

impl ForceMask {
    /// Whether a lower limit is above the upper one: no force acts on any particle.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.low_x > self.high_x || self.low_y > self.high_y || self.low_z > self.high_z
    }

    /// Whether the part is the whole body, so that all weights are 1.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        let [none, all] = [0.0, 1.0].map(Fraction::of);
        [self.low_x, self.low_y, self.low_z] == [none; 3]
            && [self.high_x, self.high_y, self.high_z] == [all; 3]
            && self.group.is_empty()
    }

    /// Weight of each particle of a body, from 0 to 1; 1 for grains.
    pub fn weights<'a>(&self, topology: &'a Topology) -> impl Fn(u32) -> f64 + use<'a> {
        let [low, high] = topology.bounds.map(|corner| corner.as_dvec3());
        let at = |x: Fraction, y: Fraction, z: Fraction| {
            low + (high - low) * DVec3::new(x.into(), y.into(), z.into())
        };
        let farthest = low.abs().max(high.abs()).max_element();
        let rounding = f64::from(f32::EPSILON) * farthest;
        let margin = DVec3::splat(MARGIN * (high - low).max_element() + rounding);
        let from = at(self.low_x, self.low_y, self.low_z) - margin;
        let to = at(self.high_x, self.high_y, self.high_z) + margin;
        let width = f64::from(self.fade) * (high - low).max_element();
        let (has_rest, is_empty) = (topology.radii.is_empty(), self.is_empty());
        let is_in = topology.groups.membership(self.group);
        move |i| {
            if !has_rest {
                return 1.0;
            }
            if !is_in(i) {
                return 0.0;
            }
            let x = topology.rest[i as usize].as_dvec3();
            let outside = (from - x).max(x - to).max(DVec3::ZERO);
            if is_empty {
                0.0
            } else if outside == DVec3::ZERO {
                1.0
            } else {
                fall(outside.length(), width)
            }
        }
    }
}

/// Smooth fall from 1 to 0 over a width; 0 beyond it.
fn fall(distance: f64, width: f64) -> f64 {
    if distance >= width {
        return 0.0;
    }
    let t = distance / width;
    1.0 - t * t * (3.0 - 2.0 * t)
}
