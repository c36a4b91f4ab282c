//! The search of the panel: only the effects, parameters and settings that match are drawn.

use bevy_egui::egui::{Button, Key, Label, RichText, TextEdit, Ui};

use super::{
    Panel, bodies, effects, energy, hands, model::PanelModel, query::Query, section, settings,
    world,
};
use crate::sandbox::{state::request::Request, ui::theme};

/// Draws the search field while it is open.
pub fn field(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    if !model.search.open {
        return;
    }
    let mut text = model.search.text.clone();
    ui.horizontal(|ui| {
        let clear = theme::ROW + 6.0;
        let width = ui.available_width() - clear - theme::GAP;
        let field = TextEdit::singleline(&mut text)
            .hint_text("Search parameters (/)")
            .desired_width(width - 8.0);
        let field = ui.add(field);
        panel.note("search", &field, ui);
        if model.search.focus {
            field.request_focus();
        }
        if field.changed() {
            panel.ask(Request::Search(text.clone()));
        }
        let left = field.lost_focus();
        let escaped = left && ui.input(|input| input.key_pressed(Key::Escape));
        field.on_hover_text("Effects, parameters and settings by name, title or description");
        let button = Button::new("×").min_size([clear, theme::ROW].into());
        let button = ui.add(button).on_hover_text("End the search (Esc)");
        panel.note("search.clear", &button, ui);
        if button.clicked() || escaped || (left && text.is_empty()) {
            panel.ask(Request::CloseSearch);
        }
    });
}

/// Draws what matches.
pub fn results(ui: &mut Ui, panel: &mut Panel, model: &PanelModel, query: &Query) {
    let found = [
        world::found(ui, panel, model, query),
        found_bodies(ui, panel, model, query),
        effects::found(ui, panel, model, query),
        found_grab(ui, panel, model, query),
        found_energy(ui, panel, model, query),
        settings::found(ui, panel, model, query),
    ];
    if found.contains(&true) {
        return;
    }
    ui.add_space(12.0);
    let text = format!("Nothing matches “{}”.", model.search.text.trim());
    ui.add(Label::new(RichText::new(text).color(theme::of(ui).strong)).wrap());
    section::note(
        ui,
        "The search compares names, titles and descriptions of effects, parameters and settings.",
    );
}

fn found_bodies(ui: &mut Ui, panel: &mut Panel, model: &PanelModel, query: &Query) -> bool {
    let found = query.matches(&["Bodies selection", bodies::WORDS]);
    if found {
        bodies::show(ui, panel, model);
    }
    found
}

fn found_grab(ui: &mut Ui, panel: &mut Panel, model: &PanelModel, query: &Query) -> bool {
    let found = query.matches(&["Grab radius stiffness brush patch drag mouse pointer"]);
    if found {
        section::heading(ui, "Grab");
        hands::grab(ui, panel, model);
    }
    found
}

fn found_energy(ui: &mut Ui, panel: &mut Panel, model: &PanelModel, query: &Query) -> bool {
    let found = query.matches(&["Energy ledger kinetic potential elastic"]);
    if found {
        energy::show(ui, panel, model);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_word_must_match_and_no_word_is_no_search() {
        assert_eq!(Query::new("  "), None);
        let query = Query::new("Damp stretch").expect("two words");
        assert!(query.matches(&["Stretch", "Damping time constant"]));
        assert!(!query.matches(&["Stretch", "Compliance"]));
    }
}
