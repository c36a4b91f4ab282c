//! The state that the fast solver and its f64 reference have in common, in f64.

use crate::solver::{SegmentState, Settings, World, reference};
use glam::DVec3;

/// A world in either precision, which can be stepped and observed.
#[derive(Debug, Clone)]
pub enum Solver {
    /// The production solver, in f32.
    Fast(Box<World>),
    /// The f64 reference, in f64.
    Reference(Box<reference::World>),
}

/// Positions, velocities and masses of the particles of a world.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct State {
    /// One per body.
    pub bodies: Vec<BodyState>,
}

/// The particles of a body, in the solver's order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BodyState {
    /// Positions [m].
    pub x: Vec<DVec3>,
    /// Velocities [m/s].
    pub v: Vec<DVec3>,
    /// Masses [kg]; 0 for fixed particles.
    pub m: Vec<f64>,
    /// The segments of a rod; empty for other bodies, and before the first tick.
    pub segments: Vec<SegmentState>,
}

impl Solver {
    /// The fast solver.
    #[must_use]
    pub fn fast(world: World) -> Self {
        Self::Fast(Box::new(world))
    }

    /// The f64 reference of a world, in its current state.
    #[must_use]
    pub fn reference(world: &World) -> Self {
        Self::Reference(Box::new(reference::World::of(world)))
    }

    /// The f64 reference of a world for finding rest: multipliers are
    /// [kept](reference::World::keeps_multipliers) between substeps.
    #[must_use]
    pub fn relaxed_reference(world: &World) -> Self {
        let mut reference = reference::World::of(world);
        reference.keeps_multipliers = true;
        Self::Reference(Box::new(reference))
    }

    /// A tick of 1/rate seconds.
    pub fn tick(&mut self) {
        match self {
            Self::Fast(world) => world.tick(),
            Self::Reference(world) => world.tick(),
        }
    }

    /// Gravity, rate, substeps and iterations.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        match self {
            Self::Fast(world) => &world.settings,
            Self::Reference(world) => &world.settings,
        }
    }

    /// Mutable settings; they may be changed between ticks.
    pub fn settings_mut(&mut self) -> &mut Settings {
        match self {
            Self::Fast(world) => &mut world.settings,
            Self::Reference(world) => &mut world.settings,
        }
    }

    /// Number of particles of a body.
    #[must_use]
    pub fn particles(&self, body: usize) -> usize {
        match self {
            Self::Fast(world) => world.bodies[body].particles.len(),
            Self::Reference(world) => world.bodies[body].x.len(),
        }
    }

    /// Number of ticks in this time, at least one.
    #[must_use]
    pub fn ticks(&self, seconds: f64) -> u64 {
        (seconds * self.settings().rate.get()).round().max(1.0) as u64
    }

    /// Sets all velocities to zero.
    pub fn stop(&mut self) {
        match self {
            Self::Fast(world) => {
                for body in &mut world.bodies {
                    body.particles.stop();
                }
            }
            Self::Reference(world) => {
                for body in &mut world.bodies {
                    body.v.fill(DVec3::ZERO);
                    body.spins.fill(DVec3::ZERO);
                }
            }
        }
    }

    /// Sets all positions to those of `state`, at rest.
    pub fn place(&mut self, state: &State) {
        match self {
            Self::Fast(world) => {
                for (body, from) in world.bodies.iter_mut().zip(&state.bodies) {
                    for (i, from) in from.x.iter().enumerate() {
                        body.particles.set_position(i, *from);
                    }
                }
            }
            Self::Reference(world) => {
                for (body, from) in world.bodies.iter_mut().zip(&state.bodies) {
                    body.x.clone_from(&from.x);
                }
            }
        }
        self.stop();
    }

    /// Reads the current state.
    #[must_use]
    pub fn state(&self) -> State {
        let mass = |w: f64| if w > 0.0 { 1.0 / w } else { 0.0 };
        let bodies = match self {
            Self::Fast(world) => world
                .bodies
                .iter()
                .map(|body| {
                    let particles = &body.particles;
                    let all = 0..particles.len();
                    let w = |i: usize| f64::from(particles.positions[i].w);
                    BodyState {
                        x: all.clone().map(|i| particles.position(i)).collect(),
                        v: all.clone().map(|i| particles.velocity_f64(i)).collect(),
                        m: all.map(|i| mass(w(i))).collect(),
                        segments: particles.segments.clone(),
                    }
                })
                .collect(),
            Self::Reference(world) => world
                .bodies
                .iter()
                .map(|body| BodyState {
                    x: body.x.clone(),
                    v: body.v.clone(),
                    m: body.w.iter().map(|&w| mass(w)).collect(),
                    segments: body.segments(),
                })
                .collect(),
        };
        State { bodies }
    }
}

