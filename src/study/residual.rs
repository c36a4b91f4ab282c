//! The residuals of the two equations that a substep solves.
//!
//! An implicit step requires C + αλ/h² = 0 for every constraint and M(x − x̃) = Σ∇C λ for every
//! particle, where x̃ is the predicted position (XPBD, equations 8 and 9). The iterations of
//! position-based dynamics satisfy the second nearly, except for the rotation of gradients, and
//! leave a residual in the first; in f32, rounding violates the second by m ε‖x‖/h².

use crate::solver::{
    Body, Rate, Substeps, World,
    effects::{
        MatchedParticle,
        elastic::{Elastic, Visit},
    },
    measure::{self, SquareSum},
};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Residuals of a substep.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Residuals {
    /// Primal: root mean square of C + αλ/h² over rest lengths and volumes.
    #[serde(deserialize_with = "super::nan::number")]
    pub primal: f64,
    /// Dual: residual M(x − x̃)/h² − Σ∇C λ/h² relative to M(x − x̃)/h²; none where contacts or
    /// grabs act as well, and where no constraint acts.
    pub dual: Option<f64>,
}

/// Takes one additional substep and measures it; `None` if that requires settings out of their
/// range.
#[must_use]
pub fn residuals(world: &World) -> Option<Residuals> {
    let mut world = world.clone();
    let h = world.settings.substep_seconds();
    world.settings.rate = Rate::new(1.0 / h).ok()?;
    world.settings.substeps = Substeps::new(1).ok()?;
    let gravity = world.settings.gravity.as_dvec3();
    let alone: Vec<Vec<DVec3>> = world
        .bodies
        .iter()
        .map(|body| {
            let particles = &body.particles;
            let all = 0..particles.len();
            all.map(|i| particles.position(i) + (particles.velocity_f64(i) + gravity * h) * h)
                .collect()
        })
        .collect();
    world.tick();
    let (mut primal, mut left, mut pulled) = (SquareSum::default(), 0.0, 0.0);
    for (body, alone) in world.bodies.iter().zip(&alone) {
        primal.add(primal_of(body, h as f32));
        let (l, p) = dual_of(body, alone);
        left += l;
        pulled += p;
    }
    let touched = world.bodies.iter().any(|body| {
        let effects = &body.effects;
        effects.ground.is_some()
            || effects.sticky_ground.is_some()
            || effects.collide.is_some()
            || effects.tethers.is_some()
            || effects.grab.is_some()
    });
    let dual = (!touched && pulled > 0.0).then(|| (left / pulled).sqrt());
    Some(Residuals {
        primal: primal.rms(),
        dual,
    })
}

fn primal_of(body: &Body, h: f32) -> SquareSum {
    let particles = &body.particles;
    measure::residuals(&body.effects, &body.topology, particles, &body.states, h)
}

/// Sums ∇C λ over the constraints of all effects.
struct Pull<'a>(&'a Body, Vec<DVec3>);

impl Visit for Pull<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        let Self(body, forces) = self;
        let elements = effect.rows_of(&body.topology, &body.particles);
        let lambdas = body.states.multipliers(E::KIND).chunks_exact(M);
        for ((corners, rows), lambdas) in elements.zip(lambdas) {
            for (row, &lambda) in rows.iter().zip(lambdas) {
                for (i, gradient) in corners.into_iter().zip(row.gradients) {
                    forces[i as usize] += gradient * f64::from(lambda);
                }
            }
        }
    }
}

/// Sums of squares over particles: of the residual, and of M(x − x̃).
fn dual_of(body: &Body, alone: &[DVec3]) -> (f64, f64) {
    let positions = &body.particles.positions;
    let mut pull = Pull(body, vec![DVec3::ZERO; positions.len()]);
    body.effects.visit(&mut pull);
    let mut forces = pull.1;
    if let (Some(_), Ok(enclosure)) = (body.effects.pressure, body.topology.enclosure()) {
        let mut gradients = vec![DVec3::ZERO; positions.len()];
        let at = |i: u32| body.particles.position(i as usize);
        enclosure.volume_and_gradients(&body.topology, at, &mut gradients);
        for (force, gradient) in forces.iter_mut().zip(gradients) {
            *force += gradient * body.states.others.pressure.multiplier;
        }
    }
    if let (Some(_), Some(rod)) = (body.effects.rod, &body.states.others.rod) {
        for (i, pull) in rod.pulls() {
            forces[i as usize] += pull;
        }
    }
    let matching = body.states.others.shape_matching.clone();
    if let (Some(_), Some(mut matching)) = (body.effects.shape_matching, matching) {
        let moves = matching.pull(&body.topology, MatchedParticle::among(&body.particles));
        for ((force, by), x) in forces.iter_mut().zip(moves).zip(positions) {
            if x.w > 0.0 {
                *force += *by / f64::from(x.w);
            }
        }
    }
    let (mut left, mut pulled) = (0.0, 0.0);
    for ((x, alone), force) in positions.iter().zip(alone).zip(&forces) {
        if x.w > 0.0 {
            let inertia = (x.truncate().as_dvec3() - *alone) / f64::from(x.w);
            left += (inertia - *force).length_squared();
            pulled += inertia.length_squared();
        }
    }
    (left, pulled)
}
