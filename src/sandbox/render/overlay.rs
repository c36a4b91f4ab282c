//! Marks over the picture: the spring that pulls a body with its force, the pins, and the stitches that
//! hold.
//!
//! Painted by egui in screen space, so that they are smooth and legible on any adapter, and
//! never take the pointer.

use crate::render::Drawn;
use crate::sandbox::{input::drag::Drag, render::camera::OrbitCamera};
use crate::{
    simulation::{Pins, SimulationSettings, SoftBody},
    solver::{Grab, StitchEnd, Stitches},
};
use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPostUpdateSet, EguiPrimaryContextPass,
    egui::{
        self, Align2, Color32, CornerRadius, FontId, Id, LayerId, Order, Painter, Pos2, Stroke,
        vec2,
    },
};

const SPRING: Color32 = Color32::from_rgb(30, 38, 52);
const HALO: Color32 = Color32::from_rgba_premultiplied(150, 150, 150, 150);
const PIN: Color32 = Color32::from_rgb(214, 60, 48);
const THREAD: Color32 = Color32::from_rgb(250, 204, 21);
/// Coils of the drawn spring, and their width [px].
const COILS: (usize, f32) = (9, 5.0);

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
            (paint_pins, paint_stitches, paint_spring).chain(),
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
            .filter_map(|&pin| drawn.particles.get(body.numbering.particle(pin) as usize));
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
                painter.line_segment([from, to], Stroke::new(3.5, SPRING));
                painter.line_segment([from, to], Stroke::new(1.5, THREAD));
            }
            for at in ends.into_iter().flatten() {
                painter.circle(at, 3.0, THREAD, Stroke::new(1.0, SPRING));
            }
        }
    }
    Ok(())
}

fn paint_spring(
    mut contexts: EguiContexts,
    camera: Single<(&Camera, &GlobalTransform), With<OrbitCamera>>,
    drag: Res<Drag>,
    bodies: Query<(&Drawn, Option<&Grab>)>,
    settings: Res<SimulationSettings>,
) -> Result {
    let Some(held) = drag.held else {
        return Ok(());
    };
    let Ok((drawn, grab)) = bodies.get(held.body) else {
        return Ok(());
    };
    let (camera, eye) = *camera;
    let screen = Screen { camera, eye };
    let ends = (
        screen.at(held.point.position(&drawn.particles)),
        screen.at(held.target),
    );
    let (Some(from), Some(to)) = ends else {
        return Ok(());
    };
    let painter = painter(contexts.ctx_mut()?);
    let line = coil(from, to);
    painter.line(line.clone(), Stroke::new(4.5, HALO));
    painter.line(line, Stroke::new(2.0, SPRING));
    painter.circle(from, 4.0, Color32::WHITE, Stroke::new(2.0, SPRING));
    painter.circle_stroke(to, 7.0, Stroke::new(4.5, HALO));
    painter.circle_stroke(to, 7.0, Stroke::new(2.0, SPRING));
    let newtons = grab.map_or(0.0, |grab| grab.force(settings.substep_seconds() as f32));
    label(&painter, to + vec2(16.0, -18.0), &force(newtons));
    Ok(())
}

/// A force in words: three digits and a unit that fits.
fn force(newtons: f32) -> String {
    let (value, unit) = match newtons.abs() {
        x if x >= 1e6 => (newtons / 1e6, "MN"),
        x if x >= 1e3 => (newtons / 1e3, "kN"),
        x if x >= 1.0 || x == 0.0 => (newtons, "N"),
        x if x >= 1e-3 => (newtons * 1e3, "mN"),
        _ => (newtons * 1e6, "µN"),
    };
    let digits = match value.abs() {
        x if x >= 100.0 => 0,
        x if x >= 10.0 => 1,
        _ => 2,
    };
    format!("{value:.digits$} {unit}")
}

/// A spring between two points of the screen: straight ends, and coils that stretch with it.
fn coil(from: Pos2, to: Pos2) -> Vec<Pos2> {
    let along = to - from;
    let across = along.normalized().rot90();
    let steps = 2 * COILS.0;
    let mut points = vec![from, from + along * 0.12];
    for step in 0..=steps {
        let share = 0.16 + 0.68 * step as f32 / steps as f32;
        let side = match step {
            0 => 0.0,
            last if last == steps => 0.0,
            odd if odd % 2 == 1 => 1.0,
            _ => -1.0,
        };
        // A short spring has flat coils: it must not become a blot.
        let width = COILS.1.min(along.length() * 0.06);
        points.push(from + along * share + across * side * width);
    }
    points.extend([from + along * 0.88, to]);
    points
}

fn label(painter: &Painter, at: Pos2, text: &str) {
    let font = FontId::proportional(13.0);
    let galley = painter.layout_no_wrap(text.to_owned(), font, Color32::WHITE);
    let rect = Align2::LEFT_CENTER.anchor_size(at, galley.size());
    painter.rect_filled(
        rect.expand2(vec2(7.0, 3.0)),
        CornerRadius::same(9),
        Color32::from_rgba_unmultiplied(22, 28, 38, 220),
    );
    painter.galley(rect.min, galley, Color32::WHITE);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_are_told_in_three_digits_and_a_unit() {
        for (newtons, text) in [
            (0.0, "0.00 N"),
            (9.81, "9.81 N"),
            (98.1, "98.1 N"),
            (981.0, "981 N"),
            (2500.0, "2.50 kN"),
            (3.2e6, "3.20 MN"),
            (0.0125, "12.5 mN"),
            (4e-6, "4.00 µN"),
        ] {
            assert_eq!(force(newtons), text);
        }
    }

    #[test]
    fn the_spring_begins_and_ends_where_it_pulls() {
        let (from, to) = (Pos2::new(10.0, 20.0), Pos2::new(110.0, 70.0));
        let line = coil(from, to);
        assert_eq!((line.first(), line.last()), (Some(&from), Some(&to)));
        assert!(
            coil(from, from)
                .iter()
                .all(|p| p.x.is_finite() && p.y.is_finite())
        );
    }
}
