//! The card over the scene, drawn from plain data.

use super::{
    AccuracyCommand, Goals,
    chart::{self, Dot, Marker},
};
use crate::{
    sandbox::ui::{WidgetRects, area, format, theme},
    study::Goal,
};
use bevy_egui::egui::{
    Align, Area, Button, Context, DragValue, Frame, Id, Label, Layout, Margin, Order, ProgressBar,
    Rect, RichText, Sense, Stroke, Ui, vec2,
};

/// Width of the card [logical px].
const WIDTH: f32 = 400.0;

/// Relative uncertainty of the reference above which the card shows a warning.
const UNSURE: f64 = 0.05;

/// Content of the card.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Card {
    /// The measured settings.
    pub dots: Vec<Dot>,
    /// Current substeps and iterations of the scene.
    pub here: (u32, u32),
    /// Completed fraction, 0 to 1, while a measurement runs.
    pub progress: Option<f32>,
    /// Result of the last search or the last error, and whether it is a failure.
    pub said: Option<(String, bool)>,
    /// Relative uncertainty of the reference.
    pub uncertainty: f64,
    /// Values of the two fields.
    pub goals: Goals,
    /// Times in which numerical damping halves the energy of the stiffest and of the softest mode,
    /// at the current number of substeps [s].
    pub half_lives: Option<(f64, Option<f64>)>,
}

/// Result of drawing the card.
#[derive(Debug, Default)]
pub struct Answer {
    /// Commands, in order.
    pub commands: Vec<AccuracyCommand>,
    /// Substeps and iterations of the clicked dot.
    pub pressed: Option<(u32, u32)>,
    /// Widget rectangles.
    pub places: WidgetRects,
}

/// Draws the card in the lower left corner of the area that the panel leaves free.
pub fn show(context: &Context, card: &Card, free: Rect) -> Answer {
    let screen = context.content_rect();
    let width = WIDTH.min(free.width() - 20.0);
    let mut answer = Answer::default();
    let area = Area::new(Id::new("what accuracy costs"))
        .order(Order::Middle)
        .anchor(
            bevy_egui::egui::Align2::LEFT_BOTTOM,
            area::lower_left(context, free),
        )
        .constrain(false)
        .show(context, |ui| {
            Frame::new()
                .fill(theme::of(ui).ground)
                .stroke(Stroke::new(1.0, theme::of(ui).line))
                .corner_radius(8.0)
                .inner_margin(Margin::symmetric(12, 10))
                .show(ui, |ui| {
                    ui.set_width(width - 26.0);
                    contents(ui, card, &mut answer);
                });
        });
    answer.places.note("accuracy", &area.response, screen);
    answer
}

fn contents(ui: &mut Ui, card: &Card, answer: &mut Answer) {
    head(ui, card, answer);
    let (response, near) = chart::draw(ui, &card.dots, card.here, card.uncertainty);
    answer
        .places
        .note("accuracy.chart", &response, ui.clip_rect());
    let near = near.map(|at| card.dots[at]);
    match near {
        Some(dot) if response.clicked() => answer.pressed = Some(dot.setting),
        _ => {}
    }
    legend(ui);
    if card.uncertainty > UNSURE {
        let text = format!(
            "The reference is only converged to {} % (contacts and buckling are chaotic): ignore \
             differences below that.",
            format(card.uncertainty * 100.0, 2)
        );
        let text = RichText::new(text).small().color(theme::of(ui).alarm);
        ui.add(Label::new(text).wrap());
    }
    ui.add(
        Label::new(
            RichText::new(line(card, near))
                .small()
                .color(theme::of(ui).text),
        )
        .wrap(),
    );
    if let Some(half_lives) = card.half_lives {
        damping(ui, half_lives);
    }
    ui.add_space(4.0);
    goals(ui, card, answer);
    if let Some((text, bad)) = &card.said {
        let color = if *bad {
            theme::of(ui).alarm
        } else {
            theme::of(ui).strong
        };
        ui.add(Label::new(RichText::new(text).small().color(color)).wrap());
    }
}

