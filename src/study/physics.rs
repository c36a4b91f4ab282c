//! Energy, momentum and linking number of a [`State`] of either solver, in f64.

use super::state::{BodyState, State};
use crate::solver::{
    Body, RodLink, World,
    measure::elastic_energies,
    topology::{self, Dimension},
};
use glam::DVec3;

/// Sum of kinetic, gravitational (zero at the origin) and elastic energy [J]. Rigid constraints
/// store no energy.
#[must_use]
pub fn energy(world: &World, state: &State) -> f64 {
    let gravity = world.settings.gravity.as_dvec3();
    let bodies = world.bodies.iter().zip(&state.bodies);
    bodies
        .map(|(body, now)| {
            let moving = moving(now);
            moving
                .map(|(m, x, v)| m * (0.5 * v.length_squared() - gravity.dot(x)))
                .sum::<f64>()
                + elastic(body, &now.x)
        })
        .sum()
}

/// Linear momentum [kg·m/s].
#[must_use]
pub fn momentum(state: &State) -> DVec3 {
    let all = state.bodies.iter().flat_map(moving);
    all.fold(DVec3::ZERO, |sum, (m, _, v)| sum + v * m)
}

/// Angular momentum about the center of mass [kg·m²/s].
#[must_use]
pub fn angular_momentum(state: &State) -> DVec3 {
    let all = || state.bodies.iter().flat_map(moving);
    let mass: f64 = all().map(|(m, ..)| m).sum();
    let middle =
        all().fold(DVec3::ZERO, |sum, (m, x, _)| sum + x * m) / mass.max(f64::MIN_POSITIVE);
    all().fold(DVec3::ZERO, |sum, (m, x, v)| {
        sum + (x - middle).cross(v) * m
    })
}

/// [Linking number](RodLink) of bodies that are a closed [rod](crate::solver::Rod), summed [turns].
#[must_use]
pub fn link(world: &World, state: &State) -> f64 {
    let bodies = world.bodies.iter().zip(&state.bodies);
    bodies
        .filter(|(body, _)| body.effects.rod.is_some())
        .filter_map(|(body, now)| RodLink::of(&body.topology, &now.x, &now.segments))
        .map(RodLink::total)
        .sum()
}

/// Total volume of the tetrahedra of a body; without tetrahedra, the volume that its surface
/// encloses [m³].
#[must_use]
pub fn volume(body: &Body, x: &[DVec3]) -> f64 {
    let topology = &body.topology;
    if topology.dimension == Dimension::Sheet
        && let Ok(enclosure) = topology.enclosure()
    {
        return enclosure.volume(topology, |i| x[i as usize]);
    }
    volumes(body, x).sum()
}

fn moving(body: &BodyState) -> impl Iterator<Item = (f64, DVec3, DVec3)> {
    let all = body.m.iter().zip(&body.x).zip(&body.v);
    all.map(|((&m, &x), &v)| (m, x, v))
}

fn volumes(body: &Body, x: &[DVec3]) -> impl Iterator<Item = f64> {
    let tetrahedra = body.topology.tetrahedra.corners();
    tetrahedra.map(|corners| topology::volume(corners.map(|i| x[i as usize])))
}

fn elastic(body: &Body, x: &[DVec3]) -> f64 {
    elastic_energies(&body.effects, &body.topology, |i| {
        let i = i as usize;
        (x[i], body.particles.positions[i].w.into())
    })
}
