//! The cards of the plots, drawn from plain data.

use super::{
    PlotCommand,
    curve::ForceCurve,
    figures::{FIGURES, Figure, SECONDS},
    labelled,
};
use crate::sandbox::ui::{WidgetRects, area, format, plot, theme};
use bevy_egui::egui::{
    Align, Align2, Area, Button, Context, Frame, Id, Label, Layout, Margin, Order, Rect, RichText,
    ScrollArea, Sense, Stroke, Ui, Vec2b, pos2,
};
use egui_plot::{HoverPosition, Line, PlotPoints, Points};

/// Width of the contents [logical px].
const WIDTH: f32 = 270.0;
/// Height of a plot over time, and of the force–displacement curve [logical px].
const HEIGHTS: (f32, f32) = (58.0, 110.0);

/// Maximum height of the list of figures [logical px].
const MENU: f32 = 320.0;

/// A figure with its points: time [s] and value.
#[derive(Debug, Clone)]
pub struct Shown {
    /// The figure.
    pub figure: &'static Figure,
    /// Its points.
    pub points: Vec<[f64; 2]>,
}

/// Content of the cards.
#[derive(Debug, Clone, Default)]
pub struct Card {
    /// The chosen figures over time, if the plots are open.
    pub over_time: Option<Vec<Shown>>,
    /// Time of the last tick [s].
    pub end: f64,
    /// Whether no ticks are taken in.
    pub frozen: bool,
    /// The force–displacement curve, if there is one and it is shown.
    pub curve: Option<ForceCurve>,
    /// Whether it is shown during a drag.
    pub curve_shown: bool,
}

/// Result of drawing the cards.
#[derive(Debug, Default)]
pub struct Answer {
    /// Commands, in order.
    pub commands: Vec<PlotCommand>,
    /// Whether the plots are to be exported.
    pub export: bool,
    /// Widget rectangles.
    pub places: WidgetRects,
}

/// Draws the cards in the lower right corner of the area that the panel leaves free.
pub fn show(context: &Context, card: &Card, free: Rect) -> Answer {
    let mut answer = Answer::default();
    let width = WIDTH.min(free.width() - 40.0);
    // Above the legend of the solver view.
    let legend = area::card(context, "solver legend", Order::Background);
    let bottom = legend.map_or(free.bottom(), |legend| legend.top());
    let area = Area::new(Id::new("plots"))
        .order(Order::Middle)
        .pivot(Align2::RIGHT_BOTTOM)
        .fixed_pos(pos2(free.right() - 10.0, bottom - 10.0))
        .constrain(false)
        // Fading would leave a gray box: see `Palette::veil` about translucent colors.
        .fade_in(false)
        .show(context, |ui| {
            ui.spacing_mut().item_spacing.y = 6.0;
            if let Some(curve) = &card.curve {
                framed(ui, width, |ui| force(ui, curve, &mut answer));
            }
            if let Some(figures) = &card.over_time {
                // Below the head-up line, and the curve.
                let above = if card.curve.is_some() { 220.0 } else { 60.0 };
                let height = (bottom - free.top() - above - 60.0).max(80.0);
                framed(ui, width, |ui| {
                    over_time(ui, card, figures, height, &mut answer);
                });
            }
        });
    answer
        .places
        .note("plots", &area.response, context.content_rect());
    answer
}

fn framed(ui: &mut Ui, width: f32, contents: impl FnOnce(&mut Ui)) {
    Frame::new()
        .fill(theme::of(ui).veil)
        .corner_radius(8.0)
        .inner_margin(Margin::symmetric(10, 7))
        .show(ui, |ui| {
            ui.set_width(width);
            ui.spacing_mut().item_spacing.y = 3.0;
            contents(ui);
        });
}

