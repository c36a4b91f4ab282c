//! Shape matching.

use super::body_effect::{BodyEffect, BodyPass, ReferenceParticles, ReferencePass, Resting, Store};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{
    Damping, Frequency, Particles, RegionSize, Topology,
    fit::MassFit,
    kernel::sum::SquareSum,
    parallel::scope::WholeBody,
    particles::Part,
    topology::{Identity, Regions},
};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::{borrow::Cow, f64::consts::TAU};

/// Particles are drawn to the rest shape.
///
/// Shape matching: particles are drawn to the rest shape, moved and rotated to fit them best
/// (Müller, Heidelberger, Teschner and Gross, *Meshless Deformations Based on Shape Matching*,
/// 2005).
///
/// The matched shape is the whole body, or each of its overlapping [regions](Regions), which gives
/// a body many more degrees of freedom. A particle in n regions contributes an n-th of its mass to
/// each. With these masses mᵢ, current positions xᵢ and rest positions qᵢ, a region has the goals
/// gᵢ = R(qᵢ − q̄) + x̄, with mass-weighted means and the rotation R that minimizes
///
/// D² = Σ mᵢ‖xᵢ − gᵢ‖²
///
/// and stores the energy ½ω²D² with ω = 2πf: a free deformed body oscillates about its shape with
/// the frequency f, independent of its mesh, its mass and the substeps. ∞ is a rigid body.
///
/// D is the single equation of a region, with the compliance 1/ω² in s². As R and the means are
/// optimal, they do not contribute to its gradient mᵢ(xᵢ − gᵢ)/D, so that every iteration conserves
/// linear and angular momentum. Regions are solved simultaneously, from the same positions. Σ
/// w‖∇D‖² is taken as 1, which is exact for the whole body: with divided masses, all regions
/// together then move a particle at most to the mean of its goals, and such averaged Jacobi
/// iterations converge.
///
/// With a [method](crate::Method) without compliances all shapes are rigid; in classic PBD
/// particles move by its stiffness fraction towards their goals.
///
/// R is found by Horn's quaternions in `f64`, from scratch every time: it exists and is
/// deterministic also for a shape that is flat, mirrored or shrunk to a line or a point. Pins are
/// weighted a million times as heavily as the rest of their region, so that the goals follow them.
///
/// ```
/// use pliant_solver::{Frequency, RegionSize, ShapeMatching};
///
/// // A pudding that wobbles with 4 Hz, in regions of 10 cm.
/// let pudding = ShapeMatching {
///     frequency: Frequency::of(4.0),  // Hz
///     region: RegionSize::of(0.1), // m
///     ..ShapeMatching::default()
/// };
/// # assert_ne!(pudding, ShapeMatching::default());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct ShapeMatching {
    /// Frequency f of oscillation of the body about its shape [Hz]; default 10, ∞ is rigid.
    pub frequency: Frequency,
    /// Size of the matched regions [m]; default ∞, the whole body.
    pub region: RegionSize,
    /// Damping τ [s], see [`Multipliers`](crate::effects::Multipliers); default 0.
    pub damping: Damping,
}

impl ShapeMatching {
    /// 1/ω² [s²]; 0 is rigid.
    #[must_use]
    pub fn compliance(&self) -> f64 {
        let omega = TAU * f64::from(self.frequency.get());
        1.0 / (omega * omega)
    }

    /// The state, or a new one before the first substep after a change.
    fn known<'a>(
        &self,
        state: &'a Option<Box<ShapeMatchingState>>,
        topology: &Topology,
    ) -> Cow<'a, ShapeMatchingState> {
        let known = state.as_deref().filter(|it| it.is_of(topology, self));
        known.map_or_else(
            || Cow::Owned(ShapeMatchingState::of(topology, self)),
            Cow::Borrowed,
        )
    }
}

/// Weight of a pin, relative to all movable particles of a region.
pub(crate) const HEAVY: f64 = 1e6;

/// Particle state for shape matching.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MatchedParticle {
    /// Current position [m].
    pub x: DVec3,
    /// Position at the start of the substep [m].
    pub p: DVec3,
    /// Inverse mass [1/kg].
    pub w: f64,
}

