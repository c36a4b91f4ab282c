//! A problem as a body of Pliant: its masses, and the f64 answer.

use super::{
    error::Measure,
    problems::{Elasticity, Problem, Volumes},
};
use crate::peer::PeerError;
use glam::DVec3;
use pliant::solver::{
    Body, Compliance, Density, Effects, Mass, NeoHookean, PoissonRatio, Settings, Stiffness,
    Stretch, Topology, VertexIndex, Volume, YoungsModulus, equilibrium,
};
use std::{fmt::Display, sync::Arc};

/// The state of rest of a problem in f64.
#[derive(Debug, Clone)]
pub struct Answer {
    /// Positions of the particles [m], in the order of the mesh.
    pub positions: Vec<DVec3>,
    /// Residual force over applied force.
    pub residual: f64,
    /// Error of this answer, estimated from a further Newton step, and from softer volumes where
    /// they are rigid.
    pub uncertainty: f64,
}

/// Wraps the reason why a problem cannot be built.
pub fn refused(problem: &Problem, reason: &dyn Display) -> PeerError {
    PeerError::Scene {
        scene: problem.name,
        reason: reason.to_string(),
    }
}

/// The body of a problem in its rest shape, with its pins, masses and elastic effects.
///
/// # Errors
/// [`PeerError::Scene`] for a mesh or a value that Pliant refuses.
pub fn body(problem: &Problem) -> Result<Body, PeerError> {
    let refuse = |reason: &dyn Display| refused(problem, reason);
    let topology = Topology::new(problem.shape.clone()).map_err(|error| refuse(&error))?;
    let density = Density::new(problem.density).map_err(|error| refuse(&error))?;
    let mut body = Body::new(problem.name, Arc::new(topology), density);
    body.pins = problem.pins.iter().copied().map(VertexIndex).collect();
    for &(particle, mass) in &problem.added {
        let mass = Mass::new(mass).map_err(|error| refuse(&error))?;
        body.added_mass.push((VertexIndex(particle), mass));
    }
    body.update_masses();
    body.effects = effects(problem)?;
    Ok(body)
}

fn effects(problem: &Problem) -> Result<Effects, PeerError> {
    let refuse = |reason: &dyn Display| refused(problem, reason);
    let mut effects = Effects::default();
    match problem.elasticity {
        Elasticity::Springs {
            compliance,
            volumes,
        } => {
            let compliance = Compliance::new(compliance).map_err(|error| refuse(&error))?;
            effects.stretch = Some(Stretch {
                compliance,
                ..Stretch::default()
            });
            effects.volume = match volumes {
                Volumes::Free => None,
                Volumes::Rigid => Some(Volume::default()),
                Volumes::Bulk(modulus) => Some(Volume {
                    bulk_modulus: Stiffness::new(modulus).map_err(|error| refuse(&error))?,
                    ..Volume::default()
                }),
            };
        }
        Elasticity::NeoHookean {
            youngs_modulus,
            poisson_ratio,
        } => {
            effects.neo_hookean = Some(NeoHookean {
                youngs_modulus: YoungsModulus::new(youngs_modulus)
                    .map_err(|error| refuse(&error))?,
                poisson_ratio: PoissonRatio::new(poisson_ratio).map_err(|error| refuse(&error))?,
                ..NeoHookean::default()
            });
        }
    }
    Ok(effects)
}

/// Inverse mass of each particle [1/kg], in the order of the mesh; 0 for pins.
///
/// # Errors
/// As [`body`].
pub fn inverse_masses(problem: &Problem) -> Result<Vec<f32>, PeerError> {
    let body = body(problem)?;
    let weights = body.particles.positions.iter().map(|x| x.w).collect();
    Ok(in_mesh_order(&body, weights))
}

