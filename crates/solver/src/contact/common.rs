//! The common motion of surfaces that come near each other.

use glam::{DAffine3, DVec3};

/// A motion that all of a group could perform without crossing: surfaces that are apart stay apart.
#[derive(Debug, Clone, Copy)]
pub(super) enum CommonMotion {
    /// By this displacement [m].
    Shift(DVec3),
    /// That of a collider, which may turn, and its inverse.
    Turn { forth: DAffine3, back: DAffine3 },
}

impl Default for CommonMotion {
    fn default() -> Self {
        Self::Shift(DVec3::ZERO)
    }
}

impl CommonMotion {
    /// That of a collider, from its pose at the start of a substep to that at the end.
    pub fn of_collider(forth: DAffine3) -> Self {
        Self::Turn {
            forth,
            back: forth.inverse(),
        }
    }

    /// Its displacement of a point [m].
    pub fn displacement(&self, start: DVec3) -> DVec3 {
        match self {
            Self::Shift(by) => *by,
            Self::Turn { forth, .. } => forth.transform_point3(start) - start,
        }
    }

    /// Displacement of a point from `start` to `end`, as seen by what performs the common motion [m].
    pub fn relative(&self, start: DVec3, end: DVec3) -> DVec3 {
        match self {
            Self::Shift(by) => end - start - by,
            Self::Turn { back, .. } => back.transform_point3(end) - start,
        }
    }

    /// The displacement [m] in the world that is this one as seen by what performs the common motion.
    pub fn seen(&self, relative: DVec3) -> DVec3 {
        match self {
            Self::Shift(_) => relative,
            Self::Turn { forth, .. } => forth.transform_vector3(relative),
        }
    }
}

/// What is known of a group of members. Its common motion is that of the collider among them that moves
/// farthest; or else that of its particles that cannot be cut, none if one of them does not move; or else
/// that of the center of mass. A motion that none of the particles that cannot be cut performs would leave
/// no plane that they do not pass.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Group {
    pub motion: CommonMotion,
    /// The collider that moves farthest, and how far one of its vertices moves [m].
    collider: Option<(DAffine3, f64)>,
    /// Σmx [kg·m] and Σm [kg] of the particles that can be cut.
    momentum: DVec3,
    mass: f64,
    sum_of_fixed: DVec3,
    fixed: f64,
    is_held: bool,
    /// Momentum that its particles have lost [kg·m].
    pub lost: DVec3,
    /// Whether part of a body is under repair, which has rules of its own for velocities.
    pub is_repaired: bool,
}

impl Group {
    /// Adds a particle with its motion [m] and inverse mass [1/kg].
    pub fn add(&mut self, displacement: DVec3, inverse_mass: f64) {
        if inverse_mass > 0.0 {
            self.momentum += displacement / inverse_mass;
            self.mass += 1.0 / inverse_mass;
        } else {
            self.sum_of_fixed += displacement;
            self.fixed += 1.0;
            self.is_held |= displacement == DVec3::ZERO;
        }
    }

    /// Adds a collider, a vertex of which moves this far [m].
    pub fn add_collider(&mut self, motion: DAffine3, farthest: f64) {
        self.fixed += 1.0;
        if self.collider.is_none_or(|(_, far)| farthest > far) {
            self.collider = Some((motion, farthest));
        }
    }

    /// Finds its common motion, of all that was added.
    pub fn find_motion(&mut self) {
        self.motion = match self.collider {
            Some((motion, farthest)) if farthest > 0.0 => CommonMotion::of_collider(motion),
            _ => CommonMotion::Shift(if self.is_held || self.collider.is_some() {
                DVec3::ZERO
            } else if self.fixed > 0.0 {
                self.sum_of_fixed / self.fixed
            } else {
                self.momentum / self.mass
            }),
        };
    }

    /// Change of its velocity that returns what it has lost, as a displacement per substep [m].
    pub fn push(&self) -> Option<DVec3> {
        let is_free = self.fixed == 0.0 && !self.is_repaired;
        (is_free && self.lost != DVec3::ZERO).then(|| self.lost / self.mass)
    }
}
