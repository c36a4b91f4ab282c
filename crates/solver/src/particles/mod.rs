//! The state of a body.

pub(crate) mod emission;
pub(crate) mod history;
pub(crate) mod repair;
pub(crate) mod segment;
pub(crate) mod surface_force;

use emission::Emission;
use glam::{DVec3, Vec3, Vec4};
use history::History;
use repair::Repair;
use segment::SegmentState;
use serde::{Deserialize, Serialize};
use surface_force::Pushes;

/// Length of a substep [s] before the first one: that of default settings.
const FIRST_SUBSTEP: f32 = 1.0 / 600.0;

/// Largest coordinate [m] at which a scene places bodies, and at which bodies touch. The boxes by
/// which crossings are found have single precision: farther out, all of them overlap.
pub const MAX_COORDINATE: f64 = 1e5;

/// Particles as columns of 16-byte elements.
///
/// The state of a body: its particles. All other data of a body is constant or derived.
///
/// A particle is at p + c at the start of a substep, and at p + u within it: p is a position in
/// `f32`, u the displacement from it, and c, the carry, the rounding error of the position.
/// Constraints thus operate on small numbers, and motion is not lost however short a substep is:
/// for two neighbors, the difference (pᵢ − pⱼ) + (uᵢ − uⱼ) has the rounding error of a
/// displacement, not of a position. The velocity is (u − c)/h; it is not stored.
///
/// Invariant between substeps: u = c + hv is the displacement by inertia alone. The first stage
/// adds gravity to u, constraints and contacts write u, and the third stage advances the position
/// by it.
///
/// ```
/// use glam::{DVec3, Vec3};
/// use pliant_solver::Particles;
///
/// let mut particles = Particles::at_rest([Vec3::ZERO, Vec3::X].into_iter()); // m
/// particles.set_position(1, DVec3::X * 2.0); // m
/// particles.set_velocity(1, Vec3::Y); // m/s
/// assert_eq!(particles.position(1), DVec3::X * 2.0);
/// assert_eq!(particles.velocity(1), Vec3::Y);
/// ```
#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "bevy", derive(bevy_ecs::component::Component))]
pub struct Particles {
    /// Position p at the start of the substep, or between substeps, in xyz [m]; inverse mass in w
    /// [1/kg], 0 is pinned.
    pub positions: Vec<Vec4>,
    /// Displacement u from `positions` in xyz [m]; w is 0.
    pub displacements: Vec<Vec4>,
    /// Carry c in xyz [m], the rounding error of `positions`; w is 0.
    pub carry: Vec<Vec4>,
    /// Length of the substep for the displacements [s].
    h: f32,
    /// State one substep ago, for [second-order steps](crate::History).
    pub history: History,
    /// [Repair](crate::repair) state of the body.
    pub repair: Repair,
    /// The segments of a [rod](crate::Rod); empty without one, and until its first tick.
    pub segments: Vec<SegmentState>,
    /// Rotation of the [grains](crate::Grains) that rotate: radius times angular velocity in xyz
    /// [m/s], the radius in w [m]; empty for all others, and until the first tick.
    pub spins: Vec<Vec4>,
    /// What its emitters have emitted, and where it comes from if it is a copy of a body.
    pub emission: Emission,
}

impl Clone for Particles {
    fn clone(&self) -> Self {
        let mut copy = Self::default();
        copy.clone_from(self);
        copy
    }

    /// Reuses allocations.
    fn clone_from(&mut self, from: &Self) {
        let Self {
            positions,
            displacements,
            carry,
            h,
            history,
            repair,
            segments,
            spins,
            emission,
        } = self;
        positions.clone_from(&from.positions);
        displacements.clone_from(&from.displacements);
        carry.clone_from(&from.carry);
        *h = from.h;
        history.clone_from(&from.history);
        repair.clone_from(&from.repair);
        segments.clone_from(&from.segments);
        spins.clone_from(&from.spins);
        emission.clone_from(&from.emission);
    }
}

impl Default for Particles {
    fn default() -> Self {
        Self {
            positions: Vec::new(),
            displacements: Vec::new(),
            carry: Vec::new(),
            h: FIRST_SUBSTEP,
            history: History::default(),
            repair: Repair::default(),
            segments: Vec::new(),
            spins: Vec::new(),
            emission: Emission::default(),
        }
    }
}

