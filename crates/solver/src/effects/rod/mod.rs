//! Rods.

mod bundle;
mod clamp;
mod elimination;
mod link;
mod pieces;
mod shape;
mod system;

pub use link::RodLink;
pub use shape::{MAX_MEETING_EDGES, MAX_RINGS, NotARod, RodShape};

use super::body_effect::{
    BodyEffect, BodyPass, BodyPhase, ReferenceParticles, ReferencePass, Store,
};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Curl, Damping, Particles, PoissonRatio, RodRadius, SectionStiffness, SegmentState, Topology,
    TurnRate, Twist, YoungsModulus,
    kernel::sum::SquareSum,
    particles::Part,
    topology::{Identity, Torn},
};
use bundle::{Bundle, Iteration};
use glam::{DQuat, DVec3};
use pieces::{EachChain, Group, RodPiece, Scratches};
use serde::{Deserialize, Serialize};
use shape::{RestCurve, RestSegment};
use std::{borrow::Cow, collections::BTreeMap};
use system::{Node, Pass, Section, System};

/// Stiffness of edges against stretching, shear, bending and twist.
///
/// Rods: edges with stiffness against stretching, shear, bending and twist, after
/// Cosserat (Kugelstadt and Schömer, *Position and Orientation Based Cosserat Rods*, 2016; Deul,
/// Kugelstadt, Weiler and Bender, *Direct Position-Based Solver for Stiff Rods*, 2018).
///
/// Each segment has an orientation q, a unit quaternion, beside the particles at its ends. Its
/// section is a circle with A = πr², I = πr⁴/4, J = πr⁴/2, and G = E/(2(1 + ν)). The equations are
///
/// - per segment C_s = xᵢ₊₁ − xᵢ − l d₃ [m], with its axis d₃ = q e₃ and the compliances l/(κGA)
///   across and l/(EA) along it, κ = 0.9;
/// - per joint C_b = Im(q̄ᵢqᵢ₊₁) − Im(Ω₀), half of the angle by which the joint is bent and twisted
///   from its rest rotation Ω₀, with the compliances l̄/(4EI) and l̄/(4GJ), l̄ being the mean of both
///   lengths.
///
/// They are solved together: an iteration is a Newton step of all that is connected. The system of an
/// open chain is block-tridiagonal and eliminated from root to tip; that of a network with branches
/// and rings is sparse. The stiffness of a rod thus depends neither on its number of segments nor on
/// the iterations, and one iteration is enough. Four chains are solved at once, one per SIMD lane;
/// networks and the reference are solved without lanes.
///
/// At a branch, the rest rotation of a joint may be large. C_b of networks is therefore
/// Im(q̄ᵢqⱼΩ̄₀), which keeps its full stiffness at any angle; that of chains loses sin²(θ₀/2) of it at
/// a rest angle θ₀ per joint.
///
/// A segment rotates like a cylinder of its mass, without the gyroscopic moment, and with implicit
/// Euler also where the particles have second-order steps. One between two pins is clamped: it follows
/// the direction between them as they move, by parallel transport, and turns about it where
/// [`turn_start`](Self::turn_start) or [`turn_end`](Self::turn_end) say so. As C_b
/// is the sine of half an angle, a joint is too soft by a fraction of θ²/6 at an angle θ: 1.1 % at
/// 15°, 4.6 % at 30°.
///
/// ```
/// use pliant_solver::{PoissonRatio, Rod, RodRadius, YoungsModulus};
///
/// // Steel wire of 1 mm diameter.
/// let wire = Rod {
///     youngs_modulus: YoungsModulus::of(2.1e11), // Pa
///     poisson_ratio: PoissonRatio::of(0.3),
///     radius: RodRadius::of(5e-4), // m
///     ..Rod::default()
/// };
/// # assert_ne!(wire, Rod::default());
/// ```
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
    /// Stiffness EI against bending [N·m²], for sections that are not a circle, such as yarns and
    /// cables; default 0: that of a circle.
    pub bending_stiffness: SectionStiffness,
    /// Stiffness GJ against twist [N·m²]; default 0: that of a circle.
    pub twisting_stiffness: SectionStiffness,
    /// Fraction of the curvature of the mesh that the rod has at rest; default 1; 0 is straight.
    /// Branches keep their angles.
    pub curl: Curl,
    /// Twist at rest beside that of the mesh [rad/m]; default 0. A curved rod becomes a helix, and a
    /// closed one leaves its plane (Michell 1889).
    pub twist: Twist,
    /// Angular velocity about its axis of the clamped first segment of each open chain [rad/s], right-handed
    /// about the direction away from it; default 0. The first segment is that of the two at free ends
    /// with the lowest vertex. No effect where its particles are not both pinned. A substep turns it by
    /// less than half a turn.
    pub turn_start: TurnRate,
    /// The same of the clamped last segment [rad/s], about the direction from the first to the last
    /// particle, so that equal rates turn the rod as a shaft; default 0.
    pub turn_end: TurnRate,
    /// Damping τ [s], see [`Multipliers`](crate::effects::Multipliers); default 0.
    #[serde(with = "in_snapshots")]
    pub damping: Damping,
}

