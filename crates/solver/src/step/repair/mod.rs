//! Recovery of collapsed and inverted elements without added velocity.
//!
//! A constraint corrects an inverted element within one substep. The correction is of the order of
//! the element's size, so it would leave with a velocity of meters per millisecond, make the body
//! explode and invert neighboring elements. Instead, damaged elements and those that share a
//! particle with them are moved back to their rest shape. Solids are checked at the start of every
//! tick, sheets without damage once per repair time. What counts as damaged:
//!
//! - of a body with [`Volume`](crate::Volume): a tetrahedron below [`COLLAPSED`] of its rest
//!   volume;
//! - of a sheet (triangles, no tetrahedra) with [`Stretch`](crate::Stretch): an edge shorter than
//!   [`CRUSHED`] of its rest length; and after [`MIN_TANGLED_TIME`] repair times without change, a
//!   tangled hinge: two triangles folded over by more than 120°, one of whose edges a single
//!   projection would still change by more than [`TANGLED`] of its length. Stiff edges that push
//!   against each other in a tangle neither come to rest nor separate. A fold without strain is no
//!   damage, nor is strain without a fold: where too few iterations carry a load, edges are
//!   stretched, and should remain so. For the same reason no hinge counts while the mean strain of
//!   the edges exceeds [`LOADED`]. Sheets are repaired with XPBD only, not with the methods that
//!   exist for comparison with other programs.
//!
//! Elements that share particles form a region. In each substep of length h, with the repair time T
//! and the time t that the body has been under repair:
//!
//! 1. The particles of a region move by the fraction 1 − e^(−h(1 + t/T)/T) towards the
//!    shape-matching goals gᵢ = R(qᵢ − q̄) + x̄ (Müller, Heidelberger, Teschner and Gross 2005),
//!    with velocities unchanged. Forces, constraints and contacts then act as usual.
//! 2. After this and after the third stage, velocities of a region are replaced by those of a rigid
//!    body of the same momentum and angular momentum. A region that is the whole body keeps the
//!    angular momentum from before the substep, because Σ m r × v does not measure rotation over
//!    such large corrections. Rotational energy never increases: the angular velocity is scaled
//!    down where the region has become more compact. If the body has a contact in the substep,
//!    contacts can only slow a region down.
//!
//! A region with pins gets no velocity, and pins dominate the fit. A region is released when it is
//! within [`RELEASE_DEVIATION`] of its rest shape and nothing in it is tangled.
//!
//! Nothing is done while less than [`MIN_COLLAPSED_VOLUME`] of a solid or [`MIN_COLLAPSED_LENGTH`]
//! of the edges of a sheet have collapsed and less than [`MIN_TANGLED_LENGTH`] of its hinges are
//! tangled: constraints recover single slivers, and moving a region among vibrating neighbors
//! disturbs them. After [`MAX_REPAIR_TIME`] repair times recovery is suspended (pins or contacts
//! can hold elements inverted) until the body has been without repair for ten times as long.
//!
//! Cost for a body without damage, in lanes and on all threads that step it: one pass per tick over
//! its tetrahedra, or per repair time (every third tick by default) over its edges, and if one of
//! these may be tangled, another over edges and hinges; two more where a hinge is tangled. None with
//! a repair time of ∞. Not for plastic bodies, whose rest positions are not their equilibrium, and not
//! for [`NeoHookean`](crate::NeoHookean), which recovers by its own forces.

mod damage;

pub use crate::particles::repair::Repair;
pub use damage::{COLLAPSED, CRUSHED, LOADED, TANGLED};
pub(crate) use damage::{OneByOne, Repairable};

use damage::Search;

use crate::{
    Particles, Topology,
    advance::{StepContext, Stepper},
    effects::shape_matching::HEAVY,
    fit,
    particles::repair::{Regions, UnderRepair},
    spin::Motion,
};
use glam::{DMat3, DVec3};

/// Number of repair times after which a tangled hinge counts as damaged.
pub const MIN_TANGLED_TIME: f64 = 3.0;

/// Fraction of the rest volume of a solid that must have collapsed for a repair to begin.
pub const MIN_COLLAPSED_VOLUME: f64 = 0.02;

/// Fraction of the edges of a sheet, by length, that must have collapsed for a repair to begin.
/// With too few iterations, some edges are briefly crushed where a sheet swings under its weight.
pub const MIN_COLLAPSED_LENGTH: f64 = 0.1;

