//! Checked numbers: each type holds a value inside its valid range.
//!
//! Values are validated where they enter (code, scene file, panel, command line), all through the
//! same constructors, so the solver can rely on valid input. External values use `new`, literals in
//! code use `of`: `const SOFT: Compliance = Compliance::of(1e-4);`.

#![allow(
    clippy::manual_range_contains,
    reason = "ranges are checked in constant functions"
)]

use serde::{Deserialize, Serialize};
use std::fmt;

/// A value outside the range of its quantity.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{quantity} is {value}, but must be {valid}")]
pub struct InvalidValue {
    /// Name of the quantity, as shown to users.
    pub quantity: &'static str,
    /// The rejected value.
    pub value: f64,
    /// The valid range in words, with its unit.
    pub valid: &'static str,
}

impl InvalidValue {
    /// The value, unless it is not finite.
    ///
    /// # Errors
    /// [`InvalidValue`] with the name of the quantity, for NaN and ±∞.
    pub fn unless_finite(quantity: &'static str, value: f32) -> Result<f32, Self> {
        if value.is_finite() {
            Ok(value)
        } else {
            Err(Self {
                quantity,
                value: f64::from(value),
                valid: "a finite number",
            })
        }
    }
}

macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident($number:ty), $quantity:literal, default $default:expr, $valid:literal, |$v:ident| $check:expr) => {
        $(#[$doc])*
        #[doc = concat!("\n\nValid: ", $valid, ".")]
        #[derive(Clone, Copy, PartialEq, PartialOrd, Serialize, Deserialize)]
        #[serde(try_from = "f64", into = "f64")]
        pub struct $name($number);

        impl $name {
            /// Validates the value.
            ///
            /// # Errors
            #[doc = concat!("[`InvalidValue`] unless the value is ", $valid, ".")]
            pub fn new(value: $number) -> Result<Self, InvalidValue> {
                if Self::is_valid(value) {
                    Ok(Self(value))
                } else {
                    Err(InvalidValue { quantity: $quantity, value: f64::from(value), valid: $valid })
                }
            }

            /// A literal value.
            ///
            /// # Panics
            #[doc = concat!("Unless the value is ", $valid, "; in a constant, that is an error of the compiler.")]
            #[must_use]
            pub const fn of(value: $number) -> Self {
                assert!(Self::is_valid(value), concat!($quantity, " must be ", $valid));
                Self(value)
            }

            const fn is_valid($v: $number) -> bool {
                $check
            }

            /// The number itself.
            #[must_use]
            pub const fn get(self) -> $number {
                self.0
            }
        }

        impl Default for $name {
            fn default() -> Self {
                Self($default)
            }
        }

        impl fmt::Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "{:?}", self.0)
            }
        }

        impl From<$name> for f64 {
            fn from(value: $name) -> Self {
                Self::from(value.0)
            }
        }
    };
}

/// An integer given as a float, as in files and panels.
fn whole(quantity: &'static str, value: f64, valid: &'static str) -> Result<u32, InvalidValue> {
    let rounded = value as u32;
    if f64::from(rounded) == value {
        Ok(rounded)
    } else {
        Err(InvalidValue {
            quantity,
            value,
            valid,
        })
    }
}

macro_rules! from_float {
    ($($name:ident),*) => {$(
        impl TryFrom<f64> for $name {
            type Error = InvalidValue;

            fn try_from(value: f64) -> Result<Self, InvalidValue> {
                // The message must show the given value, not the f32 nearest to it.
                Self::new(value as f32).map_err(|error| InvalidValue { value, ..error })
            }
        }
    )*};
}

macro_rules! from_whole {
    ($($name:ident, $quantity:literal, $valid:literal);*) => {$(
        impl TryFrom<f64> for $name {
            type Error = InvalidValue;

            fn try_from(value: f64) -> Result<Self, InvalidValue> {
                Self::new(whole($quantity, value, $valid)?)
            }
        }
    )*};
}

