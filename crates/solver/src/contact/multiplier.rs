//! What rigid surfaces have done to a particle in the substep under way.
//!
//! A pass over contacts sees a particle after the constraints of an iteration have moved it. To hold friction to µ times
//! the depth of that pass alone would lose what earlier passes left unused: a rope around a cylinder would slip the
//! sooner, the more passes there are. So both are added up over the passes of a substep, and what is added up is what is
//! limited, as for any other multiplier.

use crate::effects::body_effect::Resting;
use glam::Vec3;

/// Multipliers of the contact of a particle with a rigid surface, as displacements: times m/h² they are forces.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactMultiplier {
    /// How far friction has brought it back [m].
    pub friction: Vec3,
    /// How far it has been pushed out [m], not negative.
    pub normal: f32,
    /// Which collider has pushed it; 0 for the ground.
    pub surface: u32,
}

impl ContactMultiplier {
    /// Allocates multipliers of a body, or frees them if there is one pass, after which they are not read.
    pub(super) fn make_room(kept: &mut Vec<Self>, body: &Resting, is_read: bool) {
        let count = if is_read || body.step.contact_passes() > 1 {
            body.topology.particles()
        } else {
            0
        };
        if kept.len() != count {
            *kept = vec![Self::default(); count];
        }
    }

    /// Where it is not kept from one pass to the next.
    pub(super) fn or_none<'a>(kept: &'a mut [Self], i: usize, none: &'a mut Self) -> &'a mut Self {
        match kept.get_mut(i) {
            Some(kept) => kept,
            None => {
                *none = Self::default();
                none
            }
        }
    }
}
