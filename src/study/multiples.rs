//! Small multiples of work and precision: one diagram of error over cost for each problem, all with
//! the same axes, marks and colors, as HTML for the beginning of a report.

use super::{
    Study,
    numbers::{TARGETS, number, percent},
    overview::cost_words,
    results::{CaseResult, Point, ProblemResult},
    setting::Method,
};
use crate::output::page::escaped;
use std::fmt::Write;

/// Width and height of a diagram, in units of its drawing.
const SIZE: (f64, f64) = (300.0, 216.0);
/// Left, right, upper and lower edge of the plot area.
const PLOT: (f64, f64, f64, f64) = (46.0, 294.0, 8.0, 172.0);
/// Decades of the error [%] that are drawn at most; what is outside is drawn at the edge.
const ERRORS: (i32, i32) = (-3, 3);

/// Axes that all diagrams share, in decades.
struct Axes {
    cost: (i32, i32),
    error: (i32, i32),
}

impl Axes {
    /// Axes that contain all drawn points.
    fn of(study: &Study) -> Self {
        let cases = study
            .problems
            .iter()
            .filter_map(ProblemResult::finest_with_errors);
        let points: Vec<(f64, f64)> = cases.flat_map(drawn).map(|(place, _)| place).collect();
        let decades = |values: &mut dyn Iterator<Item = f64>| {
            let logs = values.map(f64::log10).filter(|log| log.is_finite());
            let (low, high) = logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), log| {
                (low.min(log), high.max(log))
            });
            let low = if low.is_finite() {
                low.floor() as i32
            } else {
                0
            };
            let high = if high.is_finite() {
                high.ceil() as i32
            } else {
                0
            };
            (low, high.max(low + 1))
        };
        let error = decades(&mut points.iter().map(|point| point.1));
        Self {
            cost: decades(&mut points.iter().map(|point| point.0)),
            // The line of 1 % is always in sight.
            error: (error.0.clamp(ERRORS.0, -1), error.1.clamp(1, ERRORS.1)),
        }
    }

    fn x(&self, cost: f64) -> f64 {
        along(cost.log10(), self.cost, (PLOT.0, PLOT.1))
    }

    fn y(&self, error: f64) -> f64 {
        along(error.log10(), self.error, (PLOT.3, PLOT.2))
    }
}

/// Place of a logarithm between two edges; beyond them, at the edge.
fn along(log: f64, (low, high): (i32, i32), (from, to): (f64, f64)) -> f64 {
    let fraction = (log - f64::from(low)) / f64::from(high - low);
    from + fraction.clamp(0.0, 1.0) * (to - from)
}

/// Points with a cost [ms per simulated second] and an error [%].
fn drawn(case: &CaseResult) -> impl Iterator<Item = ((f64, f64), &Point)> {
    case.points.iter().filter_map(|point| {
        let error = point.error.filter(|error| error.is_finite())?;
        Some(((point.ms?.median, error * 100.0), point))
    })
}

/// The legend of all diagrams.
pub(super) fn legend(study: &Study) -> String {
    let points = study.problems.iter().flat_map(|problem| &problem.cases);
    let points: Vec<&Point> = points.flat_map(|case| &case.points).collect();
    let used = |method: &Method| points.iter().any(|point| point.setting.method == *method);
    let mut html = "<div class=\"legend\">".to_owned();
    let mut entry = |content: &str, words: &str| {
        // Writing to a string cannot fail.
        let _ = write!(
            html,
            "<span><svg class=\"curve\" width=\"26\" height=\"14\" aria-hidden=\"true\">{content}</svg>{words}</span>"
        );
    };
    for method in Method::ALL.into_iter().filter(used) {
        entry(&mark((13.0, 7.0), method, true), method.name());
    }
    entry(
        &mark((13.0, 7.0), Method::Xpbd, false),
        "hollow: did not settle",
    );
    entry(
        "<path class=\"front\" d=\"M1 2L12 10L25 12\"/>",
        "Pareto front",
    );
    entry("<path class=\"target\" d=\"M1 7H25\"/>", "error of 1 %");
    entry(
        "<circle class=\"choice\" cx=\"13\" cy=\"7\" r=\"6\"/>",
        "cheapest setting within 1 %",
    );
    html + "</div>"
}

/// A diagram for each problem, each with a link to its details.
pub(super) fn html(study: &Study) -> String {
    let axes = Axes::of(study);
    let mut html = "<div class=\"multiples\">\n".to_owned();
    for problem in &study.problems {
        let case = problem.finest_with_errors();
        let words = case.map_or_else(
            || "No errors: no converged solution.".to_owned(),
            |case| match case.cheapest_sound(TARGETS[1]) {
                Some(point) => format!("1\u{a0}%: {}", cost_words(point)),
                None => match case.best_sound().and_then(|best| best.error) {
                    Some(error) => format!("1\u{a0}% not reached (best {})", percent(error)),
                    None => "1\u{a0}% not reached".to_owned(),
                },
            },
        );
        let picture = case.map(|case| diagram(&axes, &problem.problem.title, case));
        let _ = writeln!(
            html,
            "<figure><figcaption><a href=\"#{}\">{}</a>{}</figcaption>{}</figure>",
            anchor(problem),
            escaped(&problem.problem.title),
            escaped(&words),
            picture.unwrap_or_default()
        );
    }
    html + "</div>"
}