quantity!(
    /// Compliance α, the inverse of a stiffness: m/N for an edge, m⁵/N for a volume; 0 is rigid.
    Compliance(f32), "compliance", default 0.0,
    "between 0 and 1e12 (m/N for an edge, m⁵/N for a volume)", |v| 0.0 <= v && v <= 1e12
);
quantity!(
    /// A stiffness independent of the mesh: EA in N for a rope, K in Pa for a solid; ∞ is rigid.
    Stiffness(f32), "stiffness", default f32::INFINITY,
    "at least 1e-6 (N or Pa), or inf for rigid", |v| v >= 1e-6
);
quantity!(
    /// Flexural rigidity B of a sheet in N·m.
    FlexuralRigidity(f32), "bending stiffness", default 1e-3,
    "at least 1e-12 N·m, or inf for rigid", |v| v >= 1e-12
);
quantity!(
    /// Young's modulus E in Pa; ∞ is rigid.
    YoungsModulus(f32), "Young's modulus", default 1e6,
    "at least 1e-6 Pa, or inf for rigid", |v| v >= 1e-6
);
quantity!(
    /// Poisson's ratio ν: transverse contraction over axial extension.
    PoissonRatio(f32), "Poisson's ratio", default 0.3,
    "between 0 and 0.499", |v| 0.0 <= v && v <= 0.499
);
quantity!(
    /// Radius of the section of a rod in m.
    RodRadius(f32), "rod radius", default 5e-3,
    "between 1e-6 and 1 m", |v| 1e-6 <= v && v <= 1.0
);
quantity!(
    /// Stiffness of a section against bending or twist [N·m²]; 0 is that of a circle.
    SectionStiffness(f32), "stiffness of the section", default 0.0,
    "between 1e-20 and 1e12 N·m², or 0 for that of a circle", |v| v == 0.0 || 1e-20 <= v && v <= 1e12
);
quantity!(
    /// Fraction of the curvature of a mesh that a rod has at rest.
    Curl(f32), "curl", default 1.0, "between 0 (straight) and 10", |v| 0.0 <= v && v <= 10.0
);
quantity!(
    /// Twist at rest [rad/m].
    Twist(f32), "twist", default 0.0, "between -1e5 and 1e5 rad/m", |v| -1e5 <= v && v <= 1e5
);
quantity!(
    /// Angular velocity about an axis [rad/s].
    TurnRate(f32), "rate of turn", default 0.0, "between -1e4 and 1e4 rad/s", |v| -1e4 <= v && v <= 1e4
);
quantity!(
    /// Thickness of a sheet in m.
    Thickness(f32), "thickness", default 1e-3,
    "between 1e-9 and 1e3 m", |v| 1e-9 <= v && v <= 1e3
);
quantity!(
    /// Compliance of a sheet in m/N: strain over tension, with tension a force per width in N/m; 0
    /// is rigid.
    MembraneCompliance(f32), "compliance", default 1e-3,
    "between 0 and 1e12 m/N", |v| 0.0 <= v && v <= 1e12
);
quantity!(
    /// Maximum strain of an edge, a ratio of lengths: 0.1 is a tenth longer than at rest.
    Strain(f32), "limit", default 0.1, "between 0 and 100", |v| 0.0 <= v && v <= 100.0
);
quantity!(
    /// Additional length of a tether, as a fraction of the geodesic rest distance.
    Slack(f32), "slack", default 0.0, "between 0 and 100", |v| 0.0 <= v && v <= 100.0
);
quantity!(
    /// Frequency of oscillation in Hz; ∞ is rigid.
    Frequency(f32), "frequency", default 10.0,
    "at least 1e-6 Hz, or inf for rigid", |v| v >= 1e-6
);
quantity!(
    /// Size of the regions of a body in m; ∞ is the whole body.
    RegionSize(f32), "region", default f32::INFINITY,
    "above 0 m, or inf for the whole body", |v| v > 0.0
);
quantity!(
    /// Fill ratio of a closed surface: free volume of the filling over the rest volume.
    Filling(f32), "factor", default 1.0, "between 0.001 and 1000 times the rest volume",
    |v| 1e-3 <= v && v <= 1e3
);
quantity!(
    /// Yield strain, or yield curvature in 1/m; ∞ disables flow.
    Yield(f32), "yield strain", default f32::INFINITY,
    "at least 0, or inf for no yielding", |v| v >= 0.0
);
quantity!(
    /// Maximum permanent strain, or curvature in 1/m; ∞ is unlimited.
    PlasticLimit(f32), "plastic limit", default f32::INFINITY,
    "at least 0, or inf for no limit", |v| v >= 0.0
);
quantity!(
    /// Creep rate, the fraction of the excess strain that flows per second, in 1/s; ∞ is at once.
    Creep(f32), "creep", default 10.0, "at least 0 1/s, or inf for immediate flow", |v| v >= 0.0
);
quantity!(
    /// Damping as a time τ = αβ in s, see
    /// [`Multipliers`](crate::effects::Multipliers).
    Damping(f32), "damping", default 0.0, "between 0 and 1000 s", |v| 0.0 <= v && v <= 1000.0
);
quantity!(
    /// Time constant for recovering collapsed elements [s].
    RepairTime(f32), "repair", default 0.05, "at least 0.001 s, or inf for never", |v| v >= 0.001
);
quantity!(
    /// Mass per measure of a body: kg/m³ of a solid and of grains, kg/m² of a cloth, kg/m of a rope.
    Density(f32), "density", default 1000.0,
    "between 1e-9 and 1e9 (kg/m³ for a solid and for grains, kg/m² for a cloth, kg/m for a rope)",
    |v| 1e-9 <= v && v <= 1e9
);
quantity!(
    /// Mass of one particle in kg.
    Mass(f32), "mass", default 1.0, "between 1e-18 and 1e12 kg", |v| 1e-18 <= v && v <= 1e12
);
quantity!(
    /// Coulomb friction coefficient µ, a ratio of forces.
    Friction(f32), "friction", default 0.5, "between 0 and 100", |v| 0.0 <= v && v <= 100.0
);

