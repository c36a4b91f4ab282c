//! The stiffness that was asked for beside the one that the solver delivers.
//!
//! **What a substep leaves behind.** When a constraint has had its turn, its own equation holds,
//! with the multiplier λ of all its turns in the substep:
//!
//! C + α̃λ + γ ∇C·(x − p) = 0, α̃ = α/h², γ = τ/h.
//!
//! So λ and the C *of that moment* say nothing: they always fit. Constraints that come later in
//! the sweep then change C by δ, and nobody mends that before the substep ends. With the C and
//! the velocity v = (x − p)/h of the end,
//!
//! C + τ ∇C·v = −α̃λ + (1 + γ) δ.
//!
//! **λ/h² is the true force all the same.** In a substep every movable particle obeys
//! (v − v₀)/(h w) = g/w + Σ ∇C λ/h², whether the sweeps converged or not: λ starts from zero, and
//! all that moved the particle besides gravity is the sum of w ∇C Δλ. In a body at rest these
//! forces are in balance with the load; in a hanging chain they are the tensions. One sweep is
//! enough for that, as the sweep takes up all of gravity's way of a substep, h²g, every time.
//! (Each ∇C is the one of its own turn, so the balance at the end is off by the share of itself
//! by which an element turned or stretched within the substep.)
//!
//! **The measure** is the slope of strain over force, with F = −λ/h² [N, or Pa for a volume] and
//! e = C + τ ∇C·v:
//!
//! got = Σ eF / ΣF², asked = ΣαF² / ΣF², both in m/N, or m⁵/N for a volume.
//!
//! got/asked is the fit by least squares, weighted by 1/α, of e = factor · αF. It is a
//! ratio of works too: at rest, ΣCF over all effects is the load times its real displacement
//! (principle of virtual work), and ΣαF² is what the material would make of the same forces. Where
//! statics alone determines the forces, as in a chain, got/asked is exactly the factor by which
//! the body gives way to its load more than it should. Elsewhere the forces are not quite those of
//! the converged body, and over all effects together it is that factor or less: of all forces in
//! balance with a load, the true ones have the least ΣαF².
//!
//! **When it says nothing.** It is `None` when no element carries a force; when the mean strain
//! under load is within the rounding of a rest length to f32, as in free fall; and when elements are
//! strained against their own force, on the whole, because others overrule them. In a body that
//! swings or is hit it holds for the forces of that one substep, which may be far from those of
//! its rest: what is stiff against waves may be soft against weight. Read it when the body is
//! calm, or add up [`Work`] over many ticks.

use crate::{Damping, Particles, Settings, Topology, elastic::Elastic};

/// A body is as stiff as asked, for users, up to this factor.
pub const CLOSE: f64 = 1.1;

/// More substeps a tick than these are not advised.
pub const MAX_SUBSTEPS: u32 = 1000;

/// Strains below this many roundings of their positions are taken for noise.
const ROUNDINGS: f64 = 4.0;

/// Half of the last digit of an f32, relative to it.
const HALF_ULP: f64 = 0.5 * f32::EPSILON as f64;

/// Sums over the elements of an effect. Those of several ticks or of several bodies may be added
/// up: the result is their mean, weighted by load.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Work {
    /// ΣF² [N², or Pa²].
    pub force_squared: f64,
    /// ΣαF², twice the energy that the material would store [J].
    pub asked: f64,
    /// ΣeF, twice the energy that was given to it [J].
    pub got: f64,
    /// Σe²/α, twice the energy that the material would have stored in these strains [J]; ∞ with
    /// rigid elements.
    pub strained: f64,
    /// What rounding of positions may make of `got` [J].
    pub rounding: f64,
}

/// The compliance of an effect as it was asked for and as the solver delivers it, both weighted
/// by the load on each element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Delivered {
    /// Asked for, in the [unit](crate::ElasticKind::unit) of the effect; 0 is rigid.
    pub asked: f64,
    /// Got, in the same unit.
    pub got: f64,
}

