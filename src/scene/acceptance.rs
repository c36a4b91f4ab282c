//! Acceptance criteria of scenes.

use super::SceneError;
use crate::{
    simulation::Statistics,
    solver::{Body, VertexIndex, World, measure, topology::bounds},
};
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Duration of a scene's run, and its acceptance criteria. In addition to the checks, the whole
/// state must be finite and every pin must be bit-identical to its initial position.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Acceptance {
    /// Simulated time [s].
    pub seconds: f64,
    /// Checks at the end, which apply to every body unless restricted by [`Check::Of`].
    #[serde(default)]
    pub checks: Vec<Check>,
}

impl Default for Acceptance {
    /// 5 s, without checks.
    fn default() -> Self {
        Self {
            seconds: 5.0,
            checks: Vec::new(),
        }
    }
}

/// A single criterion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub enum Check {
    /// Checks that apply to bodies whose name begins with this.
    Of(String, Vec<Check>),
    /// Volume over rest volume differs from 1 by at most this.
    Volume(f64),
    /// Volume over rest volume differs from 1 by at least this.
    VolumeLost(f64),
    /// After a rigid fit, particles differ from the rest shape by at most this: root mean square
    /// over the body's size.
    Shape(f64),
    /// After a rigid fit, particles differ from the rest shape by at least this.
    ShapeLost(f64),
    /// No tetrahedron is inverted.
    NoInverted,
    /// Root mean square speed is below this [m/s].
    SpeedBelow(f64),
    /// The body sleeps.
    Asleep,
    /// Every particle is at this height or above [m].
    Above(f32),
    /// Some particle is at this height or below [m].
    ReachesBelow(f32),
    /// The center of the bounding box is within `within` of `place` [m].
    Middle {
        /// Expected position [m].
        place: Vec3,
        /// Tolerance [m].
        within: f32,
    },
    /// The height of the bounding box is between these [m].
    Height(f32, f32),
    /// The diagonal of the bounding box is at most this multiple of that at rest.
    Extent(f64),
    /// Root mean square of edge length over rest length minus 1 is at most this.
    EdgeStrain(f64),
    /// The number of times that a particle was split is in this range.
    Splits(usize, usize),
    /// The number of particles is in this range.
    Particles(usize, usize),
    /// The number of bodies is in this range; within [`Of`](Self::Of), the number of those whose names
    /// begin with its name.
    Bodies(usize, usize),
    /// No particle is closer than this to a point [m].
    AwayFrom(Vec3, f32),
    /// Total energy never rises above its initial value by more than this fraction of the largest
    /// kinetic energy.
    EnergyBounded(f64),
}

impl Acceptance {
    /// Checks that the duration is positive, that all named bodies exist, and that the criteria can hold.
    pub(super) fn check(&self, world: &World) -> Result<(), SceneError> {
        if !self.seconds.is_finite() || self.seconds <= 0.0 || self.seconds > 1e6 {
            return Err(SceneError::Acceptance(format!(
                "seconds is {}, but must be above 0 and at most 1e6 s",
                self.seconds
            )));
        }
        for check in &self.checks {
            let Check::Of(name, checks) = check else {
                check.check()?;
                continue;
            };
            if !world.bodies.iter().any(|body| body.name.starts_with(name)) {
                let names: Vec<_> = world.bodies.iter().map(|b| b.name.as_str()).collect();
                return Err(SceneError::Acceptance(format!(
                    "no body has a name that begins with “{name}”; the bodies are: {}",
                    names.join(", ")
                )));
            }
            for check in checks {
                if matches!(check, Check::Of(..) | Check::EnergyBounded(_)) {
                    return Err(SceneError::Acceptance(format!(
                        "{} is within Of({name:?}, …), but must stand beside it",
                        check.in_words()
                    )));
                }
                check.check()?;
            }
        }
        Ok(())
    }

    /// Number of checks.
    #[must_use]
    pub fn count(&self) -> usize {
        let count = |check: &Check| match check {
            Check::Of(_, checks) => checks.len(),
            _ => 1,
        };
        self.checks.iter().map(count).sum()
    }

