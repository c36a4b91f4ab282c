//! Contacts of bodies with colliders and with the ground: their forces in a tick, and messages when
//! they begin and end.

use super::{BodyContacts, RecordContacts, SoftBody, touch};
use crate::{
    effect::{Collide, Ground, StickyGround},
    solver::{Body, Collider, RigidSurface},
};
use bevy::prelude::*;

/// What a body touches that is no body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ContactSurface {
    /// The ground of the body: its [`Ground`] or [`StickyGround`].
    Ground,
    /// A collider.
    Collider(Entity),
}

/// A body began to touch a collider or the ground; only while
/// [`RecordContacts`](super::RecordContacts) is on.
///
/// ```
/// use bevy::prelude::*;
/// use pliant::simulation::{BodyContacts, ContactSurface, RecordContacts, SurfaceContactStarted};
///
/// #[derive(Component)]
/// struct Paddle;
///
/// fn hear(
///     mut started: MessageReader<SurfaceContactStarted>,
///     contacts: Res<BodyContacts>,
///     paddle: Single<Entity, With<Paddle>>,
/// ) {
///     for hit in started.read().filter(|it| it.surface == ContactSurface::Collider(*paddle)) {
///         let force = contacts.surfaces().find(|it| (it.body, it.surface) == (hit.body, hit.surface));
///         println!("hit with {} N", force.map_or(0.0, |it| it.normal_force));
///     }
/// }
///
/// App::new().insert_resource(RecordContacts(true)).add_systems(Update, hear);
/// ```
#[derive(Message, Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct SurfaceContactStarted {
    /// The body.
    pub body: Entity,
    /// What it touches.
    pub surface: ContactSurface,
}

/// A body no longer touches a collider or the ground; or one of them is gone, the body is in
/// quarantine, or [`RecordContacts`](super::RecordContacts) was switched off.
#[derive(Message, Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct SurfaceContactEnded {
    /// The body.
    pub body: Entity,
    /// What it touched.
    pub surface: ContactSurface,
}

/// A body that touched a collider or the ground in the last tick.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SurfaceContact {
    /// The body.
    pub body: Entity,
    /// What it touched.
    pub surface: ContactSurface,
    /// Force on the body, the mean over the tick [N]: normal forces, friction and the impulses of
    /// restitution.
    pub force: Vec3,
    /// Sum of the normal forces on all particles, the mean over the tick [N].
    pub normal_force: f32,
    /// Number of particles that touched it in the tick, at least 1.
    pub particles: u32,
    /// Mean position of these particles at the end of the tick, weighted by their normal forces [m].
    pub point: Vec3,
}

/// What a body touched in the tick that is no body, in the order of the ground and these colliders.
pub(super) fn contacts_of(
    body: Entity,
    of: &Body,
    colliders: &[Entity],
) -> impl Iterator<Item = SurfaceContact> {
    of.states.surface_forces().iter().filter_map(move |it| {
        let surface = match it.surface {
            RigidSurface::Ground => ContactSurface::Ground,
            RigidSurface::Collider(number) => {
                ContactSurface::Collider(*colliders.get(number as usize)?)
            }
        };
        Some(SurfaceContact {
            body,
            surface,
            force: it.force.as_vec3(),
            normal_force: it.normal_force as f32,
            particles: it.particles,
            point: it.point.as_vec3(),
        })
    })
}

/// Bodies with what they can touch.
type Touching = (Has<Ground>, Has<StickyGround>, Has<Collide>);

/// Compares the contacts of the tick with those before. A body that sleeps is not stepped, and
/// touches the same until it wakes.
pub(super) fn report(
    record: Res<RecordContacts>,
    contacts: Res<BodyContacts>,
    bodies: Query<Touching, With<SoftBody>>,
    colliders: Query<(), With<Collider>>,
    mut known: Local<touch::Known<(Entity, ContactSurface)>>,
    mut started: MessageWriter<SurfaceContactStarted>,
    mut ended: MessageWriter<SurfaceContactEnded>,
) {
    let remains = |&(body, surface): &(Entity, ContactSurface)| {
        let slept = record.0 && contacts.slept.contains(&body);
        let sleeper = bodies.get(body).ok().filter(|_| slept);
        sleeper.is_some_and(|(ground, sticky, collide)| match surface {
            ContactSurface::Ground => ground || sticky,
            ContactSurface::Collider(collider) => collide && colliders.contains(collider),
        })
    };
    known.update(
        contacts.surfaces.iter().map(|it| (it.body, it.surface)),
        remains,
        |(body, surface)| {
            started.write(SurfaceContactStarted { body, surface });
        },
        |(body, surface)| {
            ended.write(SurfaceContactEnded { body, surface });
        },
    );
}
