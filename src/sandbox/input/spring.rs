//! Draws the grab as a spring, with its force.

use super::drag::Drag;
use crate::{
    render::Drawn,
    sandbox::{
        render::{
            camera::OrbitCamera,
            overlay::{LINE, OverlaySystems, Screen, painter},
        },
        state::view::ViewSettings,
        ui::{area, number},
    },
    simulation::SimulationSettings,
    solver::{EffectStates, Grab, Stretch},
};
use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{Align2, Color32, CornerRadius, FontId, Painter, Pos2, Rect, Stroke, vec2},
};

const HALO: Color32 = Color32::from_rgba_premultiplied(150, 150, 150, 150);
const PATCH: Color32 = Color32::from_rgb(255, 196, 64);
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
    bodies: Query<(&Drawn, &EffectStates, Option<&Stretch>, Option<&Grab>)>,
    settings: Res<SimulationSettings>,
    view: Res<ViewSettings>,
) -> Result {
    let Some(held) = drag.held else {
        return Ok(());
    };
    let Ok((drawn, states, stretch, grab)) = bodies.get(held.body) else {
        return Ok(());
    };
    // Its number may have changed in a tick of this frame.
    let grab = grab.filter(|_| held.taken);
    let point = grab.map_or(held.point, |grab| grab.point);
    if !point.fits(drawn.particles.len()) {
        return Ok(());
    }
    let (camera, eye) = *camera;
    let screen = Screen { camera, eye };
    let ends = (
        screen.at(point.position(&drawn.particles)),
        screen.at(held.target),
    );
    let (Some(from), Some(to)) = ends else {
        return Ok(());
    };
    let context = contexts.ctx_mut()?;
    let painter = painter(context);
    let grab = &states.others.grab;
    patch(&painter, &screen, drawn, grab.patch());
    let line = coil(from, to);
    painter.line(line.clone(), Stroke::new(4.5, HALO));
    painter.line(line, Stroke::new(2.0, LINE));
    painter.circle(from, 4.0, Color32::WHITE, Stroke::new(2.0, LINE));
    painter.circle_stroke(to, 7.0, Stroke::new(4.5, HALO));
    painter.circle_stroke(to, 7.0, Stroke::new(2.0, LINE));
    let first = match held.pins {
        true => match grab.patch().len() {
            0 | 1 => "pin".to_owned(),
            pins => format!("{pins} pins"),
        },
        false => force(grab.force(settings.substep_seconds() as f32)),
    };
    let compliance = stretch.map(|stretch| stretch.compliance.get());
    let second = hint(compliance, settings.substeps.get());
    let free = area::free(context, &view);
    label(&painter, to + vec2(16.0, -26.0), free, [&first, &second]);
    Ok(())
}

/// What the arrow keys change, with the current values. The compliance is in m/N.
fn hint(compliance: Option<f32>, substeps: u32) -> String {
    let substeps = format!("⏴⏵ substeps {substeps}");
    match compliance {
        Some(compliance) => {
            let compliance = number::format(compliance.into(), 2);
            format!("⏶⏷ compliance {compliance} m/N · {substeps}")
        }
        None => substeps,
    }
}

/// Draws the particles of a grabbed patch, by weight.
fn patch(painter: &Painter, screen: &Screen, drawn: &Drawn, patch: &[(usize, f64)]) {
    let heaviest = patch.iter().fold(0.0, |most, (_, weight)| weight.max(most));
    for (i, weight) in patch {
        let place = drawn.particles.get(*i);
        if let Some(at) = place.and_then(|x| screen.at(x.truncate())) {
            let part = (weight / heaviest) as f32;
            let color = PATCH.gamma_multiply(0.25 + 0.75 * part);
            painter.circle_filled(at, 1.5 + 2.0 * part, color);
        }
    }
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

/// Draws two lines at a point, moved so that they are within the free part of the window.
fn label(painter: &Painter, at: Pos2, free: Rect, [first, second]: [&str; 2]) {
    let line = |text: &str, size: f32, color: Color32| {
        painter.layout_no_wrap(text.to_owned(), FontId::proportional(size), color)
    };
    let first = line(first, 13.0, Color32::WHITE);
    let second = line(second, 11.5, Color32::from_rgb(200, 208, 220));
    let size = vec2(
        first.size().x.max(second.size().x),
        first.size().y + second.size().y,
    );
    let rect = Align2::LEFT_CENTER
        .anchor_size(at, size)
        .expand2(vec2(7.0, 3.0));
    let right = (free.right() - rect.right()).min(0.0);
    let up = (free.top() - rect.top()).max(0.0);
    let rect = rect.translate(vec2(right.max(free.left() - rect.left()), up));
    painter.rect_filled(
        rect,
        CornerRadius::same(9),
        Color32::from_rgba_unmultiplied(22, 28, 38, 220),
    );
    let corner = rect.min + vec2(7.0, 3.0);
    let below = vec2(0.0, first.size().y);
    painter.galley(corner, first, Color32::WHITE);
    painter.galley(corner + below, second, Color32::WHITE);
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
    fn the_hint_names_the_keys_with_the_live_values() {
        assert_eq!(
            hint(Some(1.5e-4), 10),
            "⏶⏷ compliance 1.5e-4 m/N · ⏴⏵ substeps 10"
        );
        assert_eq!(hint(None, 4), "⏴⏵ substeps 4");
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