quantity!(
    /// Contact thickness of a surface in m; 0 is a tenth of its mean edge.
    ContactThickness(f32), "thickness", default 0.0,
    "between 1e-5 and 1 m, or 0 for a tenth of the mean edge length",
    |v| v == 0.0 || 1e-5 <= v && v <= 1.0
);
quantity!(
    /// Speed at which overlapping surfaces separate in m/s.
    RecoverySpeed(f32), "recovery_speed", default 0.5, "between 0.01 and 10 m/s",
    |v| 0.01 <= v && v <= 10.0
);

quantity!(
    /// Largest force with which two touching grains hold each other in N.
    Cohesion(f32), "cohesion", default 0.0, "between 0 and 1e9 N", |v| 0.0 <= v && v <= 1e9
);
quantity!(
    /// Coefficient of rolling resistance, a ratio of forces: lever arm of the torque over the
    /// radius.
    RollingResistance(f32), "rolling_resistance", default 0.0, "between 0 and 1", |v| 0.0 <= v && v <= 1.0
);

impl Friction {
    /// No rolling resistance.
    pub const NONE: Self = Self(0.0);
}

quantity!(
    /// Coefficient of restitution e: speed after a bounce over speed before it.
    Restitution(f32), "restitution", default 0.0, "between 0 and 1", |v| 0.0 <= v && v <= 1.0
);
quantity!(
    /// A length above zero in m.
    Length(f32), "length", default 1.0, "between 1e-9 and 1e9 m", |v| 1e-9 <= v && v <= 1e9
);
quantity!(
    /// A number of either sign: a coordinate in m, a speed in m/s, an acceleration in m/s².
    Finite(f32), "the value", default 0.0, "between -1e9 and 1e9", |v| -1e9 <= v && v <= 1e9
);

impl Finite {
    /// Zero.
    pub const ZERO: Self = Self(0.0);

    /// Three components as a vector.
    #[must_use]
    pub fn vector([x, y, z]: [Self; 3]) -> glam::DVec3 {
        glam::DVec3::new(x.0.into(), y.0.into(), z.0.into())
    }
}

quantity!(
    /// A height of a ground in m.
    Height(f32), "height", default 0.0, "a finite number of meters", |v| v.is_finite()
);

quantity!(
    /// A coefficient that is not negative.
    Coefficient(f32), "the coefficient", default 0.0, "between 0 and 1e9", |v| 0.0 <= v && v <= 1e9
);

quantity!(
    /// A force limit in N.
    Force(f32), "force", default f32::INFINITY, "above 0 N (inf for no limit)", |v| v > 0.0
);
quantity!(
    /// Toughness: energy per area of a crack in J/m², of a sheet per length in J/m, of a rope per
    /// cut in J; ∞ is no limit.
    Toughness(f32), "toughness", default 100.0,
    "above 0 (J/m² for a solid, J/m for a sheet, J for a rope), or inf for no limit", |v| v > 0.0
);
quantity!(
    /// Strain at which an element breaks, a ratio of lengths; ∞ is no limit.
    BreakingStrain(f32), "strain", default f32::INFINITY, "above 0, or inf for no limit",
    |v| v > 0.0
);
quantity!(
    /// A number of connected elements.
    PieceSize(u32), "smallest_piece", default 4, "a whole number between 1 and 1000 elements",
    |v| 1 <= v && v <= 1000
);
quantity!(
    /// Coefficient of rolling resistance of grains; ∞ keeps them from rotating.
    GrainRolling(f32), "rolling_resistance", default f32::INFINITY,
    "0 or more, or inf for grains that do not rotate", |v| v >= 0.0
);
quantity!(
    /// Radius of a grain in m.
    GrainRadius(f32), "radius", default 0.015, "between 1e-6 and 1e3 m", |v| 1e-6 <= v && v <= 1e3
);
quantity!(
    /// Largest number of grains of a body, or of copies of a body.
    Capacity(u32), "capacity", default 1000, "a whole number between 1 and 1000000",
    |v| 1 <= v && v <= 1_000_000
);
quantity!(
    /// Time after which something disappears [s]; ∞ is never.
    Lifetime(f32), "lifetime", default f32::INFINITY, "above 0 s, or inf for no limit", |v| v > 0.0
);
quantity!(
    /// An angle in degrees.
    Angle(f32), "the angle", default 0.0, "between 0 and 180°", |v| 0.0 <= v && v <= 180.0
);
quantity!(
    /// Seed of random numbers.
    Seed(u32), "seed", default 0, "a whole number between 0 and 1000000", |v| v <= 1_000_000
);
quantity!(
    /// Ticks per second.
    Rate(f64), "rate", default 60.0, "between 0.1 and 1000000 ticks per second",
    |v| 0.1 <= v && v <= 1e6
);
quantity!(
    /// Substeps per tick.
    Substeps(u32), "substeps", default 10, "a whole number between 1 and 10000",
    |v| 1 <= v && v <= Substeps::MAX
);
quantity!(
    /// Iterations over all constraints per substep.
    Iterations(u32), "iterations", default 1, "a whole number between 1 and 10000",
    |v| 1 <= v && v <= 10_000
);

