//! Messages when bodies begin and cease to touch.

use super::{Asleep, BodyContacts, SoftBody};
use bevy::prelude::*;

/// Two bodies touch that did not in the tick before.
///
/// ```
/// use bevy::prelude::*;
/// use pliant::simulation::{BodyContacts, ContactStarted};
///
/// fn hear(mut started: MessageReader<ContactStarted>, contacts: Res<BodyContacts>) {
///     for message in started.read() {
///         let pair = contacts.pairs().find(|pair| pair.bodies == message.bodies);
///         println!("a thud of {} N", pair.map_or(0.0, |pair| pair.normal_force));
///     }
/// }
/// # bevy::ecs::system::assert_is_system(hear);
/// ```
#[derive(Message, Debug, Clone, Copy, PartialEq, Eq)]
pub struct ContactStarted {
    /// The bodies, in the order in which they were spawned.
    pub bodies: [Entity; 2],
}

/// Two bodies no longer touch; or one of them is gone, in quarantine, or has no contact any more.
#[derive(Message, Debug, Clone, Copy, PartialEq, Eq)]
pub struct ContactEnded {
    /// The bodies, in the order in which they were spawned.
    pub bodies: [Entity; 2],
}

/// Two bodies that touched in the last tick.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct BodyPair {
    /// The bodies, in the order in which they were spawned.
    pub bodies: [Entity; 2],
    /// Force on the first one, the mean over the substeps of the tick [N]: normal forces and friction,
    /// without the impulses of restitution.
    pub force: Vec3,
    /// Sum of the normal forces of all contacts of the two, the mean over the substeps [N].
    pub normal_force: f32,
}

/// Pairs of bodies in order, to find them.
#[derive(Debug, Default)]
pub(super) struct Known(Vec<[Entity; 2]>);

/// Compares the pairs of the tick with those before. Bodies that sleep on each other are not stepped
/// and touch until one of them wakes.
pub(super) fn report(
    contacts: Res<BodyContacts>,
    asleep: Query<(), (With<SoftBody>, With<Asleep>)>,
    mut known: Local<Known>,
    mut now: Local<Known>,
    mut started: MessageWriter<ContactStarted>,
    mut ended: MessageWriter<ContactEnded>,
) {
    let (Known(known), Known(now)) = (&mut *known, &mut *now);
    now.clear();
    now.extend(contacts.pairs().map(|pair| pair.bodies));
    let new = now.iter().filter(|pair| known.binary_search(pair).is_err());
    started.write_batch(new.map(|&bodies| ContactStarted { bodies }));
    now.sort_unstable();
    let count = now.len();
    for &bodies in &*known {
        if now[..count].binary_search(&bodies).is_ok() {
            continue;
        }
        if bodies.iter().all(|&body| asleep.contains(body)) {
            now.push(bodies);
        } else {
            ended.write(ContactEnded { bodies });
        }
    }
    now.sort_unstable();
    std::mem::swap(known, now);
}
