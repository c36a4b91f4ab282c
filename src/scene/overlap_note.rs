//! A note about bodies that begin inside each other or inside colliders.

use crate::solver::{World, contact::Overlapped};

/// Number of pairs that are named.
const NAMED: usize = 3;

/// One note about all that overlaps in a world; `None` if nothing does.
pub(super) fn overlap_note(world: &World) -> Option<String> {
    let pairs = world.overlaps();
    let name = |body: usize| format!("“{}”", world.bodies[body].name);
    let named = pairs.iter().take(NAMED).map(|&(body, other)| {
        let other = match other {
            Overlapped::Itself => "itself".to_owned(),
            Overlapped::Body(other) => name(other),
            Overlapped::Collider(number) => format!("collider {}", number + 1),
        };
        format!("{} overlaps {other}", name(body))
    });
    let mut list: Vec<String> = named.collect();
    if pairs.len() > NAMED {
        list.push(format!("{} more pairs overlap", pairs.len() - NAMED));
    }
    (!list.is_empty()).then(|| {
        format!(
            "at the start {}: what overlaps is moved apart at the recovery speed; place it apart if it is \
             not meant to move",
            list.join(", ")
        )
    })
}
