//! Draws the grab as a spring, with its force.

use super::drag::Drag;
use crate::{
    render::Drawn,
    sandbox::render::{
        camera::OrbitCamera,
        overlay::{LINE, OverlaySystems, Screen, painter},
    },
    simulation::SimulationSettings,
    solver::EffectStates,
};
use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{Align2, Color32, CornerRadius, FontId, Painter, Pos2, Stroke, vec2},
};

const HALO: Color32 = Color32::from_rgba_premultiplied(150, 150, 150, 150);
/// Number of coils of the drawn spring, and their width [px].
const COILS: (usize, f32) = (9, 5.0);

/// Draws the spring.
pub struct SpringPlugin;

impl Plugin for SpringPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(EguiPrimaryContextPass, paint.after(OverlaySystems));
    }
}

fn paint(
    mut contexts: EguiContexts,
    camera: Single<(&Camera, &GlobalTransform), With<OrbitCamera>>,
    drag: Res<Drag>,
    bodies: Query<(&Drawn, &EffectStates)>,
    settings: Res<SimulationSettings>,
) -> Result {
    let Some(held) = drag.held else {
        return Ok(());
    };
    let Ok((drawn, states)) = bodies.get(held.body) else {
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
    painter.line(line, Stroke::new(2.0, LINE));
    painter.circle(from, 4.0, Color32::WHITE, Stroke::new(2.0, LINE));
    painter.circle_stroke(to, 7.0, Stroke::new(4.5, HALO));
    painter.circle_stroke(to, 7.0, Stroke::new(2.0, LINE));
    let newtons = states.others.grab.force(settings.substep_seconds() as f32);
    label(&painter, to + vec2(16.0, -18.0), &force(newtons));
    Ok(())
}

/// Formats a force with three digits and a fitting unit.
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

/// Outline of a spring between two screen points: straight ends, and coils that stretch with it.
fn coil(from: Pos2, to: Pos2) -> Vec<Pos2> {
    let along = to - from;
    let across = along.normalized().rot90();
    let steps = 2 * COILS.0;
    let mut points = vec![from, from + along * 0.12];
    for step in 0..=steps {
        let fraction = 0.16 + 0.68 * step as f32 / steps as f32;
        let side = match step {
            0 => 0.0,
            last if last == steps => 0.0,
            odd if odd % 2 == 1 => 1.0,
            _ => -1.0,
        };
        // Coils of a short spring are flattened to remain legible.
        let width = COILS.1.min(along.length() * 0.06);
        points.push(from + along * fraction + across * side * width);
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
    fn forces_are_given_in_three_digits_and_a_unit() {
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
