//! Checks the universal requirements of a world tick by tick: all numbers are finite, no energy is
//! created, pins do not move, the momentum of free bodies is constant.
//!
//! It only observes: the caller that steps the world (a headless run or the window) passes each
//! state to it.

use super::{Figure, Outside, energy::Energy};
use crate::solver::{Body, ElasticKind, Particles, TopologyId, World, measure};
use glam::{DVec3, Vec4};

/// Half an ulp of 1 in f32: a number x is rounded by at most this times |x|.
pub const ROUNDING: f64 = 1.0 / 16_777_216.0;

/// Accepted increase of energy, as a fraction.
const MORE_ENERGY: f64 = 0.01;

/// Accepted change of momentum, as a fraction of the sum of the momenta of all particles.
const MOMENTUM: f64 = 1e-5;

/// The state of a world at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Moment {
    /// Time since the start [s].
    pub time: f64,
    /// Its energy.
    pub energy: Energy,
    /// Root mean square of the relative errors of edges and volumes.
    pub strain: f64,
}

/// Observations of a world.
#[derive(Debug, Clone)]
pub struct Watch {
    /// The start, and the end of each tick.
    pub moments: Vec<Moment>,
    /// Positions at the start, when strain was largest after it, and at the end; body by body.
    pub film: [(f64, Vec<Vec<Vec4>>); 3],
    filming: bool,
    /// Largest strain after the start.
    worst: f64,
    free: bool,
    outside: Outside,
    momentum: Momentum,
    /// Topology and pinned particles of each body at the start.
    pins: Vec<(TopologyId, Vec<(usize, Vec4)>)>,
    pins_moved: f64,
    quarantined: usize,
    /// Largest number of crossings of surfaces in contact that were apart at the start.
    crossings: Option<usize>,
    floors: Floors,
}

/// Momentum of free bodies.
#[derive(Debug, Clone, Copy, Default)]
struct Momentum {
    start: DVec3,
    gravity: DVec3,
    /// Largest deviation from the expected momentum [kg·m/s].
    off: f64,
    /// Largest Σm‖v‖ [kg·m/s].
    carried: f64,
    /// Largest ‖Σmv‖ [kg·m/s].
    most: f64,
}

/// Effects of rounding to f32. Positions are accurate to f64 (position and carry); displacements
/// within a substep and lengths in constraints are rounded.
#[derive(Debug, Clone, Copy, Default)]
struct Floors {
    mass: f64,
    particles: f64,
    /// Mean number of constraints on a particle, times iterations.
    moves: f64,
    /// Largest displacement per substep, as a speed [m/s].
    speed: f64,
    /// Longest edge so far [m].
    length: f64,
    substeps: f64,
    h: f64,
}

impl Watch {
    /// Starts with the current state of a world. `outside` is the kind of external actions;
    /// `filming` keeps positions.
    #[must_use]
    pub fn new(world: &World, outside: Outside, filming: bool) -> Self {
        let bodies = || world.bodies.iter();
        let free =
            outside == Outside::Nothing && world.colliders.is_empty() && bodies().all(is_free);
        let total = |each: &dyn Fn(&Body) -> f64| bodies().map(each).sum::<f64>();
        let particles = total(&|body| body.particles.len() as f64).max(1.0);
        let corners = total(&|body| corners(body) as f64);
        let iterations = f64::from(world.settings.iterations.get());
        let mut watch = Self {
            moments: Vec::new(),
            film: Default::default(),
            filming,
            worst: 0.0,
            free,
            outside,
            momentum: Momentum {
                start: bodies()
                    .map(|body| measure::momentum(&body.particles))
                    .sum(),
                gravity: world.settings.gravity.as_dvec3(),
                ..Momentum::default()
            },
            pins: bodies()
                .map(|body| (body.topology.id(), pinned(&body.particles)))
                .collect(),
            pins_moved: 0.0,
            quarantined: 0,
            crossings: bodies().any(|body| body.effects.can_touch()).then_some(0),
            floors: Floors {
                mass: total(&|body| mass(&body.particles)),
                particles,
                moves: corners / particles * iterations,
                ..Floors::default()
            },
        };
        if watch.crossings.is_some() && world.crossings() > 0 {
            watch.crossings = None;
        }
        watch.look(world);
        watch
    }

    /// Records the world after a tick.
    pub fn see(&mut self, world: &World) {
        self.floors.substeps += f64::from(world.settings.substeps.get());
        self.look(world);
    }