/// A title with buttons at its right end.
fn head(ui: &mut Ui, title: &str, buttons: impl FnOnce(&mut Ui)) {
    ui.horizontal(|ui| {
        let title = RichText::new(title).color(theme::of(ui).strong);
        ui.add(Label::new(title).truncate());
        ui.with_layout(Layout::right_to_left(Align::Center), buttons);
    });
}

fn force(ui: &mut Ui, curve: &ForceCurve, answer: &mut Answer) {
    let colors = theme::of(ui);
    head(ui, "Force [N] over displacement [mm]", |ui| {
        let close = ui.add(Button::new("×").frame(false));
        let close = close.on_hover_text("Hide the curve; the plots (I) show it again");
        answer
            .places
            .note("plots.curve.close", &close, ui.clip_rect());
        if close.clicked() {
            answer.commands.push(PlotCommand::Curve(false));
        }
    });
    let millimeters = |&[displacement, force]: &[f64; 2]| [1e3 * displacement, force];
    let points: Vec<[f64; 2]> = curve.points().iter().map(millimeters).collect();
    let fit = curve.fit();
    let most = |axis: usize| points.iter().map(|it| it[axis]).fold(0.0, f64::max);
    let (farthest, strongest) = (most(0).max(1.0), most(1).max(1e-3));
    let shown = plot::fixed("force over displacement", HEIGHTS.1)
        .sense(Sense::hover())
        .show_grid(true)
        .y_axis_min_width(36.0)
        .label_formatter(|at| match at {
            HoverPosition::NearDataPoint { position, .. } => Some(format!(
                "{} mm\n{} N",
                format(position.x, 3),
                format(position.y, 3)
            )),
            HoverPosition::Elsewhere { .. } => None,
        })
        .show(ui, |plot| {
            plot.set_auto_bounds(Vec2b::FALSE);
            plot.set_plot_bounds_x(0.0..=1.05 * farthest);
            plot.set_plot_bounds_y(0.0..=1.1 * strongest);
            if let Some(fit) = fit {
                let at = |x: f64| [x, fit.force + 1e-3 * fit.stiffness * x];
                let line = Line::new("fit", vec![at(0.0), at(farthest)]);
                plot.line(line.stroke(Stroke::new(1.0, colors.changed)));
            }
            let line = Line::new("force", PlotPoints::from(points.clone()));
            plot.line(line.stroke(Stroke::new(1.5, colors.accent)));
            if let Some(last) = points.last().filter(|_| curve.live) {
                let last = Points::new("now", vec![*last]);
                plot.points(last.radius(3.5).color(colors.strong));
            }
        });
    answer
        .places
        .note("plots.curve", &shown.response, ui.clip_rect());
    let text = match fit {
        Some(fit) => format!(
            "Stiffness {} N/m (fit, R² {})",
            format(fit.stiffness, 3),
            format(fit.quality, 2)
        ),
        None => "Stiffness: pull farther".to_owned(),
    };
    let text = RichText::new(text).small().color(colors.text);
    let label = ui.add(Label::new(text).wrap());
    label.on_hover_text(
        "Slope of the least-squares line through all ticks of the drag. Pull slowly: inertia and \
         damping count too. A body that is not pinned is displaced as a whole.",
    );
}

fn over_time(ui: &mut Ui, card: &Card, figures: &[Shown], height: f32, answer: &mut Answer) {
    head(ui, "Last 10 s", |ui| {
        let close = ui.add(Button::new("×").frame(false));
        let close = close.on_hover_text("Close (I)");
        answer.places.note("plots.close", &close, ui.clip_rect());
        if close.clicked() {
            answer.commands.push(PlotCommand::Toggle);
        }
        let export = ui.button("Export").on_hover_text(
            "Save the chosen quantities, and the force–displacement curve, as CSV and SVG",
        );
        answer.places.note("plots.export", &export, ui.clip_rect());
        answer.export |= export.clicked();
        let freeze = Button::new("Freeze").selected(card.frozen);
        let freeze = ui.add(freeze).on_hover_text(
            "Keep the plots as they are, to read them, while the simulation goes on",
        );
        answer.places.note("plots.freeze", &freeze, ui.clip_rect());
        if freeze.clicked() {
            answer.commands.push(PlotCommand::Freeze(!card.frozen));
        }
        let menu = ui.menu_button("Quantities", |ui| menu(ui, card, figures, answer));
        answer
            .places
            .note("plots.figures", &menu.response, ui.clip_rect());
        menu.response.on_hover_text("Choose what is plotted");
    });
    ScrollArea::vertical()
        .max_height(height)
        .auto_shrink([false, true])
        .show(ui, |ui| {
            for shown in figures {
                figure(ui, shown, card.end, answer);
            }
            if figures.is_empty() {
                ui.weak("No quantity selected.");
            }
        });
}

