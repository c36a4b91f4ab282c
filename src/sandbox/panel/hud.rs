//! The head-up line: cost and state of the simulation, over the view.
//!
//! It shows [`figures`], which are updated a few times per second to remain legible, each with a
//! tooltip. It does not capture the pointer: a drag or an orbit may begin over it.

use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{self, Area, Frame, Id, Label, Layout, Margin, Order, Rect, RichText, vec2},
};
use std::time::Duration;

use super::figures::{Figure, figures};
use crate::sandbox::{
    lab::{reference_overlay::ReferenceOverlay, throughput::Throughput},
    state::{
        activity::Activity,
        view::{Followed, ViewSettings},
    },
    ui::{area, format, theme},
};
use crate::simulation::{SimulationClock, SoftBody, Statistics};
use std::collections::VecDeque;

/// Update rate of the figures [1/s].
const REFRESH: f32 = 5.0;
/// Width of a figure [logical px].
const CELL: f32 = 74.0;

/// Content of the line.
#[derive(Resource, Debug, Default)]
pub struct HeadUp {
    figures: Vec<Figure>,
    /// Exceptional state, such as paused or slow; empty otherwise.
    state: String,
    frames: u32,
    seconds: f32,
    pace: Pace,
    times: TickTimes,
}

impl HeadUp {
    /// Median time of the solver in the ticks of the last second [ms].
    pub fn ms_per_tick(&self) -> f64 {
        self.times.median
    }
}

/// Times of the solver in the last ticks.
#[derive(Debug, Default)]
struct TickTimes {
    /// The last ones [ms], oldest first.
    last: VecDeque<f64>,
    /// The tick of the last one.
    tick: u64,
    /// Their median when it was shown last [ms].
    median: f64,
}

impl TickTimes {
    /// Number of ticks: a second at the default rate.
    const COUNT: usize = 60;

    fn push(&mut self, statistics: &Statistics) {
        if statistics.tick == self.tick {
            return;
        }
        if statistics.tick < self.tick {
            self.last.clear();
        }
        self.tick = statistics.tick;
        if self.last.len() == Self::COUNT {
            self.last.pop_front();
        }
        self.last.push_back(statistics.ms_per_tick);
    }

    fn find_median(&mut self) -> f64 {
        let mut sorted = Vec::from_iter(self.last.iter().copied());
        sorted.sort_by(f64::total_cmp);
        self.median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
        self.median
    }
}

/// Simulated seconds per real second.
#[derive(Debug, Default)]
struct Pace {
    /// Measured over the last second; `None` before that.
    found: Option<f64>,
    /// Real seconds since the last measurement, and simulated time at that moment [s].
    seconds: f64,
    start: f64,
}

impl Pace {
    /// Duration of a measurement [s]; longer than several frames of a slow renderer, which take up
    /// to 1/7 s.
    const WINDOW: f64 = 1.0;

    /// Advances by `real` seconds to the simulated time of the clock [s].
    fn pass(&mut self, clock: &SimulationClock, real: f64) {
        let now = clock.time();
        if clock.paused || clock.held || now < self.start {
            *self = Self {
                start: now,
                ..Self::default()
            };
            return;
        }
        self.seconds += real;
        if self.seconds >= Self::WINDOW {
            self.found = Some((now - self.start) / self.seconds);
            self.seconds = 0.0;
            self.start = now;
        }
    }

    /// The ratio, if the computer does not keep up: less than 95 % of the requested speed.
    fn slow(&self, clock: &SimulationClock) -> Option<f64> {
        self.found.filter(|pace| *pace < 0.95 * clock.speed)
    }
}

/// Shows the head-up line.
pub struct HudPlugin;

impl Plugin for HudPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<HeadUp>()
            .init_resource::<ViewSettings>()
            .init_resource::<Throughput>()
            .init_resource::<Followed>()
            .init_resource::<Activity>()
            .add_systems(Update, (measure_while_paused, refresh).chain())
            .add_systems(EguiPrimaryContextPass, show);
    }
}

