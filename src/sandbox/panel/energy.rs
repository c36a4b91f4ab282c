//! The section of the energy ledger: what bodies hold, what it came from and went to.

use crate::sandbox::state::request::Request;
use bevy::prelude::*;
use bevy_egui::egui::{
    Align, Align2, Color32, FontSelection, Layout, Rect, RichText, Sense, Stroke, TextStyle, Ui,
    Vec2b, vec2,
};
use egui_plot::{HLine, HoverPosition, Line};
use std::collections::VecDeque;

use super::{
    Panel,
    figures::{UNRESOLVED, prefixed},
    history,
    model::{EnergyModel, PanelModel, StoredEnergy},
    section::{self, RowButton, section},
};
use crate::{
    effect::EffectRegistry,
    sandbox::ui::{number::format, plot, theme},
    simulation::{EnergyLedger, SimulationSettings},
};

/// Ticks that are shown: five seconds at the usual rate.
const TICKS: usize = 300;
/// Height of the plot [logical px].
const HEIGHT: f32 = 64.0;
/// Width of a column of figures [logical px].
const FIGURE: f32 = 62.0;

const KINETIC: &str = "Kinetic";
const POTENTIAL: &str = "Potential";

/// What bodies held after each of the last ticks [J], of potential energy what was gained: a
/// column a tick, the oldest first.
#[derive(Resource, Debug, Clone, Default, PartialEq)]
pub struct EnergyTrack(VecDeque<Vec<(&'static str, f32)>>);

impl EnergyTrack {
    /// Takes in a tick, and forgets the oldest.
    pub fn push(&mut self, column: Vec<(&'static str, f32)>) {
        if self.0.len() == TICKS {
            self.0.pop_front();
        }
        self.0.push_back(column);
    }

    fn values(&self) -> impl Iterator<Item = f32> {
        self.0.iter().flatten().map(|(_, value)| *value)
    }
}

/// Switches the ledger on or off.
pub(in crate::sandbox) fn keep(world: &mut World, on: bool) {
    world.insert_resource(EnergyLedger::kept(on));
    world.insert_resource(EnergyTrack::default());
}

/// Takes in the tick that has just ended.
pub(super) fn gather(world: &mut World) {
    let ledger = world.resource::<EnergyLedger>();
    if !ledger.on || ledger.ticks == 0 {
        return;
    }
    let began = ledger.ticks == 1;
    let column = held(world, ledger)
        .into_iter()
        .map(|(name, now, change)| {
            let shown = if name == POTENTIAL { change } else { now };
            (name, shown as f32)
        })
        .collect();
    let mut track = world.resource_mut::<EnergyTrack>();
    if began {
        track.0.clear();
    }
    track.push(column);
}

fn held(world: &World, ledger: &EnergyLedger) -> Vec<(&'static str, f64, f64)> {
    let EnergyLedger { start, now, .. } = ledger;
    let elastic = world
        .resource::<EffectRegistry>()
        .iter()
        .filter_map(|effect| {
            let [before, after] = [start, now].map(|held| held.elastic.get(effect.name));
            before.or(after)?;
            let [before, after] = [before, after].map(|energy| energy.copied().unwrap_or_default());
            Some((effect.title, after, after - before))
        });
    [
        (KINETIC, now.kinetic, now.kinetic - start.kinetic),
        (POTENTIAL, now.potential, now.potential - start.potential),
    ]
    .into_iter()
    .chain(elastic)
    .collect()
}

/// The ledger as the panel shows it; none while it is not kept.
pub(super) fn model(world: &World) -> Option<EnergyModel> {
    let ledger = world.resource::<EnergyLedger>();
    if !ledger.on {
        return None;
    }
    let held = held(world, ledger);
    let rows: Vec<_> = ledger
        .rows()
        .into_iter()
        .map(|(name, energy)| {
            let (title, help) = words(name);
            (title, help, energy)
        })
        .collect();
    let largest = held
        .iter()
        .flat_map(|(_, now, change)| [now.abs(), change.abs()])
        .chain(rows.iter().map(|(.., energy)| energy.abs()))
        .fold(f64::MIN_POSITIVE, f64::max);
    Some(EnergyModel {
        seconds: ledger.ticks as f64 * world.resource::<SimulationSettings>().tick_seconds(),
        held,
        rows,
        change: ledger.change(),
        gap: ledger.gap() / largest,
        track: world.resource::<EnergyTrack>().clone(),
    })
}

/// What a row is called, and what it means.
fn words(row: &str) -> (&'static str, &'static str) {
    match row {
        "damping" => (
            "Damping",
            "Energy dissipated by the requested damping at the rates at which edges and volumes \
             change",
        ),
        "friction" => (
            "Friction",
            "Energy dissipated by sliding on the ground, on colliders and on other surfaces",
        ),
        "contact" => (
            "Contact",
            "Energy lost in impacts and exchanged with moving colliders",
        ),
        "truncation" => (
            "Truncation",
            "Energy removed by truncating motion that would make surfaces cross, and by returning \
             the momentum of that motion",
        ),
        "recovery" => (
            "Recovery",
            "Work of separating surfaces that overlap or cross",
        ),
        "grab" => (
            "Grab",
            "Work of the mouse spring on the grabbed body, and of clamps that turn rods",
        ),
        "plastic" => (
            "Plastic flow",
            "Energy dissipated as rest lengths, angles and volumes change beyond the yield strain",
        ),
        "forces" => (
            "Forces",
            "Work of wind, drag and other force fields, without gravity",
        ),
        "integrator" => (
            "Integrator",
            "Numerical damping of the integrator, for a converged solve. More substeps reduce it.",
        ),
        "convergence" => (
            "Convergence",
            "Error of the unconverged solve: stored energy and damping above belong to the \
             requested material, but a softer one is simulated. More substeps or iterations \
             reduce it.",
        ),
        "rounding" => ("Rounding", "Rounding of positions and velocities to f32"),
        "repair" => (
            "Repair",
            "Energy removed or added while collapsed elements recover their rest shape",
        ),
        "torn" => (
            "Tearing and cutting",
            "Energy added by duplicating edges along cracks, minus the energy of hinges and joints \
             that broke. The fracture energy turns into motion, which dissipates.",
        ),
        _ => (
            "Edits and sleep",
            "Changes between ticks: edited parameters, bodies added, removed or deformed, also by \
             emitters and sinks, bodies that fell asleep",
        ),
    }
}

/// Draws the section.
pub fn show(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    section(ui, panel, "Energy", |ui, panel| {
        if model.energy.is_none() {
            stored(ui, &model.stored);
        }
        let on = model.energy.is_some();
        let buttons = [
            RowButton {
                selected: on,
                ..RowButton::new(
                    "energy.keep",
                    "Track energy",
                    "Account for all sources and sinks of energy. Steps take about three times as \
                     long.",
                )
            },
            RowButton {
                enabled: on,
                ..RowButton::new(
                    "energy.anew",
                    "Reset",
                    "Restart the balance from the current state",
                )
            },
        ];
        match section::button_row(ui, panel, &buttons) {
            Some(0) => panel.ask(Request::Ledger(!on)),
            Some(_) => panel.ask(Request::Ledger(true)),
            None => {}
        }
        if let Some(energy) = &model.energy {
            ledger(ui, panel, energy);
        }
        if model.stored.is_unresolved() {
            unresolved(ui, panel, &model.stored);
        }
    });
}

/// The energy of all bodies, by kind.
fn stored(ui: &mut Ui, stored: &StoredEnergy) {
    let rows = [
        (KINETIC, stored.kinetic),
        (POTENTIAL, stored.potential),
        ("Elastic", stored.elastic),
        ("Total", stored.sum()),
    ];
    for (title, energy) in rows {
        let color = match title {
            "Total" => theme::of(ui).strong,
            _ => theme::of(ui).text,
        };
        line(
            ui,
            None,
            title,
            ["".to_owned(), prefixed(energy, "J")],
            color,
        );
    }
}

/// The elastic energy that the solver does not hold.
fn unresolved(ui: &mut Ui, panel: &mut Panel, stored: &StoredEnergy) {
    let figures = ["".to_owned(), prefixed(stored.unresolved, "J")];
    let response = line(ui, None, "* Unresolved", figures, theme::of(ui).changed);
    panel.note("energy.unresolved", &response, ui);
    section::hint(ui, &response, |ui| {
        ui.set_max_width(theme::TOOLTIP);
        ui.label(RichText::new("Unresolved").strong());
        ui.label(UNRESOLVED);
        ui.label("The ledger counts it as stored, and its change as convergence.");
    });
}

fn ledger(ui: &mut Ui, panel: &mut Panel, energy: &EnergyModel) {
    track(ui, panel, energy);
    ui.spacing_mut().item_spacing.y = 2.0;
    line(
        ui,
        None,
        "Stored",
        ["now [J]", "change [J]"],
        theme::of(ui).weak,
    );
    for (title, now, change) in &energy.held {
        let figures = [format(*now, 3), signed(*change)];
        line(ui, Some(color(title)), title, figures, theme::of(ui).text);
    }
    let change = ["".to_owned(), signed(energy.change)];
    line(ui, None, "Total", change, theme::of(ui).strong);
    let over = format!("over {} s", format(energy.seconds, 3));
    line(
        ui,
        None,
        "Sources (−: sinks)",
        ["".to_owned(), over],
        theme::of(ui).weak,
    );
    for (title, help, given) in &energy.rows {
        let figures = ["".to_owned(), signed(*given)];
        let response = line(ui, None, title, figures, theme::of(ui).text);
        panel.note(format!("energy.{}", title.to_lowercase()), &response, ui);
        section::hint(ui, &response, |ui| {
            ui.set_max_width(280.0);
            ui.label(RichText::new(*title).strong());
            ui.label(*help);
        });
    }
    let sum: f64 = energy.rows.iter().map(|(.., given)| given).sum();
    let figures = ["".to_owned(), signed(sum)];
    line(ui, None, "Total", figures, theme::of(ui).strong);
    let gap = format(energy.gap.abs(), 1);
    section::note(ui, &format!("Balance closes to {gap} of the largest term."));
}

/// A row: a patch of color, a title, two figures in columns.
fn line(
    ui: &mut Ui,
    patch: Option<Color32>,
    title: &str,
    figures: [impl Into<String>; 2],
    text: Color32,
) -> bevy_egui::egui::Response {
    let row = ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = theme::GAP;
        let (rect, _) = ui.allocate_exact_size(vec2(8.0, 16.0), Sense::hover());
        if let Some(patch) = patch {
            let square = Rect::from_center_size(rect.center(), vec2(8.0, 8.0));
            ui.painter().rect_filled(square, 1.0, patch);
        }
        ui.label(RichText::new(title).small().color(text));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            for figure in figures.map(Into::into).into_iter().rev() {
                let size = vec2(FIGURE, 16.0);
                ui.allocate_ui_with_layout(size, Layout::right_to_left(Align::Center), |ui| {
                    ui.set_min_width(FIGURE);
                    ui.label(RichText::new(figure).small().color(text));
                });
            }
        });
    });
    row.response
}

