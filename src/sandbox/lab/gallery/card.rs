//! The card of the gallery, drawn from plain data.

use super::{GalleryCommand, On, Verdict};
use crate::{
    sandbox::ui::{WidgetRects, format, theme},
    torture::{Figure, filmstrip::Frame},
};
use bevy_egui::egui::{
    Align, Align2, Area, Button, Color32, Context, Frame as Pane, Id, Label, Layout, Margin, Order,
    ProgressBar, Rect, RichText, ScrollArea, Sense, Shape, Stroke, Ui, pos2, vec2,
};

/// Width of the card [logical px].
const WIDTH: f32 = 400.0;
/// Height of the list [logical px], if the window is high enough.
const LIST: f32 = 290.0;
/// Distance from the top of the window, below the head-up line [logical px].
const TOP: f32 = 84.0;
/// Height left for a notice at the bottom of the window [logical px].
const NOTICE: f32 = 60.0;
/// Minimum height of a window for pictures [logical px].
const PICTURES: f32 = 600.0;
/// Widths of the buttons in a row, for the selection and for the test bodies [logical px].
const BUTTONS: [f32; 2] = [66.0, 78.0];

/// The data of the card.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Card {
    /// Name of the body on screen, if there is one.
    pub this: Option<String>,
    /// The cases.
    pub lines: Vec<Line>,
    /// The verdict that is shown in detail.
    pub shown: Option<(usize, On, Verdict)>,
    /// Reason why a case could not be run.
    pub trouble: Option<String>,
}

/// A case of the list.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Title.
    pub title: &'static str,
    /// What is done, and what must hold afterwards.
    pub about: &'static str,
    /// Whether the case can be run on the body on screen.
    pub any_body: bool,
    /// For the body on screen and for the case's own bodies: whether it passed, and whether a
    /// failure was expected.
    pub verdicts: [Option<(bool, bool)>; 2],
    /// Completed fraction of the running case.
    pub running: Option<f32>,
}

/// Result of drawing the card.
#[derive(Debug, Default)]
pub struct Answer {
    /// Commands of the user, in order.
    pub commands: Vec<GalleryCommand>,
    /// Rectangles of the widgets.
    pub places: WidgetRects,
}

/// Draws the card at the left edge of the area that the panel leaves free, below the head-up line.
pub fn show(context: &Context, card: &Card, free: Rect) -> Answer {
    let screen = context.content_rect();
    let width = WIDTH.min(free.width() - 20.0);
    let pictures = screen.height() >= PICTURES;
    let rest = if pictures { 350.0 } else { 210.0 };
    let list = LIST.min(screen.height() - TOP - rest - NOTICE).max(60.0);
    let mut answer = Answer::default();
    let area = Area::new(Id::new("stress tests"))
        .order(Order::Middle)
        .anchor(Align2::LEFT_TOP, vec2(free.left() + 10.0, TOP))
        .constrain(false)
        .show(context, |ui| {
            Pane::new()
                .fill(theme::of(ui).ground)
                .stroke(Stroke::new(1.0, theme::of(ui).line))
                .corner_radius(8.0)
                .inner_margin(Margin::symmetric(12, 10))
                .show(ui, |ui| {
                    ui.set_width(width - 26.0);
                    head(ui, card, &mut answer);
                    ScrollArea::vertical()
                        .max_height(list)
                        .auto_shrink([false, true])
                        .show(ui, |ui| {
                            for (number, line) in card.lines.iter().enumerate() {
                                case(ui, card, (number, line), &mut answer);
                            }
                        });
                    foot(ui, card, pictures, &mut answer);
                });
        });
    answer.places.note("gallery", &area.response, screen);
    answer
}

fn head(ui: &mut Ui, card: &Card, answer: &mut Answer) {
    ui.horizontal(|ui| {
        ui.label(RichText::new("Stress tests").color(theme::of(ui).strong));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let close = ui.add(Button::new("×").frame(false));
            answer.places.note("gallery.close", &close, ui.clip_rect());
            if close.on_hover_text("Close (C)").clicked() {
                answer.commands.push(GalleryCommand::Toggle);
            }
            let runs = card.lines.iter().any(|line| line.running.is_some());
            let (text, help, command) = if runs {
                ("Stop", "Stop and keep the results", GalleryCommand::Stop)
            } else {
                (
                    "Run all",
                    "Run every case on its test bodies, as `pliant torture --quick` does",
                    GalleryCommand::RunAll,
                )
            };
            let button = ui.button(text).on_hover_text(help);
            answer.places.note("gallery.all", &button, ui.clip_rect());
            if button.clicked() {
                answer.commands.push(command);
            }
        });
    });
}

