//! Quantities of a body by particle, for drawing: principal strain, change of volume, speed,
//! constraint error, contact force.
//!
//! A quantity of elements is the mean over the elements of a particle, weighted by their measure at
//! rest (volume of a tetrahedron, area of a triangle, length of an edge). NaN marks a particle for
//! which the quantity is not defined.
//!
//! Sources: principal stretches are the singular values of the deformation gradient (Bonet and Wood,
//! *Nonlinear Continuum Mechanics for Finite Element Analysis*, 2008, section 4.6); the constraint
//! error is the residual of equation 9 of Macklin, Müller and Chentanez, *XPBD* (2016).

use crate::{
    EffectStates, Effects, Particles, Topology,
    elastic::{Elastic, Visit},
    topology::{Dimension, volume},
};
use glam::{DMat3, DVec3, Vec4};

/// Which of the principal stretches of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Principal {
    /// The largest: where it is above 1, the material is in tension.
    Largest,
    /// The smallest: where it is below 1, the material is compressed.
    Smallest,
}

/// Weighted means of a quantity of elements over their particles.
struct Means(Vec<(f64, f64)>);

impl Means {
    fn of(particles: usize) -> Self {
        Self(vec![(0.0, 0.0); particles])
    }

    fn add(&mut self, corners: &[u32], value: f64, measure: f64) {
        if measure > 0.0 && value.is_finite() {
            for &corner in corners {
                let (sum, total) = &mut self.0[corner as usize];
                *sum += value * measure;
                *total += measure;
            }
        }
    }

    /// Writes f of each mean to `out`, and NaN where there is none.
    fn write(&self, out: &mut Vec<f32>, f: impl Fn(f64) -> f64) {
        let mean = |&(sum, total): &(f64, f64)| match total > 0.0 {
            true => f(sum / total) as f32,
            false => f32::NAN,
        };
        out.clear();
        out.extend(self.0.iter().map(mean));
    }
}

/// Principal stretch minus 1 relative to the rest shape of the mesh: of the tetrahedra of a solid,
/// within the triangles of a cloth, along the edges of a rope. The smallest stretch of an inverted
/// tetrahedron counts as negative.
pub fn strain(topology: &Topology, positions: &[Vec4], which: Principal, out: &mut Vec<f32>) {
    let mut means = Means::of(positions.len());
    let rest = |i: u32| topology.rest[i as usize].as_dvec3();
    let now = |i: u32| positions[i as usize].truncate().as_dvec3();
    let choose = |(low, high): (f64, f64)| match which {
        Principal::Largest => high - 1.0,
        Principal::Smallest => low - 1.0,
    };
    match topology.dimension {
        Dimension::Solid => {
            for corners in topology.tetrahedra.corners() {
                let (rest, now) = (corners.map(rest), corners.map(now));
                let gradient = sides(now) * sides(rest).inverse();
                let value = choose(principal_stretches(gradient));
                means.add(&corners, value, volume(rest).abs());
            }
        }
        Dimension::Sheet => {
            for corners in topology.triangles.iter() {
                let (rest, now) = (corners.map(rest), corners.map(now));
                let area = (rest[1] - rest[0]).cross(rest[2] - rest[0]).length() / 2.0;
                if area > 0.0 {
                    means.add(corners, choose(planar_stretches(rest, now)), area);
                }
            }
        }
        Dimension::Line => {
            for ends in topology.edges.ends() {
                let [a, b] = ends.map(rest);
                let [c, d] = ends.map(now);
                let length = a.distance(b);
                means.add(&ends, c.distance(d) / length - 1.0, length);
            }
        }
        Dimension::Grains => {}
    }
    means.write(out, |mean| mean);
}

/// V/V₀ − 1: of the tetrahedra of a solid; of the volume that the surface of any other body
/// encloses, where it is closed.
pub fn volume_change(topology: &Topology, positions: &[Vec4], out: &mut Vec<f32>) {
    let now = |i: u32| positions[i as usize].truncate().as_dvec3();
    if topology.tetrahedra.rest_volume.is_empty() {
        let whole = topology.enclosure().map_or(f64::NAN, |enclosure| {
            enclosure.volume(topology, now) / enclosure.rest_volume - 1.0
        });
        out.clear();
        out.resize(positions.len(), whole as f32);
        return;
    }
    let mut means = Means::of(positions.len());
    for corners in topology.tetrahedra.corners() {
        let rest = volume(corners.map(|i| topology.rest[i as usize].as_dvec3()));
        means.add(&corners, volume(corners.map(now)) / rest - 1.0, rest.abs());
    }
    means.write(out, |mean| mean);
}

/// Speed [m/s].
pub fn speed(particles: &Particles, out: &mut Vec<f32>) {
    out.clear();
    out.extend(particles.velocities().map(|velocity| velocity.length()));
}

