//! Rods: chains of edges with stiffness against stretching, shear, bending and twist, after
//! Cosserat (Kugelstadt and Schömer, *Position and Orientation Based Cosserat Rods*, 2016; Deul,
//! Kugelstadt, Weiler and Bender, *Direct Position-Based Solver for Stiff Rods*, 2018).
//!
//! Each segment has an orientation q, a unit quaternion, beside the particles at its ends. Its
//! section is a circle with A = πr², I = πr⁴/4, J = πr⁴/2, and G = E/(2(1 + ν)). The equations are
//!
//! - per segment C_s = xᵢ₊₁ − xᵢ − l d₃ [m], with its axis d₃ = q e₃ and the compliances l/(κGA)
//!   across and l/(EA) along it, κ = 0.9;
//! - per joint C_b = Im(q̄ᵢqᵢ₊₁) − Im(Ω₀), half of the angle by which the joint is bent and twisted
//!   from its rest rotation Ω₀, with the compliances l̄/(4EI) and l̄/(4GJ), l̄ being the mean of both
//!   lengths.
//!
//! They are solved together: an iteration is a Newton step of the whole chain, a block-tridiagonal
//! system that is eliminated from root to tip. The stiffness of a rod thus depends
//! neither on its number of segments nor on the iterations, and one iteration is enough. Four chains
//! are solved at once, one per SIMD lane; the reference solves one after another.
//!
//! A segment rotates like a cylinder of its mass, without the gyroscopic moment, and with implicit
//! Euler also where the particles have second-order steps. One between two pins is clamped. As C_b
//! is the sine of half an angle, a joint is too soft by a fraction of θ²/6 at an angle θ: 0.3 % at
//! 15°, 4.5 % at 30°.

mod bundle;
mod chains;
mod elimination;
mod pieces;
mod system;

pub use chains::{Chains, NotChains};
pub use system::SegmentState;

use super::body_effect::{
    BodyEffect, BodyPass, BodyPhase, ReferenceParticles, ReferencePass, Store,
};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Damping, Particles, PoissonRatio, RodRadius, Topology, YoungsModulus,
    kernel::sum::SquareSum,
    particles::Part,
    topology::{Identity, Torn},
};
use bundle::{Bundle, Iteration};
use glam::DVec3;
use pieces::{EachChain, Group, RodPiece, Scratches};
use serde::{Deserialize, Serialize};
use std::{borrow::Cow, collections::BTreeMap};
use system::{Node, Pass, Section, System};

/// Stiffness of a chain of edges against stretching, shear, bending and twist.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Rod {
    /// Young's modulus E [Pa]; default 1e6, soft rubber; ∞ is rigid.
    pub youngs_modulus: YoungsModulus,
    /// Poisson's ratio ν; default 0.3. It gives the shear modulus G = E/(2(1 + ν)).
    pub poisson_ratio: PoissonRatio,
    /// Radius r of the section [m]; default 5e-3. It does not affect the mass.
    pub radius: RodRadius,
    /// Damping τ [s], see [`multipliers`](super::multipliers); default 0.
    pub damping: Damping,
}

/// State of a rod from iteration to iteration, derived from its topology and its particles.
#[derive(Debug, Clone, Default)]
pub struct RodState {
    made_for: Option<Identity>,
    system: System,
    /// The chains in lanes; empty in the reference.
    bundles: Vec<Bundle>,
    /// Those of each partition, and of the chains that are too long for one.
    groups: Vec<Group>,
    scratch: Scratches,
}

impl PartialEq for RodState {
    fn eq(&self, other: &Self) -> bool {
        self.made_for == other.made_for && self.system == other.system
    }
}

impl RodState {
    /// For a body; a body that is not a set of chains has no segments.
    #[must_use]
    pub fn of(topology: &Topology) -> Self {
        Self {
            made_for: Some(topology.identity()),
            system: System::new(
                Chains::of(topology).unwrap_or_default(),
                topology.particles(),
            ),
            ..Self::default()
        }
    }

    /// For a body with these segments.
    pub(crate) fn resumed(topology: &Topology, segments: &[SegmentState]) -> Self {
        let mut state = Self::of(topology);
        if segments.len() == state.system.chains.segments.len() {
            state.system.segments = segments.to_vec();
        }
        state
    }

