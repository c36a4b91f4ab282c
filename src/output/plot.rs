//! A plot of a run as SVG: energies, volume error and residual, and time per tick, over simulated
//! time.

use super::OutputError;
use crate::{file, simulation::Statistics};
use plotters::{
    coord::{CoordTranslate, Shift},
    drawing::DrawingAreaErrorKind,
    prelude::*,
};
use std::path::Path;

const SIZE: (u32, u32) = (960, 900);

/// Colors that differ in lightness as well as in hue (after Okabe and Ito 2008).
pub(crate) const COLORS: [RGBColor; 5] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(60, 60, 60),
    RGBColor(204, 121, 167),
];

type Curve<'a> = (&'a str, Vec<(f64, f64)>);
type Failure = Box<dyn std::error::Error>;

/// Writes the plot of a run.
///
/// # Errors
/// [`OutputError`] with the file and the system's message.
pub fn write(path: &Path, title: &str, history: &[Statistics]) -> Result<(), OutputError> {
    let write = || -> Result<(), Failure> {
        let mut text = String::new();
        draw(&mut text, title, history)?;
        Ok(file::replace(path, text.as_bytes())?)
    };
    write().map_err(|error| OutputError::new(path, error))
}

fn draw(text: &mut String, title: &str, history: &[Statistics]) -> Result<(), Failure> {
    let root = SVGBackend::with_string(text, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let root = root.titled(title, ("sans-serif", 22))?;
    let panels = root.split_evenly((3, 1));
    let curve = |name, value: &dyn Fn(&Statistics) -> f64| -> Curve {
        let points = history.iter().map(|row| (row.time, value(row)));
        (name, points.filter(|(_, y)| y.is_finite()).collect())
    };
    chart(
        &panels[0],
        "energy [J]",
        &[
            curve("kinetic", &|row| row.kinetic),
            curve("potential", &|row| row.potential),
            curve("elastic", &Statistics::elastic_sum),
            curve("total", &Statistics::energy),
        ],
    )?;
    chart(
        &panels[1],
        "error [% of rest]",
        &[
            curve("volume", &|row| {
                row.volume_error.map_or(f64::NAN, |error| error * 100.0)
            }),
            curve("residual", &|row| row.residual * 100.0),
        ],
    )?;
    chart(
        &panels[2],
        "tick time [ms]",
        &[curve("tick", &|row| row.ms_per_tick)],
    )?;
    root.present()?;
    Ok(())
}

fn chart(
    area: &DrawingArea<SVGBackend, Shift>,
    label: &str,
    curves: &[Curve],
) -> Result<(), Failure> {
    let (times, values) = (range(curves, |p| p.0), range(curves, |p| p.1));
    let margin = (values.1 - values.0) * 0.05;
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .x_label_area_size(34)
        .y_label_area_size(72)
        .build_cartesian_2d(times.0..times.1, values.0 - margin..values.1 + margin)?;
    chart
        .configure_mesh()
        .x_desc("time [s]")
        .y_desc(label)
        .light_line_style(WHITE)
        .label_style(("sans-serif", 13))
        .axis_desc_style(("sans-serif", 14))
        .draw()?;
    for ((name, points), color) in curves.iter().zip(COLORS) {
        chart
            .draw_series(LineSeries::new(
                points.iter().copied(),
                color.stroke_width(2),
            ))?
            .label(*name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2)));
    }
    label_series(&mut chart, emptiest_corner(curves, times, values))?;
    Ok(())
}

/// The corner of the plot with the fewest points, for a legend that covers none.
fn emptiest_corner(curves: &[Curve], times: (f64, f64), values: (f64, f64)) -> SeriesLabelPosition {
    let fraction = |x: f64, (low, high): (f64, f64)| (x - low) / (high - low);
    // A legend of four lines takes about a sixth of the width and a third of the height.
    let covers = |right: bool, upper: bool| {
        let inside = |&(x, y): &(f64, f64)| {
            let (x, y) = (fraction(x, times), fraction(y, values));
            (if right { x > 0.8 } else { x < 0.2 }) && (if upper { y > 0.6 } else { y < 0.4 })
        };
        let points = curves.iter().flat_map(|(_, points)| points);
        points.filter(|point| inside(point)).count()
    };
    let corners = [
        (true, true, SeriesLabelPosition::UpperRight),
        (false, true, SeriesLabelPosition::UpperLeft),
        (true, false, SeriesLabelPosition::LowerRight),
        (false, false, SeriesLabelPosition::LowerLeft),
    ];
    let emptiest = corners
        .into_iter()
        .min_by_key(|&(right, upper, _)| covers(right, upper));
    emptiest.map_or(SeriesLabelPosition::UpperRight, |(_, _, corner)| corner)
}

/// Draws the legend of the series.
pub(crate) fn label_series<'a, DB: DrawingBackend + 'a, CT: CoordTranslate>(
    chart: &mut ChartContext<'a, DB, CT>,
    position: SeriesLabelPosition,
) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
    chart
        .configure_series_labels()
        .position(position)
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(200, 200, 200))
        .label_font(("sans-serif", 13))
        .draw()
}

/// Minimum and maximum, widened if all values are equal.
fn range(curves: &[Curve], of: impl Fn(&(f64, f64)) -> f64) -> (f64, f64) {
    let all = curves.iter().flat_map(|(_, points)| points).map(of);
    let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
        (low.min(x), high.max(x))
    });
    if !low.is_finite() {
        (0.0, 1.0)
    } else if high > low {
        (low, high)
    } else {
        let room = low.abs().max(1.0) * 0.5;
        (low - room, high + room)
    }
}
