//! The section of the bodies: the selection, and operations on it.

mod edit;
mod materials;
mod selection;

use crate::sandbox::{
    state::request::{Distortion, Request},
    ui::{number, theme},
};
use bevy_egui::egui::{Label, RichText, Ui};

use super::{
    Panel,
    model::{BodyEntry, BodyState, PanelModel},
    section::{self, RowButton, section},
};

/// Words by which the search of the panel finds the section.
pub const WORDS: &str = "squash scramble invert material preset stress tests pin unpin duplicate hide \
                         show rename name color copy paste parameters add";

/// Draws the section.
pub fn show(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    section(ui, panel, "Bodies", |ui, panel| {
        selection::show(ui, panel, model);
        state(ui, panel, model);
        buttons(ui, panel, model);
    });
}

/// A line about the selected bodies: size and state.
fn state(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    let in_scope = model
        .bodies
        .iter()
        .filter(|body| model.scope.contains_key(body.key));
    let (mut selected, mut particles, mut asleep, mut hidden, mut inverted) = (0, 0, 0, 0, 0);
    let mut stuck = Vec::new();
    for body in in_scope {
        selected += 1;
        particles += body.particles;
        inverted += body.inverted;
        hidden += usize::from(body.hidden);
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
    match asleep {
        0 => {}
        _ if model.scope.single().is_some() => text.push_str(" · asleep"),
        n if n == selected => text.push_str(" · all asleep"),
        n => text.push_str(&format!(" · {n} asleep")),
    }
    match hidden {
        0 => {}
        _ if model.scope.single().is_some() => text.push_str(" · hidden, still simulated"),
        n => text.push_str(&format!(" · {n} hidden, still simulated")),
    }
    section::note(ui, &text);
    if inverted > 0 {
        let text = match inverted {
            1 => "1 inverted element".to_owned(),
            _ => format!("{} inverted elements", number::count(inverted)),
        };
        let text = RichText::new(text).small().color(theme::of(ui).alarm);
        let line = ui.add(Label::new(text).wrap());
        panel.note("inverted", &line, ui);
        line.on_hover_text(
            "Tetrahedra that are turned inside out or flat, drawn in magenta. “Reset shape” returns \
             the selection to its rest shape.",
        );
    }
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
    materials::show(ui, panel, model);
    let gallery = RowButton::new(
        "gallery",
        "Stress tests",
        "Cases that are difficult for solvers, on this body or on test bodies, with pass limits (C)",
    );
    let reset = button(
        "reset_shape",
        "Reset shape",
        "Return the selection to its rest shape, at its present place and mean orientation; pinned \
         points stay",
    );
    match section::button_row(ui, panel, &[gallery, reset]) {
        Some(0) => panel.ask(Request::Gallery),
        Some(_) => panel.ask(Request::Distort(Distortion::RestShape)),
        None => {}
    }
    let help = match &model.grabbed {
        Some(grab) => format!(
            "Pin or unpin the point of {} that was grabbed last, with all vertices within the grab \
             radius. P does so at the pointer.",
            grab.body
        ),
        None => {
            "Grab a body first, then pin the grabbed point. P pins the point under the pointer."
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
    match section::button_row(ui, panel, &pins) {
        Some(2) => panel.ask(Request::UnpinAll),
        Some(index) => panel.ask(Request::Pin(index == 0)),
        None => {}
    }
}
