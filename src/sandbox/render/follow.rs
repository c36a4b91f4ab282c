//! Follows a body with the camera: both move by the same way. Orbit and zoom stay free; panning and
//! framing something else end it.

use super::camera::OrbitCamera;
use crate::{
    render::Drawn,
    sandbox::state::view::{Followed, LastGrab},
};
use bevy::prelude::*;

/// The followed body and the position where it was last [m].
#[derive(Debug, Default)]
pub(super) struct Track(Option<(Entity, Vec3)>);

/// Moves the camera with the followed body. A body that is dragged is not followed: the pointer
/// would pull it along for ever.
pub(super) fn follow(
    mut followed: ResMut<Followed>,
    grab: Res<LastGrab>,
    bodies: Query<Option<&Drawn>>,
    mut camera: Single<&mut OrbitCamera>,
    mut track: Local<Track>,
) {
    let Some((body, _)) = followed.0 else {
        track.0 = None;
        return;
    };
    let Ok(drawn) = bodies.get(body) else {
        followed.0 = None;
        return;
    };
    // A new body is drawn from the next frame on.
    let Some(center) = drawn.map(Drawn::center).filter(|it| it.is_finite()) else {
        return;
    };
    let before = track.0.replace((body, center));
    match before.filter(|(other, _)| *other == body) {
        None => camera.goal.focus = center,
        Some((_, before)) => {
            let held = grab.0.is_some_and(|grab| grab.held && grab.body == body);
            let way = center - before;
            if !held && way != Vec3::ZERO {
                camera.goal.focus += way;
                camera.now.focus += way;
            }
        }
    }
}