/// State of a rod from iteration to iteration, derived from its topology and its particles.
#[derive(Debug, Clone, Default)]
pub struct RodState {
    made_for: Option<Identity>,
    curve: RestCurve,
    chains: System,
    networks: System,
    /// The chains in lanes; empty in the reference.
    bundles: Vec<Bundle>,
    /// Those of each partition, and of the chains that are too long for one.
    groups: Vec<Group>,
    scratch: Scratches,
}

impl PartialEq for RodState {
    fn eq(&self, other: &Self) -> bool {
        self.made_for == other.made_for
            && self.curve == other.curve
            && self.chains == other.chains
            && self.networks == other.networks
    }
}

impl RodState {
    /// For a rod and its body; a body with a surface has no segments.
    #[must_use]
    pub fn of(rod: &Rod, topology: &Topology) -> Self {
        let curve = rod.curve();
        let mut shape = RodShape::of(topology).unwrap_or_default();
        shape.curl(curve);
        Self {
            made_for: Some(topology.identity()),
            curve,
            chains: System::new(shape.chains, topology.particles()),
            networks: System::new(shape.networks, topology.particles()),
            ..Self::default()
        }
    }

    /// For a body with these segments.
    pub(crate) fn resumed(rod: &Rod, topology: &Topology, segments: &[SegmentState]) -> Self {
        let mut state = Self::of(rod, topology);
        state.resume(segments);
        state
    }

    /// Takes over the segments of the particles, if there is one for each.
    fn resume(&mut self, segments: &[SegmentState]) -> bool {
        let count = self.chains.rest.segments.len();
        let is_whole = segments.len() == count + self.networks.rest.segments.len();
        if is_whole {
            let (chains, networks) = segments.split_at(count);
            chains.clone_into(&mut self.chains.segments);
            networks.clone_into(&mut self.networks.segments);
        }
        is_whole
    }

    /// Particles at the ends of each segment, in the order of the segments.
    pub(crate) fn nodes(&self) -> Vec<[u32; 2]> {
        let systems = [&self.chains, &self.networks].into_iter();
        let segments = systems.flat_map(|system| &system.rest.segments);
        segments.map(|segment| segment.nodes).collect()
    }

