//! The section of the effects: active effects, each with its fraction of the tick's time and its
//! parameters on the selected bodies, and inactive effects.
//!
//! A switch adds an effect to the selected bodies or removes it.

use crate::sandbox::state::{request::Request, selection::Scope};
use bevy_egui::egui::{
    Align, Align2, Color32, ComboBox, Id, Label, Layout, Rect, RichText, Sense, Ui,
    collapsing_header::CollapsingState, vec2,
};

use super::{
    Panel, effective, essentials, hands, history,
    model::{ContactModel, Done, EffectModel, GroupModel, PanelModel, Parameter},
    parameter::{self, Edit},
    query::Query,
    section::{self, RowButton, section},
};
use crate::{
    effect::{Effect, Grab, Stitches},
    sandbox::ui::{number, theme},
    solver::GroupName,
};
use std::ptr;

/// Width of the bar of a time fraction [logical px].
const BAR: f32 = 60.0;
/// Width of the number of a time fraction [logical px].
const FIGURE: f32 = 34.0;

/// Draws the section.
pub fn show(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    section(ui, panel, "Effects", |ui, panel| {
        let (own, others): (Vec<_>, Vec<_>) =
            model.effects.iter().partition(|effect| effect.switchable);
        let (running, absent): (Vec<_>, Vec<_>) =
            own.into_iter().partition(|effect| effect.carriers > 0);
        for effect in &running {
            running_effect(ui, panel, model, effect);
        }
        // Effects that are active only while dragging keep their row, so that nothing moves when a
        // body is grabbed.
        let keeps_row = |name| [Stitches::NAME, Grab::NAME].contains(&name);
        for effect in others {
            if effect.carriers > 0 || keeps_row(effect.name) {
                heading(ui, panel, model, effect);
            }
        }
        hands::grab(ui, panel, model);
        for stage in &model.stages {
            ui.horizontal(|ui| {
                ui.add_space(26.0 + theme::GAP);
                ui.label(RichText::new(&stage.title).color(theme::of(ui).weak));
                fraction_bar(ui, stage.fraction, history::color(stage.name));
            });
        }
        history::show(ui, panel, &model.history);
        steps(ui, panel, model);
        cost_and_benefit(ui, panel);
        if !absent.is_empty() {
            ui.add_space(4.0);
            section::note(ui, "Available effects (zero cost until switched on)");
        }
        for effect in &absent {
            heading(ui, panel, model, effect);
        }
    });
}

/// The button that opens the card.
fn cost_and_benefit(ui: &mut Ui, panel: &mut Panel) {
    let button = RowButton::new(
        "effects.ablation",
        "Cost and benefit of effects",
        "Time each effect, and how much the result changes without it (in the background)",
    );
    if section::button_row(ui, panel, &[button]).is_some() {
        panel.ask(Request::Ablation);
    }
}

/// The steps of a substep, in order.
fn steps(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    let text = format!("Substep: {}", model.steps.join(" · "));
    let row = ui.add(Label::new(RichText::new(text).small().color(theme::of(ui).weak)).wrap());
    panel.note("effects.steps", &row, ui);
    section::hint(ui, &row, |ui| {
        ui.set_max_width(280.0);
        ui.label(RichText::new("Steps of a substep").strong());
        ui.label(
            "Compiled steps in execution order: the effects that some body carries, between the \
             prediction of positions and the update of velocities. Elastic constraints repeat in \
             every iteration, followed by contacts.",
        );
    });
}

/// Draws the effects and parameters that match a search, and returns whether there are any. An
/// effect that matches has all of its parameters.
pub fn found(ui: &mut Ui, panel: &mut Panel, model: &PanelModel, query: &Query) -> bool {
    let mut any = false;
    for effect in &model.effects {
        let whole = query.matches(&[effect.name, effect.title, effect.summary]);
        let parameters = effect.parameters.iter();
        let parameters: Vec<_> = parameters
            .filter(|parameter| {
                let texts = [effect.name, effect.title, parameter.name];
                let more = [parameter.title, parameter.help];
                whole || query.matches(&[&texts[..], &more[..]].concat())
            })
            .collect();
        let in_words = query.matches(&[effect.name, effect.title, &effect.words]);
        if !whole && parameters.is_empty() && !in_words {
            continue;
        }
        if !any {
            section::heading(ui, "Effects");
            any = true;
        }
        heading(ui, panel, model, effect);
        for parameter in parameters {
            parameter_row(ui, panel, effect, parameter);
        }
        if let Some(group) = effect.group.as_ref().filter(|_| whole) {
            group_row(ui, panel, group);
        }
        ui.add_space(3.0);
    }
    any
}

