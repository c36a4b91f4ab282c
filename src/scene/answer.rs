//! What mathematics says that a body of a scene should look like at rest, to be drawn over it.
//!
//! A scene file names the bodies and the shape; every number is that of the body as it is now, so that
//! the answer moves with the sliders and the pins.

use crate::{
    analytic::{Catenary, Elastica},
    solver::{Density, Effects, Topology, topology::Dimension},
};
use glam::{DVec3, Vec3, Vec4};
use serde::{Deserialize, Serialize};

/// A body, and the shape that it should have at rest. No body of that name, or one that is not as the
/// shape wants it, has no answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Answer {
    /// A rope that is pinned at both ends and nowhere else: the elastic catenary of its weight and its
    /// axial stiffness.
    Catenary(String),
    /// A strip of cloth that is pinned in its first two rows at one end: the heavy elastica of its
    /// weight and its bending stiffness, held between the two rows.
    Strip(String),
}

/// A body as an answer needs it.
#[derive(Debug, Clone, Copy)]
pub struct Subject<'a> {
    /// Its rest shape.
    pub topology: &'a Topology,
    /// Its particles, w being 0 for pins.
    pub positions: &'a [Vec4],
    /// What it carries.
    pub effects: &'a Effects,
    /// Its mass by measure.
    pub density: Density,
}

/// A curve of the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curve {
    shape: Shape,
    /// Where it begins [m].
    origin: DVec3,
    /// The directions of its first and second coordinate.
    axes: [DVec3; 2],
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Shape {
    Catenary(Catenary),
    /// A strip and its length [m].
    Strip(Elastica, f64),
}

/// Points of a drawn curve.
const PARTS: u32 = 100;

impl Curve {
    /// Points along it [m]; `None` where the shape does not exist.
    #[must_use]
    pub fn points(&self) -> Option<Vec<Vec3>> {
        let (points, scale) = match self.shape {
            Shape::Catenary(cable) => (cable.points(PARTS)?, 1.0),
            Shape::Strip(strip, length) => (strip.points(PARTS as usize)?, length),
        };
        let [first, second] = self.axes;
        let place = |[a, b]: [f64; 2]| self.origin + (first * a + second * b) * scale;
        Some(
            points
                .into_iter()
                .map(|point| place(point).as_vec3())
                .collect(),
        )
    }
}

impl Answer {
    /// Name of the body.
    #[must_use]
    pub fn body(&self) -> &str {
        match self {
            Self::Catenary(body) | Self::Strip(body) => body,
        }
    }

    /// What the shape is called.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Catenary(_) => "elastic catenary",
            Self::Strip(_) => "heavy elastica",
        }
    }

    /// The answer for a body as it is, under the given gravity [m/s²].
    #[must_use]
    pub fn curve(&self, subject: &Subject, gravity: Vec3) -> Option<Curve> {
        let gravity = gravity.as_dvec3();
        let down = gravity.try_normalize()?;
        let weight = f64::from(subject.density.get()) * gravity.length();
        match self {
            Self::Catenary(_) => catenary(subject, weight, down),
            Self::Strip(_) => strip(subject, weight, down),
        }
    }
}

fn catenary(subject: &Subject, weight: f64, down: DVec3) -> Option<Curve> {
    let edges = &subject.topology.edges;
    let count = subject.topology.particles();
    let mut degrees = vec![0; count];
    for end in edges.ends().flatten() {
        degrees[end as usize] += 1;
    }
    let mut pins = (0..count).filter(|&i| subject.positions[i].w == 0.0);
    let (Some(first), Some(last), None) = (pins.next(), pins.next(), pins.next()) else {
        return None;
    };
    let is_path = edges.ends().len() + 1 == count && degrees.iter().all(|&degree| degree <= 2);
    if subject.topology.dimension != Dimension::Line
        || !is_path
        || [first, last].iter().any(|&end| degrees[end] != 1)
    {
        return None;
    }
    let stretch = subject.effects.stretch?;
    let lengths = edges.rest_length.iter();
    let (length, compliance) = lengths.fold((0.0, 0.0), |(length, compliance), &rest| {
        (
            length + f64::from(rest),
            compliance + stretch.compliance_of(rest),
        )
    });
    let origin = place(subject, first);
    let across = place(subject, last) - origin;
    let level = across.reject_from_normalized(down);
    let cable = Catenary {
        weight,
        length,
        stiffness: length / compliance,
        span: level.length(),
        drop: across.dot(down),
    };
    Some(Curve {
        shape: Shape::Catenary(cable),
        origin,
        axes: [level.try_normalize()?, down],
    })
}

/// Slopes of a clamp [rad] for which there is one answer.
const CLAMPS: std::ops::RangeInclusive<f64> = -1.5..=1.0;

/// Directions that differ by less than this, as a cosine, count as level and square.
const SQUARE: f64 = 1e-3;

fn strip(subject: &Subject, weight: f64, down: DVec3) -> Option<Curve> {
    if subject.topology.dimension != Dimension::Sheet {
        return None;
    }
    let rest = &subject.topology.rest;
    let pins: Vec<usize> = (0..rest.len())
        .filter(|&i| subject.positions[i].w == 0.0)
        .collect();
    let mean = |all: &mut dyn Iterator<Item = DVec3>| {
        let (sum, count) = all.fold((DVec3::ZERO, 0.0), |(sum, count), x| (sum + x, count + 1.0));
        (count > 0.0).then(|| sum / count)
    };
    let clamp = mean(&mut pins.iter().map(|&i| rest[i].as_dvec3()))?;
    let middle = mean(&mut rest.iter().map(|x| x.as_dvec3()))?;
    let along = (middle - clamp).try_normalize()?;
    let depth = |i: usize| (rest[i].as_dvec3() - clamp).dot(along);
    // Where the clamp points to now: the pins' places, by how far along the strip they are at rest.
    let origin = mean(&mut pins.iter().map(|&i| place(subject, i)))?;
    let lever: DVec3 = pins
        .iter()
        .map(|&i| (place(subject, i) - origin) * depth(i))
        .sum();
    let direction = lever.try_normalize()?;
    let clamp = (-direction.dot(down)).asin();
    let level = direction.reject_from_normalized(down).try_normalize()?;
    // The axis that it bends about must be level too.
    let across = pins.iter().map(|&i| {
        let offset = place(subject, i) - origin;
        offset.reject_from_normalized(direction)
    });
    let wide = across.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))?;
    if wide.try_normalize()?.dot(down).abs() > SQUARE || !CLAMPS.contains(&clamp) {
        return None;
    }
    let effects = subject.effects;
    let stiffness: f64 = [
        effects.bend.map(|bend| bend.stiffness),
        effects.isometric_bend.map(|bend| bend.stiffness),
    ]
    .into_iter()
    .flatten()
    .map(f64::from)
    .sum();
    let length = (0..rest.len()).map(depth).fold(0.0, f64::max);
    let load = weight * length.powi(3) / stiffness;
    (load.is_finite() && load > 0.0).then_some(Curve {
        shape: Shape::Strip(Elastica { load, clamp }, length),
        origin,
        axes: [level, -down],
    })
}

fn place(subject: &Subject, particle: usize) -> DVec3 {
    subject.positions[particle].truncate().as_dvec3()
}
