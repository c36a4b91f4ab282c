//! Assembles the elastic equations of a body into a matrix, from the rows of every effect.

use super::{
    column::{Column, Columns, Kept},
    elements::{ElementWork, for_each},
    matrix::{Block, Matrix, add_outer, add_outer_and_unit, add_unit, add_unit_and_cross},
    plan::Plan,
};
use crate::{
    ElasticKind, Topology,
    elastic::{Curvature, Elastic, Point, Row, Visit},
    lanes::Instructions,
};
use glam::DVec3;

/// Lower bound of α' as a fraction of Σ w‖∇C‖²: stiff enough for rigid constraints, and well above
/// the rounding of `f64`.
const FLOOR: f64 = 1e-8;

/// A body is far from its rest shape where C exceeds this fraction of its scale: an edge a quarter
/// as long as at rest, a tetrahedron nearly flat.
const FAR: f64 = 0.75;

/// Lower bound of the compliance of a row in the merit function, as a fraction of Σ w‖∇C‖². At full
/// stiffness, the second-order stretch of a rotating rigid edge would allow only tiny steps.
const SOFTENED: f64 = 1e-2;

/// Particle state used in the assembly.
#[derive(Clone, Copy)]
pub(super) struct Positions<'a> {
    pub topology: &'a Topology,
    /// Inverse masses [1/kg].
    pub w: &'a [f64],
    /// Positions [m].
    pub x: &'a [DVec3],
    /// Positions at the start of the substep [m].
    pub p: &'a [DVec3],
    /// Length of the substep [s].
    pub h: f64,
    pub instructions: Instructions,
}

impl Positions<'_> {
    #[inline(always)]
    pub fn points<const N: usize>(&self, corners: [u32; N]) -> [Point; N] {
        let mut points = [Point::default(); N];
        for k in 0..N {
            let i = corners[k] as usize;
            points[k] = Point {
                x: self.x[i],
                w: self.w[i],
                rest: self.topology.rest[i].as_dvec3(),
            };
        }
        points
    }

    /// γ∇C·(x − p) and γ(∇C·(x − p))² of the equations of an element, with ∇C in the middle of the way,
    /// which is exactly 0 for a rotation.
    #[inline(always)]
    pub fn damped<const N: usize, const M: usize, E: Elastic<N, M>>(
        &self,
        effect: &E,
        index: usize,
        corners: [u32; N],
        gamma: f64,
    ) -> [(f64, f64); M] {
        if gamma == 0.0 {
            return [(0.0, 0.0); M];
        }
        let mut points = self.points(corners);
        let mut ways = [DVec3::ZERO; N];
        for k in 0..N {
            let i = corners[k] as usize;
            ways[k] = self.x[i] - self.p[i];
            points[k].x -= ways[k] / 2.0;
        }
        let rows = effect.rows(self.topology, index, points);
        rows.map(|row| {
            let moved: f64 = row.gradients.iter().zip(ways).map(|(g, d)| g.dot(d)).sum();
            (gamma * moved, gamma * moved * moved)
        })
    }
}

/// Adds the equations at x to a matrix and a right-hand side.
pub(super) struct Assemble<'a> {
    pub places: Positions<'a>,
    pub plan: &'a Plan,
    pub columns: &'a mut Columns,
    pub matrix: &'a mut Matrix,
    /// M Δx, by elimination index of the particle.
    pub right: &'a mut [DVec3],
    /// Whether the body is far from its rest shape.
    pub far: bool,
    /// Whether second derivatives that are not positive definite are left out.
    pub cautious: bool,
    /// Whether there are any.
    pub curved: bool,
}

impl Visit for Assemble<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        let places = self.places;
        for_each(self, effect, places);
    }
}

/// What an equation adds to the system.
#[derive(Clone, Copy)]
struct Added<const N: usize> {
    gradients: [DVec3; N],
    /// Force along ∇C.
    force: f64,
    /// Factor of ∇C ∇Cᵀ, and multiple of the identity.
    along: f64,
    taut: f64,
}