    /// For each row of equations, in the order of the energies of the rod, its segment and the
    /// segments of its joint.
    pub(crate) fn rows(&self) -> impl Iterator<Item = (Option<usize>, Option<[usize; 2]>)> + '_ {
        let first = self.chains.rest.segments.len();
        let systems = [(&self.chains.rest, 0), (&self.networks.rest, first)].into_iter();
        systems.flat_map(|(rest, first)| {
            (0..rest.rows()).map(move |row| {
                let joint = rest.joint_of(row);
                let segments = joint.map(|(behind, it)| [it.before + first, behind + first]);
                ((row < rest.segments.len()).then_some(row + first), segments)
            })
        })
    }

    /// M Δx of the particles at the ends of each segment by its current multiplier [kg·m].
    pub fn pulls(&self) -> impl Iterator<Item = (u32, DVec3)> + '_ {
        let systems = [&self.chains, &self.networks].into_iter();
        let segments = systems.flat_map(|system| system.rest.segments.iter().zip(&system.lambdas));
        segments.flat_map(|(segment, [stretch, _])| {
            let [first, second] = segment.nodes;
            [(first, -*stretch), (second, *stretch)]
        })
    }

    /// Work in a substep of `h` seconds of clamped segments that turn [J]; `w` is the inverse mass of a
    /// particle.
    pub(crate) fn work_of_clamps(&self, h: f64, w: impl Fn(u32) -> f64) -> f64 {
        let systems = [&self.chains, &self.networks].into_iter();
        systems.map(|system| system.work_of_clamps(h, &w)).sum()
    }

    /// The segments.
    pub(crate) fn segments(&self) -> Vec<SegmentState> {
        [&self.chains.segments[..], &self.networks.segments[..]].concat()
    }

    fn is_of(&self, topology: &Topology) -> bool {
        let own = self.made_for.as_ref();
        own.is_some_and(|identity| identity.id() == topology.id())
    }

    /// Begins anew for another body. With another curve at rest, the segments stay.
    fn update(&mut self, rod: &Rod, topology: &Topology) {
        if !self.is_of(topology) {
            *self = Self::of(rod, topology);
        } else if self.curve != rod.curve() {
            *self = Self::resumed(rod, topology, &self.segments());
        }
    }

    /// The segments that fit positions `at` [m], at rest.
    fn fit(&mut self, at: impl Fn(u32) -> DVec3) {
        let still = |orientation| SegmentState {
            orientation,
            angular_velocity: DVec3::ZERO,
        };
        for system in [&mut self.chains, &mut self.networks] {
            system.segments = system.rest.fit(&at).into_iter().map(still).collect();
        }
    }

    fn has_segments(&self) -> bool {
        self.chains.has_segments() && self.networks.has_segments()
    }

    /// The state of a body, or a new one before the first substep.
    fn known<'a>(
        state: Option<&'a Self>,
        rod: &Rod,
        topology: &Topology,
        at: impl Fn(u32) -> DVec3,
    ) -> Cow<'a, Self> {
        let known = state.filter(|state| state.is_of(topology) && state.has_segments());
        if let Some(known) = known.filter(|state| state.curve != rod.curve()) {
            return Cow::Owned(Self::resumed(rod, topology, &known.segments()));
        }
        known.map_or_else(
            || {
                let mut new = Self::of(rod, topology);
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
    let (Ok(old), Ok(new)) = (RodShape::of(before), RodShape::of(&torn.topology)) else {
        return Vec::new();
    };
    if segments.len() != old.segments().len() {
        return Vec::new();
    }
    let ascending = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
    let known: BTreeMap<[u32; 2], (DQuat, SegmentState)> = old
        .segments()
        .zip(segments)
        .map(|(rest, segment)| (ascending(rest.nodes), (rest.orientation, *segment)))
        .collect();
    let follow = |segment: &RestSegment| {
        let nodes = segment.nodes.map(|node| torn.sources[node as usize]);
        let (rest, state) = known.get(&ascending(nodes))?;
        let turn = state.orientation * rest.conjugate();
        Some(SegmentState {
            orientation: (turn * segment.orientation).normalize(),
            ..*state
        })
    };
    let all: Option<Vec<_>> = new.segments().map(follow).collect();
    all.unwrap_or_default()
}

/// State of a rod with these segments; of one without segments it is made in the next substep.
pub(crate) fn resumed(
    rod: &Rod,
    topology: &Topology,
    segments: &[SegmentState],
) -> Option<Box<RodState>> {
    let resumed = || Box::new(RodState::resumed(rod, topology, segments));
    (!segments.is_empty()).then(resumed)
}

/// Writes the orientations of the segments of a rod into its particles, if they have none.
pub(crate) fn place(
    rod: &Rod,
    particles: &mut Particles,
    topology: &Topology,
    state: &mut Option<Box<RodState>>,
) {
    let state = state.get_or_insert_default();
    state.update(rod, topology);
    if state.groups.is_empty() {
        let parts = RodShape::of(topology).map(|shape| shape.parts);
        let of = |some| bundle::bundles(&state.chains.rest, some);
        (state.bundles, state.groups) = pieces::groups(&parts.unwrap_or_default(), of);
    }
    if !state.resume(&particles.segments) {
        state.fit(|i| particles.position(i as usize));
        particles.segments = state.segments();
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
        let mut section = Section::circle(radius, modulus, ratio);
        let own = |stiffness: SectionStiffness| 1.0 / (4.0 * f64::from(stiffness.get()));
        if self.bending_stiffness.get() > 0.0 {
            section.bend.x = own(self.bending_stiffness);
            section.bend.y = section.bend.x;
        }
        if self.twisting_stiffness.get() > 0.0 {
            section.bend.z = own(self.twisting_stiffness);
        }
        section
    }

    /// EA [N].
    pub(crate) fn axial_stiffness(&self) -> f64 {
        1.0 / self.section().stretch.z
    }

    fn curve(&self) -> RestCurve {
        RestCurve {
            curl: self.curl.get().into(),
            twist: self.twist.get().into(),
        }
    }

    /// Whether it turns clamped segments. Such a body does not fall asleep.
    #[must_use]
    pub fn turns(&self) -> bool {
        self.turn_start.get() != 0.0 || self.turn_end.get() != 0.0
    }

    /// An iteration, by its number and the number of all of a substep of `seconds`; `h` is its length for
    /// implicit Euler [s].
    fn pass(
        &self,
        [seconds, h, compliant]: [f64; 3],
        iteration: (u32, u32),
        relaxation: f64,
    ) -> Pass {
        let half = |rate: TurnRate| libm::tan(0.5 * seconds * f64::from(rate.get()));
        Pass {
            h,
            compliant,
            first: iteration.0 == 0,
            last: iteration.0 + 1 == iteration.1,
            relaxation,
            section: self.section(),
            damping: self.damping.get().into(),
            turns: [self.turn_start, self.turn_end].map(half),
        }
    }
}

impl Pass {
    /// The same for networks, which have no first and last segment.
    fn of_networks(self) -> Self {
        Self {
            turns: [0.0; 2],
            ..self
        }
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
            networks,
            scratch,
        } = rod;
        let networks = networks.filter(|system| !system.segments.is_empty());
        let count = segments.len();
        let all = count + networks.as_ref().map_or(0, |system| system.segments.len());
        let has_segments = all > 0 && part.segments.len() == all;
        let Some(scratch) = scratch.filter(|_| has_segments) else {
            return false;
        };
        let own = self.pass(
            [pass.seconds, pass.h.into(), pass.compliant.into()],
            pass.iteration,
            pass.relaxation.into(),
        );
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
            segments.copy_from_slice(&part.segments[..count]);
        }
        if let Some(system) = networks {
            if own.first {
                system.segments.copy_from_slice(&part.segments[count..]);
            }
            let node = |i: u32| {
                let particle = i as usize - pass.first;
                Node {
                    x: part.predicted(particle),
                    w: part.positions[particle].w.into(),
                }
            };
            let start = |i| part.start(i as usize - pass.first);
            system.iterate(&own.of_networks(), node, start);
            for (i, &by) in system.moves.iter().enumerate() {
                if by != DVec3::ZERO {
                    part.shift(i - pass.first, by);
                }
            }
            if own.last {
                part.segments[count..].copy_from_slice(&system.segments);
            }
        }
        false
    }

    fn prepare_reference(&self, state: &mut RodState, topology: &Topology, x: &[DVec3], _: &[f64]) {
        state.update(self, topology);
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
        let own = self.pass(
            [pass.seconds, pass.h, pass.compliant],
            pass.iteration,
            pass.relaxation,
        );
        let systems = [
            (&mut state.chains, own),
            (&mut state.networks, own.of_networks()),
        ];
        for (system, own) in systems {
            let node = |i: u32| Node {
                x: body.x[i as usize],
                w: body.w[i as usize],
            };
            system.iterate(&own, node, |i| body.from[i as usize]);
            for (x, by) in body.x.iter_mut().zip(&system.moves) {
                *x += *by;
            }
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
        let known = RodState::known(state.as_deref(), self, topology, |i| at(i).0);
        let damping = f64::from(self.damping.get());
        let systems = [&known.chains, &known.networks].into_iter();
        for (errors, compliances) in
            systems.flat_map(|system| system.errors(self.section(), |i| at(i).0))
        {
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
        let known = RodState::known(state.as_deref(), self, topology, |i| {
            particles.position(i as usize)
        });
        let mut all = SquareSum::default();
        for system in [&known.chains, &known.networks] {
            let errors = system.errors(self.section(), |i| particles.position(i as usize));
            for (row, ([stretch, bend], [along, about])) in errors.enumerate() {
                let [of_stretch, of_bend] = system.lambdas[row];
                if let Some(segment) = system.rest.segments.get(row) {
                    let local = system.segments[row].orientation.conjugate() * of_stretch;
                    let left = (stretch + along * local / (h * h)) / segment.length;
                    all.sum += left.length_squared();
                    all.count += 1;
                }
                all.sum += (bend + about * of_bend / (h * h)).length_squared();
                all.count += 1;
            }
        }
        all
    }

    fn bytes(state: &Option<Box<RodState>>) -> usize {
        let bytes = |state: &RodState| {
            let bundles = state.bundles.iter().map(Bundle::bytes).sum::<usize>();
            let systems = state.chains.bytes() + state.networks.bytes();
            size_of::<RodState>() + systems + bundles + state.scratch.bytes()
        };
        state.as_deref().map_or(0, bytes)
    }
}

/// The damping; in snapshots a byte follows it, which is 0.
mod in_snapshots {
    use crate::Damping;
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

    pub fn serialize<S: Serializer>(damping: &Damping, to: S) -> Result<S::Ok, S::Error> {
        match to.is_human_readable() {
            true => damping.serialize(to),
            false => (damping, 0_u8).serialize(to),
        }
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Damping, D::Error> {
        if from.is_human_readable() {
            return Damping::deserialize(from);
        }
        match <(Damping, u8)>::deserialize(from)? {
            (damping, 0) => Ok(damping),
            _ => Err(D::Error::custom("a rod with an unknown solver")),
        }
    }
}
