//! What all elastic effects have in common: constraints between two to four particles each, of one
//! or several equations, with a compliance.
//!
//! An effect tells its equations twice: in `f64` as [rows](Elastic::rows), which the twin solves and
//! everything that measures goes by; and as a [kernel](Elastic::kernel) for eight elements at once.
//! Tests hold one against the other.
//!
//! # Adding one
//! A file in [`constraint`](super::constraint) with its parameters and an implementation of
//! [`Elastic`], and a line in the table of [`effects!`](crate::effects).

use super::{
    Damping, Effects, Particles, Topology,
    bands::Piece,
    constraint::{
        Multipliers,
        bend::Bend,
        block::{Blocks, Put, solve_all, solve_batch},
        isometric_bend::IsometricBend,
        membrane::Membrane,
        neo_hookean::NeoHookean,
        pressure::Walls,
        shape_matching::Matching,
        strain_limit::StrainLimit,
        stretch::Stretch,
        struts::Struts,
        volume::Volume,
        weave::Weave,
    },
    lanes::Instructions,
    order::Elements,
    particles::Part,
    phases::{Side, Task},
    share::Shared,
};
use glam::{DVec3, Vec4};

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
pub trait Elastic<const N: usize, const M: usize>: Copy + Into<Effects> {
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

/// Multipliers λ of the constraints of a body, a column for each effect that it carries: empty
/// where nobody keeps them. λ/h² is a force.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Lambdas {
    columns: [Vec<f32>; ElasticKind::COUNT],
    /// What pressure keeps.
    pub walls: Walls,
    /// The regions whose shapes are matched, with their multipliers; none before the first substep.
    pub matching: Option<Box<Matching>>,
    /// Room to add up the ways of averaged passes; zeros between them.
    sums: Vec<Vec4>,
}

impl Lambdas {
    /// Of one effect, element by element.
    #[must_use]
    pub fn of(&self, kind: ElasticKind) -> &[f32] {
        &self.columns[kind as usize]
    }

    /// Makes room for one effect, or takes it away where nobody will read it.
    pub fn make_room(&mut self, kind: ElasticKind, topology: &Topology, kept: bool) {
        let column = &mut self.columns[kind as usize];
        let count = if kept { kind.multipliers(topology) } else { 0 };
        if column.len() != count {
            *column = vec![0.0; count];
        }
    }

    /// All columns, in the order of [`ElasticKind::ALL`].
    pub(super) fn columns(&mut self) -> &mut [Vec<f32>; ElasticKind::COUNT] {
        &mut self.columns
    }

    /// Makes room to add up ways of so many particles.
    pub(super) fn make_sums(&mut self, count: usize) {
        if self.sums.len() != count {
            self.sums = vec![Vec4::ZERO; count];
        }
    }

    /// That room.
    pub(super) fn sums(&mut self) -> &mut [Vec4] {
        &mut self.sums
    }

    /// Bytes of memory.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.count() * size_of::<f32>()
            + size_of_val(&self.sums[..])
            + size_of_val(&self.walls.gradients[..])
            + self
                .matching
                .as_ref()
                .map_or(0, |it| size_of::<Matching>() + it.bytes())
    }

    /// How many multipliers there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.columns.iter().map(Vec::len).sum()
    }
}