/// The regions of a body and their state, derived from the topology and the size of the regions.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ShapeMatchingState {
    /// Topology and size [m] for which the regions were made.
    made_for: Option<(Identity, f32)>,
    regions: Regions,
    /// λ of each region; λ/h² is a force over the root of a mass.
    lambdas: Vec<f64>,
    /// Movable particles of a region, with their parts of the mass [kg] and their offsets x − g
    /// [m]: a buffer for the last iteration.
    offs: Vec<(u32, f64, DVec3)>,
    /// Displacements of the particles by the last iteration [m].
    moves: Vec<DVec3>,
}

/// Parameters of an iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MatchingPass {
    /// Length of the substep for compliance and damping [s].
    pub h: f64,
    /// Whether it is the first one of a substep, in which λ is 0.
    pub first: bool,
    /// Fraction of the correction that is applied, from 0 to 1.
    pub relaxation: f64,
}

impl MatchedParticle {
    /// Particles of the fast solver between substeps.
    pub fn among(particles: &Particles) -> impl Fn(u32) -> Self {
        |i| {
            let i = i as usize;
            Self::still((particles.position(i), particles.positions[i].w.into()))
        }
    }

    fn of_reference(body: &ReferenceParticles) -> impl Fn(u32) -> Self {
        |i| {
            let i = i as usize;
            Self {
                x: body.x[i],
                p: body.p[i],
                w: body.w[i],
            }
        }
    }

    /// A particle of inverse mass `w` at `x` without motion.
    #[must_use]
    pub fn still((x, w): (DVec3, f64)) -> Self {
        Self { x, p: x, w }
    }
}

impl ShapeMatchingState {
    /// For a body.
    #[must_use]
    pub fn of(topology: &Topology, effect: &ShapeMatching) -> Self {
        let mut matching = Self::default();
        matching.update(topology, effect);
        matching
    }

    /// Updates the regions for a changed size; must be called before a tick.
    pub fn update(&mut self, topology: &Topology, effect: &ShapeMatching) {
        if !self.is_of(topology, effect) {
            let size = effect.region.get();
            self.regions = Regions::of(topology, size);
            self.lambdas = vec![0.0; self.regions.count()];
            self.moves = vec![DVec3::ZERO; topology.particles()];
            self.made_for = Some((topology.identity(), size));
        }
    }

    /// Whether the regions are those of the effect.
    #[must_use]
    pub fn is_of(&self, topology: &Topology, effect: &ShapeMatching) -> bool {
        self.made_for.as_ref().is_some_and(|(identity, size)| {
            identity.id() == topology.id() && *size == effect.region.get()
        })
    }

    /// The regions.
    #[must_use]
    pub fn regions(&self) -> &Regions {
        &self.regions
    }

