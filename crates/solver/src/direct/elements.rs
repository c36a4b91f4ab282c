//! Work on every element of an effect, compiled for each instruction set.

use crate::{
    Topology,
    elastic::Elastic,
    lanes::{Instructions, Lanes, SimdWork},
    order,
};

/// Work on one element, of any effect.
pub(super) trait ElementWork {
    /// Performs it; must be marked `#[inline(always)]`, and without closures, which would not be
    /// compiled for the instruction set.
    fn element<const N: usize, const M: usize, E: Elastic<N, M>>(
        &mut self,
        effect: &E,
        index: usize,
        corners: [u32; N],
    );
}

/// Performs work on all elements of an effect that is solved directly.
pub(super) fn for_each<const N: usize, const M: usize, E: Elastic<N, M>>(
    work: &mut impl ElementWork,
    effect: &E,
    (topology, instructions): (&Topology, Instructions),
) {
    if E::KIND.is_solved_directly() {
        instructions.run(OfEffect(work, effect, topology));
    }
}

/// The elements of one effect.
struct OfEffect<'a, W, E, const N: usize, const M: usize>(&'a mut W, &'a E, &'a Topology);

impl<const N: usize, const M: usize, W: ElementWork, E: Elastic<N, M>> SimdWork
    for OfEffect<'_, W, E, N, M>
{
    #[inline(always)]
    fn run<L: Lanes>(self, _: L) {
        let Self(work, effect, topology) = self;
        let elements: &order::Elements<N> = E::elements(topology);
        for (index, corners) in elements.corners().enumerate() {
            work.element(effect, index, corners);
        }
    }
}
