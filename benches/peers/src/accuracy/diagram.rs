//! Work–precision diagrams as SVG: error over time, one panel per problem, one color and one shape
//! per solver.

use super::{
    Findings,
    choose::front,
    sweep::{Outcome, TARGETS},
    table::{percent, significant},
};
use plotters::{coord::Shift, prelude::*};

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Failure = Box<dyn std::error::Error>;

/// Width and height of a panel.
const PANEL: (u32, u32) = (430, 330);

/// Panels in a row.
const COLUMNS: usize = 3;

/// Height of the title with the legend.
const HEADER: u32 = 64;

/// Colors that differ in lightness as well as in hue (after Okabe and Ito 2008).
const COLORS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(86, 180, 233),
    RGBColor(213, 94, 0),
    RGBColor(230, 159, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(90, 90, 90),
    RGBColor(170, 170, 170),
];

/// Color of the targets.
const GRAY: RGBColor = RGBColor(140, 140, 140);

/// Range of errors, as fractions.
const ERRORS: (f64, f64) = (1e-6, 30.0);

/// Draws all problems and returns the text of an SVG.
///
/// # Errors
/// Errors of the plotting crate.
pub fn draw(findings: &Findings) -> Result<String, Failure> {
    let mut svg = String::new();
    {
        let rows = findings.outcomes.len().div_ceil(COLUMNS).max(1);
        let size = (PANEL.0 * COLUMNS as u32, PANEL.1 * rows as u32 + HEADER);
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        let (header, body) = root.split_vertically(HEADER);
        legend(&header, findings)?;
        let times = times(findings);
        let panels = body.split_evenly((rows, COLUMNS));
        for (area, outcome) in panels.iter().zip(&findings.outcomes) {
            panel(area, outcome, times)?;
        }
        root.present()?;
    }
    Ok(svg)
}

fn legend(area: &Area, findings: &Findings) -> Result<(), Failure> {
    let title = "Error at rest over milliseconds of one thread per simulated second";
    area.draw(&Text::new(title, (14, 8), ("sans-serif", 20)))?;
    for (place, solver) in findings.solvers.iter().enumerate() {
        let x = 24 + 150 * place as i32;
        area.draw(&mark((x, 48), place))?;
        area.draw(&Text::new(solver.name, (x + 12, 40), ("sans-serif", 15)))?;
    }
    Ok(())
}

/// Range of all times [ms per simulated second], the same for all panels.
fn times(findings: &Findings) -> (f64, f64) {
    let all = findings
        .outcomes
        .iter()
        .flat_map(|outcome| &outcome.entries)
        .flat_map(|entry| &entry.points)
        .filter_map(|point| Some(point.result()?.0.median));
    let (low, high) = all.fold((f64::INFINITY, 0.0_f64), |(low, high), ms| {
        (low.min(ms), high.max(ms))
    });
    if low <= high {
        (low / 1.5, high * 1.5)
    } else {
        (0.1, 10.0)
    }
}

/// Error as drawn [%].
fn height(error: f64) -> f64 {
    error.clamp(ERRORS.0, ERRORS.1) * 100.0
}

fn panel(area: &Area, outcome: &Outcome, (fast, slow): (f64, f64)) -> Result<(), Failure> {
    let mut chart = ChartBuilder::on(area)
        .caption(
            format!("{}: {}", outcome.problem, outcome.title),
            ("sans-serif", 15),
        )
        .margin(10)
        .x_label_area_size(34)
        .y_label_area_size(62)
        .build_cartesian_2d(
            (fast..slow).log_scale(),
            (ERRORS.0 * 50.0..ERRORS.1 * 200.0).log_scale(),
        )?;
    chart
        .configure_mesh()
        .x_desc("ms per simulated second")
        .y_desc("error [%]")
        .light_line_style(WHITE)
        .bold_line_style(RGBColor(225, 228, 233))
        .x_label_formatter(&|x| significant(*x))
        .y_label_formatter(&|y| percent(*y / 100.0))
        .x_labels(5)
        .y_labels(8)
        .label_style(("sans-serif", 12))
        .axis_desc_style(("sans-serif", 12))
        .draw()?;
    for target in TARGETS {
        let ends = [(fast, target * 100.0), (slow, target * 100.0)];
        chart.draw_series(LineSeries::new(ends, GRAY.stroke_width(1)))?;
    }
    for (place, entry) in outcome.entries.iter().enumerate() {
        let color = COLORS[place % COLORS.len()];
        let line = front(entry)
            .into_iter()
            .map(|(ms, error)| (ms, height(error)));
        chart.draw_series(LineSeries::new(line, color.stroke_width(1)))?;
        let marks = entry.points.iter().filter_map(|point| {
            let (ms, error) = point.result()?;
            Some(mark((ms.median, height(error)), place))
        });
        chart.draw_series(marks)?;
    }
    Ok(())
}

/// Color and shape of a solver.
fn mark<'a, C: Clone + 'static>(at: C, solver: usize) -> DynElement<'static, SVGBackend<'a>, C> {
    let style = COLORS[solver % COLORS.len()];
    match solver % COLORS.len() {
        0 => Circle::new(at, 3, style.filled()).into_dyn(),
        1 => Circle::new(at, 4, style.stroke_width(2)).into_dyn(),
        2 => TriangleMarker::new(at, 5, style.filled()).into_dyn(),
        3 => TriangleMarker::new(at, 5, style.stroke_width(2)).into_dyn(),
        4 | 7 => Cross::new(at, 4, style.stroke_width(2)).into_dyn(),
        _ => Circle::new(at, 2, style.filled()).into_dyn(),
    }
}
