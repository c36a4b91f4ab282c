//! Paths of colliders, as functions of time.

use super::pose::rotation;
use crate::{InvalidValue, Pose};
use glam::{DMat3, DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// Motion of a collider from its initial pose. Times are in seconds since the start of the scene.
///
/// ```
/// use glam::Vec3;
/// use pliant_solver::Path;
///
/// // Up and down by 20 cm, twice a second.
/// let shaker = Path::Oscillate { travel: Vec3::Y * 0.2, period: 0.5 };
/// // Down by 1 m within the second second, and back within the third.
/// let press = Path::Stops {
///     stops: vec![(1.0, Vec3::ZERO), (2.0, Vec3::NEG_Y), (3.0, Vec3::ZERO)],
///     repeat: false,
/// };
/// # assert!(shaker.check().is_ok() && press.check().is_ok());
/// ```
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
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
    /// From another pose to the initial pose at constant velocity, which is then kept.
    Glide {
        /// Pose until `begin`.
        from: Pose,
        /// Start of the motion [s].
        begin: f64,
        /// End of the motion [s], later than its start.
        end: f64,
    },
}

impl Path {
    /// Rejects numbers that are not finite, periods of zero and stops out of order.
    ///
    /// # Errors
    /// [`InvalidValue`] with the invalid parameter.
    pub fn check(&self) -> Result<(), InvalidValue> {
        let vector = |name, v: Vec3| InvalidValue::unless_finite(name, v.x + v.y + v.z).map(|_| ());
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
                InvalidValue::unless_finite("rate", *rate).map(|_| ())
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
            Self::Glide { begin, end, .. } => {
                if begin.is_finite() && end.is_finite() && begin < end {
                    Ok(())
                } else {
                    Err(InvalidValue {
                        quantity: "end of the motion",
                        value: *end,
                        valid: "finite and later than its start",
                    })
                }
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
            Self::Glide { from, begin, end } => {
                if time >= *end {
                    return *start;
                }
                let fraction = ((time - begin) / (end - begin)).max(0.0);
                let way = start.translation - from.translation;
                let (axis, angle) = axis_angle(start.rotation * from.rotation.transpose());
                Pose {
                    rotation: rotation(axis, angle * fraction) * from.rotation,
                    translation: from.translation + way * fraction,
                }
            }
        }
    }
}

/// Axis, of any length, and angle [rad] from 0 to π of a rotation. At π the axis is 0.
fn axis_angle(turn: DMat3) -> (DVec3, f64) {
    let [x, y, z] = [turn.x_axis, turn.y_axis, turn.z_axis];
    let axis = DVec3::new(y.z - z.y, z.x - x.z, x.y - y.x);
    let cosine = x.x + y.y + z.z - 1.0;
    (axis, libm::atan2(axis.length(), cosine))
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter turn about y and a way of 2 m in half a second, at a third of that time.
    #[test]
    fn a_glide_turns_and_moves_at_constant_velocity_and_stays_at_its_end() {
        let quarter = core::f64::consts::FRAC_PI_2;
        let from = Pose {
            rotation: rotation(DVec3::X, 0.3),
            translation: DVec3::new(1.0, 0.0, 0.0),
        };
        let start = Pose {
            rotation: rotation(DVec3::Y, quarter) * from.rotation,
            translation: DVec3::new(3.0, 0.0, 0.0),
        };
        let (begin, end) = (1.0, 1.5);
        let path = Path::Glide { from, begin, end };
        assert_eq!(path.check(), Ok(()));
        let third = path.pose(&start, 1.0 + 0.5 / 3.0);
        let expected = rotation(DVec3::Y, quarter / 3.0) * from.rotation;
        assert!(
            (third.rotation - expected)
                .to_cols_array()
                .iter()
                .all(|x| x.abs() < 1e-14)
        );
        assert!((third.translation.x - (1.0 + 2.0 / 3.0)).abs() < 1e-14);
        assert_eq!(path.pose(&start, 0.5), from);
        assert_eq!(path.pose(&start, 1.5), start);
        assert!(
            Path::Glide {
                from,
                begin,
                end: begin
            }
            .check()
            .is_err()
        );
    }
}
