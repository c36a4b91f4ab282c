//! Tensions of edges before the first solution of a substep.
//!
//! An edge under tension resists rotation, which belongs to the matrix, but its tension is only known
//! from a solution. The one at the start of the substep is close to it, and saves a factorization
//! wherever the load changes slowly.

use super::{
    assemble::{Positions, weight},
    column::Columns,
    elements::{ElementWork, for_each},
};
use crate::elastic::{Elastic, Visit};

/// Lower bound of α̃ as a fraction of Σ w‖∇C‖² for an edge whose tension is that of its length: below
/// it, and for rigid edges, rounded positions say nothing, and the first tension is 0.
const COMPLIANT: f64 = 1e-6;

/// Sets the tensions of all edges to those at `places`, the start of the substep.
pub(super) struct Tensions<'a> {
    pub places: Positions<'a>,
    pub columns: &'a mut Columns,
}

impl Visit for Tensions<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        if N == 2 {
            let places = self.places;
            for_each(self, effect, places);
        }
    }
}

impl ElementWork for Tensions<'_> {
    #[inline(always)]
    fn element<const N: usize, const M: usize, E: Elastic<N, M>>(
        &mut self,
        effect: &E,
        index: usize,
        corners: [u32; N],
    ) {
        let places = self.places;
        let points = places.points(corners);
        let row = &effect.rows(places.topology, index, points)[0];
        let alpha = row.compliance / (places.h * places.h);
        let weight = weight(row, &points);
        if weight > 0.0 && alpha >= COMPLIANT * weight {
            self.columns[E::KIND as usize].tensions[index].0 = (row.error / alpha).max(0.0);
        }
    }
}
