//! Grains.

mod contacts;
mod kernels;
mod neighbors;

use super::body_effect::{
    BodyEffect, BodyPass, BodyPhase, ReferenceParticles, ReferencePass, WorkOf,
};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Cohesion, Fraction, Friction, GrainRolling, RecoverySpeed, Topology,
    parallel::scope::WholeBody, particles::Part, topology::Identity,
};
use contacts::Contacts;
use glam::{DVec3, Vec4};
use kernels::{Limits, TOUCHING};
use neighbors::{Neighbors, PAIRS_PER_GRAIN};
use serde::{Deserialize, Serialize};

/// Contact of the grains of a body with each other.
///
/// Grains: balls that touch each other, with Coulomb friction and cohesion.
///
/// Two grains at a distance of at most the sum d of their radii push each other apart. With the unit
/// vector n from the second to the first at the start of the substep, and W = w₁ + w₂,
///
/// - normal: C = n·(x₁ − x₂) − d ≥ 0 [m], λₙ ← max(λₙ − C/W, 0);
/// - friction: the tangential displacement in the substep s = (I − nnᵀ)(Δx₁ − Δx₂) is reduced as far
///   as ‖λₜ‖ ≤ µλₙ allows.
///
/// Both multipliers [kg·m] are accumulated over all passes of a substep; λₙ/h² is the force [N]. Slip
/// that friction could take back, but has not, is carried over to the next substep of the tick, and
/// half of the multipliers too.
/// Cohesion F lets grains that touch pull: λₙ ≥ −Fh², with friction up to µ(λₙ + Fh²).
///
/// With a finite rolling resistance µᵣ, grains rotate: balls with I = ⅖mr², whose surfaces slip by
/// s − (r₁φ₁ + r₂φ₂) × n where they turn by φ in the substep. A torque of at most µᵣλₙr₁r₂/(r₁ + r₂)/h²
/// holds their relative rotation φ₁ − φ₂ back, so that a grain rolls down slopes steeper than µᵣ. On
/// the ground and on colliders of simple shapes likewise; friction with other bodies acts
/// without torque. Without a finite resistance, grains do not rotate, which acts like a large resistance. A pass that does not
/// converge leaves the load of the grains above as overlap: about n·gh² under n layers with one
/// iteration, and less with more.
///
/// Source: Müller and others, *Detailed Rigid Body Simulation with Extended Position Based Dynamics*
/// (2020), section 3.5, with friction accumulated over the substep.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Grains {
    /// Coefficient of static friction µ; default 0.5.
    pub friction: Friction,
    /// Kinetic friction as a fraction of static friction, from 0 to 1; default 1.
    pub kinetic_fraction: Fraction,
    /// Largest force with which two touching grains hold each other [N]; default 0.
    pub cohesion: Cohesion,
    /// Coefficient µᵣ of rolling resistance; default ∞: grains do not rotate.
    pub rolling_resistance: GrainRolling,
    /// Speed at which overlapping grains separate [m/s]; default 0.5.
    pub recovery_speed: RecoverySpeed,
}

impl Grains {
    /// Whether grains rotate.
    #[must_use]
    pub fn rotates(&self) -> bool {
        self.rolling_resistance.get().is_finite()
    }
}

/// Contacts of grains from pass to pass. A cache: without it a body continues with the same bits.
#[derive(Debug, Clone, Default)]
pub struct GrainsState {
    made_for: Option<Identity>,
    /// The current substep; `None` before the first pass of a tick.
    substep: Option<u32>,
    neighbors: Neighbors,
    contacts: Contacts,
}

impl PartialEq for GrainsState {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl GrainsState {
    fn is_of(&self, topology: &Topology) -> bool {
        let own = self.made_for.as_ref();
        own.is_some_and(|identity| identity.id() == topology.id())
    }

    /// Number of pairs of grains that may touch.
    #[must_use]
    pub fn pairs(&self) -> usize {
        self.contacts.pairs()
    }

