//! The close button of the window: asks once if something is not saved. A second press while the card
//! is open closes the window without saving.

use super::{card::Card, save, unsaved::Baseline};
use crate::sandbox::app::{film, plain_picture};
use bevy::{
    ecs::message::MessageCursor,
    prelude::*,
    render::view::screenshot::Screenshot,
    window::{ClosingWindow, PrimaryWindow, RequestRedraw, WindowCloseRequested},
};

/// Frames for which a window that closes waits for pictures that were requested before.
const PATIENCE: u32 = 300;

/// Whether a script controls the window, which then closes without asking.
#[derive(Resource, Debug, Default)]
pub struct Scripted(pub bool);

/// Closes the window when that is requested, or asks. A film ends, and pictures under way are
/// finished first.
pub(super) fn close(
    world: &mut World,
    mut read: Local<MessageCursor<WindowCloseRequested>>,
    mut waited: Local<u32>,
) {
    // Marked in the frame before, as Bevy itself does it.
    let closing: Vec<Entity> = world
        .query_filtered::<Entity, With<ClosingWindow>>()
        .iter(world)
        .collect();
    if !closing.is_empty() {
        film::stop(world);
    }
    let mut pictures = world.query_filtered::<(), With<Screenshot>>();
    let is_pending = pictures.iter(world).next().is_some() || plain_picture::is_coming(world);
    if !closing.is_empty() && *waited < PATIENCE && is_pending {
        *waited += 1;
        world.write_message(RequestRedraw);
        return;
    }
    for window in closing {
        world.despawn(window);
    }
    let Some(messages) = world.get_resource::<Messages<WindowCloseRequested>>() else {
        return;
    };
    if read.read(messages).count() == 0 {
        return;
    }
    let scripted = world.resource::<Scripted>().0;
    let asked = matches!(*world.resource::<Card>(), Card::Closing { .. });
    let changes = match scripted || asked {
        true => Vec::new(),
        false => Baseline::changes(world),
    };
    if changes.is_empty() {
        close_now(world);
    } else {
        let file = save::scene_file(world);
        *world.resource_mut::<Card>() = Card::Closing { changes, file };
    }
}

/// Closes the window without asking.
pub fn close_now(world: &mut World) {
    let windows: Vec<Entity> = world
        .query_filtered::<Entity, With<PrimaryWindow>>()
        .iter(world)
        .collect();
    for window in windows {
        world.entity_mut(window).insert(ClosingWindow);
    }
}
