//! Tearing of the reference, by the limits and splits of the fast solver.

use super::Body;
use crate::{
    Density, Mass, Settings, TearState, VertexIndex,
    effects::{rod, tear::Strained},
    masses::set_inverse_masses,
    topology::Torn,
};
use glam::Vec4;
use std::{borrow::Cow, sync::Arc};

/// What determines the masses of a body.
#[derive(Debug, Clone, Default)]
pub(super) struct Masses {
    pub density: Density,
    pub added: Vec<(VertexIndex, Mass)>,
    pub pins: Vec<VertexIndex>,
}

impl Body {
    /// Tears the body at the end of a tick, where it is above its limits; returns what has become
    /// of its particles, if it was torn.
    pub(super) fn tear(&mut self, settings: &Settings) -> Option<Torn> {
        let tear = self.effects.tear?;
        let lambdas = |kind| {
            let column: &Vec<f64> = &self.lambdas[kind as usize];
            Cow::Owned(column.iter().map(|&lambda| lambda as f32).collect())
        };
        let rod = Some(Box::new(self.states.rod.clone()));
        let strained = Strained {
            topology: &self.topology,
            effects: &self.effects,
            at: &|i| self.x[i as usize],
            lambdas: &lambdas,
            rod: &rod,
            h: settings.method.compliant_seconds(self.h),
        };
        let torn = tear.split(&mut TearState::default(), &strained)?;
        let segments = rod::torn(&self.states.rod.segments(), &self.topology, &torn);
        for column in [&mut self.x, &mut self.p, &mut self.from, &mut self.v] {
            let old = std::mem::take(column);
            column.extend(torn.sources.iter().map(|&source| old[source as usize]));
        }
        let mut masses = vec![Vec4::ZERO; self.x.len()];
        let Masses {
            density,
            added,
            pins,
        } = &self.masses;
        set_inverse_masses(&mut masses, &torn.topology, *density, added, pins);
        self.w = masses.iter().map(|x| f64::from(x.w)).collect();
        if let Some(grab) = &mut self.effects.grab {
            grab.point = torn.point(&grab.point);
        }
        self.controls.follow(|point| Some(torn.point(point)));
        let mut stitches = std::mem::take(&mut self.states.stitches);
        stitches.0.follow(&torn);
        self.topology = Arc::clone(&torn.topology);
        self.states = super::ReferenceStates {
            stitches,
            rod: self
                .effects
                .rod
                .map_or_else(crate::RodState::default, |rod| {
                    crate::RodState::resumed(&rod, &self.topology, &segments)
                }),
            ..super::ReferenceStates::default()
        };
        self.lambdas = Default::default();
        self.repair = crate::repair::Repair::default();
        self.past = super::Past::default();
        let effects = self.effects;
        self.carry(&effects);
        Some(torn)
    }
}