    /// Begins a substep before the first pass: finds pairs where grains have moved farther than
    /// expected, and in the first substep of a tick. So pairs depend on the state at the start of
    /// the tick alone.
    fn begin(&mut self, effect: &Grains, part: &Part, pass: &BodyPass) {
        let (substep, count) = pass.substep;
        let machine = (pass.threads, pass.instructions);
        let is_known = self.is_of(pass.topology) && substep > 0 && self.contacts.fit(part);
        self.neighbors.follow(part);
        if !(is_known && self.neighbors.are_valid(part)) {
            self.made_for = Some(pass.topology.identity());
            let radii = &pass.topology.radii;
            self.neighbors.find(part, radii, count - substep, machine);
            self.contacts
                .assign(&self.neighbors, part, radii, pass.threads);
        }
        let recovery = effect.recovery_speed.get() * pass.h;
        let friction = effect.friction.get();
        self.contacts
            .begin(part, (recovery, friction, pass.h), machine);
    }
}

impl BodyEffect for Grains {
    type State = Option<Box<GrainsState>>;
    type Scope = WholeBody;
    type ReferenceState = Vec<ReferenceContact>;

    const PHASE: BodyPhase = BodyPhase::Contact;
    const WORK: WorkOf = WorkOf::Contact;

    fn begin_tick(&self, state: &mut Self::State, _: &Topology, _: &[Vec4]) {
        state.get_or_insert_default().substep = None;
    }

    fn solve(&self, state: &mut Self::State, part: Part, pass: &BodyPass) -> bool {
        if pass.topology.radii.len() != part.positions.len() {
            return false;
        }
        let state = state.get_or_insert_default();
        if state.substep != Some(pass.substep.0) {
            state.begin(self, &part, pass);
            state.substep = Some(pass.substep.0);
        }
        if !state.contacts.fit(&part) {
            return false;
        }
        let friction = self.friction.get();
        let limits = Limits {
            friction: match pass.is_frictionless {
                true => [0.0; 2],
                false => [friction, friction * self.kinetic_fraction.get()],
            },
            cohesion: self.cohesion.get() * pass.h * pass.h,
            releases_friction: pass.is_frictionless,
            rolling: match pass.is_frictionless {
                true => 0.0,
                false => self.rolling_resistance.get(),
            },
        };
        let GrainsState {
            neighbors,
            contacts,
            ..
        } = &mut **state;
        let machine = (pass.threads, pass.instructions);
        contacts.solve(&neighbors.order, part, (limits, pass.h), machine)
    }

    fn begin_reference(&self, state: &mut Vec<ReferenceContact>, _: usize) {
        state.clear();
    }

    fn solve_reference(
        &self,
        state: &mut Vec<ReferenceContact>,
        mut body: ReferenceParticles,
        pass: &ReferencePass,
    ) {
        if state.is_empty() {
            find_reference(state, &body, f64::from(self.recovery_speed) * pass.h);
        }
        let friction = f64::from(self.friction);
        let kinetic = friction * f64::from(self.kinetic_fraction);
        let cohesion = f64::from(self.cohesion) * pass.h * pass.h;
        for contact in state {
            contact.solve(&mut body, ([friction, kinetic], cohesion), pass.h);
            *body.touched |= contact.normal_multiplier != 0.0;
        }
    }

    fn elements(&self, state: &Self::State, _: &Topology) -> usize {
        state.as_ref().map_or(0, |state| state.pairs())
    }

    fn load(&self, topology: &Topology) -> usize {
        PAIRS_PER_GRAIN * topology.radii.len()
    }