    fn look(&mut self, world: &World) {
        let h = world.settings.substep_seconds();
        self.floors.h = if self.floors.h > 0.0 {
            self.floors.h.min(h)
        } else {
            h
        };
        let moment = Moment {
            time: world.time,
            energy: Energy::of(world),
            strain: strain(world),
        };
        if self.filming {
            let positions = || {
                world
                    .bodies
                    .iter()
                    .map(|b| b.particles.positions.clone())
                    .collect()
            };
            let [start, most, end] = &mut self.film;
            if self.moments.is_empty() {
                *start = (world.time, positions());
            } else if moment.strain >= self.worst {
                self.worst = moment.strain;
                *most = (world.time, positions());
            }
            *end = (world.time, positions());
        }
        self.moments.push(moment);
        self.pins_moved = self.pins_moved.max(self.way_of_pins(world));
        let caught = world.bodies.iter().filter(|body| body.quarantine.is_some());
        self.quarantined = self.quarantined.max(caught.count());
        if let Some(crossings) = &mut self.crossings {
            *crossings = (*crossings).max(world.crossings());
        }
        for body in &world.bodies {
            let particles = &body.particles;
            let largest = |most: f32, u: &Vec4| most.max(u.truncate().length());
            let way = particles.displacements.iter().fold(0.0, largest);
            let speed = f64::from(way / particles.substep_seconds());
            self.floors.speed = self.floors.speed.max(speed);
            let (topology, x) = (&body.topology, &particles.positions);
            let errors = measure::edge_errors(topology, x).zip(&topology.edges.rest_length);
            let lengths = errors.map(|(error, &rest)| error + f64::from(rest));
            self.floors.length = lengths.fold(self.floors.length, f64::max);
        }
        let bodies = || world.bodies.iter().map(|body| &body.particles);
        let total: DVec3 = bodies().map(measure::momentum).sum();
        self.momentum.most = self.momentum.most.max(total.length());
        if self.free {
            let fallen = self.momentum.gravity * (self.floors.mass * world.time);
            let off = (total - self.momentum.start - fallen).length();
            self.momentum.off = self.momentum.off.max(off);
            self.momentum.carried = self.momentum.carried.max(bodies().map(carried).sum());
        }
    }

    /// Largest distance of a pin from its place at the start [m]. Where bodies or particles have come, gone
    /// or been split since, it is that to the nearest of these places.
    fn way_of_pins(&self, world: &World) -> f64 {
        let distance = |a: Vec4, b: Vec4| (a - b).truncate().as_dvec3().length();
        let same_bodies = world.bodies.len() == self.pins.len();
        let mut most = 0.0_f64;
        for (number, body) in world.bodies.iter().enumerate() {
            let x = &body.particles.positions;
            let known = self.pins.get(number).filter(|_| same_bodies);
            if let Some((topology, pins)) = known
                && *topology == body.topology.id()
            {
                let ways = pins
                    .iter()
                    .map(|&(particle, place)| distance(x[particle], place));
                most = ways.fold(most, f64::max);
                continue;
            }
            for (_, now) in pinned(&body.particles) {
                let places = self.pins.iter().flat_map(|(_, pins)| pins);
                let ways = places.map(|&(_, place)| distance(now, place));
                most = most.max(ways.fold(f64::INFINITY, f64::min));
            }
        }
        most
    }

    /// The universal figures.
    #[must_use]
    pub fn figures(&self) -> Vec<Figure> {
        let mut figures = Vec::new();
        if self.outside != Outside::Poison {
            figures.push(Figure::none(
                "bodies not finite",
                self.quarantined,
                "bodies",
            ));
        }
        if self.pins.iter().any(|(_, pins)| !pins.is_empty()) {
            figures.push(Figure::new("way of the pins", self.pins_moved, 0.0, "m"));
        }
        if let Some(crossings) = self.crossings {
            figures.push(Figure::none("crossings", crossings, "crossings"));
        }
        if self.outside == Outside::Nothing {
            figures.push(self.energy());
        }
        if self.free && self.momentum.carried > 0.0 {
            let off = self.momentum.off / self.momentum.carried;
            let limit = MOMENTUM + self.floors.momentum() / self.momentum.carried;
            figures.push(Figure::new(
                "momentum gained",
                off * 100.0,
                limit * 100.0,
                "%",
            ));
        }
        figures
    }

    /// Largest speed of the center of mass [m/s].
    fn flight(&self) -> f64 {
        if self.floors.mass > 0.0 {
            self.momentum.most / self.floors.mass
        } else {
            0.0
        }
    }

