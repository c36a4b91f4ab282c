//! Measurements of a body: energies, momentum, volume, residual. Sums are in f64 and in the order
//! of particles and constraints, so that they are identical on every machine.

pub use crate::kernel::sum::SquareSum;

use crate::{
    BodyEffectKind, EffectStates, Effects, Particles, Topology,
    effects::{
        body_effect::{Store, spring_energy},
        body_kinds::BodyEffectStates,
    },
    elastic::{Elastic, Visit},
    kernel::geometry::volume_and_gradients,
};
use glam::{DVec3, Vec3, Vec4};

fn mass(x: &Vec4) -> f64 {
    if x.w > 0.0 { 1.0 / f64::from(x.w) } else { 0.0 }
}

/// Mass [kg], position [m] and velocity [m/s] of each particle, mapped to a term.
fn terms<T>(
    particles: &Particles,
    term: impl Fn(f64, DVec3, DVec3) -> T,
) -> impl Iterator<Item = T> {
    (0..particles.len()).map(move |i| {
        let mass = mass(&particles.positions[i]);
        term(mass, particles.position(i), particles.velocity_f64(i))
    })
}

/// Kinetic energy [J] of the particles that can move, with that of [rotating](rotational_energy)
/// grains.
#[must_use]
pub fn kinetic_energy(particles: &Particles) -> f64 {
    let moving: f64 = terms(particles, |m, _, v| 0.5 * m * v.length_squared()).sum();
    moving + rotational_energy(particles)
}

/// Mass [kg], and radius times angular velocity [m/s] with the radius [m], of grains that rotate.
fn spinning(particles: &Particles) -> impl Iterator<Item = (f64, DVec3, f64)> {
    let grains = particles.positions.iter().zip(&particles.spins);
    grains.map(|(x, spin)| (mass(x), spin.truncate().as_dvec3(), spin.w.into()))
}

/// Energy of the rotation of grains [J], balls with I = ⅖mr².
#[must_use]
pub fn rotational_energy(particles: &Particles) -> f64 {
    let grains = spinning(particles);
    grains
        .map(|(m, spin, _)| 0.2 * m * spin.length_squared())
        .sum()
}

/// Potential energy in a uniform gravity [J], zero at the origin, of the particles that can move.
#[must_use]
pub fn gravitational_energy(particles: &Particles, gravity: Vec3) -> f64 {
    let gravity = gravity.as_dvec3();
    terms(particles, |m, x, _| -m * gravity.dot(x)).sum()
}

/// Linear momentum [kg·m/s].
#[must_use]
pub fn momentum(particles: &Particles) -> DVec3 {
    moments(particles, |m, _, v| v * m)
}

/// Angular momentum about the origin [kg·m²/s].
#[must_use]
pub fn angular_momentum(particles: &Particles) -> DVec3 {
    let grains = spinning(particles).map(|(m, spin, radius)| spin * (0.4 * m * radius));
    moments(particles, |m, x, v| x.cross(v) * m) + grains.sum::<DVec3>()
}

fn moments(particles: &Particles, term: impl Fn(f64, DVec3, DVec3) -> DVec3) -> DVec3 {
    terms(particles, term).fold(DVec3::ZERO, |sum, moment| sum + moment)
}

/// Center of mass of the particles that can move [m]; the origin if none can.
#[must_use]
pub fn center_of_mass(particles: &Particles) -> DVec3 {
    let total: f64 = particles.positions.iter().map(mass).sum();
    if total > 0.0 {
        moments(particles, |m, x, _| x * m) / total
    } else {
        DVec3::ZERO
    }
}

/// Root mean square speed [m/s].
#[must_use]
pub fn rms_speed(particles: &Particles) -> f64 {
    let sum: f64 = terms(particles, |_, _, v| v.length_squared()).sum();
    (sum / particles.len().max(1) as f64).sqrt()
}

/// C of every edge [m], in the order of the topology.
pub fn edge_errors(topology: &Topology, positions: &[Vec4]) -> impl Iterator<Item = f64> {
    let edges = &topology.edges;
    edges
        .ends()
        .zip(&edges.rest_length)
        .map(move |(ends, &rest)| {
            let [a, b] = ends.map(|i| positions[i as usize].truncate().as_dvec3());
            a.distance(b) - f64::from(rest)
        })
}

/// Signed volume of every tetrahedron [m³], in the order of the topology.
pub fn tetrahedron_volumes(topology: &Topology, positions: &[Vec4]) -> impl Iterator<Item = f64> {
    topology.tetrahedra.corners().map(move |corners| {
        crate::topology::volume(corners.map(|i| positions[i as usize].truncate().as_dvec3()))
    })
}

