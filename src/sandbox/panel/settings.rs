//! The section of the display settings: quality, interface scale, theme, side of the panel.

use bevy_egui::egui::{Align2, Button, ComboBox, FontSelection, Response, Sense, Ui, Vec2};

use super::{
    Panel,
    model::PanelModel,
    parameter::title_width,
    query::Query,
    section::{self, RowButton, section},
};
use crate::sandbox::{
    render::quality::EffectiveQuality,
    state::{
        display::{DisplayChange, Quality, SCALE_STEPS, Side, Theme},
        request::Request,
    },
    ui::theme,
};

/// A row of the section.
struct Row {
    /// Title.
    title: &'static str,
    /// Description.
    help: &'static str,
    /// Draws it.
    draw: fn(&mut Ui, &mut Panel, &PanelModel, &str),
}

const ROWS: &[Row] = &[
    Row {
        title: "Quality",
        help: "Low draws no shadows, does not smooth edges, and draws the bodies at two thirds of \
               the resolution. Auto measures the time of a frame and lowers the quality below \
               30 frames per second: to low, then to half the resolution.",
        draw: quality,
    },
    Row {
        title: "UI scale",
        help: "Size of text and controls (Ctrl + and Ctrl -, Ctrl 0 for automatic). Auto follows \
               the system, or else the size of the window.",
        draw: scale,
    },
    Row {
        title: "Theme",
        help: "Colors of the panel and of everything that is written over the view",
        draw: theme_row,
    },
    Row {
        title: "Panel side",
        help: "Side of the window. Drag the edge of the panel to change its width.",
        draw: side,
    },
    Row {
        title: "First steps",
        help: "Show the three first steps again",
        draw: first_steps,
    },
];

/// Draws the section.
pub fn show(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    section(ui, panel, "Settings", |ui, panel| {
        for row in ROWS {
            (row.draw)(ui, panel, model, row.help);
        }
    });
}

/// Draws the rows that match a search, and returns whether there are any.
pub fn found(ui: &mut Ui, panel: &mut Panel, model: &PanelModel, query: &Query) -> bool {
    let rows = ROWS.iter();
    let rows: Vec<&Row> = rows
        .filter(|row| query.matches(&["Settings", row.title, row.help]))
        .collect();
    if !rows.is_empty() {
        section::heading(ui, "Settings");
    }
    for row in &rows {
        (row.draw)(ui, panel, model, row.help);
    }
    !rows.is_empty()
}

fn theme_row(ui: &mut Ui, panel: &mut Panel, model: &PanelModel, help: &str) {
    let themes = [
        ("dark", "Dark", Theme::Dark),
        ("light", "Light", Theme::Light),
    ];
    let current = model.display.theme;
    if let Some(theme) = choice(ui, panel, ("Theme", help), &themes, current) {
        panel.ask(Request::Display(DisplayChange::Theme(theme)));
    }
}

fn side(ui: &mut Ui, panel: &mut Panel, model: &PanelModel, help: &str) {
    let sides = [
        ("left", "Left", Side::Left),
        ("right", "Right", Side::Right),
    ];
    let current = model.display.side;
    if let Some(side) = choice(ui, panel, ("Panel side", help), &sides, current) {
        panel.ask(Request::Display(DisplayChange::Side(side)));
    }
}

fn first_steps(ui: &mut Ui, panel: &mut Panel, _: &PanelModel, help: &str) {
    let steps = RowButton::new("settings.first_steps", "First steps", help);
    if section::button_row(ui, panel, &[steps]).is_some() {
        panel.ask(Request::FirstSteps);
    }
}

fn quality(ui: &mut Ui, panel: &mut Panel, model: &PanelModel, help: &str) {
    let automatic = match (model.display.quality, model.quality) {
        (Quality::Auto, EffectiveQuality::Lowest) => "Auto: half",
        (Quality::Auto, EffectiveQuality::Low) => "Auto: low",
        (Quality::Auto, EffectiveQuality::High) => "Auto: high",
        _ => "Auto",
    };
    let choices = [
        ("auto", automatic, Quality::Auto),
        ("low", "Low", Quality::Low),
        ("high", "High", Quality::High),
    ];
    let current = model.display.quality;
    if let Some(quality) = choice(ui, panel, ("Quality", help), &choices, current) {
        panel.ask(Request::Display(DisplayChange::Quality(quality)));
    }
}

/// The scale as a drop-down.
fn scale(ui: &mut Ui, panel: &mut Panel, model: &PanelModel, help: &str) {
    let percent = |scale: f32| format!("{:.0} %", 100.0 * scale);
    let automatic = format!("Auto ({})", percent(model.automatic_scale));
    let chosen = model.display.scale;
    ui.horizontal(|ui| {
        let name = title(ui, "UI scale");
        let menu = ComboBox::from_id_salt("ui scale")
            .selected_text(chosen.map_or_else(|| automatic.clone(), percent))
            .width(ui.available_width())
            .show_ui(ui, |ui| {
                let steps = SCALE_STEPS.map(|step| (Some(step), percent(step)));
                let first = (None, automatic.clone());
                for (scale, text) in std::iter::once(first).chain(steps) {
                    let line = ui.selectable_label(scale == chosen, &text);
                    let step = scale.map_or("auto".to_owned(), |it| format!("{:.0}", it * 100.0));
                    panel.note(format!("settings.scale.{step}"), &line, ui);
                    if line.clicked() {
                        panel.ask(Request::Display(DisplayChange::Scale(scale)));
                    }
                }
            });
        panel.note("settings.scale", &menu.response, ui);
        name.on_hover_text(help);
        menu.response.on_hover_text(help);
    });
}

/// A row of buttons for the values of a setting, each with its name and text; returns the value
/// that was pressed.
fn choice<T: Copy + PartialEq>(
    ui: &mut Ui,
    panel: &mut Panel,
    (name, help): (&str, &str),
    choices: &[(&str, &str, T)],
    current: T,
) -> Option<T> {
    let mut pressed = None;
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = theme::GAP;
        ui.spacing_mut().button_padding.x = 2.0;
        title(ui, name).on_hover_text(help);
        let count = choices.len() as f32;
        let width = (ui.available_width() - theme::GAP * (count - 1.0)) / count;
        for (key, text, value) in choices {
            let button = Button::new(*text).selected(*value == current);
            let button = ui.add_sized(Vec2::new(width, theme::ROW), button);
            panel.note(format!("settings.{key}"), &button, ui);
            if button.clicked() {
                pressed = Some(*value);
            }
            button.on_hover_text(help);
        }
    });
    pressed
}

fn title(ui: &mut Ui, text: &str) -> Response {
    let size = Vec2::new(title_width(ui), theme::ROW);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    let font = FontSelection::Default.resolve(ui.style());
    let color = theme::of(ui).text;
    let place = rect.left_center();
    ui.painter()
        .text(place, Align2::LEFT_CENTER, text, font, color);
    response
}
