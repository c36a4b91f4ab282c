//! Draws the analytic solutions of bodies at rest over them.

use crate::{
    sandbox::{
        render::{
            camera::OrbitCamera,
            overlay::{Screen, painter},
        },
        state::view::ViewSettings,
    },
    scene::{AnswerCurve, AnswerSubject, CurrentScene},
    simulation::{BodyDensity, SimulationSettings, SoftBody, carried::Carried},
    solver::Particles,
};
use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{Color32, Shape, Stroke},
};

const LINE: Color32 = Color32::from_rgb(20, 28, 44);
const HALO: Color32 = Color32::from_rgba_premultiplied(170, 170, 170, 170);
/// Length of dashes and gaps [px].
const DASH: (f32, f32) = (7.0, 5.0);

/// Draws the analytic solutions of the scene while the view shows them.
pub struct AnswerPlugin;

impl Plugin for AnswerPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(
            EguiPrimaryContextPass,
            paint.run_if(|view: Res<ViewSettings>| view.answers),
        );
    }
}

/// Curves of the last frame with their points, which are recomputed only when a parameter changes.
type Known = Vec<(AnswerCurve, Option<Vec<Vec3>>)>;

fn paint(
    mut contexts: EguiContexts,
    camera: Single<(&Camera, &GlobalTransform), With<OrbitCamera>>,
    scene: Option<Res<CurrentScene>>,
    settings: Res<SimulationSettings>,
    bodies: Query<(&Name, &SoftBody, &Particles, &BodyDensity, Carried)>,
    mut known: Local<Known>,
) -> Result {
    let Some(scene) = scene else {
        return Ok(());
    };
    let painter = painter(contexts.ctx_mut()?);
    let (camera, eye) = *camera;
    let screen = Screen { camera, eye };
    let mut drawn = Known::new();
    for answer in &scene.scene.answers {
        let of_body = bodies
            .iter()
            .find(|(name, ..)| name.as_str() == answer.body());
        let Some((_, body, particles, density, carried)) = of_body else {
            continue;
        };
        let subject = AnswerSubject {
            topology: body,
            positions: &particles.positions,
            effects: &carried.effects(),
            density: density.0,
        };
        let Some(curve) = answer.curve(&subject, settings.gravity) else {
            continue;
        };
        let place = known.iter().position(|(other, _)| *other == curve);
        let (curve, points) = match place {
            Some(place) => known.swap_remove(place),
            None => (curve, curve.points()),
        };
        if let Some(points) = &points {
            let line: Vec<_> = points
                .iter()
                .filter_map(|&point| screen.at(point))
                .collect();
            for (color, width) in [(HALO, 4.5), (LINE, 2.0)] {
                let stroke = Stroke::new(width, color);
                painter.extend(Shape::dashed_line(&line, stroke, DASH.0, DASH.1));
            }
        }
        drawn.push((curve, points));
    }
    *known = drawn;
    Ok(())
}
