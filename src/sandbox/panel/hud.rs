//! The head-up line: cost and state of the simulation, over the view.
//!
//! The figures are those of [`Statistics`], the same as in the CSV; the frame rate and the
//! [`Throughput`] are measured by the window. They are updated a few times per second to remain
//! legible.

use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{self, Area, Frame, Id, Label, Layout, Margin, Order, Rect, RichText, vec2},
};

use crate::sandbox::{
    lab::{reference_overlay::ReferenceOverlay, throughput::Throughput},
    state::view::{Followed, ViewSettings},
    ui::{area, count, format, theme},
};
use crate::simulation::{SimulationClock, SoftBody, Statistics, statistics};

/// Update rate of the figures [1/s].
const REFRESH: f32 = 5.0;
/// Width of a figure [logical px].
const CELL: f32 = 74.0;

/// A figure of the line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Figure {
    /// The number with its unit.
    pub value: String,
    /// Label.
    pub name: &'static str,
    /// Whether it indicates a problem.
    pub alarm: bool,
}

/// Content of the line.
#[derive(Resource, Debug, Default)]
pub struct HeadUp {
    figures: Vec<Figure>,
    /// Exceptional state, such as paused or slow; empty otherwise.
    state: String,
    frames: u32,
    seconds: f32,
    pace: Pace,
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
            .add_systems(Update, (measure_while_paused, refresh).chain())
            .add_systems(EguiPrimaryContextPass, show);
    }
}

/// Statistics are taken after ticks; this also counts bodies that are added while paused.
fn measure_while_paused(world: &mut World, new: &mut QueryState<(), Added<SoftBody>>) {
    let came = new.iter(world).next().is_some();
    if came && world.resource::<SimulationClock>().paused {
        let statistics = statistics::measure(world);
        world.insert_resource(statistics);
    }
}

fn refresh(
    mut head_up: ResMut<HeadUp>,
    time: Res<Time<Real>>,
    statistics: Res<Statistics>,
    throughput: Res<Throughput>,
    clock: Res<SimulationClock>,
    reference_overlay: Option<Res<ReferenceOverlay>>,
    followed: Res<Followed>,
) {
    head_up.frames += 1;
    head_up.seconds += time.delta_secs();
    head_up.pace.pass(&clock, time.delta_secs_f64());
    let slow = head_up.pace.slow(&clock);
    head_up.state = state(
        &clock,
        slow,
        reference_overlay.is_some_and(|reference_overlay| reference_overlay.holds()),
        &followed,
    );
    if head_up.seconds >= 1.0 / REFRESH {
        let rate = head_up.frames as f32 / head_up.seconds;
        head_up.figures = figures(rate, &statistics, throughput.per_second());
        head_up.frames = 0;
        head_up.seconds = 0.0;
    }
}

/// The figures of the line, in order; `projections` are per second.
pub fn figures(
    frames_per_second: f32,
    statistics: &Statistics,
    projections: Option<f64>,
) -> Vec<Figure> {
    let figure = |value: String, name| Figure {
        value,
        name,
        alarm: false,
    };
    vec![
        figure(format!("{frames_per_second:.0} fps"), "frame rate"),
        figure(format!("{:.2} ms", statistics.ms_per_tick), "per tick"),
        figure(count(statistics.particles), "particles"),
        figure(count(statistics.constraint_count()), "constraints"),
        figure(millions(projections), "projections"),
        figure(prefixed(statistics.energy(), "J"), "energy"),
        figure(percent(statistics.volume_error), "volume error"),
        Figure {
            alarm: !statistics.finite,
            ..figure(format(statistics.residual, 2), "residual")
        },
    ]
}

/// Projections per second in millions; a dash if there are none, which keeps the layout.
pub fn millions(projections: Option<f64>) -> String {
    projections.map_or_else(
        || "–".to_owned(),
        |projections| format!("{} M/s", format(projections / 1e6, 3)),
    )
}

