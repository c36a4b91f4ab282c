//! Common interface of elastic effects: constraints between two to four particles each, with one or
//! several equations and a compliance.
//!
//! An effect implements its equations twice: as [rows](Elastic::rows) in `f64`, for the reference
//! and for diagnostics, and as a [kernel](Elastic::kernel) for several elements at once. Tests
//! compare the two.
//!
//! # Adding one
//! A file in [`effects`](crate::effects) with its parameters and an implementation of
//! [`Elastic`], and a line in the table of [`effects!`](crate::effects).

use crate::{
    Damping, ElasticKind, Particles, Topology,
    kernel::{
        block::{Blocks, solve_all},
        multipliers::Multipliers,
    },
    order::Elements,
    particles::Part,
};
use glam::DVec3;

/// A particle in the `f64` form of a constraint.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Point {
    /// Its position [m].
    pub x: DVec3,
    /// Its inverse mass [1/kg].
    pub w: f64,
    /// Its rest position [m].
    pub rest: DVec3,
}

/// One equation C + α̃λ + γ∇C·(x − p) = 0 of an element. A row of zeros, apart from its scale, is
/// an inactive inequality: it moves no particle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row<const N: usize> {
    /// C.
    pub error: f64,
    /// ∇C for each particle.
    pub gradients: [DVec3; N],
    /// α; 0 is rigid.
    pub compliance: f64,
    /// Unit of relative errors of C: a rest length or a rest volume; never 0 for a valid element.
    pub scale: f64,
    /// Lower bound of Σ w‖∇C‖² in denominators, also after elimination of the equations before it.
    pub least: f64,
}

/// An effect of constraints on `N` particles each, of `M` equations each.
pub trait Elastic<const N: usize, const M: usize>: Copy {
    /// Kind of the effect.
    const KIND: ElasticKind;
    /// The unit of its compliance.
    const UNIT: &'static str;

    /// SIMD form of its constraints.
    type Kernel<'a>: Blocks<N, M>;

    /// Particles of the constraints, and their order.
    fn elements(topology: &Topology) -> &Elements<N>;

    /// The constraints with coefficients for substeps of `h` seconds.
    fn kernel<'a>(&self, topology: &'a Topology, h: f32) -> Self::Kernel<'a>;

    /// Equations of element number `index` with the particles `points`.
    fn rows(&self, topology: &Topology, index: usize, points: [Point; N]) -> [Row<N>; M];

    /// Equations of an element at rest, whose squares over α give the energy of small strains:
    /// [`rows`](Self::rows), unless an equation has no gradient there.
    fn linear_rows(&self, topology: &Topology, index: usize, points: [Point; N]) -> Vec<Row<N>> {
        self.rows(topology, index, points).into()
    }

    /// Second derivatives of the energy of an element, where ∇C ∇Cᵀ/α of its equations is no
    /// approximation to them.
    fn curvature(&self, _: &Topology, _: usize, _: [Point; N]) -> Option<Curvature<N, M>> {
        None
    }

    /// C of its equations after displacements of its particles [m], to second order; only with a
    /// [`curvature`](Self::curvature).
    fn foresee(&self, _: &Topology, _: usize, _: [Point; N], _: [DVec3; N]) -> Option<[f64; M]> {
        None
    }

    /// τ [s].
    fn damping(&self) -> Damping;

    /// Whether all its constraints are rigid.
    fn is_rigid(&self) -> bool;

    /// All its equations with the indices of their elements.
    fn all_rows(
        &self,
        topology: &Topology,
        at: impl Fn(u32) -> (DVec3, f64),
    ) -> impl Iterator<Item = ([u32; N], [Row<N>; M])> {
        let elements = Self::elements(topology).corners().enumerate();
        elements.map(move |(index, corners)| {
            let points = corners.map(|i| {
                let (x, w) = at(i);
                let rest = topology.rest[i as usize].as_dvec3();
                Point { x, w, rest }
            });
            (corners, self.rows(topology, index, points))
        })
    }

    /// The same for particles of the fast solver between substeps.
    fn rows_of(
        &self,
        topology: &Topology,
        particles: &Particles,
    ) -> impl Iterator<Item = ([u32; N], [Row<N>; M])> {
        self.all_rows(topology, |i| {
            let i = i as usize;
            (particles.position(i), f64::from(particles.positions[i].w))
        })
    }
}

/// Second derivatives of the energy of an element.
#[derive(Debug, Clone, Copy)]
pub struct Curvature<const N: usize, const M: usize> {
    /// Factors of ∇C ∇Cᵀ of each equation, in the unit of 1/α.
    pub along: [f64; M],
    /// Multiples of the identity for each pair of corners [N/m].
    pub even: [[f64; N]; N],
    /// w for each pair of corners, whose block has −w× in addition [N/m]. Without it the
    /// derivatives are positive definite, but too stiff against rotation.
    pub odd: [[DVec3; N]; N],
    /// Whether the element is too far from its rest shape for a linear system.
    pub is_far: bool,
}

/// A visitor of the elastic effects of a body, generic over their types.
pub trait Visit {
    /// Visits one effect.
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E);
}

/// One iteration over all constraints of an effect of a body, on one thread, with substeps of `h`
/// seconds.
pub fn iterate<const N: usize, const M: usize>(
    effect: &impl Elastic<N, M>,
    topology: &Topology,
    h: f32,
    part: Part,
    multipliers: Multipliers,
) {
    solve_all(&effect.kernel(topology, h), part, multipliers);
}
