//! A report as SVG: projections per second over the size of the body, with their roofs.

use super::{BenchRow, Elastic, Report, Shape, Stepped};
use crate::{
    file,
    output::{
        OutputError,
        plot::{COLORS, label_series},
    },
};
use plotters::{coord::Shift, prelude::*};
use std::path::Path;

const SIZE: (u32, u32) = (1100, 860);

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Failure = Box<dyn std::error::Error>;

/// Writes the plot of a report.
///
/// # Errors
/// [`OutputError`] with the file and the system's message.
pub fn write(path: &Path, report: &Report) -> Result<(), OutputError> {
    let write = || -> Result<(), Failure> {
        let mut text = String::new();
        draw(&mut text, report)?;
        Ok(file::replace(path, text.as_bytes())?)
    };
    write().map_err(|error| OutputError::new(path, error))
}

fn draw(text: &mut String, report: &Report) -> Result<(), Failure> {
    let root = SVGBackend::with_string(text, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let title = format!(
        "Projections per second, {} instructions",
        report.instructions
    );
    let root = root.titled(&title, ("sans-serif", 22))?;
    let alone = |row: &BenchRow, elastic| row.case.elastic == elastic && row.case.bodies == 1;
    let small =
        |row: &BenchRow| row.case.elastic == Elastic::Both && row.case.shape == Shape::Box(5);
    let panels: [(&str, &dyn Fn(&BenchRow) -> bool); 4] = [
        ("stretch, a cloth", &|row| alone(row, Elastic::Stretch)),
        ("volume, a box", &|row| alone(row, Elastic::Volume)),
        ("stretch and volume, a box", &|row| {
            alone(row, Elastic::Both)
        }),
        ("stretch and volume, 1 to 100 small boxes", &small),
    ];
    for (area, (caption, belongs)) in root.split_evenly((2, 2)).iter().zip(panels) {
        let rows: Vec<&BenchRow> = report.rows.iter().filter(|row| belongs(row)).collect();
        if !rows.is_empty() {
            panel(area, caption, &rows, &report.threads)?;
        }
    }
    root.present()?;
    Ok(())
}

/// Measured medians as lines with spread bars; roofs as dashed lines of the same color.
fn panel(area: &Area, caption: &str, rows: &[&BenchRow], threads: &[usize]) -> Result<(), Failure> {
    let sizes = rows.iter().map(|row| row.particles as f64);
    let smallest = sizes.clone().fold(f64::INFINITY, f64::min);
    let largest = sizes.fold(0.0, f64::max);
    let stepped = || rows.iter().flat_map(|row| &row.stepped);
    let lowest = stepped().map(|stepped| stepped.millions().low);
    let highest = stepped().map(|stepped| stepped.roof().max(stepped.millions().high));
    let (lowest, highest) = (
        lowest.fold(f64::INFINITY, f64::min),
        highest.fold(0.0, f64::max),
    );
    let mut chart = ChartBuilder::on(area)
        .caption(caption, ("sans-serif", 16))
        .margin(12)
        .x_label_area_size(34)
        .y_label_area_size(64)
        .build_cartesian_2d(
            (smallest / 1.5..largest * 1.5).log_scale(),
            // Space above the highest point for the legend.
            (lowest / 1.5..highest * 8.0).log_scale(),
        )?;
    chart
        .configure_mesh()
        .x_desc("particles")
        .y_desc("million projections per second")
        .light_line_style(WHITE)
        .x_label_formatter(&|x| format!("{x:.0}"))
        .y_label_formatter(&|y| format!("{y:.0}"))
        .label_style(("sans-serif", 13))
        .axis_desc_style(("sans-serif", 14))
        .draw()?;
    for (column, (&threads, color)) in threads.iter().zip(COLORS).enumerate() {
        let over = |figure: fn(&Stepped) -> f64| -> Vec<(f64, f64)> {
            let point = |row: &&BenchRow| (row.particles as f64, figure(&row.stepped[column]));
            rows.iter().map(point).collect()
        };
        let measured = over(|stepped| stepped.millions().median);
        let (low, high) = (
            over(|stepped| stepped.millions().low),
            over(|stepped| stepped.millions().high),
        );
        chart.draw_series(
            low.into_iter()
                .zip(high)
                .map(|(low, high)| PathElement::new([low, high], color.stroke_width(2))),
        )?;
        chart.draw_series(
            measured
                .iter()
                .map(|&point| Circle::new(point, 4, color.filled())),
        )?;
        chart
            .draw_series(LineSeries::new(measured, color.stroke_width(2)))?
            .label(named(threads))
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2)));
        chart
            .draw_series(DashedLineSeries::new(
                over(Stepped::roof),
                8,
                6,
                color.stroke_width(1),
            ))?
            .label(format!("roofline, {}", named(threads)))
            .legend(move |(x, y)| {
                EmptyElement::at((x, y))
                    + PathElement::new([(0, 0), (7, 0)], color.stroke_width(1))
                    + PathElement::new([(11, 0), (18, 0)], color.stroke_width(1))
            });
    }
    label_series(&mut chart, SeriesLabelPosition::UpperRight)?;
    Ok(())
}

fn named(threads: usize) -> String {
    match threads {
        1 => "1 thread".to_owned(),
        _ => format!("{threads} threads"),
    }
}