impl Work {
    /// Of an effect after a substep of `h` seconds that left these multipliers; nothing if nobody
    /// kept them.
    #[must_use]
    pub fn of<const N: usize, const M: usize>(
        effect: &impl Elastic<N, M>,
        topology: &Topology,
        particles: &Particles,
        multipliers: &[f32],
        h: f64,
    ) -> Self {
        let mut all = Self::default();
        let tau = f64::from(effect.damping().get());
        let rows = effect.rows_of(topology, particles);
        let rows = rows.flat_map(|(corners, rows)| rows.map(|row| (corners, row)));
        for ((corners, row), &lambda) in rows.zip(multipliers) {
            let force = -f64::from(lambda) / (h * h);
            let rounding = HALF_ULP * row.scale.abs();
            let mut speed = 0.0;
            for (gradient, i) in row.gradients.iter().zip(corners) {
                speed += gradient.dot(particles.velocity_f64(i as usize));
            }
            let strain = row.error + tau * speed;
            all.force_squared += force * force;
            all.asked += row.compliance * force * force;
            all.got += strain * force;
            all.strained += strain * strain / row.compliance;
            all.rounding += rounding * force.abs();
        }
        all
    }

    /// Leaves this share of it, from 0 to 1: what is older shall count for less.
    pub fn fade(&mut self, kept: f64) {
        self.force_squared *= kept;
        self.asked *= kept;
        self.got *= kept;
        self.strained *= kept;
        self.rounding *= kept;
    }

    /// Adds another. Of two effects the units of `force_squared` differ; factors of their sum are
    /// sound, its compliances are not.
    pub fn add(&mut self, other: Self) {
        self.force_squared += other.force_squared;
        self.asked += other.asked;
        self.got += other.got;
        self.strained += other.strained;
        self.rounding += other.rounding;
    }

    /// How many times softer than asked all of it behaves, at least and at most; `None` when the
    /// sums say nothing, or with rigid elements. Of all effects of a body together, these are
    /// bounds of how much further than it should its load has come down, as long as strains are
    /// small: the forces are in balance with the load, but not the least; the strains fit
    /// together, but are not those of the least energy.
    #[must_use]
    pub fn factors(&self) -> Option<(f64, f64)> {
        let least = self.delivered()?.factor()?;
        let most = self.strained / self.got;
        most.is_finite().then_some((least, most))
    }

    /// The compliances; `None` when the sums say nothing, see the [module](self).
    #[must_use]
    pub fn delivered(&self) -> Option<Delivered> {
        let told = self.got > ROUNDINGS * self.rounding && self.force_squared > 0.0;
        let delivered = Delivered {
            asked: self.asked / self.force_squared,
            got: self.got / self.force_squared,
        };
        (told && delivered.asked.is_finite() && delivered.got.is_finite()).then_some(delivered)
    }
}

impl Delivered {
    /// How many times softer than asked the effect behaves; below 1 it is stiffer. `None` when
    /// rigid was asked for: any compliance is infinitely more than that.
    #[must_use]
    pub fn factor(&self) -> Option<f64> {
        (self.asked > 0.0).then(|| self.got / self.asked)
    }

    /// Whether the solver and not the material limits the stiffness.
    #[must_use]
    pub fn is_limited(&self) -> bool {
        self.factor().is_none_or(|factor| factor > CLOSE)
    }

    /// Substeps a tick, from those that it has, with which it would be at most [`CLOSE`] times as
    /// soft as asked; `None` if [`MAX_SUBSTEPS`] would not do. Then more iterations may help, or
    /// a softer material has to be accepted.
    ///
    /// What is softer than asked is (1 + γ)δ, and δ is made of ∇C w ∇C λ = h² ∇C w ∇C F with
    /// forces F that the load determines. With one sweep a substep it so falls like
    /// h²(1 + τ/h) = h² + τh, `damping` being the τ of the effect: with damping, twice the
    /// substeps only halve it. With more sweeps a substep δ is what the last of them did, and
    /// falls at least as fast, so that fewer substeps may do. In a body whose forces are not given
    /// by statics alone they too change with the substeps, and it is a first guess, up to a third
    /// too few: ask again when it runs with them.
    #[must_use]
    pub fn substeps(&self, settings: &Settings, damping: Damping) -> Option<u32> {
        let excess = self.factor()? - 1.0;
        let tau = f64::from(damping.get());
        let own = |substeps: u32| {
            let h = settings.tick_seconds() / f64::from(substeps);
            h * (h + tau)
        };
        let now = settings.substeps.get();
        let enough = |&n: &u32| excess * own(n) <= (CLOSE - 1.0) * own(now);
        (now..=MAX_SUBSTEPS).find(enough)
    }
}