impl State {
    /// Largest distance of a particle from its position in the other state [m].
    #[must_use]
    pub fn farthest(&self, start: &Self) -> f64 {
        let bodies = self.bodies.iter().zip(&start.bodies);
        let ways = bodies.flat_map(|(now, then)| now.x.iter().zip(&then.x));
        ways.map(|(now, then)| now.distance(*then))
            .fold(0.0, f64::max)
    }

    /// Whether every number is finite.
    #[must_use]
    pub fn finite(&self) -> bool {
        let mut all = self
            .bodies
            .iter()
            .flat_map(|body| body.x.iter().chain(&body.v));
        all.all(|x| x.is_finite())
    }

    /// Root mean square speed of the particles from `before` to here in `seconds` [m/s], and the
    /// kinetic energy of that motion [J].
    ///
    /// To be evaluated over a whole tick: over one substep, the rounding of positions appears as a
    /// speed near ε‖x‖/h.
    #[must_use]
    pub fn motion_since(&self, before: &Self, seconds: f64) -> (f64, f64) {
        let (mut squares, mut count, mut energy) = (0.0, 0, 0.0);
        for (now, before) in self.bodies.iter().zip(&before.bodies) {
            for ((x, from), m) in now.x.iter().zip(&before.x).zip(&now.m) {
                let square = (*x - *from).length_squared() / (seconds * seconds);
                squares += square;
                energy += 0.5 * m * square;
                count += usize::from(*m > 0.0);
            }
        }
        ((squares / count.max(1) as f64).sqrt(), energy)
    }

    /// The same bodies with every particle at the origin.
    #[must_use]
    pub fn zero(&self) -> Self {
        let mut zero = self.clone();
        zero.scale(0.0);
        zero
    }

    /// Adds positions.
    pub fn add(&mut self, other: &Self) {
        for (body, other) in self.bodies.iter_mut().zip(&other.bodies) {
            for (x, other) in body.x.iter_mut().zip(&other.x) {
                *x += *other;
            }
        }
    }

    /// Subtracts positions.
    pub fn subtract(&mut self, other: &Self) {
        for (body, other) in self.bodies.iter_mut().zip(&other.bodies) {
            for (x, other) in body.x.iter_mut().zip(&other.x) {
                *x -= *other;
            }
        }
    }

    /// Total mass of the particles that can move [kg].
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.bodies.iter().flat_map(|body| &body.m).sum()
    }

    /// Σ m‖x‖ [kg·m].
    #[must_use]
    pub fn weighted_length(&self) -> f64 {
        let bodies = self.bodies.iter();
        let all = bodies.flat_map(|body| body.m.iter().zip(&body.x));
        all.map(|(m, x)| m * x.length()).sum()
    }

    /// Scales the positions.
    pub fn scale(&mut self, factor: f64) {
        for x in self.bodies.iter_mut().flat_map(|body| &mut body.x) {
            *x *= factor;
        }
    }

    /// Largest distance of a particle from the origin [m].
    #[must_use]
    pub fn reach(&self) -> f64 {
        let all = self.bodies.iter().flat_map(|body| &body.x);
        all.map(|x| x.abs().max_element()).fold(0.0, f64::max)
    }
}