impl ElementWork for Assemble<'_> {
    #[inline(always)]
    fn element<const N: usize, const M: usize, E: Elastic<N, M>>(
        &mut self,
        effect: &E,
        index: usize,
        corners: [u32; N],
    ) {
        let places = self.places;
        let points = places.points(corners);
        let rows = effect.rows(places.topology, index, points);
        let curvature = effect.curvature(places.topology, index, points);
        if let Some(curvature) = &curvature {
            self.far |= curvature.is_far;
            self.curved = true;
        }
        let judged = curvature.is_none()
            && !matches!(E::KIND, ElasticKind::Bend | ElasticKind::IsometricBend);
        let (h, gamma) = (places.h, f64::from(effect.damping().get()) / places.h);
        let damped = places.damped(effect, index, corners, gamma);
        let column = &mut self.columns[E::KIND as usize];
        let mut added = [None; M];
        for equation in 0..M {
            let (number, row) = (index * M + equation, &rows[equation]);
            let weight = weight(row, &points);
            let alpha = row.compliance * (1.0 / (h * h));
            let used = match curvature {
                Some(_) => alpha,
                None => alpha.max(FLOOR * weight.max(row.least)),
            };
            column.rows[number] = Kept::default();
            let sound = used > 0.0 && (weight > 0.0 || curvature.is_some());
            if !sound {
                continue;
            }
            self.far |= judged && row.error.abs() > FAR * row.scale.abs();
            let lambda = column.lambdas[number];
            let (moved, lost) = damped[equation];
            let inverse = 1.0 / used;
            let residual = (row.error + alpha * lambda + moved) * inverse;
            let stiffness = (1.0 + gamma) * inverse;
            column.rows[number] = Kept {
                residual,
                stiffness,
                error: row.error,
                lost,
                alpha,
                // The energy itself is minimized where its curvature is known.
                softened: match curvature {
                    Some(_) => alpha,
                    None => used.max(SOFTENED * weight),
                },
            };
            column.gradients[number * N..][..N].copy_from_slice(&row.gradients);
            let taut = taut(column, index, &points, stiffness);
            let stiffness = match &curvature {
                Some(curvature) => curvature.along[equation] * h * h + gamma / used,
                None => stiffness,
            };
            added[equation] = Some(Added {
                gradients: row.gradients,
                force: lambda - residual,
                along: stiffness - taut,
                taut,
            });
        }
        self.add_blocks(E::KIND, (index, corners), &points, (&curvature, &added));
    }
}

impl Assemble<'_> {
    /// Adds the blocks of one element; none of pinned particles.
    #[inline(always)]
    fn add_blocks<const N: usize, const M: usize>(
        &mut self,
        kind: ElasticKind,
        (index, corners): (usize, [u32; N]),
        points: &[Point; N],
        (curvature, added): (&Option<Curvature<N, M>>, &[Option<Added<N>>; M]),
    ) {
        let square = self.places.h * self.places.h;
        let mut at = [0; N];
        for i in 0..N {
            at[i] = self.plan.place[corners[i] as usize] as usize;
        }
        let mut slot = index * (N * (N - 1) / 2);
        for i in 0..N {
            let is_free = points[i].w > 0.0;
            if is_free {
                let diagonal = &mut self.matrix.diagonal[at[i]];
                if let Some(curvature) = curvature {
                    add_unit(diagonal, curvature.even[i][i] * square);
                }
                let mut right = self.right[at[i]];
                for equation in added.iter().flatten() {
                    let g = equation.gradients[i];
                    right += g * equation.force;
                    add_equation::<N>(diagonal, (g, g), (equation.along, equation.taut));
                }
                self.right[at[i]] = right;
            }
            for j in 0..i {
                let block = self.columns[kind as usize].slots[slot] as usize;
                slot += 1;
                if !is_free || points[j].w == 0.0 {
                    continue;
                }
                let block = &mut self.matrix.lower[block];
                let (high, low) = if at[i] > at[j] { (i, j) } else { (j, i) };
                if let Some(curvature) = curvature {
                    let odd = match self.cautious {
                        true => DVec3::ZERO,
                        false => curvature.odd[high][low] * -square,
                    };
                    add_unit_and_cross(block, curvature.even[high][low] * square, odd);
                }
                for equation in added.iter().flatten() {
                    let both = (equation.gradients[high], equation.gradients[low]);
                    add_equation::<N>(block, both, (equation.along, -equation.taut));
                }
            }
        }
    }
}

/// Σ w‖∇C‖².
#[inline(always)]
pub(super) fn weight<const N: usize>(row: &Row<N>, points: &[Point; N]) -> f64 {
    let mut sum = 0.0;
    for (point, g) in points.iter().zip(&row.gradients) {
        sum += point.w * g.length_squared();
    }
    sum
}

/// Tension over length of an element of two particles, whose length is kept; otherwise 0.
#[inline(always)]
fn taut<const N: usize>(
    column: &mut Column,
    index: usize,
    points: &[Point; N],
    stiffness: f64,
) -> f64 {
    if N != 2 {
        return 0.0;
    }
    let (tension, length) = &mut column.tensions[index];
    // In this order it is the length in the equation, and its root is not taken twice.
    *length = points[1].x.distance(points[0].x);
    if *length > 0.0 {
        (*tension / *length).clamp(0.0, stiffness)
    } else {
        0.0
    }
}

/// block += along g hᵀ + taut · 1; taut is 0 unless N is 2.
#[inline(always)]
fn add_equation<const N: usize>(
    block: &mut Block,
    (g, h): (DVec3, DVec3),
    (along, taut): (f64, f64),
) {
    let (g, h) = ([g.x, g.y, g.z, 0.0], (h * along).to_array());
    if N == 2 {
        add_outer_and_unit(block, (g, h), taut);
    } else if along != 0.0 {
        add_outer(block, g, h);
    }
}
