//! Conservation of angular momentum by internal constraints.
//!
//! Internal forces have no torque. A pass over constraints (Gauss–Seidel) has none either, constraint
//! by constraint, about the positions of *that moment*; but velocities follow from the positions at
//! the start and at the end of a substep, and about those it has: where it moves particles of masses m
//! by Δ, it changes the angular momentum about the center of mass, times the length h of the
//! substep, by
//!
//! hΔL = Σ m r × Δ,
//!
//! with r from the center to the positions at the *start* of the substep. The difference has a fixed
//! sign: a rotating body slows down (a rigid pair that rotates with ω loses 2πhω per revolution), and a
//! ball that rests on the ground begins to rotate, which friction turns into travel.
//!
//! So Δ is projected onto what does not rotate the body: after the internal constraints of an
//! iteration, and before anything from outside acts, its particles are displaced by
//!
//! θ × r, (Σ m (r² − r rᵀ)) θ = −Σ m r × Δ.
//!
//! Of all rigid rotations about the center, this one is nearest to −Δ, weighted by mass: what is left is
//! never larger than Δ. Linear momentum does not change. In a body of several
//! [parts](crate::topology::Components), each is treated by itself; one with a pin, which has no free
//! rotation, is left alone.
//!
//! By default, for XPBD and implicit Euler; [`KeepSpin`](crate::KeepSpin) 0 turns it off. The other methods
//! stay as they are in the literature, and second-order steps, which lose little rotation, have another
//! balance. [Rods](crate::Rod), whose segments rotate too, and stitches between points of a body are not
//! among the internal constraints here.

use super::{stage::Stage, stepper::Stepper};
use crate::{
    Method, Particles, Settings, Topology,
    effects::free::Free,
    kernel::moments::{Moments, Turn},
    particles::Part,
};
use glam::{DMat3, DVec3, Vec3, Vec4};

/// A body whose moment of inertia about an axis is below this fraction of the total is a line along
/// that axis, about which rotation is undefined.
const LINE: f64 = 1e-12;

impl Settings {
    /// Whether bodies without pins keep their angular momentum in implicit Euler's substeps.
    pub(crate) fn keeps_spin(&self) -> bool {
        self.method == Method::Xpbd && self.keep_spin.get() == 1
    }
}

impl Stepper<'_> {
    /// Begins a tick: finds what can rotate freely.
    pub(crate) fn begin_spin(&mut self, settings: &Settings) {
        let (effects, positions) = (self.effects, &self.particles.positions);
        let mut internal = Stage::internal(effects, settings.method);
        let acts = settings.keeps_spin() && internal.next().is_some();
        let spin = &mut self.states.scratch.found().spin;
        spin.begin(acts, self.topology, effects, positions);
    }

    /// The parts that keep their angular momentum in the substep under way: second-order steps lose little
    /// by themselves, and have another balance; repair turns what it moves.
    pub(crate) fn free(&self) -> Free {
        let particles = &*self.particles;
        match particles.history.is_second_order() || !particles.repair.is_empty() {
            true => Free::None,
            false => self.states.scratch.free(),
        }
    }
}

/// The rotation that takes back what the sums of all pieces give.
pub(crate) fn turn_back(sums: &[Moments], origin: Vec3) -> Turn {
    let mut all = Moments::<f64>::default();
    for sum in sums {
        all.add(sum.wide());
    }
    all.turn_back()
        .map_or_else(Turn::default, |(angle, center)| {
            Turn::about(origin, angle, center)
        })
}

/// Takes back the rotation of each of some parts of a body, whose particles were displaced by `before`
/// [m] before internal constraints.
pub(crate) fn turn_parts_back(
    parts: &[u32],
    topology: &Topology,
    part: Part,
    (before, origin): (&[Vec4], Vec3),
) {
    for &number in parts {
        let members = topology.components().part(number as usize);
        let mut sums = Moments::<f64>::default();
        for &i in members {
            let i = i as usize;
            let x = part.positions[i];
            let r = (x.truncate() - origin).as_dvec3();
            let moved = (part.displacements[i] - before[i]).truncate().as_dvec3();
            sums.add(Moments::of(1.0 / f64::from(x.w), r, moved));
        }
        if let Some((angle, center)) = sums.turn_back() {
            for &i in members {
                let r = (part.positions[i as usize].truncate() - origin).as_dvec3();
                let by = angle.cross(r - center);
                part.displacements[i as usize] += by.as_vec3().extend(0.0);
            }
        }
    }
}

/// Mass [kg], position [m] and velocity [m/s] of each particle.
pub(crate) fn particle_state(particles: &Particles) -> impl Fn(usize) -> (f64, DVec3, DVec3) {
    |i| {
        let mass = 1.0 / f64::from(particles.positions[i].w);
        (mass, particles.position(i), particles.velocity_f64(i))
    }
}

/// Rigid motion of a body.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Motion {
    /// Mass [kg].
    pub mass: f64,
    /// Center of mass [m].
    pub center: DVec3,
    /// Angular momentum about it [kg·m²/s].
    pub angular: DVec3,
    /// Moment of inertia about it [kg·m²].
    inertia: DMat3,
}

impl Motion {
    /// Of `count` particles; `at` gives mass [kg], position [m] and velocity [m/s].
    pub fn of(at: impl Fn(usize) -> (f64, DVec3, DVec3), count: usize) -> Self {
        let (mut mass, mut center) = (0.0, DVec3::ZERO);
        for i in 0..count {
            let (m, x, _) = at(i);
            mass += m;
            center += x * m;
        }
        center /= mass;
        let (mut angular, mut inertia) = (DVec3::ZERO, DMat3::ZERO);
        for i in 0..count {
            let (m, x, v) = at(i);
            let r = x - center;
            angular += r.cross(v) * m;
            let square = DMat3::from_diagonal(DVec3::splat(r.length_squared()));
            inertia += (square - DMat3::from_cols(r * r.x, r * r.y, r * r.z)) * m;
        }
        Self {
            mass,
            center,
            angular,
            inertia,
        }
    }

    /// Angular velocity [rad/s] whose addition results in an angular momentum [kg·m²/s]; zero for a
    /// point.
    pub fn rotation_to(&self, angular: DVec3) -> DVec3 {
        self.turn(angular - self.angular)
    }

    /// Angular velocity of the body [rad/s].
    pub fn angular_velocity(&self) -> DVec3 {
        self.turn(self.angular)
    }

    /// Angular momentum [kg·m²/s] of an angular velocity [rad/s].
    pub fn angular_momentum(&self, velocity: DVec3) -> DVec3 {
        self.inertia * velocity
    }

    fn turn(&self, angular: DVec3) -> DVec3 {
        let trace = self.inertia.x_axis.x + self.inertia.y_axis.y + self.inertia.z_axis.z;
        if trace > 0.0 {
            let least = DMat3::from_diagonal(DVec3::splat(LINE * trace));
            (self.inertia + least).inverse() * angular
        } else {
            DVec3::ZERO
        }
    }
}
