//! Camera orbit: plain geometry around a focus, without a window.

use bevy::prelude::*;

/// Vertical field of view [rad].
pub const FIELD_OF_VIEW: f32 = 0.62;
/// Rotation per pixel [rad/px].
const TURN: f32 = 0.0055;
/// Factor of distance per wheel step.
const STEP: f32 = 0.88;
/// Pitch above the floor [rad]: from just above it to almost straight down.
const PITCH: std::ops::RangeInclusive<f32> = 0.03..=1.54;
/// Distance to the focus [m].
const DISTANCE: std::ops::RangeInclusive<f32> = 1e-3..=1e5;

/// Orbit of a camera around a focus.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Orbit {
    /// The point in the center of the view [m].
    pub focus: Vec3,
    /// Distance from the focus [m].
    pub distance: f32,
    /// Rotation about the vertical [rad]; at 0 the camera looks along −z.
    pub yaw: f32,
    /// Angle above the horizon [rad].
    pub pitch: f32,
}

impl Default for Orbit {
    fn default() -> Self {
        Self {
            focus: Vec3::Y * 0.4,
            distance: 4.0,
            yaw: 0.42,
            pitch: 0.33,
        }
    }
}

impl Orbit {
    /// The orbit of a camera at `eye` that looks at `target` [m].
    #[must_use]
    pub fn look(eye: Vec3, target: Vec3) -> Self {
        let arm = eye - target;
        let distance = arm.length().clamp(*DISTANCE.start(), *DISTANCE.end());
        Self {
            focus: target,
            distance,
            yaw: arm.x.atan2(arm.z),
            pitch: (arm.y / distance)
                .asin()
                .clamp(*PITCH.start(), *PITCH.end()),
        }
    }

    /// Rotated by a pointer motion [px].
    #[must_use]
    pub fn turned(self, by: Vec2) -> Self {
        Self {
            yaw: self.yaw - TURN * by.x,
            pitch: (self.pitch + TURN * by.y).clamp(*PITCH.start(), *PITCH.end()),
            ..self
        }
    }

    /// Panned by a pointer motion [px] in a window of a height [px], so that the point at the focus
    /// stays under the pointer.
    #[must_use]
    pub fn panned(self, by: Vec2, height: f32) -> Self {
        let meters = 2.0 * self.distance * (FIELD_OF_VIEW / 2.0).tan() / height.max(1.0);
        let rotation = self.rotation();
        let shift = rotation * Vec3::X * -by.x + rotation * Vec3::Y * by.y;
        Self {
            focus: self.focus + shift * meters,
            ..self
        }
    }

    /// Zoomed in by a number of wheel steps.
    #[must_use]
    pub fn zoomed(self, steps: f32) -> Self {
        let distance = self.distance * STEP.powf(steps.clamp(-20.0, 20.0));
        Self {
            distance: distance.clamp(*DISTANCE.start(), *DISTANCE.end()),
            ..self
        }
    }

    /// Minimum distance of the eye from the nearest framed point [m], beyond the near plane.
    pub(super) const CLEARANCE: f32 = 0.02;

    /// The nearest valid distance [m].
    pub(super) fn valid_distance(distance: f32) -> f32 {
        distance.clamp(*DISTANCE.start(), *DISTANCE.end())
    }

    /// Interpolates towards another orbit by a fraction from 0 to 1.
    #[must_use]
    pub fn towards(self, goal: Self, fraction: f32) -> Self {
        let mix = |a: f32, b: f32| a + (b - a) * fraction;
        Self {
            focus: self.focus.lerp(goal.focus, fraction),
            distance: mix(self.distance.ln(), goal.distance.ln()).exp(),
            yaw: mix(self.yaw, goal.yaw),
            pitch: mix(self.pitch, goal.pitch),
        }
    }

    /// Whether another orbit gives the same view, to a tenth of a pixel of a large screen.
    #[must_use]
    pub fn is_near(self, other: Self) -> bool {
        const NEAR: f32 = 2e-5;
        self.focus.distance(other.focus) <= NEAR * other.distance
            && (self.distance - other.distance).abs() <= NEAR * other.distance
            && (self.yaw - other.yaw).abs() <= NEAR
            && (self.pitch - other.pitch).abs() <= NEAR
    }

    fn rotation(self) -> Quat {
        Quat::from_rotation_y(self.yaw) * Quat::from_rotation_x(-self.pitch)
    }

    /// Pose of the camera.
    #[must_use]
    pub fn transform(self) -> Transform {
        let rotation = self.rotation();
        Transform::from_translation(self.focus + rotation * Vec3::Z * self.distance)
            .with_rotation(rotation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A few rounding errors of the rotation, at a distance of about 5 m.
    const CLOSE: f32 = 1e-5;

    #[test]
    fn an_orbit_looks_from_the_eye_it_was_given() {
        let (eye, target) = (Vec3::new(3.0, 2.0, 4.0), Vec3::new(0.5, 0.5, 0.0));
        let transform = Orbit::look(eye, target).transform();
        assert!(transform.translation.distance(eye) < CLOSE);
        let forward = (target - eye).normalize();
        assert!(transform.forward().distance(forward) < CLOSE);
    }

    #[test]
    fn the_camera_never_goes_below_the_floor_or_over_the_top() {
        let orbit = Orbit {
            focus: Vec3::ZERO,
            ..default()
        };
        for by in [1e4, -1e4] {
            let turned = orbit.turned(Vec2::Y * by);
            assert!(turned.transform().translation.y > 0.0);
            assert!(turned.transform().up().y > 0.0);
        }
    }

    #[test]
    fn zooming_in_and_out_again_comes_back() {
        let orbit = Orbit::default();
        let back = orbit.zoomed(3.0).zoomed(-3.0);
        assert!((back.distance - orbit.distance).abs() < CLOSE * orbit.distance);
        assert!(orbit.zoomed(1e9).distance > 0.0);
    }

    #[test]
    fn panning_across_the_window_moves_the_focus_by_what_is_seen() {
        let orbit = Orbit {
            pitch: 0.03,
            yaw: 0.0,
            ..default()
        };
        let seen = 2.0 * orbit.distance * (FIELD_OF_VIEW / 2.0).tan();
        let moved = orbit.panned(Vec2::X * 800.0, 800.0).focus - orbit.focus;
        assert!(moved.distance(Vec3::NEG_X * seen) < CLOSE);
    }

    #[test]
    fn gliding_ends_at_its_goal() {
        let goal = Orbit {
            distance: 9.0,
            yaw: 1.0,
            ..default()
        };
        let there = Orbit::default().towards(goal, 1.0);
        assert!((there.distance - 9.0).abs() < 1e-4 && there.yaw == goal.yaw);
    }
}
