//! The energy of a world as a solver with steps of a given length can know it.
//!
//! A rigid constraint stores no energy, or any amount: violated by C it closes in the next substep
//! h, and what it moves leaves with the kinetic energy ½C²/(h² Σw‖∇C‖²). So a constraint of
//! compliance α counts with ½C²/(α + h² Σw‖∇C‖²): the usual ½C²/α where α is soft for the step, and
//! what closing it gives where it is rigid. A body in a hard case begins with that much, and must
//! never have more.

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
    /// In constraints.
    pub elastic: f64,
}

impl Energy {
    /// Of all bodies that are stepped.
    #[must_use]
    pub fn of(world: &World) -> Self {
        let h = world.settings.substep_seconds();
        let bodies = world.bodies.iter().filter(|body| body.quarantine.is_none());
        bodies.fold(Self::default(), |sum, body| Self {
            kinetic: sum.kinetic + kinetic_energy(&body.particles),
            potential: sum.potential
                + gravitational_energy(&body.particles, world.settings.gravity),
            elastic: sum.elastic + elastic(body, h),
        })
    }

    /// All of it.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.kinetic + self.potential + self.elastic
    }
}

fn elastic(body: &Body, h: f64) -> f64 {
    let (topology, x) = (&body.topology, &body.particles.positions);
    let mut energy = 0.0;
    let mut add = |error: f64, compliance: f64, weight: f64| {
        let give = compliance + h * h * weight;
        if give > 0.0 {
            energy += 0.5 * error * error / give;
        }
    };
    if let Some(stretch) = &body.effects.stretch {
        let edges = topology.edges.ends().zip(&topology.edges.rest_length);
        let errors = measure::edge_errors(topology, x);
        for ((ends, &rest), error) in edges.zip(errors) {
            let weight = ends.map(|i| f64::from(x[i as usize].w)).iter().sum();
            add(error, stretch.compliance_of(rest), weight);
        }
    }
    if let Some(volume) = &body.effects.volume {
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
            let error = f64::from(now) - f64::from(rest);
            add(error, volume.compliance_of(rest), weight.max(floor));
        }
    }
    energy
}
