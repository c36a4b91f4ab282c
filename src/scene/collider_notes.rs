//! Notes about colliders that do not do what they seem to.

use crate::solver::{Body, Collider, ColliderShape, Path, World};

/// The notes about the colliders of a world.
pub(super) fn collider_notes(world: &World) -> Vec<String> {
    let numbered = (1..).zip(&world.colliders);
    let fast = numbered.filter_map(|(number, collider)| {
        let note = aliased(collider, world)?;
        Some(format!("collider {number}: {note}"))
    });
    fast.chain(too_small(world)).collect()
}

/// It turns so fast that bodies meet another motion.
fn aliased(collider: &Collider, world: &World) -> Option<String> {
    let Path::Spin { rate, .. } = collider.path else {
        return None;
    };
    let h = world.settings.substep_seconds();
    let turns = f64::from(rate).abs() * h;
    (turns >= 0.5).then(|| {
        format!(
            "turns {turns:.2} times in each substep of {:.2} ms, and from half a turn on bodies meet \
             another motion; lower the `rate`, or raise the substeps above {:.0}",
            1e3 * h,
            2.0 * f64::from(rate).abs() * world.settings.tick_seconds()
        )
    })
}

/// Some fit between the vertices of a body.
fn too_small(world: &World) -> Option<String> {
    let edge = |body: &Body| body.topology.surface().mean_edge;
    let touching = world
        .bodies
        .iter()
        .filter(|body| body.effects.collide.is_some());
    let coarsest = touching.max_by(|a, b| edge(a).total_cmp(&edge(b)))?;
    let numbered = (1..).zip(&world.colliders);
    let small: Vec<(u32, f32)> = numbered
        .map(|(number, collider)| (number, across(&collider.shape)))
        .filter(|(_, across)| *across < edge(coarsest))
        .collect();
    let smallest = small.iter().map(|it| it.1).reduce(f32::min)?;
    let numbers: Vec<String> = small.iter().map(|it| it.0.to_string()).collect();
    let collider = if small.len() == 1 {
        "collider"
    } else {
        "colliders"
    };
    Some(format!(
        "{collider} {}: {smallest} m across, less than the mean edge length of {:.3} m of “{}”, of which \
         only vertices meet a sphere, a box or a capsule: it can get between them; use `Surface(…)`, \
         which edges and faces meet, or more cells",
        numbers.join(", "),
        edge(coarsest),
        coarsest.name
    ))
}

/// How thin a shape is that only vertices meet [m].
fn across(shape: &ColliderShape) -> f32 {
    match shape {
        ColliderShape::Sphere { radius } | ColliderShape::Capsule { radius, .. } => 2.0 * radius,
        ColliderShape::Box { size } => size.min_element(),
        ColliderShape::Mesh(_) => f32::INFINITY,
    }
}
