//! Tearing and cutting of bodies between ticks.

use super::{
    Active, AddedMass, Asleep, BodyDensity, BodySkin, EnergyLedger, PastStarts, Pins, RestTimer,
    SoftBody, TickStart,
    action::ActionError,
    body::{KnownMesh, follow_joints},
    step::UnderWay,
};
use crate::{
    effect::follow_points,
    mesh::Skin,
    solver::{
        Cut, EffectStates, Effects, Grab, ParticleIndex, Particles, Stitches, SurfacePoint, Tear,
        Topology, VertexIndex, advance::Stepper, direct::DirectWorkspace, masses::Masses,
        topology::Torn,
    },
};
use bevy::{ecs::query::QueryData, prelude::*};
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

/// The components that tearing changes.
#[derive(QueryData)]
#[query_data(mutable)]
pub(super) struct Tearable {
    entity: Entity,
    body: &'static mut SoftBody,
    known: &'static mut KnownMesh,
    particles: &'static mut Particles,
    start: &'static mut TickStart,
    past: &'static mut PastStarts,
    states: &'static mut EffectStates,
    stitches: Option<&'static mut Stitches>,
    skin: Option<&'static mut BodySkin>,
    density: &'static BodyDensity,
    added: &'static AddedMass,
    pins: &'static Pins,
}

/// What follows from a split.
struct Followed {
    torn: Torn,
    /// Number of split particles.
    splits: usize,
    /// The point that is grabbed now.
    grabbed: Option<SurfacePoint>,
}

impl Followed {
    /// Moves what other components refer to: the grab of the body, and stitches to it.
    fn finish(&self, world: &mut World, body: Entity) {
        follow_joints(world, body, |stitches, number| {
            stitches.follow_torn(number, &self.torn);
            false
        });
        if let Ok(mut body) = world.get_entity_mut(body) {
            self.move_grab(&mut body);
            follow_points(&mut body, |point| Some(self.torn.point(point)));
        }
    }

    fn move_grab(&self, body: &mut EntityWorldMut) {
        if let (Some(mut grab), Some(point)) = (body.get_mut::<Grab>(), self.grabbed) {
            grab.bypass_change_detection().point = point;
        }
    }
}

impl TearableItem<'_, '_> {
    /// Splits the body by `how`.
    fn split(
        &mut self,
        effects: &Effects,
        how: impl FnOnce(&mut Stepper, Masses, &mut Particles) -> Option<Torn>,
    ) -> Option<Followed> {
        let before = Arc::clone(&self.body.0);
        let mut topology = Arc::clone(&before);
        let mut none = Stitches::default();
        let mut stepper = Stepper {
            topology: &mut topology,
            particles: self.particles.bypass_change_detection(),
            effects,
            states: self.states.bypass_change_detection(),
            // A tick without tears is no change, which would wake the body.
            stitches: match &mut self.stitches {
                Some(stitches) => stitches.bypass_change_detection(),
                None => &mut none,
            },
            direct: &mut DirectWorkspace::default(),
            force: None,
        };
        let masses = Masses {
            density: self.density.0,
            added: self.added,
            pins: self.pins,
        };
        let start = &mut self.start.bypass_change_detection().0;
        let torn = how(&mut stepper, masses, start)?;
        if let Some(skin) = &mut self.skin {
            let followed = follow_skin(skin, &before, &torn);
            skin.0 = Arc::new(followed);
        }
        self.past.follow(&torn.sources);
        self.known.follow(topology.id());
        self.body.0 = topology;
        self.particles.set_changed();
        Some(Followed {
            splits: torn.sources.len() - before.particles(),
            grabbed: effects.grab.map(|grab| torn.point(&grab.point)),
            torn,
        })
    }
}

/// Tears the bodies that are above their limits, at the end of a tick.
pub(super) fn tear(
    mut bodies: Query<(Tearable, &Tear, super::carried::Carried), Active>,
    under_way: Res<UnderWay>,
    mut torn: MessageWriter<BodyTorn>,
    mut ledger: ResMut<EnergyLedger>,
    mut commands: Commands,
) {
    for (mut body, _, carried) in &mut bodies {
        let followed = body.split(&carried.effects(), |stepper, masses, start| {
            stepper.tear(masses, start, under_way.settings())
        });
        if let Some(followed) = followed {
            torn.write(BodyTorn {
                body: body.entity,
                splits: followed.splits,
            });
            ledger.tears();
            let entity = body.entity;
            commands.queue(move |world: &mut World| followed.finish(world, entity));
        }
    }
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
    let effects = Effects {
        grab: world.get::<Grab>(body).copied(),
        ..Effects::default()
    };
    let mut bodies = world.query::<Tearable>();
    let mut item = bodies
        .get_mut(world, body)
        .map_err(|_| ActionError::NoBody(body))?;
    let followed = item.split(&effects, |stepper, masses, start| {
        stepper.cut(cut, masses, start)
    });
    if let Some(followed) = followed {
        let splits = followed.splits;
        world.write_message(BodyTorn { body, splits });
        world.resource_mut::<EnergyLedger>().tears();
        followed.finish(world, body);
        let mut entity = world.entity_mut(body);
        entity.remove::<Asleep>().insert(RestTimer::default());
    }
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