impl Particles {
    /// Particles at rest at the given positions [m], with inverse masses of zero.
    #[must_use]
    pub fn at_rest(positions: impl Iterator<Item = Vec3>) -> Self {
        let positions: Vec<Vec4> = positions.map(|x| x.extend(0.0)).collect();
        Self {
            displacements: vec![Vec4::ZERO; positions.len()],
            carry: vec![Vec4::ZERO; positions.len()],
            positions,
            ..Self::default()
        }
    }

    /// Position of a particle at the start of a substep, or between substeps [m]: p + c.
    #[must_use]
    pub fn position(&self, i: usize) -> DVec3 {
        wide(self.positions[i]) + wide(self.carry[i])
    }

    /// Position of a particle within a substep [m]: p + u. Between substeps, the position that
    /// inertia alone would give it after the next one.
    #[must_use]
    pub fn predicted(&self, i: usize) -> DVec3 {
        wide(self.positions[i]) + wide(self.displacements[i])
    }

    /// Velocity of a particle [m/s]: (u − c)/h.
    #[must_use]
    pub fn velocity(&self, i: usize) -> Vec3 {
        self.velocity_f64(i).as_vec3()
    }

    /// The same without rounding.
    #[must_use]
    pub fn velocity_f64(&self, i: usize) -> DVec3 {
        self.motion(i) / f64::from(self.h)
    }

