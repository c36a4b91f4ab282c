//! The energy of a world, and when it is known.
//!
//! Edges and volumes of compliance α store ½C²/α. A violated rigid constraint has no defined
//! energy: it closes in the next substep h, and its particles gain ½C²/(h² Σw‖∇C‖²). If rigid
//! constraints are violated at the start, energy is therefore [known](Energy::is_known) only after
//! this closing energy has become small.

use crate::solver::{
    Body, ShapeMatching, ShapeMatchingState, World,
    effects::{
        MatchedParticle,
        elastic::{Elastic, Visit},
    },
    measure::{self, gravitational_energy, kinetic_energy},
};
use glam::DVec3;

/// Energies of a world [J].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[non_exhaustive]
pub struct Energy {
    /// ½mv² of all particles that can move.
    pub kinetic: f64,
    /// Gravitational energy, relative to the origin.
    pub potential: f64,
    /// Elastic energy of constraints that are not rigid.
    pub elastic: f64,
    /// Closing energy: the kinetic energy that violated rigid constraints produce when they close
    /// in the next substep.
    pub closing: f64,
}

impl Energy {
    /// Sum over all bodies that are stepped.
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

    /// Whether the closing energy of rigid constraints is below a thousandth of the kinetic and
    /// elastic energy. That is a tenth of the accepted gain, because several constraints that close
    /// together can produce more than the sum of each alone.
    #[must_use]
    pub fn is_known(&self) -> bool {
        self.closing <= 1e-3 * (self.kinetic + self.elastic)
    }

    /// Sum of all energies.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.mechanical() + self.elastic + self.closing
    }

    /// Energy outside constraints. An unconverged solver leaves constraints longer than their
    /// forces would make them, with a multiple of the energy that they would store, so only this
    /// part is known at any time; it must never exceed the total initial energy.
    #[must_use]
    pub fn mechanical(&self) -> f64 {
        self.kinetic + self.potential
    }
}

fn elastic(body: &Body) -> f64 {
    let particles = &body.particles;
    let at = |i: u32| {
        let i = i as usize;
        (particles.position(i), particles.positions[i].w.into())
    };
    measure::elastic_energies(&body.effects, &body.topology, at)
}

/// Sums the closing energy of rigid constraints.
struct Closing<'a> {
    body: &'a Body,
    h: f64,
    energy: f64,
}

impl Visit for Closing<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        if !effect.is_rigid() {
            return;
        }
        let positions = &self.body.particles.positions;
        let rows = effect.rows_of(&self.body.topology, &self.body.particles);
        for (corners, row) in rows.flat_map(|(corners, rows)| rows.map(|row| (corners, row))) {
            let terms = corners.iter().zip(row.gradients);
            let weight: f64 = terms
                .map(|(&i, g)| f64::from(positions[i as usize].w) * g.length_squared())
                .sum();
            let weight = weight.max(row.least);
            if weight > 0.0 {
                self.energy += 0.5 * row.error * row.error / (self.h * self.h * weight);
            }
        }
    }
}

fn closing(body: &Body, h: f64) -> f64 {
    let mut closing = Closing {
        body,
        h,
        energy: 0.0,
    };
    body.effects.visit(&mut closing);
    closing.energy + closing_volume(body, h) + closing_shapes(body, h)
}

/// Closing energy of rigid shape-matching regions: Σ w‖∇D‖² is 1.
fn closing_shapes(body: &Body, h: f64) -> f64 {
    let rigid = |effect: &ShapeMatching| effect.compliance() == 0.0;
    let Some(effect) = body.effects.shape_matching.filter(rigid) else {
        return 0.0;
    };
    let matching = ShapeMatchingState::of(&body.topology, &effect);
    let at = MatchedParticle::among(&body.particles);
    let squares = matching
        .strains(&body.topology, at)
        .map(|strain| strain * strain);
    0.5 * squares.sum::<f64>() / (h * h)
}

/// Closing energy of an incompressible filling.
fn closing_volume(body: &Body, h: f64) -> f64 {
    let (Some(pressure), Ok(enclosure)) = (&body.effects.pressure, body.topology.enclosure())
    else {
        return 0.0;
    };
    if pressure.bulk_modulus.get().is_finite() {
        return 0.0;
    }
    let positions = &body.particles.positions;
    let mut gradients = vec![DVec3::ZERO; positions.len()];
    let at = |i: u32| body.particles.position(i as usize);
    let volume = enclosure.volume_and_gradients(&body.topology, at, &mut gradients);
    let error = volume - pressure.own_volume(enclosure);
    let weight = enclosure.weight(&gradients, |i| f64::from(positions[i].w));
    if weight > 0.0 {
        0.5 * error * error / (h * h * weight)
    } else {
        0.0
    }
}
