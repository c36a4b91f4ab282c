//! Display settings: quality of the picture, size and colors of the interface, place of the panel.

use bevy::prelude::*;
use std::ops::RangeInclusive;

/// Valid scales of the interface.
pub const SCALES: RangeInclusive<f32> = 0.75..=3.0;
/// Scales that are offered.
pub const SCALE_STEPS: [f32; 5] = [1.0, 1.25, 1.5, 1.75, 2.0];
/// Valid widths of the panel [logical px].
pub const PANEL_WIDTHS: RangeInclusive<f32> = 328.0..=720.0;

/// Quality of the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Quality {
    /// By the measured frame time: high, low, or low at half the resolution.
    #[default]
    Auto,
    /// No shadows, no smoothed edges, and bodies at two thirds of the resolution.
    Low,
    /// Shadows, smoothed edges, and the resolution of the window.
    High,
}

/// Colors of the interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Theme {
    /// Light text on a dark ground.
    #[default]
    Dark,
    /// Dark text on a light ground.
    Light,
}

/// A side of the window.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Side {
    /// The left side.
    Left,
    /// The right side.
    #[default]
    Right,
}

/// The display settings.
#[derive(Resource, Debug, Clone, Copy, PartialEq)]
pub struct DisplaySettings {
    /// Quality of the picture.
    pub quality: Quality,
    /// Scale of the interface, in [`SCALES`]; `None` for [`automatic_scale`].
    pub scale: Option<f32>,
    /// Colors of the interface.
    pub theme: Theme,
    /// Side of the window on which the panel is.
    pub side: Side,
    /// Width of the panel [logical px], in [`PANEL_WIDTHS`]. A small window limits it further.
    pub panel_width: f32,
}

impl Default for DisplaySettings {
    fn default() -> Self {
        Self {
            quality: Quality::Auto,
            scale: None,
            theme: Theme::Dark,
            side: Side::Right,
            panel_width: 344.0,
        }
    }
}

/// A change of one of the display settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DisplayChange {
    /// The quality of the picture.
    Quality(Quality),
    /// The scale of the interface; `None` for the automatic one.
    Scale(Option<f32>),
    /// The colors of the interface.
    Theme(Theme),
    /// The side of the panel.
    Side(Side),
    /// The width of the panel [logical px].
    PanelWidth(f32),
}

impl DisplaySettings {
    /// Applies a change; numbers are clamped to their range, and ignored if not finite.
    pub fn change(&mut self, change: DisplayChange) {
        let finite = |value: &f32| value.is_finite();
        match change {
            DisplayChange::Quality(quality) => self.quality = quality,
            DisplayChange::Scale(scale) => {
                let scale = scale.filter(finite);
                self.scale = scale.map(|it| it.clamp(*SCALES.start(), *SCALES.end()));
            }
            DisplayChange::Theme(theme) => self.theme = theme,
            DisplayChange::Side(side) => self.side = side,
            DisplayChange::PanelWidth(width) if width.is_finite() => {
                let (min, max) = PANEL_WIDTHS.into_inner();
                self.panel_width = width.clamp(min, max);
            }
            DisplayChange::PanelWidth(_) => {}
        }
    }
}

/// Scale of the interface for a window of a size [physical px] on a system that asks for `system`
/// physical pixels per logical one. A system that asks for more than one is followed. Otherwise the
/// scale grows with the window in quarters, so that text does not become tiny on a large screen.
#[must_use]
pub fn automatic_scale(size: UVec2, system: f32) -> f32 {
    /// Size of a window per unit of scale [px]: 1920 × 1080 gives 1, 2560 × 1440 gives 1.25.
    const UNIT: Vec2 = Vec2::new(1500.0, 1100.0);
    if system > 1.0 {
        return system;
    }
    let ratio = (size.as_vec2() / UNIT).min_element();
    ((4.0 * ratio).floor() / 4.0).clamp(1.0, 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_window_has_larger_text_and_the_system_is_followed() {
        let scale = |x, y| automatic_scale(UVec2::new(x, y), 1.0);
        assert_eq!(scale(1280, 800), 1.0);
        assert_eq!(scale(1920, 1080), 1.0);
        assert_eq!(scale(2560, 1440), 1.25);
        assert_eq!(scale(2560, 1900), 1.5);
        assert_eq!(scale(3840, 2160), 1.75);
        assert_eq!(scale(320, 200), 1.0);
        assert_eq!(automatic_scale(UVec2::new(3840, 2160), 2.0), 2.0);
    }

    #[test]
    fn numbers_out_of_range_are_clamped_or_ignored() {
        let mut settings = DisplaySettings::default();
        settings.change(DisplayChange::Scale(Some(90.0)));
        assert_eq!(settings.scale, Some(*SCALES.end()));
        settings.change(DisplayChange::Scale(Some(f32::NAN)));
        assert_eq!(settings.scale, None);
        settings.change(DisplayChange::PanelWidth(1.0));
        assert_eq!(settings.panel_width, *PANEL_WIDTHS.start());
        settings.change(DisplayChange::PanelWidth(f32::INFINITY));
        assert_eq!(settings.panel_width, *PANEL_WIDTHS.start());
    }
}
