//! The list of bodies, in which one or several are selected.

use bevy_egui::egui::{
    Button, Color32, ComboBox, Id, PopupCloseBehavior, RichText, ScrollArea, Sense, Ui, vec2,
};

use super::edit;
use crate::sandbox::{
    panel::{
        Panel,
        model::{BodyEntry, BodyState, PanelModel},
        spawn,
    },
    state::{request::Request, selection::Scope},
    ui::theme,
};

/// Width of the button that adds bodies [logical px].
const ADD: f32 = 64.0;
/// Width of the button that edits the selection [logical px].
const EDIT: f32 = 40.0;
/// Maximum height of the list [logical px].
const LIST: f32 = 360.0;

/// Draws the list as a drop-down, and the menu that adds bodies.
pub fn show(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    let all = format!("All bodies ({})", model.bodies.len());
    let shown = match model.scope.keys().count() {
        0 => all.clone(),
        1 => model
            .bodies
            .iter()
            .find(|body| model.scope.names(body.key))
            .map_or_else(|| "(removed)".to_owned(), |body| body.name.clone()),
        n => format!("{n} of {} bodies", model.bodies.len()),
    };
    ui.horizontal(|ui| {
        let width = ui.available_width() - ADD - EDIT - 2.0 * theme::GAP;
        let combo = ComboBox::from_id_salt("scope")
            .selected_text(RichText::new(shown).color(theme::of(ui).strong))
            .width(width)
            .truncate()
            .close_behavior(PopupCloseBehavior::CloseOnClickOutside)
            .show_ui(ui, |ui| list(ui, panel, model, &all));
        panel.note("scope", &combo.response, ui);
        combo.response.on_hover_text(
            "Selection: whose parameters are shown and changed. Grabbing a body selects it; Ctrl \
             click on bodies selects several.",
        );
        edit::show(ui, panel, model, EDIT);
        spawn::show(ui, panel, model, ADD);
    });
}

fn list(ui: &mut Ui, panel: &mut Panel, model: &PanelModel, all: &str) {
    ui.set_min_width(220.0);
    let line = ui.selectable_label(model.scope == Scope::All, all);
    panel.note("scope.all", &line, ui);
    if line.clicked() {
        panel.ask(Request::Show(Scope::All));
        ui.close();
    }
    ScrollArea::vertical().max_height(LIST).show(ui, |ui| {
        for (index, body) in model.bodies.iter().enumerate() {
            ui.horizontal(|ui| row(ui, panel, model, (index, body)));
        }
    });
    ui.weak(RichText::new("Ctrl: one more or less · Shift: range").small());
}

fn row(ui: &mut Ui, panel: &mut Panel, model: &PanelModel, (index, body): (usize, &BodyEntry)) {
    let (swatch, _) = ui.allocate_exact_size(vec2(10.0, 14.0), Sense::hover());
    let [red, green, blue] = body.color;
    let color = Color32::from_rgb(red, green, blue);
    ui.painter()
        .rect_filled(swatch.shrink2(vec2(0.0, 2.0)), 2.0, color);
    let state = match (&body.state, body.hidden) {
        (BodyState::Quarantined(_), _) => " · diverged",
        (_, true) => " · hidden",
        (BodyState::Asleep, _) => " · asleep",
        (BodyState::Awake, _) => "",
    };
    let text = format!("{}{state}", body.name);
    let line = Button::selectable(model.scope.names(body.key), text).truncate();
    let line = ui.add(line);
    panel.note(format!("scope.{}", body.name), &line, ui);
    if !line.clicked() {
        return;
    }
    let modifiers = ui.input(|input| input.modifiers);
    let anchor = Id::new("anchor of the selection");
    let scope = if modifiers.command {
        model.scope.toggled(body.key)
    } else if modifiers.shift {
        let from = ui.data(|data| data.get_temp::<u64>(anchor));
        range(model, from, index)
    } else {
        ui.close();
        Scope::key(body.key)
    };
    if !modifiers.shift {
        ui.data_mut(|data| data.insert_temp(anchor, body.key));
    }
    panel.ask(Request::Show(scope));
}

/// The bodies from the one with key `from`, or else the first selected one, to the one at an index.
fn range(model: &PanelModel, from: Option<u64>, to: usize) -> Scope {
    let place = |key: u64| model.bodies.iter().position(|body| body.key == key);
    let first = model.bodies.iter().position(|it| model.scope.names(it.key));
    let from = from.and_then(place).or(first).unwrap_or(to);
    let (low, high) = (from.min(to), from.max(to));
    Scope::of(model.bodies[low..=high].iter().map(|body| body.key))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_goes_in_both_directions_and_begins_at_the_selected_body() {
        let body = |key| BodyEntry {
            key,
            name: format!("body {key}"),
            particles: 1,
            state: BodyState::Awake,
            hidden: false,
            color: [0; 3],
        };
        let model = PanelModel {
            bodies: (1..=5).map(body).collect(),
            scope: Scope::key(4),
            ..PanelModel::default()
        };
        assert_eq!(range(&model, None, 1), Scope::of([2, 3, 4]));
        assert_eq!(range(&model, Some(1), 2), Scope::of([1, 2, 3]));
        let empty = PanelModel {
            scope: Scope::All,
            ..model
        };
        assert_eq!(range(&empty, Some(99), 2), Scope::key(3));
    }
}
