//! Choice between the direct solver and Gauss–Seidel: by the time that each takes for an error.
//!
//! **Error.** One Gauss–Seidel iteration leaves of the displacement by a force F, which is αF where it
//! is converged, an excess of about h² Σ w‖∇C‖² F
//! ([`effective`](crate::effective)), and with damping τ of (h² + τh) Σ w‖∇C‖² F. Forces are not known
//! before a body is loaded; assuming the same energy in each compliant equation, the relative excess is
//!
//! error(h) = ½ (h² + τh) · mean over equations of (Σ w‖∇C‖² / α),
//!
//! at rest, before any plastic flow. ½ is measured: it makes the error 0.8 to 1.6 times that of nine
//! problems of `pliant study` (cantilevers, a twisted bar, a hanging bar, rubber, a beam of finite
//! elements, and strips with damping), where that is 0.5 to 60 %. Where forces are distributed otherwise,
//! it is too high: by 200 times in a strip that bends, and in a rope with a heavy weight at its end. With
//! k iterations it is at most a k-th, and each of them multiplies it by error/(1 + error) at most: a
//! fit to the same problems, but rubber and the finite elements, within a factor of 4 for 2 iterations,
//! and too high for more. A body with a rigid effect is never converged, unless that is `volume` beside compliant
//! ones.
//!
//! **Time.** Nanoseconds per substep, measured with the same problems on one thread of a cloud AMD EPYC:
//! by Gauss–Seidel 1000 for a body, 4.5 for an edge or a volume, and 14 for each equation of an element
//! that has several; for their parts of a linear system 90 and 185, and 0.12 for each multiplication of
//! its factorization, or 0.07 of a large one, which in a solid takes a quarter of that after the first in a tick
//! ([`reuse`](super::reuse): 0.18 to 0.46 on cubes of 20³ to 11³ cells; a cloth changes too much). Only the ratio matters, and the figures are the same everywhere, so that every
//! computer chooses the same. The direct solver is compared at the substeps of the world, Gauss–Seidel
//! at those that it needs, at most 1000.

use super::{DirectWorkspace, Status, Workspace, elimination, plan::LARGE, unfit_effects, work_in};
use crate::{
    Effects, ElasticKind, Settings, Topology, TopologyId,
    elastic::{Elastic, Point, Row, Visit},
    history::STEP_FRACTION,
    measure::{FNV_START, fnv1a_on},
    particles::Particles,
};
use glam::DVec3;

/// Substeps per tick beyond which no error is extrapolated.
const MAX_SUBSTEPS: u32 = 1000;
/// Measured solver error over the mean of the module.
const MEASURED: f64 = 0.5;
/// Nanoseconds of a body per substep by Gauss–Seidel.
const BODY: f64 = 1000.0;
/// Nanoseconds per equation and substep, of elements with one equation and with several.
const GAUSS_SEIDEL: [f64; 2] = [4.5, 14.0];
const ASSEMBLY: [f64; 2] = [90.0, 185.0];
/// Nanoseconds per multiplication of a factorization by blocks, and of a large one in fronts.
const FACTORIZATION: [f64; 2] = [0.12, 0.07];
/// Time of a solution with the factor of an earlier system of the tick, over that of a large factorization of a solid.
const REUSE: f64 = 0.25;
/// Displacement that gives an equation a gradient which has none at rest, as a fraction of the body.
const NUDGE: f64 = 1e-3;

/// What the solvers take for a body, and which of them is used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Choice {
    /// Whether the body is solved directly.
    pub is_direct: bool,
    /// The tolerance for which it was made.
    pub tolerance: f64,
    /// The substeps per tick of the world for which it was made.
    pub substeps: u32,
    /// Expected excess of the displacement under a load by Gauss–Seidel with these substeps, relative to
    /// the converged one; ∞ for a rigid body.
    pub error: f64,
    /// Substeps per tick at which that would be within the tolerance; `None` above 1000.
    pub needed: Option<u32>,
    /// Time of a tick by Gauss–Seidel with the needed substeps, or with 1000, over that of the direct
    /// solver with those of the world, on one thread; `None` where it was not compared, because the
    /// error is within the tolerance, or because the body cannot be solved directly.
    pub ratio: Option<f64>,
}