/// Statistics are taken after ticks; this also counts bodies that are added while paused.
fn measure_while_paused(world: &mut World, new: &mut QueryState<(), Added<SoftBody>>) {
    let came = new.iter(world).next().is_some();
    if came && world.resource::<SimulationClock>().paused {
        let statistics = Statistics::measure(world);
        world.insert_resource(statistics);
    }
}

fn refresh(
    mut head_up: ResMut<HeadUp>,
    time: Res<Time<Real>>,
    statistics: Res<Statistics>,
    throughput: Res<Throughput>,
    (clock, activity): (Res<SimulationClock>, Res<Activity>),
    reference_overlay: Option<Res<ReferenceOverlay>>,
    followed: Res<Followed>,
) {
    head_up.frames += 1;
    head_up.times.push(&statistics);
    head_up.seconds += time.delta_secs();
    if activity.is_idle() {
        head_up.pace = Pace::default();
    } else {
        head_up.pace.pass(&clock, time.delta_secs_f64());
    }
    let slow = head_up.pace.slow(&clock);
    head_up.state = state(
        &clock,
        slow,
        reference_overlay.is_some_and(|reference_overlay| reference_overlay.holds()),
        &followed,
    );
    if head_up.seconds >= 1.0 / REFRESH || activity.is_idle() {
        let rate = head_up.frames as f32 / head_up.seconds;
        let rate = (!activity.is_idle()).then_some(rate);
        let shown = Statistics {
            ms_per_tick: head_up.times.find_median(),
            ..statistics.clone()
        };
        head_up.figures = figures(rate, &shown, throughput.per_second());
        head_up.frames = 0;
        head_up.seconds = 0.0;
    }
}

/// The exceptional state; `slow` is the measured speed if the computer does not keep up.
fn state(
    clock: &SimulationClock,
    slow: Option<f64>,
    reference_overlay_holds: bool,
    followed: &Followed,
) -> String {
    let mut parts = Vec::new();
    if clock.paused {
        parts.push("paused".to_owned());
    }
    if clock.speed != 1.0 {
        parts.push(format!("{}× speed", format(clock.speed, 2)));
    }
    if reference_overlay_holds {
        parts.push("waiting for the reference".to_owned());
    }
    if let Some(pace) = slow {
        parts.push(format!("running at {}× real time", format(pace, 2)));
    }
    if let Some((_, name)) = &followed.0 {
        parts.push(format!("following {name} (L to stop)"));
    }
    parts.join("  ·  ")
}

fn show(
    mut contexts: EguiContexts,
    head_up: Res<HeadUp>,
    mut view: ResMut<ViewSettings>,
) -> Result {
    if !head_up.figures.is_empty() {
        let context = contexts.ctx_mut()?;
        let free = area::free(context, &view);
        let height = draw(context, &head_up.figures, &head_up.state, free);
        if view.head_up_height != height {
            view.head_up_height = height;
        }
    }
    Ok(())
}

/// Draws the line in the upper left corner of the area that the panel leaves free. Returns the height
/// from the top of the window that it covers, without the badge of the state [logical px].
pub fn draw(context: &egui::Context, figures: &[Figure], state: &str, free: Rect) -> f32 {
    let margin = 10.0;
    let width = free.width() - 2.0 * margin;
    let mut cells = Vec::new();
    // Does not capture the pointer.
    let bottom = Area::new(Id::new("head-up line"))
        .order(Order::Background)
        .interactable(false)
        .fixed_pos(free.min + vec2(margin, margin))
        .constrain(false)
        .show(context, |ui| {
            ui.set_max_width(width);
            let frame = Frame::new()
                .fill(theme::of(ui).veil)
                .corner_radius(8.0)
                .inner_margin(Margin::symmetric(10, 5))
                .show(ui, |ui| cells = line(ui, figures, width - 20.0));
            if !state.is_empty() {
                badge(ui, state);
            }
            frame.response.rect.bottom() - context.content_rect().top()
        })
        .inner;
    tooltip(context, figures, &cells);
    bottom
}

