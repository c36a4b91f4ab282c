//! Choice between the direct solver and Gauss–Seidel: by the time that each takes for an error.
//!
//! **Error.** One Gauss–Seidel iteration leaves of the displacement by a force F, which is αF where it
//! is converged, an excess of about h² Σ w‖∇C‖² F
//! ([`effective`](crate::effective)), and with damping τ of (h² + τh) Σ w‖∇C‖² F. Forces are not known
//! before a body is loaded; assuming the same energy in each compliant equation, the excess is
//!
//! error(h) = ½ (h² + τh) · mean over equations of (Σ w‖∇C‖² / α),
//!
//! at rest. ½ is measured: it makes the error 0.8 to 1.6 times that of nine problems of `pliant study`
//! (cantilevers, a twisted bar, a hanging bar, rubber, a beam of finite elements, and strips with
//! damping), where that is 0.5 to 60 %. Where forces are distributed otherwise, it is too high: by 200
//! times in a strip that bends, and in a rope with a heavy weight at its end. Rigid equations do
//! not count beside compliant ones; a body with rigid ones alone is never converged.
//!
//! **Time.** Nanoseconds per substep, measured with the same problems on one thread of a cloud AMD EPYC:
//! by Gauss–Seidel 1000 for a body, 4.5 for an edge or a volume, and 14 for each equation of an element
//! that has several; for their parts of a linear system 200 and 400, and 0.26 for each multiplication of
//! its factorization. The ratio of both times is within a factor of 2 of the measured one. Only the ratio
//! matters, and the figures are the same everywhere, so that every computer chooses the same.

use super::{DirectWorkspace, work};
use crate::{
    Effects, Settings, Topology, TopologyId,
    elastic::{Elastic, Point, Visit},
    particles::Particles,
};

/// Measured solver error over the mean of the module.
const MEASURED: f64 = 0.5;
/// Nanoseconds of a body per substep by Gauss–Seidel.
const BODY: f64 = 1000.0;
/// Nanoseconds per equation and substep, of elements with one equation and with several.
const GAUSS_SEIDEL: [f64; 2] = [4.5, 14.0];
const ASSEMBLY: [f64; 2] = [200.0, 400.0];
/// Nanoseconds per multiplication of a factorization.
const FACTORIZATION: f64 = 0.26;
/// Most substeps with which Gauss–Seidel is compared.
const MAX_SUBSTEPS: u32 = 1000;

/// What each solver takes for a body, and which of them is used.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Choice {
    /// Whether the body is solved directly.
    pub is_direct: bool,
    /// Relative error of its stiffness that is expected of Gauss–Seidel with the substeps of the world;
    /// ∞ for a rigid body.
    pub error: f64,
    /// Substeps per tick at which that error would be within the tolerance; `None` above 1000.
    pub substeps: Option<u32>,
    /// Time for that error in a tick over the time of the direct solver with one substep, on one thread;
    /// ∞ where Gauss–Seidel does not reach it, 0 where the body is too large to be solved directly.
    pub ratio: f64,
}

impl Choice {
    /// Chooses for a body with a tolerance.
    pub(super) fn of(given: &Given, tolerance: f64) -> Self {
        let Given {
            topology,
            effects,
            particles,
            settings,
        } = *given;
        let mut sums = Sums::of(topology, particles);
        effects.visit(&mut sums);
        let iterations = f64::from(settings.iterations.get());
        let error = |substeps: u32| {
            let h = settings.tick_seconds() / f64::from(substeps);
            sums.error(h) / iterations
        };
        let now = settings.substeps.get();
        let substeps = enough(|substeps| error(substeps) <= tolerance);
        let direct = work(topology, effects)
            .filter(|_| super::unfit_effects(effects, settings.method).is_none())
            .map(|work| iterations * (sums.assembly + FACTORIZATION * work as f64));
        let by_iterations = |substeps: u32| iterations * f64::from(substeps) * sums.gauss_seidel;
        let ratio = match (substeps.map(by_iterations), direct) {
            (_, None) => 0.0,
            (None, Some(_)) => f64::INFINITY,
            (Some(iterated), Some(direct)) => iterated / direct,
        };
        Self {
            is_direct: error(now) > tolerance && ratio > 1.0,
            error: error(now),
            substeps,
            ratio,
        }
    }
}

/// The fewest substeps that are enough, if at most [`MAX_SUBSTEPS`] are; more are never worse.
fn enough(is_enough: impl Fn(u32) -> bool) -> Option<u32> {
    let (mut low, mut high) = (0, MAX_SUBSTEPS);
    if !is_enough(high) {
        return None;
    }
    while high - low > 1 {
        let middle = low.midpoint(high);
        match is_enough(middle) {
            true => high = middle,
            false => low = middle,
        }
    }
    Some(high)
}

