//! The diagram: milliseconds per tick across, error in per cent upwards, both logarithmic.

use crate::{
    sandbox::ui::{format, theme},
    study::{ProbePoint, Setting, pareto},
};
use bevy_egui::egui::{
    Align2, Color32, FontSelection, Painter, Pos2, Rect, Response, Sense, Shape, Stroke, TextStyle,
    Ui, pos2, vec2,
};

/// Heights and widths around the field of the diagram [logical px].
const LEFT: f32 = 46.0;
const BELOW: f32 = 32.0;
const HEIGHT: f32 = 190.0;
/// How near the pointer has to be to a dot [logical px].
const REACH: f32 = 9.0;

/// A setting with what it costs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dot {
    /// Substeps and iterations.
    pub setting: (u32, u32),
    /// Least, median and most time of a tick on one thread [ms].
    pub milliseconds: (f64, f64, f64),
    /// Distance to the reference over the body's size; not finite if the body diverged.
    pub error: f64,
}

impl Dot {
    /// Of a point, at so many ticks a second.
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

    /// Whether the body came through.
    #[must_use]
    pub fn sound(&self) -> bool {
        self.error.is_finite() && self.error > 0.0 && self.error < 1e3
    }
}

/// How dots of so many iterations are drawn: form and colour, of Okabe and Ito's that the
/// colour-blind can tell.
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
    /// All, with what the legend calls them.
    pub const ALL: [(Self, &'static str); 4] = [
        (Self::Circle, "1"),
        (Self::Square, "2"),
        (Self::Diamond, "4"),
        (Self::Triangle, "8, 16 iterations"),
    ];

    /// For so many iterations a substep.
    #[must_use]
    pub const fn of(iterations: u32) -> Self {
        match iterations {
            0..=1 => Self::Circle,
            2..=3 => Self::Square,
            4..=7 => Self::Diamond,
            _ => Self::Triangle,
        }
    }

    const fn colour(self) -> Color32 {
        match self {
            Self::Circle => Color32::from_rgb(86, 180, 233),
            Self::Square => Color32::from_rgb(230, 159, 0),
            Self::Diamond => Color32::from_rgb(0, 178, 135),
            Self::Triangle => Color32::from_rgb(204, 121, 167),
        }
    }

    /// Draws it around a point.
    pub fn paint(self, painter: &Painter, at: Pos2) {
        let colour = self.colour();
        let polygon = |points: &[(f32, f32)]| {
            let points = points.iter().map(|&(x, y)| at + vec2(x, y)).collect();
            Shape::convex_polygon(points, colour, Stroke::NONE)
        };
        painter.add(match self {
            Self::Circle => Shape::circle_filled(at, 4.0, colour),
            Self::Square => polygon(&[(-3.6, -3.6), (3.6, -3.6), (3.6, 3.6), (-3.6, 3.6)]),
            Self::Diamond => polygon(&[(0.0, -5.2), (5.2, 0.0), (0.0, 5.2), (-5.2, 0.0)]),
            Self::Triangle => polygon(&[(0.0, -5.0), (4.8, 3.6), (-4.8, 3.6)]),
        });
    }
}

/// A logarithmic axis.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Axis {
    /// Powers of ten at its ends.
    decades: (i32, i32),
    /// Where they are [logical px].
    ends: (f32, f32),
}

impl Axis {
    /// Around all values, at least a decade.
    fn around(values: impl Iterator<Item = f64>, ends: (f32, f32)) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for power in values.map(f64::log10) {
            low = low.min(power);
            high = high.max(power);
        }
        if low > high {
            (low, high) = (-2.0, 0.0);
        }
        let (first, mut last) = (low.floor() as i32, high.ceil() as i32);
        last = last.max(first + 1);
        Self {
            decades: (first, last),
            ends,
        }
    }

    fn at(&self, value: f64) -> f32 {
        let (first, last) = (f64::from(self.decades.0), f64::from(self.decades.1));
        let share = ((value.log10() - first) / (last - first)).clamp(0.0, 1.0) as f32;
        self.ends.0 + share * (self.ends.1 - self.ends.0)
    }

    fn ticks(&self) -> impl Iterator<Item = f64> {
        (self.decades.0..=self.decades.1).map(|power| 10_f64.powi(power))
    }
}

