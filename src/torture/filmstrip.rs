//! Pictures of a run as SVG: a filmstrip of wireframes, and the energy over time.

use super::{Outcome, Watch};
use crate::{
    output::plot::{COLOURS, label_series},
    solver::{Body, topology::bounds},
};
use glam::{Vec2, Vec3, Vec4};
use plotters::prelude::*;
use std::fmt::Write;

type Failure = Box<dyn std::error::Error>;

/// Width and height of a picture of the strip.
const PICTURE: f32 = 300.0;

/// Room around a body.
const MARGIN: f32 = 18.0;

/// Lines drawn of a body at most: more are one grey.
const MOST_LINES: usize = 4000;

/// The start, the moment of the largest strain after it, and the end, side by side; each fills its
/// picture, and says how many metres that is.
#[must_use]
pub fn strip(outcome: &Outcome) -> Option<String> {
    let (watch, world) = (outcome.watch.as_ref()?, outcome.world.as_ref()?);
    let height = PICTURE + 24.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {height}\" width=\"{}\" font-family=\"sans-serif\" font-size=\"13\">\n",
        PICTURE * 3.0,
        PICTURE * 3.0,
    );
    for (place, ((time, positions), name)) in
        watch.film.iter().zip(["start", "worst", "end"]).enumerate()
    {
        let left = PICTURE * place as f32;
        let eye: Vec<Vec<Vec2>> = positions.iter().map(|body| seen(body)).collect();
        let all = eye.iter().flatten().filter(|x| x.is_finite());
        let (low, high) = bounds(all.map(|x| x.extend(0.0)));
        let extent = (high - low).max_element().max(f32::MIN_POSITIVE);
        let scale = (PICTURE - 2.0 * MARGIN) / extent;
        let middle = (low + high).truncate() / 2.0;
        let at = |x: Vec2| {
            let from_middle = (x - middle) * scale;
            Vec2::new(
                left + PICTURE / 2.0 + from_middle.x,
                PICTURE / 2.0 - from_middle.y,
            )
        };
        for ((body, points), colour) in world.bodies.iter().zip(&eye).zip(COLOURS.iter().cycle()) {
            let RGBColor(r, g, b) = *colour;
            let path = wires(body, points, at);
            let _ = writeln!(
                svg,
                "<path d=\"{path}\" fill=\"none\" stroke=\"rgb({r},{g},{b})\" stroke-width=\"0.7\" stroke-opacity=\"0.7\"/>"
            );
        }
        let _ = writeln!(
            svg,
            "<text x=\"{}\" y=\"{}\">{name}, {time:.3} s, {} m across</text>",
            left + MARGIN,
            PICTURE + 14.0,
            super::table::number(f64::from(if extent > f32::MIN_POSITIVE {
                extent
            } else {
                0.0
            })),
        );
    }
    svg += "</svg>\n";
    Some(svg)
}

/// Where points are on paper, seen from the front, above and to the right.
fn seen(body: &[Vec4]) -> Vec<Vec2> {
    const RIGHT: Vec3 = Vec3::new(0.85, 0.0, -0.5);
    const UP: Vec3 = Vec3::new(-0.2, 0.92, -0.34);
    let place = |x: &Vec4| Vec2::new(x.truncate().dot(RIGHT), x.truncate().dot(UP));
    body.iter().map(place).collect()
}

/// Edges as a path of lines, and a dot for each particle where lines have no length.
fn wires(body: &Body, points: &[Vec2], at: impl Fn(Vec2) -> Vec2) -> String {
    let edges = body.topology.edges.ends();
    let step = edges.len().div_ceil(MOST_LINES).max(1);
    let mut path = String::new();
    for ends in edges.step_by(step) {
        let [a, b] = ends.map(|i| at(points.get(i as usize).copied().unwrap_or_default()));
        if a.is_finite() && b.is_finite() {
            let _ = write!(
                path,
                "M{:.1} {:.1}L{:.1} {:.1}",
                a.x - 0.5,
                a.y,
                b.x + 0.5,
                b.y
            );
        }
    }
    path
}

/// Energies over time; the text of an SVG.
///
/// # Errors
/// What the plotting crate says.
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
        ("all", curve(&|energy| energy.total())),
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
        for ((name, points), colour) in curves.into_iter().zip(COLOURS) {
            chart
                .draw_series(LineSeries::new(points, colour.stroke_width(2)))?
                .label(name)
                .legend(move |(x, y)| {
                    PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2))
                });
        }
        label_series(&mut chart)?;
        root.present()?;
    }
    Ok(svg)
}
