//! Pressure.

use super::body_effect::{BodyEffect, BodyPass, ReferenceParticles, ReferencePass, Store};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Filling, Stiffness, Topology,
    kernel::sum::SquareSum,
    parallel::scope::WholeBody,
    particles::{Part, Particles},
    topology::Enclosure,
};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Gas or liquid inside a closed surface.
///
/// Pressure: the filling of a closed surface exerts the overpressure p = K (fV₀/V − 1) [Pa], with
/// the bulk modulus K of the filling and its free volume fV₀.
///
/// The law covers gases and liquids. An isothermal gas has pV = nRT with its absolute pressure; in
/// an atmosphere of p₀ its overpressure is nRT/V − p₀, which is the law above with K = p₀ and
/// nRT = p₀ fV₀. For a liquid, K is far above any pressure, and V stays near fV₀; with K = ∞ it is
/// fV₀.
///
/// It is a single constraint over the whole surface: λ/h² is the overpressure in Pa, and every
/// particle moves by w ∇V λ. An implicit substep requires λ = h²p(V + Σw‖∇V‖² Δλ), a quadratic
/// equation for Δλ that is solved exactly: the target volume is always above 0, so that a gas
/// cannot be compressed through zero. With K → ∞ it is XPBD's Δλ = (fV₀ − V)/Σw‖∇V‖².
///
/// ```
/// use pliant_solver::{Filling, Pressure};
///
/// // A balloon with half as much gas again as it holds at rest.
/// let taut = Pressure {
///     factor: Filling::of(1.5),
///     ..Pressure::default()
/// };
/// # assert_ne!(taut, Pressure::default());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Pressure {
    /// Fill ratio f, the free volume of the filling over the rest volume of the surface; default 1.
    /// A gas at rest volume has the overpressure K (f − 1).
    pub factor: Filling,
    /// Bulk modulus K of the filling [Pa] at that volume: 101325 for a gas in the atmosphere,
    /// 2.2e9 for water; default ∞, a liquid that keeps its volume.
    pub bulk_modulus: Stiffness,
}

/// State of the pressure in a body: the multiplier, and a buffer for a substep.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PressureState {
    /// λ [Pa·s²].
    pub multiplier: f64,
    /// ∇V of each particle [m²], as it was in the last iteration; empty before the first.
    pub gradients: Vec<DVec3>,
}

/// Lower bound of the volume in the stored energy, as a fraction of the free volume.
const DENSEST: f64 = 1e-6;

impl PressureState {
    /// Overpressure [Pa] after a substep of `h` seconds; `None` before the first one, or if the
    /// method has no compliances, for which `h` is ∞.
    #[must_use]
    pub fn overpressure(&self, h: f64) -> Option<f64> {
        (!self.gradients.is_empty() && h.is_finite()).then_some(self.multiplier / (h * h))
    }

    /// One iteration: Δλ, with the gradients to push along; `at` gives positions [m] and `w`
    /// inverse masses [1/kg].
    pub fn iterate(
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
            // All particles are pinned, or at one point.
            return 0.0;
        }
        let change = pressure.change(enclosure, volume, weight, self.multiplier, h);
        self.multiplier += change;
        change
    }
}

impl Pressure {
    /// Δλ [Pa·s²] at a volume [m³], with Σw‖∇V‖² = `weight`, in a substep of `h` seconds.
    ///
    /// With a = 1/(h²K) it is the root of (V + wΔλ)(1 + a(λ + Δλ)) = fV₀ for which V + wΔλ is above
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

    /// Overpressure K (fV₀/V − 1) at a volume [Pa]; 0 if it is rigid.
    #[must_use]
    pub fn overpressure(&self, enclosure: &Enclosure, volume: f64) -> f64 {
        match f64::from(self.bulk_modulus) {
            f64::INFINITY => 0.0,
            modulus => modulus * (1.0 / self.volume_ratio(enclosure, volume) - 1.0),
        }
    }

    /// Stored energy at a volume [J], K fV₀ (s − 1 − ln s) with s = V/(fV₀): the work of the
    /// overpressure from the volume of zero overpressure. 0 if it is rigid.
    #[must_use]
    pub fn energy(&self, enclosure: &Enclosure, volume: f64) -> f64 {
        match f64::from(self.bulk_modulus) {
            f64::INFINITY => 0.0,
            modulus => {
                let ratio = self.volume_ratio(enclosure, volume);
                modulus * self.own_volume(enclosure) * (ratio - 1.0 - libm::log(ratio))
            }
        }
    }

    /// Residual of its equation with the multiplier λ, as a fraction of fV₀.
    fn left(&self, enclosure: &Enclosure, volume: f64, lambda: f64, h: f64) -> f64 {
        let pressed = 1.0 + lambda / (h * h * f64::from(self.bulk_modulus));
        volume * pressed / self.own_volume(enclosure) - 1.0
    }

    fn volume_ratio(&self, enclosure: &Enclosure, volume: f64) -> f64 {
        (volume / self.own_volume(enclosure)).max(DENSEST)
    }
}

impl BodyEffect for Pressure {
    type State = PressureState;
    type Scope = WholeBody;
    const IS_INTERNAL: bool = true;
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
        let change = state.iterate(self, body, at, weight, pass.compliant.into());
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
        let change = state.iterate(self, (body.topology, enclosure), at, weight, pass.compliant);
        blow(state, body, change);
    }

    fn pull_reference(&self, state: &mut PressureState, body: ReferenceParticles) {
        if let Ok(enclosure) = body.topology.enclosure() {
            // Empty before the first substep.
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
