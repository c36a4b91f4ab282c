//! Appearance and disappearance of grains in the reference, by the plan of the fast solver.

use super::Body;
use crate::{Settings, masses::set_inverse_masses, topology::Renewed};
use glam::{DVec3, Vec4};
use std::sync::Arc;

impl Body {
    /// Adds and removes grains at the end of a tick; returns what has become of its particles, if
    /// there were any changes.
    pub(super) fn renew(&mut self, settings: &Settings) -> Option<Renewed> {
        let effects = self.effects;
        let renewing = effects.renewing()?;
        if self.topology.radii.is_empty() {
            return None;
        }
        let at = |i: usize| self.x[i];
        let radii = &self.topology.radii;
        let renewal = renewing.end_tick(&mut self.emission, radii, at, settings)?;
        let renewed = self.topology.renewed(&renewal).ok()?;
        let moved = |column: &mut Vec<DVec3>, births: &mut dyn Iterator<Item = DVec3>| {
            let old = std::mem::take(column);
            column.extend(renewal.kept.iter().map(|&i| old[i as usize]));
            column.extend(births);
        };
        for column in [&mut self.x, &mut self.p, &mut self.from] {
            moved(column, &mut renewal.births.iter().map(|it| it.position));
        }
        moved(
            &mut self.v,
            &mut renewal.births.iter().map(|it| it.velocity),
        );
        if !self.spins.is_empty() {
            let still = renewal.births.iter().map(|_| DVec3::ZERO);
            moved(&mut self.spins, &mut { still });
        }
        let super::tear::Masses {
            density,
            added,
            pins,
        } = &mut self.masses;
        renewed.keep_attached(&self.topology, pins, added);
        let mut masses = vec![Vec4::ZERO; self.x.len()];
        set_inverse_masses(&mut masses, &renewed.topology, *density, added, pins);
        self.w = masses.iter().map(|x| f64::from(x.w)).collect();
        let grab = self.effects.grab.take();
        self.effects.grab = grab.and_then(|mut grab| {
            grab.point = renewed.point(&grab.point)?;
            Some(grab)
        });
        self.controls.follow(|point| renewed.point(point));
        let mut stitches = std::mem::take(&mut self.states.stitches);
        stitches.0.renew(&renewed);
        self.topology = Arc::clone(&renewed.topology);
        self.states = super::ReferenceStates {
            stitches,
            ..super::ReferenceStates::default()
        };
        self.lambdas = Default::default();
        self.repair = crate::repair::Repair::default();
        self.past = super::Past::default();
        let effects = self.effects;
        self.carry(&effects);
        Some(renewed)
    }
}