    /// Velocities of all particles [m/s].
    pub fn velocities(&self) -> impl ExactSizeIterator<Item = Vec3> + Clone + '_ {
        (0..self.len()).map(|i| self.velocity(i))
    }

    /// Displacement of a particle in a substep [m]: u − c.
    #[must_use]
    pub fn motion(&self, i: usize) -> DVec3 {
        wide(self.displacements[i]) - wide(self.carry[i])
    }

    /// Sets the velocity of a particle [m/s]. A pinned one loses it in the next substep.
    pub fn set_velocity(&mut self, i: usize, velocity: Vec3) {
        let motion = velocity.as_dvec3() * f64::from(self.h);
        let displacement = wide(self.carry[i]) + motion;
        self.displacements[i] = displacement.as_vec3().extend(0.0);
    }

    /// Adds to the velocity of a particle [m/s]. The rounding error of the displacement does not
    /// affect it.
    pub fn accelerate(&mut self, i: usize, change: DVec3) {
        let state = [self.displacements[i], self.carry[i]];
        [self.displacements[i], self.carry[i]] = accelerated(state, change * f64::from(self.h));
    }

    /// Sets the position of a particle [m]; its velocity does not change.
    pub fn set_position(&mut self, i: usize, position: DVec3) {
        let motion = self.motion(i);
        let rounded = position.as_vec3();
        let carry = position - rounded.as_dvec3();
        self.positions[i] = rounded.extend(self.positions[i].w);
        self.carry[i] = carry.as_vec3().extend(0.0);
        self.displacements[i] = (carry + motion).as_vec3().extend(0.0);
    }

    /// Moves a particle before a substep [m]; its velocity does not change. The displacement goes
    /// into the carry, so that contacts do not treat the old position as its start.
    pub(super) fn shift(&mut self, i: usize, by: DVec3) {
        let motion = self.motion(i);
        let carry = (wide(self.carry[i]) + by).as_vec3();
        self.carry[i] = carry.extend(0.0);
        self.displacements[i] = (carry.as_dvec3() + motion).as_vec3().extend(0.0);
    }

    /// Moves a pinned particle within a substep [m], after its first stage.
    pub fn move_pin(&mut self, i: usize, by: DVec3) {
        let u = wide(self.displacements[i]) + by;
        self.displacements[i] = u.as_vec3().extend(0.0);
    }

    /// Sets the velocity of all particles to zero.
    pub fn stop(&mut self) {
        self.displacements.clone_from(&self.carry);
        for segment in &mut self.segments {
            segment.angular_velocity = DVec3::ZERO;
        }
        for spin in &mut self.spins {
            *spin = Vec4::ZERO.with_w(spin.w);
        }
    }

    /// Grains of these radii [m] rotate, except pinned ones, or nothing does.
    pub(super) fn allow_rotation(&mut self, radii: Option<&[f32]>) {
        let radii = radii.unwrap_or_default();
        if self.spins.len() != radii.len() {
            self.spins.clear();
            self.spins.resize(radii.len(), Vec4::ZERO);
        }
        let grains = self.spins.iter_mut().zip(radii).zip(&self.positions);
        for ((spin, &radius), x) in grains {
            *spin = match x.w {
                0.0 => Vec4::ZERO.with_w(radius),
                _ => spin.with_w(radius),
            };
        }
    }

    /// Sets all particles to rest exactly at `positions`; must be called after writing these.
    pub fn settle(&mut self) {
        let count = self.positions.len();
        for column in [&mut self.displacements, &mut self.carry] {
            column.clear();
            column.resize(count, Vec4::ZERO);
        }
        self.segments.clear();
        self.spins.clear();
        self.history.forget();
        self.repair = Repair::default();
    }

    /// Replaces the positions by the given ones [m], at rest.
    pub fn restore_at_rest(&mut self, positions: &[Vec4]) {
        self.positions.clear();
        self.positions.extend_from_slice(positions);
        self.settle();
    }

    /// Whether all particles have zero velocity, and no grain rotates.
    #[must_use]
    pub fn is_still(&self) -> bool {
        let rotates = |spin: &Vec4| spin.truncate() != Vec3::ZERO;
        self.displacements == self.carry && !self.spins.iter().any(rotates)
    }

    /// Length of the substep for the displacements [s].
    #[must_use]
    pub fn substep_seconds(&self) -> f32 {
        self.h
    }

    /// Converts displacements to a substep of another length [s]; velocities do not change.
    pub fn set_substep_seconds(&mut self, h: f32) {
        if self.h == h {
            return;
        }
        let longer = f64::from(h) / f64::from(self.h);
        for i in 0..self.len() {
            let displacement = wide(self.carry[i]) + self.motion(i) * longer;
            self.displacements[i] = displacement.as_vec3().extend(0.0);
        }
        self.h = h;
    }

    /// The same if displacements are overwritten anyway.
    pub(super) fn begin_with_substep(&mut self, h: f32) {
        self.h = h;
    }

    /// Records a contact in the current substep.
    pub fn touch(&mut self) {
        self.history.touch();
        self.repair.touch();
    }

    /// All particles, for stepping.
    #[must_use]
    pub fn as_part(&mut self) -> Part<'_> {
        Part {
            positions: &mut self.positions,
            displacements: &mut self.displacements,
            carry: &mut self.carry,
            segments: &mut self.segments,
            spins: &mut self.spins,
            pushes: &mut [],
        }
    }

    /// Moves all particles by `offset` [m], exactly; velocities do not change.
    pub fn translate(&mut self, offset: DVec3) {
        for i in 0..self.len() {
            self.set_position(i, self.position(i) + offset);
        }
    }

    /// A copy with nothing but positions.
    pub(super) fn only_positions(&self) -> Self {
        Self {
            positions: self.positions.clone(),
            ..Self::default()
        }
    }

    /// Number of particles.
    #[must_use]
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The columns with their names.
    #[must_use]
    pub fn columns(&self) -> [(&'static str, &[Vec4]); 3] {
        [
            ("positions", &self.positions),
            ("displacements", &self.displacements),
            ("carries", &self.carry),
        ]
    }

    /// Index of the first particle whose position or velocity is not finite.
    #[must_use]
    pub fn first_not_finite(&self) -> Option<usize> {
        [
            first_not_finite(&self.positions, 1.0),
            first_not_finite(&self.displacements, 1.0 / self.h),
            first_not_finite(&self.carry, 1.0),
            first_not_finite(&self.spins, 1.0),
        ]
        .into_iter()
        .flatten()
        .min()
    }

    /// Index of the first particle that cannot be stepped in a body of `count`: it is missing in a
    /// column or not finite. The last one if a column is too long.
    #[must_use]
    pub fn first_unfit(&self, count: usize) -> Option<usize> {
        let columns = [&self.positions, &self.displacements, &self.carry];
        if columns.iter().all(|column| column.len() == count) {
            return self.first_not_finite();
        }
        let shortest = columns.iter().map(|column| column.len()).min().unwrap_or(0);
        Some(shortest.min(count.saturating_sub(1)))
    }
}

