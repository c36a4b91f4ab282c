//! Requested compliance and effective compliance.
//!
//! **State after a substep.** Right after a constraint is projected, its own equation holds, with
//! the multiplier λ accumulated over the substep:
//!
//! C + α̃λ + γ ∇C·(x − p) = 0, α̃ = α/h², γ = τ/h.
//!
//! So λ and the value of C *at that moment* carry no information: they always match. Constraints
//! later in the iteration then change C by δ, which is not corrected before the substep ends. With
//! C and the velocity v = (x − p)/h at the end,
//!
//! C + τ ∇C·v = −α̃λ + (1 + γ) δ.
//!
//! **λ/h² is nevertheless the true force.** In a substep every movable particle obeys
//! (v − v₀)/(h w) = g/w + Σ ∇C λ/h², whether or not the iterations converged: λ starts at zero, and
//! the motion of the particle apart from gravity is the sum of w ∇C Δλ. In a body at rest these
//! forces balance the load; in a hanging chain they are the tensions. One iteration is sufficient
//! for that, because it compensates the whole displacement by gravity in a substep, h²g. (Each ∇C
//! is taken at its own projection, so the relative error of the balance at the end is the fraction
//! by which an element rotated or stretched within the substep.)
//!
//! **The measure** is the slope of strain over force, with F = −λ/h² [N, or Pa for a volume] and
//! e = C + τ ∇C·v:
//!
//! effective = Σ eF / ΣF², requested = ΣαF² / ΣF², both in m/N, or m⁵/N for a volume.
//!
//! effective/requested is the least-squares fit of e = factor · αF, weighted by 1/α. It is also a
//! ratio of works: at rest, ΣCF over all effects is the load times its actual displacement
//! (principle of virtual work), and ΣαF² is the value that the material would give for the same
//! forces. Where statics alone determines the forces, as in a chain, effective/requested is exactly
//! the excess compliance of the body under its load. Elsewhere the forces differ slightly from
//! those of the converged body, and over all effects together the ratio is at most that factor: of
//! all forces in balance with a load, the true ones minimize ΣαF².
//!
//! **When it is undefined.** It is `None` when no element carries a force; when the mean strain
//! under load is within the rounding of a rest length to f32, as in free fall; and when elements
//! are on the whole strained against their own force by other constraints. In a body that
//! oscillates or is hit it applies to the forces of that one substep, which may differ much from
//! those at rest: what is stiff against waves may be soft against weight. Read it when the body is
//! calm, or accumulate [`ConstraintWork`] over many ticks.

use crate::{Damping, Particles, Settings, Topology, elastic::Elastic};

/// Up to this factor, a body is reported to users as having the requested stiffness.
pub const CLOSE: f64 = 1.1;

/// Maximum number of substeps per tick that is recommended.
pub const MAX_SUBSTEPS: u32 = 1000;

/// Strains below this multiple of the rounding error of their positions count as noise.
const ROUNDINGS: f64 = 4.0;

/// Half an ulp of an f32, as a relative value.
const HALF_ULP: f64 = 0.5 * f32::EPSILON as f64;

/// Sums over the elements of an effect. Sums of several ticks or bodies may be added: the result is
/// their mean, weighted by load.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ConstraintWork {
    /// ΣF² [N², or Pa²].
    pub force_squared: f64,
    /// ΣαF², twice the energy that the material would store under these forces [J].
    pub requested: f64,
    /// ΣeF, twice the energy that was put into it [J].
    pub effective: f64,
    /// Σe²/α, twice the energy that the material would store at these strains [J]; ∞ with rigid
    /// elements.
    pub strained: f64,
    /// Contribution of position rounding to `effective` [J].
    pub rounding: f64,
}

/// Requested and effective compliance of an effect, both weighted by the load on each element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectiveCompliance {
    /// Requested compliance, in the [unit](crate::ElasticKind::unit) of the effect; 0 is rigid.
    pub requested: f64,
    /// Effective compliance, in the same unit.
    pub effective: f64,
}

impl ConstraintWork {
    /// Sums of an effect after a substep of `h` seconds with these multipliers; empty if they were
    /// not kept.
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
            all.requested += row.compliance * force * force;
            all.effective += strain * force;
            all.strained += strain * strain / row.compliance;
            all.rounding += rounding * force.abs();
        }
        all
    }

    /// Scales all sums by `kept`, from 0 to 1, to give older values less weight.
    pub fn fade(&mut self, kept: f64) {
        self.force_squared *= kept;
        self.requested *= kept;
        self.effective *= kept;
        self.strained *= kept;
        self.rounding *= kept;
    }

    /// Adds another. The units of `force_squared` differ between effects; for a sum of different
    /// effects the factors are valid, the compliances are not.
    pub fn add(&mut self, other: Self) {
        self.force_squared += other.force_squared;
        self.requested += other.requested;
        self.effective += other.effective;
        self.strained += other.strained;
        self.rounding += other.rounding;
    }

    /// Lower and upper bound of effective over requested compliance; `None` when the sums carry no
    /// information, or with rigid elements. Over all effects of a body together, these bound the
    /// factor of excess displacement of its load, as long as strains are small: the forces balance
    /// the load but are not the minimal ones; the strains are compatible but not those of minimal
    /// energy.
    #[must_use]
    pub fn factors(&self) -> Option<(f64, f64)> {
        let least = self.compliance()?.factor()?;
        let most = self.strained / self.effective;
        most.is_finite().then_some((least, most))
    }

    /// The compliances; `None` when the sums carry no information, see the [module](self).
    #[must_use]
    pub fn compliance(&self) -> Option<EffectiveCompliance> {
        let is_known = self.effective > ROUNDINGS * self.rounding && self.force_squared > 0.0;
        let compliance = EffectiveCompliance {
            requested: self.requested / self.force_squared,
            effective: self.effective / self.force_squared,
        };
        (is_known && compliance.requested.is_finite() && compliance.effective.is_finite())
            .then_some(compliance)
    }
}

impl EffectiveCompliance {
    /// Effective over requested compliance; below 1 the effect is stiffer than requested. `None`
    /// when the request is rigid: any compliance is infinitely more.
    #[must_use]
    pub fn factor(&self) -> Option<f64> {
        (self.requested > 0.0).then(|| self.effective / self.requested)
    }

    /// Whether the solver rather than the material limits the stiffness.
    #[must_use]
    pub fn is_limited(&self) -> bool {
        self.factor().is_none_or(|factor| factor > CLOSE)
    }

    /// Number of substeps per tick at which the effective compliance would be at most [`CLOSE`]
    /// times the requested one, extrapolated from the current settings; `None` if [`MAX_SUBSTEPS`]
    /// are not enough. In that case more iterations may help, or a softer material is required.
    ///
    /// The excess compliance is (1 + γ)δ, and δ consists of ∇C w ∇C λ = h² ∇C w ∇C F with forces F
    /// determined by the load. With one iteration per substep it therefore decreases like
    /// h²(1 + τ/h) = h² + τh, with `damping` the τ of the effect: with damping, doubling the
    /// substeps only halves it. With more iterations per substep, δ is the change by the last of
    /// them and decreases at least as fast, so that fewer substeps may be sufficient. In a body
    /// whose forces are not determined by statics alone, they also change with the substeps, and
    /// the result is a first estimate, up to a third too low: evaluate it again at the new setting.
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
