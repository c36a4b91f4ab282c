//! Paths of colliders, as functions of time.

use super::{Pose, pose::rotation};
use crate::quantity::{InvalidValue, finite};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// Motion of a collider from its initial pose. Times are in seconds since the start of the scene.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Path {
    /// No motion.
    #[default]
    Still,
    /// Oscillation: position + travel · sin(2π t/period).
    Oscillate {
        /// Amplitude with direction [m].
        travel: Vec3,
        /// Period [s], above 0.
        period: f32,
    },
    /// Constant velocity.
    Line {
        /// Velocity [m/s].
        velocity: Vec3,
    },
    /// Rotation about its own center.
    Spin {
        /// Axis by the right-hand rule; its length does not matter.
        axis: Vec3,
        /// Angular speed in revolutions per second.
        rate: f32,
    },
    /// Straight from stop to stop, at rest before the first and after the last.
    Stops {
        /// Time [s] and displacement from the initial position [m], in ascending order of time.
        stops: Vec<(f32, Vec3)>,
        /// Whether to start again after the last stop.
        #[serde(default)]
        repeat: bool,
    },
}

impl Path {
    /// Rejects numbers that are not finite, periods of zero and stops out of order.
    ///
    /// # Errors
    /// [`InvalidValue`] with the invalid parameter.
    pub fn check(&self) -> Result<(), InvalidValue> {
        let vector = |name, v: Vec3| finite(name, v.x + v.y + v.z).map(|_| ());
        match self {
            Self::Still => Ok(()),
            Self::Oscillate { travel, period } => {
                vector("travel", *travel)?;
                if period.is_finite() && *period > 0.0 {
                    Ok(())
                } else {
                    Err(InvalidValue {
                        quantity: "period",
                        value: f64::from(*period),
                        valid: "a finite time above 0 s",
                    })
                }
            }
            Self::Line { velocity } => vector("velocity", *velocity),
            Self::Spin { axis, rate } => {
                vector("axis", *axis)?;
                finite("rate", *rate).map(|_| ())
            }
            Self::Stops { stops, .. } => {
                let mut last = f32::NEG_INFINITY;
                for &(time, place) in stops {
                    vector("stop", place)?;
                    if !time.is_finite() || time < 0.0 || time <= last {
                        return Err(InvalidValue {
                            quantity: "time of a stop",
                            value: f64::from(time),
                            valid: "finite, at least 0 s, and later than the stop before it",
                        });
                    }
                    last = time;
                }
                Ok(())
            }
        }
    }

    /// Whether it ever moves.
    #[must_use]
    pub fn moves(&self) -> bool {
        !matches!(self, Self::Still)
    }

    /// Pose at a time [s] of a collider with the initial pose `start`.
    #[must_use]
    pub fn pose(&self, start: &Pose, time: f64) -> Pose {
        let shifted = |by: DVec3| Pose {
            translation: start.translation + by,
            ..*start
        };
        match self {
            Self::Still => *start,
            Self::Oscillate { travel, period } => {
                let phase = time / f64::from(*period);
                let turn = core::f64::consts::TAU * (phase - libm::floor(phase));
                shifted(travel.as_dvec3() * libm::sin(turn))
            }
            Self::Line { velocity } => shifted(velocity.as_dvec3() * time),
            Self::Spin { axis, rate } => {
                let turns = f64::from(*rate) * time;
                let angle = core::f64::consts::TAU * (turns - libm::floor(turns));
                let spun = rotation(axis.as_dvec3(), angle) * start.rotation;
                Pose {
                    rotation: spun,
                    ..*start
                }
            }
            Self::Stops { stops, repeat } => shifted(between(stops, *repeat, time)),
        }
    }
}

fn between(stops: &[(f32, Vec3)], repeat: bool, time: f64) -> DVec3 {
    let (Some(first), Some(last)) = (stops.first(), stops.last()) else {
        return DVec3::ZERO;
    };
    let end = f64::from(last.0);
    let time = if repeat && end > 0.0 {
        time - end * libm::floor(time / end)
    } else {
        time
    };
    if time <= f64::from(first.0) {
        return first.1.as_dvec3();
    }
    for pair in stops.windows(2) {
        let [(t0, a), (t1, b)] = [pair[0], pair[1]].map(|(t, x)| (f64::from(t), x.as_dvec3()));
        if time < t1 {
            return a + (b - a) * ((time - t0) / (t1 - t0));
        }
    }
    last.1.as_dvec3()
}