/// A contiguous range of the particles of a body.
#[derive(Debug)]
pub struct Part<'a> {
    /// As [`Particles::positions`].
    pub positions: &'a mut [Vec4],
    /// As [`Particles::displacements`].
    pub displacements: &'a mut [Vec4],
    /// As [`Particles::carry`].
    pub carry: &'a mut [Vec4],
    /// The segments that a rod solves on these particles.
    pub segments: &'a mut [SegmentState],
    /// As [`Particles::spins`].
    pub spins: &'a mut [Vec4],
    /// Where contacts are recorded; empty unless they are.
    pub(crate) pushes: &'a mut [Pushes],
}

impl<'a> Part<'a> {
    /// The first `count` particles, and the others.
    ///
    /// # Panics
    /// If there are fewer.
    #[must_use]
    pub fn split_at(self, count: usize) -> (Self, Self) {
        let (positions, more_positions) = self.positions.split_at_mut(count);
        let (displacements, more_displacements) = self.displacements.split_at_mut(count);
        let (carry, more_carry) = self.carry.split_at_mut(count);
        let (spins, more_spins) = self.spins.split_at_mut(count.min(self.spins.len()));
        let (pushes, more_pushes) = self.pushes.split_at_mut(count.min(self.pushes.len()));
        (
            Part {
                positions,
                displacements,
                carry,
                segments: &mut [],
                spins,
                pushes,
            },
            Part {
                positions: more_positions,
                displacements: more_displacements,
                carry: more_carry,
                segments: &mut [],
                spins: more_spins,
                pushes: more_pushes,
            },
        )
    }

    /// Reborrows for a shorter lifetime.
    #[must_use]
    pub fn reborrow(&mut self) -> Part<'_> {
        Part {
            positions: self.positions,
            displacements: self.displacements,
            carry: self.carry,
            segments: self.segments,
            spins: self.spins,
            pushes: self.pushes,
        }
    }

    /// Position of a particle within a substep [m]: p + u.
    pub(super) fn predicted(&self, i: usize) -> DVec3 {
        wide(self.positions[i]) + wide(self.displacements[i])
    }

    /// Position at the start of the substep [m]: p + c.
    pub(super) fn start(&self, i: usize) -> DVec3 {
        wide(self.positions[i]) + wide(self.carry[i])
    }

    /// Moves a particle [m].
    pub(super) fn shift(&mut self, i: usize, by: DVec3) {
        let u = &mut self.displacements[i];
        *u = (wide(*u) + by).as_vec3().extend(0.0);
    }
}

/// A displacement and a carry [m] after an addition to the displacement, whose rounding error is not lost to the
/// velocity.
pub(crate) fn accelerated([u, c]: [Vec4; 2], by: DVec3) -> [Vec4; 2] {
    let wanted = wide(u) + by;
    let next = wanted.as_vec3().extend(0.0);
    let lost = wanted - wide(next);
    [next, (wide(c) - lost).as_vec3().extend(0.0)]
}

pub(crate) fn wide(x: Vec4) -> DVec3 {
    x.truncate().as_dvec3()
}

/// Index of the first element that is not finite, or not finite when multiplied by `factor`.
#[must_use]
pub fn first_not_finite(elements: &[Vec4], factor: f32) -> Option<usize> {
    // A non-finite number times zero is NaN, and NaN persists: one sum covers all elements. Four
    // sums, because a single one would be latency-bound.
    let (fours, rest) = elements.as_chunks::<4>();
    let mut sums = [Vec4::ZERO; 4];
    for four in fours {
        for (sum, x) in sums.iter_mut().zip(four) {
            *sum += *x * factor * 0.0;
        }
    }
    let last = rest.iter();
    let sum = last.fold(Vec4::ZERO, |sum, x| sum + *x * factor * 0.0);
    let all = sum + (sums[0] + sums[1]) + (sums[2] + sums[3]);
    if all == Vec4::ZERO {
        return None;
    }
    elements.iter().position(|x| !(*x * factor).is_finite())
}
