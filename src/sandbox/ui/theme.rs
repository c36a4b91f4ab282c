//! Colors, sizes and spacing of everything that egui draws.
//!
//! Only colors carry meaning: `accent` marks editable values, `changed` marks differences from the
//! scene file, `alarm` marks errors. Text has a contrast of at least 4.5 to 1 on the panel, as
//! verified by a test.

use crate::sandbox::state::display::{DisplaySettings, Theme};
use bevy::{
    asset::AssetEventSystems,
    prelude::{
        App, DetectChanges, IntoScheduleConfigs, Local, Plugin, PostUpdate, PreUpdate, Query, Res,
    },
};
use bevy_egui::{
    EguiContext, EguiPostUpdateSet,
    egui::{
        self, Color32, CornerRadius, FontFamily, FontId, Margin, Shadow, Stroke, TextStyle, Vec2,
        style::{HandleShape, ScrollFadeStyle, ScrollStyle, WidgetVisuals},
    },
};

/// Colors of a theme.
#[derive(Debug, Clone, PartialEq)]
pub struct Palette {
    /// Background of the panel.
    pub ground: Color32,
    /// Background of recessed parts: rails, entries, rows.
    pub sunken: Color32,
    /// Background of buttons.
    pub raised: Color32,
    /// Background of hovered buttons.
    pub raised_hovered: Color32,
    /// Background of selected buttons.
    pub selected: Color32,
    /// Lines between parts.
    pub line: Color32,
    /// Minor lines, such as the ticks of a rail.
    pub tick: Color32,
    /// Figures and headings.
    pub strong: Color32,
    /// Text.
    pub text: Color32,
    /// Units, notes, and disabled parts.
    pub weak: Color32,
    /// Background of text over the view. Nearly opaque: the window blends in linear light, where a
    /// dark translucent color appears lighter than its value suggests.
    pub veil: Color32,
    /// Editable values, and active parts.
    pub accent: Color32,
    /// Differences from the scene file.
    pub changed: Color32,
    /// Errors.
    pub alarm: Color32,
}

/// Colors of the dark theme.
pub const DARK: Palette = Palette {
    ground: Color32::from_rgb(25, 28, 35),
    sunken: Color32::from_rgb(17, 19, 24),
    raised: Color32::from_rgb(43, 48, 59),
    raised_hovered: Color32::from_rgb(57, 64, 78),
    selected: Color32::from_rgb(44, 92, 98),
    line: Color32::from_rgb(50, 56, 68),
    tick: Color32::from_rgb(84, 93, 110),
    strong: Color32::from_rgb(240, 243, 248),
    text: Color32::from_rgb(205, 211, 221),
    weak: Color32::from_rgb(142, 151, 167),
    veil: Color32::from_rgba_unmultiplied_const(20, 23, 29, 242),
    accent: Color32::from_rgb(94, 190, 196),
    changed: Color32::from_rgb(245, 184, 92),
    alarm: Color32::from_rgb(255, 122, 107),
};

/// Colors of the light theme.
pub const LIGHT: Palette = Palette {
    ground: Color32::from_rgb(246, 247, 249),
    sunken: Color32::from_rgb(232, 235, 240),
    raised: Color32::from_rgb(220, 224, 231),
    raised_hovered: Color32::from_rgb(205, 211, 221),
    selected: Color32::from_rgb(164, 218, 222),
    line: Color32::from_rgb(203, 208, 217),
    tick: Color32::from_rgb(146, 154, 168),
    strong: Color32::from_rgb(14, 17, 23),
    text: Color32::from_rgb(45, 51, 62),
    weak: Color32::from_rgb(84, 93, 108),
    veil: Color32::from_rgba_unmultiplied_const(248, 249, 251, 242),
    accent: Color32::from_rgb(0, 108, 116),
    changed: Color32::from_rgb(138, 78, 0),
    alarm: Color32::from_rgb(176, 30, 18),
};

/// Colors of the active theme.
#[must_use]
pub fn colors(context: &egui::Context) -> &'static Palette {
    match context.theme() {
        egui::Theme::Dark => &DARK,
        egui::Theme::Light => &LIGHT,
    }
}

/// Colors of the active theme.
#[must_use]
pub fn of(ui: &egui::Ui) -> &'static Palette {
    colors(ui.ctx())
}

/// Height of a row of the panel [logical px].
pub const ROW: f32 = 21.0;
/// Maximum width of a tooltip [logical px].
pub const TOOLTIP: f32 = 280.0;
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
        app.init_resource::<DisplaySettings>();
        // Glyphs that are drawn for the first time are uploaded with the frame that needs them.
        app.configure_sets(
            PostUpdate,
            EguiPostUpdateSet::PostProcessOutput.before(AssetEventSystems),
        )
        .add_systems(PreUpdate, dress);
    }
}

