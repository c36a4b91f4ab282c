//! The first and the last of the three stages; the constraints between them are in
//! [`constraint`](super::constraint) and [`contact`](super::contact).
//!
//! Symplectic Euler on positions: `v += hg; p = x; x += hv`, then the constraints move x, then
//! `v = (x − p)/h`. Pinned particles (inverse mass 0) are not moved by a bit.
//! Source: Müller and others, *Position Based Dynamics* (2007), algorithm 1; Macklin and others,
//! *Small Steps in Physics Simulation* (2019), algorithm 1.

use super::Particles;
use glam::{Vec3, Vec4};

/// Predicts positions: gravity [m/s²] over a substep of `h` seconds.
pub fn presolve(particles: &mut Particles, h: f32, gravity: Vec3) {
    let push = (gravity * h).extend(0.0);
    let state = particles
        .positions
        .iter_mut()
        .zip(&mut particles.previous)
        .zip(&mut particles.velocities);
    for ((x, p), v) in state {
        *p = *x;
        if x.w > 0.0 {
            *v += push;
            *x += *v * h;
        } else {
            *v = Vec4::ZERO;
        }
    }
}

/// Turns positions back into velocities after a substep of `h` seconds.
///
/// # Errors
/// The index of the first particle whose position is not finite; velocities are untouched then,
/// and `previous` holds the last finite positions.
pub fn postsolve(particles: &mut Particles, h: f32) -> Result<(), usize> {
    if let Some(particle) = super::particles::first_not_finite(&particles.positions) {
        return Err(particle);
    }
    let state = particles
        .positions
        .iter()
        .zip(&particles.previous)
        .zip(&mut particles.velocities);
    for ((x, p), v) in state {
        // w of x and p is the same inverse mass, so that w of v stays 0.
        *v = (*x - *p) / h;
    }
    Ok(())
}