fn signed(energy: f64) -> String {
    let text = format(energy, 3);
    if energy > 0.0 {
        format!("+{text}")
    } else {
        text.replacen('-', "−", 1)
    }
}

fn color(title: &str) -> Color32 {
    match title {
        KINETIC => history::color("presolve"),
        POTENTIAL => history::color("ground"),
        _ => history::color(&title.to_lowercase()),
    }
}

fn track(ui: &mut Ui, panel: &mut Panel, energy: &EnergyModel) {
    let ticks = &energy.track;
    let (low, high) = ticks
        .values()
        .fold((0.0_f32, 0.0_f32), |(low, high), value| {
            (low.min(value), high.max(value))
        });
    let joules = |value: f64| format!("{} J", signed(value));
    let plot = plot::fixed("stored energy", HEIGHT)
        .show_axes(false)
        .show_grid(false)
        .sense(Sense::hover())
        .label_formatter(move |at| match at {
            HoverPosition::NearDataPoint {
                plot_name,
                position,
                ..
            } => Some(format!(
                "{plot_name}: {}\n{}",
                joules(position.y),
                match -position.x {
                    1.0 => "1 tick ago".to_owned(),
                    ticks => format!("{ticks} ticks ago"),
                }
            )),
            HoverPosition::Elsewhere { .. } => None,
        });
    let colors = theme::of(ui);
    let shown = plot.show(ui, |plot| {
        let last = ticks.0.len() as f64 - 1.0;
        // Room for the figures in the corners.
        let margin = f64::from(high - low).max(f64::MIN_POSITIVE) * 0.1;
        plot.set_auto_bounds(Vec2b::FALSE);
        plot.set_plot_bounds_x(1.0 - TICKS as f64..=0.0);
        plot.set_plot_bounds_y(f64::from(low) - margin..=f64::from(high) + margin);
        plot.hline(HLine::new("0 J", 0.0).stroke(Stroke::new(1.0, colors.line)));
        for (title, ..) in &energy.held {
            let points = ticks.0.iter().enumerate().filter_map(|(tick, column)| {
                let (_, value) = column.iter().find(|(name, _)| name == title)?;
                Some([tick as f64 - last, f64::from(*value)])
            });
            let line = Line::new(*title, points.collect::<Vec<_>>());
            plot.line(line.stroke(Stroke::new(1.5, color(title))));
        }
    });
    panel.note("energy.plot", &shown.response, ui);
    let font = FontSelection::Style(TextStyle::Small).resolve(ui.style());
    let rect = shown.response.rect;
    let painter = ui.painter();
    let label = |at, align, value: f32| {
        painter.text(
            at,
            align,
            joules(f64::from(value)),
            font.clone(),
            theme::of(ui).weak,
        );
    };
    label(rect.left_top() + vec2(4.0, 1.0), Align2::LEFT_TOP, high);
    if low < 0.0 {
        label(
            rect.left_bottom() + vec2(4.0, -1.0),
            Align2::LEFT_BOTTOM,
            low,
        );
    }
}
