//! Assembles the elastic equations of a body into a matrix, from the rows of every effect.

use super::{
    matrix::{Matrix, add_cross, add_outer, add_unit},
    plan::Plan,
};
use crate::{
    ElasticKind, Topology,
    elastic::{Curvature, Elastic, Point, Row, Visit},
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

/// An equation at the last assembly.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Kept {
    /// (C + α̃λ + γ∇C·(x − p))/α'; 0, as all other fields, for equations without gradient.
    residual: f64,
    /// (1 + γ)/α'.
    stiffness: f64,
    /// C and γ(∇C·(x − p))².
    error: f64,
    lost: f64,
    /// α̃, and its value in the merit function.
    alpha: f64,
    softened: f64,
}

impl Kept {
    /// ½ (C − (α − α̃)λ)²/α plus a damping term, with α the softened compliance: an augmented
    /// Lagrangian, which the solution minimizes at the λ of the solution.
    fn merit(&self, error: f64, lost: f64, lambda: f64) -> f64 {
        let off = error - (self.softened - self.alpha) * lambda;
        if self.softened > 0.0 {
            0.5 * (off * off + lost) / self.softened
        } else {
            0.0
        }
    }
}

/// The equations of one effect at the last assembly.
#[derive(Debug, Clone, Default)]
pub(super) struct Column {
    /// Matrix block of each pair of corners of each element.
    slots: Vec<u32>,
    /// Each equation, and its ∇C for each corner.
    rows: Vec<Kept>,
    gradients: Vec<DVec3>,
    /// λ of each equation.
    pub lambdas: Vec<f64>,
    /// λ after a full step.
    next: Vec<f64>,
    /// Tension of each edge or strut times h², and its length [m]; unused for other effects.
    tensions: Vec<(f64, f64)>,
}

impl Column {
    /// Before the first step of a substep: sets λ and tensions to 0.
    pub fn begin(&mut self) {
        self.lambdas.fill(0.0);
        self.tensions.fill((0.0, 0.0));
    }

    /// Updates λ for a fraction of the step.
    pub fn advance(&mut self, fraction: f64) {
        for (lambda, next) in self.lambdas.iter_mut().zip(&self.next) {
            *lambda += (next - *lambda) * fraction;
        }
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.slots[..])
            + size_of_val(&self.rows[..])
            + size_of_val(&self.gradients[..])
            + size_of_val(&self.lambdas[..])
            + size_of_val(&self.next[..])
            + size_of_val(&self.tensions[..])
    }
}

/// Columns of all effects.
pub(super) type Columns = [Column; ElasticKind::COUNT];

/// Collects the pairs of particles that share an element of a directly solved effect.
pub(super) struct Links<'a> {
    pub topology: &'a Topology,
    pub found: Vec<(u32, u32)>,
}

impl Visit for Links<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, _: &E) {
        if E::KIND.is_solved_directly() {
            let elements = E::elements(self.topology).corners();
            self.found.extend(elements.flat_map(pairs));
        }
    }
}

/// All pairs of corners, the later one first.
fn pairs<const N: usize>(corners: [u32; N]) -> impl Iterator<Item = (u32, u32)> {
    (0..N).flat_map(move |i| (0..i).map(move |j| (corners[i], corners[j])))
}

/// Finds the blocks of all elements, and allocates columns.
pub(super) struct Prepare<'a> {
    pub topology: &'a Topology,
    pub plan: &'a Plan,
    pub columns: &'a mut Columns,
}

impl Visit for Prepare<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, _: &E) {
        if !E::KIND.is_solved_directly() {
            return;
        }
        let place = |i: u32| self.plan.place[i as usize];
        let elements = E::elements(self.topology).corners();
        let count = elements.len();
        let pairs = elements.flat_map(pairs);
        let column = &mut self.columns[E::KIND as usize];
        column.slots.clear();
        column
            .slots
            .extend(pairs.map(|(a, b)| self.plan.block(place(a), place(b))));
        column.rows = vec![Kept::default(); count * M];
        column.gradients = vec![DVec3::ZERO; count * M * N];
        column.lambdas = vec![0.0; count * M];
        column.next = vec![0.0; count * M];
        column.tensions = vec![(0.0, 0.0); if N == 2 { count } else { 0 }];
    }
}

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
}

