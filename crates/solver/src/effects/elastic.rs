//! What all elastic effects have in common: constraints between two to four particles each, of one
//! or several equations, with a compliance.
//!
//! An effect has its equations twice: as [rows](Elastic::rows) in `f64`, for the reference and for diagnostics, and as
//! a [kernel](Elastic::kernel) for eight elements at once. Tests compare the two.
//!
//! # Adding one
//! A file in [`effects`](crate::effects) with its parameters and an implementation of
//! [`Elastic`], and a line in the table of [`effects!`](crate::effects).

use super::multipliers::Multipliers;
use crate::{
    Damping, Particles, Topology,
    kernel::block::{Blocks, solve_all},
    order::Elements,
    particles::Part,
};
use glam::DVec3;

/// A particle as a constraint in `f64` sees it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Point {
    /// Its position [m].
    pub x: DVec3,
    /// Its inverse mass [1/kg].
    pub w: f64,
    /// Its place in the rest shape [m].
    pub rest: DVec3,
}

/// One equation C + α̃λ + γ∇C·(x − p) = 0 of an element. All zeros but for its scale is an inequality
/// that holds: it moves nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row<const N: usize> {
    /// C.
    pub error: f64,
    /// ∇C for each particle.
    pub gradients: [DVec3; N],
    /// α; 0 is rigid.
    pub compliance: f64,
    /// What C is told in shares of: a rest length, a rest volume; never 0 for a sound element.
    pub scale: f64,
    /// The least Σ w‖∇C‖² that is divided by, also of what is left of it once the equations before
    /// hold.
    pub least: f64,
}

/// An effect of constraints on `N` particles each, of `M` equations each.
pub trait Elastic<const N: usize, const M: usize>: Copy {
    /// Which one it is.
    const KIND: ElasticKind;
    /// The unit of its compliance.
    const UNIT: &'static str;

    /// Its constraints as lanes solve them.
    type Kernel<'a>: Blocks<N, M>;

    /// Which particles they are on, and their order.
    fn elements(topology: &Topology) -> &Elements<N>;

    /// The constraints with coefficients for substeps of `h` seconds.
    fn kernel<'a>(&self, topology: &'a Topology, h: f32) -> Self::Kernel<'a>;

    /// The equations of element number `index`, whose particles are `points`.
    fn rows(&self, topology: &Topology, index: usize, points: [Point; N]) -> [Row<N>; M];

    /// The equations of an element at rest, whose squares over α say what a small strain of it
    /// stores: [`rows`](Self::rows), unless an equation has no gradient there.
    fn linear_rows(&self, topology: &Topology, index: usize, points: [Point; N]) -> Vec<Row<N>> {
        self.rows(topology, index, points).into()
    }

    /// τ [s].
    fn damping(&self) -> Damping;

    /// Whether all its constraints are rigid.
    fn is_rigid(&self) -> bool;

    /// All its equations with the places of their elements.
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

/// Something to be done with each elastic effect of a body, whatever its type.
pub trait Visit {
    /// Does it.
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E);
}

/// One sweep over all constraints of an effect of a body, on one thread, with substeps of `h` seconds.
pub fn sweep<const N: usize, const M: usize>(
    effect: &impl Elastic<N, M>,
    topology: &Topology,
    h: f32,
    part: Part,
    multipliers: Multipliers,
) {
    solve_all(&effect.kernel(topology, h), part, multipliers);
}

/// Makes the kinds of elastic effects.
macro_rules! kinds {
    (
        {
            forces { $($force:tt)* }
            solvers { $($solver:tt)* }
            elastic { $($effect:ident $field:ident ($corners:literal, $rows:literal) $does:literal;)* }
            $($others:tt)*
        }
        $($rest:tt)*
    ) => {
        /// The elastic effects, in the order in which they act within a sweep.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        pub enum ElasticKind {
            $(#[doc = concat!("[`", stringify!($effect), "`].")] $effect,)*
        }

        impl ElasticKind {
            /// All of them.
            pub const ALL: [Self; [$(Self::$effect),*].len()] = [$(Self::$effect),*];
            /// How many there are.
            pub const COUNT: usize = Self::ALL.len();

            /// Its name in files and commands.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$effect => stringify!($field),)*
                }
            }

            /// How many particles each of its elements has.
            #[must_use]
            pub const fn corners(self) -> usize {
                match self {
                    $(Self::$effect => $corners,)*
                }
            }
        }
    };
}

crate::effects!(kinds);