impl Choice {
    /// Chooses for a body with a tolerance; `work` are the multiplications of a factorization, if it can
    /// be solved directly.
    fn of(sums: &Sums, (tolerance, settings): (f64, &Settings), work: Option<u64>) -> Self {
        let iterations = f64::from(settings.iterations.get());
        let step = match settings.order.get() {
            1 => settings.tick_seconds(),
            _ => settings.tick_seconds() * STEP_FRACTION,
        };
        let error = |substeps: u32| {
            let error = sums.error(step / f64::from(substeps));
            iterated_error(error, settings.iterations.get())
        };
        let substeps = settings.substeps.get();
        let needed = enough(|substeps| error(substeps) <= tolerance);
        let passes = iterations + f64::from(settings.smoothing_iterations.get());
        let iterated = passes * f64::from(needed.unwrap_or(MAX_SUBSTEPS)) * sums.gauss_seidel;
        let direct = |work: u64| {
            let count = iterations * f64::from(substeps);
            let (each, factorizations) = match work >= LARGE {
                true if sums.topology.tetrahedra.corners().len() > 0 => {
                    (FACTORIZATION[1], 1.0 + (count - 1.0) * REUSE)
                }
                true => (FACTORIZATION[1], count),
                false => (FACTORIZATION[0], count),
            };
            count * sums.assembly + factorizations * each * work as f64
        };
        let ratio = work.map(|work| iterated / direct(work));
        let error = error(substeps);
        Self {
            is_direct: error > tolerance && ratio.is_some_and(|ratio| ratio > 1.0),
            tolerance,
            substeps,
            error,
            needed,
            ratio,
        }
    }
}

/// The error of several iterations, given that of one.
fn iterated_error(error: f64, iterations: u32) -> f64 {
    if !error.is_finite() {
        return error;
    }
    // Beyond 64 it is that of rounding, or proportional.
    let each = error / (1.0 + error);
    let reduced = (1..iterations.min(64)).fold(error, |error, _| error * each);
    reduced.min(error / f64::from(iterations))
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

/// Sums over the equations of a body.
struct Sums<'a> {
    topology: &'a Topology,
    particles: &'a Particles,
    /// Σ (Σ w‖∇C‖² / α) of compliant equations, and with a factor τ [1/s², 1/s].
    excess: [f64; 2],
    compliant: usize,
    is_rigid: bool,
    has_rigid_volume: bool,
    /// Time of a Gauss–Seidel iteration, and of the assembly of a linear system [ns].
    gauss_seidel: f64,
    assembly: f64,
}

impl<'a> Sums<'a> {
    fn of(topology: &'a Topology, effects: &Effects, particles: &'a Particles) -> Self {
        let mut sums = Self {
            topology,
            particles,
            excess: [0.0; 2],
            compliant: 0,
            is_rigid: false,
            has_rigid_volume: false,
            gauss_seidel: BODY,
            assembly: 0.0,
        };
        effects.visit(&mut sums);
        sums
    }

    /// Expected error with one iteration per substep of `h` seconds.
    fn error(&self, h: f64) -> f64 {
        let is_rigid = self.is_rigid || self.has_rigid_volume && self.compliant == 0;
        match self.compliant {
            _ if is_rigid => f64::INFINITY,
            0 => 0.0,
            count => MEASURED * (h * h * self.excess[0] + h * self.excess[1]) / count as f64,
        }
    }

    /// Σ w‖∇C‖² of an equation.
    fn mobility<const N: usize>(row: &Row<N>, points: &[Point; N]) -> f64 {
        let gradients = row.gradients.iter().zip(points);
        gradients.map(|(g, p)| p.w * g.length_squared()).sum()
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
            let mut points = corners.map(|i| {
                let x = self.topology.rest[i as usize].as_dvec3();
                let w = f64::from(self.particles.positions[i as usize].w);
                Point { x, w, rest: x }
            });
            let mut rows = effect.linear_rows(self.topology, index, points);
            if rows.iter().all(|row| Self::mobility(row, &points) == 0.0) {
                // A flat hinge has no direction at rest. The weight of its last corner is never zero.
                points[N - 1].x += DVec3::splat(NUDGE * f64::from(self.topology.size));
                rows = effect.linear_rows(self.topology, index, points);
            }
            for row in rows {
                let mobility = Self::mobility(&row, &points);
                if mobility == 0.0 {
                    continue;
                }
                if row.compliance > 0.0 {
                    let excess = mobility / row.compliance;
                    self.excess[0] += excess;
                    self.excess[1] += tau * excess;
                    self.compliant += 1;
                } else if E::KIND == ElasticKind::Volume {
                    self.has_rigid_volume = true;
                } else {
                    self.is_rigid = true;
                }
            }
        }
    }
}

/// The last choice, and what it was made for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chosen {
    given: Given,
    choice: Choice,
}

/// What a choice depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Given {
    /// The elastic effects.
    effects: Effects,
    tolerance: f64,
    topology: TopologyId,
    /// Of the inverse masses.
    masses: u64,
    settings: Settings,
}

