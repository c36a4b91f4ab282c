//! Observed quantities and how they are measured.

use super::{
    physics, rest,
    state::{Solver, State},
};
use crate::solver::{VertexIndex, World};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// An observed quantity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Observe {
    /// A quantity at rest; the state of rest is found within this simulated time.
    Rest {
        /// The quantity that is measured.
        quantity: Quantity,
        /// Limit on the simulated time [s].
        seconds: f64,
    },
    /// A quantity at a time, in motion.
    At {
        /// The quantity that is measured.
        quantity: Quantity,
        /// The time [s].
        seconds: f64,
    },
    /// Mean period of a particle [s]: time between crossings in the same direction, interpolated
    /// linearly between two ticks.
    Period {
        /// Index of the body in the list.
        body: usize,
        /// Vertex number in the mesh.
        particle: u32,
        /// Axis of the crossing.
        axis: Vec3,
        /// Position of the crossing along the axis [m].
        at: f64,
        /// Number of periods in the mean, from 1.
        periods: u32,
        /// Limit on the simulated time [s].
        seconds: f64,
    },
    /// Fraction of the energy that is lost per period, as a mean over the simulated time.
    EnergyLoss {
        /// Period [s].
        period: f64,
        /// Simulated time [s].
        seconds: f64,
    },
    /// Largest deviation of a conserved quantity from its initial value.
    Drift {
        /// The conserved quantity.
        of: Conserved,
        /// Simulated time [s].
        seconds: f64,
    },
    /// Time until a body has torn at this number of particles [s].
    Torn {
        /// Index of the body in the list.
        body: usize,
        /// Number of particles that were split, from 1.
        splits: usize,
        /// Limit on the simulated time [s].
        seconds: f64,
    },
    /// Positions of all particles at these times [s]; the error is their root mean square distance
    /// to the f64 reference, relative to the size of their body.
    Path {
        /// Times [s], ascending.
        times: Vec<f64>,
    },
}

/// A quantity of a body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Quantity {
    /// Mean displacement of a selection along an axis [m].
    Moved {
        /// Index of the body in the list.
        body: usize,
        /// The selected particles.
        select: Select,
        /// The axis.
        axis: Vec3,
    },
    /// Rotation of a selection about an axis through its center [rad].
    Turned {
        /// Index of the body in the list.
        body: usize,
        /// The selected particles.
        select: Select,
        /// The axis.
        axis: Vec3,
    },
    /// Increase of the extent of a selection along an axis [m].
    Widened {
        /// Index of the body in the list.
        body: usize,
        /// The selected particles.
        select: Select,
        /// The axis.
        axis: Vec3,
    },
    /// Volume relative to the initial volume, minus 1.
    VolumeChange {
        /// Index of the body in the list.
        body: usize,
    },
}

/// Particles of a body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Select {
    /// One vertex, by its number in the mesh.
    Particle(u32),
    /// Particles that are initially in a world-space box [m].
    Within {
        /// Lowest corner.
        low: Vec3,
        /// Highest corner.
        high: Vec3,
    },
}

/// A conserved quantity of mechanics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Conserved {
    /// Kinetic, potential and elastic energy [J].
    Energy,
    /// Linear momentum [kg·m/s].
    Momentum,
    /// Angular momentum about the center of mass [kg·m²/s].
    AngularMomentum,
    /// [Linking number](crate::solver::RodLink) of closed rods, summed over bodies [turns].
    Link,
}

/// The observed values of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Observed {
    /// One number, or all coordinates of a path.
    #[serde(deserialize_with = "super::nan::numbers")]
    pub values: Vec<f64>,
    /// Whether rest was found or the awaited event occurred; false for a body that diverged.
    pub settled: bool,
    /// Simulated time [s].
    pub seconds: f64,
}

impl Observed {
    fn one(value: f64, settled: bool, seconds: f64) -> Self {
        Self {
            values: vec![value],
            settled: settled && value.is_finite(),
            seconds,
        }
    }
}

