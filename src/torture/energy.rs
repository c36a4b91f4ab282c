//! The energy of a world, and when it is known.
//!
//! Edges and volumes of compliance α store ½C²/α. A rigid one stores nothing, or, violated, any
//! amount: it closes in the next substep h, and what it moves leaves with ½C²/(h² Σw‖∇C‖²). So where
//! rigid constraints are violated at first, energy is [known](Energy::is_known) from when that is
//! little.

use crate::solver::{
    Body, World,
    constraint::volume::volume_and_gradients,
    measure::{self, gravitational_energy, kinetic_energy},
};

/// Below this share of |V₀|^(4/3) the solver does not let a squared gradient of a volume count.
const FLOOR: f64 = 0.01;

/// Energies of a world [J].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Energy {
    /// ½mv² of all particles that can move.
    pub kinetic: f64,
    /// In gravity, from the origin.
    pub potential: f64,
    /// In constraints that are not rigid.
    pub elastic: f64,
    /// What rigid constraints give when they close in the next substep.
    pub closing: f64,
}

impl Energy {
    /// Of all bodies that are stepped.
    #[must_use]
    pub fn of(world: &World) -> Self {
        let bodies = world.bodies.iter().filter(|body| body.quarantine.is_none());
        bodies.fold(Self::default(), |sum, body| Self {
            kinetic: sum.kinetic + kinetic_energy(&body.particles),
            potential: sum.potential
                + gravitational_energy(&body.particles, world.settings.gravity),
            elastic: sum.elastic + elastic(body),
            closing: sum.closing + closing(body, world.settings.substep_seconds()),
        })
    }

    /// Whether what rigid constraints may still give is below a thousandth of what moves: a tenth of
    /// what may be gained, as several that close together give more than each alone.
    #[must_use]
    pub fn is_known(&self) -> bool {
        self.closing <= 1e-3 * (self.kinetic + self.elastic)
    }

    /// All of it.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.mechanical() + self.elastic + self.closing
    }

    /// What is not in constraints. A solver that has not converged leaves constraints longer than
    /// their forces make them, by a multiple of what they would store, so only this is known at any
    /// time; and it may never be more than all was at first.
    #[must_use]
    pub fn mechanical(&self) -> f64 {
        self.kinetic + self.potential
    }
}

fn elastic(body: &Body) -> f64 {
    let (topology, x) = (&body.topology, &body.particles.positions);
    let stretch = body.effects.stretch.as_ref();
    let volume = body.effects.volume.as_ref();
    stretch.map_or(0.0, |stretch| measure::stretch_energy(topology, x, stretch))
        + volume.map_or(0.0, |volume| measure::volume_energy(topology, x, volume))
}

fn closing(body: &Body, h: f64) -> f64 {
    let (topology, x) = (&body.topology, &body.particles.positions);
    let of = |error: f64, weight: f64| match weight > 0.0 {
        true => 0.5 * error * error / (h * h * weight),
        false => 0.0,
    };
    let mut energy = 0.0;
    if is_rigid_stretch(body) {
        for (ends, error) in topology.edges.ends().zip(measure::edge_errors(topology, x)) {
            energy += of(error, ends.map(|i| f64::from(x[i as usize].w)).iter().sum());
        }
    }
    if is_rigid_volume(body) {
        let tetrahedra = &topology.tetrahedra;
        let rest = tetrahedra
            .rest_volume
            .iter()
            .zip(&tetrahedra.gradient_scale);
        for (corners, (&rest, &scale)) in tetrahedra.corners().zip(rest) {
            let corners = corners.map(|i| x[i as usize]);
            let (now, gradients) = volume_and_gradients(corners.map(|x| x.truncate()));
            let terms = corners.iter().zip(gradients);
            let weight: f64 = terms
                .map(|(x, g)| f64::from(x.w) * f64::from(g.length_squared()))
                .sum();
            let masses: f64 = corners.iter().map(|x| f64::from(x.w)).sum();
            let floor = FLOOR * f64::from(scale) * masses;
            energy += of(f64::from(now) - f64::from(rest), weight.max(floor));
        }
    }
    energy
}

fn is_rigid_stretch(body: &Body) -> bool {
    let stretch = body.effects.stretch;
    stretch.is_some_and(|stretch| stretch.compliance_of(1.0) == 0.0)
}

fn is_rigid_volume(body: &Body) -> bool {
    let volume = body.effects.volume;
    volume.is_some_and(|volume| volume.compliance_of(1.0) == 0.0)
}
