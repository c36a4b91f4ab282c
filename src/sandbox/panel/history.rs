//! Time per part of a tick over the last seconds, as a stacked plot with one column per tick.

use bevy::prelude::*;
use bevy_egui::egui::{
    Align2, Color32, FontSelection, Rect, RichText, Sense, TextStyle, Ui, pos2, vec2,
};
use std::collections::VecDeque;

use super::Panel;
use crate::sandbox::ui::number::format;
use crate::{
    sandbox::ui::theme,
    simulation::{Profile, SimulationClock},
    solver::advance::Stage,
};

/// Number of ticks shown: five seconds at the default rate.
const TICKS: usize = 300;
/// Height of the plot [logical px].
const HEIGHT: f32 = 46.0;
/// Stages and effects, plus the remaining time of a tick.
const PARTS: usize = Stage::ALL.len() + 1;

/// Time by part of a tick [ms].
pub type Column = [f32; PARTS];

/// The last ticks, oldest first.
#[derive(Resource, Debug, Clone, Default, PartialEq)]
pub struct History {
    columns: VecDeque<Column>,
    tick: u64,
}

impl History {
    /// Appends a tick, and drops the oldest one.
    pub fn push(&mut self, column: Column) {
        if self.columns.len() == TICKS {
            self.columns.pop_front();
        }
        self.columns.push_back(column);
    }

    /// Maximum time of a tick [ms]; 0 if there is none.
    #[must_use]
    pub fn most(&self) -> f32 {
        let sums = self.columns.iter().map(|column| column.iter().sum());
        sums.fold(0.0, f32::max)
    }
}

/// Color of all other parts.
const OTHER: Color32 = Color32::from_rgb(112, 120, 136);

/// Color of a part, by its name; from the color-blind safe palette of Okabe and Ito.
#[must_use]
pub fn color(part: &str) -> Color32 {
    match part {
        "stretch" => Color32::from_rgb(86, 180, 233),
        "volume" => Color32::from_rgb(230, 159, 0),
        "grab" => Color32::from_rgb(204, 121, 167),
        "ground" | "sticky_ground" => Color32::from_rgb(0, 158, 115),
        "collide" => Color32::from_rgb(213, 94, 0),
        "presolve" => Color32::from_rgb(240, 228, 66),
        "postsolve" => Color32::from_rgb(0, 114, 178),
        _ => OTHER,
    }
}

/// Adds the last tick. Returns whether a tick has ended since the last frame and no other is under
/// way.
pub(super) fn gather(world: &mut World) -> bool {
    let clock = world.resource::<SimulationClock>();
    let (tick, under_way) = (clock.tick(), clock.mid_tick());
    let profile = world.resource::<Profile>();
    let milliseconds = |time: std::time::Duration| time.as_secs_f32() * 1e3;
    let mut column = [0.0; PARTS];
    for (part, spent) in profile.parts() {
        let place = Stage::ALL.iter().position(|stage| stage.name() == *part);
        column[place.unwrap_or(PARTS - 1)] += milliseconds(*spent);
    }
    let named: f32 = column.iter().sum();
    column[PARTS - 1] += (milliseconds(profile.tick()) - named).max(0.0);
    let mut history = world.resource_mut::<History>();
    if tick < history.tick {
        history.columns.clear();
    }
    let ended = tick > history.tick;
    if ended {
        history.push(column);
    }
    history.tick = tick;
    ended && !under_way
}

/// Draws the plot, and shows the values at the pointer.
pub(super) fn show(ui: &mut Ui, panel: &mut Panel, history: &History) {
    let most = history.most();
    if most == 0.0 {
        return;
    }
    let size = vec2(ui.available_width(), HEIGHT);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    panel.note("effects.history", &response, ui);
    let painter = ui.painter();
    painter.rect_filled(rect, 3.0, theme::of(ui).sunken);
    let width = rect.width() / TICKS as f32;
    let left = rect.right() - width * history.columns.len() as f32;
    let names = Stage::ALL.map(Stage::name);
    let name = |part: usize| names.get(part).copied().unwrap_or("other");
    for (place, column) in history.columns.iter().enumerate() {
        let x = left + width * place as f32;
        let mut bottom = rect.bottom();
        for (part, time) in column.iter().enumerate().filter(|(_, time)| **time > 0.0) {
            let top = bottom - time / most * (HEIGHT - 12.0);
            let bar = Rect::from_min_max(pos2(x, top), pos2(x + width, bottom));
            painter.rect_filled(bar, 0.0, color(name(part)));
            bottom = top;
        }
    }
    let font = FontSelection::Style(TextStyle::Small).resolve(ui.style());
    let text = format!("peak {} ms", format(f64::from(most), 2));
    painter.text(
        rect.left_top() + vec2(4.0, 1.0),
        Align2::LEFT_TOP,
        text,
        font,
        theme::of(ui).weak,
    );
    let pointed = response.hover_pos().and_then(|at| {
        let place = ((at.x - left) / width).floor();
        history.columns.get(if place < 0.0 {
            usize::MAX
        } else {
            place as usize
        })
    });
    let words = pointed.map(|column| {
        let parts = column.iter().enumerate().filter(|(_, time)| **time > 0.0);
        let lines = parts.map(|(part, time)| {
            let time = format(f64::from(*time), 2);
            format!("{}: {time} ms", name(part).replace('_', " "))
        });
        lines.collect::<Vec<_>>().join("\n")
    });
    response.on_hover_ui(|ui| {
        ui.label(RichText::new("Tick time by part").strong());
        ui.label(words.unwrap_or_else(|| "One column per tick, the last 300 ticks".to_owned()));
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_ticks_are_kept_and_the_tallest_is_known() {
        let mut history = History::default();
        assert_eq!(history.most(), 0.0);
        for tick in 0..TICKS + 10 {
            let mut column = [0.0; PARTS];
            column[0] = 0.5;
            column[1] = if tick == 5 { 9.0 } else { 0.25 };
            history.push(column);
        }
        assert_eq!(history.columns.len(), TICKS);
        assert_eq!(history.most(), 0.75, "the tall one is forgotten");
    }
}
