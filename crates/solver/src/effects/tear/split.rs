//! Splitting a body where it is above its limits.

use super::{Tear, state::TearState};
use crate::{
    Effects, ElasticKind, RodState, Topology,
    topology::{Tearing, Torn},
};
use glam::DVec3;
use std::borrow::Cow;

/// A body at the end of a tick.
pub(crate) struct Strained<'a> {
    /// Its topology.
    pub topology: &'a Topology,
    /// Its effects.
    pub effects: &'a Effects,
    /// Positions [m].
    pub at: &'a dyn Fn(u32) -> DVec3,
    /// Multipliers of the last substep.
    pub lambdas: &'a dyn Fn(ElasticKind) -> Cow<'a, [f32]>,
    /// State of a rod.
    pub rod: &'a Option<Box<RodState>>,
    /// Length of the last substep [s] for compliances.
    pub h: f64,
}

/// An element above its limit.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Weak {
    /// Its load relative to the limit, as a ratio of energies, above 1.
    pub load: f64,
    /// Its particles.
    pub particles: Vec<u32>,
    /// Direction at rest across which it breaks.
    pub direction: DVec3,
}

impl Tear {
    /// Splits a body where it is above its limits; `None` if it is nowhere.
    pub(crate) fn split(&self, state: &mut TearState, body: &Strained) -> Option<Torn> {
        state.update(self, body);
        let mut weak = state.weak(self, body);
        if weak.is_empty() {
            return None;
        }
        // Stable, so that equal loads keep the order of the elements.
        weak.sort_by(|one, other| other.load.total_cmp(&one.load));
        let mut loads = vec![0.0_f64; body.topology.particles()];
        for element in &weak {
            for &particle in &element.particles {
                loads[particle as usize] += element.load;
            }
        }
        let mut tearing = Tearing::of(body.topology, self.smallest_piece.get() as usize)?;
        let mut relieved = vec![false; tearing.elements()];
        for mut element in weak {
            element.particles.sort_by(|&a, &b| {
                let [of_a, of_b] = [a, b].map(|it| loads[it as usize]);
                of_b.total_cmp(&of_a).then(a.cmp(&b))
            });
            let mut all = tearing.around(element.particles[0]).iter();
            let has_all = |it: &u32| {
                let mut corners = element.particles.iter();
                corners.all(|particle| tearing.corners(*it).any(|corner| corner == *particle))
            };
            if all.any(|it| has_all(it) && relieved[*it as usize]) {
                continue;
            }
            for &particle in &element.particles {
                let fan = tearing.around(particle).to_vec();
                let x = body.topology.rest[particle as usize].as_dvec3();
                let is_beyond = |it: &u32| (tearing.center(*it) - x).dot(element.direction) > 0.0;
                let beyond: Vec<u32> = fan.iter().copied().filter(is_beyond).collect();
                if tearing.split(particle, &beyond) {
                    for it in fan {
                        relieved[it as usize] = true;
                    }
                    break;
                }
            }
        }
        tearing.finish()
    }
}
