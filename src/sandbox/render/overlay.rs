//! Marks over the picture: pins, and the stitches that hold.
//!
//! Painted by egui in screen space, so that they are smooth and legible on any adapter, and
//! never take the pointer.

use crate::{
    render::Drawn,
    sandbox::render::camera::OrbitCamera,
    simulation::{Pins, SoftBody},
    solver::{StitchEnd, Stitches},
};
use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPostUpdateSet, EguiPrimaryContextPass,
    egui::{self, Color32, Id, LayerId, Order, Painter, Pos2, Stroke},
};

/// The color of lines.
pub(in crate::sandbox) const LINE: Color32 = Color32::from_rgb(30, 38, 52);
const PIN: Color32 = Color32::from_rgb(214, 60, 48);
const THREAD: Color32 = Color32::from_rgb(250, 204, 21);

/// Systems that paint marks, in `EguiPrimaryContextPass`.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct OverlaySystems;

/// Paints the marks.
pub struct OverlayPlugin;

impl Plugin for OverlayPlugin {
    fn build(&self, app: &mut App) {
        // What is painted lies over what is drawn: it needs this frame's bodies and camera.
        app.configure_sets(
            PostUpdate,
            EguiPostUpdateSet::EndPass.after(TransformSystems::Propagate),
        )
        .add_systems(
            EguiPrimaryContextPass,
            (paint_pins, paint_stitches).chain().in_set(OverlaySystems),
        );
    }
}

/// From the world to the screen [logical px], if it is before the eye.
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

fn paint_pins(
    mut contexts: EguiContexts,
    camera: Single<(&Camera, &GlobalTransform), With<OrbitCamera>>,
    bodies: Query<(&SoftBody, &Pins, &Drawn)>,
) -> Result {
    let painter = painter(contexts.ctx_mut()?);
    let (camera, eye) = *camera;
    let screen = Screen { camera, eye };
    for (body, pins, drawn) in &bodies {
        let points = pins
            .0
            .iter()
            .filter_map(|&pin| drawn.particles.get(body.particle(pin)));
        for at in points.filter_map(|x| screen.at(x.truncate())) {
            painter.circle(at, 4.0, PIN, Stroke::new(1.5, Color32::WHITE));
        }
    }
    Ok(())
}

/// The points of stitches that are not broken, and threads between those of one body.
fn paint_stitches(
    mut contexts: EguiContexts,
    camera: Single<(&Camera, &GlobalTransform), With<OrbitCamera>>,
    bodies: Query<(&Stitches, &Drawn)>,
) -> Result {
    let painter = painter(contexts.ctx_mut()?);
    let (camera, eye) = *camera;
    let screen = Screen { camera, eye };
    for (stitches, drawn) in &bodies {
        for stitch in stitches.all().iter().filter(|stitch| !stitch.broken) {
            let other = match &stitch.to {
                StitchEnd::Point(other) => Some(other),
                StitchEnd::Collider { .. } => None,
            };
            let ends = [Some(&stitch.point), other].map(|end| {
                let end = end?;
                screen.at(end.position(&drawn.particles))
            });
            if let [Some(from), Some(to)] = ends {
                painter.line_segment([from, to], Stroke::new(3.5, LINE));
                painter.line_segment([from, to], Stroke::new(1.5, THREAD));
            }
            for at in ends.into_iter().flatten() {
                painter.circle(at, 3.0, THREAD, Stroke::new(1.0, LINE));
            }
        }
    }
    Ok(())
}
