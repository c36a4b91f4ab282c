//! Contact impulses of rigid surfaces on a particle in the current substep.

use crate::effects::body_effect::Resting;
use glam::Vec3;

/// Contact multipliers of a particle on rigid surfaces in the current substep, as displacements.
///
/// A displacement times m/h² is a force [N]; the displacement `torque` of a grain times ⅖mr/h² is a
/// torque [N·m].
///
/// A contact pass sees a particle after the constraints of an iteration have moved it. Limiting
/// friction to µ times the depth of that pass alone would discard the unused part of earlier
/// passes: a rope around a cylinder would slip more with more passes. Therefore both are
/// accumulated over the passes of a substep, and the limit applies to the accumulated values, as
/// for any other multiplier.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactMultiplier {
    /// Displacement by friction [m].
    pub friction: Vec3,
    /// Displacement of the surface of a grain by the torque of rolling resistance [m].
    pub torque: Vec3,
    /// Displacement by the normal force [m], not negative.
    pub normal: f32,
    /// Number of the collider that pushed last; 0 for the ground.
    pub surface: u32,
}

impl ContactMultiplier {
    /// Allocates the multipliers of a body, or frees them if there is only one pass, after which
    /// they are not read.
    pub(super) fn allocate(kept: &mut Vec<Self>, body: &Resting, is_read: bool) {
        let is_read = is_read || body.records_contacts;
        let count = if is_read || body.step.contact_passes() > 1 {
            body.topology.particles()
        } else {
            0
        };
        if kept.len() != count {
            *kept = vec![Self::default(); count];
        }
    }

    /// Whether any of them has pushed a particle.
    pub(super) fn any_pushes(kept: &[Self]) -> bool {
        kept.iter().any(|it| it.normal > 0.0)
    }

    /// Multiplier of a particle, or a temporary one where none are stored.
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
