//! A row of the panel for one number: title, slider, text entry with unit, reset.
//!
//! The row never changes the number; it returns the user's edit.

use std::cell::RefCell;

use bevy_egui::egui::{
    Align2, Button, Color32, DragValue, FontSelection, Response, RichText, Sense, Ui, Vec2,
};

use super::{Panel, model::Parameter, section::hint};
use crate::sandbox::ui::theme;
use crate::sandbox::ui::{number, slider::slider, track::Spread};

/// Width of the text entry with its unit [logical px].
const ENTRY: f32 = 86.0;
/// Width of the reset button [logical px].
pub(super) const RESET: f32 = 18.0;

/// Width of the title column [logical px]: a part of the row, as wide as the longest title if there
/// is room. Longer titles are wrapped.
pub(super) fn title_width(ui: &Ui) -> f32 {
    (0.36 * ui.available_width()).clamp(104.0, 190.0)
}

/// The user's edit of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Edit {
    /// Set to a value.
    Set(f64),
    /// Reset to the scene default.
    Reset,
}

/// Draws the row of a parameter. `name` identifies it among the widget rectangles.
///
/// `written` is its name in scene files and on the command line, if it has one.
pub fn row(
    ui: &mut Ui,
    panel: &mut Panel,
    (name, written): (&str, Option<&str>),
    parameter: &Parameter,
) -> Option<Edit> {
    let named = Named { parameter, written };
    ui.push_id(name, |ui| {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = theme::GAP;
            title(ui, named);
            if !parameter.choices.is_empty() {
                return choose(ui, panel, name, named);
            }
            let width = ui.available_width() - ENTRY - RESET - 2.0 * theme::GAP;
            let mark = parameter.original.filter(|_| parameter.changed);
            let (rail, slid) = slider(
                ui,
                width.max(40.0),
                &parameter.track,
                parameter.value,
                mark,
                parameter.title,
            );
            panel.note(name, &rail, ui);
            let mut edit = slid.map(Edit::Set);
            if rail.double_clicked() && parameter.changed {
                edit = Some(Edit::Reset);
            }
            hint(ui, &rail, |ui| help(ui, named));

            if let Some(value) = entry(ui, panel, name, named) {
                edit = Some(Edit::Set(value));
            }
            let reset = reset(ui, parameter);
            panel.note(format!("{name}.reset"), &reset, ui);
            if reset.clicked() {
                edit = Some(Edit::Reset);
            }
            edit
        })
        .inner
    })
    .inner
}

/// A parameter with its name in scene files and on the command line.
#[derive(Clone, Copy)]
struct Named<'a> {
    parameter: &'a Parameter,
    written: Option<&'a str>,
}

/// Buttons for a parameter with named values.
fn choose(ui: &mut Ui, panel: &mut Panel, name: &str, named: Named) -> Option<Edit> {
    let parameter = named.parameter;
    let count = parameter.choices.len() as f32;
    let width = ui.available_width() - RESET - theme::GAP;
    let width = (width - theme::GAP * (count - 1.0)) / count;
    let size = Vec2::new(width, theme::ROW - 2.0);
    let first = parameter.track.low().round();
    let mut edit = None;
    for (value, choice) in (0..).map(|i| first + f64::from(i)).zip(parameter.choices) {
        let selected = parameter.value == value;
        let button = ui.add_sized(size, Button::new(*choice).selected(selected));
        panel.note(format!("{name}.{choice}"), &button, ui);
        if button.clicked() && !selected {
            edit = Some(Edit::Set(value));
        }
        hint(ui, &button, |ui| help(ui, named));
    }
    let reset = reset(ui, parameter);
    panel.note(format!("{name}.reset"), &reset, ui);
    if reset.clicked() {
        edit = Some(Edit::Reset);
    }
    edit
}

fn title(ui: &mut Ui, named: Named) {
    let font = FontSelection::Default.resolve(ui.style());
    let width = title_width(ui);
    let text = named.parameter.title.to_owned();
    let text = ui.painter().layout(text, font, Color32::PLACEHOLDER, width);
    let size = Vec2::new(width, theme::ROW.max(text.size().y));
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    let color = if response.hovered() {
        theme::of(ui).strong
    } else {
        theme::of(ui).text
    };
    let place = Align2::LEFT_CENTER.anchor_size(rect.left_center(), text.size());
    ui.painter().galley(place.min, text, color);
    hint(ui, &response, |ui| help(ui, named));
}

