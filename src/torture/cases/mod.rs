//! The table of cases, and helpers that several of them use.

mod change;
mod company;
mod contact;
mod effects;
mod elements;
mod load;
mod meshes;
mod recovery;
mod sameness;
mod time;
mod touch;

use super::{
    Case, Figure, Kind, Member, Outside, Run, Shape, Start, TortureError,
    family::{self, Axes},
    nothing,
    watch::{ROUNDING, strains},
};
use crate::solver::{
    Body, Coefficient, Drag, World,
    deform::{Deformation, deform},
    measure,
};
use glam::{Vec3, Vec4};

/// All cases, in the order of the table.
pub const CASES: &[Case] = &[
    recovery::SQUASHED,
    recovery::POINT,
    recovery::LINE,
    recovery::SHUFFLED,
    recovery::MIRRORED,
    recovery::INSIDE_OUT,
    recovery::TENFOLD,
    elements::ELEMENT,
    elements::EDGE,
    effects::EFFECTS,
    sameness::SAME,
    sameness::ORDER,
    sameness::FAR,
    meshes::MESHES,
    load::MASSES,
    load::STIFFNESSES,
    load::EXTREMES,
    load::IMPOSSIBLE,
    time::STEPS,
    time::FINE,
    time::SETTLES,
    time::HOUR,
    contact::PLATES,
    contact::STRUCK,
    contact::DRAGGED,
    contact::OVERLAP,
    touch::COLLIDE,
    touch::FOLDED,
    touch::TWISTED,
    touch::PINCHED,
    touch::OVERLAPPING,
    touch::STACK,
    touch::KNOT,
    touch::HAIR_KNOT,
    change::TORN,
    change::BURIED,
    change::SPRAYED,
    company::NOT_FINITE,
    company::CROWD,
];

/// Rotates bodies along x or in y = 0 upright: x becomes y. Solids and user bodies are not rotated.
fn stand_up(member: &Member, body: &mut Body) {
    let given = matches!(member.shape, Shape::Given(_));
    if member.shape.kind() != Kind::Tetrahedra && !given {
        place(body, |x| Vec4::new(-x.y, x.x, x.z, x.w));
    }
}

/// Deforms all bodies.
pub(super) fn deformed(member: &Member, world: &mut World, how: Deformation) {
    for body in &mut world.bodies {
        stand_up(member, body);
        deform(&mut body.particles, how);
        body.tick_start.clone_from(&body.particles);
    }
}

/// Moves all particles to new positions, at rest.
fn place(body: &mut Body, to: impl Fn(Vec4) -> Vec4) {
    for x in &mut body.particles.positions {
        *x = to(*x);
    }
    body.particles.settle();
    body.tick_start.clone_from(&body.particles);
}

/// Adds a copy of the first body, moved by this many lengths.
fn add_copy(world: &mut World, lengths: Vec3) {
    let mut copy = world.bodies[0].clone();
    copy.translate(lengths * copy.topology.size);
    world.bodies.push(copy);
}

/// Pins the vertices whose positions satisfy `which`.
fn pin(body: &mut Body, which: impl Fn(Vec4) -> bool) {
    let positions = body.particles.positions.iter().enumerate();
    let chosen = positions
        .filter(|(_, x)| which(**x))
        .map(|(i, _)| body.topology.vertex(i));
    body.pins = chosen.collect();
    body.update_masses();
}

/// Pins the highest of its particles.
fn pin_top(body: &mut Body) {
    let heights = body.particles.positions.iter().map(|x| x.y);
    let top = heights.fold(f32::NEG_INFINITY, f32::max) - 1e-4 * body.topology.size;
    pin(body, |x| x.y >= top);
}

/// Puts all bodies into a medium with this linear drag [1/s].
fn medium(world: &mut World, linear: f32) -> Result<(), TortureError> {
    let drag = Drag {
        linear: Coefficient::new(linear)?,
        ..Drag::default()
    };
    for body in &mut world.bodies {
        body.effects.drag = Some(drag);
    }
    Ok(())
}

/// Whether a body has recovered: no inverted element, and a distance to its rest shape within
/// `limit`, a fraction of its size; for cloths and ropes, which may fold, a strain of edges within
/// `limit`.
fn shape_figures(body: &Body, limit: f64) -> Vec<Figure> {
    let (topology, x) = (&body.topology, &body.particles.positions);
    if topology.tetrahedra.corners().len() == 0 {
        return vec![edge_strain(body, limit)];
    }
    let inverted = measure::inverted(topology, x);
    let shape = measure::shape_error(topology, x);
    vec![
        Figure::none("elements inside out", inverted, "elements"),
        Figure::new(
            "distance to rest shape",
            shape * 100.0,
            limit * 100.0,
            "% of size",
        ),
    ]
}

/// Root mean square strain of its edges.
fn edge_strain(body: &Body, limit: f64) -> Figure {
    let (edges, _) = strains(body);
    let sum: f64 = edges.iter().map(|s| s * s).sum();
    let rms = (sum / edges.len().max(1) as f64).sqrt();
    Figure::new("strain of edges", rms * 100.0, limit * 100.0, "%")
}

/// Number of particle values that differ in any bit between two states.
fn different_bits(a: &Body, b: &Body) -> usize {
    let (a, b) = (&a.particles, &b.particles);
    let columns = a.columns().into_iter().zip(b.columns());
    let differ = |(a, b): (&Vec4, &Vec4)| {
        let bits = |v: &Vec4| v.to_array().map(f32::to_bits);
        bits(a) != bits(b)
    };
    let counts = columns.map(|((_, a), (_, b))| {
        let pairs = a.iter().zip(b.iter()).filter(|pair| differ(*pair)).count();
        pairs + a.len().abs_diff(b.len())
    });
    counts.sum()
}

/// Ticks a world until it has reached the tick of another.
fn catch_up(world: &mut World, other: &World) {
    while world.tick < other.tick {
        world.tick();
    }
}

fn is_solid(member: &Member) -> bool {
    member.shape.kind() == Kind::Tetrahedra
}
