//! The card over the scene, drawn from plain data.

use super::AblationCommand;
use crate::{
    ablation::{
        Ablation, Advice, Variant,
        report::{length, others, per_cent, sentences},
    },
    sandbox::{
        state::{request::Request, selection::Scope},
        ui::{WidgetRects, area, format, theme},
    },
};
use bevy_egui::egui::{
    Align, Align2, Area, Button, Color32, Context, Frame, Grid, Id, Label, Layout, Margin, Order,
    ProgressBar, Rect, RichText, ScrollArea, Sense, Stroke, Ui, vec2,
};

/// Width of the card [logical px].
const WIDTH: f32 = 470.0;
/// Width of the bar of a saving [logical px].
const BAR: f32 = 56.0;

/// Content of the card.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Card {
    /// The last measurement.
    pub measured: Option<Ablation>,
    /// Completed fraction, 0 to 1, while a measurement runs.
    pub progress: Option<f32>,
    /// Reason why nothing could be measured.
    pub failure: Option<String>,
}

/// Result of drawing the card.
#[derive(Debug, Default)]
pub struct Answer {
    /// Commands, in order.
    pub commands: Vec<AblationCommand>,
    /// Requests, in order.
    pub requests: Vec<Request>,
    /// Widget rectangles.
    pub places: WidgetRects,
}

/// Draws the card in the lower left corner of the area that the panel leaves free.
pub fn show(context: &Context, card: &Card, free: Rect) -> Answer {
    let screen = context.content_rect();
    let width = WIDTH.min(free.width() - 20.0);
    let mut answer = Answer::default();
    let area = Area::new(Id::new("cost of effects"))
        .order(Order::Middle)
        .anchor(Align2::LEFT_BOTTOM, area::lower_left(context, free))
        .constrain(false)
        .show(context, |ui| {
            Frame::new()
                .fill(theme::of(ui).ground)
                .stroke(Stroke::new(1.0, theme::of(ui).line))
                .corner_radius(8.0)
                .inner_margin(Margin::symmetric(12, 10))
                .show(ui, |ui| {
                    ui.set_width(width - 26.0);
                    head(ui, card, &mut answer);
                    // An area that is anchored at the bottom offers no height of its own.
                    ScrollArea::vertical()
                        .min_scrolled_height(free.height() * 0.6)
                        .max_height(free.height() * 0.6)
                        .show(ui, |ui| contents(ui, card, &mut answer));
                });
        });
    answer.places.note("ablation", &area.response, screen);
    answer
}

fn head(ui: &mut Ui, card: &Card, answer: &mut Answer) {
    ui.horizontal(|ui| {
        ui.label(RichText::new("Cost and benefit of effects").color(theme::of(ui).strong));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let close = ui.add(Button::new("×").frame(false));
            answer.places.note("ablation.close", &close, ui.clip_rect());
            if close.on_hover_text("Close").clicked() {
                answer.commands.push(AblationCommand::Toggle);
            }
            let (text, command) = match card.progress {
                Some(_) => ("Stop", AblationCommand::Stop),
                None => ("Measure", AblationCommand::Measure),
            };
            let button = ui.button(text).on_hover_text(
                "Run copies of the current state for a second, with and without each effect, in the \
                 background",
            );
            answer
                .places
                .note("ablation.measure", &button, ui.clip_rect());
            if button.clicked() {
                answer.commands.push(command);
            }
            if let Some(fraction) = card.progress {
                ui.add(
                    ProgressBar::new(fraction)
                        .desired_height(6.0)
                        .fill(theme::of(ui).accent),
                );
            }
        });
    });
}

fn contents(ui: &mut Ui, card: &Card, answer: &mut Answer) {
    if let Some(reason) = &card.failure {
        sentence(ui, reason, theme::of(ui).alarm);
    }
    match &card.measured {
        Some(ablation) => result(ui, ablation, answer),
        None if card.progress.is_some() => {
            sentence(
                ui,
                "Running copies of the scene without each effect…",
                theme::of(ui).weak,
            );
        }
        None => sentence(ui, "Not measured yet.", theme::of(ui).weak),
    }
}