    /// Memory use in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.regions.bytes()
            + size_of_val(&self.lambdas[..])
            + size_of_val(&self.offs[..])
            + size_of_val(&self.moves[..])
    }

    /// D of each region [m √kg].
    pub fn strains(
        &self,
        topology: &Topology,
        at: impl Fn(u32) -> MatchedParticle,
    ) -> impl Iterator<Item = f64> {
        let regions = self.regions.each();
        regions.map(move |members| Fit::of(members, &self.regions, topology, &at).strain(&at))
    }

    /// Energy stored by all regions, ½ω²D² [J]; rigid ones store none.
    #[must_use]
    pub fn energy(
        &self,
        topology: &Topology,
        effect: &ShapeMatching,
        at: impl Fn(u32) -> MatchedParticle,
    ) -> f64 {
        let compliance = effect.compliance();
        if compliance > 0.0 {
            let squares = self.strains(topology, at).map(|strain| strain * strain);
            0.5 * squares.sum::<f64>() / compliance
        } else {
            0.0
        }
    }

    /// Residual of D + αλ/h² = 0 after a substep of `h` seconds, relative to the root of the moment
    /// of mass of each region.
    #[must_use]
    pub fn residual(
        &self,
        topology: &Topology,
        effect: &ShapeMatching,
        h: f64,
        at: impl Fn(u32) -> MatchedParticle,
    ) -> SquareSum {
        let alpha = effect.compliance() / (h * h);
        let mut all = SquareSum::default();
        for (members, lambda) in self.regions.each().zip(&self.lambdas) {
            let fit = Fit::of(members, &self.regions, topology, &at);
            let scale = fit.size(&at);
            if scale > 0.0 {
                let relative = (fit.strain(&at) + alpha * lambda) / scale;
                all.sum += relative * relative;
                all.count += 1;
            }
        }
        all
    }

    /// One iteration over all regions: displacement of each particle [m].
    pub fn iterate(
        &mut self,
        topology: &Topology,
        effect: &ShapeMatching,
        MatchingPass {
            h,
            first,
            relaxation,
        }: MatchingPass,
        at: impl Fn(u32) -> MatchedParticle,
    ) -> &[DVec3] {
        let alpha = effect.compliance() / (h * h);
        let gamma = f64::from(effect.damping.get()) / h;
        if first {
            self.lambdas.fill(0.0);
        }
        self.push(topology, at, |strain, rate, lambda| {
            let left = strain + alpha * *lambda + gamma * rate;
            let change = -relaxation * left / (1.0 + gamma + alpha);
            *lambda += change;
            change
        })
    }

    /// Displacement of each particle by the current multipliers [m].
    pub fn pull(&mut self, topology: &Topology, at: impl Fn(u32) -> MatchedParticle) -> &[DVec3] {
        self.push(topology, at, |_, _, lambda| *lambda)
    }

    /// Accumulates w ∇D Δλ over all regions; Δλ is a function of D, ∇D·(x − p) and λ.
    fn push(
        &mut self,
        topology: &Topology,
        at: impl Fn(u32) -> MatchedParticle,
        change: impl Fn(f64, f64, &mut f64) -> f64,
    ) -> &[DVec3] {
        let Self {
            regions,
            lambdas,
            offs,
            moves,
            ..
        } = self;
        moves.fill(DVec3::ZERO);
        for (members, lambda) in regions.each().zip(lambdas) {
            let fit = Fit::of(members, regions, topology, &at);
            offs.clear();
            offs.extend(
                fit.free(&at)
                    .map(|(i, mass)| (i, mass, fit.off(i, at(i).x))),
            );
            let squares = offs
                .iter()
                .map(|(_, mass, off)| mass * off.length_squared());
            let strain = squares.sum::<f64>().sqrt();
            if strain == 0.0 {
                continue;
            }
            let rates = offs.iter().map(|&(i, mass, off)| {
                let place = at(i);
                mass * off.dot(place.x - place.p)
            });
            let rate = rates.sum::<f64>() / strain;
            let by = change(strain, rate, lambda) / strain;
            for &(i, _, off) in &*offs {
                moves[i as usize] += off * (regions.weights()[i as usize] * by);
            }
        }
        moves
    }
}

impl BodyEffect for ShapeMatching {
    type State = Option<Box<ShapeMatchingState>>;
    type Scope = WholeBody;
    const IS_INTERNAL: bool = true;
    type ReferenceState = ShapeMatchingState;

    fn prepare(&self, state: &mut Option<Box<ShapeMatchingState>>, body: &Resting) {
        let state = state.get_or_insert_default();
        state.update(body.topology, self);
    }

    fn solve(
        &self,
        state: &mut Option<Box<ShapeMatchingState>>,
        mut part: Part,
        pass: &BodyPass,
    ) -> bool {
        let Some(state) = state
            .as_mut()
            .filter(|it| it.moves.len() == part.positions.len())
        else {
            return false;
        };
        let own = MatchingPass {
            h: pass.compliant.into(),
            first: pass.iteration.0 == 0,
            relaxation: pass.relaxation.into(),
        };
        let moves = state.iterate(pass.topology, self, own, |i| MatchedParticle {
            x: part.predicted(i as usize),
            p: part.start(i as usize),
            w: part.positions[i as usize].w.into(),
        });
        for (i, &by) in moves.iter().enumerate() {
            if by != DVec3::ZERO {
                part.shift(i, by);
            }
        }
        false
    }

    fn prepare_reference(
        &self,
        state: &mut ShapeMatchingState,
        topology: &Topology,
        _: &[DVec3],
        _: &[f64],
    ) {
        state.update(topology, self);
    }

    fn solve_reference(
        &self,
        state: &mut ShapeMatchingState,
        body: ReferenceParticles,
        pass: &ReferencePass,
    ) {
        let own = MatchingPass {
            h: pass.compliant,
            first: pass.is_anew,
            relaxation: pass.relaxation,
        };
        let moves = state.iterate(
            body.topology,
            self,
            own,
            MatchedParticle::of_reference(&body),
        );
        for (x, by) in body.x.iter_mut().zip(moves) {
            *x += *by;
        }
    }