/// The order of elimination without pins, and for which kinds of elements on which topology; `None` if a
/// factorization would exceed the limit.
#[derive(Debug, Clone)]
pub(super) struct Known {
    kinds: u32,
    topology: TopologyId,
    ordered: Option<Ordered>,
}

#[derive(Debug, Clone)]
pub(super) struct Ordered {
    /// Multiplications of a factorization.
    pub work: u64,
    /// All particles.
    pub order: Vec<u32>,
}

impl Known {
    fn of(topology: &Topology, effects: &Effects) -> Self {
        let ordered = elimination(topology, effects).ok().map(|found| Ordered {
            work: work_in(&found),
            order: found.iter().map(|(particle, _)| *particle).collect(),
        });
        Self {
            kinds: super::kinds_of(effects),
            topology: topology.id(),
            ordered,
        }
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        self.ordered
            .as_ref()
            .map_or(0, |it| size_of_val(&it.order[..]))
    }
}

impl DirectWorkspace {
    /// Chooses the solver for the next tick of a body that carries [`Direct`](crate::Direct) with a
    /// tolerance. Must be called before its stages; [`World`](crate::World) does so. A function of
    /// masses, rest shape, effects and settings alone; plastic flow does not change it. Nothing is
    /// chosen for particles that do not belong to the topology.
    pub fn choose(
        &mut self,
        effects: &mut Effects,
        topology: &Topology,
        particles: &Particles,
        settings: &Settings,
    ) {
        let Some(direct) = &mut effects.direct else {
            if let Some(workspace) = &mut self.0 {
                (workspace.chosen, workspace.status) = (None, Status::Nothing);
            }
            return;
        };
        let tolerance = f64::from(direct.tolerance.get());
        direct.yields = false;
        if tolerance == 0.0 {
            if let Some(workspace) = &mut self.0 {
                workspace.chosen = None;
            }
            return;
        }
        if particles.positions.len() != topology.particles() {
            return;
        }
        let workspace = self.0.get_or_insert_default();
        let choice = workspace.choose(effects, topology, particles, (tolerance, settings));
        if !choice.is_direct {
            workspace.status = Status::Nothing;
        }
        if let Some(direct) = &mut effects.direct {
            direct.yields = !choice.is_direct;
        }
    }

    /// The last choice of a solver; `None` without a tolerance.
    #[must_use]
    pub fn choice(&self) -> Option<Choice> {
        Some(self.0.as_ref()?.chosen?.choice)
    }
}

impl Workspace {
    fn choose(
        &mut self,
        effects: &Effects,
        topology: &Topology,
        particles: &Particles,
        (tolerance, settings): (f64, &Settings),
    ) -> Choice {
        let topology = topology.original().map_or(topology, |original| original);
        // What the error does not depend on must not be planned anew, for example while gravity changes.
        let given = Given {
            effects: effects.elastic(),
            tolerance,
            topology: topology.id(),
            masses: hash_of(particles.positions.iter().map(|x| x.w)),
            settings: Settings {
                rate: settings.rate,
                substeps: settings.substeps,
                iterations: settings.iterations,
                smoothing_iterations: settings.smoothing_iterations,
                order: settings.order,
                method: settings.method,
                ..Settings::default()
            },
        };
        if let Some(Chosen { choice, .. }) = self.chosen.filter(|known| known.given == given) {
            return choice;
        }
        let sums = Sums::of(topology, effects, particles);
        let mut choice = Choice::of(&sums, (tolerance, settings), None);
        if choice.error > tolerance && unfit_effects(effects, settings.method).is_none() {
            let work = self.ordered(topology, effects).map(|it| it.work);
            choice = Choice::of(&sums, (tolerance, settings), work);
        }
        self.chosen = Some(Chosen { given, choice });
        choice
    }

    /// The order of elimination without pins; `None` if a factorization would exceed the limit. It is kept.
    pub(super) fn ordered(&mut self, topology: &Topology, effects: &Effects) -> Option<&Ordered> {
        let wanted = (super::kinds_of(effects), topology.id());
        let known = self.known.take();
        let known = known.filter(|known| (known.kinds, known.topology) == wanted);
        let known = known.unwrap_or_else(|| Known::of(topology, effects));
        self.known.insert(known).ordered.as_ref()
    }
}

/// A hash of numbers in their order.
fn hash_of(numbers: impl Iterator<Item = f32>) -> u64 {
    numbers.fold(FNV_START, |hash, number| {
        fnv1a_on(hash, &number.to_bits().to_le_bytes())
    })
}
