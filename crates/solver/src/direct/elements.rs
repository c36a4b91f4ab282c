//! Work on every element of an effect, compiled for each instruction set.

use super::assemble::Positions;
use crate::{
    ElasticKind,
    elastic::Elastic,
    lanes::{Lanes, SimdWork},
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

/// Performs work on all elements of an effect that is solved directly, but those whose particles are all
/// pinned: nothing can be said of them except the stress of neo-Hookean tetrahedra.
pub(super) fn for_each<const N: usize, const M: usize, E: Elastic<N, M>>(
    work: &mut impl ElementWork,
    effect: &E,
    places: Positions,
) {
    if E::KIND.is_solved_directly() {
        places.instructions.run(OfEffect(work, effect, places));
    }
}

/// The elements of one effect.
struct OfEffect<'a, W, E, const N: usize, const M: usize>(&'a mut W, &'a E, Positions<'a>);

impl<const N: usize, const M: usize, W: ElementWork, E: Elastic<N, M>> SimdWork
    for OfEffect<'_, W, E, N, M>
{
    #[inline(always)]
    fn run<L: Lanes>(self, _: L) {
        let Self(work, effect, places) = self;
        let elements: &order::Elements<N> = E::elements(places.topology);
        for (index, corners) in elements.corners().enumerate() {
            let mut is_free = matches!(E::KIND, ElasticKind::NeoHookean);
            for corner in corners {
                is_free |= places.w[corner as usize] > 0.0;
            }
            if is_free {
                work.element(effect, index, corners);
            }
        }
    }
}