/// Shows the tooltip of the figure under the pointer, after the usual delay. As the line does not
/// capture the pointer, egui does not know that it is hovered.
fn tooltip(context: &egui::Context, figures: &[Figure], cells: &[Rect]) {
    let id = Id::new("tooltip of the head-up line");
    let (at, is_down, rests) = context.input(|input| {
        let pointer = &input.pointer;
        let rests = pointer.time_since_last_movement();
        (pointer.hover_pos(), pointer.any_down(), rests)
    });
    let is_free = |at: &egui::Pos2| {
        let above = context.layer_id_at(*at);
        !is_down && above.is_none_or(|layer| layer.order == Order::Background)
    };
    let hovered = at
        .filter(is_free)
        .and_then(|at| cells.iter().position(|cell| cell.contains(at)));
    let was_shown = context.data(|data| data.get_temp::<bool>(id).unwrap_or(false));
    let delay = context.global_style().interaction.tooltip_delay;
    let shown = hovered.filter(|_| was_shown || rests >= delay);
    context.data_mut(|data| data.insert_temp(id, shown.is_some()));
    if hovered.is_some() && shown.is_none() {
        context.request_repaint_after(Duration::from_secs_f32((delay - rests).max(0.0)));
    }
    let (Some(figure), Some(cell)) = (
        shown.and_then(|index| figures.get(index)),
        shown.and_then(|index| cells.get(index)),
    ) else {
        return;
    };
    Area::new(id)
        .order(Order::Tooltip)
        .interactable(false)
        .fade_in(false)
        .fixed_pos(cell.left_bottom() + vec2(0.0, 8.0))
        .show(context, |ui| {
            Frame::popup(&context.global_style()).show(ui, |ui| {
                ui.set_max_width(theme::TOOLTIP);
                ui.label(RichText::new(figure.title).strong());
                ui.label(&figure.help);
                for (part, value) in &figure.parts {
                    ui.horizontal(|ui| {
                        ui.label(RichText::new(*part).color(theme::of(ui).weak));
                        let end = Layout::right_to_left(egui::Align::Center);
                        ui.with_layout(end, |ui| ui.label(RichText::new(value).monospace()));
                    });
                }
            });
        });
}

/// Draws the figures in as many rows as they need, and returns their places.
fn line(ui: &mut egui::Ui, figures: &[Figure], width: f32) -> Vec<Rect> {
    let most = ((width / CELL) as usize).clamp(1, figures.len());
    // The same number of figures in each row, so that the last one is not nearly empty.
    let a_row = figures.len().div_ceil(figures.len().div_ceil(most));
    ui.spacing_mut().item_spacing = vec2(0.0, 4.0);
    let mut cells = Vec::new();
    for row in figures.chunks(a_row) {
        ui.horizontal(|ui| cells.extend(row.iter().map(|figure| cell(ui, figure))));
    }
    cells
}

fn cell(ui: &mut egui::Ui, figure: &Figure) -> Rect {
    let layout = Layout::top_down(egui::Align::Min);
    let cell = ui.allocate_ui_with_layout(vec2(CELL, 28.0), layout, |ui| {
        ui.set_min_width(CELL);
        ui.spacing_mut().item_spacing.y = 0.0;
        let color = if figure.alarm {
            theme::of(ui).alarm
        } else {
            theme::of(ui).strong
        };
        let value = RichText::new(&figure.value).monospace().color(color);
        ui.add(Label::new(value).extend());
        let name = RichText::new(figure.name).small().color(theme::of(ui).weak);
        ui.add(Label::new(name).extend());
    });
    cell.response.rect
}

