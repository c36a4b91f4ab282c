//! The section of the bodies: the selection, and operations on it.

use crate::sandbox::state::{
    request::{Distortion, Request},
    selection::Scope,
};
use bevy_egui::egui::{ComboBox, Label, RichText, Ui};

use super::{
    Panel,
    model::{BodyEntry, BodyState, PanelModel},
    section::{self, RowButton, section},
    spawn,
};
use crate::{
    sandbox::ui::{number, theme},
    scene::Material,
};

/// Draws the section.
pub fn show(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    section(ui, panel, "Bodies", |ui, panel| {
        scope(ui, panel, model);
        state(ui, panel, model);
        buttons(ui, panel, model);
    });
}

fn scope(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    let all = format!("All bodies ({})", model.bodies.len());
    let shown = match model.scope {
        Scope::All => all.clone(),
        Scope::Body(key) => name(model, key).to_owned(),
    };
    ui.horizontal(|ui| {
        let add_width = 64.0;
        let width = ui.available_width() - add_width - theme::GAP;
        let combo = ComboBox::from_id_salt("scope")
            .selected_text(RichText::new(shown).color(theme::of(ui).strong))
            .width(width)
            .truncate()
            .show_ui(ui, |ui| {
                ui.set_min_width(200.0);
                let line = ui.selectable_label(model.scope == Scope::All, all.as_str());
                panel.note("scope.all", &line, ui);
                if line.clicked() {
                    panel.ask(Request::Show(Scope::All));
                    ui.close();
                }
                for body in &model.bodies {
                    let scope = Scope::Body(body.key);
                    let line = ui.selectable_label(model.scope == scope, body.name.as_str());
                    panel.note(format!("scope.{}", body.name), &line, ui);
                    if line.clicked() {
                        panel.ask(Request::Show(scope));
                        ui.close();
                    }
                }
            });
        panel.note("scope", &combo.response, ui);
        combo.response.on_hover_text(
            "Selection: whose parameters are shown and changed. Grabbing a body selects it.",
        );
        spawn::show(ui, panel, model, add_width);
    });
}

/// A line about the selected bodies: size and state.
fn state(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    let in_scope = model
        .bodies
        .iter()
        .filter(|body| model.scope == Scope::All || model.scope == Scope::Body(body.key));
    let (mut particles, mut asleep) = (0, 0);
    let mut stuck = Vec::new();
    for body in in_scope {
        particles += body.particles;
        match &body.state {
            BodyState::Awake => {}
            BodyState::Asleep => asleep += 1,
            BodyState::Quarantined(reason) => stuck.push((body, reason.as_str())),
        }
    }
    let mut text = match particles {
        1 => "1 particle".to_owned(),
        _ => format!("{} particles", number::count(particles)),
    };
    match (asleep, model.scope) {
        (0, _) => {}
        (_, Scope::Body(_)) => text.push_str(" · asleep"),
        (n, Scope::All) if n == model.bodies.len() => text.push_str(" · all asleep"),
        (n, Scope::All) => text.push_str(&format!(" · {n} asleep")),
    }
    section::note(ui, &text);
    quarantined(ui, panel, &stuck);
}

/// Maximum number of diverged bodies that are named; for more, only their number is shown.
const MAX_NAMED: usize = 2;

fn quarantined(ui: &mut Ui, panel: &mut Panel, stuck: &[(&BodyEntry, &str)]) {
    let alarm = |ui: &mut Ui, text: String| {
        ui.add(Label::new(RichText::new(text).small().color(theme::of(ui).alarm)).wrap());
    };
    for (body, reason) in stuck.iter().take(MAX_NAMED) {
        alarm(
            ui,
            format!("{} diverged and is paused: {reason}", body.name),
        );
    }
    if stuck.len() > MAX_NAMED {
        alarm(ui, format!("and {} more", stuck.len() - MAX_NAMED));
    }
    if stuck.is_empty() {
        return;
    }
    let help = "Resume from the last finite state, the start of the tick in which the body diverged, at zero velocity";
    let button = RowButton::new("thaw", "Restore last finite state", help);
    if section::button_row(ui, panel, &[button]).is_some() {
        for (body, _) in stuck {
            panel.ask(Request::Restore(body.key));
        }
    }
}

