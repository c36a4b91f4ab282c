//! A work–precision diagram as SVG: solver error over cost, one panel per mesh.

use super::{
    numbers::number,
    results::{CaseResult, Point, ProblemResult},
    setting::Method,
};
use crate::output::plot::{COLORS, label_series};
use plotters::{coord::Shift, prelude::*};

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Failure = Box<dyn std::error::Error>;

/// Width and height of a panel.
const PANEL: (u32, u32) = (620, 460);

/// Errors below this are drawn at it.
const MIN_PERCENT: f64 = 1e-4;

/// Draws a problem and returns the text of an SVG.
///
/// # Errors
/// Errors of the plotting crate.
pub fn draw(result: &ProblemResult) -> Result<String, Failure> {
    let cases: Vec<&CaseResult> = result
        .cases
        .iter()
        .filter(|case| case.best().is_some())
        .collect();
    let mut svg = String::new();
    {
        let columns = cases.len().clamp(1, 2);
        let rows = cases.len().div_ceil(columns).max(1);
        let size = (PANEL.0 * columns as u32, PANEL.1 * rows as u32 + 40);
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        let root = root.titled(&result.problem.title, ("sans-serif", 22))?;
        let panels = root.split_evenly((rows, columns));
        for (area, case) in panels.iter().zip(cases) {
            panel(area, case)?;
        }
        root.present()?;
    }
    Ok(svg)
}

/// Error in per cent, as drawn.
fn height(error: f64) -> f64 {
    (error * 100.0).max(MIN_PERCENT)
}

fn panel(area: &Area, case: &CaseResult) -> Result<(), Failure> {
    let drawn: Vec<(f64, f64, &Point)> = case
        .points
        .iter()
        .filter_map(|point| {
            let error = point.error.filter(|error| error.is_finite())?;
            Some((point.ms?.median, height(error), point))
        })
        .collect();
    let bounds = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, 0.0_f64), |(low, high), value| {
            (low.min(value), high.max(value))
        })
    };
    let (fast, slow) = bounds(&mut drawn.iter().map(|point| point.0));
    // Errors below the uncertainty of the converged solution are not drawn.
    let known = |error: &f64| {
        case.doubt()
            .is_some_and(|doubt| *error > doubt.max(MIN_PERCENT / 100.0))
    };
    let mesh = case.mesh_error.filter(known).map(height);
    let (good, bad) = bounds(&mut drawn.iter().map(|point| point.1).chain(mesh));
    let constraints = match case.case.constraints() {
        1 => "1 constraint".to_owned(),
        count => format!("{count} constraints"),
    };
    let (name, particles) = (&case.case.level_name, case.case.particles());
    let caption = format!("{name}: {particles} particles, {constraints}");
    let mut chart = ChartBuilder::on(area)
        .caption(caption, ("sans-serif", 15))
        .margin(14)
        .x_label_area_size(42)
        .y_label_area_size(78)
        .build_cartesian_2d(
            (fast / 1.6..slow * 2.5).log_scale(),
            // Space above the highest point for the legend.
            (good / 3.0..bad * 30.0).log_scale(),
        )?;
    chart
        .configure_mesh()
        .x_desc("ms per simulated second, one thread")
        .y_desc("error [%]")
        .light_line_style(WHITE)
        .bold_line_style(RGBColor(225, 228, 233))
        .x_label_formatter(&|x| number(*x))
        .y_label_formatter(&|y| number(*y))
        .x_labels(6)
        .y_labels(8)
        .label_style(("sans-serif", 13))
        .axis_desc_style(("sans-serif", 14))
        .draw()?;
    if let Some(mesh) = mesh {
        let ends = [(fast / 1.6, mesh), (slow * 2.5, mesh)];
        let style = COLORS[2].stroke_width(2);
        chart
            .draw_series(DashedLineSeries::new(ends, 8, 6, style))?
            .label("mesh error")
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style));
    }
    let front = case.front();
    let line = front
        .iter()
        .filter_map(|point| Some((point.ms?.median, height(point.error?))));
    let style = COLORS[3].stroke_width(1);
    chart
        .draw_series(LineSeries::new(line.clone(), style))?
        .label("Pareto front")
        .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style));
    for method in Method::ALL {
        let of = drawn
            .iter()
            .filter(|point| point.2.setting.method == method);
        let of: Vec<_> = of.collect();
        if of.is_empty() {
            continue;
        }
        let marks = of
            .iter()
            .map(|&&(x, y, point)| mark((x, y), method, point.settled()));
        chart
            .draw_series(marks)?
            .label(method.name())
            .legend(move |(x, y)| mark((x + 9, y), method, true));
    }
    // Labels are omitted where they would overlap the previous one.
    let mut last: Option<(f64, f64)> = None;
    let (width, tall) = ((slow / fast * 4.0).log10(), (bad / good * 90.0).log10());
    for (place, point) in line.zip(&front) {
        let near = last.is_some_and(|last: (f64, f64)| {
            let across = (place.0 / last.0).log10().abs() / width;
            let along = (place.1 / last.1).log10().abs() / tall;
            across < 0.09 && along < 0.05
        });
        if !near {
            let words = format!("{}×{}", point.setting.substeps, point.setting.iterations);
            let style = ("sans-serif", 12).into_font().color(&COLORS[3]);
            let label = EmptyElement::at(place) + Text::new(words, (6, -14), style);
            chart.draw_series([label])?;
            last = Some(place);
        }
    }
    label_series(&mut chart, SeriesLabelPosition::UpperRight)?;
    Ok(())
}

/// Color and shape of a method; hollow for points that did not come to rest.
fn mark<'a, C: Clone + 'static>(
    at: C,
    method: Method,
    settled: bool,
) -> DynElement<'static, SVGBackend<'a>, C> {
    let color = match method {
        Method::Xpbd => COLORS[0],
        Method::Pbd => COLORS[1],
        Method::Direct => COLORS[2],
    };
    let style = if settled {
        color.filled()
    } else {
        color.stroke_width(1)
    };
    match method {
        Method::Xpbd => Circle::new(at, 4, style).into_dyn(),
        Method::Pbd => TriangleMarker::new(at, 5, style).into_dyn(),
        Method::Direct => Cross::new(at, 4, style).into_dyn(),
    }
}
