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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        sandbox::{render::orbit::Orbit, state::view::GrabbedPoint},
        solver::VertexIndex,
    };

    /// An app with a camera and a body at x = 1 m that is followed.
    fn app() -> (App, Entity) {
        let mut app = App::new();
        app.init_resource::<LastGrab>().add_systems(Update, follow);
        app.world_mut().spawn(OrbitCamera::at(Orbit::default()));
        let body = app.world_mut().spawn(Drawn::default()).id();
        app.insert_resource(Followed(Some((body, "ball".to_owned()))));
        put(&mut app, body, 1.0);
        app.update();
        (app, body)
    }

    fn put(app: &mut App, body: Entity, x: f32) {
        let mut drawn = app.world_mut().get_mut::<Drawn>(body).expect("a body");
        (drawn.low, drawn.high) = (Vec3::X * (x - 0.1), Vec3::X * (x + 0.1));
    }

    fn orbits(app: &mut App) -> (Orbit, Orbit) {
        let mut cameras = app.world_mut().query::<&OrbitCamera>();
        let camera = cameras.single(app.world()).expect("one camera");
        (camera.now, camera.goal)
    }

    #[test]
    fn the_camera_turns_to_the_body_and_then_moves_with_it() {
        let (mut app, body) = app();
        let (now, goal) = orbits(&mut app);
        assert_eq!(goal.focus, Vec3::X);
        put(&mut app, body, 4.0);
        app.update();
        let (later, goal) = orbits(&mut app);
        assert_eq!(goal.focus, 4.0 * Vec3::X);
        assert!(later.focus.distance(now.focus + 3.0 * Vec3::X) < 1e-5);
        assert_eq!(goal.distance, now.distance);
    }

    #[test]
    fn a_dragged_body_does_not_pull_the_camera_along() {
        let (mut app, body) = app();
        let hold = |held| {
            let vertex = VertexIndex(0);
            LastGrab(Some(GrabbedPoint { body, vertex, held }))
        };
        app.insert_resource(hold(true));
        put(&mut app, body, 4.0);
        app.update();
        assert_eq!(orbits(&mut app).1.focus, Vec3::X);
        app.insert_resource(hold(false));
        put(&mut app, body, 4.5);
        app.update();
        assert_eq!(orbits(&mut app).1.focus, 1.5 * Vec3::X);
    }

    #[test]
    fn following_ends_with_the_body() {
        let (mut app, body) = app();
        app.world_mut().despawn(body);
        app.update();
        assert_eq!(*app.world().resource::<Followed>(), Followed(None));
    }
}
