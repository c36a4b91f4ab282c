//! Watches a world, tick by tick, for what must hold whatever is done to it: every number finite,
//! no energy out of nothing, pins exactly still, the momentum of free bodies constant.
//!
//! It only looks: whoever steps the world, a run without a window or the window itself, shows it
//! each state.

use super::{Figure, Outside, energy::Energy};
use crate::solver::{Body, ElasticKind, Particles, World, measure};
use glam::{DVec3, Vec4};

/// Half an ulp of 1 in f32: a number x is rounded by at most this times |x|.
pub const ROUNDING: f64 = 1.0 / 16_777_216.0;

/// Energy may exceed what was there by this share of it.
const MORE_ENERGY: f64 = 0.01;

/// Momentum may differ by this share of what the particles carry.
const MOMENTUM: f64 = 1e-5;

/// What a world was like at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Time since the start [s].
    pub time: f64,
    /// Its energy.
    pub energy: Energy,
    /// Root mean square of the edges' C over their lengths, and of the volumes' over theirs.
    pub strain: f64,
}

/// What has been seen of a world.
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
    pins: Vec<Vec<(usize, Vec4)>>,
    pins_moved: f64,
    quarantined: usize,
    floors: Floors,
}

/// Momentum of free bodies.
#[derive(Debug, Clone, Copy, Default)]
struct Momentum {
    start: DVec3,
    gravity: DVec3,
    /// Largest distance from what it must be [kg·m/s].
    off: f64,
    /// Largest Σm‖v‖ [kg·m/s].
    carried: f64,
    /// Largest ‖Σmv‖ [kg·m/s].
    most: f64,
}

/// What rounding to f32 adds. Positions are exact to f64 (position and carry); what is rounded are displacements in a
/// substep, and lengths in constraints.
#[derive(Debug, Clone, Copy, Default)]
struct Floors {
    mass: f64,
    particles: f64,
    /// Constraints on a particle, times iterations, on average.
    moves: f64,
    /// Largest displacement in a substep, per second [m/s].
    speed: f64,
    /// Longest edge seen [m].
    length: f64,
    substeps: f64,
    h: f64,
}

impl Watch {
    /// Begins with a world as it is. `outside` says what else is done to it; `filming` that positions
    /// are to be kept.
    #[must_use]
    pub fn new(world: &World, outside: Outside, filming: bool) -> Self {
        let bodies = || world.bodies.iter();
        let free =
            outside == Outside::Nothing && world.colliders.is_empty() && bodies().all(is_free);
        let total = |each: &dyn Fn(&Body) -> f64| bodies().map(each).sum::<f64>();
        let particles = total(&|body| body.particles.len() as f64).max(1.0);
        let corners = total(&|body| corners(body) as f64);
        let sweeps = f64::from(world.settings.iterations.get());
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
            pins: bodies().map(|body| pinned(&body.particles)).collect(),
            pins_moved: 0.0,
            quarantined: 0,
            floors: Floors {
                mass: total(&|body| mass(&body.particles)),
                particles,
                moves: corners / particles * sweeps,
                ..Floors::default()
            },
        };
        watch.look(world);
        watch
    }

    /// Sees the world after a tick.
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
        for (body, pins) in world.bodies.iter().zip(&self.pins) {
            for &(particle, place) in pins {
                let now = body.particles.positions[particle];
                let moved = (now - place).truncate().as_dvec3().length();
                self.pins_moved = self.pins_moved.max(moved);
            }
        }
        let caught = world.bodies.iter().filter(|body| body.quarantine.is_some());
        self.quarantined = self.quarantined.max(caught.count());
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
        if self.pins.iter().any(|pins| !pins.is_empty()) {
            figures.push(Figure::new("way of the pins", self.pins_moved, 0.0, "m"));
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

    /// Largest speed of the centre of mass [m/s].
    fn flight(&self) -> f64 {
        if self.floors.mass > 0.0 {
            self.momentum.most / self.floors.mass
        } else {
            0.0
        }
    }

    /// How much more energy there ever was than when it was first known.
    fn energy(&self) -> Figure {
        let known = self
            .moments
            .iter()
            .position(|moment| moment.energy.is_known());
        let after = &self.moments[known.unwrap_or(self.moments.len())..];
        let start = after.first().map_or(0.0, |moment| moment.energy.total());
        let most = after.iter().map(|moment| moment.energy.mechanical());
        let more = most.fold(start, f64::max) - start - self.floors.energy(self.flight());
        // A share of what moves and is stored, not of a height above the origin.
        let energies = after.iter().map(|moment| moment.energy);
        let scale = energies.map(|e| e.kinetic + e.elastic).fold(0.0, f64::max);
        let share = if more > 0.0 { more / scale } else { 0.0 };
        let finite = self
            .moments
            .iter()
            .all(|moment| moment.energy.total().is_finite());
        let share = if finite { share } else { f64::NAN };
        Figure::new("energy gained", share * 100.0, MORE_ENERGY * 100.0, "%")
    }
}

impl Floors {
    /// Each of the 2 + k roundings of a displacement u in a substep (the prediction, the velocity, and one for each of
    /// the k constraints on it and iterations) changes a velocity by up to ε‖u‖/h in each of three directions.
    fn kick(&self) -> f64 {
        ROUNDING * self.speed
    }

    /// A constraint of a length l is rounded by up to εl, and displacements in the course of the iterations can be as long.
    fn constraint_kick(&self) -> f64 {
        self.kick() + ROUNDING * self.length / self.h
    }

    /// Independent kicks add in their squares: ½m · 3(2 + k)n (ε(‖u‖ + l)/h)² after n substeps. Those of
    /// an even flight at a speed v add up to nε‖u‖/h, and so to mv times that.
    fn energy(&self, flight: f64) -> f64 {
        let kicks = 3.0 * (2.0 + self.moves) * self.substeps.max(1.0);
        let apart = 0.5 * self.mass * kicks * self.constraint_kick().powi(2);
        apart + self.mass * flight * self.substeps * self.kick()
    }

    /// A particle that flies evenly is rounded alike in each substep, so that the kicks of the
    /// prediction add up: mnε‖u‖/h. Those of constraints have no direction: of N particles in n
    /// substeps they add like √(3kn/N), and four times that is not exceeded by chance.
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

/// Corners of all constraints: how often a sweep moves a particle, added up.
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

/// C over the rest value of each edge, and of each volume; what has no size at rest is left out.
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
