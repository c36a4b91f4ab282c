//! Figures about a body: energies, momentum, volume, residual. Sums are in f64 and in the order
//! of particles and constraints, so that they too are the same everywhere.

use super::{
    Particles, Topology,
    constraint::{
        stretch::Stretch,
        volume::{Volume, volume_and_gradients},
    },
};
use glam::{DVec3, Vec3, Vec4};

fn mass(x: &Vec4) -> f64 {
    if x.w > 0.0 { 1.0 / f64::from(x.w) } else { 0.0 }
}

fn sum_over(particles: &Particles, term: impl Fn(f64, DVec3, DVec3) -> f64) -> f64 {
    particles
        .positions
        .iter()
        .zip(&particles.velocities)
        .map(|(x, v)| term(mass(x), x.truncate().as_dvec3(), v.truncate().as_dvec3()))
        .sum()
}

/// Kinetic energy [J] of the particles that can move.
#[must_use]
pub fn kinetic_energy(particles: &Particles) -> f64 {
    sum_over(particles, |m, _, v| 0.5 * m * v.length_squared())
}

/// Potential energy in a uniform gravity [J], zero at the origin, of the particles that can move.
#[must_use]
pub fn gravitational_energy(particles: &Particles, gravity: Vec3) -> f64 {
    let gravity = gravity.as_dvec3();
    sum_over(particles, |m, x, _| -m * gravity.dot(x))
}

/// Linear momentum [kg·m/s].
#[must_use]
pub fn momentum(particles: &Particles) -> DVec3 {
    moments(particles, |m, _, v| v * m)
}

/// Angular momentum about the origin [kg·m²/s].
#[must_use]
pub fn angular_momentum(particles: &Particles) -> DVec3 {
    moments(particles, |m, x, v| x.cross(v) * m)
}

fn moments(particles: &Particles, term: impl Fn(f64, DVec3, DVec3) -> DVec3) -> DVec3 {
    particles
        .positions
        .iter()
        .zip(&particles.velocities)
        .fold(DVec3::ZERO, |sum, (x, v)| {
            sum + term(mass(x), x.truncate().as_dvec3(), v.truncate().as_dvec3())
        })
}

/// Centre of mass of the particles that can move [m]; the origin if none can.
#[must_use]
pub fn centre_of_mass(particles: &Particles) -> DVec3 {
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
    let sum: f64 = particles
        .velocities
        .iter()
        .map(|v| v.truncate().as_dvec3().length_squared())
        .sum();
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
        super::topology::volume(corners.map(|i| positions[i as usize].truncate().as_dvec3()))
    })
}

/// Volume of the body over its rest volume, less 1; 0 for a body without tetrahedra.
#[must_use]
pub fn volume_error(topology: &Topology, positions: &[Vec4]) -> f64 {
    let rest: f64 = topology
        .tetrahedra
        .rest_volume
        .iter()
        .map(|&v| f64::from(v))
        .sum();
    if rest == 0.0 {
        return 0.0;
    }
    tetrahedron_volumes(topology, positions).sum::<f64>() / rest - 1.0
}

/// How many tetrahedra are turned inside out.
#[must_use]
pub fn inverted(topology: &Topology, positions: &[Vec4]) -> usize {
    topology
        .tetrahedra
        .corners()
        .zip(&topology.tetrahedra.rest_volume)
        .filter(|&(corners, &rest)| {
            let x = corners.map(|i| positions[i as usize].truncate());
            volume_and_gradients(x).0 * rest <= 0.0
        })
        .count()
}

/// Elastic energy ½C²/α of the edges [J]; rigid ones store none.
#[must_use]
pub fn stretch_energy(topology: &Topology, positions: &[Vec4], stretch: &Stretch) -> f64 {
    edge_errors(topology, positions)
        .zip(&topology.edges.rest_length)
        .map(|(error, &rest)| stored(error, stretch.compliance_of(rest)))
        .sum()
}

/// Elastic energy ½C²/α of the tetrahedra's volumes [J]; rigid ones store none.
#[must_use]
pub fn volume_energy(topology: &Topology, positions: &[Vec4], volume: &Volume) -> f64 {
    tetrahedron_volumes(topology, positions)
        .zip(&topology.tetrahedra.rest_volume)
        .map(|(now, &rest)| stored(now - f64::from(rest), volume.compliance_of(rest)))
        .sum()
}

fn stored(error: f64, compliance: f64) -> f64 {
    if compliance > 0.0 {
        0.5 * error * error / compliance
    } else {
        0.0
    }
}

/// A sum of squares with its count, to take the root mean square over several effects.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SquareSum {
    /// Σ x².
    pub sum: f64,
    /// How many.
    pub count: usize,
}

impl SquareSum {
    /// Adds another.
    pub fn add(&mut self, other: Self) {
        self.sum += other.sum;
        self.count += other.count;
    }

    /// Root mean square; 0 for nothing.
    #[must_use]
    pub fn rms(&self) -> f64 {
        (self.sum / self.count.max(1) as f64).sqrt()
    }
}

/// What is left of the edges' equations C + αλ/h² = 0, over the rest length of each.
#[must_use]
pub fn stretch_residual(
    topology: &Topology,
    positions: &[Vec4],
    stretch: &Stretch,
    multipliers: &[f32],
    h: f32,
) -> SquareSum {
    let terms = edge_errors(topology, positions)
        .zip(&topology.edges.rest_length)
        .zip(multipliers)
        .map(|((error, &rest), &lambda)| {
            let force = f64::from(lambda) / (f64::from(h) * f64::from(h));
            (error + stretch.compliance_of(rest) * force, f64::from(rest))
        });
    relative(terms)
}

/// What is left of the volumes' equations C + αλ/h² = 0, over the rest volume of each.
#[must_use]
pub fn volume_residual(
    topology: &Topology,
    positions: &[Vec4],
    volume: &Volume,
    multipliers: &[f32],
    h: f32,
) -> SquareSum {
    let terms = tetrahedron_volumes(topology, positions)
        .zip(&topology.tetrahedra.rest_volume)
        .zip(multipliers)
        .map(|((now, &rest), &lambda)| {
            let pressure = f64::from(lambda) / (f64::from(h) * f64::from(h));
            let rest_volume = f64::from(rest);
            (
                now - rest_volume + volume.compliance_of(rest) * pressure,
                rest_volume,
            )
        });
    relative(terms)
}

fn relative(terms: impl Iterator<Item = (f64, f64)>) -> SquareSum {
    terms
        .filter(|&(_, rest)| rest != 0.0)
        .fold(SquareSum::default(), |mut all, (error, rest)| {
            let share = error / rest;
            all.sum += share * share;
            all.count += 1;
            all
        })
}

/// Root mean square distance of the particles to the rest shape after the best rigid fit, over
/// the body's size.
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
    let rotation = super::fit::rotation_between(
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

/// Hash of the bits of positions and velocities: equal states have equal hashes.
#[must_use]
pub fn state_hash<'a>(bodies: impl Iterator<Item = &'a Particles>) -> u64 {
    let mut hash = FNV_START;
    for particles in bodies {
        for element in particles.positions.iter().chain(&particles.velocities) {
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

const FNV_START: u64 = 0xcbf2_9ce4_8422_2325;

fn fnv1a_on(hash: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(hash, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
    })
}
