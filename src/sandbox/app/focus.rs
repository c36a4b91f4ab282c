//! Frames and follows single bodies.

use crate::sandbox::{
    state::{
        selection::Selection,
        view::{Followed, Hovered, LastGrab, ViewCommand},
    },
    ui::message::Notices,
};
use crate::simulation::plain::bodies_in_order;
use bevy::prelude::*;

/// Frames bodies, by their keys.
pub(super) fn frame(world: &mut World, bodies: &[u64]) {
    let bodies = bodies.iter().filter_map(|&key| Entity::try_from_bits(key));
    let command = ViewCommand::Frame(bodies.collect());
    world.write_message(command);
}

/// Frames the selected bodies, or the chosen one.
pub(super) fn selected(world: &mut World) {
    let keys: Vec<u64> = world.resource::<Selection>().0.keys().collect();
    if keys.len() > 1 {
        frame(world, &keys);
    } else if let Some(body) = chosen(world, "focus") {
        world.write_message(ViewCommand::Frame(vec![body]));
    }
}

/// Follows the chosen body, or ends following.
pub(super) fn follow(world: &mut World) {
    if world.resource::<Followed>().0.is_some() {
        world.resource_mut::<Followed>().0 = None;
    } else if let Some(body) = chosen(world, "follow") {
        let name = world.get::<Name>(body).map(ToString::to_string);
        let name = name.unwrap_or_else(|| "body".to_owned());
        world.resource_mut::<Followed>().0 = Some((body, name));
    }
}

/// The selected body, the one under the pointer, the last grabbed one, or the only one.
fn chosen(world: &mut World, purpose: &str) -> Option<Entity> {
    let selected = world.resource::<Selection>().0.keys().next();
    let selected = selected.and_then(Entity::try_from_bits);
    let hovered = world.resource::<Hovered>().0;
    let grabbed = world.resource::<LastGrab>().0.map(|grab| grab.body);
    let bodies = bodies_in_order(world);
    let only = (bodies.len() == 1).then(|| bodies[0]);
    let mut candidates = [selected, hovered, grabbed, only].into_iter().flatten();
    let found = candidates.find(|body| bodies.contains(body));
    if found.is_none() {
        let text = format!("No body to {purpose}: click one or select it in the panel first");
        world.resource_mut::<Notices>().info(text);
    }
    found
}
