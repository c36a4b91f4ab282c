//! Deforms the bodies of a case.

use super::{Kind, Member, Shape};
use crate::solver::{
    Body, World,
    deform::{Deformation, deform},
};
use glam::Vec4;

/// Deforms all bodies.
pub fn deformed(member: &Member, world: &mut World, how: Deformation) {
    for body in &mut world.bodies {
        stand_up(member, body);
        deform(&mut body.particles, how);
        body.tick_start.clone_from(&body.particles);
    }
}

/// Rotates bodies along x or in y = 0 upright: x becomes y. Solids and user bodies are not rotated.
pub fn stand_up(member: &Member, body: &mut Body) {
    let given = matches!(member.shape, Shape::Given(_));
    if member.shape.kind() != Kind::Tetrahedra && !given {
        place(body, |x| Vec4::new(-x.y, x.x, x.z, x.w));
    }
}

/// Moves all particles to new positions, at rest.
pub fn place(body: &mut Body, to: impl Fn(Vec4) -> Vec4) {
    for x in &mut body.particles.positions {
        *x = to(*x);
    }
    body.particles.settle();
    body.tick_start.clone_from(&body.particles);
}
