//! Building blocks of the panel's sections: collapsible section, rows of buttons, switch.

use bevy_egui::egui::{
    Align2, Button, FontSelection, Id, Label, Rect, RectAlign, Response, RichText, Sense, Stroke,
    StrokeKind, TextStyle, Tooltip, Ui, Vec2, WidgetInfo, WidgetType,
    collapsing_header::CollapsingState, lerp, pos2, vec2,
};

use super::Panel;
use crate::sandbox::ui::theme;

/// A collapsible section, open at first. Its heading is named `section.<title>` among the widget
/// rectangles.
pub fn section(
    ui: &mut Ui,
    panel: &mut Panel,
    title: &str,
    body: impl FnOnce(&mut Ui, &mut Panel),
) {
    let mut state = heading_of(ui, panel, title, true);
    state.show_body_unindented(ui, |ui| body(ui, panel));
}

/// A collapsible section, folded at first; `body` draws all of it, or what is shown while it is folded.
pub fn folded_section(
    ui: &mut Ui,
    panel: &mut Panel,
    title: &str,
    body: impl FnOnce(&mut Ui, &mut Panel, bool),
) {
    let mut state = heading_of(ui, panel, title, false);
    if state.openness(ui.ctx()) == 0.0 {
        body(ui, panel, false);
    } else {
        state.show_body_unindented(ui, |ui| body(ui, panel, true));
    }
}

/// The heading of a collapsible section, with the state that a click changes.
fn heading_of(ui: &mut Ui, panel: &mut Panel, title: &str, opens: bool) -> CollapsingState {
    ui.add_space(6.0);
    let id = Id::new(("panel section", title));
    let mut state = CollapsingState::load_with_default_open(ui.ctx(), id, opens);
    let size = vec2(ui.available_width(), 20.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    response.widget_info(|| WidgetInfo::labeled(WidgetType::CollapsingHeader, true, title));
    panel.note(format!("section.{}", title.to_lowercase()), &response, ui);
    if response.clicked() {
        state.toggle(ui);
    }
    let color = if response.hovered() {
        theme::of(ui).strong
    } else {
        theme::of(ui).weak
    };
    let font = FontSelection::Style(TextStyle::Small).resolve(ui.style());
    let painter = ui.painter();
    let text = painter.text(
        rect.left_center(),
        Align2::LEFT_CENTER,
        title.to_uppercase(),
        font.clone(),
        color,
    );
    let chevron = if state.is_open() { "⏷" } else { "⏵" };
    painter.text(
        rect.right_center(),
        Align2::RIGHT_CENTER,
        chevron,
        font,
        color,
    );
    painter.hline(
        text.right() + 8.0..=rect.right() - 16.0,
        rect.center().y,
        Stroke::new(1.0, theme::of(ui).line),
    );
    state
}

/// The heading of a section of search results.
pub fn heading(ui: &mut Ui, title: &str) {
    ui.add_space(6.0);
    let text = RichText::new(title.to_uppercase()).small();
    ui.label(text.color(theme::of(ui).weak));
}

/// A button of a row.
pub struct RowButton<'a> {
    /// Name among the widget rectangles.
    pub name: &'a str,
    /// Text.
    pub text: &'a str,
    /// Tooltip.
    pub help: &'a str,
    /// Whether it can be pressed.
    pub enabled: bool,
    /// Whether it is switched on.
    pub selected: bool,
}

impl<'a> RowButton<'a> {
    /// An enabled button.
    pub fn new(name: &'a str, text: &'a str, help: &'a str) -> Self {
        Self {
            name,
            text,
            help,
            enabled: true,
            selected: false,
        }
    }
}

/// Horizontal padding of a button of a row [logical px].
const PADDING: f32 = 2.0;

