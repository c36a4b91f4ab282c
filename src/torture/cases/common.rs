//! What several cases use.

pub(super) use super::super::{
    Case, Figure, Kind, Member, Outside, Run, Shape, Start, TortureError,
    case::nothing,
    deformed::{deformed, place, stand_up},
    family::{self, Axes},
    watch::{ROUNDING, strains},
};
pub(super) use crate::solver::{Body, Coefficient, Drag, World, measure};
pub(super) use glam::{Vec3, Vec4};

/// Adds a copy of the first body, moved by this many lengths.
pub(super) fn add_copy(world: &mut World, lengths: Vec3) {
    let mut copy = world.bodies[0].clone();
    copy.translate(lengths * copy.topology.size);
    world.bodies.push(copy);
}

/// Pins the vertices whose positions satisfy `which`.
pub(super) fn pin(body: &mut Body, which: impl Fn(Vec4) -> bool) {
    let positions = body.particles.positions.iter().enumerate();
    let chosen = positions
        .filter(|(_, x)| which(**x))
        .map(|(i, _)| body.topology.vertex(i));
    body.pins = chosen.collect();
    body.update_masses();
}

/// Pins the highest of its particles.
pub(super) fn pin_top(body: &mut Body) {
    let heights = body.particles.positions.iter().map(|x| x.y);
    let top = heights.fold(f32::NEG_INFINITY, f32::max) - 1e-4 * body.topology.size;
    pin(body, |x| x.y >= top);
}

/// Puts all bodies into a medium with this linear drag [1/s].
pub(super) fn medium(world: &mut World, linear: f32) -> Result<(), TortureError> {
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
pub(super) fn shape_figures(body: &Body, limit: f64) -> Vec<Figure> {
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
pub(super) fn edge_strain(body: &Body, limit: f64) -> Figure {
    let (edges, _) = strains(body);
    let sum: f64 = edges.iter().map(|s| s * s).sum();
    let rms = (sum / edges.len().max(1) as f64).sqrt();
    Figure::new("strain of edges", rms * 100.0, limit * 100.0, "%")
}

/// Number of particle values that differ in any bit between two states.
pub(super) fn different_bits(a: &Body, b: &Body) -> usize {
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
pub(super) fn catch_up(world: &mut World, other: &World) {
    while world.tick < other.tick {
        world.tick();
    }
}

pub(super) fn is_solid(member: &Member) -> bool {
    member.shape.kind() == Kind::Tetrahedra
}