/// Makes what elastic effects need one line each for.
macro_rules! elastic_effects {
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

            /// The unit of its compliance.
            #[must_use]
            pub const fn unit(self) -> &'static str {
                match self {
                    $(Self::$effect => <$effect as Elastic<$corners, $rows>>::UNIT,)*
                }
            }

            /// How many particles each of its elements has.
            #[must_use]
            pub const fn corners(self) -> usize {
                match self {
                    $(Self::$effect => $corners,)*
                }
            }

            /// How many elements it has on a body.
            #[must_use]
            pub fn elements(self, topology: &Topology) -> usize {
                match self {
                    $(Self::$effect => <$effect as Elastic<$corners, $rows>>::elements(topology).corners().len(),)*
                }
            }

            /// How many multipliers it has on a body.
            #[must_use]
            pub fn multipliers(self, topology: &Topology) -> usize {
                let rows = match self {
                    $(Self::$effect => $rows,)*
                };
                rows * self.elements(topology)
            }

            /// A sweep: the constraints of one side, those of the other, and the loose ones.
            pub(super) fn halves(self, topology: &Topology, task: Task) -> [Option<(Task, Side)>; 3] {
                match self {
                    $(Self::$effect => halves(<$effect as Elastic<$corners, $rows>>::elements(topology), task),)*
                }
            }
        }

        impl Effects {
            /// Whether the effect is carried.
            #[must_use]
            pub fn has(&self, kind: ElasticKind) -> bool {
                match kind {
                    $(ElasticKind::$effect => self.$field.is_some(),)*
                }
            }

            /// τ of an effect; `None` if it is not carried.
            #[must_use]
            pub fn damping(&self, kind: ElasticKind) -> Option<Damping> {
                match kind {
                    $(ElasticKind::$effect => self.$field.map(|effect| effect.damping()),)*
                }
            }

            /// Shows all elastic effects to a visitor, in their order.
            pub fn visit(&self, visitor: &mut impl Visit) {
                $(if let Some(effect) = &self.$field {
                    visitor.visit(effect);
                })*
            }
        }

        /// The kernels of the elastic effects that a body carries.
        #[derive(Default)]
        pub(super) struct Kernels<'a> {
            $($field: Option<<$effect as Elastic<$corners, $rows>>::Kernel<'a>>,)*
        }

        impl<'a> Kernels<'a> {
            /// For substeps of `h` seconds.
            pub fn new(effects: &Effects, topology: &'a Topology, h: f32) -> Self {
                Self {
                    $($field: effects.$field.map(|effect| effect.kernel(topology, h)),)*
                }
            }

            /// Does the constraints of an effect on one piece.
            ///
            /// # Safety
            /// Nobody else works on the piece, or on one that shares a particle with it.
            #[allow(unsafe_code, reason = "multipliers are handed out by hand")]
            pub unsafe fn solve(&self, kind: ElasticKind, work: Work) {
                match kind {
                    // SAFETY: the caller's promise.
                    $(ElasticKind::$effect => if let Some(kernel) = &self.$field {
                        unsafe { work.solve(kind, kernel) }
                    },)*
                }
            }
        }

        /// One sweep over all constraints of one elastic effect of a body, on one thread, with
        /// substeps of `h` seconds. Does nothing if it is not among the effects.
        pub fn sweep(
            (effects, kind): (&Effects, ElasticKind),
            topology: &Topology,
            h: f32,
            part: Part,
            multipliers: Multipliers,
        ) {
            let kernels = Kernels::new(effects, topology, h);
            match kind {
                $(ElasticKind::$effect => if let Some(kernel) = &kernels.$field {
                    solve_all(kernel, part, multipliers);
                },)*
            }
        }

        $(impl From<$effect> for Effects {
            fn from(effect: $effect) -> Self {
                Self {
                    $field: Some(effect),
                    ..Self::default()
                }
            }
        })*
    };
}

crate::effects!(elastic_effects);

/// A sweep: the constraints of one side, those of the other, and the loose ones.
fn halves<const N: usize>(elements: &Elements<N>, task: Task) -> [Option<(Task, Side)>; 3] {
    let odd = elements.odd_first();
    let half = |odd: bool| {
        let side = if odd { Side::Odd } else { Side::Even };
        (!elements.half(odd).is_empty()).then_some((task, side))
    };
    let loose = elements.loose().map(|_| (task, Side::Whole));
    [half(odd), half(!odd), loose]
}

/// A piece of a body on which constraints are to be solved.
pub(super) struct Work<'a> {
    /// The piece.
    pub piece: &'a Piece,
    /// Whether it is the whole body, and loose constraints are to be solved.
    pub whole: bool,
    /// Its particles.
    pub part: Part<'a>,
    /// The body.
    pub shared: &'a Shared<'a>,
    /// Which sweep of how many, and whether λ is to be kept.
    pub sweep: (u32, u32, bool),
    /// What becomes of where constraints would have particles.
    pub put: Put<'a>,
    /// Instructions to use.
    pub instructions: Instructions,
}

impl Work<'_> {
    /// # Safety
    /// As of [`Kernels::solve`].
    #[allow(unsafe_code, reason = "multipliers are handed out by hand")]
    unsafe fn solve<const N: usize, const M: usize>(
        self,
        kind: ElasticKind,
        kernel: &impl Blocks<N, M>,
    ) {
        let elements = kernel.elements();
        let batch = if self.whole {
            elements.loose()
        } else {
            self.piece.band.map(|band| elements.batch_of(band))
        };
        if let Some(index) = batch {
            let constraints = elements.batches()[index].constraints();
            let column = constraints.start * M..constraints.end * M;
            // SAFETY: a constraint is in one batch, a batch on one piece.
            let column = unsafe { self.shared.lambdas(kind, column) };
            let multipliers = Multipliers::of_sweep(column, self.sweep);
            let particles = (self.part, self.piece.particles.start);
            let means = (self.put, self.instructions);
            solve_batch(kernel, index, particles, multipliers, means);
        }
    }
}