impl Positions<'_> {
    fn points<const N: usize>(&self, corners: [u32; N]) -> [Point; N] {
        corners.map(|i| i as usize).map(|i| Point {
            x: self.x[i],
            w: self.w[i],
            rest: self.topology.rest[i].as_dvec3(),
        })
    }

    /// ∇C·(x − p).
    fn moved<const N: usize>(&self, corners: [u32; N], row: &Row<N>) -> f64 {
        let both = corners.into_iter().zip(row.gradients);
        both.map(|(i, g)| g.dot(self.x[i as usize] - self.p[i as usize]))
            .sum()
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
        if !E::KIND.is_solved_directly() {
            return;
        }
        let places = self.places;
        let (h, gamma) = (places.h, f64::from(effect.damping().get()) / places.h);
        let judged = !matches!(E::KIND, ElasticKind::Bend | ElasticKind::IsometricBend);
        let Column {
            slots,
            rows: kept,
            gradients,
            lambdas,
            tensions,
            ..
        } = &mut self.columns[E::KIND as usize];
        let elements = E::elements(places.topology).corners().enumerate();
        let pairs = N * (N - 1) / 2;
        for (index, corners) in elements {
            let points = places.points(corners);
            let rows = effect.rows(places.topology, index, points);
            let curvature = effect.curvature(places.topology, index, points);
            let at = corners.map(|i| self.plan.place[i as usize] as usize);
            let slots = &slots[index * pairs..][..pairs];
            if let Some(curvature) = &curvature {
                self.far |= curvature.is_far;
                self.curved = true;
                let given = (curvature, self.cautious);
                curve(self.matrix, given, &points, (at, slots), h * h);
            }
            for (equation, row) in rows.iter().enumerate() {
                let number = index * M + equation;
                let weights = row.gradients.iter().zip(&points);
                let weight: f64 = weights.map(|(g, point)| point.w * g.length_squared()).sum();
                let alpha = row.compliance / (h * h);
                let used = match curvature {
                    Some(_) => alpha,
                    None => alpha.max(FLOOR * weight.max(row.least)),
                };
                kept[number] = Kept::default();
                let sound = used > 0.0 && (weight > 0.0 || curvature.is_some());
                if !sound {
                    continue;
                }
                let is_judged = judged && curvature.is_none();
                self.far |= is_judged && row.error.abs() > FAR * row.scale.abs();
                let lambda = lambdas[number];
                let moved = places.moved(corners, row);
                let residual = (row.error + alpha * lambda + gamma * moved) / used;
                let stiffness = (1.0 + gamma) / used;
                kept[number] = Kept {
                    residual,
                    stiffness,
                    error: row.error,
                    lost: gamma * moved * moved,
                    alpha,
                    // The energy itself is minimized where its curvature is known.
                    softened: match curvature {
                        Some(_) => alpha,
                        None => used.max(SOFTENED * weight),
                    },
                };
                gradients[number * N..][..N].copy_from_slice(&row.gradients);
                let taut = tensions.get_mut(index).map_or(0.0, |(tension, length)| {
                    *length = points[0].x.distance(points[N - 1].x);
                    if *length > 0.0 {
                        (*tension / *length).clamp(0.0, stiffness)
                    } else {
                        0.0
                    }
                });
                let stiffness = curvature.map_or(stiffness, |curvature| {
                    curvature.along[equation] * h * h + gamma / used
                });
                let (force, along) = (lambda - residual, stiffness - taut);
                for i in 0..N {
                    let g = row.gradients[i];
                    if points[i].w > 0.0 {
                        self.right[at[i]] += g * force;
                        let diagonal = &mut self.matrix.diagonal[at[i]];
                        add_outer(diagonal, g, g, along);
                        add_unit(diagonal, taut);
                    }
                }
                for ([high, low], block) in blocks(&points, at, slots) {
                    let block = &mut self.matrix.lower[block];
                    add_outer(block, row.gradients[high], row.gradients[low], along);
                    add_unit(block, -taut);
                }
            }
        }
    }
}