/// Relative change of the volume of the body from its rest volume: of its tetrahedra, or of the
/// enclosed volume if it has none; 0 if the rest volume is 0.
#[must_use]
pub fn volume_error(topology: &Topology, positions: &[Vec4]) -> f64 {
    let rest: f64 = topology
        .tetrahedra
        .rest_volume
        .iter()
        .map(|&v| f64::from(v))
        .sum();
    if rest == 0.0 {
        let at = |i: u32| positions[i as usize].truncate().as_dvec3();
        return topology.enclosure().map_or(0.0, |enclosure| {
            enclosure.volume(topology, at) / enclosure.rest_volume - 1.0
        });
    }
    tetrahedron_volumes(topology, positions).sum::<f64>() / rest - 1.0
}

/// Corners of the inverted tetrahedra: those whose signed volume is zero or has another sign than at
/// rest.
pub fn inverted_elements(
    topology: &Topology,
    positions: &[Vec4],
) -> impl Iterator<Item = [u32; 4]> {
    topology
        .tetrahedra
        .corners()
        .zip(&topology.tetrahedra.rest_volume)
        .filter(|&(corners, &rest)| {
            let x = corners.map(|i| positions[i as usize].truncate());
            volume_and_gradients(x).0 * rest <= 0.0
        })
        .map(|(corners, _)| corners)
}

/// Number of inverted tetrahedra.
#[must_use]
pub fn inverted(topology: &Topology, positions: &[Vec4]) -> usize {
    inverted_elements(topology, positions).count()
}

/// Elastic energy ½C²/α of the constraints of an effect [J]; rigid ones store none.
#[must_use]
pub fn elastic_energy<const N: usize, const M: usize>(
    effect: &impl Elastic<N, M>,
    topology: &Topology,
    particles: &Particles,
) -> f64 {
    let rows = effect.rows_of(topology, particles);
    rows.flat_map(|(_, rows)| rows)
        .map(|row| spring_energy(row.error, row.compliance))
        .sum()
}

/// Energy of all elastic effects of a body [J], with its particles `at` positions in m and inverse
/// masses in 1/kg. The segments of a rod are not known here: they are turned as fits the positions
/// best, which is not how they are turned where the rod has a twist at rest.
#[must_use]
pub fn elastic_energies(
    effects: &Effects,
    topology: &Topology,
    at: impl Fn(u32) -> (DVec3, f64),
) -> f64 {
    struct Sum<'a, F>(f64, &'a Topology, F);
    impl<F: Fn(u32) -> (DVec3, f64)> Visit for Sum<'_, F> {
        fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
            let elements = effect.all_rows(self.1, &self.2);
            let rows = elements.flat_map(|(_, rows)| rows);
            self.0 += rows
                .map(|row| spring_energy(row.error, row.compliance))
                .sum::<f64>();
        }
    }
    let mut sum = Sum(0.0, topology, at);
    effects.visit(&mut sum);
    let Sum(mut all, _, at) = sum;
    let mut store = |store: Store| all += store.energy();
    let states = BodyEffectStates::default();
    for &kind in BodyEffectKind::ALL {
        states.stores((effects, kind), topology, &at, &mut store);
    }
    all
}

/// Energy stored by an effect without elements [J].
#[must_use]
pub fn body_effect_energy(
    (effects, kind): (&Effects, BodyEffectKind),
    topology: &Topology,
    (particles, states): (&Particles, &EffectStates),
) -> f64 {
    let at = |i: u32| {
        let i = i as usize;
        (particles.position(i), particles.positions[i].w.into())
    };
    let mut all = 0.0;
    let mut store = |store: Store| all += store.energy();
    states
        .others
        .stores((effects, kind), topology, &at, &mut store);
    all
}

/// Residual of the equations C + αλ/h² = 0 of an effect, each relative to its scale (rest length of
/// an edge, rest volume of a tetrahedron).
#[must_use]
pub fn residual<const N: usize, const M: usize>(
    effect: &impl Elastic<N, M>,
    topology: &Topology,
    particles: &Particles,
    multipliers: &[f32],
    h: f32,
) -> SquareSum {
    let per_step = 1.0 / (f64::from(h) * f64::from(h));
    let rows = effect.rows_of(topology, particles);
    rows.flat_map(|(_, rows)| rows)
        .zip(multipliers)
        .filter(|(row, _)| row.scale != 0.0)
        .fold(SquareSum::default(), |mut all, (row, &lambda)| {
            let force = f64::from(lambda) * per_step;
            let relative = (row.error + row.compliance * force) / row.scale;
            all.sum += relative * relative;
            all.count += 1;
            all
        })
}

/// Figures of the constraints of an elastic effect after a substep.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct ElementFigures {
    /// Elastic energy ½C²/α of the requested material at the current strain [J].
    pub energy: f64,
    /// The part of the energy that the solver does not hold [J], from 0 to `energy`.
    ///
    /// Where iterations have not converged, the constraints act like springs of the
    /// [effective compliance](crate::effective) e/F, with F = −λ/h² the true force and
    /// e = C + τ ∇C·v the strain with damping. At a strain C these hold ½C²/(e/F). Over all
    /// constraints, ½(ΣCF)²/ΣeF: the same for one of them, half of the work ΣCF of the load at
    /// rest, and not more than `energy`.
    pub unresolved: f64,
    /// See [`residual`].
    pub residual: SquareSum,
}

