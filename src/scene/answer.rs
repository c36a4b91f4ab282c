//! Analytic solutions for bodies of a scene at rest, to be drawn over them.
//!
//! A scene file names the body and the kind of solution; all parameters are those of the body in
//! its current state, so that the solution follows changes of parameters and pins.

use crate::solver::{
    Density, Effects, Topology,
    analytic::{Balloon, Catenary, Elastica},
    topology::Dimension,
};
use glam::{DVec3, Vec3, Vec4};
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// A body, and its analytic solution at rest. There is no solution if the body does not exist or
/// does not meet the solution's requirements.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub enum Answer {
    /// A rope that is pinned at its two ends only: the elastic catenary for its weight and axial
    /// stiffness.
    Catenary(String),
    /// A strip of cloth with the first two rows at one end pinned: the heavy elastica for its
    /// weight and bending stiffness, clamped between the two rows.
    Strip(String),
    /// A closed, filled sphere: the radius at which skin tension balances the internal pressure,
    /// drawn as circles about its center. Weight and ground contact are neglected.
    Balloon(String),
}

/// The properties of a body that a solution depends on.
#[derive(Debug, Clone, Copy)]
pub struct AnswerSubject<'a> {
    /// Rest shape.
    pub topology: &'a Topology,
    /// Particles; w is 0 for pins.
    pub positions: &'a [Vec4],
    /// Effects of the body.
    pub effects: &'a Effects,
    /// Mass per measure.
    pub density: Density,
}

/// A curve in world space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnswerCurve {
    shape: Shape,
    /// Origin of the curve [m].
    origin: DVec3,
    /// Directions of its first and second coordinates.
    axes: [DVec3; 2],
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Shape {
    Catenary(Catenary),
    /// A strip, and its length [m].
    Strip(Elastica, f64),
    /// A sphere with a radius [m].
    Sphere(f64),
}

/// Number of segments of a drawn curve.
const PARTS: u32 = 100;

impl AnswerCurve {
    /// Points along the curve [m]; `None` if the solution does not exist.
    #[must_use]
    pub fn points(&self) -> Option<Vec<Vec3>> {
        let [first, second] = self.axes;
        let (points, scale) = match self.shape {
            Shape::Catenary(cable) => (cable.points(PARTS)?, 1.0),
            Shape::Strip(strip, length) => (strip.points(PARTS as usize)?, length),
            Shape::Sphere(radius) => {
                let third = first.cross(second);
                let circles = [second, third].map(|other| self.circle(first, other, radius));
                return Some(circles.into_iter().flatten().collect());
            }
        };
        let place = |[a, b]: [f64; 2]| self.origin + (first * a + second * b) * scale;
        Some(
            points
                .into_iter()
                .map(|point| place(point).as_vec3())
                .collect(),
        )
    }

    /// Points of a closed circle about the origin through the ends of two axes, starting at the
    /// first.
    fn circle(&self, first: DVec3, second: DVec3, radius: f64) -> impl Iterator<Item = Vec3> {
        let origin = self.origin;
        (0..=PARTS).map(move |part| {
            let (up, along) = (TAU * f64::from(part) / f64::from(PARTS)).sin_cos();
            (origin + (first * along + second * up) * radius).as_vec3()
        })
    }
}

impl Answer {
    /// Name of the body.
    #[must_use]
    pub fn body(&self) -> &str {
        match self {
            Self::Catenary(body) | Self::Strip(body) | Self::Balloon(body) => body,
        }
    }

    /// Name of the solution.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Catenary(_) => "elastic catenary",
            Self::Strip(_) => "heavy elastica",
            Self::Balloon(_) => "filled sphere",
        }
    }

    /// The solution for the current state of a body, under the given gravity [m/s²].
    #[must_use]
    pub fn curve(&self, subject: &AnswerSubject, gravity: Vec3) -> Option<AnswerCurve> {
        let gravity = gravity.as_dvec3();
        let down = gravity.try_normalize();
        let weight = f64::from(subject.density.get()) * gravity.length();
        match self {
            Self::Catenary(_) => catenary(subject, weight, down?),
            Self::Strip(_) => strip(subject, weight, down?),
            Self::Balloon(_) => balloon(subject),
        }
    }
}

