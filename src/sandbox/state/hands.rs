//! How the pointer grabs, and what is shot.

use bevy::prelude::*;
use std::ops::RangeInclusive;

/// Valid radii of a grabbed patch [m].
pub const RADII: RangeInclusive<f32> = 0.0..=2.0;
/// Valid stiffnesses of the mouse spring, relative to the default.
pub const STIFFNESSES: RangeInclusive<f32> = 0.01..=100.0;
/// Valid speeds of bodies that are shot [m/s].
pub const SPEEDS: RangeInclusive<f32> = 0.5..=50.0;

/// What is shot from the camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Shot {
    /// A ball of half the size of new bodies.
    #[default]
    Ball,
    /// The body that is chosen for adding.
    Chosen,
}

/// Settings of grabbing and shooting.
#[derive(Resource, Debug, Clone, Copy, PartialEq)]
pub struct Hands {
    /// Radius of the grabbed patch [m]; 0 (default) grabs a point.
    pub radius: f32,
    /// Stiffness of the mouse spring relative to the default, at which the body's weight stretches
    /// it by a twentieth of the body's size.
    pub stiffness: f32,
    /// What is shot.
    pub shot: Shot,
    /// Its speed [m/s]; default 10.
    pub speed: f32,
}

impl Default for Hands {
    fn default() -> Self {
        Self {
            radius: 0.0,
            stiffness: 1.0,
            shot: Shot::Ball,
            speed: 10.0,
        }
    }
}

/// A change of [`Hands`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum HandsChange {
    /// Radius of the grabbed patch [m].
    Radius(f64),
    /// Relative stiffness of the mouse spring.
    Stiffness(f64),
    /// What is shot.
    Shot(Shot),
    /// Speed of bodies that are shot [m/s].
    Speed(f64),
}

impl Hands {
    /// Whether a point is grabbed with the default stiffness.
    #[must_use]
    pub fn is_point(&self) -> bool {
        self.radius == 0.0 && self.stiffness == 1.0
    }

    /// Applies a change.
    ///
    /// # Errors
    /// A sentence for the user, for a value out of range.
    pub fn change(&mut self, change: HandsChange) -> Result<(), String> {
        match change {
            HandsChange::Radius(value) => {
                self.radius = within("Grab radius", value, " m", &RADII)?;
            }
            HandsChange::Stiffness(value) => {
                self.stiffness = within("Grab stiffness", value, "", &STIFFNESSES)?;
            }
            HandsChange::Shot(shot) => self.shot = shot,
            HandsChange::Speed(value) => {
                self.speed = within("Speed", value, " m/s", &SPEEDS)?;
            }
        }
        Ok(())
    }
}

fn within(name: &str, value: f64, unit: &str, valid: &RangeInclusive<f32>) -> Result<f32, String> {
    let (low, high) = (valid.start(), valid.end());
    let fits = valid.contains(&(value as f32));
    fits.then_some(value as f32).ok_or_else(|| {
        format!("{name} is {value}{unit}, but must be between {low} and {high}{unit}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_out_of_range_are_refused_with_the_range() {
        let mut hands = Hands::default();
        assert_eq!(hands.change(HandsChange::Radius(0.25)), Ok(()));
        for change in [
            HandsChange::Radius(-0.1),
            HandsChange::Stiffness(0.0),
            HandsChange::Speed(f64::NAN),
        ] {
            let error = hands.change(change).expect_err("out of range");
            assert!(error.contains("must be between"), "{error}");
        }
        let expected = Hands {
            radius: 0.25,
            ..Hands::default()
        };
        assert_eq!(hands, expected);
    }
}
