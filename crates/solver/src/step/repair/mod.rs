//! Recovery of collapsed and inverted elements without added velocity.
//!
//! A constraint corrects an inverted element within one substep. The correction is of the order of the
//! element's size, so it would leave with a velocity of meters per millisecond, make the body explode and
//! invert neighboring elements. Instead, damaged elements and those that share a particle with them are moved
//! back to their rest shape. Solids are checked at the start of every tick, sheets without damage once per repair time.
//! What counts as damaged:
//!
//! - of a body with [`Volume`](crate::Volume): a tetrahedron below [`COLLAPSED`] of its rest volume;
//! - of a sheet (triangles, no tetrahedra) with [`Stretch`](crate::Stretch): an edge shorter than
//!   [`CRUSHED`] of its rest length; and after [`LASTING`] repair times without change, a tangled
//!   hinge: two triangles folded over by more than 120°, one of whose edges a single projection
//!   would still change by more than [`TANGLED`] of its length. Stiff edges that push against each
//!   other in a tangle neither come to rest nor separate. A fold without strain is no damage, nor
//!   is strain without a fold: where too few iterations carry a load, edges are stretched, and
//!   should remain so. For the same reason no hinge counts while the mean strain of the edges
//!   exceeds [`LOADED`]. Sheets are repaired with XPBD only, not with the methods that exist for
//!   comparison with other programs.
//!
//! Elements that share particles form a region. In each substep of length h, with the repair time T and the
//! time t that the body has been under repair:
//!
//! 1. The particles of a region move by the fraction 1 − e^(−h(1 + t/T)/T) towards the shape-matching goals
//!    gᵢ = R(qᵢ − q̄) + x̄ (Müller, Heidelberger, Teschner and Gross 2005), with velocities unchanged. Forces,
//!    constraints and contacts then act as usual.
//! 2. After this and after the third stage, velocities of a region are replaced by those of a rigid body of
//!    the same momentum and angular momentum. A region that is the whole body keeps the angular momentum from
//!    before the substep, because Σ m r × v does not measure rotation over such large corrections.
//!    Rotational energy never increases: the angular velocity is scaled down where the region has become
//!    more compact. If the body has a contact in the substep, contacts can only slow a region down.
//!
//! A region with pins gets no velocity, and pins dominate the fit. A region is released when it is within
//! [`DONE`] of its rest shape and nothing in it is tangled.
//!
//! Nothing is done while less than [`LITTLE`] of a solid or [`MANY`] of the edges of a sheet have collapsed and
//! less than [`FEW`] of its hinges are tangled: constraints recover single slivers, and moving a region among
//! vibrating neighbors disturbs them. After [`PATIENCE`] repair times recovery is suspended (pins or contacts
//! can hold elements inverted) until the body has been without repair for ten times as long.
//!
//! Cost for a body without damage: one pass per tick over its tetrahedra, or per repair time (every third tick by
//! default) over its edges; none with a repair time of ∞. Not for plastic bodies, whose rest positions are not their
//! equilibrium, and not for
//! [`NeoHookean`](crate::NeoHookean), which recovers by its own forces.

mod damage;
pub(crate) mod state;

pub(crate) use damage::Repairable;
pub use damage::{COLLAPSED, CRUSHED, LOADED, TANGLED};
pub use state::Repair;

use state::{Regions, UnderRepair};

use crate::{
    Particles, Topology,
    advance::{StepContext, Stepper},
    effects::shape_matching::HEAVY,
    fit,
    spin::Motion,
};
use glam::{DMat3, DVec3};

/// Number of repair times for which a hinge may be tangled.
pub const LASTING: f64 = 3.0;

/// Fraction of the rest volume of a solid that must have collapsed for a repair to begin.
pub const LITTLE: f64 = 0.02;

/// Fraction of the edges of a sheet, by length, that must have collapsed for a repair to begin.
/// With too few iterations, some edges are briefly crushed where a sheet swings under its weight.
pub const MANY: f64 = 0.1;

/// Change of the strain of a tangled hinge between checks below which it does not separate by
/// itself.
pub const STEADY: f64 = 0.05;

/// Fraction of the hinges of a sheet, by length, that must be tangled for a repair to begin.
pub const FEW: f64 = 0.004;

/// RMS distance from its rest shape, relative to its RMS size, at which a region is released.
pub const DONE: f64 = 0.01;

/// Number of repair times after which recovery is suspended.
pub const PATIENCE: f64 = 40.0;