fn catenary(subject: &AnswerSubject, weight: f64, down: DVec3) -> Option<AnswerCurve> {
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
    Some(AnswerCurve {
        shape: Shape::Catenary(cable),
        origin,
        axes: [level.try_normalize()?, down],
    })
}

/// Clamp slopes [rad] for which the solution is unique.
const CLAMPS: std::ops::RangeInclusive<f64> = -1.5..=1.0;

/// Tolerance for horizontal and perpendicular directions, as a cosine.
const SQUARE: f64 = 1e-3;

fn strip(subject: &AnswerSubject, weight: f64, down: DVec3) -> Option<AnswerCurve> {
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
    // Direction of the clamp: current positions of the pins, weighted by their rest distance along
    // the strip.
    let origin = mean(&mut pins.iter().map(|&i| place(subject, i)))?;
    let lever: DVec3 = pins
        .iter()
        .map(|&i| (place(subject, i) - origin) * depth(i))
        .sum();
    let direction = lever.try_normalize()?;
    let clamp = (-direction.dot(down)).asin();
    let level = direction.reject_from_normalized(down).try_normalize()?;
    // The bending axis must also be horizontal.
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
    (load.is_finite() && load > 0.0).then_some(AnswerCurve {
        shape: Shape::Strip(Elastica { load, clamp }, length),
        origin,
        axes: [level, -down],
    })
}

/// Tolerance for a sphere: relative deviation of the distances from the center.
const ROUND: f64 = 0.02;

fn balloon(subject: &AnswerSubject) -> Option<AnswerCurve> {
    let AnswerSubject {
        topology, effects, ..
    } = *subject;
    let pressure = effects.pressure?;
    let enclosure = topology.enclosure().ok()?;
    let (rest, count) = (&topology.rest, topology.particles() as f64);
    let middle = rest.iter().map(|x| x.as_dvec3()).sum::<DVec3>() / count;
    let far = || rest.iter().map(|x| x.as_dvec3().distance(middle));
    let radius = far().sum::<f64>() / count;
    let is_round = far().all(|it| (it / radius - 1.0).abs() < ROUND);
    // Effects that resist growth and are not part of the solution.
    let others = [
        effects.weave.is_some(),
        effects.struts.is_some(),
        effects.strain_limit.is_some(),
        effects.isometric_bend.is_some(),
    ];
    let held = subject.positions.iter().any(|x| x.w == 0.0);
    if topology.dimension != Dimension::Sheet || !is_round || held || others.contains(&true) {
        return None;
    }
    let membrane = effects.membrane.map_or(0.0, |skin| {
        let [modulus, thickness, ratio] = [
            skin.youngs_modulus.into(),
            skin.thickness.into(),
            skin.poisson_ratio.into(),
        ]
        .map(|number: f64| number);
        modulus * thickness / (1.0 - ratio)
    });
    let area = 4.0 * PI * radius * radius;
    let lattice = effects.stretch.map_or(0.0, |stretch| {
        let lengths = topology.edges.rest_length.iter();
        let stored = lengths.map(|&rest| f64::from(rest).powi(2) / stretch.compliance_of(rest));
        stored.sum::<f64>() / (2.0 * area)
    });
    let radius = Balloon {
        radius,
        factor: pressure.own_volume(enclosure) / enclosure.rest_volume,
        bulk_modulus: pressure.bulk_modulus.into(),
        membrane,
        lattice,
    }
    .filled_radius();
    let places = (0..topology.particles()).map(|i| place(subject, i));
    radius.is_finite().then_some(AnswerCurve {
        shape: Shape::Sphere(radius),
        origin: places.sum::<DVec3>() / count,
        axes: [DVec3::X, DVec3::Y],
    })
}

fn place(subject: &AnswerSubject, particle: usize) -> DVec3 {
    subject.positions[particle].truncate().as_dvec3()
}