/// Reorders values of particles from the numbering of the solver to that of the mesh.
#[must_use]
pub fn in_mesh_order<T: Copy>(body: &Body, values: Vec<T>) -> Vec<T> {
    let vertices = 0..values.len() as u32;
    let numbering = &body.topology.numbering;
    vertices
        .map(|vertex| values[numbering.particle(VertexIndex(vertex)).index()])
        .collect()
}

/// Largest bulk modulus from which rigid volumes are extrapolated, relative to 1/(αL) with the
/// compliance α and the length L of the shortest edge. Rounding limits it.
const STIFFEST: f32 = 1e3;

/// Finds the state of rest by Newton's method in f64.
///
/// Rigid volumes are extrapolated from large bulk moduli (Richardson 1911).
///
/// # Errors
/// As [`body`], and if the search fails.
pub fn answer(problem: &Problem) -> Result<Answer, PeerError> {
    let Elasticity::Springs {
        compliance,
        volumes: Volumes::Rigid,
    } = problem.elasticity
    else {
        return equilibrium_of(problem);
    };
    let stiffest = STIFFEST / (compliance * shortest_edge(problem));
    let with = |softer: f32| {
        let mut problem = problem.clone();
        problem.elasticity = Elasticity::Springs {
            compliance,
            volumes: Volumes::Bulk(stiffest / softer),
        };
        equilibrium_of(&problem)
    };
    let mut levels = Vec::new();
    for softer in [1.0, 2.0, 4.0, 8.0] {
        levels.push(with(softer)?);
    }
    let residual = levels[0].residual;
    let positions = levels.into_iter().map(|level| level.positions).collect();
    let second = extrapolated(extrapolated(positions, 2.0), 4.0);
    let [better, worse] = [&second[0], &second[1]];
    let measure = Measure::new(problem, better.clone());
    Ok(Answer {
        // The remaining error falls like the third power of the compliance.
        uncertainty: measure.error(worse) / 7.0,
        residual,
        positions: better.clone(),
    })
}

/// Limits of successive pairs of positions, of which the error is `ratio` times as large in the
/// second as in the first.
fn extrapolated(levels: Vec<Vec<DVec3>>, ratio: f64) -> Vec<Vec<DVec3>> {
    let limit = |fine: &DVec3, coarse: &DVec3| *fine + (*fine - *coarse) / (ratio - 1.0);
    let pairs = levels.windows(2);
    pairs
        .map(|pair| {
            let both = pair[0].iter().zip(&pair[1]);
            both.map(|(fine, coarse)| limit(fine, coarse)).collect()
        })
        .collect()
}

/// Length of the shortest edge [m].
#[must_use]
pub fn shortest_edge(problem: &Problem) -> f32 {
    let shape = &problem.shape;
    let length =
        |&[a, b]: &[u32; 2]| shape.vertices[a as usize].distance(shape.vertices[b as usize]);
    shape.edges.iter().map(length).fold(f32::INFINITY, f32::min)
}

fn equilibrium_of(problem: &Problem) -> Result<Answer, PeerError> {
    let body = body(problem)?;
    let settings = Settings {
        gravity: problem.gravity(),
        ..Settings::default()
    };
    let found = equilibrium::find(&body, &settings).map_err(|error| refused(problem, &error))?;
    let positions = in_mesh_order(&body, found.x);
    let neighbors = in_mesh_order(&body, found.neighbor);
    let measure = Measure::new(problem, positions.clone());
    Ok(Answer {
        uncertainty: measure.error(&neighbors),
        positions,
        residual: found.residual,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extrapolation_removes_powers_of_the_error_one_by_one() {
        // 3 + 2e + 5e² with e = 0.01, 0.1 and 1.
        let level = |e: f64| vec![DVec3::splat(3.0 + 2.0 * e + 5.0 * e * e)];
        let levels = vec![level(0.01), level(0.1), level(1.0)];
        let first = extrapolated(levels, 10.0);
        assert!((first[0][0].x - 2.995).abs() < 1e-9);
        let second = extrapolated(first, 100.0);
        assert!((second[0][0].x - 3.0).abs() < 1e-9);
    }
}
