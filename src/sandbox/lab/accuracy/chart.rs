//! The diagram: error in per cent over milliseconds per tick, both logarithmic.

use crate::{
    sandbox::ui::{format, plot, theme},
    study::{ProbePoint, Setting, pareto},
};
use bevy_egui::egui::{
    Align2, Color32, FontSelection, Painter, Pos2, Response, Sense, Shape, Stroke, TextStyle, Ui,
    Vec2b, vec2,
};
use egui_plot::{
    Axis, AxisHints, GridMark, Line, MarkerShape, PlotPoint, Points, Span, VPlacement,
};

/// Height of the diagram [logical px].
const HEIGHT: f32 = 190.0;
/// Maximum distance of the pointer from a dot [logical px].
const REACH: f32 = 9.0;

/// A setting with its time and error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dot {
    /// Substeps and iterations.
    pub setting: (u32, u32),
    /// Minimum, median and maximum time of a tick on one thread [ms].
    pub milliseconds: (f64, f64, f64),
    /// Distance to the reference over the body's size; not finite if the body diverged.
    pub error: f64,
}

impl Dot {
    /// The dot of a point, at `rate` ticks per second.
    #[must_use]
    pub fn new(point: &ProbePoint, rate: f64) -> Self {
        let Setting {
            substeps,
            iterations,
            ..
        } = point.setting;
        let time = point.ms_per_second;
        Self {
            setting: (substeps, iterations),
            milliseconds: (time.low / rate, time.median / rate, time.high / rate),
            error: point.error,
        }
    }

    /// Whether the body did not diverge.
    #[must_use]
    pub fn sound(&self) -> bool {
        self.error.is_finite() && self.error > 0.0 && self.error < 1e3
    }
}

/// Marker of dots by their number of iterations: shape, and color from Okabe and Ito's palette for
/// the color-blind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Marker {
    /// One iteration.
    Circle,
    /// Two or three.
    Square,
    /// Four to seven.
    Diamond,
    /// Eight and more.
    Triangle,
}

