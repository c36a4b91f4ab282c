//! The energy of a body as a function of its particle positions, with derivatives.
//!
//! The variables are displacements from the start, and positions in an element are relative to its
//! first particle: rows depend on differences alone, so their rounding error is relative to the
//! size of an element, not to its distance from the origin.

use crate::{
    Body, ElasticKind, Finite, Topology,
    direct::{
        matrix::{Block, Matrix},
        plan::Plan,
    },
    elastic::{Elastic, Point, Row, Visit},
    kernel::eigen::{ElementMatrix, MAX_COORDINATES, project},
};
use glam::DVec3;

/// Second derivatives are central differences of the gradient, with this fraction of the element
/// size as the step. Their error is ε/STEP by rounding, and STEP² times the third derivative of the
/// gradient by truncation; near ∛ε = 6e-6 both are about 1e-10. A step of Newton's method then
/// gains at most ten digits.
const STEP: f64 = 1e-5;

/// A rigid row of the scale s has the compliance s²/K. K is at least this multiple of
/// weight × size, so that the first solution violates a row by less than 1e-3 of its scale, and
/// each update of the multipliers reduces the violation by about the same factor. Larger values
/// cost precision of the forces.
const RIGID_OVER_LOAD: f64 = 1e3;

/// K is at least this multiple of s²/α of the stiffest elastic row, because springs would otherwise
/// pull rigid rows open; the limit is [`MAX_RIGID_OVER_LOAD`] times weight × size.
const RIGID_OVER_ELASTIC: f64 = 10.0;

/// See [`RIGID_OVER_ELASTIC`]; larger values would leave too little precision.
const MAX_RIGID_OVER_LOAD: f64 = 1e9;

/// A body, its load, and the multipliers of its rigid rows.
pub(super) struct Energy<'a> {
    body: &'a Body,
    /// Positions at the start [m].
    pub start: Vec<DVec3>,
    /// Inverse masses [1/kg].
    pub w: Vec<f64>,
    /// Force on each particle [N]; none on pins.
    pub load: Vec<DVec3>,
    /// K, see [`RIGID_OVER_LOAD`] [J]; `None` without rigid rows.
    rigid: Option<f64>,
    /// λ of each row, if any is rigid; 0 for elastic rows.
    lambdas: [Vec<f64>; ElasticKind::COUNT],
}

/// Energy, gradient, and the sum of the magnitudes of the energy terms.
pub(super) struct Slope {
    /// E [J].
    pub energy: f64,
    /// ∇E [N], 0 for pins.
    pub gradient: Vec<DVec3>,
    /// Elastic energy and work of the load, both positive [J]: the rounding error of E is a few ε
    /// of it.
    pub terms: f64,
}

impl<'a> Energy<'a> {
    pub fn new(body: &'a Body, gravity: DVec3) -> Self {
        let particles = &body.particles;
        let all = 0..particles.len();
        let uniform = body.effects.uniform.map_or(DVec3::ZERO, |uniform| {
            Finite::vector([uniform.x, uniform.y, uniform.z])
        });
        let weight = body.effects.force_weights(&body.topology);
        let w: Vec<f64> = all
            .clone()
            .map(|i| particles.positions[i].w.into())
            .collect();
        let force = |(i, w): (u32, &f64)| {
            if *w > 0.0 {
                (gravity + uniform * weight(i)) / *w
            } else {
                DVec3::ZERO
            }
        };
        let mut energy = Self {
            body,
            start: all.map(|i| particles.position(i)).collect(),
            load: (0..).zip(&w).map(force).collect(),
            w,
            rigid: None,
            lambdas: Default::default(),
        };
        let mut scales = Scales {
            energy: &energy,
            stiffest: 0.0,
            rigid: false,
        };
        body.effects.visit(&mut scales);
        if scales.rigid {
            let weight: f64 = energy.load.iter().map(|force| force.length()).sum();
            let load = weight * f64::from(body.topology.size);
            let elastic = RIGID_OVER_ELASTIC * scales.stiffest;
            let elastic = elastic.min(MAX_RIGID_OVER_LOAD * load);
            energy.rigid = Some(elastic.max(RIGID_OVER_LOAD * load));
            energy.release();
        }
        energy
    }

    /// Sets all multipliers to 0.
    pub fn release(&mut self) {
        if self.rigid.is_some() {
            for kind in ElasticKind::ALL {
                let carried = self.body.effects.has(kind);
                let count = if carried {
                    kind.multipliers(self.topology())
                } else {
                    0
                };
                self.lambdas[kind as usize] = vec![0.0; count];
            }
        }
    }