impl Observe {
    /// The unit of the values.
    #[must_use]
    pub const fn unit(&self) -> &'static str {
        match self {
            Self::Rest { quantity, .. } | Self::At { quantity, .. } => match quantity {
                Quantity::Moved { .. } | Quantity::Widened { .. } => "m",
                Quantity::Turned { .. } => "rad",
                Quantity::VolumeChange { .. } => "1",
            },
            Self::Period { .. } | Self::Torn { .. } => "s",
            Self::EnergyLoss { .. } => "1",
            Self::Drift { of, .. } => match of {
                Conserved::Energy => "J",
                Conserved::Momentum => "kg·m/s",
                Conserved::AngularMomentum => "kg·m²/s",
                Conserved::Link => "turns",
            },
            Self::Path { .. } => "m",
        }
    }

    /// Limit on the simulated time [s].
    #[must_use]
    pub fn seconds(&self) -> f64 {
        match self {
            Self::Rest { seconds, .. }
            | Self::At { seconds, .. }
            | Self::Period { seconds, .. }
            | Self::EnergyLoss { seconds, .. }
            | Self::Drift { seconds, .. }
            | Self::Torn { seconds, .. } => *seconds,
            Self::Path { times } => times.iter().copied().fold(0.0, f64::max),
        }
    }

    /// The same observation; one of rest gets at most `limit` seconds to come to rest.
    #[must_use]
    pub fn within(&self, limit: f64) -> Self {
        let mut shorter = self.clone();
        if let Self::Rest { seconds, .. } = &mut shorter {
            *seconds = seconds.min(limit);
        }
        shorter
    }

    /// Whether it observes a body at rest.
    #[must_use]
    pub const fn is_static(&self) -> bool {
        matches!(self, Self::Rest { .. })
    }

    /// Whether it observes a conserved quantity: a body that never moves conserves everything,
    /// which is not a valid result.
    #[must_use]
    pub const fn wants_motion(&self) -> bool {
        matches!(self, Self::EnergyLoss { .. } | Self::Drift { .. })
    }

    /// The observed values of bodies at rest in `state`, if it observes rest.
    #[must_use]
    pub fn at_rest(&self, state: &State, start: &State, world: &World) -> Option<f64> {
        match self {
            Self::Rest { quantity, .. } => Some(quantity.of(state, start, world)),
            _ => None,
        }
    }

    /// Runs and observes. `start` is the initial state; `world` is the original scene, from which
    /// `solver` may differ in state (nearer to rest) or compliance.
    pub fn run(&self, solver: &mut Solver, start: &State, world: &World) -> Observed {
        let tick = solver.settings().tick_seconds();
        match self {
            Self::Rest { quantity, seconds } => {
                let rest = rest::find(solver, size(world), *seconds);
                let value = quantity.of(&solver.state(), start, world);
                Observed::one(value, rest.settled, rest.seconds)
            }
            Self::At { quantity, seconds } => {
                for _ in 0..solver.ticks(*seconds) {
                    solver.tick();
                }
                let value = quantity.of(&solver.state(), start, world);
                Observed::one(value, true, *seconds)
            }
            Self::Period {
                body,
                particle,
                axis,
                at,
                periods,
                seconds,
            } => {
                let index = particle_index(world, *body, *particle);
                let place = |solver: &Solver| {
                    let x = solver.state().bodies[*body].x[index];
                    x.dot(axis.as_dvec3()) - at
                };
                let mut crossings = Vec::new();
                let mut before = place(solver);
                for done in 0..solver.ticks(*seconds) {
                    solver.tick();
                    let after = place(solver);
                    if before > 0.0 && after <= 0.0 {
                        crossings.push(tick * (done as f64 + before / (before - after)));
                    }
                    before = after;
                    if crossings.len() > *periods as usize {
                        break;
                    }
                }
                let enough = crossings.len() > *periods as usize;
                let value = match crossings[..] {
                    [first, .., last] => (last - first) / (crossings.len() - 1) as f64,
                    _ => f64::NAN,
                };
                let spent = crossings.last().copied().unwrap_or(*seconds);
                Observed::one(value, enough, spent)
            }
            Self::EnergyLoss { period, seconds } => {
                let ticks = solver.ticks(*seconds);
                let before = physics::energy(world, start);
                let mut went = 0.0_f64;
                for _ in 0..ticks {
                    solver.tick();
                    went = went.max(solver.state().farthest(start));
                }
                let kept = physics::energy(world, &solver.state()) / before;
                let periods = ticks as f64 * tick / period;
                let moved = went > STILL * size(world);
                Observed::one(1.0 - kept.powf(1.0 / periods), moved, *seconds)
            }
            Self::Drift { of, seconds } => {
                let (mut farthest, mut went) = (0.0_f64, 0.0_f64);
                for _ in 0..solver.ticks(*seconds) {
                    solver.tick();
                    let state = solver.state();
                    went = went.max(state.farthest(start));
                    let drift = of.distance(&state, start, world);
                    // `max` would ignore NaN.
                    farthest = if drift <= farthest { farthest } else { drift };
                }
                Observed::one(farthest, went > STILL * size(world), *seconds)
            }
            Self::Torn {
                body,
                splits,
                seconds,
            } => {
                let torn = start.bodies[*body].x.len() + splits;
                for done in 1..=solver.ticks(*seconds) {
                    solver.tick();
                    if solver.particles(*body) >= torn {
                        let time = tick * done as f64;
                        return Observed::one(time, true, time);
                    }
                }
                Observed::one(f64::NAN, false, *seconds)
            }
            Self::Path { times } => {
                let mut values = Vec::new();
                let mut done = 0;
                for &time in times {
                    let due = solver.ticks(time);
                    while done < due {
                        solver.tick();
                        done += 1;
                    }
                    for body in solver.state().bodies {
                        values.extend(body.x.iter().flat_map(|x| x.to_array()));
                    }
                }
                Observed {
                    settled: values.iter().all(|value| value.is_finite()),
                    values,
                    seconds: self.seconds(),
                }
            }
        }
    }

    /// Normalization where neither the file nor the converged solution provides one: the size of
    /// the body for a path, the initial value of a conserved quantity, and 1 for a loss.
    #[must_use]
    pub fn natural_scale(&self, start: &State, world: &World) -> Option<f64> {
        match self {
            Self::Rest { .. } | Self::At { .. } | Self::Period { .. } | Self::Torn { .. } => None,
            Self::EnergyLoss { .. } => Some(1.0),
            Self::Drift { of, .. } => Some(of.size(start, world)),
            Self::Path { .. } => Some(size(world)),
        }
    }
}

