//! Tearing of a body: carries its state over to the torn topology.

use super::{
    masses::{Masses, set_inverse_masses},
    stepper::Stepper,
};
use crate::{
    Cut, Particles, Settings, StitchEnd, Stitches, SurfacePoint,
    effects::{rod, tear::Strained},
    topology::Torn,
};
use glam::Vec4;
use std::borrow::Cow;

impl Stepper<'_> {
    /// Tears the body where it is above the limits of [`Tear`](crate::Tear), at the end of a tick
    /// in which multipliers were stored. `start` is the state at the start of the tick. Returns
    /// what has become of its particles, if it was torn.
    pub fn tear(
        &mut self,
        masses: Masses,
        start: &mut Particles,
        settings: &Settings,
    ) -> Option<Torn> {
        let tear = self.effects.tear?;
        let mut limits = std::mem::take(&mut self.states.tear);
        let particles = &*self.particles;
        let h = f64::from(particles.substep_seconds());
        let body = Strained {
            topology: self.topology,
            effects: self.effects,
            at: &|i| particles.position(i as usize),
            lambdas: &|kind| Cow::Borrowed(self.states.multipliers(kind)),
            rod: &self.states.others.rod,
            h: settings.method.compliant_seconds(h),
        };
        let torn = tear.split(limits.get_or_insert_default(), &body);
        self.states.tear = limits;
        let torn = torn?;
        self.follow(&torn, masses, start);
        Some(torn)
    }

    /// Cuts the body between ticks. `start` is the state at the start of the last tick. Returns
    /// what has become of its particles; `None` if the cut misses it. Stitches within the body that
    /// the cut crosses break.
    pub fn cut(&mut self, cut: &Cut, masses: Masses, start: &mut Particles) -> Option<Torn> {
        let particles = &*self.particles;
        let at = |i: usize| particles.position(i);
        self.stitches.break_where(|point, other| {
            let ends = [point, other].map(|it| it.mean(at));
            cut.crosses(ends)
        });
        let torn = cut.split(self.topology, |i| at(i as usize))?;
        self.follow(&torn, masses, start);
        Some(torn)
    }

    /// Replaces the topology; copies of a particle have its position and velocity.
    fn follow(&mut self, torn: &Torn, masses: Masses, start: &mut Particles) {
        let segments = rod::torn(&self.particles.segments, self.topology, torn);
        for particles in [&mut *self.particles, start] {
            particles.copy_from(&torn.sources);
        }
        self.particles.segments = segments;
        *self.topology = torn.topology.clone();
        let Masses {
            density,
            added,
            pins,
        } = masses;
        let positions = &mut self.particles.positions;
        set_inverse_masses(positions, self.topology, density, added, pins);
        for (past, now) in start.positions.iter_mut().zip(positions) {
            past.w = now.w;
        }
        self.stitches.follow(torn);
        self.states.forget();
        self.states
            .resume(self.effects, self.topology, self.particles);
    }
}

impl Particles {
    /// Replaces its particles by copies of those with these numbers.
    fn copy_from(&mut self, sources: &[u32]) {
        let copy = |column: &mut Vec<Vec4>| {
            let old = std::mem::take(column);
            if !old.is_empty() {
                column.extend(sources.iter().map(|&source| old[source as usize]));
            }
        };
        copy(&mut self.positions);
        copy(&mut self.displacements);
        copy(&mut self.carry);
        self.segments.clear();
        self.spins.clear();
        self.history.forget();
        self.repair = crate::repair::Repair::default();
    }
}

impl Torn {
    /// The same point of the torn body.
    #[must_use]
    pub fn point(&self, point: &SurfacePoint) -> SurfacePoint {
        let was: Vec<u32> = point.terms().map(|(particle, _)| particle.0).collect();
        let now = self.together(&was);
        let terms: Vec<_> = now
            .into_iter()
            .zip(point.terms())
            .map(|(particle, (_, weight))| (crate::ParticleIndex(particle), weight))
            .collect();
        SurfacePoint::new(&terms).unwrap_or(*point)
    }
}

impl Stitches {
    /// Breaks the stitches between points of the body for which `crosses` holds.
    fn break_where(&mut self, crosses: impl Fn(&SurfacePoint, &SurfacePoint) -> bool) {
        for stitch in self.all_mut() {
            if let StitchEnd::Point(other) = &stitch.to {
                stitch.broken |= crosses(&stitch.point, other);
            }
        }
    }

    /// Moves the stitches to the points of a torn body.
    pub(crate) fn follow(&mut self, torn: &Torn) {
        for stitch in self.all_mut() {
            stitch.point = torn.point(&stitch.point);
            if let StitchEnd::Point(other) = &mut stitch.to {
                *other = torn.point(other);
            }
        }
    }

    /// Moves the intact stitches of other bodies to body number `other` to its points after it was
    /// torn. Those to particles that it does not have break.
    pub fn follow_torn(&mut self, other: u32, torn: &Torn) {
        self.follow_joints(other, |point| {
            point.fits(torn.places.len()).then(|| torn.point(point))
        });
    }

    /// Moves the points of intact stitches to body number `other`; those without a new point break.
    pub(crate) fn follow_joints(
        &mut self,
        other: u32,
        moved: impl Fn(&SurfacePoint) -> Option<SurfacePoint>,
    ) {
        for stitch in self.all_mut().iter_mut().filter(|stitch| !stitch.broken) {
            if let StitchEnd::Body { number, point } = &mut stitch.to
                && *number == other
            {
                match moved(point) {
                    Some(moved) => *point = moved,
                    None => stitch.broken = true,
                }
            }
        }
    }
}