fn head(ui: &mut Ui, card: &Card, answer: &mut Answer) {
    ui.horizontal(|ui| {
        ui.label(RichText::new("Accuracy vs. cost").color(theme::of(ui).strong));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let close = ui.add(Button::new("×").frame(false));
            answer.places.note("accuracy.close", &close, ui.clip_rect());
            if close.on_hover_text("Close (A)").clicked() {
                answer.commands.push(AccuracyCommand::Toggle);
            }
            let (text, command) = match card.progress {
                Some(_) => ("Stop", AccuracyCommand::Stop),
                None => ("Measure", AccuracyCommand::Measure),
            };
            let button = ui.button(text).on_hover_text(
                "Run a copy of the current scene for half a second at many settings and compare it \
                 with a double-precision reference with small steps, in the background",
            );
            answer
                .places
                .note("accuracy.measure", &button, ui.clip_rect());
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

fn legend(ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        for (marker, text) in Marker::ALL {
            let (rect, _) = ui.allocate_exact_size(vec2(14.0, 14.0), Sense::hover());
            marker.paint(ui.painter(), rect.center());
            ui.label(RichText::new(text).small().color(theme::of(ui).weak));
            ui.add_space(6.0);
        }
        ui.label(RichText::new("○").color(theme::of(ui).strong));
        ui.label(RichText::new("current").small().color(theme::of(ui).weak));
    });
}

/// Description of the dot under the pointer, or else of the current setting.
fn line(card: &Card, near: Option<Dot>) -> String {
    let here = card.dots.iter().find(|dot| dot.setting == card.here);
    match (near, here) {
        (Some(dot), _) => format!("{} Click to use it.", words(&dot)),
        (None, Some(dot)) => words(dot),
        (None, None) if card.dots.is_empty() && card.progress.is_none() => {
            "Not measured yet.".to_owned()
        }
        (None, None) if card.dots.is_empty() => "Computing the reference solution…".to_owned(),
        (None, None) => format!(
            "The current setting, {} × {}, is not in the diagram. Measure again.",
            card.here.0, card.here.1
        ),
    }
}

/// Time and error of a setting, as text.
fn words(dot: &Dot) -> String {
    let (substeps, iterations) = dot.setting;
    let plural = |count: u32, what: &str| match count {
        1 => format!("1 {what}"),
        _ => format!("{count} {what}s"),
    };
    let (low, median, high) = dot.milliseconds;
    let setting = format!(
        "{} of {}: {} ms per tick ({}–{})",
        plural(substeps, "substep"),
        plural(iterations, "iteration"),
        format(median, 3),
        format(low, 3),
        format(high, 3)
    );
    if dot.sound() {
        let percent = format(dot.error * 100.0, 2);
        format!("{setting}, error {percent} % of the body size.")
    } else {
        format!("{setting}, diverged.")
    }
}

/// Numerical damping of the stiffest and of the softest mode.
fn damping(ui: &mut Ui, (stiffest, softest): (f64, Option<f64>)) {
    let seconds = |time: f64| match time {
        0.0 => "less than a substep".to_owned(),
        time if time < 0.1 => format!("{} ms", format(time * 1e3, 2)),
        time => format!("{} s", format(time, 2)),
    };
    let mut text = format!(
        "Numerical damping at this step size: the stiffest mode loses half its energy in {}",
        seconds(stiffest)
    );
    if let Some(softest) = softest {
        text.push_str(&format!(", the softest in {}", seconds(softest)));
    }
    text.push('.');
    let label = Label::new(RichText::new(text).small().color(theme::of(ui).weak)).wrap();
    ui.add(label).on_hover_text(
        "Damping by the implicit integrator, for a converged solve. More substeps reduce it.",
    );
}

fn goals(ui: &mut Ui, card: &Card, answer: &mut Answer) {
    let mut goals = card.goals;
    ui.horizontal(|ui| {
        ui.label("Best within");
        let field = DragValue::new(&mut goals.milliseconds)
            .range(0.001..=1000.0)
            .speed(0.01)
            .suffix(" ms");
        let field = ui.add(field);
        answer
            .places
            .note("accuracy.milliseconds", &field, ui.clip_rect());
        let goal = Goal::Milliseconds(goals.milliseconds);
        pick(
            ui,
            answer,
            "accuracy.reach_ms",
            goal,
            card.progress.is_none(),
        );
        ui.label("or");
        let field = DragValue::new(&mut goals.percent)
            .range(0.001..=100.0)
            .speed(0.01)
            .suffix(" %");
        let field = ui.add(field);
        answer
            .places
            .note("accuracy.percent", &field, ui.clip_rect());
        let goal = Goal::Error(goals.percent / 100.0);
        pick(
            ui,
            answer,
            "accuracy.reach_error",
            goal,
            card.progress.is_none(),
        );
    });
    if goals != card.goals {
        answer.commands.push(AccuracyCommand::Goals(goals));
    }
}

fn pick(ui: &mut Ui, answer: &mut Answer, name: &str, goal: Goal, enabled: bool) {
    let button = ui.add_enabled(enabled, Button::new("Find"));
    let button = button.on_hover_text(match goal {
        Goal::Milliseconds(_) | Goal::Projections(_) => {
            "Find and use the most accurate setting within this time per tick"
        }
        Goal::Error(_) => "Find and use the cheapest setting within this error",
    });
    answer.places.note(name, &button, ui.clip_rect());
    if button.clicked() {
        answer.commands.push(AccuracyCommand::Reach(goal));
    }
}