/// Particles that can be repaired.
pub(crate) trait Motes {
    /// Inverse mass [1/kg].
    fn inverse_mass(&self, i: usize) -> f64;
    /// Position where a substep begins or ends [m].
    fn position(&self, i: usize) -> DVec3;
    /// Velocity [m/s].
    fn velocity(&self, i: usize) -> DVec3;
    /// Moves it [m]; its velocity does not change.
    fn shift(&mut self, i: usize, by: DVec3);
    /// Adds to its velocity [m/s].
    fn accelerate(&mut self, i: usize, change: DVec3);
}

impl Motes for Particles {
    fn inverse_mass(&self, i: usize) -> f64 {
        self.positions[i].w.into()
    }

    fn position(&self, i: usize) -> DVec3 {
        self.position(i)
    }

    fn velocity(&self, i: usize) -> DVec3 {
        self.velocity_f64(i)
    }

    fn shift(&mut self, i: usize, by: DVec3) {
        self.shift(i, by);
    }

    fn accelerate(&mut self, i: usize, change: DVec3) {
        self.accelerate(i, change);
    }
}

impl Repair {
    /// Finds damaged elements, and those still under repair, in a tick of `seconds`.
    ///
    /// An undamaged body is checked once per interval, if it `may_be_damaged`.
    pub(crate) fn look<M: Motes>(
        &mut self,
        body: &Repairable,
        seconds: f64,
        motes: &M,
        may_be_damaged: impl FnOnce(&M) -> bool,
    ) {
        let elapsed = match self.is_due(body.interval(), seconds) {
            Some(elapsed) if !self.is_empty() || may_be_damaged(motes) => elapsed,
            due => return self.recuperate(seconds, due.is_some()),
        };
        let topology = body.topology;
        let mut repair = self.under.take().unwrap_or_default();
        repair.time = body.time;
        if repair.spent > PATIENCE * body.time {
            repair.spent = 2.0 * PATIENCE * body.time;
            repair.drawn.clear();
            repair.regions.clear();
            self.under = Some(repair);
            return;
        }
        repair.drawn.resize(topology.particles(), false);
        repair.find_regions(body);
        let mut strains = std::mem::take(&mut repair.regions.strains);
        strains.clear();
        strains.resize(topology.particles(), 0.0_f32);
        body.tangles(motes, |corners, strain| {
            for &i in corners {
                let most = &mut strains[i as usize];
                *most = most.max(strain as f32);
            }
            true
        });
        for region in repair.regions.each() {
            let off = || Whole::of(region, motes).off(region, topology, motes);
            if !region.iter().any(|&i| strains[i as usize] > 0.0) && off() < DONE {
                for &i in region {
                    repair.drawn[i as usize] = false;
                }
            }
        }
        repair.count_tangles(&strains, elapsed);
        let mut damaged = std::mem::take(&mut repair.regions.damaged);
        damaged.clear();
        damaged.resize(topology.particles(), false);
        if body.collapsed(motes, |corners| mark(&mut damaged, corners)) < body.least() {
            damaged.fill(false);
        }
        if body.tangles(motes, |corners, _| repair.has_lasted(corners)) >= FEW {
            for (damaged, &strain) in damaged.iter_mut().zip(&strains) {
                *damaged |= strain > 0.0;
            }
        }
        body.each(|corners, _| {
            if corners.iter().any(|&i| damaged[i as usize]) {
                mark(&mut repair.drawn, corners);
            }
        });
        repair.regions.damaged = damaged;
        repair.regions.strains = strains;
        if repair.drawn.contains(&true) {
            repair.spent += seconds;
            repair.find_regions(body);
        } else {
            repair.drawn.clear();
            repair.recuperate(seconds);
        }
        self.under = Some(repair);
    }

    /// Moves all regions towards their rest shapes, in a substep of `h` seconds.
    pub(crate) fn draw(&mut self, topology: &Topology, h: f64, motes: &mut impl Motes) {
        let Some(repair) = &mut self.under else {
            return;
        };
        let mut motions = std::mem::take(&mut repair.regions.motions);
        motions.clear();
        let share = -(-h * (1.0 + repair.spent / repair.time) / repair.time).exp_m1();
        for region in repair.regions.each() {
            let whole = Whole::of(region, motes);
            let (rotation, rest_center) = whole.fit(region, topology, motes);
            let goal = |i: u32| rotation * (rest(topology, i) - rest_center) + whole.motion.center;
            for &i in region {
                let (i, goal) = (i as usize, goal(i));
                if motes.inverse_mass(i) > 0.0 {
                    motes.shift(i, (goal - motes.position(i)) * share);
                }
            }
            whole.stiffen(region, motes);
            motions.push((whole.velocity, whole.motion.angular, whole.turning));
        }
        repair.regions.motions = motions;
        repair.regions.touched = false;
    }