fn buttons(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    let any = !model.bodies.is_empty();
    let button = |name, text, help| RowButton {
        enabled: any,
        ..RowButton::new(name, text, help)
    };
    let distortions = [
        button("squash", "Squash", "Compress to a tenth of the height"),
        button(
            "shuffle",
            "Scramble",
            "Move every particle to a random position in the body's bounding box",
        ),
        button(
            "mirror",
            "Invert",
            "Swap left and right, which inverts every element",
        ),
    ];
    let distortion = match section::button_row(ui, panel, &distortions) {
        Some(0) => Some(Distortion::Squash),
        Some(1) => Some(Distortion::Shuffle),
        Some(2) => Some(Distortion::Mirror),
        _ => None,
    };
    if let Some(distortion) = distortion {
        panel.ask(Request::Distort(distortion));
    }
    materials(ui, panel, model);
    let gallery = RowButton::new(
        "gallery",
        "Stress tests",
        "Known hard cases for solvers, on this body or on test bodies, with pass limits (C)",
    );
    if section::button_row(ui, panel, &[gallery]).is_some() {
        panel.ask(Request::Gallery);
    }
    let help = match &model.grabbed {
        Some(grab) => format!(
            "The point of {} that was grabbed last, with all vertices within the grab radius. The key \
             P does so at the pointer",
            grab.body
        ),
        None => {
            "Grab a body first, then pin the grabbed point. The key P pins the point under the \
                 pointer"
                .to_owned()
        }
    };
    let pinned = model.grabbed.as_ref().map(|grab| grab.pinned);
    let pins = [
        RowButton {
            enabled: pinned == Some(false),
            ..RowButton::new("pin", "Pin", &help)
        },
        RowButton {
            enabled: pinned == Some(true),
            ..RowButton::new("unpin", "Unpin", &help)
        },
        RowButton {
            enabled: model.is_pinned,
            ..RowButton::new(
                "unpin_all",
                "Unpin all",
                "Release every pin of the selection (U)",
            )
        },
    ];
    super::hands::grab(ui, panel, model);
    match section::button_row(ui, panel, &pins) {
        Some(2) => panel.ask(Request::UnpinAll),
        Some(index) => panel.ask(Request::Pin(index == 0)),
        None => {}
    }
}

/// The material of the selection as a drop-down.
fn materials(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    if model.materials.is_empty() {
        return;
    }
    ui.horizontal(|ui| {
        ui.label("Material");
        let current = model.material.map_or("custom", |it| it.title.as_str());
        let menu = ComboBox::from_id_salt("material")
            .selected_text(current)
            .width(ui.available_width())
            .truncate()
            .show_ui(ui, |ui| {
                for material in &model.materials {
                    let is_current = model.material == Some(*material);
                    let line = ui.selectable_label(is_current, &material.title);
                    let line = line.on_hover_ui(|ui| {
                        ui.set_max_width(320.0);
                        ui.label(figures(material));
                        ui.add(Label::new(RichText::new(&material.source).small().weak()).wrap());
                    });
                    panel.note(format!("material.{}", material.name), &line, ui);
                    if line.clicked() {
                        panel.ask(Request::Material(&material.name));
                    }
                }
            });
        panel.note("material", &menu.response, ui);
        menu.response.on_hover_text(
            "Assign the density and stiffness of a real material to the selection. The result does \
             not depend on the mesh.",
        );
    });
}

/// The parameters of a material with their units.
fn figures(material: &Material) -> String {
    let mut text = format!(
        "E {} Pa, ν {}, {} kg/m³",
        number::format(material.youngs_modulus.into(), 3),
        number::format(material.poisson_ratio.into(), 3),
        number::format(material.density.into(), 3),
    );
    if let Some(sheet) = material.sheet {
        text.push_str(&format!(
            ", {} mm thick, bending stiffness {} N·m",
            number::format(1e3 * f64::from(sheet.thickness), 3),
            number::format(sheet.bending_stiffness.into(), 3),
        ));
    }
    text
}

fn name(model: &PanelModel, key: u64) -> &str {
    let body = model.bodies.iter().find(|body| body.key == key);
    body.map_or("(removed)", |body| body.name.as_str())
}
