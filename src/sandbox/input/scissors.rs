//! Scissors: a stroke of the pointer with Shift held cuts the bodies that it crosses.

use super::pointer::{Pointer, PointerOwner, PointerSystems};
use crate::{
    render::Drawn,
    sandbox::{
        render::{
            camera::OrbitCamera,
            overlay::{LINE, OverlaySystems, painter},
        },
        state::look::HiddenBody,
    },
    simulation::{Action, Actions, SoftBody},
    solver::Cut,
};
use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{Color32, Pos2, Stroke},
};

/// Length of a stroke after which it cuts [logical px]. Shorter ones would have the direction of
/// the pixels.
const STROKE: f32 = 6.0;
/// Number of points of the stroke that are drawn.
const DRAWN: usize = 24;

/// The stroke under way.
#[derive(Resource, Debug, Default)]
pub struct Snip {
    /// Its points on the screen [logical px].
    points: Vec<Vec2>,
}

/// Cuts bodies.
pub struct ScissorsPlugin;

impl Plugin for ScissorsPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Snip>()
            .add_systems(Update, cut.after(PointerSystems))
            .add_systems(EguiPrimaryContextPass, paint.after(OverlaySystems));
    }
}

/// Cuts along each part of the stroke.
fn cut(
    pointer: Res<Pointer>,
    camera: Single<(&Camera, &GlobalTransform), With<OrbitCamera>>,
    bodies: Query<(Entity, &SoftBody, &Drawn), Without<HiddenBody>>,
    mut stroke: ResMut<Snip>,
    mut actions: ResMut<Actions>,
) {
    let at = match (pointer.owner, pointer.position) {
        (PointerOwner::Scissors, Some(at)) => at,
        _ => {
            if !stroke.points.is_empty() {
                stroke.points.clear();
            }
            return;
        }
    };
    let Some(&last) = stroke.points.last() else {
        stroke.points.push(at);
        return;
    };
    if last.distance(at) < STROKE {
        return;
    }
    stroke.points.push(at);
    let (camera, eye) = *camera;
    let ray = |at| camera.viewport_to_world(eye, at).ok();
    let (Some(from), Some(to)) = (ray(last), ray(at)) else {
        return;
    };
    let cut = Cut {
        eye: eye.translation(),
        rays: [*from.direction, *to.direction],
    };
    for (body, topology, drawn) in &bodies {
        let at = |i: u32| {
            drawn
                .particles
                .get(i as usize)
                .map(|x| x.truncate().as_dvec3())
        };
        let crosses = |[a, b]: [u32; 2]| match (at(a), at(b)) {
            (Some(a), Some(b)) => cut.crosses([a, b]),
            _ => false,
        };
        if topology.edges.ends().any(crosses) {
            actions.push(Action::Cut { body, cut });
        }
    }
}

/// Draws the stroke.
fn paint(mut contexts: EguiContexts, stroke: Res<Snip>, pointer: Res<Pointer>) -> Result {
    let from = stroke.points.len().saturating_sub(DRAWN);
    let points = stroke.points[from..].iter().copied();
    let line: Vec<Pos2> = points
        .chain(pointer.position)
        .map(|at| Pos2::new(at.x, at.y))
        .collect();
    if !stroke.points.is_empty() && line.len() > 1 {
        let painter = painter(contexts.ctx_mut()?);
        painter.line(
            line.clone(),
            Stroke::new(4.5, Color32::from_white_alpha(150)),
        );
        painter.line(line, Stroke::new(1.5, LINE));
    }
    Ok(())
}