    pub fn topology(&self) -> &'a Topology {
        &self.body.topology
    }

    /// E and ∇E at the displacements `u`, under a fraction of the load.
    pub fn slope(&self, u: &[DVec3], fraction: f64) -> Slope {
        let mut sum = Sum {
            energy: self,
            u,
            stored: 0.0,
            gradient: vec![DVec3::ZERO; u.len()],
        };
        self.body.effects.visit(&mut sum);
        let Sum {
            stored,
            mut gradient,
            ..
        } = sum;
        let (mut work, mut size) = (0.0, 0.0);
        for (((gradient, load), u), w) in gradient.iter_mut().zip(&self.load).zip(u).zip(&self.w) {
            work += fraction * load.dot(*u);
            size += fraction * load.length() * u.length();
            *gradient = if *w > 0.0 {
                *gradient - *load * fraction
            } else {
                DVec3::ZERO
            };
        }
        Slope {
            energy: stored - work,
            gradient,
            terms: stored + size,
        }
    }

    /// Second derivatives, made positive semidefinite per element if `projected`; 1 for pins.
    pub fn assemble(&self, u: &[DVec3], plan: &Plan, matrix: &mut Matrix, projected: bool) {
        matrix.reset(plan);
        self.body.effects.visit(&mut Assemble {
            energy: self,
            u,
            plan,
            matrix,
            projected,
        });
    }

    /// Largest violation of a rigid row relative to its scale; 0 without rigid rows.
    pub fn violation(&self, u: &[DVec3]) -> f64 {
        let mut worst = Violation {
            energy: self,
            u,
            worst: 0.0,
        };
        if self.rigid.is_some() {
            self.body.effects.visit(&mut worst);
        }
        worst.worst
    }

    /// Multiplier update of rigid rows: λ − C/α.
    pub fn update_multipliers(&mut self, u: &[DVec3]) {
        let mut lambdas = std::mem::take(&mut self.lambdas);
        self.body.effects.visit(&mut Update {
            energy: self,
            u,
            lambdas: &mut lambdas,
        });
        self.lambdas = lambdas;
    }

    /// Pairs of particles that share an element.
    pub fn links(&self) -> Vec<(u32, u32)> {
        struct Links<'a>(&'a Topology, Vec<(u32, u32)>);
        impl Visit for Links<'_> {
            fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, _: &E) {
                for corners in E::elements(self.0).corners() {
                    for (i, &a) in corners.iter().enumerate() {
                        self.1.extend(corners[..i].iter().map(|&b| (a, b)));
                    }
                }
            }
        }
        let mut links = Links(self.topology(), Vec::new());
        self.body.effects.visit(&mut links);
        links.1
    }

    /// Particles of an element relative to its first.
    fn points<const N: usize>(&self, corners: [u32; N], u: &[DVec3]) -> [Point; N] {
        let at = corners.map(|i| i as usize);
        let rest = |i: usize| self.topology().rest[i].as_dvec3();
        let first = at[0];
        at.map(|i| Point {
            x: (self.start[i] - self.start[first]) + (u[i] - u[first]),
            w: self.w[i],
            rest: rest(i) - rest(first),
        })
    }

    /// λ of the rows of an element.
    fn lambdas<const M: usize>(&self, kind: ElasticKind, index: usize) -> [f64; M] {
        let own = self.lambdas[kind as usize].get(index * M..);
        std::array::from_fn(|row| own.and_then(|own| own.get(row)).copied().unwrap_or(0.0))
    }

    /// Compliance of a row, and −λ, its force at zero violation. A rigid row without a scale has no
    /// force.
    fn pull<const N: usize>(&self, row: &Row<N>, lambda: f64) -> (f64, f64) {
        match self.rigid {
            Some(rigid) if row.compliance == 0.0 => {
                let alpha = row.scale * row.scale / rigid;
                if alpha > 0.0 {
                    (alpha, row.error / alpha - lambda)
                } else {
                    (0.0, 0.0)
                }
            }
            _ => (row.compliance, row.error / row.compliance),
        }
    }

    /// Energy and gradient of an element. For a rigid row it is ½(C − αλ)²/α, which differs by a
    /// constant from the augmented Lagrangian ½C²/α − λC.
    fn element<const N: usize, const M: usize, E: Elastic<N, M>>(
        &self,
        effect: &E,
        index: usize,
        points: [Point; N],
        lambdas: &[f64; M],
    ) -> (f64, [DVec3; N]) {
        let (mut stored, mut gradient) = (0.0, [DVec3::ZERO; N]);
        let rows = effect.rows(self.topology(), index, points);
        for (row, lambda) in rows.iter().zip(lambdas) {
            let (alpha, pull) = self.pull(row, *lambda);
            if pull == 0.0 {
                continue;
            }
            stored += 0.5 * alpha * pull * pull;
            for (gradient, of_row) in gradient.iter_mut().zip(row.gradients) {
                *gradient += of_row * pull;
            }
        }
        (stored, gradient)
    }
}

/// Determines whether any row is rigid, and the stiffness of the others.
struct Scales<'a> {
    energy: &'a Energy<'a>,
    /// The largest s²/α [J].
    stiffest: f64,
    rigid: bool,
}

impl Visit for Scales<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        let energy = self.energy;
        let still = vec![DVec3::ZERO; energy.start.len()];
        for (index, corners) in E::elements(energy.topology()).corners().enumerate() {
            let points = energy.points(corners, &still);
            for row in effect.rows(energy.topology(), index, points) {
                if row.compliance == 0.0 {
                    self.rigid = true;
                } else {
                    self.stiffest = self.stiffest.max(row.scale * row.scale / row.compliance);
                }
            }
        }
    }
}

