//! The camera: glides to its [controlled](crate::sandbox::input::steer) goal. The view is shifted
//! so that its center is the center of the area that the panel leaves free.
//!
//! A framed view stays framed when the window or the panel changes, until the user moves the camera.

use super::{follow, framing::Subject, free_area::FreeArea};
use crate::render::Drawn;
use crate::sandbox::{
    render::orbit::Orbit,
    state::view::{Followed, ViewCommand, ViewSettings},
};
use crate::simulation::SimulationClock;
use crate::solver::Collider;
use bevy::{camera::SubCameraView, prelude::*, window::PrimaryWindow};
use std::f32::consts::TAU;

/// Time constant of the camera motion [s].
const GLIDE: f32 = 0.07;

/// Maximum time of a step of the motion [s]: a frame of a slow renderer.
const MAX_STEP: f32 = 0.15;

/// The camera's orbit: current and goal.
#[derive(Component, Debug, Clone, Copy, Default)]
pub struct OrbitCamera {
    /// Current orbit.
    pub now: Orbit,
    /// Goal, set by user input.
    pub goal: Orbit,
    /// Shift of the view to the left [px]: half of the width that the panel covers on the right.
    shift: f32,
}

impl OrbitCamera {
    /// A camera at rest.
    #[must_use]
    pub fn at(orbit: Orbit) -> Self {
        Self {
            now: orbit,
            goal: orbit,
            shift: 0.0,
        }
    }
}

/// The points that are framed, as long as the user has not moved the camera.
#[derive(Resource, Debug, Default)]
pub struct Framed(Option<Framing>);

#[derive(Debug)]
struct Framing {
    points: Vec<Vec3>,
    area: FreeArea,
    goal: Orbit,
}

impl Framed {
    /// Moves the goal of the camera so that points [m] are framed, seen from a direction.
    pub fn begin(
        &mut self,
        camera: &mut OrbitCamera,
        direction: Orbit,
        points: Vec<Vec3>,
        area: FreeArea,
    ) {
        let mut goal = direction.fitting(&points, &area);
        // The shorter way round.
        goal.yaw += TAU * ((camera.now.yaw - goal.yaw) / TAU).round();
        camera.goal = goal;
        self.0 = Some(Framing { points, area, goal });
    }

    /// Frames the same points in another area, or forgets them after the user moved the camera.
    fn refit(&mut self, camera: &mut OrbitCamera, area: FreeArea) {
        let Some(framing) = &mut self.0 else {
            return;
        };
        if camera.goal != framing.goal {
            self.0 = None;
        } else if framing.area != area {
            framing.area = area;
            framing.goal = framing.goal.fitting(&framing.points, &area);
            camera.goal = framing.goal;
        }
    }
}

/// Systems that move the camera, in `Update`.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct CameraSystems;

/// Moves the camera.
pub struct CameraPlugin;

impl Plugin for CameraPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Framed>()
            .init_resource::<Followed>()
            .add_systems(
                Update,
                (frame, refit, follow::follow, glide)
                    .chain()
                    .in_set(CameraSystems),
            );
    }
}

fn frame(
    mut commands: MessageReader<ViewCommand>,
    bodies: Query<(Entity, &Drawn)>,
    colliders: Query<&Collider>,
    clock: Res<SimulationClock>,
    settings: Res<ViewSettings>,
    window: Single<&Window, With<PrimaryWindow>>,
    mut camera: Single<&mut OrbitCamera>,
    mut framed: ResMut<Framed>,
    mut followed: ResMut<Followed>,
) {
    for command in commands.read() {
        let chosen = match command {
            ViewCommand::FrameAll => None,
            ViewCommand::Frame(bodies) => Some(bodies),
            _ => continue,
        };
        let mut subject = Subject::default();
        for (entity, drawn) in &bodies {
            if chosen.is_none_or(|chosen| chosen.contains(&entity)) {
                subject.add(drawn.points.iter().copied());
            }
        }
        match chosen {
            None => subject.add_colliders(colliders.iter(), clock.time()),
            Some(_) => subject.add_surroundings(),
        }
        let area = FreeArea::new(&settings, window.size());
        let direction = camera.goal;
        framed.begin(&mut camera, direction, subject.points, area);
        let stays = |(body, _): &(Entity, String)| chosen.is_some_and(|it| it[..] == [*body]);
        if followed.0.as_ref().is_some_and(|it| !stays(it)) {
            followed.0 = None;
        }
    }
}