/// Change of the strain of a tangled hinge between checks below which it does not separate by
/// itself.
pub const MAX_TANGLE_CHANGE: f64 = 0.05;

/// Fraction of the hinges of a sheet, by length, that must be tangled for a repair to begin.
pub const MIN_TANGLED_LENGTH: f64 = 0.004;

/// RMS distance from its rest shape, relative to its RMS size, at which a region is released.
pub const RELEASE_DEVIATION: f64 = 0.01;

/// Number of repair times after which recovery is suspended.
pub const MAX_REPAIR_TIME: f64 = 40.0;

/// Access to the particles of a body under repair.
pub(crate) trait ParticleAccess: Sync {
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

impl ParticleAccess for Particles {
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
    /// An undamaged body is checked once per interval.
    pub(crate) fn check<M: ParticleAccess>(
        &mut self,
        body: &Repairable,
        seconds: f64,
        particles: &M,
        search: &impl Search<M>,
    ) {
        let elapsed = match self.is_due(body.interval(), seconds) {
            Some(elapsed) if !self.is_empty() || search.may_be_damaged(body, particles) => elapsed,
            due => return self.cool_down(seconds, due.is_some()),
        };
        let topology = body.topology;
        let mut repair = self.under.take().unwrap_or_default();
        repair.time = body.time;
        if repair.spent > MAX_REPAIR_TIME * body.time {
            repair.spent = 2.0 * MAX_REPAIR_TIME * body.time;
            repair.drawn.clear();
            repair.regions.clear();
            self.under = Some(repair);
            return;
        }
        if repair.drawn.is_empty() && !search.may_need_repair(body, particles) {
            repair.tangled.clear();
            repair.regions.clear();
            repair.cool_down(seconds);
            self.under = Some(repair);
            return;
        }
        let survey = search.survey(body, particles);
        repair.drawn.resize(topology.particles(), false);
        if repair.drawn.contains(&true) {
            repair.find_regions(body);
        } else {
            repair.regions.clear();
        }
        let mut strains = std::mem::take(&mut repair.regions.strains);
        strains.clear();
        strains.resize(topology.particles(), 0.0_f32);
        let tangled = body.tangles(
            particles,
            (search, survey.mean_change),
            |corners, strain| {
                for &i in corners {
                    let largest = &mut strains[i as usize];
                    *largest = largest.max(strain as f32);
                }
                true
            },
        );
        for region in repair.regions.each() {
            let deviation =
                || RegionMotion::of(region, particles).deviation(region, topology, particles);
            if !region.iter().any(|&i| strains[i as usize] > 0.0) && deviation() < RELEASE_DEVIATION
            {
                for &i in region {
                    repair.drawn[i as usize] = false;
                }
            }
        }
        repair.count_tangles(&strains, elapsed);
        let mut damaged = std::mem::take(&mut repair.regions.damaged);
        damaged.clear();
        damaged.resize(topology.particles(), false);
        let mut collapsed = || body.collapsed(particles, |corners| mark(&mut damaged, corners));
        // A hundredth is more than the rounding of the survey.
        let is_clear = survey.collapsed < 0.99 * body.min_collapsed();
        if is_clear || collapsed() < body.min_collapsed() {
            damaged.fill(false);
        }
        let lasting = || {
            body.tangles(particles, (search, survey.mean_change), |corners, _| {
                repair.has_lasted(corners)
            })
        };
        if tangled >= MIN_TANGLED_LENGTH && lasting() >= MIN_TANGLED_LENGTH {
            for (damaged, &strain) in damaged.iter_mut().zip(&strains) {
                *damaged |= strain > 0.0;
            }
        }
        if damaged.contains(&true) {
            body.each(|corners, _| {
                if corners.iter().any(|&i| damaged[i as usize]) {
                    mark(&mut repair.drawn, corners);
                }
            });
        }
        repair.regions.damaged = damaged;
        repair.regions.strains = strains;
        if repair.drawn.contains(&true) {
            repair.spent += seconds;
            repair.find_regions(body);
        } else {
            repair.drawn.clear();
            repair.cool_down(seconds);
        }
        self.under = Some(repair);
    }

