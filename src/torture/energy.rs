//! The energy of a world, and when it is known.
//!
//! Edges and volumes of compliance α store ½C²/α. A rigid one stores nothing, or, violated, any
//! amount: it closes in the next substeps, and what it moves leaves as fast as they are short. So
//! where rigid constraints are violated at first, energy is held constant from when they have
//! closed.

use crate::solver::{
    Body, World,
    measure::{self, gravitational_energy, kinetic_energy},
};

/// Energies of a world [J].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Energy {
    /// ½mv² of all particles that can move.
    pub kinetic: f64,
    /// In gravity, from the origin.
    pub potential: f64,
    /// In constraints that are not rigid.
    pub elastic: f64,
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
        })
    }

    /// All of it.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.mechanical() + self.elastic
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

/// Root mean square of C over the rest value, of the constraints that are rigid.
#[must_use]
pub fn rigid_strain(world: &World) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for body in &world.bodies {
        let (edges, volumes) = super::watch::strains(body);
        let effects = &body.effects;
        let stretch = effects.stretch.is_some_and(|s| s.compliance_of(1.0) == 0.0);
        let volume = effects.volume.is_some_and(|v| v.compliance_of(1.0) == 0.0);
        for (rigid, strains) in [(stretch, edges), (volume, volumes)] {
            if rigid {
                count += strains.len();
                sum += strains.iter().map(|s| s * s).sum::<f64>();
            }
        }
    }
    (sum / count.max(1) as f64).sqrt()
}