quantity!(
    /// Passes over all contacts per substep, spread evenly over its iterations; 0 is one after each
    /// iteration.
    CollisionIterations(u32), "collision_iterations", default 0, "a whole number between 0 and 10000",
    |v| v <= 10_000
);

impl CollisionIterations {
    /// Number of passes after iteration number `iteration` of `iterations`; the last iteration has
    /// at least one.
    #[must_use]
    pub fn after(self, iteration: u32, iterations: u32) -> u32 {
        if self.0 == 0 {
            return 1;
        }
        let until = |iteration: u32| {
            u64::from(self.0) * u64::from(iteration) / u64::from(iterations.max(1))
        };
        (until(iteration + 1) - until(iteration)) as u32
    }
}

quantity!(
    /// Smoothing (averaged) passes after the iterations of a substep.
    SmoothingIterations(u32), "smoothing_iterations", default 0, "a whole number between 0 and 10000",
    |v| v <= 10_000
);
quantity!(
    /// Order of the time integration: 1 is implicit Euler, 2 is BDF2, whose iterations go through the
    /// constraints twice.
    Order(u32), "order", default 1, "1 or 2", |v| v == 1 || v == 2
);
quantity!(
    /// Whether free bodies conserve their angular momentum: 1 if they do.
    KeepSpin(u32), "keep_spin", default 1, "0 or 1", |v| v <= 1
);
quantity!(
    /// A fraction of a whole.
    Fraction(f32), "the fraction", default 1.0, "between 0 and 1", |v| 0.0 <= v && v <= 1.0
);

impl Substeps {
    /// Maximum value.
    pub const MAX: u32 = 10_000;
}

from_float!(
    Compliance,
    Stiffness,
    FlexuralRigidity,
    YoungsModulus,
    RodRadius,
    SectionStiffness,
    Curl,
    Twist,
    TurnRate,
    PoissonRatio,
    Thickness,
    MembraneCompliance,
    Strain,
    Slack,
    Creep,
    Frequency,
    RegionSize,
    Filling,
    PlasticLimit,
    Yield,
    Damping,
    RepairTime,
    Density,
    Mass,
    Friction,
    RollingResistance,
    Cohesion,
    Restitution,
    ContactThickness,
    RecoverySpeed,
    Fraction,
    Length,
    Finite,
    Height,
    Coefficient,
    Force,
    Toughness,
    BreakingStrain,
    GrainRadius,
    GrainRolling,
    Lifetime,
    Angle
);
from_whole!(
    Substeps, "substeps", "a whole number between 1 and 10000";
    Iterations, "iterations", "a whole number between 1 and 10000";
    CollisionIterations, "collision_iterations", "a whole number between 0 and 10000";
    SmoothingIterations, "smoothing_iterations", "a whole number between 0 and 10000";
    Order, "order", "1 or 2";
    KeepSpin, "keep_spin", "0 or 1";
    PieceSize, "smallest_piece", "a whole number between 1 and 1000 elements";
    Capacity, "capacity", "a whole number between 1 and 1000000";
    Seed, "seed", "a whole number between 0 and 1000000"
);

impl TryFrom<f64> for Rate {
    type Error = InvalidValue;

    fn try_from(value: f64) -> Result<Self, InvalidValue> {
        Self::new(value)
    }
}
