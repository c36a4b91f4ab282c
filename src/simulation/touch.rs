//! Messages when bodies begin and cease to touch.

use super::{BodyContacts, SoftBody};
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
#[non_exhaustive]
pub struct ContactStarted {
    /// The bodies, in the order in which they were spawned.
    pub bodies: [Entity; 2],
}

/// Two bodies no longer touch; or one of them is gone, in quarantine, or has no contact any more.
#[derive(Message, Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
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
    /// Force on the first one, the mean over the substeps of the tick [N]: normal forces, friction and
    /// the impulses of restitution.
    pub force: Vec3,
    /// Sum of the normal forces of all contacts of the two, the mean over the substeps [N].
    pub normal_force: f32,
}

/// What touched in the tick before, in order, to find it.
#[derive(Debug)]
pub(super) struct Known<T> {
    before: Vec<T>,
    now: Vec<T>,
}

impl<T> Default for Known<T> {
    fn default() -> Self {
        Self {
            before: Vec::new(),
            now: Vec::new(),
        }
    }
}

impl<T: Copy + Ord> Known<T> {
    /// Compares what touches in this tick with what did before. What is not among it any more
    /// `remains`, or has `ended`.
    pub fn update(
        &mut self,
        touching: impl Iterator<Item = T>,
        remains: impl Fn(&T) -> bool,
        started: impl FnMut(T),
        mut ended: impl FnMut(T),
    ) {
        let Self { before, now } = self;
        now.clear();
        now.extend(touching);
        let new = now.iter().filter(|it| before.binary_search(it).is_err());
        new.copied().for_each(started);
        now.sort_unstable();
        let count = now.len();
        for it in &*before {
            if now[..count].binary_search(it).is_ok() {
                continue;
            }
            if remains(it) {
                now.push(*it);
            } else {
                ended(*it);
            }
        }
        now.sort_unstable();
        std::mem::swap(before, now);
    }
}

/// Compares the pairs of the tick with those before. Bodies that sleep on each other are not stepped
/// and touch until one of them wakes.
pub(super) fn report(
    contacts: Res<BodyContacts>,
    bodies: Query<(), With<SoftBody>>,
    mut known: Local<Known<[Entity; 2]>>,
    mut started: MessageWriter<ContactStarted>,
    mut ended: MessageWriter<ContactEnded>,
) {
    known.update(
        contacts.pairs().map(|pair| pair.bodies),
        |pair| {
            let mut pair = pair.iter();
            pair.all(|body| contacts.slept.contains(body) && bodies.contains(*body))
        },
        |bodies| {
            started.write(ContactStarted { bodies });
        },
        |bodies| {
            ended.write(ContactEnded { bodies });
        },
    );
}