/// Figures of an elastic effect after a substep of `h` seconds with these multipliers; all energy
/// counts as resolved where they were not kept.
#[must_use]
pub fn element_figures<const N: usize, const M: usize>(
    effect: &impl Elastic<N, M>,
    topology: &Topology,
    particles: &Particles,
    multipliers: &[f32],
    h: f32,
) -> ElementFigures {
    let mut all = ElementFigures::default();
    let per_step = 1.0 / (f64::from(h) * f64::from(h));
    let tau = f64::from(effect.damping().get());
    // ΣCF and ΣeF [J].
    let (mut work, mut damped_work) = (0.0, 0.0);
    let mut multipliers = multipliers.iter();
    let rows = effect.rows_of(topology, particles);
    for (corners, row) in rows.flat_map(|(corners, rows)| rows.map(|row| (corners, row))) {
        let energy = spring_energy(row.error, row.compliance);
        all.energy += energy;
        let Some(&lambda) = multipliers.next() else {
            continue;
        };
        let force = -f64::from(lambda) * per_step;
        if row.scale != 0.0 {
            let relative = (row.error - row.compliance * force) / row.scale;
            all.residual.sum += relative * relative;
            all.residual.count += 1;
        }
        if row.compliance > 0.0 {
            let ends = row.gradients.iter().zip(corners);
            let speed =
                |(gradient, i): (&DVec3, u32)| gradient.dot(particles.velocity_f64(i as usize));
            let damped = match tau > 0.0 {
                true => tau * ends.map(speed).sum::<f64>(),
                false => 0.0,
            };
            work += row.error * force;
            damped_work += (row.error + damped) * force;
        }
    }
    if damped_work > 0.0 {
        let held = 0.5 * work * work / damped_work;
        all.unresolved = (all.energy - held).max(0.0);
    }
    all
}

/// Residual of the equations of all elastic effects of a body, see [`residual`].
#[must_use]
pub fn residuals(
    effects: &Effects,
    topology: &Topology,
    particles: &Particles,
    states: &EffectStates,
    h: f32,
) -> SquareSum {
    struct Sum<'a> {
        all: SquareSum,
        topology: &'a Topology,
        particles: &'a Particles,
        states: &'a EffectStates,
        h: f32,
    }
    impl Visit for Sum<'_> {
        fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
            let lambda = self.states.multipliers(E::KIND);
            let own = residual(effect, self.topology, self.particles, lambda, self.h);
            self.all.add(own);
        }
    }
    let mut sum = Sum {
        all: SquareSum::default(),
        topology,
        particles,
        states,
        h,
    };
    effects.visit(&mut sum);
    for &kind in BodyEffectKind::ALL {
        let own = states
            .others
            .residual((effects, kind), topology, particles, h.into());
        sum.all.add(own);
    }
    sum.all
}

/// Root mean square distance of the particles from the best rigid fit of the rest shape, relative
/// to the size of the body.
#[must_use]
pub fn shape_error(topology: &Topology, positions: &[Vec4]) -> f64 {
    let count = topology.rest.len() as f64;
    let mean = |points: &mut dyn Iterator<Item = DVec3>| {
        points.fold(DVec3::ZERO, |sum, x| sum + x) / count
    };
    let rest: Vec<DVec3> = topology.rest.iter().map(|x| x.as_dvec3()).collect();
    let now: Vec<DVec3> = positions.iter().map(|x| x.truncate().as_dvec3()).collect();
    let rest_mean = mean(&mut rest.iter().copied());
    let now_mean = mean(&mut now.iter().copied());
    let rotation = crate::fit::rotation_between(
        rest.iter().map(|&x| x - rest_mean),
        now.iter().map(|&x| x - now_mean),
    );
    let sum: f64 = rest
        .iter()
        .zip(&now)
        .map(|(&r, &x)| (rotation * (r - rest_mean)).distance_squared(x - now_mean))
        .sum();
    (sum / count).sqrt() / f64::from(topology.size)
}

/// Hash of the bits of positions, displacements and carries: equal states have equal hashes.
#[must_use]
pub fn state_hash<'a>(bodies: impl Iterator<Item = &'a Particles>) -> u64 {
    let mut hash = FNV_START;
    for particles in bodies {
        for element in particles
            .columns()
            .into_iter()
            .flat_map(|(_, column)| column)
        {
            for number in element.to_array() {
                hash = fnv1a_on(hash, &number.to_bits().to_le_bytes());
            }
        }
    }
    hash
}

/// The FNV-1a hash of some bytes, the same on every machine.
#[must_use]
pub fn fnv1a(bytes: &[u8]) -> u64 {
    fnv1a_on(FNV_START, bytes)
}

pub(crate) const FNV_START: u64 = 0xcbf2_9ce4_8422_2325;

pub(crate) fn fnv1a_on(hash: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(hash, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
    })
}