    /// Evaluates the criteria after a run: one sentence for each violation.
    #[must_use]
    pub fn judge(&self, start: &World, end: &World, history: &[Statistics]) -> Vec<String> {
        let mut reasons = Vec::new();
        for body in &end.bodies {
            if let Some(quarantine) = &body.quarantine {
                reasons.push(format!(
                    "{}: diverged with a non-finite state of vertex {} after {}",
                    body.name, quarantine.vertex, quarantine.stage
                ));
            }
        }
        for (first, last) in Body::in_both(&start.bodies, &end.bodies) {
            // Grains are numbered anew when one disappears.
            if first.topology.radii.len() != last.topology.radii.len() {
                continue;
            }
            let known = |pin: &&VertexIndex| pin.index() < last.topology.particles();
            let moved = first.pins.iter().filter(known).filter(|&&pin| {
                let at = |body: &Body| body.particles.positions[body.topology.particle(pin)];
                at(first).truncate() != at(last).truncate()
            });
            let count = moved.count();
            if count > 0 {
                let particles = if count == 1 { "particle" } else { "particles" };
                reasons.push(format!("{}: {count} pinned {particles} moved", last.name));
            }
        }
        let crosses = |row: &&Statistics| row.crossings.is_some_and(|count| count > 0);
        // What overlaps at the start has the time to come apart.
        let since = history.iter().position(|row| !crosses(&row)).unwrap_or(0);
        if let Some(row) = history[since..].iter().find(crosses) {
            reasons.push(format!(
                "surfaces cross after {1:.3} s: {0} pairs of an edge and a triangle, expected 0",
                row.crossings.unwrap_or(0),
                row.time
            ));
        }
        for check in &self.checks {
            match check {
                Check::Of(name, checks) => {
                    let own = end.bodies.iter();
                    let own = own.filter(|body| body.name.starts_with(name));
                    let counts = checks
                        .iter()
                        .filter_map(|it| it.counts(own.clone().count()));
                    reasons.extend(counts.map(|reason| format!("{name}: {reason}")));
                    for body in own {
                        reasons.extend(checks.iter().filter_map(|check| check.fails(body)));
                    }
                }
                Check::Bodies(..) => reasons.extend(check.counts(end.bodies.len())),
                Check::EnergyBounded(fraction) => reasons.extend(energy_rises(history, *fraction)),
                _ => reasons.extend(end.bodies.iter().filter_map(|body| check.fails(body))),
            }
        }
        reasons
    }
}

fn energy_rises(history: &[Statistics], fraction: f64) -> Option<String> {
    let first = history.first()?.energy();
    let scale = history.iter().map(|row| row.kinetic).fold(0.0, f64::max);
    let highest = history
        .iter()
        .map(Statistics::energy)
        .fold(f64::NEG_INFINITY, f64::max);
    (highest - first > fraction * scale).then(|| {
        format!(
            "energy rose from {first:.6} J to {highest:.6} J, by more than {fraction} times the largest kinetic energy, {scale:.6} J"
        )
    })
}

impl Check {
    /// The check as a scene file has it.
    fn in_words(&self) -> String {
        ron::to_string(self).unwrap_or_else(|_| format!("{self:?}"))
    }

    /// Checks that its numbers are possible.
    fn check(&self) -> Result<(), SceneError> {
        // Comparisons with NaN are false.
        let from_0 = |x: f64| x >= 0.0 && x.is_finite();
        let (is_possible, expected) = match *self {
            Self::Of(..) | Self::NoInverted | Self::Asleep => return Ok(()),
            Self::Volume(x)
            | Self::VolumeLost(x)
            | Self::Shape(x)
            | Self::ShapeLost(x)
            | Self::EdgeStrain(x)
            | Self::EnergyBounded(x) => (from_0(x), "a finite number from 0"),
            Self::SpeedBelow(x) | Self::Extent(x) => {
                (from_0(x) && x > 0.0, "a finite number above 0")
            }
            Self::Above(y) | Self::ReachesBelow(y) => (y.is_finite(), "a finite height [m]"),
            Self::Middle { place, within } => (
                place.is_finite() && from_0(within.into()),
                "a finite place [m], and a finite distance from 0 [m]",
            ),
            Self::AwayFrom(point, distance) => (
                point.is_finite() && from_0(distance.into()),
                "a finite point [m], and a finite distance from 0 [m]",
            ),
            Self::Height(least, most) => (
                from_0(least.into()) && from_0(most.into()) && least <= most,
                "two finite heights from 0 [m], the lower one first",
            ),
            Self::Splits(least, most)
            | Self::Particles(least, most)
            | Self::Bodies(least, most) => {
                (least <= most, "two whole numbers, the smaller one first")
            }
        };
        match is_possible {
            true => Ok(()),
            false => Err(SceneError::Acceptance(format!(
                "{} cannot hold or says nothing; expected {expected}",
                self.in_words()
            ))),
        }
    }

