//! Grab.

mod patch;

use super::body_effect::{
    BodyEffect, BodyPass, BodyPhase, ReferenceParticles, ReferencePass, WorkOf,
};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Compliance, Damping, Force, SurfacePoint, Topology,
    kernel::each::{InLanes, Singles},
    parallel::scope::WholeBody,
    particles::Part,
    topology::surface_point::mean,
};
use glam::{DVec3, Vec3, Vec4};
use patch::Patch;
use serde::{Deserialize, Serialize};

/// What a grab holds.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub enum Hold {
    /// One point.
    #[default]
    Point,
    /// All particles within a radius of the point at rest, weighted by (1 − r²/R²)².
    Patch {
        /// Radius R [m].
        radius: f32,
    },
    /// The pinned particle nearest to the point, and the pins that are connected to it by edges
    /// between pins.
    Pins,
}

/// A motion of the target that takes longer than a tick.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Glide {
    /// End of the motion [m].
    pub goal: Vec3,
    /// Time from the end of this tick to the end of the motion [s]; 0 after it.
    pub seconds: f32,
}

/// A grab of a body. Serialized without [`hold`](Self::hold) and [`glide`](Self::glide), as in the
/// first versions of the formats.
///
/// Grab: a compliant spring from a point of a body to a target, active while dragging.
///
/// C = ‖a − t‖ [m] with a = Σ bᵢxᵢ a weighted point of the body, so ∇ᵢC = bᵢ n. The force is
/// limited, so that fast motion of the target cannot overpower the constraints of the body.
///
/// A grab of a patch has the same equation with a mean over all particles within a radius, so that
/// they move together. A grab of pins is no spring: it moves pins that are connected, by the
/// displacement of its target in each substep.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(opaque),
    reflect(Component, Clone, Debug, PartialEq),
    type_path = "pliant::effect"
)]
pub struct Grab {
    /// The grabbed point.
    pub point: SurfacePoint,
    /// Target at the end of this tick [m].
    pub target: Vec3,
    /// Target at the end of the last tick [m]; the target moves linearly over the substeps.
    pub from: Vec3,
    /// Compliance of the spring [m/N].
    pub compliance: Compliance,
    /// Damping τ [s], see [`Multipliers`](crate::effects::Multipliers).
    pub damping: Damping,
    /// Maximum force of the spring [N].
    pub max_force: Force,
    /// What is held; default one point.
    #[serde(skip)]
    pub hold: Hold,
    /// The rest of the target's motion; default none.
    #[serde(skip)]
    pub glide: Glide,
}

/// State of a grab.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GrabState {
    /// λ of the last substep.
    multiplier: f32,
    /// The particles, if it is not one point.
    patch: Patch,
}

impl GrabState {
    /// Force of the spring in the last substep of `h` seconds [N].
    #[must_use]
    pub fn force(&self, h: f32) -> f32 {
        self.multiplier.abs() / (h * h)
    }

    /// Heap memory in bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.patch.bytes()
    }

    /// The same without its patch.
    pub(crate) fn of_point(self) -> Self {
        Self {
            patch: Patch::default(),
            ..self
        }
    }

    /// The held particles with their weights; empty for a grab of one point.
    #[must_use]
    pub fn patch(&self) -> &[(usize, f64)] {
        self.patch.terms()
    }
}

/// State of a grab of the reference.
#[derive(Debug, Clone, Default)]
pub struct ReferenceGrab {
    /// λ of the substep.
    multiplier: f64,
    /// The particles, if it is not one point.
    patch: Patch,
}

impl Grab {
    /// A grab on a body of the given mass [kg] under gravity of the given strength [m/s²]. Its
    /// deflection under the whole weight is a twentieth of the body's size [m].
    ///
    /// The damping time constant is a quarter of the period of the spring, and the force limit is
    /// fifty times the weight of the body.
    #[must_use]
    pub fn on(point: SurfacePoint, target: Vec3, mass: f32, size: f32, gravity: f32) -> Self {
        let weight = (mass * gravity.max(1.0)).clamp(1e-12, 1e12);
        let compliance = (size / 20.0 / weight).clamp(0.0, 1e12);
        let damping = (0.25 * (compliance * mass).sqrt()).clamp(0.0, 1.0);
        Self {
            point,
            target,
            from: target,
            compliance: Compliance::new(compliance).unwrap_or_default(),
            damping: Damping::new(damping).unwrap_or_default(),
            max_force: Force::new(50.0 * weight).unwrap_or_default(),
            hold: Hold::Point,
            glide: Glide::default(),
        }
    }