/// Distance of two observations, in their unit: root mean square over particles for a path.
#[must_use]
pub(super) fn distance(a: &[f64], b: &[f64]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    let particles = if a.len() > 1 {
        a.len() as f64 / 3.0
    } else {
        1.0
    };
    if a.len() == b.len() {
        (sum / particles).sqrt()
    } else {
        f64::NAN
    }
}

/// Largest displacement relative to the size of a body that counts as no motion: a few roundings of
/// f32.
const STILL: f64 = 1e-6;

/// Size of the largest body [m].
#[must_use]
pub(super) fn size(world: &World) -> f64 {
    let sizes = world
        .bodies
        .iter()
        .map(|body| f64::from(body.topology.size));
    sizes.fold(0.0, f64::max)
}

fn particle_index(world: &World, body: usize, vertex: u32) -> usize {
    world.bodies[body].topology.particle(VertexIndex(vertex))
}

impl Conserved {
    fn distance(self, now: &State, start: &State, world: &World) -> f64 {
        match self {
            Self::Energy => (physics::energy(world, now) - physics::energy(world, start)).abs(),
            Self::Momentum => physics::momentum(now).distance(physics::momentum(start)),
            Self::AngularMomentum => {
                physics::angular_momentum(now).distance(physics::angular_momentum(start))
            }
            Self::Link => (physics::link(world, now) - physics::link(world, start)).abs(),
        }
    }

    fn size(self, start: &State, world: &World) -> f64 {
        match self {
            Self::Energy => physics::energy(world, start).abs(),
            Self::Momentum => physics::momentum(start).length(),
            Self::AngularMomentum => physics::angular_momentum(start).length(),
            Self::Link => physics::link(world, start).abs(),
        }
    }
}

impl Select {
    /// Solver indices of the selected particles of a body.
    #[must_use]
    pub fn particles(&self, start: &State, world: &World, body: usize) -> Vec<usize> {
        match self {
            Self::Particle(vertex) => {
                let index = particle_index(world, body, *vertex);
                (index < start.bodies[body].x.len())
                    .then_some(index)
                    .into_iter()
                    .collect()
            }
            Self::Within { low, high } => {
                let (low, high) = (low.as_dvec3(), high.as_dvec3());
                let all = start.bodies[body].x.iter().enumerate();
                all.filter(|(_, x)| x.cmpge(low).all() && x.cmple(high).all())
                    .map(|(index, _)| index)
                    .collect()
            }
        }
    }
}

impl Quantity {
    /// The body that is measured, and its particles; none for all.
    #[must_use]
    pub const fn subject(&self) -> (usize, Option<&Select>) {
        match self {
            Self::Moved { body, select, .. }
            | Self::Turned { body, select, .. }
            | Self::Widened { body, select, .. } => (*body, Some(select)),
            Self::VolumeChange { body } => (*body, None),
        }
    }

    fn of(&self, now: &State, start: &State, world: &World) -> f64 {
        let (body, select) = self.subject();
        let (x, from) = (&now.bodies[body].x, &start.bodies[body].x);
        let chosen = select.map_or(Vec::new(), |select| select.particles(start, world, body));
        let count = chosen.len() as f64;
        let mean = |x: &[DVec3]| chosen.iter().fold(DVec3::ZERO, |sum, &i| sum + x[i]) / count;
        match self {
            Self::Moved { axis, .. } => {
                (mean(x) - mean(from)).dot(axis.as_dvec3().normalize_or_zero())
            }
            Self::Turned { axis, .. } => {
                let axis = axis.as_dvec3().normalize_or_zero();
                let (middle, first) = (mean(x), mean(from));
                let (across, along) = chosen.iter().fold((0.0, 0.0), |(across, along), &i| {
                    let r = (from[i] - first).reject_from_normalized(axis);
                    let s = (x[i] - middle).reject_from_normalized(axis);
                    (across + r.cross(s).dot(axis), along + r.dot(s))
                });
                across.atan2(along)
            }
            Self::Widened { axis, .. } => {
                let axis = axis.as_dvec3().normalize_or_zero();
                let width = |x: &[DVec3]| {
                    let along = chosen.iter().map(|&i| x[i].dot(axis));
                    let (low, high) = along
                        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
                            (low.min(x), high.max(x))
                        });
                    high - low
                };
                width(x) - width(from)
            }
            Self::VolumeChange { .. } => {
                let body = &world.bodies[body];
                physics::volume(body, x) / physics::volume(body, from) - 1.0
            }
        }
    }
}