    fn bytes(state: &Self::State) -> usize {
        state.as_ref().map_or(0, |state| {
            size_of::<GrainsState>() + state.neighbors.bytes() + state.contacts.bytes()
        })
    }
}

/// A contact of the reference, found among all pairs.
#[derive(Debug, Clone)]
pub struct ReferenceContact {
    grains: [usize; 2],
    normal: DVec3,
    /// Distance to maintain [m].
    distance: f64,
    /// Whether they touch at the start of the substep.
    touches: bool,
    normal_multiplier: f64,
    friction_multiplier: DVec3,
    torque_multiplier: DVec3,
}

/// Finds the pairs of grains that may touch in a substep: they start closer than the lengths of
/// their motions allow. Swept along x; the contacts are in the order of their grains.
fn find_reference(found: &mut Vec<ReferenceContact>, body: &ReferenceParticles, recovery: f64) {
    let radius = |i: usize| f64::from(body.topology.radius(i));
    let motion = |i: usize| (body.x[i] - body.p[i]).length();
    // A pair reaches as far as both of its grains together.
    let reach = |i: usize| (1.0 + REFERENCE_REACH) * radius(i) + REFERENCE_REACH * motion(i);
    let farthest = (0..body.x.len()).map(reach).fold(0.0, f64::max);
    let mut order: Vec<usize> = (0..body.x.len()).collect();
    order.sort_by(|&a, &b| body.p[a].x.total_cmp(&body.p[b].x));
    for (place, &one) in order.iter().enumerate() {
        let limit = body.p[one].x + reach(one) + farthest;
        let near = order[place + 1..].iter();
        for &other in near.take_while(|&&other| body.p[other].x <= limit) {
            let [i, j] = [one.min(other), one.max(other)];
            let apart = body.p[i] - body.p[j];
            let (distance, gap) = (radius(i) + radius(j), apart.length());
            if gap <= reach(i) + reach(j) && gap > 0.0 && body.w[i] + body.w[j] > 0.0 {
                found.push(ReferenceContact {
                    grains: [i, j],
                    normal: apart / gap,
                    distance: distance.min(gap + recovery),
                    touches: gap < distance * (1.0 + f64::from(TOUCHING)),
                    normal_multiplier: 0.0,
                    friction_multiplier: DVec3::ZERO,
                    torque_multiplier: DVec3::ZERO,
                });
            }
        }
    }
    found.sort_unstable_by_key(|contact| contact.grains);
}

/// Reach of the search of the reference beyond contact, as a multiple of the motions and of the
/// distance.
const REFERENCE_REACH: f64 = 1.0;

impl ReferenceContact {
    fn solve(
        &mut self,
        body: &mut ReferenceParticles,
        ([sticks, slides], cohesion): ([f64; 2], f64),
        h: f64,
    ) {
        let ReferenceParticles {
            topology, x, p, w, ..
        } = body;
        let [i, j] = self.grains;
        let n = self.normal;
        let weight = w[i] + w[j];
        let cohesion = if self.touches { cohesion } else { 0.0 };
        let error = n.dot(x[i] - x[j]) - self.distance;
        let before = self.normal_multiplier;
        self.normal_multiplier = (before - error / weight).max(-cohesion);
        let impulse = n * (self.normal_multiplier - before);
        x[i] += impulse * w[i];
        x[j] -= impulse * w[j];
        let moved = (x[i] - p[i]) - (x[j] - p[j]);
        let slip = moved - n * moved.dot(n);
        let load = self.normal_multiplier + cohesion;
        let radii = [i, j].map(|grain| f64::from(topology.radius(grain)));
        // Angles by which a torque or an impulse at the surface turn the grains: I = ⅖mr².
        let turns = [0, 1].map(|k| 2.5 * w[self.grains[k]] / (radii[k] * radii[k]));
        let mut change = DVec3::ZERO;
        let wanted = if body.spins.is_empty() {
            self.friction_multiplier - slip / weight
        } else {
            let angles = [0, 1].map(|k| body.spins[self.grains[k]] * (h / radii[k]));
            let rolled = (angles[0] * radii[0] + angles[1] * radii[1]).cross(n);
            let slip = slip - (rolled - n * rolled.dot(n));
            let relative = angles[0] - angles[1];
            let mixed = turns[0] * radii[0] - turns[1] * radii[1];
            let of_turn = turns[0] + turns[1];
            let of_slip = 3.5 * weight;
            let both = of_slip - mixed * mixed / of_turn;
            let stuck = (n.cross(relative) * (mixed / of_turn) - slip) / both;
            let acting = self.friction_multiplier;
            let stuck = (acting + stuck).clamp_length_max((sticks * load).max(0.0)) - acting;
            let held = self.torque_multiplier;
            let limit = radii[0] * radii[1] / (radii[0] + radii[1]);
            let torque = (held + (n.cross(stuck) * mixed - relative) / of_turn)
                .clamp_length_max((body.rolling_resistance * load * limit).max(0.0));
            self.torque_multiplier = torque;
            change = torque - held;
            self.friction_multiplier - (slip + n.cross(change) * mixed) / of_slip
        };
        let size = wanted.length();
        let friction = match size <= sticks * load {
            true => wanted,
            false => wanted * (slides * load / size),
        };
        let impulse = friction - self.friction_multiplier;
        self.friction_multiplier = friction;
        x[i] += impulse * w[i];
        x[j] -= impulse * w[j];
        for (k, sign) in [(0, 1.0), (1, -1.0)] {
            if let Some(spin) = body.spins.get_mut(self.grains[k]) {
                let angle = (change * sign - n.cross(impulse) * radii[k]) * turns[k];
                *spin += angle * (radii[k] / h);
            }
        }
    }
}
