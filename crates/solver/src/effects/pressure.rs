//! Pressure: what fills a closed surface pushes its walls with p = K (fV₀/V − 1) [Pa], K being the
//! bulk modulus of the filling and fV₀ the volume that it would have by itself.
//!
//! That is a gas as much as a liquid. A gas of constant temperature has pV = nRT with its absolute
//! pressure; in an atmosphere of p₀ it pushes with nRT/V − p₀, which is the law above with K = p₀ and
//! nRT = p₀ fV₀. A liquid has a K far above any pressure, and V stays near fV₀; with K = ∞ it is
//! fV₀.
//!
//! The constraint is one over the whole surface: λ/h² is the overpressure in Pa, and every particle
//! moves by w ∇V λ. An implicit substep asks for λ = h²p(V + Σw‖∇V‖² Δλ), which is a quadratic
//! equation for Δλ, solved as it stands: the volume that it aims at is always above 0, so that a gas
//! cannot be pushed through itself. With K → ∞ it is XPBD's Δλ = (fV₀ − V)/Σw‖∇V‖².

use super::body_effect::{BodyEffect, BodyPass, ReferenceParticles, ReferencePass, Store};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Filling, Stiffness, Topology,
    kernel::sum::SquareSum,
    particles::{Part, Particles},
    step::scope::WholeBody,
    topology::Enclosure,
};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A closed surface is filled.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Pressure {
    /// f, the volume that the filling would have by itself over the rest volume of the surface;
    /// default 1. A gas at rest volume pushes with K (f − 1).
    pub factor: Filling,
    /// Bulk modulus K of the filling [Pa] at that volume: 101325 for a gas in the atmosphere,
    /// 2.2e9 for water; default ∞, a liquid that keeps its volume.
    pub bulk_modulus: Stiffness,
}

/// What is kept of the pressure on a body: the multiplier, and room for a substep.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PressureState {
    /// λ [Pa·s²].
    pub multiplier: f64,
    /// ∇V of each particle [m²], as it was in the last sweep; empty before the first.
    pub gradients: Vec<DVec3>,
}

/// A filling stores no more than it would when pressed to this share of its own volume.
const DENSEST: f64 = 1e-6;

impl PressureState {
    /// The overpressure [Pa] after a substep of `h` seconds; `None` if there was none yet, or if the
    /// method has no compliances, for which `h` is ∞.
    #[must_use]
    pub fn overpressure(&self, h: f64) -> Option<f64> {
        (!self.gradients.is_empty() && h.is_finite()).then_some(self.multiplier / (h * h))
    }

    /// One sweep: Δλ, with the gradients to push along; `at` tells places [m] and `w` inverse masses [1/kg].
    pub fn sweep(
        &mut self,
        pressure: &Pressure,
        (topology, enclosure): (&Topology, &Enclosure),
        at: impl Fn(u32) -> DVec3,
        w: impl Fn(usize) -> f64,
        h: f64,
    ) -> f64 {
        let count = topology.particles();
        self.gradients.resize(count, DVec3::ZERO);
        let volume = enclosure.volume_and_gradients(topology, at, &mut self.gradients);
        let weight = enclosure.weight(&self.gradients, w);
        if weight == 0.0 {
            // All is pinned, or in one point.
            return 0.0;
        }
        let change = pressure.change(enclosure, volume, weight, self.multiplier, h);
        self.multiplier += change;
        change
    }
}

impl Pressure {
    /// Δλ [Pa·s²] at a volume [m³], Σw‖∇V‖² being `weight`, in a substep of `h` seconds.
    ///
    /// With a = 1/(h²K) it is the root of (V + wΔλ)(1 + a(λ + Δλ)) = fV₀ that leaves V + wΔλ above
    /// 0.
    fn change(&self, enclosure: &Enclosure, volume: f64, weight: f64, lambda: f64, h: f64) -> f64 {
        let own = self.own_volume(enclosure);
        let a = 1.0 / (h * h * f64::from(self.bulk_modulus));
        let pressed = 1.0 + a * lambda;
        let (linear, constant) = (weight * pressed + a * volume, volume * pressed - own);
        let difference = weight * pressed - a * volume;
        let root = (difference * difference + 4.0 * a * weight * own).sqrt();
        if linear > 0.0 {
            -2.0 * constant / (linear + root)
        } else {
            (root - linear) / (2.0 * a * weight)
        }
    }

    /// fV₀ [m³].
    #[must_use]
    pub fn own_volume(&self, enclosure: &Enclosure) -> f64 {
        f64::from(self.factor) * enclosure.rest_volume
    }

    /// The overpressure K (fV₀/V − 1) of a volume [Pa]; 0 if it is rigid.
    #[must_use]
    pub fn overpressure(&self, enclosure: &Enclosure, volume: f64) -> f64 {
        match f64::from(self.bulk_modulus) {
            f64::INFINITY => 0.0,
            modulus => modulus * (1.0 / self.share(enclosure, volume) - 1.0),
        }
    }