fn badge(ui: &mut egui::Ui, state: &str) {
    ui.add_space(4.0);
    Frame::new()
        .fill(theme::of(ui).veil)
        .corner_radius(8.0)
        .inner_margin(Margin::symmetric(10, 3))
        .show(ui, |ui| {
            ui.label(RichText::new(state).color(theme::of(ui).changed));
        });
}

#[cfg(test)]
mod tests {
    use crate::sandbox::{panel::hud::*, state::display::Theme};

    #[test]
    fn what_is_out_of_the_ordinary_is_said() {
        let mut clock = SimulationClock::default();
        assert_eq!(state(&clock, None, false, &Followed(None)), "");
        let slow = "running at 0.45× real time";
        let not_following = &Followed(None);
        assert_eq!(state(&clock, Some(0.451), false, not_following), slow);
        clock.paused = true;
        clock.speed = 0.1;
        assert_eq!(
            state(&clock, None, false, not_following),
            "paused  ·  0.1× speed"
        );
        assert_eq!(
            state(&clock, None, true, not_following),
            "paused  ·  0.1× speed  ·  waiting for the reference"
        );
        let bunny = Followed(Some((Entity::PLACEHOLDER, "bunny".to_owned())));
        let clock = SimulationClock::default();
        assert_eq!(
            state(&clock, None, false, &bunny),
            "following bunny (L to stop)"
        );
    }

    /// A line over an empty view, with a pointer.
    struct Line {
        context: egui::Context,
        frames: u32,
    }

    impl Line {
        /// Draws a frame after 0.1 s, and returns all texts in it.
        fn draw(&mut self, events: Vec<egui::Event>) -> Vec<String> {
            let screen = Rect::from_min_size(egui::Pos2::ZERO, vec2(1000.0, 600.0));
            self.frames += 1;
            let input = egui::RawInput {
                screen_rect: Some(screen),
                time: Some(f64::from(self.frames) * 0.1),
                events,
                ..egui::RawInput::default()
            };
            let figures = figures(Some(60.0), &Statistics::default(), None);
            let output = self.context.run_ui(input, |ui| {
                draw(ui.ctx(), &figures, "", screen);
            });
            let texts = output
                .shapes
                .iter()
                .filter_map(|clipped| match &clipped.shape {
                    egui::Shape::Text(text) => Some(text.galley.text().to_owned()),
                    _ => None,
                });
            let texts = texts.collect();
            output.drop_without_applying_deltas();
            texts
        }
    }

    #[test]
    fn a_figure_under_a_resting_pointer_has_a_tooltip_and_the_pointer_stays_free() {
        let mut line = Line {
            context: egui::Context::default(),
            frames: 0,
        };
        theme::apply(&line.context, Theme::Dark);
        (0..3).for_each(|_| drop(line.draw(Vec::new())));
        for (x, title) in [(30.0, "Frame rate"), (420.0, "Energy")] {
            let at = egui::pos2(x, 26.0);
            let moved = line.draw(vec![egui::Event::PointerMoved(at)]);
            let is_first = title == "Frame rate";
            // Another tooltip is open already for the second, which needs no delay.
            assert_eq!(
                moved.iter().any(|text| text == title),
                !is_first,
                "{moved:?}"
            );
            let mut rested = Vec::new();
            (0..6).for_each(|_| rested = line.draw(Vec::new()));
            assert!(rested.iter().any(|text| text == title), "{rested:?}");
            assert!(
                !line.context.egui_wants_pointer_input(),
                "a drag may begin here"
            );
        }
        let press = egui::Event::PointerButton {
            pos: egui::pos2(420.0, 26.0),
            button: egui::PointerButton::Primary,
            pressed: true,
            modifiers: egui::Modifiers::NONE,
        };
        line.draw(vec![press]);
        let dragging = line.draw(Vec::new());
        assert!(
            !dragging.iter().any(|text| text == "Energy"),
            "{dragging:?}"
        );
        assert!(!line.context.egui_wants_pointer_input(), "a drag goes on");
    }
}