fn case(ui: &mut Ui, card: &Card, (number, line): (usize, &Line), answer: &mut Answer) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = theme::GAP;
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.add_space(8.0);
            buttons(ui, card, (number, line), answer);
            if let Some(fraction) = line.running {
                let bar = ProgressBar::new(fraction).desired_height(6.0);
                ui.add(bar.desired_width(40.0).fill(theme::of(ui).accent));
            }
            // The title gets the room that is left.
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                let looked_at = card.shown.as_ref().is_some_and(|shown| shown.0 == number);
                let color = if looked_at {
                    theme::of(ui).strong
                } else {
                    theme::of(ui).text
                };
                let title = RichText::new(line.title).small().color(color);
                let title = ui.add(Label::new(title).sense(Sense::click()).truncate());
                let place = format!("gallery.{number}");
                answer.places.note(place, &title, ui.clip_rect());
                if title.on_hover_text(line.about).clicked() {
                    answer.commands.push(GalleryCommand::Look(number));
                }
            });
        });
    });
}

/// The buttons that run a case, from right to left.
fn buttons(ui: &mut Ui, card: &Card, (number, line): (usize, &Line), answer: &mut Answer) {
    let [this_width, own_width] = BUTTONS;
    let this_help = match &card.this {
        Some(body) => format!("Run the case on {body}"),
        None => "Run the case on the selected body: select one first".to_owned(),
    };
    for (on, name, text, help, enabled, verdict, width) in [
        (
            On::Own,
            "own",
            "Test bodies",
            "Run the case on its test bodies",
            true,
            line.verdicts[1],
            own_width,
        ),
        (
            On::This,
            "this",
            "Selection",
            this_help.as_str(),
            card.this.is_some(),
            line.verdicts[0],
            this_width,
        ),
    ] {
        if on == On::This && !line.any_body {
            ui.add_space(width);
            continue;
        }
        let mut button = Button::new(RichText::new(text).small());
        if let Some((passed, expected)) = verdict {
            button = button.stroke(Stroke::new(1.5, verdict_color(ui, passed, expected)));
        }
        let button = button.min_size(vec2(width, 18.0));
        let button = ui.add_enabled(enabled, button);
        let button = button.on_hover_text(help).on_disabled_hover_text(help);
        let place = format!("gallery.{number}.{name}");
        answer.places.note(place, &button, ui.clip_rect());
        if button.clicked() {
            answer.commands.push(GalleryCommand::Run(number, on));
        }
    }
}

/// Green for a pass, amber for an expected failure, red for an unexpected one; the text also says
/// so.
fn verdict_color(ui: &Ui, passed: bool, expected: bool) -> Color32 {
    let colors = theme::of(ui);
    match (passed, expected) {
        (true, _) => colors.accent,
        (false, true) => colors.changed,
        (false, false) => colors.alarm,
    }
}