    /// Replaces the velocities of all regions by rigid motion.
    pub(crate) fn stiffen(&self, motes: &mut impl Motes) {
        let Some(repair) = &self.under else { return };
        let Regions {
            motions, touched, ..
        } = &repair.regions;
        for (region, &(before, angular, turning)) in repair.regions.each().zip(motions) {
            let mut whole = Whole::of(region, motes);
            whole.turning = turning;
            if region.len() == repair.drawn.len() {
                whole.motion.angular = angular;
            }
            let change = whole.velocity - before;
            let size = change.length_squared();
            if *touched && size > 0.0 {
                // Only as far as it slows down.
                let share = (-before.dot(change) / size).clamp(0.0, 1.0);
                whole.velocity = before + change * share;
            }
            whole.stiffen(region, motes);
        }
    }
}

impl UnderRepair {
    /// Records the strain of tangled hinges at each particle, 0 where there is none, `seconds`
    /// after the previous check.
    fn count_tangles(&mut self, strains: &[f32], seconds: f64) {
        if strains.iter().all(|&strain| strain == 0.0) {
            self.tangled.clear();
            return;
        }
        self.tangled.resize(strains.len(), [0.0; 2]);
        for ([time, before], &strain) in self.tangled.iter_mut().zip(strains) {
            let steady = strain > 0.0 && f64::from((strain - *before).abs()) < STEADY;
            (*time, *before) = (if steady { *time + seconds as f32 } else { 0.0 }, strain);
        }
    }

    /// Whether these particles have been in tangled hinges for long enough.
    fn has_lasted(&self, corners: &[u32]) -> bool {
        corners.iter().all(|&i| {
            let tangled = self.tangled.get(i as usize);
            tangled.is_some_and(|&[seconds, _]| f64::from(seconds) > LASTING * self.time)
        })
    }

    /// Advances the recovery time of a tick of `seconds` without repair.
    fn recuperate(&mut self, seconds: f64) {
        self.spent = (self.spent - 0.1 * seconds).max(0.0);
    }

    /// Finds the regions: particles under repair that share elements, each region in ascending
    /// order, regions by their first particle.
    fn find_regions(&mut self, body: &Repairable) {
        let Self { drawn, regions, .. } = self;
        let Regions {
            members,
            ends,
            parent,
            motions,
            ..
        } = regions;
        members.reserve(drawn.len());
        ends.reserve(drawn.len());
        motions.reserve(drawn.len());
        parent.clear();
        parent.extend(0..drawn.len() as u32);
        body.each(|corners, _| {
            if corners.iter().all(|&i| drawn[i as usize]) {
                for &i in &corners[1..] {
                    // The root is the smallest particle of its region.
                    let (a, b) = (root(parent, corners[0]), root(parent, i));
                    parent[a.max(b) as usize] = a.min(b);
                }
            }
        });
        members.clear();
        members.extend((0..drawn.len() as u32).filter(|&i| drawn[i as usize]));
        for &i in &*members {
            parent[i as usize] = root(parent, i);
        }
        members.sort_unstable_by_key(|&i| (parent[i as usize], i));
        let mut end = 0;
        ends.clear();
        for region in members.chunk_by(|&a, &b| parent[a as usize] == parent[b as usize]) {
            end += region.len();
            ends.push(end);
        }
    }
}

fn mark(particles: &mut [bool], corners: &[u32]) {
    for &i in corners {
        particles[i as usize] = true;
    }
}

fn root(parent: &mut [u32], mut i: u32) -> u32 {
    while parent[i as usize] != i {
        parent[i as usize] = parent[parent[i as usize] as usize];
        i = parent[i as usize];
    }
    i
}

fn rest(topology: &Topology, i: u32) -> DVec3 {
    topology.rest[i as usize].as_dvec3()
}

/// Rigid motion of a region.
struct Whole {
    /// Mass assigned to a pin [kg].
    pin: f64,
    pinned: bool,
    /// Total mass [kg].
    mass: f64,
    /// Velocity of the center of mass [m/s].
    velocity: DVec3,
    /// Motion relative to it.
    motion: Motion,
    /// Rotational energy of the motion if the region were rigid [J].
    turning: f64,
}