    /// The same grab of a patch with a radius [m] and a stiffness relative to [`on`](Self::on).
    /// The target is for the weighted mean of the patch.
    #[must_use]
    pub fn of_patch(mut self, radius: f32, stiffness: f32) -> Self {
        let softened = self.compliance.get() / stiffness;
        let compliance = softened.clamp(0.0, 1e12);
        self.damping = Damping::new((self.damping.get() / stiffness.sqrt()).clamp(0.0, 1.0))
            .unwrap_or_default();
        self.compliance = Compliance::new(compliance).unwrap_or_default();
        if radius > 0.0 {
            self.hold = Hold::Patch { radius };
        }
        self
    }

    /// Weighted mean of `at` over the held particles of a body.
    #[must_use]
    pub fn mean(&self, topology: &Topology, at: impl Fn(usize) -> DVec3) -> DVec3 {
        let mut patch = Patch::default();
        patch.update(self, topology, |_| false);
        match patch.terms() {
            [] => self.point.mean(at),
            terms => mean(terms.iter().copied(), at),
        }
    }

    /// Moves the target to `goal` [m] at constant velocity over a time [s], and at least to the end
    /// of a tick of `tick` seconds.
    pub fn glide_to(&mut self, goal: Vec3, seconds: f32, tick: f32) {
        self.glide = Glide { goal, seconds };
        self.aim(tick);
    }

    /// Ends a tick of `tick` seconds, of which a fraction was computed: the next motion begins
    /// where the target is.
    pub fn end_tick(&mut self, fraction: Option<f32>, tick: f32) {
        self.from = match fraction {
            Some(fraction) => self.from.lerp(self.target, fraction),
            None => self.target,
        };
        if self.glide.seconds > 0.0 {
            self.aim(tick);
        }
    }

    /// Sets the target of the next tick on the way to the goal.
    fn aim(&mut self, tick: f32) {
        let Glide { goal, seconds } = self.glide;
        if seconds > tick {
            self.target = self.from.lerp(goal, tick / seconds);
            self.glide.seconds = seconds - tick;
        } else {
            self.target = goal;
            self.glide.seconds = 0.0;
        }
    }

    /// Particles and weights, for a patch of this grab.
    fn terms(&self, patch: &Patch) -> impl Iterator<Item = (usize, f64)> + Clone {
        let own = patch.terms().is_empty().then(|| self.point.wide_terms());
        let patch = patch.terms().iter().copied();
        own.into_iter().flatten().chain(patch)
    }

    /// Finds the particles of a patch, at the start of a tick.
    pub fn begin(&self, state: &mut GrabState, topology: &Topology, positions: &[Vec4]) {
        let is_pinned = |i: usize| positions[i].w == 0.0;
        state.patch.update(self, topology, is_pinned);
    }