/// The blocks of an element below the diagonal, with the corners of their row and column; none of
/// pinned particles.
fn blocks<const N: usize>(
    points: &[Point; N],
    at: [usize; N],
    slots: &[u32],
) -> impl Iterator<Item = ([usize; 2], usize)> {
    let pairs = (0..N).flat_map(|i| (0..i).map(move |j| [i, j]));
    let free = move |[i, j]: [usize; 2]| points[i].w > 0.0 && points[j].w > 0.0;
    let pairs = pairs.zip(slots).filter(move |(pair, _)| free(*pair));
    pairs.map(move |([i, j], &block)| {
        let ordered = if at[i] > at[j] { [i, j] } else { [j, i] };
        (ordered, block as usize)
    })
}

/// Adds second derivatives that the equations of an element do not have, times h².
fn curve<const N: usize, const M: usize>(
    matrix: &mut Matrix,
    (curvature, cautious): (&Curvature<N, M>, bool),
    points: &[Point; N],
    (at, slots): ([usize; N], &[u32]),
    square: f64,
) {
    for i in 0..N {
        if points[i].w > 0.0 {
            add_unit(&mut matrix.diagonal[at[i]], curvature.even[i][i] * square);
        }
    }
    for ([high, low], block) in blocks(points, at, slots) {
        let block = &mut matrix.lower[block];
        add_unit(block, curvature.even[high][low] * square);
        if !cautious {
            add_cross(block, curvature.odd[high][low] * -square);
        }
    }
}

/// Predicts λ after a full step Δx.
pub(super) struct ForeseenMerit<'a> {
    pub places: Positions<'a>,
    pub plan: &'a Plan,
    pub columns: &'a mut Columns,
    /// By elimination index of the particle [m].
    pub step: &'a [DVec3],
    /// Accumulates the value of [`Merit`] before the step.
    pub sum: f64,
    /// Whether the tension of an edge exceeds the assumed one by a relevant amount.
    pub tighter: bool,
}

impl Visit for ForeseenMerit<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        if !E::KIND.is_solved_directly() {
            return;
        }
        let places = self.places;
        let Column {
            rows,
            gradients,
            lambdas,
            next,
            tensions,
            ..
        } = &mut self.columns[E::KIND as usize];
        let elements = E::elements(places.topology).corners().enumerate();
        for (index, corners) in elements {
            let steps = corners.map(|i| self.step[self.plan.place[i as usize] as usize]);
            let foreseen = effect.foresee(places.topology, index, places.points(corners), steps);
            for number in index * M..(index + 1) * M {
                let kept = &rows[number];
                let both = gradients[number * N..].iter().zip(steps);
                let moved: f64 = both.map(|(g, step)| g.dot(step)).sum();
                next[number] = lambdas[number] - (kept.residual + kept.stiffness * moved);
                if let Some(errors) = foreseen
                    && kept.alpha > 0.0
                {
                    // Its second order, which is all where C has no gradient at rest.
                    let bent = errors[number - index * M] - kept.error - moved;
                    next[number] -= bent / kept.alpha;
                }
                self.sum += kept.merit(kept.error, kept.lost, next[number]);
            }
            if let Some((tension, length)) = tensions.get_mut(index) {
                let now = (-next[index]).max(0.0);
                let weight: f64 = corners.iter().map(|&i| places.w[i as usize]).sum();
                self.tighter |= (now - *tension) * weight > *length;
                *tension = now;
            }
        }
    }
}

/// Accumulates the merit function at x, with the predicted λ.
pub(super) struct Merit<'a> {
    pub places: Positions<'a>,
    pub columns: &'a Columns,
    pub sum: f64,
}

impl Visit for Merit<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        if !E::KIND.is_solved_directly() {
            return;
        }
        let places = self.places;
        let gamma = f64::from(effect.damping().get()) / places.h;
        let Column {
            rows: kept, next, ..
        } = &self.columns[E::KIND as usize];
        let elements = E::elements(places.topology).corners().enumerate();
        for (index, corners) in elements {
            let rows = effect.rows(places.topology, index, places.points(corners));
            for (number, row) in (index * M..).zip(&rows) {
                let moved = places.moved(corners, row);
                self.sum += kept[number].merit(row.error, gamma * moved * moved, next[number]);
            }
        }
    }
}