impl Whole {
    fn of(region: &[u32], motes: &impl Motes) -> Self {
        let weights = region.iter().map(|&i| motes.inverse_mass(i as usize));
        let light: f64 = weights.clone().filter(|w| *w > 0.0).map(|w| 1.0 / w).sum();
        let mut whole = Self {
            pin: if light > 0.0 { HEAVY * light } else { 1.0 },
            pinned: weights.into_iter().any(|w| w == 0.0),
            mass: 0.0,
            velocity: DVec3::ZERO,
            motion: Motion::default(),
            turning: 0.0,
        };
        for &i in region {
            let mass = whole.mass_of(i, motes);
            whole.mass += mass;
            whole.velocity += motes.velocity(i as usize) * mass;
        }
        whole.velocity /= whole.mass;
        whole.motion = whole.motion_of(region, motes);
        let angular = whole.motion.angular;
        let turn = whole.motion.turn_to(angular * 2.0);
        whole.turning = 0.5 * turn.dot(angular);
        whole
    }

    /// RMS distance from its rest shape, relative to its RMS size.
    fn off(&self, region: &[u32], topology: &Topology, motes: &impl Motes) -> f64 {
        let (rotation, rest_center) = self.fit(region, topology, motes);
        let (mut off, mut size) = (0.0, 0.0);
        for &i in region {
            let arm = rest(topology, i) - rest_center;
            let goal = rotation * arm + self.motion.center;
            let mass = self.mass_of(i, motes);
            off += mass * goal.distance_squared(motes.position(i as usize));
            size += mass * arm.length_squared();
        }
        (off / size).sqrt()
    }

    /// Motion of a region relative to its center of mass.
    fn motion_of(&self, region: &[u32], motes: &impl Motes) -> Motion {
        let at = |place: usize| {
            let i = region[place];
            let (x, v) = (motes.position(i as usize), motes.velocity(i as usize));
            (self.mass_of(i, motes), x, v - self.velocity)
        };
        Motion::of(at, region.len())
    }

    /// Gives a region, at its current positions, the velocities of a rigid body with the momenta
    /// that it had before; zero where it is pinned.
    fn stiffen(&self, region: &[u32], motes: &mut impl Motes) {
        let now = self.motion_of(region, motes);
        let mut turn = now.turn_to(now.angular + self.motion.angular);
        let turning = 0.5 * turn.dot(self.motion.angular);
        if turning > self.turning {
            turn *= (self.turning / turning).sqrt();
        }
        for &i in region {
            let i = i as usize;
            if motes.inverse_mass(i) > 0.0 {
                let rigid = match self.pinned {
                    true => DVec3::ZERO,
                    false => self.velocity + turn.cross(motes.position(i) - now.center),
                };
                motes.accelerate(i, rigid - motes.velocity(i));
            }
        }
    }

    fn mass_of(&self, i: u32, motes: &impl Motes) -> f64 {
        match motes.inverse_mass(i as usize) {
            w if w > 0.0 => 1.0 / w,
            _ => self.pin,
        }
    }

    /// Best-fit rotation of the rest shape, and the center of mass of that [m].
    fn fit(&self, region: &[u32], topology: &Topology, motes: &impl Motes) -> (DMat3, DVec3) {
        let terms = region
            .iter()
            .map(|&i| rest(topology, i) * self.mass_of(i, motes));
        let center = terms.sum::<DVec3>() / self.mass;
        let each = || region.iter();
        let from = each().map(|&i| (rest(topology, i) - center) * self.mass_of(i, motes));
        let to = each().map(|&i| motes.position(i as usize) - self.motion.center);
        (fit::rotation_between(from, to), center)
    }
}

impl Stepper<'_> {
    /// Begins a tick: checks for damage.
    pub(crate) fn look_for_damage(&mut self, context: &StepContext) {
        let settings = context.settings;
        let Some(body) = Repairable::of(self.effects, self.topology, settings) else {
            self.particles.repair = Repair::default();
            return;
        };
        let seconds = settings.tick_seconds();
        let mut repair = std::mem::take(&mut self.particles.repair);
        repair.look(&body, seconds, &*self.particles, |particles| {
            body.may_be_damaged(particles, context.instructions)
        });
        self.particles.repair = repair;
    }

    /// Begins a substep: moves particles under repair towards their rest shape.
    pub(crate) fn draw(&mut self, context: &StepContext) {
        let particles = &mut *self.particles;
        if !particles.repair.is_empty() {
            let mut repair = std::mem::take(&mut particles.repair);
            let h = context.settings.substep_seconds();
            repair.draw(self.topology, h, particles);
            particles.repair = repair;
        }
    }

    /// Ends a substep: makes the motion of particles under repair rigid.
    pub(crate) fn stiffen(&mut self) {
        let particles = &mut *self.particles;
        if !particles.repair.is_empty() {
            let repair = std::mem::take(&mut particles.repair);
            repair.stiffen(particles);
            particles.repair = repair;
        }
    }
}