/// Accumulates elastic energy and its gradient.
struct Sum<'a> {
    energy: &'a Energy<'a>,
    u: &'a [DVec3],
    stored: f64,
    gradient: Vec<DVec3>,
}

impl Visit for Sum<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        let energy = self.energy;
        for (index, corners) in E::elements(energy.topology()).corners().enumerate() {
            let points = energy.points(corners, self.u);
            let lambdas = energy.lambdas(E::KIND, index);
            let (stored, gradient) = energy.element(effect, index, points, &lambdas);
            self.stored += stored;
            for (i, gradient) in corners.into_iter().zip(gradient) {
                self.gradient[i as usize] += gradient;
            }
        }
    }
}

/// Accumulates second derivatives.
struct Assemble<'a> {
    energy: &'a Energy<'a>,
    u: &'a [DVec3],
    plan: &'a Plan,
    matrix: &'a mut Matrix,
    projected: bool,
}

impl Visit for Assemble<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        const { assert!(3 * N <= MAX_COORDINATES) };
        let energy = self.energy;
        for (index, corners) in E::elements(energy.topology()).corners().enumerate() {
            let points = energy.points(corners, self.u);
            let lambdas = energy.lambdas(E::KIND, index);
            let sizes = points.iter().map(|point| point.rest.length());
            let step = STEP * sizes.fold(0.0, f64::max);
            if step == 0.0 {
                continue;
            }
            let mut matrix = ElementMatrix::default();
            for corner in (0..N).filter(|&corner| points[corner].w > 0.0) {
                for axis in 0..3 {
                    let beside = |by: f64| {
                        let mut points = points;
                        points[corner].x[axis] += by;
                        energy.element(effect, index, points, &lambdas).1
                    };
                    let (more, less) = (beside(step), beside(-step));
                    for other in (0..N).filter(|&other| points[other].w > 0.0) {
                        let rate = (more[other] - less[other]) / (2.0 * step);
                        for (along, rate) in rate.to_array().into_iter().enumerate() {
                            // Both halves, for symmetry.
                            matrix[3 * other + along][3 * corner + axis] += 0.5 * rate;
                            matrix[3 * corner + axis][3 * other + along] += 0.5 * rate;
                        }
                    }
                }
            }
            if self.projected {
                project(&mut matrix, 3 * N);
            }
            self.add(corners, &matrix);
        }
    }
}

impl Assemble<'_> {
    fn add<const N: usize>(&mut self, corners: [u32; N], element: &ElementMatrix) {
        let place = corners.map(|i| self.plan.place[i as usize]);
        for i in 0..N {
            // Pinned particles have no blocks.
            if let Some(block) = self.matrix.diagonal.get_mut(place[i] as usize) {
                add_block(block, element, (i, i));
            }
            for j in 0..i {
                let both = if place[i] > place[j] { (i, j) } else { (j, i) };
                let block = self.plan.block(place[i], place[j]);
                if let Some(block) = self.matrix.lower.get_mut(block as usize) {
                    add_block(block, element, both);
                }
            }
        }
    }
}

/// Adds the derivatives with respect to the coordinates of one corner (rows) and another (columns).
fn add_block(block: &mut Block, element: &ElementMatrix, (row, column): (usize, usize)) {
    for (c, cells) in block.iter_mut().enumerate() {
        for (r, cell) in cells.iter_mut().enumerate().take(3) {
            *cell += element[3 * row + r][3 * column + c];
        }
    }
}

/// Finds the largest violation of a rigid row.
struct Violation<'a> {
    energy: &'a Energy<'a>,
    u: &'a [DVec3],
    worst: f64,
}

impl Visit for Violation<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        let energy = self.energy;
        for (index, corners) in E::elements(energy.topology()).corners().enumerate() {
            let points = energy.points(corners, self.u);
            for row in effect.rows(energy.topology(), index, points) {
                // A row without movable particles is not part of the problem.
                let free = points.iter().any(|point| point.w > 0.0);
                if row.compliance == 0.0 && row.scale != 0.0 && free {
                    self.worst = self.worst.max((row.error / row.scale).abs());
                }
            }
        }
    }
}

/// Updates the multipliers of rigid rows.
struct Update<'a> {
    energy: &'a Energy<'a>,
    u: &'a [DVec3],
    lambdas: &'a mut [Vec<f64>; ElasticKind::COUNT],
}

impl Visit for Update<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        let energy = self.energy;
        let own = self.lambdas[E::KIND as usize].chunks_exact_mut(M);
        let elements = E::elements(energy.topology()).corners().enumerate();
        for ((index, corners), lambdas) in elements.zip(own) {
            let points = energy.points(corners, self.u);
            let rows = effect.rows(energy.topology(), index, points);
            for (row, lambda) in rows.iter().zip(lambdas) {
                if row.compliance == 0.0 {
                    *lambda = -energy.pull(row, *lambda).1;
                }
            }
        }
    }
}
