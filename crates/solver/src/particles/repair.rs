//! Repair state of a body.

use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::iter;

/// Recovery state of a body; empty while nothing is under repair. Allocations are kept.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Repair {
    pub(crate) under: Option<Box<UnderRepair>>,
    /// Time to the next check of an undamaged body [s].
    pub(crate) wait: f64,
}

#[derive(Debug, Default, Serialize, Deserialize)]
pub(crate) struct UnderRepair {
    /// Which particles are under repair; empty where none is.
    pub(crate) drawn: Vec<bool>,
    /// T [s].
    pub(crate) time: f64,
    /// Duration of repair [s], minus a tenth of the time without repair since then.
    pub(crate) spent: f64,
    /// For each particle, the time in a tangled hinge [s], and the strain there; empty where there
    /// is none.
    pub(crate) tangled: Vec<[f32; 2]>,
    /// Computed at the beginning of a tick.
    #[serde(skip)]
    pub(crate) regions: Regions,
}

/// Particles by region, and buffers.
#[derive(Debug, Default)]
pub(crate) struct Regions {
    pub(crate) particles: Vec<u32>,
    /// End of the range of each region.
    pub(crate) ends: Vec<usize>,
    pub(crate) damaged: Vec<bool>,
    /// Largest strain of a tangled hinge at each particle.
    pub(crate) strains: Vec<f32>,
    pub(crate) parent: Vec<u32>,
    /// Velocity [m/s], angular momentum [kg·m²/s] and rotational energy [J] of each at the
    /// beginning of the substep.
    pub(crate) motions: Vec<(DVec3, DVec3, f64)>,
    /// Whether the body touches something in the substep.
    pub(crate) touched: bool,
}

impl Clone for Repair {
    fn clone(&self) -> Self {
        let mut copy = Self::default();
        copy.clone_from(self);
        copy
    }

    /// Reuses allocations. Regions are not copied: they are computed at the beginning of a tick.
    fn clone_from(&mut self, from: &Self) {
        self.wait = from.wait;
        let Some(from) = &from.under else {
            self.under = None;
            return;
        };
        let repair = self.under.get_or_insert_default();
        repair.drawn.clone_from(&from.drawn);
        repair.tangled.clone_from(&from.tangled);
        (repair.time, repair.spent) = (from.time, from.spent);
    }
}

/// Regions are derived data, and buffers are not part of the state.
impl PartialEq for Repair {
    fn eq(&self, other: &Self) -> bool {
        let state = |it: &Self| {
            let repair = it.under.as_ref();
            repair.map_or((Vec::new(), Vec::new(), 0.0), |it| {
                (it.drawn.clone(), it.tangled.clone(), it.spent)
            })
        };
        self.wait == other.wait && state(self) == state(other)
    }
}

impl Regions {
    pub(crate) fn clear(&mut self) {
        self.particles.clear();
        self.ends.clear();
        self.motions.clear();
    }

    pub(crate) fn each(&self) -> impl Iterator<Item = &[u32]> {
        let starts = iter::once(&0).chain(&self.ends);
        let bounds = starts.zip(&self.ends);
        bounds.map(|(&start, &end)| &self.particles[start..end])
    }
}

impl Repair {
    /// Number of particles of the body; 0 without repair.
    #[must_use]
    pub fn len(&self) -> usize {
        self.under.as_ref().map_or(0, |repair| repair.drawn.len())
    }

    /// Whether nothing is under repair.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Memory use in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.under.as_ref().map_or(0, |repair| {
            let regions = &repair.regions;
            size_of_val(&repair.drawn[..])
                + size_of_val(&repair.tangled[..])
                + size_of_val(&regions.particles[..])
                + size_of_val(&regions.ends[..])
                + size_of_val(&regions.damaged[..])
                + size_of_val(&regions.strains[..])
                + size_of_val(&regions.parent[..])
                + size_of_val(&regions.motions[..])
        })
    }

    /// Time since the last check [s] if a check is due in a tick of `seconds`: once per `interval`
    /// [s], and in every tick during repair.
    pub(crate) fn is_due(&mut self, interval: f64, seconds: f64) -> Option<f64> {
        if !self.is_empty() {
            self.wait = 0.0;
            return Some(seconds);
        }
        // Half a tick exceeds the rounding error of a sum of ticks.
        let is_due = self.wait < 0.5 * seconds;
        if is_due {
            self.wait = interval;
        }
        self.wait = (self.wait - seconds).max(0.0);
        is_due.then_some(interval.max(seconds))
    }

    /// Reduces the duration of repair in a tick of `seconds` without repair; clears tangled hinges
    /// if the body `is_undamaged`.
    pub(crate) fn cool_down(&mut self, seconds: f64, is_undamaged: bool) {
        if let Some(repair) = &mut self.under {
            if is_undamaged {
                repair.tangled.clear();
            }
            repair.cool_down(seconds);
        }
    }

    /// Records that the body touches something in the current substep.
    pub(crate) fn touch(&mut self) {
        if let Some(repair) = &mut self.under {
            repair.regions.touched = true;
        }
    }
}

impl UnderRepair {
    /// Reduces the duration of repair in a tick of `seconds` without repair.
    pub(crate) fn cool_down(&mut self, seconds: f64) {
        self.spent = (self.spent - 0.1 * seconds).max(0.0);
    }
}
