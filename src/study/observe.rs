//! What is observed of a run, and how.

use super::{
    physics, rest,
    state::{Solver, State},
};
use crate::solver::{VertexIndex, World};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// What is observed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Observe {
    /// A quantity at rest, which is [found](rest) within so many simulated seconds.
    Rest {
        /// What is measured then.
        quantity: Quantity,
        /// Simulated time at most [s].
        seconds: f64,
    },
    /// Mean period of a particle [s]: time between crossings in the same direction, each placed
    /// between two ticks by a straight line.
    Period {
        /// Body, by its place in the list.
        body: usize,
        /// Particle, by its number in the mesh.
        particle: u32,
        /// Along which its place is taken.
        axis: Vec3,
        /// Where it crosses, along the axis [m].
        at: f64,
        /// Periods over which the mean is taken, from 1.
        periods: u32,
        /// Simulated time at most [s].
        seconds: f64,
    },
    /// Share of the energy that is lost in a period, as a mean over so many seconds.
    EnergyLoss {
        /// A period [s].
        period: f64,
        /// Simulated time [s].
        seconds: f64,
    },
    /// How far something that is conserved goes from where it began, at most.
    Drift {
        /// What is conserved.
        of: Conserved,
        /// Simulated time [s].
        seconds: f64,
    },
    /// Where all particles are at these times [s]; the error is their root mean square distance
    /// to the f64 reference over the size of their body.
    Path {
        /// Times [s], rising.
        times: Vec<f64>,
    },
}

/// Something measured of a body that rests.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Quantity {
    /// How far a selection has moved along an axis, on average [m].
    Moved {
        /// Body, by its place in the list.
        body: usize,
        /// Which particles.
        select: Select,
        /// Along which axis.
        axis: Vec3,
    },
    /// How far a selection has turned about an axis through its middle [rad].
    Turned {
        /// Body, by its place in the list.
        body: usize,
        /// Which particles.
        select: Select,
        /// About which axis.
        axis: Vec3,
    },
    /// By how much a selection has grown along an axis [m].
    Widened {
        /// Body, by its place in the list.
        body: usize,
        /// Which particles.
        select: Select,
        /// Along which axis.
        axis: Vec3,
    },
    /// Volume over volume at first, less 1.
    VolumeChange {
        /// Body, by its place in the list.
        body: usize,
    },
}

/// Particles of a body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Select {
    /// One, by its number in the mesh.
    Particle(u32),
    /// Those that are in a box of the world at first [m].
    Within {
        /// Lowest corner.
        low: Vec3,
        /// Highest corner.
        high: Vec3,
    },
}

/// What mechanics conserves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Conserved {
    /// Kinetic, potential and elastic energy [J].
    Energy,
    /// Linear momentum [kg·m/s].
    Momentum,
    /// Angular momentum about the centre of mass [kg·m²/s].
    AngularMomentum,
}

/// What was observed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Observed {
    /// One number, or all coordinates of a path.
    #[serde(deserialize_with = "super::nan::numbers")]
    pub values: Vec<f64>,
    /// Whether rest was found, or what was waited for happened; a body that blew up has not.
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
    /// The unit of the numbers.
    #[must_use]
    pub const fn unit(&self) -> &'static str {
        match self {
            Self::Rest { quantity, .. } => match quantity {
                Quantity::Moved { .. } | Quantity::Widened { .. } => "m",
                Quantity::Turned { .. } => "rad",
                Quantity::VolumeChange { .. } => "1",
            },
            Self::Period { .. } => "s",
            Self::EnergyLoss { .. } => "1",
            Self::Drift { of, .. } => match of {
                Conserved::Energy => "J",
                Conserved::Momentum => "kg·m/s",
                Conserved::AngularMomentum => "kg·m²/s",
            },
            Self::Path { .. } => "m",
        }
    }

    /// Simulated time at most [s].
    #[must_use]
    pub fn seconds(&self) -> f64 {
        match self {
            Self::Rest { seconds, .. }
            | Self::Period { seconds, .. }
            | Self::EnergyLoss { seconds, .. }
            | Self::Drift { seconds, .. } => *seconds,
            Self::Path { times } => times.iter().copied().fold(0.0, f64::max),
        }
    }

    /// The same with less time to come to rest, where it is about that.
    #[must_use]
    pub fn within(&self, limit: f64) -> Self {
        let mut shorter = self.clone();
        if let Self::Rest { seconds, .. } = &mut shorter {
            *seconds = seconds.min(limit);
        }
        shorter
    }

    /// Whether it is about a body at rest.
    #[must_use]
    pub const fn is_static(&self) -> bool {
        matches!(self, Self::Rest { .. })
    }

    /// Whether it is about what is conserved: what never moves conserves everything, and that is no
    /// answer.
    #[must_use]
    pub const fn wants_motion(&self) -> bool {
        matches!(self, Self::EnergyLoss { .. } | Self::Drift { .. })
    }

    /// What is observed of bodies that rest at `state`, where it is about that.
    #[must_use]
    pub fn at_rest(&self, state: &State, start: &State, world: &World) -> Option<f64> {
        match self {
            Self::Rest { quantity, .. } => Some(quantity.of(state, start, world)),
            _ => None,
        }
    }

    /// Runs and observes. `start` is where the world begins, `world` what it is made of: the
    /// solver may have come nearer to rest, or use another compliance.
    pub fn run(&self, solver: &mut Solver, start: &State, world: &World) -> Observed {
        let tick = solver.settings().tick_seconds();
        match self {
            Self::Rest { quantity, seconds } => {
                let rest = rest::find(solver, size(world), *seconds);
                let value = quantity.of(&solver.state(), start, world);
                Observed::one(value, rest.settled, rest.seconds)
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
                    // `max` would forget what is not a number.
                    farthest = if drift <= farthest { farthest } else { drift };
                }
                Observed::one(farthest, went > STILL * size(world), *seconds)
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

    /// What 100 % is, where neither the file nor the converged answer says: the size of the body
    /// for a path, what there was at first for what is conserved, and all of it for a loss.
    #[must_use]
    pub fn natural_scale(&self, start: &State, world: &World) -> Option<f64> {
        match self {
            Self::Rest { .. } | Self::Period { .. } => None,
            Self::EnergyLoss { .. } => Some(1.0),
            Self::Drift { of, .. } => Some(of.size(start, world)),
            Self::Path { .. } => Some(size(world)),
        }
    }
}

/// Distance of two observations, in their unit: root mean square over particles for a path.
#[must_use]
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
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

/// What goes less far than this, as a share of its size, never moved: some roundings of f32.
const STILL: f64 = 1e-6;

/// Size of the largest body [m].
#[must_use]
pub fn size(world: &World) -> f64 {
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
        }
    }

    fn size(self, start: &State, world: &World) -> f64 {
        match self {
            Self::Energy => physics::energy(world, start).abs(),
            Self::Momentum => physics::momentum(start).length(),
            Self::AngularMomentum => physics::angular_momentum(start).length(),
        }
    }
}

impl Select {
    /// Places in the solver's order of the particles of a body.
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
    /// The body that it is about, and the particles of it; none for all.
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