/// Draws the row of a parameter.
pub(super) fn parameter_row(
    ui: &mut Ui,
    panel: &mut Panel,
    effect: &EffectModel,
    parameter: &Parameter,
) {
    let name = format!("{}.{}", effect.name, parameter.name);
    if let Some(edit) = parameter::row(ui, panel, (&name, Some(&name)), parameter) {
        panel.ask(Request::Parameter {
            effect: effect.name,
            parameter: parameter.name,
            value: match edit {
                Edit::Set(value) => Some(value),
                Edit::Reset => None,
            },
        });
    }
}

/// Whether the user has changed a parameter of the effect, or a setting.
pub(super) fn changed(effect: &EffectModel, model: &PanelModel) -> bool {
    let mut all = effect.parameters.iter().chain(&model.settings);
    all.any(|parameter| parameter.changed)
}

/// The choice of the group of vertices on which forces act.
fn group_row(ui: &mut Ui, panel: &mut Panel, group: &GroupModel) {
    let title = |name: GroupName| match name.is_empty() {
        true => "Whole body".to_owned(),
        false => name.to_string(),
    };
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = theme::GAP;
        let size = vec2(parameter::title_width(ui), theme::ROW);
        ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
            ui.set_min_width(size.x);
            ui.label("Group");
        });
        let width = ui.available_width() - parameter::RESET - theme::GAP;
        let combo = ComboBox::from_id_salt("force_mask.group")
            .selected_text(group.chosen.map_or("(several)".to_owned(), title))
            .width(width)
            .truncate()
            .show_ui(ui, |ui| {
                let whole = [GroupName::default()];
                for &name in whole.iter().chain(&group.names) {
                    let line = ui.selectable_label(group.chosen == Some(name), title(name));
                    panel.note(format!("force_mask.group.{name}"), &line, ui);
                    if line.clicked() {
                        panel.ask(Request::ForceGroup(name));
                    }
                }
            });
        panel.note("force_mask.group", &combo.response, ui);
        combo
            .response
            .on_hover_text("Named group of vertices on which the forces act, from the scene file");
    });
}

fn running_effect(ui: &mut Ui, panel: &mut Panel, model: &PanelModel, effect: &EffectModel) {
    let id = Id::new(("effect", effect.name));
    let mut state = CollapsingState::load_with_default_open(ui.ctx(), id, true);
    if heading(ui, panel, model, effect) {
        state.toggle(ui);
    }
    state.show_body_unindented(ui, |ui| {
        // What is always in sight is not shown twice.
        let above = essentials::stiffness(model);
        let is_above = |it: &Parameter| above.is_some_and(|(_, other)| ptr::eq(it, other));
        let rest = effect.parameters.iter().filter(|it| !is_above(it));
        for parameter in rest {
            parameter_row(ui, panel, effect, parameter);
        }
        if let Some(group) = &effect.group {
            group_row(ui, panel, group);
        }
        if let Some(note) = &effect.note {
            section::note(ui, note);
        }
        if let Some(effective) = &effect.effective
            && above.is_none_or(|(other, _)| !ptr::eq(effect, other))
        {
            effective::show(ui, panel, effect.name, effective, changed(effect, model));
        }
        if let Some(range) = effect.overpressure {
            let text = RichText::new(overpressure(range))
                .small()
                .color(theme::of(ui).weak);
            let response = ui.add(Label::new(text).wrap()).on_hover_text(
                "Pressure of the filling above ambient pressure, after the last substep",
            );
            panel.note(format!("{}.overpressure", effect.name), &response, ui);
        }
        if let Some(done) = effect.done {
            let text = RichText::new(done_so_far(done))
                .small()
                .color(theme::of(ui).weak);
            let response = ui.add(Label::new(text).wrap()).on_hover_text(match done {
                Done::Emitted { .. } => {
                    "Grains or copies emitted so far. Waiting: due, but blocked by something in their \
                     place, or grains by the capacity."
                }
                Done::Split(_) => "Particles that were split by tearing or cutting",
            });
            panel.note(format!("{}.done", effect.name), &response, ui);
        }
        if let Some(contacts) = effect.contacts.filter(|_| effect.carriers > 0) {
            let gap = contacts.smallest_gap.map_or(String::new(), |gap| {
                format!(" Smallest gap: {} m.", number::format(gap, 2))
            });
            let ContactModel {
                acting, crossings, ..
            } = contacts;
            let text = RichText::new(format!(
                "Active contacts: {acting}.{gap} Crossings: {crossings}. (All bodies)"
            ))
            .small()
            .color(if crossings > 0 {
                theme::of(ui).alarm
            } else {
                theme::of(ui).weak
            });
            let response = ui.add(Label::new(text).wrap()).on_hover_text(
                "Contacts with a force in the last substep, the smallest distance of two surfaces at \
                 its start, and edges that cross a triangle",
            );
            panel.note(format!("{}.contacts", effect.name), &response, ui);
        }
        ui.add_space(3.0);
    });
}