    fn pull_reference(&self, state: &mut ShapeMatchingState, body: ReferenceParticles) {
        let moves = state.pull(body.topology, MatchedParticle::of_reference(&body));
        for (x, by) in body.x.iter_mut().zip(moves) {
            *x += *by;
        }
    }

    fn constraints(&self, _: &Topology) -> usize {
        1
    }

    fn elements(&self, state: &Option<Box<ShapeMatchingState>>, topology: &Topology) -> usize {
        self.known(state, topology).regions.count()
    }

    fn load(&self, topology: &Topology) -> usize {
        1 + topology.particles()
    }

    fn stores(
        &self,
        state: &Option<Box<ShapeMatchingState>>,
        topology: &Topology,
        at: &dyn Fn(u32) -> (DVec3, f64),
        store: &mut dyn FnMut(Store),
    ) {
        let known = self.known(state, topology);
        for error in known.strains(topology, |i| MatchedParticle::still(at(i))) {
            store(Store::Spring {
                error,
                compliance: self.compliance(),
                damping: self.damping.get().into(),
            });
        }
    }

    fn residual(
        &self,
        state: &Option<Box<ShapeMatchingState>>,
        topology: &Topology,
        particles: &Particles,
        h: f64,
    ) -> SquareSum {
        let known = self.known(state, topology);
        known.residual(topology, self, h, MatchedParticle::among(particles))
    }

    fn bytes(state: &Option<Box<ShapeMatchingState>>) -> usize {
        state
            .as_ref()
            .map_or(0, |it| size_of::<ShapeMatchingState>() + it.bytes())
    }
}

/// Best fit of the rest shape of a region.
struct Fit<'a> {
    members: &'a [u32],
    regions: &'a Regions,
    topology: &'a Topology,
    best: MassFit,
}

impl<'a> Fit<'a> {
    fn of(
        members: &'a [u32],
        regions: &'a Regions,
        topology: &'a Topology,
        at: &impl Fn(u32) -> MatchedParticle,
    ) -> Self {
        let rest = |i: u32| topology.rest[i as usize].as_dvec3();
        let mass = |i: u32, w: f64| (w > 0.0).then(|| regions.weights()[i as usize] / w);
        let light: f64 = members.iter().filter_map(|&i| mass(i, at(i).w)).sum();
        let pinned = if light > 0.0 { HEAVY * light } else { 1.0 };
        let particles = members.iter().map(|&i| {
            let MatchedParticle { x, w, .. } = at(i);
            (rest(i), x, mass(i, w).unwrap_or(pinned))
        });
        Self {
            members,
            regions,
            topology,
            best: MassFit::of(particles),
        }
    }

    fn rest(&self, i: u32) -> DVec3 {
        self.topology.rest[i as usize].as_dvec3()
    }

    /// Part of the mass of a particle of inverse mass `w` in the region [kg]; `None` if it is
    /// pinned.
    fn mass(&self, i: u32, w: f64) -> Option<f64> {
        (w > 0.0).then(|| self.regions.weights()[i as usize] / w)
    }

    /// Movable particles, with their parts of the mass [kg].
    fn free(&self, at: &impl Fn(u32) -> MatchedParticle) -> impl Iterator<Item = (u32, f64)> {
        let members = self.members.iter();
        members.filter_map(|&i| Some((i, self.mass(i, at(i).w)?)))
    }

    /// x − g of a particle [m].
    fn off(&self, i: u32, x: DVec3) -> DVec3 {
        self.best.off(self.rest(i), x)
    }

    /// D [m √kg].
    fn strain(&self, at: &impl Fn(u32) -> MatchedParticle) -> f64 {
        let squares = self
            .free(at)
            .map(|(i, mass)| mass * self.off(i, at(i).x).length_squared());
        squares.sum::<f64>().sqrt()
    }

    /// Root of Σ m‖q − q̄‖² [m √kg], which is D of a region that has shrunk to a point.
    fn size(&self, at: &impl Fn(u32) -> MatchedParticle) -> f64 {
        let squares = self
            .free(at)
            .map(|(i, mass)| mass * self.rest(i).distance_squared(self.best.rest_middle));
        squares.sum::<f64>().sqrt()
    }
}
