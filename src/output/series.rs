//! Curves over a common axis, in small multiples: as CSV and as SVG.

use super::OutputError;
use crate::file;
use plotters::prelude::*;
use std::path::Path;

/// A curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name of its column in CSV, with the unit.
    pub name: String,
    /// Label in SVG, with the unit.
    pub label: String,
    /// Values by row; NaN where there is none.
    pub values: Vec<f64>,
}

/// Curves over one axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Multiples {
    /// Title of the SVG.
    pub title: String,
    /// The common axis.
    pub axis: Series,
    /// The curves, as long as the axis.
    pub curves: Vec<Series>,
}

type Failure = Box<dyn std::error::Error>;

impl Multiples {
    /// Writes the axis and the curves as columns; a missing value is an empty cell.
    ///
    /// # Errors
    /// [`OutputError`] with the file and the system's message.
    pub fn write_csv(&self, path: &Path) -> Result<(), OutputError> {
        let write = || Ok::<_, Failure>(file::replace(path, &self.csv()?)?);
        write().map_err(|error| OutputError::new(path, error))
    }

    fn csv(&self) -> Result<Vec<u8>, Failure> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let columns = || [&self.axis].into_iter().chain(&self.curves);
        writer.write_record(columns().map(|column| &column.name))?;
        for row in 0..self.axis.values.len() {
            let cell = |column: &Series| match column.values.get(row) {
                Some(value) if value.is_finite() => value.to_string(),
                _ => String::new(),
            };
            writer.write_record(columns().map(cell))?;
        }
        Ok(writer.into_inner()?)
    }

    /// Draws each curve in a panel of its own, one below the other.
    ///
    /// # Errors
    /// [`OutputError`] with the file and the system's message.
    pub fn write_svg(&self, path: &Path) -> Result<(), OutputError> {
        let write = || -> Result<(), Failure> {
            let mut text = String::new();
            self.svg(&mut text)?;
            Ok(file::replace(path, text.as_bytes())?)
        };
        write().map_err(|error| OutputError::new(path, error))
    }

    fn svg(&self, text: &mut String) -> Result<(), Failure> {
        /// Width, and height of a panel and of the title [px].
        const SIZES: (u32, u32, u32) = (800, 190, 40);
        let panels = self.curves.len().max(1);
        let height = SIZES.2 + SIZES.1 * panels as u32;
        let root = SVGBackend::with_string(text, (SIZES.0, height)).into_drawing_area();
        root.fill(&WHITE)?;
        let root = root.titled(&self.title, ("sans-serif", 20))?;
        let times = range(&self.axis.values, 0.0);
        for (panel, curve) in root.split_evenly((panels, 1)).iter().zip(&self.curves) {
            let values = range(&curve.values, 0.05);
            let mut chart = ChartBuilder::on(panel)
                .margin(10)
                .x_label_area_size(32)
                .y_label_area_size(80)
                .build_cartesian_2d(times.0..times.1, values.0..values.1)?;
            chart
                .configure_mesh()
                .x_desc(&self.axis.label)
                .y_desc(&curve.label)
                .y_labels(5)
                .light_line_style(WHITE)
                .label_style(("sans-serif", 12))
                .axis_desc_style(("sans-serif", 13))
                .draw()?;
            let color = super::plot::COLORS[0];
            let points = self.axis.values.iter().zip(&curve.values);
            let is_there = |(x, y): &(f64, f64)| x.is_finite() && y.is_finite();
            let points = points.map(|(x, y)| (*x, *y)).filter(is_there);
            chart.draw_series(LineSeries::new(points, color.stroke_width(2)))?;
        }
        root.present()?;
        Ok(())
    }
}

/// The range of some values with a margin as a fraction of it; never empty.
fn range(values: &[f64], margin: f64) -> (f64, f64) {
    let finite = values.iter().copied().filter(|value| value.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    if low > high {
        return (0.0, 1.0);
    }
    let least = (low.abs().max(high.abs()) * 1e-6).max(1e-12);
    let margin = ((high - low) * margin).max(least);
    (low - margin, high + margin)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_and_a_constant_curve_have_a_range() {
        for values in [&[][..], &[f64::NAN], &[3.0, 3.0], &[0.0]] {
            let (low, high) = range(values, 0.05);
            assert!(low < high, "{values:?}");
        }
    }

    #[test]
    fn both_files_have_every_curve_and_missing_values_are_empty_cells() {
        let series = |name: &str, values: &[f64]| Series {
            name: name.to_owned(),
            label: format!("{name} [J]"),
            values: values.to_vec(),
        };
        let multiples = Multiples {
            title: "cube".to_owned(),
            axis: series("time_s", &[0.0, 0.5]),
            curves: vec![
                series("one_j", &[1.0, 2.0]),
                series("two_j", &[f64::NAN, 4.0]),
            ],
        };
        let folder = std::env::temp_dir().join(format!("pliant-series-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder for temporary files");
        let (csv, svg) = (folder.join("a.csv"), folder.join("a.svg"));
        multiples.write_csv(&csv).expect("written");
        multiples.write_svg(&svg).expect("written");
        let read = |path| std::fs::read_to_string(path).expect("text");
        assert_eq!(read(&csv), "time_s,one_j,two_j\n0,1,\n0.5,2,4\n");
        let picture = read(&svg);
        for label in ["cube", "one_j [J]", "two_j [J]"] {
            assert!(picture.contains(label), "{label}");
        }
        std::fs::remove_dir_all(&folder).expect("it is there");
        let error = multiples.write_csv(&csv).expect_err("no folder");
        assert!(error.to_string().contains("a.csv"), "{error}");
    }
}