fn dress(
    mut contexts: Query<&mut EguiContext>,
    settings: Res<DisplaySettings>,
    mut worn: Local<Theme>,
) {
    let changed = *worn != settings.theme;
    *worn = settings.theme;
    for mut context in &mut contexts {
        if changed || context.is_added() {
            apply(context.get_mut(), settings.theme);
        }
    }
}

/// Applies a theme to a context.
pub fn apply(context: &egui::Context, theme: Theme) {
    context.set_theme(match theme {
        Theme::Dark => egui::Theme::Dark,
        Theme::Light => egui::Theme::Light,
    });
    // Zooming egui alone would shift everything that is drawn over the picture.
    context.options_mut(|options| options.zoom_with_keyboard = false);
    context.style_mut_of(egui::Theme::Dark, |it| style(it, &DARK));
    context.style_mut_of(egui::Theme::Light, |it| style(it, &LIGHT));
}

fn style(style: &mut egui::Style, colors: &Palette) {
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
    spacing.tooltip_width = TOOLTIP;
    spacing.combo_height = 480.0;
    spacing.icon_width = 14.0;
    spacing.scroll = ScrollStyle {
        bar_width: 8.0,
        // bevy_egui blends the fade to transparent as a gray edge.
        fade: ScrollFadeStyle {
            strength: 0.0,
            ..ScrollFadeStyle::default()
        },
        ..ScrollStyle::thin()
    };
    style.interaction.tooltip_delay = 0.35;
    style.interaction.selectable_labels = false;
    style.visuals = visuals(colors);
}

fn visuals(colors: &Palette) -> egui::Visuals {
    let is_dark = *colors == DARK;
    let mut visuals = if is_dark {
        egui::Visuals::dark()
    } else {
        egui::Visuals::light()
    };
    let state = |fill: Color32, line: Color32, text: Color32| WidgetVisuals {
        bg_fill: fill,
        weak_bg_fill: fill,
        bg_stroke: Stroke::new(1.0, line),
        corner_radius: CornerRadius::same(4),
        fg_stroke: Stroke::new(1.2, text),
        expansion: 0.0,
    };
    visuals.widgets.noninteractive = state(colors.ground, colors.line, colors.text);
    visuals.widgets.inactive = state(colors.raised, colors.raised, colors.text);
    visuals.widgets.hovered = state(colors.raised_hovered, colors.raised_hovered, colors.strong);
    visuals.widgets.active = state(colors.raised_hovered, colors.accent, colors.strong);
    visuals.widgets.open = state(colors.raised, colors.line, colors.strong);
    visuals.selection.bg_fill = colors.selected;
    visuals.selection.stroke = Stroke::new(1.0, colors.strong);
    visuals.weak_text_color = Some(colors.weak);
    visuals.hyperlink_color = colors.accent;
    visuals.warn_fg_color = colors.changed;
    visuals.error_fg_color = colors.alarm;
    visuals.panel_fill = colors.ground;
    visuals.window_fill = colors.ground;
    visuals.window_stroke = Stroke::new(1.0, colors.line);
    visuals.extreme_bg_color = colors.sunken;
    visuals.faint_bg_color = colors.sunken;
    visuals.slider_trailing_fill = true;
    visuals.handle_shape = HandleShape::Circle;
    visuals.window_corner_radius = CornerRadius::same(8);
    visuals.menu_corner_radius = CornerRadius::same(6);
    let shade = Color32::from_black_alpha(if is_dark { 110 } else { 40 });
    visuals.window_shadow = Shadow {
        offset: [0, 8],
        blur: 24,
        spread: 0,
        color: shade,
    };
    visuals.popup_shadow = Shadow {
        offset: [0, 4],
        blur: 12,
        spread: 0,
        color: shade,
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
        for colors in [DARK, LIGHT] {
            let Palette {
                strong,
                text,
                weak,
                accent,
                changed,
                alarm,
                ..
            } = colors;
            for text in [strong, text, weak, accent, changed, alarm] {
                for ground in [colors.ground, colors.sunken] {
                    // WCAG 2 level AA requires 4.5 to 1 for text of this size.
                    assert!(contrast(text, ground) >= 4.5, "{text:?} on {ground:?}");
                }
            }
            for text in [strong, text] {
                for ground in [colors.raised_hovered, colors.selected] {
                    assert!(contrast(text, ground) >= 4.5, "{text:?} on {ground:?}");
                }
            }
        }
    }
}
