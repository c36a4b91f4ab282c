//! Markers over the picture: intact stitches. Pins are in [`pin_marks`](super::pin_marks).
//!
//! Drawn by egui in screen space, so that they are smooth and legible on any adapter and never
//! capture the pointer.

use crate::{
    render::Drawn,
    sandbox::{render::camera::OrbitCamera, state::look::HiddenBody},
    simulation::SpawnOrder,
    solver::{StitchEnd, Stitches},
};
use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPostUpdateSet, EguiPrimaryContextPass,
    egui::{self, Color32, Id, LayerId, Order, Painter, Pos2, Stroke},
};

/// Color of lines.
pub(in crate::sandbox) const LINE: Color32 = Color32::from_rgb(30, 38, 52);
/// Number of marks of a body above which they are small.
pub(super) const MANY: usize = 100;
/// Number of stitches of a body above which they are not drawn: they would cover it, as on fur.
const MAX_STITCHES: usize = 1000;
const THREAD: Color32 = Color32::from_rgb(250, 204, 21);

/// Systems that draw markers, in `EguiPrimaryContextPass`.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct OverlaySystems;

/// Draws the markers.
pub struct OverlayPlugin;

impl Plugin for OverlayPlugin {
    fn build(&self, app: &mut App) {
        // Markers are drawn over the picture and need the bodies and camera of this frame.
        app.configure_sets(
            PostUpdate,
            EguiPostUpdateSet::EndPass.after(TransformSystems::Propagate),
        )
        .add_systems(
            EguiPrimaryContextPass,
            paint_stitches.in_set(OverlaySystems),
        );
    }
}

/// Projection from world to screen [logical px], for points in front of the camera.
pub(in crate::sandbox) struct Screen<'a> {
    pub camera: &'a Camera,
    pub eye: &'a GlobalTransform,
}

impl Screen<'_> {
    pub fn at(&self, point: Vec3) -> Option<Pos2> {
        let at = self.camera.world_to_viewport(self.eye, point).ok()?;
        Some(Pos2::new(at.x, at.y))
    }
}

pub(in crate::sandbox) fn painter(context: &egui::Context) -> Painter {
    // Below every window and panel, above the picture.
    context.layer_painter(LayerId::new(Order::Background, Id::new("marks")))
}

/// Draws the points of intact stitches, and lines between two points of bodies.
fn paint_stitches(
    mut contexts: EguiContexts,
    camera: Single<(&Camera, &GlobalTransform), With<OrbitCamera>>,
    bodies: Query<(&Stitches, &Drawn), Without<HiddenBody>>,
    all: Query<(&SpawnOrder, &Drawn)>,
) -> Result {
    let painter = painter(contexts.ctx_mut()?);
    let (camera, eye) = *camera;
    let screen = Screen { camera, eye };
    let mut sorted: Vec<_> = all.iter().collect();
    sorted.sort_unstable_by_key(|(order, _)| **order);
    let few = bodies
        .iter()
        .filter(|(stitches, _)| stitches.all().len() <= MAX_STITCHES);
    for (stitches, drawn) in few {
        let (radius, edge) = match stitches.all().len() > MANY {
            true => (1.5, 0.5),
            false => (3.0, 1.0),
        };
        for stitch in stitches.all().iter().filter(|stitch| !stitch.broken) {
            let other = match &stitch.to {
                StitchEnd::Point(other) => Some((other, drawn)),
                StitchEnd::Collider { .. } => None,
                StitchEnd::Body { number, point } => {
                    let other = sorted.get(*number as usize);
                    other.map(|(_, drawn)| (point, *drawn))
                }
            };
            let ends = [Some((&stitch.point, drawn)), other].map(|end| {
                let (point, drawn) = end?;
                screen.at(point.position(&drawn.particles))
            });
            if let [Some(from), Some(to)] = ends {
                painter.line_segment([from, to], Stroke::new(3.5, LINE));
                painter.line_segment([from, to], Stroke::new(1.5, THREAD));
            }
            for at in ends.into_iter().flatten() {
                painter.circle(at, radius, THREAD, Stroke::new(edge, LINE));
            }
        }
    }
    Ok(())
}