fn result(ui: &mut Ui, ablation: &Ablation, answer: &mut Answer) {
    let text = format!(
        "{} s from here, on one thread: {} ms per tick",
        format(ablation.seconds, 2),
        format(ablation.cost.ms, 3)
    );
    sentence(ui, &text, theme::of(ui).weak);
    Grid::new("effects")
        .num_columns(4)
        .spacing([10.0, 3.0])
        .show(ui, |ui| {
            for (name, help) in [
                ("without", "The effect that is removed from all bodies"),
                (
                    "saves",
                    "Fraction of the time per tick that is saved (fastest of 3 runs). Within noise: \
                     less than the difference of the two fastest runs.",
                ),
                (
                    "effect on result (RMS)",
                    "RMS distance of the particles after a second from where they are with the \
                     effect",
                ),
                ("", ""),
            ] {
                ui.label(RichText::new(name).small().color(theme::of(ui).weak))
                    .on_hover_text(help);
            }
            ui.end_row();
            for variant in &ablation.without {
                row(ui, ablation, variant, answer);
            }
            if let Some(finer) = &ablation.finer {
                ui.label(RichText::new("Solver error (for scale)").color(theme::of(ui).weak))
                    .on_hover_text("Distance to a run with twice the substeps");
                ui.label("");
                distance(ui, ablation, finer, theme::of(ui).weak);
                ui.end_row();
            }
        });
    ui.add_space(4.0);
    for text in sentences(ablation) {
        sentence(ui, &text, theme::of(ui).text);
    }
}

fn row(ui: &mut Ui, ablation: &Ablation, variant: &Variant, answer: &mut Answer) {
    let advice = ablation.advice(variant);
    ui.label(variant.title);
    let (saved, noise) = ablation.saved(variant);
    ui.horizontal(|ui| {
        let (rect, _) = ui.allocate_exact_size(vec2(BAR, 8.0), Sense::hover());
        let filled = vec2(BAR * (saved.clamp(0.0, 1.0) as f32), 8.0);
        let painter = ui.painter();
        painter.rect_filled(rect, 2.0, theme::of(ui).sunken);
        let bar = Rect::from_min_size(rect.min, filled);
        painter.rect_filled(bar, 2.0, theme::of(ui).accent);
        let text = if saved.abs() <= noise {
            "within noise".to_owned()
        } else {
            format!("{:.0} ± {:.0} %", saved * 100.0, noise * 100.0)
        };
        ui.label(RichText::new(text).small());
    });
    let color = match advice {
        Advice::Keep => theme::of(ui).text,
        Advice::Remove | Advice::Negligible => theme::of(ui).changed,
    };
    distance(ui, ablation, variant, color);
    let name = format!("ablation.remove.{}", variant.name);
    let button = ui.small_button("Remove").on_hover_text(format!(
        "Remove {} from all bodies. Its switch in the panel brings it back",
        variant.title
    ));
    answer.places.note(&name, &button, ui.clip_rect());
    if button.clicked() {
        answer.requests.extend([
            Request::Show(Scope::All),
            Request::Effect {
                effect: variant.name,
                on: false,
            },
        ]);
        answer.commands.push(AblationCommand::Measure);
    }
    ui.end_row();
}

fn distance(ui: &mut Ui, ablation: &Ablation, variant: &Variant, color: Color32) {
    let text = match variant.distance {
        Some(it) if it.unmatched > 0 => others(it.unmatched),
        Some(it) => format!("{} ({})", length(it.rms), per_cent(it.rms / ablation.size)),
        None => "diverges".to_owned(),
    };
    let label = ui.label(RichText::new(text).small().color(color));
    if let Some(it) = variant.distance {
        let of_others = match it.unmatched {
            0 => String::new(),
            _ => "Bodies and grains that only one of the two has. Of the others: ".to_owned(),
        };
        label.on_hover_text(format!(
            "{of_others}Maximum {} ({} of the largest body)",
            length(it.max),
            per_cent(it.max / ablation.size)
        ));
    }
}

fn sentence(ui: &mut Ui, text: &str, color: Color32) {
    ui.add(Label::new(RichText::new(text).small().color(color)).wrap());
}