/// Widths of the buttons of a row [logical px]: equal, or by their texts where one would not fit.
fn button_widths(ui: &Ui, buttons: &[RowButton]) -> Vec<f32> {
    let count = buttons.len() as f32;
    let gaps = theme::GAP * (buttons.len().saturating_sub(1)) as f32;
    let free = ui.available_width() - gaps;
    let equal = free / count;
    let font = TextStyle::Button.resolve(ui.style());
    let needed = |button: &RowButton| {
        let (text, color) = (button.text.to_owned(), theme::of(ui).text);
        let galley = ui.painter().layout_no_wrap(text, font.clone(), color);
        (galley.size().x + 2.0 * PADDING).ceil()
    };
    let needed: Vec<f32> = buttons.iter().map(needed).collect();
    let spare = (free - needed.iter().sum::<f32>()) / count;
    if spare < 0.0 || needed.iter().all(|&width| width <= equal) {
        return vec![equal; buttons.len()];
    }
    needed.into_iter().map(|width| width + spare).collect()
}

/// Buttons over the whole row; returns the index of the pressed one.
pub fn button_row(ui: &mut Ui, panel: &mut Panel, buttons: &[RowButton]) -> Option<usize> {
    let widths = button_widths(ui, buttons);
    let mut pressed = None;
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = theme::GAP;
        ui.spacing_mut().button_padding.x = PADDING;
        for (index, (button, width)) in buttons.iter().zip(widths).enumerate() {
            let widget = Button::new(button.text)
                .selected(button.selected)
                .min_size(Vec2::new(width, theme::ROW + 2.0))
                .truncate();
            let response = ui
                .add_enabled_ui(button.enabled, |ui| {
                    ui.add_sized([width, theme::ROW + 2.0], widget)
                })
                .inner
                .on_hover_text(button.help)
                .on_disabled_hover_text(button.help);
            panel.note(button.name, &response, ui);
            if response.clicked() {
                pressed = Some(index);
            }
        }
    });
    pressed
}

/// A switch; the second value is `true` if it was pressed.
pub fn switch(ui: &mut Ui, on: bool, enabled: bool, title: &str) -> (Response, bool) {
    let sense = if enabled {
        Sense::click()
    } else {
        Sense::hover()
    };
    let (rect, response) = ui.allocate_exact_size(vec2(26.0, theme::ROW), sense);
    response.widget_info(|| WidgetInfo::selected(WidgetType::Checkbox, enabled, on, title));
    let travel = ui.ctx().animate_bool_responsive(response.id, on);
    let body = Rect::from_center_size(rect.center(), vec2(24.0, 13.0));
    let ground = if on {
        theme::of(ui)
            .accent
            .gamma_multiply(if enabled { 0.75 } else { 0.35 })
    } else {
        theme::of(ui).raised
    };
    let line = if response.hovered() && enabled {
        theme::of(ui).text
    } else {
        ground
    };
    let painter = ui.painter();
    painter.rect(
        body,
        6.5,
        ground,
        Stroke::new(1.0, line),
        StrokeKind::Inside,
    );
    let x = lerp(body.left() + 6.5..=body.right() - 6.5, travel);
    let knob = if enabled {
        theme::of(ui).strong
    } else {
        theme::of(ui).weak
    };
    painter.circle_filled(pos2(x, body.center().y), 4.5, knob);
    let pressed = enabled && response.clicked();
    (response, pressed)
}

/// A tooltip beside the panel, so that it does not cover the next row.
pub fn hint(ui: &Ui, response: &Response, contents: impl FnOnce(&mut Ui)) {
    let mut tooltip = Tooltip::for_enabled(response);
    let row = Rect::from_x_y_ranges(ui.max_rect().x_range(), response.rect.y_range());
    tooltip.popup = tooltip
        .popup
        .anchor(row)
        .align(RectAlign::LEFT)
        .align_alternatives(&[
            RectAlign::LEFT_START,
            RectAlign::LEFT_END,
            RectAlign::BOTTOM,
        ])
        .gap(18.0);
    tooltip.show(contents);
}

/// A line of weak text with wrapping.
pub fn note(ui: &mut Ui, text: &str) {
    ui.add(Label::new(RichText::new(text).small().color(theme::of(ui).weak)).wrap());
}