/// A quantity with three digits and an SI prefix: `1.25 mJ`.
fn prefixed(value: f64, unit: &str) -> String {
    const PREFIXES: [(f64, &str); 7] = [
        (1e9, "G"),
        (1e6, "M"),
        (1e3, "k"),
        (1.0, ""),
        (1e-3, "m"),
        (1e-6, "µ"),
        (1e-9, "n"),
    ];
    let size = value.abs();
    match PREFIXES.iter().find(|(factor, _)| size >= *factor) {
        Some((factor, prefix)) => format!("{} {prefix}{unit}", format(value / factor, 3)),
        None => format!("0 {unit}"),
    }
}

/// A ratio in per cent with its sign, to 0.01 %.
fn percent(ratio: f64) -> String {
    let percent = ratio * 100.0;
    if percent.abs() < 0.005 {
        "0 %".to_owned()
    } else {
        format!("{percent:+.2} %")
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
    // Does not capture the pointer.
    Area::new(Id::new("head-up line"))
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
                .show(ui, |ui| line(ui, figures, width - 20.0));
            if !state.is_empty() {
                badge(ui, state);
            }
            frame.response.rect.bottom() - context.content_rect().top()
        })
        .inner
}

fn line(ui: &mut egui::Ui, figures: &[Figure], width: f32) {
    let most = ((width / CELL) as usize).clamp(1, figures.len());
    // The same number of figures in each row, so that the last one is not nearly empty.
    let a_row = figures.len().div_ceil(figures.len().div_ceil(most));
    ui.spacing_mut().item_spacing = vec2(0.0, 4.0);
    for row in figures.chunks(a_row) {
        ui.horizontal(|ui| {
            for figure in row {
                cell(ui, figure);
            }
        });
    }
}

fn cell(ui: &mut egui::Ui, figure: &Figure) {
    let layout = Layout::top_down(egui::Align::Min);
    ui.allocate_ui_with_layout(vec2(CELL, 28.0), layout, |ui| {
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
    use crate::sandbox::panel::hud::*;

    #[test]
    fn the_line_has_the_eight_figures_with_their_units() {
        let statistics = Statistics {
            ms_per_tick: 1.236,
            particles: 12_288,
            kinetic: 12.0,
            potential: 0.345,
            volume_error: -0.001_24,
            residual: 1.24e-5,
            finite: true,
            ..Statistics::default()
        };
        let values: Vec<_> = figures(59.7, &statistics, Some(212.34e6))
            .into_iter()
            .map(|figure| figure.value)
            .collect();
        let wanted = [
            "60 fps", "1.24 ms", "12 288", "0", "212 M/s", "12.3 J", "-0.12 %", "1.2e-5",
        ];
        assert_eq!(values, wanted);
    }

    #[test]
    fn no_projections_are_a_dash() {
        assert_eq!(millions(None), "–");
        assert_eq!(millions(Some(0.834e6)), "0.834 M/s");
    }

    #[test]
    fn an_energy_has_the_prefix_of_its_size() {
        assert_eq!(prefixed(-1.254e-3, "J"), "-1.25 mJ");
        assert_eq!(prefixed(0.0, "J"), "0 J");
        assert_eq!(prefixed(98_100.0, "J"), "98.1 kJ");
    }

    #[test]
    fn what_is_out_of_the_ordinary_is_said() {
        let mut clock = SimulationClock::default();
        assert_eq!(state(&clock, None, false, &Followed(None)), "");
        let slow = "running at 0.45× real time";
        let nobody = &Followed(None);
        assert_eq!(state(&clock, Some(0.451), false, nobody), slow);
        clock.paused = true;
        clock.speed = 0.1;
        assert_eq!(state(&clock, None, false, nobody), "paused  ·  0.1× speed");
        assert_eq!(
            state(&clock, None, true, nobody),
            "paused  ·  0.1× speed  ·  waiting for the reference"
        );
        let bunny = Followed(Some((Entity::PLACEHOLDER, "bunny".to_owned())));
        let clock = SimulationClock::default();
        assert_eq!(
            state(&clock, None, false, &bunny),
            "following bunny (L to stop)"
        );
    }
}