/// Root mean square of (C + αλ/h²)/s over the equations of elastic effects at a particle, after a
/// substep of `h` seconds. s is the rest length or rest volume of the element. The residual of the
/// statistics is the same over the whole body.
pub fn constraint_error(
    (effects, states): (&Effects, &EffectStates),
    topology: &Topology,
    particles: &Particles,
    h: f32,
    out: &mut Vec<f32>,
) {
    struct Errors<'a> {
        means: Means,
        topology: &'a Topology,
        particles: &'a Particles,
        states: &'a EffectStates,
        per_step: f64,
    }
    impl Visit for Errors<'_> {
        fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
            let multipliers = self
                .states
                .multipliers(E::KIND)
                .iter()
                .map(|&it| f64::from(it));
            let mut multipliers = multipliers.chain(std::iter::repeat(0.0));
            for (corners, rows) in effect.rows_of(self.topology, self.particles) {
                for (row, multiplier) in rows.iter().zip(&mut multipliers) {
                    if row.scale != 0.0 {
                        let force = multiplier * self.per_step;
                        let error = (row.error + row.compliance * force) / row.scale;
                        self.means.add(&corners, error * error, 1.0);
                    }
                }
            }
        }
    }
    let mut errors = Errors {
        means: Means::of(particles.len()),
        topology,
        particles,
        states,
        per_step: 1.0 / (f64::from(h) * f64::from(h)),
    };
    effects.visit(&mut errors);
    errors.means.write(out, f64::sqrt);
}

/// Force of ground and colliders on each particle in the last substep of `h` seconds [N]: the sum of
/// the magnitudes, friction included. Zero unless the states
/// [record contacts](EffectStates::records_contacts); forces of sticky ground are not known.
pub fn contact_force(particles: &Particles, states: &EffectStates, h: f32, out: &mut Vec<f32>) {
    let columns = [&states.others.ground, &states.others.collide];
    let force = |(i, x): (usize, &Vec4)| {
        if x.w == 0.0 {
            return 0.0;
        }
        let moved = columns.iter().filter_map(|column| column.get(i)).map(|it| {
            let (normal, friction) = (f64::from(it.normal), it.friction.as_dvec3());
            (normal * normal + friction.length_squared()).sqrt()
        });
        let h = f64::from(h);
        (moved.sum::<f64>() / (f64::from(x.w) * h * h)) as f32
    };
    out.clear();
    out.extend(particles.positions.iter().enumerate().map(force));
}

/// Three sides of a tetrahedron as columns.
fn sides([a, b, c, d]: [DVec3; 4]) -> DMat3 {
    DMat3::from_cols(b - a, c - a, d - a)
}

/// Smallest and largest singular value of a deformation gradient F; the smallest has the sign of
/// det F.
#[must_use]
pub fn principal_stretches(gradient: DMat3) -> (f64, f64) {
    let metric = gradient.transpose() * gradient;
    let [low, high] = eigenvalues(metric).map(|value| value.max(0.0).sqrt());
    (low.copysign(gradient.determinant()), high)
}

/// Smallest and largest stretch within a triangle.
fn planar_stretches(rest: [DVec3; 3], now: [DVec3; 3]) -> (f64, f64) {
    let (a, b) = (rest[1] - rest[0], rest[2] - rest[0]);
    let along = a.normalize();
    let across = b.reject_from_normalized(along);
    // Sides at rest in axes of the triangle: (p, 0) and (q, r).
    let (p, q, r) = (a.length(), b.dot(along), across.length());
    // Columns of the deformation gradient.
    let u = (now[1] - now[0]) / p;
    let v = ((now[2] - now[0]) - u * q) / r;
    let (uu, vv, uv) = (u.dot(u), v.dot(v), u.dot(v));
    let (mean, half) = ((uu + vv) / 2.0, (uu - vv) / 2.0);
    let radius = (half * half + uv * uv).sqrt();
    ((mean - radius).max(0.0).sqrt(), (mean + radius).sqrt())
}

/// Smallest and largest eigenvalue of a symmetric matrix, by Jacobi rotations.
fn eigenvalues(matrix: DMat3) -> [f64; 2] {
    let mut a = matrix.transpose().to_cols_array_2d();
    let size = a
        .as_flattened()
        .iter()
        .fold(0.0_f64, |most, x| most.max(x.abs()));
    // Smaller entries change no bit of an eigenvalue.
    let least = size * f64::EPSILON * f64::EPSILON;
    for _ in 0..16 {
        let mut done = true;
        for (p, q, r) in [(0, 1, 2), (0, 2, 1), (1, 2, 0)] {
            if a[p][q].abs() <= least {
                continue;
            }
            done = false;
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = 1.0_f64.copysign(theta) / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            let shift = t * a[p][q];
            a[p][p] -= shift;
            a[q][q] += shift;
            (a[p][q], a[q][p]) = (0.0, 0.0);
            let (x, y) = (a[r][p], a[r][q]);
            (a[r][p], a[r][q]) = (c * x - s * y, s * x + c * y);
            (a[p][r], a[q][r]) = (a[r][p], a[r][q]);
        }
        if done {
            break;
        }
    }
    let values = [a[0][0], a[1][1], a[2][2]];
    [
        values.into_iter().fold(f64::INFINITY, f64::min),
        values.into_iter().fold(f64::NEG_INFINITY, f64::max),
    ]
}
