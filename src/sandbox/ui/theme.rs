//! Colors, sizes and spacing of everything that egui draws.
//!
//! Only colors carry meaning: [`ACCENT`] marks editable values, [`CHANGED`] marks differences from
//! the scene file, [`ALARM`] marks errors. Text has a contrast of at least 4.5 to 1 on the panel,
//! as verified by a test.

use bevy::prelude::{Added, App, Plugin, PreUpdate, Query};
use bevy_egui::{
    EguiContext,
    egui::{
        self, Color32, CornerRadius, FontFamily, FontId, Margin, Shadow, Stroke, TextStyle, Vec2,
        style::{HandleShape, ScrollStyle, WidgetVisuals},
    },
};

/// Background of the panel.
pub const GROUND: Color32 = Color32::from_rgb(25, 28, 35);
/// Background of recessed parts: rails, entries, rows.
pub const SUNKEN: Color32 = Color32::from_rgb(17, 19, 24);
/// Background of buttons.
pub const RAISED: Color32 = Color32::from_rgb(43, 48, 59);
/// Background of hovered buttons.
pub const RAISED_HOVERED: Color32 = Color32::from_rgb(57, 64, 78);
/// Lines between parts.
pub const LINE: Color32 = Color32::from_rgb(50, 56, 68);
/// Figures and headings.
pub const STRONG: Color32 = Color32::from_rgb(240, 243, 248);
/// Text.
pub const TEXT: Color32 = Color32::from_rgb(205, 211, 221);
/// Units, notes, and disabled parts.
pub const WEAK: Color32 = Color32::from_rgb(142, 151, 167);
/// Background of text over the view. Nearly opaque: the window blends in linear light, where a dark
/// translucent color appears lighter than its value suggests.
pub const VEIL: Color32 = Color32::from_rgba_unmultiplied_const(20, 23, 29, 242);
/// Editable values, and active parts.
pub const ACCENT: Color32 = Color32::from_rgb(94, 190, 196);
/// Differences from the scene file.
pub const CHANGED: Color32 = Color32::from_rgb(245, 184, 92);
/// Errors.
pub const ALARM: Color32 = Color32::from_rgb(255, 122, 107);

/// Height of a row of the panel [logical px].
pub const ROW: f32 = 21.0;
/// Minor lines, such as the ticks of a rail.
pub const TICK: Color32 = Color32::from_rgb(84, 93, 110);

/// Gap between neighbors in a row [logical px].
pub const GAP: f32 = 6.0;

/// Text style of the figures in the head-up line and in lists.
pub fn figures() -> TextStyle {
    TextStyle::Monospace
}

/// Applies the theme to every new egui context.
pub struct ThemePlugin;

impl Plugin for ThemePlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(PreUpdate, dress);
    }
}

fn dress(mut contexts: Query<&mut EguiContext, Added<EguiContext>>) {
    for mut context in &mut contexts {
        apply(context.get_mut());
    }
}

/// Applies the theme to a context. Needed once per context.
pub fn apply(context: &egui::Context) {
    context.set_theme(egui::Theme::Dark);
    context.all_styles_mut(style);
}

fn style(style: &mut egui::Style) {
    let proportional = |size| FontId::new(size, FontFamily::Proportional);
    style.text_styles = [
        (TextStyle::Heading, proportional(17.0)),
        (TextStyle::Body, proportional(13.0)),
        (TextStyle::Button, proportional(13.0)),
        (TextStyle::Small, proportional(11.5)),
        (
            TextStyle::Monospace,
            FontId::new(12.0, FontFamily::Monospace),
        ),
    ]
    .into();
    style.drag_value_text_style = TextStyle::Small;
    style.explanation_tooltips = false;
    style.animation_time = 0.1;

    let spacing = &mut style.spacing;
    spacing.item_spacing = Vec2::new(GAP, 3.0);
    spacing.button_padding = Vec2::new(8.0, 3.0);
    spacing.interact_size = Vec2::new(28.0, ROW);
    spacing.window_margin = Margin::same(12);
    spacing.menu_margin = Margin::same(6);
    spacing.tooltip_width = 280.0;
    spacing.combo_height = 480.0;
    spacing.icon_width = 14.0;
    spacing.scroll = ScrollStyle {
        bar_width: 8.0,
        ..ScrollStyle::thin()
    };
    style.interaction.tooltip_delay = 0.35;
    style.interaction.selectable_labels = false;
    style.visuals = visuals();
}

fn visuals() -> egui::Visuals {
    let mut visuals = egui::Visuals::dark();
    let state = |fill: Color32, line: Color32, text: Color32| WidgetVisuals {
        bg_fill: fill,
        weak_bg_fill: fill,
        bg_stroke: Stroke::new(1.0, line),
        corner_radius: CornerRadius::same(4),
        fg_stroke: Stroke::new(1.2, text),
        expansion: 0.0,
    };
    visuals.widgets.noninteractive = state(GROUND, LINE, TEXT);
    visuals.widgets.inactive = state(RAISED, RAISED, TEXT);
    visuals.widgets.hovered = state(RAISED_HOVERED, RAISED_HOVERED, STRONG);
    visuals.widgets.active = state(RAISED_HOVERED, ACCENT, STRONG);
    visuals.widgets.open = state(RAISED, LINE, STRONG);
    visuals.selection.bg_fill = Color32::from_rgb(44, 92, 98);
    visuals.selection.stroke = Stroke::new(1.0, STRONG);
    visuals.weak_text_color = Some(WEAK);
    visuals.hyperlink_color = ACCENT;
    visuals.warn_fg_color = CHANGED;
    visuals.error_fg_color = ALARM;
    visuals.panel_fill = GROUND;
    visuals.window_fill = GROUND;
    visuals.window_stroke = Stroke::new(1.0, LINE);
    visuals.extreme_bg_color = SUNKEN;
    visuals.faint_bg_color = Color32::from_rgb(30, 33, 41);
    visuals.slider_trailing_fill = true;
    visuals.handle_shape = HandleShape::Circle;
    visuals.window_corner_radius = CornerRadius::same(8);
    visuals.menu_corner_radius = CornerRadius::same(6);
    visuals.window_shadow = Shadow {
        offset: [0, 8],
        blur: 24,
        spread: 0,
        color: Color32::from_black_alpha(110),
    };
    visuals.popup_shadow = Shadow {
        offset: [0, 4],
        blur: 12,
        spread: 0,
        color: Color32::from_black_alpha(110),
    };
    visuals.striped = false;
    visuals
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance as WCAG 2 defines it, 0 (black) to 1 (white).
    fn luminance(color: Color32) -> f32 {
        let linear = |byte: u8| {
            let c = f32::from(byte) / 255.0;
            if c <= 0.04045 {
                c / 12.92
            } else {
                ((c + 0.055) / 1.055).powf(2.4)
            }
        };
        0.2126 * linear(color.r()) + 0.7152 * linear(color.g()) + 0.0722 * linear(color.b())
    }

    fn contrast(a: Color32, b: Color32) -> f32 {
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    #[test]
    fn every_text_can_be_read_on_every_ground_that_it_stands_on() {
        for text in [STRONG, TEXT, WEAK, ACCENT, CHANGED, ALARM] {
            for ground in [GROUND, SUNKEN] {
                // WCAG 2 level AA requires 4.5 to 1 for text of this size.
                assert!(contrast(text, ground) >= 4.5, "{text:?} on {ground:?}");
            }
        }
        for text in [STRONG, TEXT] {
            assert!(contrast(text, RAISED_HOVERED) >= 4.5, "{text:?}");
        }
    }
}
