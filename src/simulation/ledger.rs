//! The energy ledger of a scene: stored energy, and its sources and sinks.

use super::plain::bodies_in_order;
use crate::{
    effect::EffectRegistry,
    solver::{self, Particles, Settings, measure},
};
use bevy::prelude::*;
use std::collections::BTreeMap;

/// Energy of all bodies [J].
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct Energies {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Potential energy of gravity, zero at height 0.
    pub potential: f64,
    /// Elastic energy by effect.
    pub elastic: BTreeMap<&'static str, f64>,
}

impl Energies {
    /// Total energy.
    #[must_use]
    pub fn sum(&self) -> f64 {
        self.kinetic + self.potential + self.elastic.values().sum::<f64>()
    }

    /// Energy of all bodies in their current state, under the gravity of these settings.
    fn under(world: &mut World, settings: &Settings) -> Self {
        let h = settings.substep_seconds() as f32;
        let mut all = Self::default();
        for entity in bodies_in_order(world) {
            let entity = world.entity(entity);
            let Some(particles) = entity.get::<Particles>() else {
                continue;
            };
            all.kinetic += measure::kinetic_energy(particles);
            all.potential += measure::gravitational_energy(particles, settings.gravity);
            for effect in world.resource::<EffectRegistry>().iter() {
                let energy = (effect.figures)(&entity, h).and_then(|figures| figures.energy);
                if let Some(energy) = energy {
                    *all.elastic.entry(effect.name).or_default() += energy;
                }
            }
        }
        all
    }
}

/// The ledger since it was switched on, or since the start of the scene.
///
/// It does not change the simulation. Steps take about three times as long while it is on.
#[derive(Resource, Debug, Clone, Default, PartialEq)]
pub struct EnergyLedger {
    /// Whether it is on; default false.
    pub on: bool,
    /// Energy of the bodies at the start [J].
    pub start: Energies,
    /// Energy of the bodies after the last tick [J].
    pub now: Energies,
    /// Changes by the solver since the start [J].
    pub solver: solver::ledger::Ledger,
    /// Changes by tearing and cutting [J]: the energy of edges that were doubled along cracks, less that
    /// of folds and joints that broke. It includes other changes between the same two ticks, unless
    /// emitters or sinks added or removed bodies: then all is in [`other`](Self::other).
    pub torn: f64,
    /// Changes from other sources [J]: edits, added and removed bodies, falling asleep, quarantine,
    /// and whole ticks with effects that are not built in.
    pub other: f64,
    /// Ticks that it covers.
    pub ticks: u64,
    /// Number of the next tick that it covers.
    next: u64,
    /// Whether a body was torn since the last tick.
    has_torn: bool,
    tick: Option<Tick>,
}

/// The tick under way.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Tick {
    /// Energy of the bodies before the tick [J].
    before: f64,
    solver: solver::ledger::Ledger,
    /// Whether the solver's ledger does not cover the whole tick.
    incomplete: bool,
}

impl EnergyLedger {
    /// An empty ledger.
    #[must_use]
    pub fn kept(on: bool) -> Self {
        Self {
            on,
            ..Self::default()
        }
    }

    /// Change of the total energy since the start [J].
    #[must_use]
    pub fn change(&self) -> f64 {
        self.now.sum() - self.start.sum()
    }

    /// Changes since the start, with their names [J].
    #[must_use]
    pub fn rows(&self) -> Vec<(&'static str, f64)> {
        let mut rows = self.solver.rows().to_vec();
        rows.extend([("torn", self.torn), ("other", self.other)]);
        rows
    }

    /// Bodies were added or removed at the end of a tick, with their energy.
    pub(super) fn changes_bodies(&mut self) {
        self.has_torn = false;
    }

    /// A body was torn at the end of a tick.
    pub(super) fn tears(&mut self) {
        self.has_torn = true;
    }

    /// Change that the rows do not account for [J]: only rounding of the sums, unless a parameter
    /// was changed in the middle of a tick that was spread over frames.
    #[must_use]
    pub fn gap(&self) -> f64 {
        self.change() - self.rows().iter().map(|(_, energy)| energy).sum::<f64>()
    }

    pub(super) fn begin_tick(world: &mut World, settings: &Settings, number: u64) {
        let energies = Energies::under(world, settings);
        let mut ledger = world.resource_mut::<Self>();
        let before = energies.sum();
        if ledger.ticks == 0 || number != ledger.next {
            *ledger = Self {
                start: energies.clone(),
                now: energies,
                ..Self::kept(true)
            };
        } else {
            let change = before - ledger.now.sum();
            match ledger.has_torn {
                true => ledger.torn += change,
                false => ledger.other += change,
            }
        }
        ledger.has_torn = false;
        ledger.next = number + 1;
        ledger.tick = Some(Tick {
            before,
            ..Tick::default()
        });
    }

    /// Adds the solver's ledger of some substeps, or `None` if the solver could not track them.
    pub(super) fn add(&mut self, ledger: Option<solver::ledger::Ledger>) {
        if let Some(tick) = &mut self.tick {
            match ledger {
                Some(ledger) => tick.solver += ledger,
                None => tick.incomplete = true,
            }
        }
    }

    pub(super) fn end_tick(world: &mut World, settings: &Settings) {
        let energies = Energies::under(world, settings);
        let mut ledger = world.resource_mut::<Self>();
        // `None` if the ledger was switched on in the middle of a tick.
        let Some(tick) = ledger.tick.take() else {
            return;
        };
        ledger.solver += tick.solver;
        if tick.incomplete {
            ledger.other += energies.sum() - tick.before - tick.solver.sum();
        }
        ledger.now = energies;
        ledger.ticks += 1;
    }
}
