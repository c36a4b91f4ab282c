//! Appearance and disappearance of grains: carries the state of a body over.

use super::{masses::set_inverse_masses, stepper::Stepper};
use crate::{
    Density, Effects, Mass, Particles, Settings, StitchEnd, Stitches, VertexIndex,
    effects::emitter::Renewing,
    topology::{Renewal, Renewed},
};
use glam::Vec4;

/// What a body has at its vertices.
#[derive(Debug)]
pub struct Attached<'a> {
    /// Additional masses.
    pub added: &'a mut Vec<(VertexIndex, Mass)>,
    /// Fixed vertices.
    pub pins: &'a mut Vec<VertexIndex>,
}

impl Effects {
    /// Effects that add or remove grains.
    pub(crate) fn renewing(&self) -> Option<Renewing<'_>> {
        let renewing = Renewing {
            emitter: self.emitter.as_ref(),
            sink: self.sink.as_ref(),
        };
        (renewing.emitter.is_some() || renewing.sink.is_some()).then_some(renewing)
    }
}

impl Stepper<'_> {
    /// Adds and removes grains at the end of a tick. `start` is the state at the start of the tick.
    /// Returns what has become of the particles, if any has appeared or disappeared.
    pub fn renew(
        &mut self,
        density: Density,
        attached: Attached,
        start: &mut Particles,
        settings: &Settings,
    ) -> Option<Renewed> {
        let renewing = self.effects.renewing()?;
        if self.topology.radii.is_empty() {
            return None;
        }
        let mut emission = std::mem::take(&mut self.particles.emission);
        let particles = &*self.particles;
        let at = |i: usize| particles.position(i);
        let renewal = renewing.end_tick(&mut emission, &self.topology.radii, at, settings);
        self.particles.emission = emission;
        let renewal = renewal?;
        let renewed = self.topology.renewed(&renewal).ok()?;
        let Attached { added, pins } = attached;
        renewed.keep_attached(self.topology, pins, added);
        for particles in [&mut *self.particles, start] {
            particles.renew(&renewal);
        }
        *self.topology = renewed.topology.clone();
        let positions = &mut self.particles.positions;
        set_inverse_masses(positions, self.topology, density, added, pins);
        for (past, now) in start.positions.iter_mut().zip(positions) {
            past.w = now.w;
        }
        self.stitches.renew(&renewed);
        self.states.forget();
        Some(renewed)
    }
}

impl Particles {
    fn renew(&mut self, renewal: &Renewal) {
        let count = renewal.kept.len() + renewal.births.len();
        if self.spins.len() != self.positions.len() {
            self.spins.clear();
        }
        for column in [
            &mut self.positions,
            &mut self.displacements,
            &mut self.carry,
            &mut self.spins,
        ] {
            let old = std::mem::take(column);
            if !old.is_empty() {
                column.extend(renewal.kept.iter().map(|&i| old[i as usize]));
                column.resize(count, Vec4::ZERO);
            }
        }
        let births = renewal.births.iter();
        for (i, birth) in (renewal.kept.len()..).zip(births) {
            self.set_position(i, birth.position);
            self.set_velocity(i, birth.velocity.as_vec3());
        }
        self.history.forget();
        self.repair = crate::repair::Repair::default();
    }
}

impl Stitches {
    /// Moves the stitches to the particles of a renewed body; those of grains that have disappeared
    /// are removed.
    pub(crate) fn renew(&mut self, renewed: &Renewed) {
        self.retain_mut(|stitch| {
            let point = renewed.point(&stitch.point);
            let other = match &stitch.to {
                StitchEnd::Point(other) => renewed.point(other).map(StitchEnd::Point),
                end @ (StitchEnd::Collider { .. } | StitchEnd::Body { .. }) => Some(*end),
            };
            let both = point.zip(other);
            both.inspect(|both| (stitch.point, stitch.to) = *both)
                .is_some()
        });
    }

    /// Moves the stitches of other bodies to body number `other` to its particles after it was
    /// renewed; those of grains that have disappeared break.
    pub fn follow_renewed(&mut self, other: u32, renewed: &Renewed) {
        self.follow_joints(other, |point| renewed.point(point));
    }
}
