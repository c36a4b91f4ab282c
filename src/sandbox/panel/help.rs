//! The overlay of keys and gestures, generated from the table in
//! [`keys`](crate::sandbox::input::keys).

use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{self, Align2, Area, Color32, Frame, Grid, Id, Margin, Order, RichText, Stroke, vec2},
};

use crate::sandbox::{
    input::keys::{BINDINGS, GESTURES},
    state::view::ViewSettings,
    ui::theme,
};

/// Draws the overlay while it is open.
pub struct HelpPlugin;

impl Plugin for HelpPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<ViewSettings>()
            .add_systems(EguiPrimaryContextPass, overlay);
    }
}

fn overlay(mut contexts: EguiContexts, mut view: ResMut<ViewSettings>) -> Result {
    if view.help_visible && draw(contexts.ctx_mut()?) {
        view.help_visible = false;
    }
    Ok(())
}

/// Draws the overlay; `true` if a press closed it.
pub fn draw(context: &egui::Context) -> bool {
    let screen = context.content_rect();
    let veil = Area::new(Id::new("help veil"))
        .order(Order::Foreground)
        .fixed_pos(screen.min)
        .constrain(false)
        .show(context, |ui| {
            let response = ui.allocate_response(screen.size(), egui::Sense::click());
            ui.painter()
                .rect_filled(screen, 0.0, Color32::from_black_alpha(120));
            response.clicked()
        });
    let page = Area::new(Id::new("help"))
        .order(Order::Foreground)
        .anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0))
        .show(context, |ui| {
            Frame::window(ui.style())
                .inner_margin(Margin::same(20))
                .show(ui, columns);
        });
    context.move_to_top(page.response.layer_id);
    veil.inner
}

fn columns(ui: &mut egui::Ui) {
    ui.heading(RichText::new("Keyboard").color(theme::of(ui).strong));
    ui.add_space(8.0);
    let half = BINDINGS.len().div_ceil(2);
    ui.horizontal_top(|ui| {
        for (index, bindings) in BINDINGS.chunks(half).enumerate() {
            let rows = bindings.iter().map(|binding| (binding.cap, binding.text));
            table(ui, ("keys", index), rows);
            ui.add_space(20.0);
        }
    });
    ui.add_space(12.0);
    ui.heading(RichText::new("Mouse").color(theme::of(ui).strong));
    ui.add_space(8.0);
    ui.horizontal_top(|ui| {
        for (index, gestures) in GESTURES.chunks(GESTURES.len().div_ceil(2)).enumerate() {
            table(ui, ("gestures", index), gestures.iter().copied());
            ui.add_space(20.0);
        }
    });
}

fn table<'a>(ui: &mut egui::Ui, id: (&str, usize), rows: impl Iterator<Item = (&'a str, &'a str)>) {
    Grid::new(id)
        .num_columns(2)
        .spacing(vec2(12.0, 5.0))
        .min_col_width(48.0)
        .show(ui, |ui| {
            for (cap, text) in rows {
                key_cap(ui, cap);
                ui.label(text);
                ui.end_row();
            }
        });
}

fn key_cap(ui: &mut egui::Ui, cap: &str) {
    Frame::new()
        .fill(theme::of(ui).raised)
        .stroke(Stroke::new(1.0, theme::of(ui).tick))
        .corner_radius(4.0)
        .inner_margin(Margin::symmetric(7, 1))
        .show(ui, |ui| {
            ui.label(RichText::new(cap).small().color(theme::of(ui).strong));
        });
}