fn menu(ui: &mut Ui, card: &Card, figures: &[Shown], answer: &mut Answer) {
    let mut curve = card.curve_shown;
    let line = ui.checkbox(&mut curve, "Force over displacement, while dragging");
    answer
        .places
        .note("plots.figure.curve", &line, ui.clip_rect());
    if line.changed() {
        answer.commands.push(PlotCommand::Curve(curve));
    }
    ui.separator();
    ScrollArea::vertical().max_height(MENU).show(ui, |ui| {
        for figure in &FIGURES {
            let mut chosen = figures.iter().any(|it| it.figure.name == figure.name);
            let line = ui.checkbox(&mut chosen, labelled(figure));
            let name = format!("plots.figure.{}", figure.name);
            answer.places.note(name, &line, ui.clip_rect());
            if line.changed() {
                answer.commands.push(PlotCommand::Figure(figure.name));
            }
        }
    });
}

/// A figure over time, with its last value.
fn figure(ui: &mut Ui, shown: &Shown, end: f64, answer: &mut Answer) {
    let colors = theme::of(ui);
    let unit = shown.figure.unit;
    let text = |value: f64| format!("{} {unit}", format(value, 4)).trim_end().to_owned();
    ui.horizontal(|ui| {
        let title = RichText::new(shown.figure.title).small().color(colors.text);
        ui.add(Label::new(title).truncate());
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let last = shown.points.last();
            let last = last.map_or_else(|| "–".to_owned(), |it| text(it[1]));
            ui.label(RichText::new(last).small().monospace().color(colors.strong));
        });
    });
    let fold = |(low, high): (f64, f64), point: &[f64; 2]| (low.min(point[1]), high.max(point[1]));
    let range = (f64::INFINITY, f64::NEG_INFINITY);
    let (low, high) = shown.points.iter().fold(range, fold);
    let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
    let least = (low.abs().max(high.abs()) * 1e-3).max(1e-9);
    let margin = ((high - low) * 0.08).max(least);
    let relative: Vec<[f64; 2]> = shown.points.iter().map(|it| [it[0] - end, it[1]]).collect();
    let plot = plot::fixed(shown.figure.name, HEIGHTS.0)
        .sense(Sense::hover())
        .show_x(true)
        .show_axes([false, true])
        .y_axis_min_width(36.0)
        .label_formatter(move |at| match at {
            HoverPosition::NearDataPoint { position, .. } => Some(format!(
                "{} s\n{}",
                format(end + position.x, 4),
                format!("{} {unit}", format(position.y, 4)).trim_end()
            )),
            HoverPosition::Elsewhere { .. } => None,
        })
        .show(ui, |plot| {
            plot.set_auto_bounds(Vec2b::FALSE);
            plot.set_plot_bounds_x(-SECONDS..=0.0);
            plot.set_plot_bounds_y(low - margin..=high + margin);
            let line = Line::new(shown.figure.title, PlotPoints::from(relative));
            plot.line(line.stroke(Stroke::new(1.5, colors.accent)));
        });
    let name = format!("plots.{}", shown.figure.name);
    answer.places.note(name, &plot.response, ui.clip_rect());
}
