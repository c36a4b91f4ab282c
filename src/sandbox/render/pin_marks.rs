//! Markers of pins: a needle with a head for a few pins of a body, dots for many.
//!
//! Which marker is under a point of the screen is decided here too, so that it agrees with the
//! picture.

use super::{
    camera::OrbitCamera,
    overlay::{MANY, OverlaySystems, Screen, painter},
};
use crate::{
    render::Drawn,
    sandbox::state::view::HoveredPin,
    simulation::{Pins, SoftBody},
};
use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{Color32, Pos2, Stroke, Vec2},
};

const PIN: Color32 = Color32::from_rgb(214, 60, 48);
const HOVERED: Color32 = Color32::from_rgb(255, 138, 92);
const NEEDLE: Color32 = Color32::from_rgb(60, 66, 78);
/// Largest number of pins of a body that are drawn with needles.
const MAX_NEEDLES: usize = 40;
/// Offset of a pin's head from its point [logical px].
const HEAD: Vec2 = Vec2::new(3.0, -12.0);
/// Distance within which a pin is under the pointer [logical px].
const REACH: f32 = 8.0;

/// Draws the pins.
pub struct PinMarksPlugin;

impl Plugin for PinMarksPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<HoveredPin>()
            .add_systems(EguiPrimaryContextPass, paint.in_set(OverlaySystems));
    }
}

/// Offset of the head of a pin of a body with this number of them.
fn head(pins: usize) -> Vec2 {
    if pins <= MAX_NEEDLES {
        HEAD
    } else {
        Vec2::ZERO
    }
}

/// Distance of a point of the screen from a pin at `tip` of a body with this number of pins
/// [logical px], if it is on it.
#[must_use]
pub fn distance(at: Pos2, tip: Pos2, pins: usize) -> Option<f32> {
    let head = head(pins);
    let along = match head.length_sq() {
        0.0 => 0.0,
        length => ((at - tip).dot(head) / length).clamp(0.0, 1.0),
    };
    let away = at.distance(tip + head * along);
    (away <= REACH).then_some(away)
}

fn paint(
    mut contexts: EguiContexts,
    camera: Single<(&Camera, &GlobalTransform), With<OrbitCamera>>,
    hovered: Res<HoveredPin>,
    bodies: Query<(Entity, &SoftBody, &Pins, &Drawn)>,
) -> Result {
    let painter = painter(contexts.ctx_mut()?);
    let (camera, eye) = *camera;
    let screen = Screen { camera, eye };
    for (entity, body, pins, drawn) in &bodies {
        let head = head(pins.len());
        for &pin in pins.iter() {
            let place = drawn.particles.get(body.particle(pin));
            let Some(tip) = place.and_then(|x| screen.at(x.truncate())) else {
                continue;
            };
            let is_hovered = hovered.0 == Some((entity, pin));
            let (radius, color, edge) = match is_hovered {
                true => (6.0, HOVERED, 1.5),
                false if pins.len() > MANY => (1.5, PIN, 0.5),
                false if head == Vec2::ZERO => (3.0, PIN, 1.5),
                false => (4.5, PIN, 1.5),
            };
            if head != Vec2::ZERO {
                painter.line_segment([tip, tip + head], Stroke::new(4.0, Color32::WHITE));
                painter.line_segment([tip, tip + head], Stroke::new(2.0, NEEDLE));
            }
            painter.circle(tip + head, radius, color, Stroke::new(edge, Color32::WHITE));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pin_is_pointed_at_by_its_tip_its_needle_and_its_head_and_not_beside() {
        let tip = Pos2::new(100.0, 100.0);
        for at in [tip, tip + HEAD, tip + HEAD * 0.5] {
            assert_eq!(distance(at, tip, 1), Some(0.0));
        }
        assert_eq!(distance(tip + HEAD * 2.0, tip, 1), None);
        assert_eq!(distance(tip + HEAD, tip, MAX_NEEDLES + 1), None);
    }
}