fn foot(ui: &mut Ui, card: &Card, pictures: bool, answer: &mut Answer) {
    if let Some(trouble) = &card.trouble {
        let text = RichText::new(trouble).small().color(theme::of(ui).alarm);
        ui.add(Label::new(text).wrap());
    }
    let Some((number, on, verdict)) = &card.shown else {
        return;
    };
    ui.separator();
    let title = card.lines.get(*number).map_or("", |line| line.title);
    let color = verdict_color(ui, verdict.passed(), verdict.expected.is_some());
    let text = RichText::new(format!("{title}: {}", words(*on, verdict)));
    ui.add(Label::new(text.color(color)).wrap());
    for figure in verdict.figures.iter().take(4) {
        let color = if figure.holds() {
            theme::of(ui).text
        } else {
            theme::of(ui).alarm
        };
        let text = RichText::new(figure_words(figure)).small().color(color);
        ui.add(Label::new(text).wrap());
    }
    if let Some(reason) = verdict.expected {
        let text = format!("Known failure: {reason}");
        ui.add(Label::new(RichText::new(text).small().color(theme::of(ui).changed)).wrap());
    }
    match &verdict.advice {
        Some(advice) => {
            let text = RichText::new(format!("It {advice}."))
                .small()
                .color(theme::of(ui).strong);
            ui.add(Label::new(text).wrap());
        }
        None if !verdict.passed() => {
            let runs = card.lines.iter().any(|line| line.running.is_some());
            let button = ui
                .add_enabled(!runs, Button::new("Find settings that pass"))
                .on_hover_text(
                    "Try more substeps, more iterations and the direct solver, the cheapest first",
                );
            answer
                .places
                .note("gallery.advise", &button, ui.clip_rect());
            if button.clicked() {
                answer.commands.push(GalleryCommand::Advise(*number, *on));
            }
        }
        None => {}
    }
    if pictures {
        strip(ui, &verdict.film);
    }
    if *on == On::This {
        let button = ui
            .button("Save recording")
            .on_hover_text("Save this run as a recording for `pliant replay`");
        answer.places.note("gallery.save", &button, ui.clip_rect());
        if button.clicked() {
            answer.commands.push(GalleryCommand::Save(*number));
        }
    }
}

fn words(on: On, verdict: &Verdict) -> String {
    let outcome = if verdict.passed() { "passes" } else { "fails" };
    let Verdict {
        member,
        members,
        failed,
        expected_failed,
        ..
    } = verdict;
    let passed = members - failed - expected_failed;
    match (on, failed, expected_failed) {
        (On::This, ..) => format!("{outcome} on this body."),
        (On::Own, 0, 0) => format!("all {members} pass. Closest to its limit: {member}."),
        (On::Own, 0, 1) => format!(
            "{passed} of {members} pass, 1 is a known failure. Closest to its limit: {member}."
        ),
        (On::Own, 0, expected) => format!(
            "{passed} of {members} pass, {expected} are known failures. Closest to its limit: {member}."
        ),
        (On::Own, failed, _) => {
            format!("unexpected failures: {failed} of {members}. Shown: {member}, which {outcome}.")
        }
    }
}

fn figure_words(figure: &Figure) -> String {
    let Figure {
        name,
        value,
        limit,
        unit,
    } = figure;
    let value = format(*value, 3);
    if limit.is_finite() {
        format!("{name}: {value} {unit} (limit {})", format(*limit, 3))
    } else {
        format!("{name}: {value} {unit}")
    }
}

/// The pictures side by side, each with its time and scale.
fn strip(ui: &mut Ui, film: &[Frame]) {
    if film.is_empty() {
        return;
    }
    let width = (ui.available_width() - 8.0) / film.len() as f32;
    let height = width + 14.0;
    let size = vec2(ui.available_width(), height);
    let (rect, _) = ui.allocate_exact_size(size, Sense::hover());
    for (place, frame) in film.iter().enumerate() {
        let left = rect.left() + (width + 4.0) * place as f32;
        let picture = Rect::from_min_size(pos2(left, rect.top()), vec2(width, width));
        let painter = ui.painter().with_clip_rect(picture);
        painter.rect_filled(picture, 3.0, theme::of(ui).sunken);
        let inside = picture.shrink(8.0);
        let at = |[x, y]: [f32; 2]| {
            pos2(
                inside.left() + x * inside.width(),
                inside.bottom() - y * inside.height(),
            )
        };
        let stroke = Stroke::new(0.7, theme::of(ui).accent.gamma_multiply(0.8));
        for ends in frame.lines.iter().map(|line| line.map(at)) {
            painter.add(Shape::line_segment(ends, stroke));
        }
        let text = format!(
            "{} {} s, {} m",
            frame.name,
            format(frame.time, 2),
            format(frame.extent, 2)
        );
        ui.put(
            Rect::from_min_size(pos2(left, picture.bottom()), vec2(width, 14.0)),
            Label::new(RichText::new(text).small().color(theme::of(ui).weak)).truncate(),
        );
    }
}