    /// The energy that it stores in a volume [J], K fV₀ (s − 1 − ln s) with s = V/(fV₀): the work of
    /// the overpressure from where there is none. 0 if it is rigid.
    #[must_use]
    pub fn energy(&self, enclosure: &Enclosure, volume: f64) -> f64 {
        match f64::from(self.bulk_modulus) {
            f64::INFINITY => 0.0,
            modulus => {
                let share = self.share(enclosure, volume);
                modulus * self.own_volume(enclosure) * (share - 1.0 - libm::log(share))
            }
        }
    }

    /// What is left of its equation, as a share of fV₀, with the multiplier λ.
    fn left(&self, enclosure: &Enclosure, volume: f64, lambda: f64, h: f64) -> f64 {
        let pressed = 1.0 + lambda / (h * h * f64::from(self.bulk_modulus));
        volume * pressed / self.own_volume(enclosure) - 1.0
    }

    fn share(&self, enclosure: &Enclosure, volume: f64) -> f64 {
        (volume / self.own_volume(enclosure)).max(DENSEST)
    }
}

impl BodyEffect for Pressure {
    type State = PressureState;
    type Scope = WholeBody;
    type ReferenceState = PressureState;

    fn solve(&self, state: &mut PressureState, mut part: Part, pass: &BodyPass) -> bool {
        let Ok(enclosure) = pass.topology.enclosure() else {
            return false;
        };
        if pass.iteration.0 == 0 {
            state.multiplier = 0.0;
        }
        let at = |i: u32| part.predicted(i as usize);
        let weight = |i: usize| f64::from(part.positions[i].w);
        let body = (pass.topology, enclosure);
        let change = state.sweep(self, body, at, weight, pass.compliant.into());
        for (i, gradient) in state.gradients.iter().enumerate() {
            let w = f64::from(part.positions[i].w);
            if w > 0.0 {
                part.shift(i, *gradient * (w * change));
            }
        }
        false
    }

    fn solve_reference(
        &self,
        state: &mut PressureState,
        body: ReferenceParticles,
        pass: &ReferencePass,
    ) {
        let Ok(enclosure) = body.topology.enclosure() else {
            return;
        };
        if pass.is_anew {
            state.multiplier = 0.0;
        }
        let (at, weight) = (|i: u32| body.x[i as usize], |i: usize| body.w[i]);
        let change = state.sweep(self, (body.topology, enclosure), at, weight, pass.compliant);
        blow(state, body, change);
    }

    fn pull_reference(&self, state: &mut PressureState, body: ReferenceParticles) {
        if let Ok(enclosure) = body.topology.enclosure() {
            // There is nothing yet in the first substep.
            state.gradients.resize(body.x.len(), DVec3::ZERO);
            let at = |i: u32| body.x[i as usize];
            enclosure.volume_and_gradients(body.topology, at, &mut state.gradients);
            let multiplier = state.multiplier;
            blow(state, body, multiplier);
        }
    }

    fn constraints(&self, _: &Topology) -> usize {
        1
    }

    fn elements(&self, _: &PressureState, topology: &Topology) -> usize {
        usize::from(topology.enclosure().is_ok())
    }

    fn load(&self, topology: &Topology) -> usize {
        1 + topology.triangles.len()
    }

    fn stores(
        &self,
        _: &PressureState,
        topology: &Topology,
        at: &dyn Fn(u32) -> (DVec3, f64),
        store: &mut dyn FnMut(Store),
    ) {
        if let Ok(enclosure) = topology.enclosure() {
            let volume = enclosure.volume(topology, |i| at(i).0);
            store(Store::Potential {
                coordinate: volume,
                energy: self.energy(enclosure, volume),
                force: self.overpressure(enclosure, volume),
            });
        }
    }

    fn residual(
        &self,
        state: &PressureState,
        topology: &Topology,
        particles: &Particles,
        h: f64,
    ) -> SquareSum {
        let Ok(enclosure) = topology.enclosure() else {
            return SquareSum::default();
        };
        if state.gradients.is_empty() {
            return SquareSum::default();
        }
        let volume = enclosure.volume(topology, |i| particles.position(i as usize));
        let left = self.left(enclosure, volume, state.multiplier, h);
        SquareSum {
            sum: left * left,
            count: 1,
        }
    }

    fn bytes(state: &PressureState) -> usize {
        size_of_val(&state.gradients[..])
    }
}

/// Moves every particle by w∇V λ.
fn blow(state: &PressureState, body: ReferenceParticles, lambda: f64) {
    let all = body.x.iter_mut().zip(body.w).zip(&state.gradients);
    for ((x, w), gradient) in all {
        *x += *gradient * (w * lambda);
    }
}