/// The target of links to a problem.
pub(super) fn anchor(problem: &ProblemResult) -> String {
    let name = problem.problem.name.chars();
    let safe = name.map(|c| {
        if c.is_alphanumeric() || c == '-' {
            c
        } else {
            '_'
        }
    });
    format!("problem-{}", safe.collect::<String>())
}

fn diagram(axes: &Axes, title: &str, case: &CaseResult) -> String {
    let (left, right, top, bottom) = PLOT;
    let mut svg = format!(
        "<svg class=\"curve\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}: error over cost\">",
        SIZE.0,
        SIZE.1,
        escaped(title)
    );
    let grid = grid(axes);
    let level = axes.y(1.0);
    let _ = write!(
        svg,
        "{grid}<path class=\"target\" d=\"M{left} {level:.1}H{right}\"/>\
         <text class=\"label\" x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">1 %</text>",
        right - 2.0,
        level - 4.0
    );
    let front: Vec<String> = case
        .front()
        .iter()
        .filter_map(|point| Some((point.ms?.median, point.error? * 100.0)))
        .map(|(cost, error)| format!("{:.1} {:.1}", axes.x(cost), axes.y(error)))
        .collect();
    let _ = write!(svg, "<path class=\"front\" d=\"M{}\"/>", front.join("L"));
    for ((cost, error), point) in drawn(case) {
        let at = (axes.x(cost), axes.y(error));
        let _ = write!(
            svg,
            "<g><title>{}: {} %, {} ms per simulated second</title>{}</g>",
            point.setting,
            number(error),
            number(cost),
            mark(at, point.setting.method, point.settled())
        );
    }
    if let Some((point, ms)) = case
        .cheapest_sound(TARGETS[1])
        .and_then(|point| Some((point, point.ms?)))
    {
        let error = point.error.unwrap_or_default() * 100.0;
        let _ = write!(
            svg,
            "<circle class=\"choice\" cx=\"{:.1}\" cy=\"{:.1}\" r=\"6\"/>",
            axes.x(ms.median),
            axes.y(error)
        );
    }
    let _ = write!(
        svg,
        "<text x=\"{:.0}\" y=\"{}\" text-anchor=\"middle\">cost [ms per simulated second]</text>\
         <text transform=\"translate(11 {:.0}) rotate(-90)\" text-anchor=\"middle\">error [%]</text></svg>",
        (left + right) / 2.0,
        SIZE.1 - 5.0,
        (top + bottom) / 2.0
    );
    svg
}

/// A line and a number for each decade.
fn grid(axes: &Axes) -> String {
    let (left, right, top, bottom) = PLOT;
    let mut lines = String::new();
    let mut labels = String::new();
    for decade in axes.cost.0..=axes.cost.1 {
        let x = along(f64::from(decade), axes.cost, (left, right));
        let _ = write!(lines, "M{x:.1} {top}V{bottom}");
        // Its middle stays inside the drawing.
        let middle = x.clamp(left, right - 8.0);
        let _ = write!(
            labels,
            "<text x=\"{middle:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
            bottom + 18.0,
            power(decade)
        );
    }
    for decade in axes.error.0..=axes.error.1 {
        let y = along(f64::from(decade), axes.error, (bottom, top));
        let _ = write!(lines, "M{left} {y:.1}H{right}");
        let _ = write!(
            labels,
            "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            left - 4.0,
            y + 4.0,
            power(decade)
        );
    }
    format!("<path class=\"grid\" d=\"{lines}\"/>{labels}")
}

/// A power of ten, as text.
fn power(decade: i32) -> String {
    match decade {
        -3..=3 => format!("{}", 10_f64.powi(decade)),
        _ => format!("10<tspan dy=\"-4\" font-size=\"8\">{decade}</tspan>"),
    }
}

/// The mark of a method; hollow for points that did not settle.
fn mark((x, y): (f64, f64), method: Method, settled: bool) -> String {
    let class = format!(
        "class=\"mark {}{}\"",
        method.name(),
        if settled { "" } else { " moving" }
    );
    match method {
        Method::Xpbd => format!("<circle {class} cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.8\"/>"),
        Method::Pbd => format!("<path {class} d=\"M{x:.1} {:.1}l3.6 6.2h-7.2z\"/>", y - 3.8),
        Method::Direct => format!(
            "<path {class} d=\"M{:.1} {:.1}h6v6h-6z\"/>",
            x - 3.0,
            y - 3.0
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_logarithmic_and_stay_inside_the_axes() {
        let axes = Axes {
            cost: (-1, 3),
            error: (-3, 3),
        };
        let (left, right, top, bottom) = PLOT;
        assert_eq!((axes.x(0.1), axes.x(1e3)), (left, right));
        assert!((axes.x(10.0) - (left + right) / 2.0).abs() < 1e-9);
        assert!((axes.y(1.0) - (top + bottom) / 2.0).abs() < 1e-9);
        assert_eq!((axes.y(1e-9), axes.y(1e9)), (bottom, top));
        assert_eq!(axes.y(0.0), bottom, "no error at all");
    }

    #[test]
    fn methods_differ_in_shape_and_what_moves_is_hollow() {
        let shapes = Method::ALL.map(|method| {
            let text = mark((1.0, 2.0), method, true);
            text.replace(method.name(), "")
        });
        for (place, shape) in shapes.iter().enumerate() {
            assert!(!shapes[..place].contains(shape), "{shape}");
        }
        assert!(mark((0.0, 0.0), Method::Xpbd, false).contains("moving"));
    }
}