    /// Pulls a body in an iteration of a substep of `h` seconds, with the numbers of the substep, of the
    /// substeps and of the iteration.
    pub fn pull(
        &self,
        state: &mut GrabState,
        singles: &mut (impl Singles + ?Sized),
        h: f32,
        (substep, iteration): ((u32, u32), u32),
    ) {
        if iteration == 0 {
            state.multiplier = 0.0;
        }
        let h = f64::from(h);
        let (target, travel) = self.target_in(substep);
        if self.hold == Hold::Pins {
            // Substeps begin without motion of pins: once per substep.
            if iteration == 0 {
                for &(i, _) in state.patch.terms() {
                    singles.shift(i, travel);
                }
            }
            return;
        }
        let terms = self.terms(&state.patch);
        let (mut held, mut start, mut weight) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for (i, b) in terms.clone() {
            let single = singles.single(i);
            held += single.predicted * b;
            start += single.start * b;
            weight += b * b * single.inverse_mass;
        }
        let d = held - target;
        let distance = d.length();
        if weight == 0.0 || distance == 0.0 {
            return;
        }
        let direction = d / distance;
        let alpha = f64::from(self.compliance) / (h * h);
        let gamma = f64::from(self.damping.get()) / h;
        let moved = direction.dot(held - start - travel);
        let multiplier = f64::from(state.multiplier);
        let change =
            -(distance + alpha * multiplier + gamma * moved) / ((1.0 + gamma) * weight + alpha);
        let limit = f64::from(self.max_force.get()) * h * h;
        let next = (multiplier + change).clamp(-limit, limit);
        let push = direction * (next - multiplier);
        for (i, b) in terms {
            singles.push(i, push, b);
        }
        state.multiplier = next as f32;
    }

    /// Target at the end of substep number `substep` of `substeps`, and its displacement per
    /// substep [m].
    fn target_in(&self, (substep, substeps): (u32, u32)) -> (DVec3, DVec3) {
        let (from, target) = (self.from.as_dvec3(), self.target.as_dvec3());
        let travel = (target - from) / f64::from(substeps);
        (from + travel * f64::from(substep + 1), travel)
    }
}

impl BodyEffect for Grab {
    type State = GrabState;
    type Scope = WholeBody;
    type ReferenceState = ReferenceGrab;
    const PHASE: BodyPhase = BodyPhase::IterationEnd;
    const WORK: WorkOf = WorkOf::Grab;
    const IN_LANES: bool = true;

    fn begin_tick(&self, state: &mut GrabState, topology: &Topology, positions: &[Vec4]) {
        self.begin(state, topology, positions);
    }

    fn solve_in_lanes(
        &self,
        state: &mut GrabState,
        particles: &mut impl InLanes,
        pass: &BodyPass,
    ) -> Option<u64> {
        let singles = particles.singles()?;
        self.pull(state, singles, pass.h, (pass.substep, pass.iteration.0));
        Some(0)
    }

    fn solve(&self, state: &mut GrabState, mut part: Part, pass: &BodyPass) -> bool {
        self.pull(state, &mut part, pass.h, (pass.substep, pass.iteration.0));
        false
    }

    fn prepare_reference(
        &self,
        state: &mut ReferenceGrab,
        topology: &Topology,
        _: &[DVec3],
        w: &[f64],
    ) {
        state.patch.update(self, topology, |i| w[i] == 0.0);
    }

    fn solve_reference(
        &self,
        state: &mut ReferenceGrab,
        body: ReferenceParticles,
        pass: &ReferencePass,
    ) {
        if pass.iteration.0 == 0 {
            state.multiplier = 0.0;
        }
        let h = pass.h;
        let (target, travel) = self.target_in(pass.substep);
        if self.hold == Hold::Pins {
            if pass.iteration.0 == 0 {
                for &(i, _) in state.patch.terms() {
                    body.x[i] += travel;
                }
            }
            return;
        }
        let terms = self.terms(&state.patch);
        let held = mean(terms.clone(), |i| body.x[i]);
        let d = held - target;
        let weight: f64 = terms.clone().map(|(i, b)| b * b * body.w[i]).sum();
        if weight == 0.0 || d.length() == 0.0 {
            return;
        }
        let direction = d / d.length();
        let alpha = f64::from(self.compliance) / (h * h);
        let gamma = f64::from(self.damping.get()) / h;
        let moved = direction.dot(held - mean(terms.clone(), |i| body.p[i]) - travel);
        let before = state.multiplier;
        let left = d.length() + alpha * before + gamma * moved;
        let limit = f64::from(self.max_force.get()) * h * h;
        let after = (before - left / ((1.0 + gamma) * weight + alpha)).clamp(-limit, limit);
        for (i, b) in terms {
            body.x[i] += direction * (body.w[i] * b * (after - before));
        }
        state.multiplier = after;
    }

    fn bytes(state: &GrabState) -> usize {
        state.bytes()
    }
}