/// Draws the diagram over the whole width; returns what it takes of the pointer, and the place of
/// the dot that the pointer is at.
pub fn draw(
    ui: &mut Ui,
    dots: &[Dot],
    here: (u32, u32),
    uncertainty: f64,
) -> (Response, Option<usize>) {
    let size = vec2(ui.available_width(), HEIGHT);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    let field = Rect::from_min_max(
        pos2(rect.left() + LEFT, rect.top() + 8.0),
        pos2(rect.right() - 10.0, rect.bottom() - BELOW),
    );
    let painter = ui.painter().with_clip_rect(rect);
    let sound = || dots.iter().filter(|dot| dot.sound());
    let across = Axis::around(
        sound().map(|dot| dot.milliseconds.1),
        (field.left(), field.right()),
    );
    let upwards = Axis::around(
        sound().map(|dot| dot.error * 100.0),
        (field.bottom(), field.top()),
    );
    let font = FontSelection::Style(TextStyle::Small).resolve(ui.style());
    painter.rect_filled(field, 2.0, theme::SUNKEN);
    let line = Stroke::new(1.0, theme::LINE);
    for tick in across.ticks() {
        let x = across.at(tick);
        painter.vline(x, field.y_range(), line);
        let at = pos2(x, field.bottom() + 3.0);
        painter.text(
            at,
            Align2::CENTER_TOP,
            format(tick, 3),
            font.clone(),
            theme::WEAK,
        );
    }
    for tick in upwards.ticks() {
        let y = upwards.at(tick);
        painter.hline(field.x_range(), y, line);
        let at = pos2(field.left() - 5.0, y);
        let text = format!("{} %", format(tick, 3));
        painter.text(at, Align2::RIGHT_CENTER, text, font.clone(), theme::WEAK);
    }
    let below = pos2(field.center().x, rect.bottom());
    let title = "time per tick [ms], one thread";
    painter.text(
        below,
        Align2::CENTER_BOTTOM,
        title,
        font.clone(),
        theme::TEXT,
    );
    if uncertainty > 0.0 && !dots.is_empty() {
        let top = upwards.at(uncertainty * 100.0);
        let unsure = Rect::from_x_y_ranges(field.x_range(), top..=field.bottom());
        painter.rect_filled(unsure, 0.0, theme::WEAK.gamma_multiply(0.16));
        if unsure.height() > 14.0 {
            let at = unsure.right_bottom() - vec2(4.0, 2.0);
            let text = "below the reference's own uncertainty";
            painter.text(at, Align2::RIGHT_BOTTOM, text, font, theme::WEAK);
        }
    }
    let place = |dot: &Dot| {
        let y = if dot.sound() {
            upwards.at(dot.error * 100.0)
        } else {
            field.top()
        };
        pos2(across.at(dot.milliseconds.1), y)
    };
    let costs: Vec<_> = dots
        .iter()
        .map(|dot| (dot.milliseconds.1, dot.error))
        .collect();
    let front = pareto::front(&costs)
        .into_iter()
        .filter(|&at| dots[at].sound());
    let front = front.map(|at| place(&dots[at])).collect();
    painter.add(Shape::line(front, Stroke::new(1.2, theme::TICK)));
    for dot in dots {
        let at = place(dot);
        if dot.sound() {
            Marker::of(dot.setting.1).paint(&painter, at);
        } else {
            let stroke = Stroke::new(1.6, theme::ALARM);
            painter.line_segment([at + vec2(-4.0, -4.0), at + vec2(4.0, 4.0)], stroke);
            painter.line_segment([at + vec2(-4.0, 4.0), at + vec2(4.0, -4.0)], stroke);
        }
    }
    if let Some(dot) = dots.iter().find(|dot| dot.setting == here) {
        painter.circle_stroke(place(dot), 8.0, Stroke::new(1.8, theme::STRONG));
    }
    let near = response.hover_pos().and_then(|pointer| {
        let distance = |at: &usize| place(&dots[*at]).distance(pointer);
        let nearest = (0..dots.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.filter(|at| distance(at) <= REACH)
    });
    if let Some(near) = near {
        painter.circle_stroke(place(&dots[near]), 8.0, Stroke::new(1.0, theme::ACCENT));
    }
    (response, near)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_has_its_values_between_its_ends() {
        let axis = Axis::around([0.03, 4.0].into_iter(), (10.0, 110.0));
        assert_eq!(axis.decades, (-2, 1));
        assert_eq!(axis.ticks().count(), 4);
        assert_eq!((axis.at(0.01), axis.at(10.0)), (10.0, 110.0));
        assert!((axis.at(1.0) - (10.0 + 200.0 / 3.0)).abs() < 1e-4);
    }

    #[test]
    fn an_axis_without_values_is_still_one() {
        let axis = Axis::around(std::iter::empty(), (0.0, 1.0));
        assert_eq!(axis.decades, (-2, 0));
    }
}