    /// Particles at the ends of each segment, in the order of the segments.
    pub(crate) fn nodes(&self) -> Vec<[u32; 2]> {
        let segments = self.system.chains.segments.iter();
        segments.map(|segment| segment.nodes).collect()
    }

    /// M Δx of the particles at the ends of each segment by its current multiplier [kg·m].
    pub fn pulls(&self) -> impl Iterator<Item = (u32, DVec3)> + '_ {
        let System {
            chains, lambdas, ..
        } = &self.system;
        let segments = chains.segments.iter().zip(lambdas);
        segments.flat_map(|(segment, [stretch, _])| {
            let [first, second] = segment.nodes;
            [(first, -*stretch), (second, *stretch)]
        })
    }

    /// The segments.
    pub(crate) fn segments(&self) -> &[SegmentState] {
        &self.system.segments
    }

    fn is_of(&self, topology: &Topology) -> bool {
        let own = self.made_for.as_ref();
        own.is_some_and(|identity| identity.id() == topology.id())
    }

    fn update(&mut self, topology: &Topology) {
        if !self.is_of(topology) {
            *self = Self::of(topology);
        }
    }

    /// The segments that fit positions `at` [m], at rest.
    fn fit(&mut self, at: impl Fn(u32) -> DVec3) {
        let fitted = self.system.chains.fit(at).into_iter();
        let still = |orientation| SegmentState {
            orientation,
            angular_velocity: DVec3::ZERO,
        };
        self.system.segments = fitted.map(still).collect();
    }

    fn has_segments(&self) -> bool {
        self.system.segments.len() == self.system.chains.segments.len()
    }

    /// The state of a body, or a new one before the first substep.
    fn known<'a>(
        state: Option<&'a Self>,
        topology: &Topology,
        at: impl Fn(u32) -> DVec3,
    ) -> Cow<'a, Self> {
        let known = state.filter(|state| state.is_of(topology) && state.has_segments());
        known.map_or_else(
            || {
                let mut new = Self::of(topology);
                new.fit(at);
                Cow::Owned(new)
            },
            Cow::Borrowed,
        )
    }
}

/// The segments of a torn rod: turned from the rest shape as before, also where a chain now begins
/// at its other end. Empty where there were none.
pub(crate) fn torn(segments: &[SegmentState], before: &Topology, torn: &Torn) -> Vec<SegmentState> {
    let (Ok(old), Ok(new)) = (Chains::of(before), Chains::of(&torn.topology)) else {
        return Vec::new();
    };
    if segments.len() != old.segments.len() {
        return Vec::new();
    }
    let ascending = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
    let known: BTreeMap<[u32; 2], usize> = old
        .segments
        .iter()
        .enumerate()
        .map(|(index, segment)| (ascending(segment.nodes), index))
        .collect();
    let follow = |segment: &chains::RestSegment| {
        let nodes = segment.nodes.map(|node| torn.sources[node as usize]);
        let index = *known.get(&ascending(nodes))?;
        let turn = segments[index].orientation * old.segments[index].orientation.conjugate();
        Some(SegmentState {
            orientation: (turn * segment.orientation).normalize(),
            ..segments[index]
        })
    };
    let all: Option<Vec<_>> = new.segments.iter().map(follow).collect();
    all.unwrap_or_default()
}

/// Writes the orientations of the segments of a rod into its particles, if they have none.
pub(crate) fn place(
    particles: &mut Particles,
    topology: &Topology,
    state: &mut Option<Box<RodState>>,
) {
    let state = state.get_or_insert_default();
    state.update(topology);
    let System {
        chains, segments, ..
    } = &mut state.system;
    let count = chains.segments.len();
    if state.groups.is_empty() {
        let of = |some| bundle::bundles(chains, some);
        (state.bundles, state.groups) = pieces::groups(&chains.parts, of);
    }
    if particles.segments.len() == count {
        segments.clone_from(&particles.segments);
    } else {
        state.fit(|i| particles.position(i as usize));
        particles.segments.clone_from(&state.system.segments);
    }
}

impl Rod {
    fn section(&self) -> Section {
        let [radius, modulus, ratio] = [
            self.radius.get(),
            self.youngs_modulus.get(),
            self.poisson_ratio.get(),
        ]
        .map(f64::from);
        Section::circle(radius, modulus, ratio)
    }
}

impl BodyEffect for Rod {
    type State = Option<Box<RodState>>;
    type Scope = EachChain;
    type ReferenceState = RodState;

