//! The badges of what is being written: recorded time, and a button to end it.

use crate::sandbox::{
    app::film::FilmStatus,
    state::{
        keep::{KeepRequest, RecordingStatus},
        request::{Request, Requested},
        view::ViewSettings,
    },
    ui::{area, theme},
};
use bevy::prelude::*;
use bevy_egui::{
    EguiContexts,
    egui::{
        self, Align2, Area, Frame, Id, Label, Margin, Order, Rect, RichText, Sense, Stroke, vec2,
    },
};

pub(super) fn show(
    mut contexts: EguiContexts,
    view: Res<ViewSettings>,
    recording: Res<RecordingStatus>,
    film: Res<FilmStatus>,
    mut requests: MessageWriter<Requested>,
) -> Result {
    let mut badges = Vec::new();
    if let Some(file) = &recording.file {
        let help = format!("Recording to {}. Click or press F9 to end.", file.display());
        let text = format!("REC {:.1} s", recording.seconds);
        badges.push((text, help, Request::Keep(KeepRequest::Record)));
    }
    if let Some((text, help)) = film.words() {
        badges.push((text, help, Request::Film));
    }
    if badges.is_empty() {
        return Ok(());
    }
    let context = contexts.ctx_mut()?;
    let free = area::free(context, &view);
    for request in draw(context, &badges, free) {
        requests.write(Requested(request));
    }
    Ok(())
}

/// Draws badges of text, tooltip and request; returns the requests of the pressed ones.
fn draw(context: &egui::Context, badges: &[(String, String, Request)], free: Rect) -> Vec<Request> {
    let mut pressed = Vec::new();
    Area::new(Id::new("keep badges"))
        .order(Order::Middle)
        .anchor(
            Align2::CENTER_TOP,
            area::off_center(context, free) + vec2(0.0, 56.0),
        )
        .fade_in(false)
        .show(context, |ui| {
            ui.horizontal(|ui| {
                for (text, help, request) in badges {
                    let frame = Frame::new()
                        .fill(theme::of(ui).veil)
                        .stroke(Stroke::new(1.0, theme::of(ui).alarm))
                        .corner_radius(10.0)
                        .inner_margin(Margin::symmetric(10, 4))
                        .show(ui, |ui| {
                            ui.horizontal(|ui| {
                                let dot = RichText::new("⏺").color(theme::of(ui).alarm);
                                ui.add(Label::new(dot).selectable(false));
                                let text = RichText::new(text).color(theme::of(ui).strong);
                                ui.add(Label::new(text).selectable(false));
                            });
                        });
                    let response = frame.response.interact(Sense::click());
                    if response.on_hover_text(help).clicked() {
                        pressed.push(request.clone());
                    }
                }
            });
        });
    pressed
}
