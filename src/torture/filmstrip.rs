//! Pictures of a run as SVG: a filmstrip of wireframes, and the energy over time.

use super::{Outcome, Watch};
use crate::{
    output::plot::{COLORS, label_series},
    solver::{Body, topology::bounds},
};
use glam::{Vec2, Vec3, Vec4};
use plotters::prelude::*;
use std::fmt::Write;

type Failure = Box<dyn std::error::Error>;

/// Width and height of a frame.
const PICTURE: f32 = 300.0;

/// Margin around a body.
const MARGIN: f32 = 18.0;

/// A frame of the filmstrip.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Frame {
    /// Name of the moment.
    pub name: &'static str,
    /// Time since the start [s].
    pub time: f64,
    /// Length of its longer side [m].
    pub extent: f64,
    /// End points of the edges, in the unit square, y upwards.
    pub lines: Vec<[[f32; 2]; 2]>,
}

/// Maximum number of lines per body: more cannot be distinguished.
const MAX_LINES: usize = 4000;

/// The start, the moment of the largest strain after it, and the end; the bodies fill each frame.
/// `None` unless positions were kept.
#[must_use]
pub fn frames(outcome: &Outcome) -> Option<Vec<Frame>> {
    let (watch, world) = (outcome.watch.as_ref()?, outcome.world.as_ref()?);
    let frame = |((time, positions), name): (&(f64, Vec<Vec<Vec4>>), &'static str)| {
        let eye: Vec<Vec<Vec2>> = positions.iter().map(|body| seen(body)).collect();
        let all = eye.iter().flatten().filter(|x| x.is_finite());
        let (low, high) = bounds(all.map(|x| x.extend(0.0)));
        let extent = (high - low).max_element();
        let scale = 1.0 / extent.max(f32::MIN_POSITIVE);
        let middle = (low + high).truncate() / 2.0;
        let at = |x: Vec2| ((x - middle) * scale + 0.5).to_array();
        let lines = world.bodies.iter().zip(&eye);
        let lines = lines.flat_map(|(body, points)| wires(body, points));
        Frame {
            name,
            time: *time,
            extent: f64::from(extent),
            lines: lines.map(|ends| ends.map(at)).collect(),
        }
    };
    let names = ["start", "worst", "end"];
    Some(watch.film.iter().zip(names).map(frame).collect())
}

/// The frames side by side; each shows its extent in meters.
#[must_use]
pub fn strip(outcome: &Outcome) -> Option<String> {
    let height = PICTURE + 24.0;
    let width = PICTURE * 3.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" font-family=\"sans-serif\" font-size=\"13\">\n",
    );
    let RGBColor(r, g, b) = COLORS[0];
    for (place, frame) in frames(outcome)?.iter().enumerate() {
        let left = PICTURE * place as f32 + MARGIN;
        let side = PICTURE - 2.0 * MARGIN;
        let mut path = String::new();
        for ends in &frame.lines {
            let [a, b] = ends.map(|[x, y]| (left + x * side, PICTURE - MARGIN - y * side));
            // Half a pixel longer at both ends, so that a zero-length edge is drawn as a dot.
            let _ = write!(
                path,
                "M{:.1} {:.1}L{:.1} {:.1}",
                a.0 - 0.5,
                a.1,
                b.0 + 0.5,
                b.1
            );
        }
        let _ = writeln!(
            svg,
            "<path d=\"{path}\" fill=\"none\" stroke=\"rgb({r},{g},{b})\" stroke-width=\"0.7\" stroke-opacity=\"0.7\"/>\n<text x=\"{left}\" y=\"{}\">{}, {:.3} s, {} m across</text>",
            PICTURE + 14.0,
            frame.name,
            frame.time,
            super::table::number(frame.extent),
        );
    }
    svg += "</svg>\n";
    Some(svg)
}

/// Projects points onto the page, seen from the front, above and right.
fn seen(body: &[Vec4]) -> Vec<Vec2> {
    const RIGHT: Vec3 = Vec3::new(0.85, 0.0, -0.5);
    const UP: Vec3 = Vec3::new(-0.2, 0.92, -0.34);
    let place = |x: &Vec4| Vec2::new(x.truncate().dot(RIGHT), x.truncate().dot(UP));
    body.iter().map(place).collect()
}

/// Edges of a body; a subset if there are very many.
fn wires(body: &Body, points: &[Vec2]) -> impl Iterator<Item = [Vec2; 2]> {
    let edges = body.topology.edges.ends();
    let step = edges.len().div_ceil(MAX_LINES).max(1);
    let at = |i: u32| points.get(i as usize).copied().unwrap_or(Vec2::NAN);
    let lines = edges.step_by(step).map(move |ends| ends.map(at));
    lines.filter(|[a, b]| a.is_finite() && b.is_finite())
}

/// Energies over time; returns the text of an SVG.
///
/// # Errors
/// Errors of the plotting crate.
pub fn energies(watch: &Watch) -> Result<String, Failure> {
    let curve = |value: &dyn Fn(&super::Energy) -> f64| -> Vec<(f64, f64)> {
        let points = watch
            .moments
            .iter()
            .map(|moment| (moment.time, value(&moment.energy)));
        points.filter(|(_, y)| y.is_finite()).collect()
    };
    let curves = [
        ("kinetic", curve(&|energy| energy.kinetic)),
        ("potential", curve(&|energy| energy.potential)),
        ("elastic", curve(&|energy| energy.elastic)),
        ("total", curve(&|energy| energy.total())),
    ];
    let all = curves.iter().flat_map(|(_, points)| points);
    let (low, high) = all.fold((0.0_f64, 0.0_f64), |(low, high), p| {
        (low.min(p.1), high.max(p.1))
    });
    let room = if high > low { (high - low) * 0.05 } else { 0.5 };
    let end = watch.moments.last().map_or(1.0, |moment| moment.time);
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (900, 260)).into_drawing_area();
        root.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&root)
            .margin(12)
            .x_label_area_size(34)
            .y_label_area_size(90)
            .build_cartesian_2d(0.0..end.max(1e-9), low - room..high + room)?;
        chart
            .configure_mesh()
            .x_desc("time [s]")
            .y_desc("energy [J]")
            .y_label_formatter(&|y| super::table::number(*y))
            .light_line_style(WHITE)
            .label_style(("sans-serif", 13))
            .axis_desc_style(("sans-serif", 14))
            .draw()?;
        for ((name, points), color) in curves.into_iter().zip(COLORS) {
            chart
                .draw_series(LineSeries::new(points, color.stroke_width(2)))?
                .label(name)
                .legend(move |(x, y)| {
                    PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2))
                });
        }
        label_series(&mut chart, SeriesLabelPosition::UpperRight)?;
        root.present()?;
    }
    Ok(svg)
}
