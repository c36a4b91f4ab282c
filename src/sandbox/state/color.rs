//! Coloring of bodies by a quantity: which one, and over which range.

use bevy::prelude::*;

/// The quantity by which bodies are colored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ColorMode {
    /// Off: bodies have their own colors.
    #[default]
    Off,
    /// Largest principal stretch minus 1.
    Tension,
    /// Smallest principal stretch minus 1.
    Compression,
    /// V/V₀ − 1.
    VolumeChange,
    /// Speed [m/s].
    Speed,
    /// Root mean square of the relative residuals of the constraints.
    ConstraintError,
    /// Magnitude of the contact forces [N].
    ContactForce,
}

/// Description of a quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantity {
    /// Title, for menus.
    pub title: &'static str,
    /// Title with its symbol, for the legend.
    pub symbol: &'static str,
    /// Unit in which it is shown.
    pub unit: &'static str,
    /// Factor from SI to that unit.
    pub factor: f64,
    /// Whether it has a sign. If so, the map is diverging, with its middle at 0.
    pub signed: bool,
    /// Minimum extent of the automatic range [SI], above the noise of single precision.
    pub least: f32,
    /// Definition, for tooltips.
    pub help: &'static str,
}

impl ColorMode {
    /// All modes, in the order of the key.
    pub const ALL: [Self; 7] = [
        Self::Off,
        Self::Tension,
        Self::Compression,
        Self::VolumeChange,
        Self::Speed,
        Self::ConstraintError,
        Self::ContactForce,
    ];

    /// The next mode in the order of the key.
    #[must_use]
    pub fn next(self) -> Self {
        let at = Self::ALL.iter().position(|&mode| mode == self);
        let next = at.map_or(0, |at| (at + 1) % Self::ALL.len());
        Self::ALL[next]
    }

    /// Name in the journal and among the widget rectangles.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Tension => "tension",
            Self::Compression => "compression",
            Self::VolumeChange => "volume",
            Self::Speed => "speed",
            Self::ConstraintError => "error",
            Self::ContactForce => "contact",
        }
    }

    /// Its description; `None` if off.
    #[must_use]
    pub const fn quantity(self) -> Option<Quantity> {
        let percent = Quantity {
            title: "",
            symbol: "",
            unit: "%",
            factor: 100.0,
            signed: true,
            least: 1e-3,
            help: "",
        };
        Some(match self {
            Self::Off => return None,
            Self::Tension => Quantity {
                title: "Max. strain",
                symbol: "Max. principal strain λ₁ − 1",
                help: "Maximum principal strain: the largest principal stretch minus 1, of the \
                       tetrahedra of a solid, within the triangles of a cloth, along the edges of \
                       a rope. Above 0: tension.",
                ..percent
            },
            Self::Compression => Quantity {
                title: "Min. strain",
                symbol: "Min. principal strain λ₃ − 1",
                help: "Minimum principal strain: the smallest principal stretch minus 1, of the \
                       tetrahedra of a solid, within the triangles of a cloth, along the edges of \
                       a rope. Below 0: compression; below −100 %: inverted.",
                ..percent
            },
            Self::VolumeChange => Quantity {
                title: "Volume change",
                symbol: "Volume change V/V₀ − 1",
                help: "Relative change of the volume of the tetrahedra of a solid, or of the volume \
                       that a closed surface encloses.",
                ..percent
            },
            Self::Speed => Quantity {
                title: "Speed",
                symbol: "Speed",
                unit: "m/s",
                factor: 1.0,
                signed: false,
                least: 0.01,
                help: "Speed of each particle.",
            },
            Self::ConstraintError => Quantity {
                title: "Constraint error",
                symbol: "Constraint error |C + αλ/h²|/s",
                unit: "",
                factor: 1.0,
                signed: false,
                least: 1e-6,
                help: "Root mean square of the residuals C + αλ/h² of the constraints at each \
                       particle, relative to rest length or rest volume. 0 is a converged solve; it \
                       shows where more iterations or substeps are needed.",
            },
            Self::ContactForce => Quantity {
                title: "Contact force",
                symbol: "Contact force per particle",
                unit: "N",
                factor: 1.0,
                signed: false,
                least: 1e-3,
                help: "Sum of the magnitudes of the contact forces on each particle in the last \
                       substep: of the ground, colliders, other bodies and the body itself.",
            },
        })
    }
}

/// The range of the colors.
#[derive(Resource, Debug, Clone, Copy, PartialEq, Default)]
pub struct ColorScale {
    /// Range set by the user [SI]; `None` for the automatic one.
    pub fixed: Option<(f32, f32)>,
    /// Automatic range [SI].
    pub automatic: (f32, f32),
    /// Smallest and largest value on screen [SI], if there is any.
    pub extremes: Option<(f32, f32)>,
}

impl ColorScale {
    /// The range that is drawn [SI].
    #[must_use]
    pub fn range(&self) -> (f32, f32) {
        self.fixed.unwrap_or(self.automatic)
    }
}

/// Position of a value in a range: 0 at its start, 1 at its end, beyond for values out of range.
#[must_use]
pub fn place(value: f32, (low, high): (f32, f32)) -> f32 {
    if high > low {
        (value - low) / (high - low)
    } else {
        0.5
    }
}

/// Position of a value in the color map, 0 to 1 within the range. For a signed quantity whose range
/// contains 0, the middle of the map is at 0, and equal differences have equal differences of color
/// on both sides.
#[must_use]
pub fn shade(value: f32, range: (f32, f32), signed: bool) -> f32 {
    let (low, high) = range;
    let most = low.abs().max(high.abs());
    if signed && low <= 0.0 && high >= 0.0 && most > 0.0 {
        0.5 + 0.5 * value / most
    } else {
        place(value, range)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_key_visits_every_mode_once_and_ends_where_it_began() {
        let mut mode = ColorMode::Off;
        for expected in ColorMode::ALL {
            assert_eq!(mode, expected);
            mode = mode.next();
        }
        assert_eq!(mode, ColorMode::Off);
    }

    #[test]
    fn zero_is_the_middle_of_a_diverging_map_and_both_sides_have_the_same_scale() {
        let range = (-0.1, 0.3);
        assert_eq!(shade(0.0, range, true), 0.5);
        let step = |value: f32| (shade(value, range, true) - 0.5).abs();
        assert!((step(0.1) - step(-0.1)).abs() < 1e-6);
        assert_eq!(shade(0.3, range, true), 1.0);
        assert_eq!(shade(0.3, range, false), 1.0);
        assert_eq!(shade(-0.1, range, false), 0.0);
    }

    #[test]
    fn values_beyond_the_range_are_beyond_0_and_1() {
        assert!(place(2.0, (0.0, 1.0)) > 1.0);
        assert!(place(-2.0, (0.0, 1.0)) < 0.0);
        assert_eq!(place(3.0, (1.0, 1.0)), 0.5);
    }
}