    /// Moves all regions towards their rest shapes, in a substep of `h` seconds.
    pub(crate) fn move_regions(
        &mut self,
        topology: &Topology,
        h: f64,
        particles: &mut impl ParticleAccess,
    ) {
        let Some(repair) = &mut self.under else {
            return;
        };
        let mut motions = std::mem::take(&mut repair.regions.motions);
        motions.clear();
        let fraction = -(-h * (1.0 + repair.spent / repair.time) / repair.time).exp_m1();
        for region in repair.regions.each() {
            let rigid = RegionMotion::of(region, particles);
            let (rotation, rest_center) = rigid.fit(region, topology, particles);
            let goal = |i: u32| rotation * (rest(topology, i) - rest_center) + rigid.motion.center;
            for &i in region {
                let (i, goal) = (i as usize, goal(i));
                if particles.inverse_mass(i) > 0.0 {
                    particles.shift(i, (goal - particles.position(i)) * fraction);
                }
            }
            rigid.make_rigid(region, particles);
            motions.push((
                rigid.velocity,
                rigid.motion.angular,
                rigid.rotational_energy,
            ));
        }
        repair.regions.motions = motions;
        repair.regions.touched = false;
    }

    /// Replaces the velocities of all regions by rigid motion.
    pub(crate) fn make_rigid(&self, particles: &mut impl ParticleAccess) {
        let Some(repair) = &self.under else { return };
        let Regions {
            motions, touched, ..
        } = &repair.regions;
        for (region, &(before, angular, energy)) in repair.regions.each().zip(motions) {
            let mut rigid = RegionMotion::of(region, particles);
            rigid.rotational_energy = energy;
            if region.len() == repair.drawn.len() {
                rigid.motion.angular = angular;
            }
            let change = rigid.velocity - before;
            let size = change.length_squared();
            if *touched && size > 0.0 {
                // Contacts can only slow it down.
                let fraction = (-before.dot(change) / size).clamp(0.0, 1.0);
                rigid.velocity = before + change * fraction;
            }
            rigid.make_rigid(region, particles);
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
            let steady = strain > 0.0 && f64::from((strain - *before).abs()) < MAX_TANGLE_CHANGE;
            (*time, *before) = (if steady { *time + seconds as f32 } else { 0.0 }, strain);
        }
    }

    /// Whether these particles have been in tangled hinges for long enough.
    fn has_lasted(&self, corners: &[u32]) -> bool {
        corners.iter().all(|&i| {
            let tangled = self.tangled.get(i as usize);
            tangled.is_some_and(|&[seconds, _]| f64::from(seconds) > MIN_TANGLED_TIME * self.time)
        })
    }