impl Marker {
    /// All markers, with their labels in the legend.
    pub const ALL: [(Self, &'static str); 4] = [
        (Self::Circle, "1"),
        (Self::Square, "2"),
        (Self::Diamond, "4"),
        (Self::Triangle, "8, 16 iterations"),
    ];

    /// The marker for a number of iterations per substep.
    #[must_use]
    pub const fn of(iterations: u32) -> Self {
        match iterations {
            0..=1 => Self::Circle,
            2..=3 => Self::Square,
            4..=7 => Self::Diamond,
            _ => Self::Triangle,
        }
    }

    /// Fill of the marker.
    #[must_use]
    pub const fn color(self) -> Color32 {
        match self {
            Self::Circle => Color32::from_rgb(86, 180, 233),
            Self::Square => Color32::from_rgb(230, 159, 0),
            Self::Diamond => Color32::from_rgb(0, 178, 135),
            Self::Triangle => Color32::from_rgb(204, 121, 167),
        }
    }

    /// Draws the marker around a point, for a legend.
    pub fn paint(self, painter: &Painter, at: Pos2) {
        let polygon = |points: &[(f32, f32)]| {
            let points = points.iter().map(|&(x, y)| at + vec2(x, y)).collect();
            Shape::convex_polygon(points, self.color(), Stroke::NONE)
        };
        painter.add(match self {
            Self::Circle => Shape::circle_filled(at, 4.0, self.color()),
            Self::Square => polygon(&[(-3.6, -3.6), (3.6, -3.6), (3.6, 3.6), (-3.6, 3.6)]),
            Self::Diamond => polygon(&[(0.0, -5.2), (5.2, 0.0), (0.0, 5.2), (-5.2, 0.0)]),
            Self::Triangle => polygon(&[(0.0, -5.0), (4.8, 3.6), (-4.8, 3.6)]),
        });
    }

    const fn shape(self) -> MarkerShape {
        match self {
            Self::Circle => MarkerShape::Circle,
            Self::Square => MarkerShape::Square,
            Self::Diamond => MarkerShape::Diamond,
            Self::Triangle => MarkerShape::Up,
        }
    }
}

/// Exponents of the powers of ten that enclose all values; at least one decade.
fn decades(values: impl Iterator<Item = f64>) -> (i32, i32) {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for power in values.map(f64::log10) {
        low = low.min(power);
        high = high.max(power);
    }
    if low > high {
        (low, high) = (-2.0, 0.0);
    }
    let (first, last) = (low.floor() as i32, high.ceil() as i32);
    (first, last.max(first + 1))
}

/// A grid line per power of ten.
fn marks((first, last): (i32, i32)) -> Vec<GridMark> {
    let marks = (first..=last).map(|power| GridMark {
        value: f64::from(power),
        step_size: 1.0,
    });
    marks.collect()
}

/// Draws the diagram over the whole width; returns its response, and the index of the dot under
/// the pointer.
pub fn draw(
    ui: &mut Ui,
    dots: &[Dot],
    current: (u32, u32),
    uncertainty: f64,
) -> (Response, Option<usize>) {
    let sound = || dots.iter().filter(|dot| dot.sound());
    let across = decades(sound().map(|dot| dot.milliseconds.1));
    let upwards = decades(sound().map(|dot| dot.error * 100.0));
    // Diverged settings are drawn at the top.
    let place = |dot: &Dot| {
        let y = if dot.sound() {
            (dot.error * 100.0).log10()
        } else {
            f64::from(upwards.1)
        };
        [dot.milliseconds.1.log10(), y]
    };
    let colors = theme::of(ui);
    let font = FontSelection::Style(TextStyle::Small).resolve(ui.style());
    let power = |mark: GridMark| format(10_f64.powf(mark.value), 3);
    let hints = |axis: AxisHints<'static>| {
        axis.tick_label_color(colors.weak)
            .tick_label_font(font.clone())
    };
    let plot = plot::fixed("accuracy vs. cost", HEIGHT)
        .label_formatter(|_| None)
        .sense(Sense::click())
        .grid_color(colors.line)
        .x_grid_spacer(|_| marks(across))
        .y_grid_spacer(|_| marks(upwards))
        .custom_x_axes(vec![
            hints(AxisHints::new_x())
                .label("time per tick [ms], one thread")
                .placement(VPlacement::Bottom)
                .formatter(move |mark, _| power(mark)),
        ])
        .custom_y_axes(vec![
            hints(AxisHints::new_y()).formatter(move |mark, _| format!("{} %", power(mark))),
        ]);
    let shown = plot.show(ui, |plot| {
        plot.set_auto_bounds(Vec2b::FALSE);
        // A margin of half a marker, for dots on the frame.
        let around = |(first, last): (i32, i32)| f64::from(first) - 0.05..=f64::from(last) + 0.05;
        plot.set_plot_bounds_x(around(across));
        plot.set_plot_bounds_y(around(upwards));
        if uncertainty > 0.0 && !dots.is_empty() {
            let below = f64::from(upwards.0) - 1.0..=(uncertainty * 100.0).log10();
            let span = Span::new("below the reference's own uncertainty", below)
                .axis(Axis::Y)
                .fill(colors.weak.gamma_multiply(0.16))
                .label_align(Align2::RIGHT_TOP);
            plot.add(span);
        }
        let costs: Vec<_> = dots
            .iter()
            .map(|dot| (dot.milliseconds.1, dot.error))
            .collect();
        let front = pareto::front(&costs).into_iter();
        let front = front.filter(|&at| dots[at].sound());
        let front: Vec<_> = front.map(|at| place(&dots[at])).collect();
        plot.line(Line::new("front", front).stroke(Stroke::new(1.2, colors.tick)));
        for (marker, name) in Marker::ALL {
            let of = sound().filter(|dot| Marker::of(dot.setting.1) == marker);
            let points = Points::new(name, of.map(place).collect::<Vec<_>>());
            plot.points(
                points
                    .shape(marker.shape())
                    .radius(4.5)
                    .color(marker.color()),
            );
        }
        let diverged = dots.iter().filter(|dot| !dot.sound());
        let diverged = Points::new("diverged", diverged.map(place).collect::<Vec<_>>());
        let cross = diverged.shape(MarkerShape::Cross).radius(4.5);
        plot.points(cross.color(colors.alarm));
        let ring = |name: &'static str, dot: &Dot, color| {
            let ring = Points::new(name, vec![place(dot)]).filled(false);
            ring.radius(8.0).color(color)
        };
        if let Some(dot) = dots.iter().find(|dot| dot.setting == current) {
            plot.points(ring("current", dot, colors.strong));
        }
        let pointer = plot.response().hover_pos()?;
        let distance = |at: &usize| {
            let [x, y] = place(&dots[*at]);
            plot.screen_from_plot(PlotPoint::new(x, y))
                .distance(pointer)
        };
        let nearest = (0..dots.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let near = nearest.filter(|at| distance(at) <= REACH)?;
        plot.points(ring("pointer", &dots[near], colors.accent));
        Some(near)
    });
    (shown.response, shown.inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_has_its_values_between_its_ends() {
        assert_eq!(decades([0.03, 4.0].into_iter()), (-2, 1));
        assert_eq!(marks((-2, 1)).len(), 4);
    }

    #[test]
    fn an_axis_has_at_least_a_decade() {
        assert_eq!(decades([10.0].into_iter()), (1, 2));
        assert_eq!(decades(std::iter::empty()), (-2, 0));
    }
}