/// What the choice depends on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Given<'a> {
    pub topology: &'a Topology,
    pub effects: &'a Effects,
    pub particles: &'a Particles,
    pub settings: &'a Settings,
}

/// Sums over the equations of a body.
struct Sums<'a> {
    topology: &'a Topology,
    particles: &'a Particles,
    /// Σ (Σ w‖∇C‖² / α) of compliant equations, and with a factor τ [1/s², 1/s].
    excess: [f64; 2],
    compliant: usize,
    rigid: usize,
    /// Time of a Gauss–Seidel iteration, and of the assembly of a linear system [ns].
    gauss_seidel: f64,
    assembly: f64,
}

impl<'a> Sums<'a> {
    fn of(topology: &'a Topology, particles: &'a Particles) -> Self {
        Self {
            topology,
            particles,
            excess: [0.0; 2],
            compliant: 0,
            rigid: 0,
            gauss_seidel: BODY,
            assembly: 0.0,
        }
    }

    /// Expected error with one iteration per substep of `h` seconds.
    fn error(&self, h: f64) -> f64 {
        match (self.compliant, self.rigid) {
            (0, 0) => 0.0,
            (0, _) => f64::INFINITY,
            (count, _) => MEASURED * (h * h * self.excess[0] + h * self.excess[1]) / count as f64,
        }
    }
}

impl Visit for Sums<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        if !E::KIND.is_solved_directly() {
            return;
        }
        let tau = f64::from(effect.damping().get());
        let elements = E::elements(self.topology).corners();
        let kind = usize::from(M > 1);
        let equations = (M * elements.len()) as f64;
        self.gauss_seidel += GAUSS_SEIDEL[kind] * equations;
        self.assembly += ASSEMBLY[kind] * equations;
        for (index, corners) in elements.enumerate() {
            let points = corners.map(|i| {
                let x = self.topology.rest[i as usize].as_dvec3();
                let w = f64::from(self.particles.positions[i as usize].w);
                Point { x, w, rest: x }
            });
            for row in effect.linear_rows(self.topology, index, points) {
                let gradients = row.gradients.iter().zip(points);
                let mobility: f64 = gradients.map(|(g, p)| p.w * g.length_squared()).sum();
                if row.compliance > 0.0 {
                    let excess = mobility / row.compliance;
                    self.excess[0] += excess;
                    self.excess[1] += tau * excess;
                    self.compliant += 1;
                } else if mobility > 0.0 {
                    self.rigid += 1;
                }
            }
        }
    }
}

/// The last choice, and what it was made for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chosen {
    effects: Effects,
    topology: TopologyId,
    /// Σ w, for a change of pins or densities [1/kg].
    mobility: f64,
    settings: Settings,
    pub choice: Choice,
}

impl DirectWorkspace {
    /// Chooses the solver for the next tick of a body that carries [`Direct`](super::Direct) with a
    /// tolerance. Must be called before its stages; [`World`](crate::World) does so. A function of
    /// masses, rest shape, effects and settings alone.
    pub fn choose(
        &mut self,
        effects: &mut Effects,
        topology: &Topology,
        particles: &Particles,
        settings: &Settings,
    ) {
        let Some(direct) = effects.direct else {
            return;
        };
        let tolerance = f64::from(direct.tolerance.get());
        if tolerance == 0.0 {
            effects.direct = Some(super::Direct {
                yields: false,
                ..direct
            });
            return;
        }
        // A grab moves in every tick, and is no elastic effect.
        let key = Effects {
            grab: None,
            direct: Some(direct),
            ..*effects
        };
        let mobility = particles.positions.iter().map(|x| f64::from(x.w)).sum();
        let workspace = self.0.get_or_insert_default();
        let choice = match &workspace.chosen {
            Some(known)
                if known.effects == key
                    && known.topology == topology.id()
                    && known.mobility == mobility
                    && known.settings == *settings =>
            {
                known.choice
            }
            _ => {
                let given = Given {
                    topology,
                    effects,
                    particles,
                    settings,
                };
                let choice = Choice::of(&given, tolerance);
                workspace.chosen = Some(Chosen {
                    effects: key,
                    topology: topology.id(),
                    mobility,
                    settings: *settings,
                    choice,
                });
                choice
            }
        };
        effects.direct = Some(super::Direct {
            yields: !choice.is_direct,
            ..direct
        });
    }

    /// The last choice of a solver; `None` without a tolerance.
    #[must_use]
    pub fn choice(&self) -> Option<Choice> {
        Some(self.0.as_ref()?.chosen?.choice)
    }
}