    /// Finds the regions: particles under repair that share elements, each region in ascending
    /// order, regions by their first particle.
    fn find_regions(&mut self, body: &Repairable) {
        let Self { drawn, regions, .. } = self;
        let Regions {
            particles,
            ends,
            parent,
            motions,
            ..
        } = regions;
        particles.reserve(drawn.len());
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
        particles.clear();
        particles.extend((0..drawn.len() as u32).filter(|&i| drawn[i as usize]));
        for &i in &*particles {
            parent[i as usize] = root(parent, i);
        }
        particles.sort_unstable_by_key(|&i| (parent[i as usize], i));
        let mut end = 0;
        ends.clear();
        for region in particles.chunk_by(|&a, &b| parent[a as usize] == parent[b as usize]) {
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
struct RegionMotion {
    /// Mass assigned to a pin [kg].
    pin_mass: f64,
    pinned: bool,
    /// Total mass [kg].
    mass: f64,
    /// Velocity of the center of mass [m/s].
    velocity: DVec3,
    /// Motion relative to it.
    motion: Motion,
    /// Rotational energy of the motion if the region were rigid [J].
    rotational_energy: f64,
}

impl RegionMotion {
    fn of(region: &[u32], particles: &impl ParticleAccess) -> Self {
        let weights = region.iter().map(|&i| particles.inverse_mass(i as usize));
        let movable: f64 = weights.clone().filter(|w| *w > 0.0).map(|w| 1.0 / w).sum();
        let mut rigid = Self {
            pin_mass: if movable > 0.0 { HEAVY * movable } else { 1.0 },
            pinned: weights.into_iter().any(|w| w == 0.0),
            mass: 0.0,
            velocity: DVec3::ZERO,
            motion: Motion::default(),
            rotational_energy: 0.0,
        };
        for &i in region {
            let mass = rigid.mass_of(i, particles);
            rigid.mass += mass;
            rigid.velocity += particles.velocity(i as usize) * mass;
        }
        rigid.velocity /= rigid.mass;
        rigid.motion = rigid.motion_of(region, particles);
        let angular = rigid.motion.angular;
        let turn = rigid.motion.rotation_to(angular * 2.0);
        rigid.rotational_energy = 0.5 * turn.dot(angular);
        rigid
    }

    /// RMS distance from its rest shape, relative to its RMS size.
    fn deviation(
        &self,
        region: &[u32],
        topology: &Topology,
        particles: &impl ParticleAccess,
    ) -> f64 {
        let (rotation, rest_center) = self.fit(region, topology, particles);
        let (mut distance, mut size) = (0.0, 0.0);
        for &i in region {
            let arm = rest(topology, i) - rest_center;
            let goal = rotation * arm + self.motion.center;
            let mass = self.mass_of(i, particles);
            distance += mass * goal.distance_squared(particles.position(i as usize));
            size += mass * arm.length_squared();
        }
        (distance / size).sqrt()
    }

    /// Motion of a region relative to its center of mass.
    fn motion_of(&self, region: &[u32], particles: &impl ParticleAccess) -> Motion {
        let at = |place: usize| {
            let i = region[place];
            let (x, v) = (
                particles.position(i as usize),
                particles.velocity(i as usize),
            );
            (self.mass_of(i, particles), x, v - self.velocity)
        };
        Motion::of(at, region.len())
    }

    /// Gives a region, at its current positions, the velocities of a rigid body with the momenta
    /// that it had before; zero where it is pinned.
    fn make_rigid(&self, region: &[u32], particles: &mut impl ParticleAccess) {
        let now = self.motion_of(region, particles);
        let mut turn = now.rotation_to(now.angular + self.motion.angular);
        let energy = 0.5 * turn.dot(self.motion.angular);
        if energy > self.rotational_energy {
            turn *= (self.rotational_energy / energy).sqrt();
        }
        for &i in region {
            let i = i as usize;
            if particles.inverse_mass(i) > 0.0 {
                let rigid = match self.pinned {
                    true => DVec3::ZERO,
                    false => self.velocity + turn.cross(particles.position(i) - now.center),
                };
                particles.accelerate(i, rigid - particles.velocity(i));
            }
        }
    }

    fn mass_of(&self, i: u32, particles: &impl ParticleAccess) -> f64 {
        match particles.inverse_mass(i as usize) {
            w if w > 0.0 => 1.0 / w,
            _ => self.pin_mass,
        }
    }

    /// Best-fit rotation of the rest shape, and the center of mass of that [m].
    fn fit(
        &self,
        region: &[u32],
        topology: &Topology,
        particles: &impl ParticleAccess,
    ) -> (DMat3, DVec3) {
        let terms = region
            .iter()
            .map(|&i| rest(topology, i) * self.mass_of(i, particles));
        let center = terms.sum::<DVec3>() / self.mass;
        let each = || region.iter();
        let from = each().map(|&i| (rest(topology, i) - center) * self.mass_of(i, particles));
        let to = each().map(|&i| particles.position(i as usize) - self.motion.center);
        (fit::rotation_between(from, to), center)
    }
}

impl Stepper<'_> {
    /// Begins a tick: checks for damage.
    pub(crate) fn check_damage(&mut self, context: &StepContext) {
        let settings = context.settings;
        let Some(body) = Repairable::of(self.effects, self.topology, settings) else {
            self.particles.repair = Repair::default();
            return;
        };
        let seconds = settings.tick_seconds();
        let mut repair = std::mem::take(&mut self.particles.repair);
        let search = (context.instructions, context.threads);
        repair.check(&body, seconds, &*self.particles, &search);
        self.particles.repair = repair;
    }

    /// Begins a substep: moves particles under repair towards their rest shape.
    pub(crate) fn move_repaired(&mut self, context: &StepContext) {
        let particles = &mut *self.particles;
        if !particles.repair.is_empty() {
            let mut repair = std::mem::take(&mut particles.repair);
            let h = context.settings.substep_seconds();
            repair.move_regions(self.topology, h, particles);
            particles.repair = repair;
        }
    }

    /// Ends a substep: makes the motion of particles under repair rigid.
    pub(crate) fn end_repair(&mut self) {
        let particles = &mut *self.particles;
        if !particles.repair.is_empty() {
            let repair = std::mem::take(&mut particles.repair);
            repair.make_rigid(particles);
            particles.repair = repair;
        }
    }
}
