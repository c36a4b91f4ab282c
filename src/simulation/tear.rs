//! What follows from tears, cuts, and grains that appear or disappear, between ticks.

use super::{
    BodyContacts, BodySkin, EnergyLedger, PastStarts, SoftBody, action::ActionError,
    bodies::Bodies, body::KnownMesh, step,
};
use crate::{
    mesh::Skin,
    solver::{
        Cut, ParticleIndex, Particles, Topology, VertexIndex,
        tick::{TickReport, TornBody},
        topology::{Renewed, Torn},
    },
};
use bevy::{ecs::system::SystemState, prelude::*};
use std::sync::Arc;

/// A body came apart.
#[derive(Message, Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct BodyTorn {
    /// The body.
    pub body: Entity,
    /// Number of particles that were split.
    pub splits: usize,
}

/// Lets everything that refers to particles follow what has become of them at the end of a tick.
pub(super) fn follow(world: &mut World, report: TickReport) {
    for torn in report.torn {
        follow_torn(world, &torn);
    }
    for (number, renewed) in report.renewed {
        follow_renewed(world, number, &renewed);
    }
}

fn follow_torn(world: &mut World, it: &TornBody) {
    let TornBody {
        number,
        before,
        torn,
    } = it;
    let body = follow_particles(world, *number, &torn.sources);
    if let Some(mut skin) = world.get_mut::<BodySkin>(body) {
        let followed = follow_skin(&skin, before, torn);
        skin.0 = Arc::new(followed);
    }
    let splits = torn.sources.len() - before.particles();
    world.write_message(BodyTorn { body, splits });
    world.resource_mut::<EnergyLedger>().tears();
}

fn follow_renewed(world: &mut World, number: u32, renewed: &Renewed) {
    follow_particles(world, number, &renewed.kept);
}

/// Lets what is known of a body follow its new particles, each of which was one of `sources`, and says that
/// it has changed.
fn follow_particles(world: &mut World, number: u32, sources: &[u32]) -> Entity {
    let (_, entity) = world.resource::<BodyContacts>().bodies[number as usize];
    let mut body = world.entity_mut(entity);
    if let Some(mut past) = body.get_mut::<PastStarts>() {
        past.follow(sources);
    }
    let mesh = body.get_mut::<SoftBody>().map(|mut mesh| {
        mesh.set_changed();
        mesh.id()
    });
    if let (Some(mut known), Some(mesh)) = (body.get_mut::<KnownMesh>(), mesh) {
        known.follow(mesh);
    }
    if let Some(mut particles) = body.get_mut::<Particles>() {
        particles.set_changed();
    }
    entity
}

/// Cuts a body; a cut that misses it changes nothing.
///
/// # Errors
/// [`ActionError::NoBody`] if it does not exist, [`ActionError::Cut`] if the cut is not finite or
/// its rays are parallel.
pub(super) fn cut(world: &mut World, body: Entity, cut: &Cut) -> Result<(), ActionError> {
    if !cut.is_valid() {
        return Err(ActionError::Cut);
    }
    if !world
        .get_entity(body)
        .is_ok_and(|body| body.contains::<SoftBody>())
    {
        return Err(ActionError::NoBody(body));
    }
    let mut bodies = SystemState::<Bodies>::new(world);
    let (torn, turned) = step::all(&mut bodies, world).cut(body, cut);
    if let Some(torn) = torn {
        follow_torn(world, &torn);
    }
    step::turn(world, turned);
    Ok(())
}

/// The skin of a torn body: points follow their tetrahedra, and triangles across a crack are
/// removed.
fn follow_skin(skin: &Skin, before: &Topology, torn: &Torn) -> Skin {
    let mut followed = skin.clone();
    for anchor in &mut followed.anchors {
        let was = anchor.vertices.map(|vertex| before.particle(vertex) as u32);
        let now = torn.together(&was);
        for (vertex, particle) in anchor.vertices.iter_mut().zip(now) {
            *vertex = torn.topology.numbering.vertex(ParticleIndex(particle));
        }
    }
    let corners = |point: u32, skin: &Skin| skin.anchors[point as usize].vertices;
    let are_apart = |a: u32, b: u32| {
        let both = |point: u32| -> [(VertexIndex, VertexIndex); 4] {
            let (was, now) = (corners(point, skin), corners(point, &followed));
            std::array::from_fn(|i| (was[i], now[i]))
        };
        let others = both(b);
        both(a).iter().any(|(was, now)| {
            let mut others = others.iter();
            others.any(|(other, its)| was == other && now != its)
        })
    };
    let kept = skin.triangles.iter().copied();
    let kept: Vec<_> = kept
        .filter(|&[a, b, c]| !(are_apart(a, b) || are_apart(b, c) || are_apart(c, a)))
        .collect();
    followed.triangles = kept;
    followed
}