    /// Largest excess of energy over its first known value.
    fn energy(&self) -> Figure {
        let known = self
            .moments
            .iter()
            .position(|moment| moment.energy.is_known());
        let after = &self.moments[known.unwrap_or(self.moments.len())..];
        let start = after.first().map_or(0.0, |moment| moment.energy.total());
        let most = after.iter().map(|moment| moment.energy.mechanical());
        let more = most.fold(start, f64::max) - start - self.floors.energy(self.flight());
        // Relative to the kinetic and elastic energy; the potential energy depends on the choice of
        // the origin.
        let energies = after.iter().map(|moment| moment.energy);
        let scale = energies.map(|e| e.kinetic + e.elastic).fold(0.0, f64::max);
        let gain = if more > 0.0 { more / scale } else { 0.0 };
        let finite = self
            .moments
            .iter()
            .all(|moment| moment.energy.total().is_finite());
        let gain = if finite { gain } else { f64::NAN };
        Figure::new("energy gained", gain * 100.0, MORE_ENERGY * 100.0, "%")
    }
}

impl Floors {
    /// In a substep, a displacement u is rounded 2 + k times: in the prediction, in the velocity,
    /// and once for each of the k constraint projections of the particle. Each rounding changes a
    /// velocity by up to ε‖u‖/h in each of three directions.
    fn kick(&self) -> f64 {
        ROUNDING * self.speed
    }

    /// A constraint of length l is rounded by up to εl, and displacements during the iterations can
    /// be as long.
    fn constraint_kick(&self) -> f64 {
        self.kick() + ROUNDING * self.length / self.h
    }

    /// Independent errors add in squares: ½m · 3(2 + k)n (ε(‖u‖ + l)/h)² after n substeps. Those of
    /// uniform motion at a speed v add up to nε‖u‖/h, and so to an energy of mv times that.
    fn energy(&self, flight: f64) -> f64 {
        let kicks = 3.0 * (2.0 + self.moves) * self.substeps.max(1.0);
        let apart = 0.5 * self.mass * kicks * self.constraint_kick().powi(2);
        apart + self.mass * flight * self.substeps * self.kick()
    }

    /// A particle in uniform motion is rounded in the same way in each substep, so that the errors
    /// of the prediction add up: mnε‖u‖/h. Those of constraints have random directions: for N
    /// particles and n substeps they grow like √(3kn/N), and four times that is not exceeded by
    /// chance.
    fn momentum(&self) -> f64 {
        let flight = self.substeps;
        let constraints = 4.0 * (3.0 * self.moves * self.substeps / self.particles).sqrt();
        self.mass * (self.kick() * flight + self.constraint_kick() * constraints)
    }
}

fn is_free(body: &Body) -> bool {
    let effects = &body.effects;
    body.pins.is_empty()
        && effects.grab.is_none()
        && effects.ground.is_none()
        && effects.sticky_ground.is_none()
}

fn pinned(particles: &Particles) -> Vec<(usize, Vec4)> {
    let positions = particles.positions.iter().copied().enumerate();
    positions.filter(|(_, x)| x.w == 0.0).collect()
}

fn mass(particles: &Particles) -> f64 {
    let free = particles.positions.iter().filter(|x| x.w > 0.0);
    free.map(|x| 1.0 / f64::from(x.w)).sum()
}

fn carried(particles: &Particles) -> f64 {
    let w = |i: usize| f64::from(particles.positions[i].w);
    let free = (0..particles.len()).filter(|&i| w(i) > 0.0);
    free.map(|i| particles.velocity_f64(i).length() / w(i))
        .sum()
}

/// Total number of corners of all constraints: the number of particle updates per iteration.
fn corners(body: &Body) -> usize {
    let carried = ElasticKind::ALL.into_iter();
    carried
        .filter(|&kind| body.effects.has(kind))
        .map(|kind| kind.corners() * kind.elements(&body.topology))
        .sum()
}

/// Root mean square of C over the rest value, of edges and volumes.
#[must_use]
pub fn strain(world: &World) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for body in &world.bodies {
        let (edges, volumes) = strains(body);
        count += edges.len() + volumes.len();
        sum += edges.iter().chain(&volumes).map(|s| s * s).sum::<f64>();
    }
    (sum / count.max(1) as f64).sqrt()
}

/// Relative errors of each edge and each volume; elements with a rest size of zero are skipped.
#[must_use]
pub fn strains(body: &Body) -> (Vec<f64>, Vec<f64>) {
    let (topology, x) = (&body.topology, &body.particles.positions);
    let edges = measure::edge_errors(topology, x).zip(&topology.edges.rest_length);
    let edges = edges.filter(|(_, rest)| **rest > 0.0);
    let volumes = measure::tetrahedron_volumes(topology, x).zip(&topology.tetrahedra.rest_volume);
    (
        edges
            .map(|(error, &rest)| error / f64::from(rest))
            .collect(),
        volumes
            .map(|(now, &rest)| now / f64::from(rest) - 1.0)
            .collect(),
    )
}