fn refit(
    settings: Res<ViewSettings>,
    window: Single<&Window, With<PrimaryWindow>>,
    mut camera: Single<&mut OrbitCamera>,
    mut framed: ResMut<Framed>,
) {
    let area = FreeArea::new(&settings, window.size());
    // Compares first, so that the camera is not marked as changed.
    if framed.0.is_some() {
        framed.refit(&mut camera, area);
    }
}

fn glide(
    time: Res<Time<Real>>,
    settings: Res<ViewSettings>,
    window: Single<&Window, With<PrimaryWindow>>,
    mut camera: Single<(&mut OrbitCamera, &mut Transform, &mut Camera)>,
) {
    let (orbit, transform, camera) = &mut *camera;
    // The first frame after a rest has the duration of the rest.
    let seconds = time.delta_secs().min(MAX_STEP);
    let fraction = 1.0 - (-seconds / GLIDE).exp();
    let now = orbit.now.towards(orbit.goal, fraction);
    // Stops within a fraction of a pixel, so that nothing is recomputed.
    let now = if now.is_near(orbit.goal) {
        orbit.goal
    } else {
        now
    };
    if now != orbit.now {
        orbit.now = now;
    }
    transform.set_if_neq(now.transform());
    let goal = settings.shift();
    let shift = orbit.shift + (goal - orbit.shift) * fraction;
    orbit.shift = if (goal - shift).abs() < 0.5 {
        goal
    } else {
        shift
    };
    let view = shifted_view(window.physical_size(), orbit.shift * window.scale_factor());
    if camera.sub_camera_view != view {
        camera.sub_camera_view = view;
    }
}

/// The view shifted left by a number of physical pixels, without rotating the camera.
fn shifted_view(size: UVec2, shift: f32) -> Option<SubCameraView> {
    (shift.round() != 0.0 && size.min_element() > 0).then(|| SubCameraView {
        full_size: size,
        offset: Vec2::new(shift.round(), 0.0),
        size,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(width: f32) -> FreeArea {
        FreeArea::whole(Vec2::new(width, 600.0))
    }

    #[test]
    fn a_framed_view_follows_the_window_until_the_user_moves_the_camera() {
        let mut camera = OrbitCamera::at(Orbit::default());
        let mut framed = Framed::default();
        let points = vec![Vec3::ZERO, Vec3::new(2.0, 1.0, 0.0)];
        framed.begin(&mut camera, Orbit::default(), points, area(1000.0));
        let wide = camera.goal.distance;
        framed.refit(&mut camera, area(300.0));
        let narrow = camera.goal.distance;
        assert!(narrow > 1.5 * wide, "{narrow} m and {wide} m");
        camera.goal = camera.goal.zoomed(1.0);
        let zoomed = camera.goal;
        framed.refit(&mut camera, area(1000.0));
        framed.refit(&mut camera, area(300.0));
        assert_eq!(camera.goal, zoomed);
    }

    #[test]
    fn the_camera_turns_the_shorter_way() {
        let from = Orbit {
            yaw: 3.0,
            ..default()
        };
        let mut camera = OrbitCamera::at(from);
        let to = Orbit {
            yaw: -3.0,
            ..default()
        };
        Framed::default().begin(&mut camera, to, vec![Vec3::ONE], area(800.0));
        assert!((camera.goal.yaw - 3.0).abs() < 0.3, "{}", camera.goal.yaw);
    }
}
