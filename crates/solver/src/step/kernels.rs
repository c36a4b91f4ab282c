//! The kernels of the elastic effects of a body, and the pieces that they work on.

use super::{phases::Task, shared_body::SharedBody};
use crate::{
    Effects, ElasticKind, Topology,
    effects::{Multipliers, elastic::Elastic},
    kernel::{
        block::{Blocks, Put, solve_batch},
        copies::{self, CopiedMultipliers, Copies},
        lanes::Instructions,
        strips::{self, StripRows},
    },
    layout::{
        order::{Direction, Elements},
        partitions::Piece,
    },
    parallel::scope::Side,
    particles::Part,
};

/// Generates the code for elastic effects.
macro_rules! of_elastic_effects {
    (
        {
            forces { $($force:tt)* }
            masks { $($mask:tt)* }
            solvers { $($solver:tt)* }
            elastic { $($effect:ident $field:ident ($corners:literal, $rows:literal) $does:literal;)* }
            $($others:tt)*
        }
        $($rest:tt)*
    ) => {
        /// A pass: the constraints of one half, those of the other, and the overflow constraints, or
        /// the other way around.
        pub(super) fn halves_of(
            kind: ElasticKind,
            topology: &Topology,
            task: Task,
            direction: Direction,
        ) -> [Option<(Task, Side)>; 3] {
            match kind {
                $(ElasticKind::$effect => {
                    halves(<crate::$effect as Elastic<$corners, $rows>>::elements(topology), task, direction)
                })*
            }
        }

        /// Kernels of the elastic effects of a body.
        #[derive(Default)]
        pub(crate) struct Kernels<'a> {
            $($field: Option<<crate::$effect as Elastic<$corners, $rows>>::Kernel<'a>>,)*
        }

        impl<'a> Kernels<'a> {
            /// For substeps of `h` seconds.
            pub fn new(effects: &Effects, topology: &'a Topology, h: f32) -> Self {
                Self {
                    $($field: effects.$field.map(|effect| effect.kernel(topology, h)),)*
                }
            }

            /// Solves the constraints of an effect on one piece.
            ///
            /// # Safety
            /// No other thread works on the piece, or on one that shares a particle with it.
            #[allow(unsafe_code, reason = "threads borrow disjoint multipliers")]
            pub unsafe fn solve(&self, kind: ElasticKind, work: ElasticPass) {
                match kind {
                    // SAFETY: the caller's promise.
                    $(ElasticKind::$effect => if let Some(kernel) = &self.$field {
                        unsafe { work.solve(kind, kernel) }
                    },)*
                }
            }

            /// Solves the constraints of an effect on copies of a body.
            pub fn solve_copies(&self, kind: ElasticKind, work: CopiesPass) {
                match kind {
                    $(ElasticKind::$effect => if let Some(kernel) = &self.$field {
                        work.solve(kernel)
                    },)*
                }
            }

            /// Whether the constraints of any effect are damped.
            pub fn are_damped(&self) -> bool {
                false $(|| self.$field.as_ref().is_some_and(|it| it.damped()))*
            }
        }
    };
}

crate::effects!(of_elastic_effects);

/// A pass: the constraints of one half, those of the other, and the overflow constraints, or the other
/// way around.
fn halves<const N: usize>(
    elements: &Elements<N>,
    task: Task,
    direction: Direction,
) -> [Option<(Task, Side)>; 3] {
    let odd = elements.odd_first();
    let half = |odd: bool| {
        let side = if odd { Side::Odd } else { Side::Even };
        (!elements.half(odd).is_empty()).then_some((task, side))
    };
    let overflow = elements.overflow().map(|_| (task, Side::Whole));
    match direction {
        Direction::Forward => [half(odd), half(!odd), overflow],
        Direction::Backward => [overflow, half(!odd), half(odd)],
    }
}

/// Work on the constraints of a piece of a body.
pub(crate) struct ElasticPass<'a> {
    /// The piece.
    pub piece: &'a Piece,
    /// Whether it is the whole body, including overflow constraints.
    pub whole: bool,
    /// Its particles.
    pub part: Part<'a>,
    /// Its rows, which are solved instead, in a body in strips.
    pub rows: Option<StripRows<'a>>,
    /// The body.
    pub shared: &'a SharedBody<'a>,
    /// Number of the iteration, their count, and whether λ is stored.
    pub pass: (u32, u32, bool),
    /// Direction in which it goes through the constraints.
    pub direction: Direction,
    /// How corrections are applied to particles.
    pub put: Put<'a>,
    /// Instructions to use.
    pub instructions: Instructions,
}

impl ElasticPass<'_> {
    /// # Safety
    /// As for [`Kernels::solve`].
    #[allow(unsafe_code, reason = "threads borrow disjoint multipliers")]
    unsafe fn solve<const N: usize, const M: usize>(
        self,
        kind: ElasticKind,
        kernel: &impl Blocks<N, M>,
    ) {
        let elements = kernel.elements();
        if let Some(index) = batch(elements, self.piece, self.whole) {
            let constraints = elements.batches()[index].constraints();
            let column = constraints.start * M..constraints.end * M;
            // SAFETY: a constraint is in one batch, a batch on one piece.
            let column = unsafe { self.shared.multipliers(kind, column) };
            let multipliers = Multipliers::of_iteration(column, self.pass);
            if let Some(rows) = self.rows {
                let how = (self.direction, self.instructions);
                return strips::solve(kernel, index, rows, multipliers, how);
            }
            let particles = (self.part, self.piece.particles.start);
            let context = (self.put, self.direction, self.instructions);
            solve_batch(kernel, index, particles, multipliers, context);
        }
    }
}

/// Number of the batch that is solved on a piece; overflow constraints on the whole body.
fn batch<const N: usize>(elements: &Elements<N>, piece: &Piece, whole: bool) -> Option<usize> {
    match whole {
        true => elements.overflow(),
        false => piece
            .partition
            .map(|partition| elements.batch_of(partition)),
    }
}

/// Work on the constraints of copies of a body that has one partition.
pub(crate) struct CopiesPass<'a> {
    /// The partition.
    pub piece: &'a Piece,
    /// Whether overflow constraints are solved.
    pub whole: bool,
    /// Their particles.
    pub copies: &'a mut Copies,
    /// Multipliers of the effect, if they are stored.
    pub multipliers: &'a mut CopiedMultipliers,
    /// Number of the iteration, their count, and whether λ is stored.
    pub pass: (u32, u32, bool),
    /// Instructions to use.
    pub instructions: Instructions,
}

impl CopiesPass<'_> {
    fn solve<const N: usize, const M: usize>(self, kernel: &impl Blocks<N, M>) {
        let elements = kernel.elements();
        if let Some(index) = batch(elements, self.piece, self.whole) {
            let constraints = elements.batches()[index].constraints();
            let column = constraints.start * M..constraints.end * M;
            let (iteration, count, is_last) = self.pass;
            let is_kept = !self.multipliers.is_empty() && (count > 1 || is_last);
            let lanes = self.copies.lanes();
            let column = column.start * lanes..column.end * lanes;
            let kept = is_kept.then(|| (&mut self.multipliers[column], iteration == 0));
            copies::solve(kernel, index, self.copies, kept, self.instructions);
        }
    }
}