/// The number with its unit, to be dragged or typed.
fn entry(ui: &mut Ui, panel: &mut Panel, name: &str, named: Named) -> Option<f64> {
    let parameter = named.parameter;
    let mut value = parameter.value;
    let unit = parameter.unit;
    let differs = parameter.spread.is_some();
    let speed = match parameter.track.spread() {
        Spread::Integer => 0.1,
        Spread::Linear => 0.02,
        Spread::Logarithmic => (parameter.value.abs() * 0.01).max(1e-12),
    };
    let refused = RefCell::new(None);
    let widget = DragValue::new(&mut value)
        .speed(speed)
        .range(f64::NEG_INFINITY..=f64::INFINITY)
        .update_while_editing(false)
        .custom_formatter(move |value, _| {
            let number = number::format(value, 3);
            let sign = if differs { "~ " } else { "" };
            if unit.is_empty() {
                format!("{sign}{number}")
            } else {
                format!("{sign}{number} {unit}")
            }
        })
        .custom_parser(
            |text| match number::parse(text.trim_start_matches('~'), unit) {
                Ok(value) => Some(value),
                Err(reason) => {
                    *refused.borrow_mut() = Some(reason);
                    None
                }
            },
        );
    let response = ui
        .scope(|ui| {
            let colors = theme::of(ui);
            let visuals = ui.visuals_mut();
            let ground = colors.sunken;
            visuals.widgets.inactive.weak_bg_fill = ground;
            visuals.widgets.inactive.bg_stroke.color = ground;
            if parameter.changed {
                visuals.widgets.inactive.fg_stroke.color = colors.changed;
            }
            ui.spacing_mut().button_padding.x = 4.0;
            ui.spacing_mut().interact_size.x = ENTRY;
            ui.add_sized([ENTRY, theme::ROW - 2.0], widget)
        })
        .inner;
    if let Some(reason) = refused.take()
        && is_first_refusal(ui, &response)
    {
        panel.refuse(format!("{} is unchanged: {reason}", parameter.title));
    }
    panel.note(format!("{name}.entry"), &response, ui);
    let changed = response.changed();
    hint(ui, &response, |ui| help(ui, named));
    (changed && value as f32 != parameter.value as f32).then_some(value)
}

/// Whether a text was not refused in the previous frame already: egui reads it when the entry loses
/// the focus, and once more in the next frame.
fn is_first_refusal(ui: &Ui, response: &Response) -> bool {
    let (id, frame) = (response.id.with("refused"), ui.ctx().cumulative_pass_nr());
    ui.data_mut(|data| {
        let last = data.get_temp::<u64>(id);
        data.insert_temp(id, frame);
        last.is_none_or(|last| last + 1 < frame)
    })
}

/// The reset button. Keeps its space while the value is the scene default, so that the row does not
/// move.
fn reset(ui: &mut Ui, parameter: &Parameter) -> Response {
    let size = Vec2::new(RESET, theme::ROW - 2.0);
    if !parameter.changed {
        return ui.allocate_exact_size(size, Sense::hover()).1;
    }
    let text = match parameter.original {
        Some(original) => format!("Reset to the scene's {}", value_text(original, parameter)),
        None => "Reset each body to its value in the scene".to_owned(),
    };
    ui.scope(|ui| {
        ui.spacing_mut().button_padding = Vec2::ZERO;
        let glyph = RichText::new("⟲").color(theme::of(ui).changed);
        ui.add_sized(size, Button::new(glyph).frame_when_inactive(false))
    })
    .inner
    .on_hover_text(text)
}

fn help(ui: &mut Ui, Named { parameter, written }: Named) {
    ui.set_max_width(280.0);
    ui.horizontal(|ui| {
        ui.label(RichText::new(parameter.title).strong());
        if !parameter.unit.is_empty() {
            ui.label(RichText::new(format!("[{}]", parameter.unit)).weak());
        }
    });
    ui.label(parameter.help);
    if let Some((low, high)) = parameter.spread {
        ui.label(format!(
            "Differs between bodies: {} to {}.",
            with_unit(low, parameter.unit),
            with_unit(high, parameter.unit)
        ));
    }
    let typed = match parameter.choices {
        [] => "Click the number to type a value, such as 0.02, 1e-4 or 1/3.",
        _ => "",
    };
    match parameter.original {
        Some(original) if parameter.changed => {
            let original = value_text(original, parameter);
            ui.weak(format!("{typed} Scene: {original}; ⟲ resets."));
        }
        _ if typed.is_empty() => {}
        _ => {
            ui.weak(typed);
        }
    }
    if let Some(written) = written {
        ui.label(RichText::new(written).monospace().weak());
    }
}

fn value_text(value: f64, parameter: &Parameter) -> String {
    let place = (value - parameter.track.low()).round() as usize;
    match parameter.choices.get(place) {
        Some(choice) => (*choice).to_owned(),
        None => with_unit(value, parameter.unit),
    }
}

fn with_unit(value: f64, unit: &str) -> String {
    let number = number::format(value, 4);
    if unit.is_empty() {
        number
    } else {
        format!("{number} {unit}")
    }
}