    // After grabs, whose displacement of a light node it then spreads over the chain.
    const PHASE: BodyPhase = BodyPhase::IterationEnd;

    fn solve(&self, rod: RodPiece, part: Part, pass: &BodyPass) -> bool {
        let RodPiece {
            bundles,
            segments,
            lambdas,
            first_segment,
            scratch,
        } = rod;
        let has_segments = !segments.is_empty() && part.segments.len() == segments.len();
        let Some(scratch) = scratch.filter(|_| has_segments) else {
            return false;
        };
        let own = Pass {
            h: pass.h.into(),
            compliant: pass.compliant.into(),
            first: pass.iteration.0 == 0,
            last: pass.iteration.0 + 1 == pass.iteration.1,
            relaxation: pass.relaxation.into(),
            section: self.section(),
            damping: self.damping.get().into(),
        };
        let mut part = part;
        scratch.with(|scratch| {
            pass.instructions.run(Iteration {
                bundles,
                pass: &own,
                piece: bundle::Piece {
                    part: part.reborrow(),
                    first_particle: pass.first,
                    first_segment,
                    lambdas,
                },
                scratch,
            });
        });
        if own.last {
            segments.copy_from_slice(part.segments);
        }
        false
    }

    fn prepare_reference(&self, state: &mut RodState, topology: &Topology, x: &[DVec3], _: &[f64]) {
        state.update(topology);
        if !state.has_segments() {
            state.fit(|i| x[i as usize]);
        }
    }

    fn solve_reference(
        &self,
        state: &mut RodState,
        body: ReferenceParticles,
        pass: &ReferencePass,
    ) {
        let own = Pass {
            h: pass.h,
            compliant: pass.compliant,
            first: pass.iteration.0 == 0,
            last: pass.iteration.0 + 1 == pass.iteration.1,
            relaxation: pass.relaxation,
            section: self.section(),
            damping: self.damping.get().into(),
        };
        state.system.iterate(
            &own,
            |i| Node {
                x: body.x[i as usize],
                w: body.w[i as usize],
            },
            |i| body.from[i as usize],
        );
        for (x, by) in body.x.iter_mut().zip(&state.system.moves) {
            *x += *by;
        }
    }

    fn constraints(&self, topology: &Topology) -> usize {
        2 * topology.edges.ends().len()
    }

    /// A direct solve of a segment costs as much as about thirty springs.
    fn load(&self, topology: &Topology) -> usize {
        30 * topology.edges.ends().len()
    }

    fn stores(
        &self,
        state: &Option<Box<RodState>>,
        topology: &Topology,
        at: &dyn Fn(u32) -> (DVec3, f64),
        store: &mut dyn FnMut(Store),
    ) {
        let known = RodState::known(state.as_deref(), topology, |i| at(i).0);
        let damping = f64::from(self.damping.get());
        for (errors, compliances) in known.system.errors(self.section(), |i| at(i).0) {
            for (error, compliance) in errors.into_iter().zip(compliances) {
                for axis in 0..3 {
                    store(Store::Spring {
                        error: error[axis],
                        compliance: compliance[axis],
                        damping,
                    });
                }
            }
        }
    }

    /// Relative to the length of a segment, and to a half angle of 1 rad.
    fn residual(
        &self,
        state: &Option<Box<RodState>>,
        topology: &Topology,
        particles: &Particles,
        h: f64,
    ) -> SquareSum {
        let known = RodState::known(state.as_deref(), topology, |i| {
            particles.position(i as usize)
        });
        let system = &known.system;
        let mut all = SquareSum::default();
        let errors = system.errors(self.section(), |i| particles.position(i as usize));
        for (i, ([stretch, bend], [along, about])) in errors.enumerate() {
            let segment = &system.chains.segments[i];
            let local = system.segments[i].orientation.conjugate() * system.lambdas[i][0];
            let left = (stretch + along * local / (h * h)) / segment.length;
            let turn = bend + about * system.lambdas[i][1] / (h * h);
            all.sum += left.length_squared() + turn.length_squared();
            all.count += 2;
        }
        all
    }

    fn bytes(state: &Option<Box<RodState>>) -> usize {
        let bytes = |state: &RodState| {
            let bundles = state.bundles.iter().map(Bundle::bytes).sum::<usize>();
            size_of::<RodState>() + state.system.bytes() + bundles + state.scratch.bytes()
        };
        state.as_deref().map_or(0, bytes)
    }
}