/// The overpressure of one body, or the minimum and maximum of several [Pa].
fn overpressure((low, high): (f64, f64)) -> String {
    let [low, high] = [low, high].map(|pressure| number::format(pressure, 3));
    if low == high {
        format!("Overpressure {low} Pa.")
    } else {
        format!("Overpressure {low} to {high} Pa.")
    }
}

fn done_so_far(done: Done) -> String {
    match done {
        Done::Emitted { emitted, waiting } => format!("Emitted: {emitted}. Waiting: {waiting}."),
        Done::Split(particles) => format!("Split particles: {particles}."),
    }
}

/// The row of an effect: switch, title, number of constraints, fraction of the time. `true` if its
/// title was pressed.
fn heading(ui: &mut Ui, panel: &mut Panel, model: &PanelModel, effect: &EffectModel) -> bool {
    ui.horizontal(|ui| {
        let on = effect.carriers_shown > 0;
        let runs = effect.carriers > 0;
        let enabled = effect.switchable && !model.bodies.is_empty();
        let (response, pressed) = section::switch(ui, on, enabled, effect.title);
        panel.note(format!("effect.{}", effect.name), &response, ui);
        response.on_hover_text(match (effect.switchable, on) {
            (true, true) => "Remove from selection",
            (true, false) => "Add to selection",
            (false, _) if effect.name == Stitches::NAME => "Placed by the scene",
            (false, _) if effect.name == Grab::NAME => "Active while dragging",
            (false, _) => "Set by the app",
        });
        if pressed {
            panel.ask(Request::Effect {
                effect: effect.name,
                on: !on,
            });
        }
        let color = if runs {
            theme::of(ui).strong
        } else {
            theme::of(ui).weak
        };
        let title = Label::new(RichText::new(effect.title).color(color)).sense(Sense::click());
        let title = ui.add(title).on_hover_text(effect.summary);
        let detail = detail(model, effect);
        if !detail.is_empty() {
            ui.label(RichText::new(detail).small().weak());
        }
        if let Some(value) = effect.fraction.filter(|_| runs) {
            fraction_bar(ui, value, history::color(effect.name));
        }
        title.clicked()
    })
    .inner
}

/// Number of constraints of an effect, and number of bodies that carry it if not all do.
fn detail(model: &PanelModel, effect: &EffectModel) -> String {
    if effect.carriers == 0 {
        let waits = match effect.name {
            _ if effect.switchable => "",
            Stitches::NAME => "placed by the scene",
            Grab::NAME => "while dragging",
            _ => "",
        };
        return waits.to_owned();
    }
    let mut text = String::new();
    if effect.elements > 0 {
        text = number::count(effect.elements);
    }
    let bodies = model.bodies.len();
    if model.scope == Scope::All && effect.carriers < bodies {
        text.push_str(&format!(" on {} of {bodies}", effect.carriers));
    } else if effect.carriers_shown == 0 {
        text.push_str(" on others");
    }
    text.trim_start().to_owned()
}

/// A bar and a number at the right end of a row.
fn fraction_bar(ui: &mut Ui, fraction: f32, color: Color32) {
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        let size = vec2(BAR + FIGURE, theme::ROW);
        let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
        response.on_hover_text(
            "Fraction of the wall-clock time of a tick; all fractions add up to 100 %. With several \
             threads, it is split by the time that each part took on all threads.",
        );
        let fraction = fraction.clamp(0.0, 1.0);
        let bar = Rect::from_min_size(rect.left_center() - vec2(0.0, 2.0), vec2(BAR, 4.0));
        let filled = Rect::from_min_size(bar.min, vec2(BAR * fraction, 4.0));
        let painter = ui.painter();
        painter.rect_filled(bar, 2.0, theme::of(ui).raised);
        painter.rect_filled(filled, 2.0, color.gamma_multiply(0.8));
        let font = theme::figures().resolve(ui.style());
        let place = rect.right_center();
        painter.text(
            place,
            Align2::RIGHT_CENTER,
            percent(fraction),
            font,
            theme::of(ui).text,
        );
    });
}

/// A fraction in per cent, with at most three characters before the sign.
fn percent(fraction: f32) -> String {
    let percent = fraction * 100.0;
    if percent > 0.0 && percent < 1.0 {
        "<1%".to_owned()
    } else {
        format!("{percent:.0}%")
    }
}

#[cfg(test)]
mod tests {
    use super::{overpressure, percent};

    #[test]
    fn an_overpressure_is_one_figure_where_one_is_enough() {
        assert_eq!(overpressure((1234.0, 1234.4)), "Overpressure 1234 Pa.");
        assert_eq!(overpressure((-20.0, 315.0)), "Overpressure -20 to 315 Pa.");
    }

    #[test]
    fn a_small_fraction_is_not_shown_as_zero() {
        assert_eq!(percent(0.0), "0%");
        assert_eq!(percent(0.004), "<1%");
        assert_eq!(percent(0.416), "42%");
        assert_eq!(percent(1.0), "100%");
    }
}