    /// The violation by the number of bodies, in a sentence; `None` if the criterion holds.
    fn counts(&self, found: usize) -> Option<String> {
        match *self {
            Self::Bodies(least, most) if !(least..=most).contains(&found) => Some(format!(
                "the number of bodies is {found}, expected {least} to {most}"
            )),
            _ => None,
        }
    }

    /// The violation by a body, in a sentence; `None` if the criterion holds.
    fn fails(&self, body: &Body) -> Option<String> {
        let (topology, positions) = (&body.topology, &body.particles.positions);
        let (low, high) = bounds(positions.iter().map(|x| x.truncate()));
        let (holds, found) = match *self {
            Self::Of(..) | Self::Bodies(..) | Self::EnergyBounded(_) => return None,
            Self::Volume(limit) => {
                let error = measure::volume_error(topology, positions);
                (
                    error.abs() <= limit,
                    format!("relative volume error {error:.5}"),
                )
            }
            Self::VolumeLost(limit) => {
                let error = measure::volume_error(topology, positions);
                (
                    error.abs() >= limit,
                    format!("relative volume error only {error:.5}"),
                )
            }
            Self::Shape(limit) => {
                let error = measure::shape_error(topology, positions);
                (
                    error <= limit,
                    format!("shape error {error:.5} of the size"),
                )
            }
            Self::ShapeLost(limit) => {
                let error = measure::shape_error(topology, positions);
                (
                    error >= limit,
                    format!("shape error only {error:.5} of the size"),
                )
            }
            Self::NoInverted => {
                let count = measure::inverted(topology, positions);
                (count == 0, format!("inverted tetrahedra: {count}"))
            }
            Self::SpeedBelow(limit) => {
                let speed = measure::rms_speed(&body.particles);
                (speed < limit, format!("moves at {speed:.6} m/s"))
            }
            Self::Asleep => (body.asleep, "is awake".to_owned()),
            Self::Above(height) => (low.y >= height, format!("reaches down to {} m", low.y)),
            Self::ReachesBelow(height) => {
                (low.y <= height, format!("reaches down only to {} m", low.y))
            }
            Self::Middle { place, within } => {
                let middle = (low + high) / 2.0;
                (
                    middle.distance(place) <= within,
                    format!("center at {middle}"),
                )
            }
            Self::Height(least, most) => {
                let height = high.y - low.y;
                (
                    (least..=most).contains(&height),
                    format!("is {height} m high"),
                )
            }
            Self::Extent(limit) => {
                let (rest_low, rest_high) = bounds(topology.rest.iter().copied());
                let factor = f64::from((high - low).length() / (rest_high - rest_low).length());
                (
                    factor <= limit,
                    format!("has {factor:.3} times its size at rest"),
                )
            }
            Self::EdgeStrain(limit) => {
                let strain = edge_strain(body);
                (strain <= limit, format!("RMS strain of edges {strain:.5}"))
            }
            Self::Splits(least, most) => {
                let splits = topology.splits();
                (
                    (least..=most).contains(&splits),
                    format!("split {splits} times"),
                )
            }
            Self::Particles(least, most) => {
                let count = topology.particles();
                (
                    (least..=most).contains(&count),
                    format!("{count} particles"),
                )
            }
            Self::AwayFrom(point, distance) => {
                let nearest = positions
                    .iter()
                    .map(|x| x.truncate().distance(point))
                    .fold(f32::INFINITY, f32::min);
                (
                    nearest >= distance,
                    format!("comes within {nearest} m of {point}"),
                )
            }
        };
        // Comparisons with NaN are false, so a criterion that cannot be evaluated is violated.
        (!holds).then(|| format!("{}: {found}, expected {self:?}", body.name))
    }
}

/// Root mean square of edge length over rest length minus 1.
fn edge_strain(body: &Body) -> f64 {
    let rest = &body.topology.edges.rest_length;
    let sum: f64 = measure::edge_errors(&body.topology, &body.particles.positions)
        .zip(rest)
        .map(|(error, &rest)| {
            let strain = error / f64::from(rest);
            strain * strain
        })
        .sum();
    (sum / rest.len().max(1) as f64).sqrt()
}
