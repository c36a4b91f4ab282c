//! Marks of emitters, a ring with an arrow, and of sinks, a box.

use super::overlay::{LINE, OverlaySystems, Screen, painter};
use crate::{
    sandbox::{render::camera::OrbitCamera, state::look::HiddenBody},
    simulation::SoftBody,
    solver::{BodyEmitter, Emitter, Finite, Particles, Sink},
};
use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{Color32, Stroke},
};

const SOURCE: Color32 = Color32::from_rgb(94, 234, 212);
const DRAIN: Color32 = Color32::from_rgb(251, 146, 60);
/// Segments of a ring.
const RING: usize = 32;
/// Length of an arrow over the radius of its ring.
const ARROW: f32 = 2.0;
/// Smallest radius of a ring [m].
const SMALLEST: f32 = 0.02;

/// Draws the marks.
pub struct OpeningsPlugin;

impl Plugin for OpeningsPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(EguiPrimaryContextPass, paint.in_set(OverlaySystems));
    }
}

fn paint(
    mut contexts: EguiContexts,
    camera: Single<(&Camera, &GlobalTransform), With<OrbitCamera>>,
    emitters: Query<
        (Option<&Emitter>, Option<&BodyEmitter>),
        (With<SoftBody>, Without<HiddenBody>),
    >,
    sinks: Query<(&Sink, &Particles), Without<HiddenBody>>,
) -> Result {
    let painter = painter(contexts.ctx_mut()?);
    let (camera, eye) = *camera;
    let screen = Screen { camera, eye };
    let line = |from: Vec3, to: Vec3, color: Color32| {
        if let (Some(from), Some(to)) = (screen.at(from), screen.at(to)) {
            painter.line_segment([from, to], Stroke::new(3.0, LINE));
            painter.line_segment([from, to], Stroke::new(1.5, color));
        }
    };
    let of_bodies = |emitter: &BodyEmitter| Emitter::from(*emitter);
    let emitters = emitters.iter().flat_map(|(of_grains, other)| {
        let all = [of_grains.copied(), other.map(of_bodies)];
        all.into_iter().flatten()
    });
    for emitter in emitters {
        let center = Finite::vector([emitter.x, emitter.y, emitter.z]).as_vec3();
        let axis = emitter.axis().as_vec3();
        let radius = emitter.opening.get().max(SMALLEST);
        let (u, v) = axis.any_orthonormal_pair();
        let at = |i: usize| {
            let angle = i as f32 / RING as f32 * std::f32::consts::TAU;
            center + (u * angle.cos() + v * angle.sin()) * radius
        };
        for i in 0..RING {
            line(at(i), at(i + 1), SOURCE);
        }
        let tip = center + axis * radius * ARROW;
        line(center, tip, SOURCE);
        for side in [u, -u] {
            line(tip, tip + (side - axis) * radius * 0.4, SOURCE);
        }
    }
    // Copies have the sink of their source.
    let own = |(sink, body): (_, &Particles)| body.emission.source().is_none().then_some(sink);
    let sinks: Vec<&Sink> = sinks.iter().filter_map(own).collect();
    for sink in sinks {
        let center = Finite::vector([sink.x, sink.y, sink.z]).as_vec3();
        let half = Vec3::new(sink.size_x.get(), sink.size_y.get(), sink.size_z.get()) / 2.0;
        let corner = |i: usize| {
            let sign = |bit: usize| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
            center + half * Vec3::new(sign(0), sign(1), sign(2))
        };
        for from in 0..8 {
            for to in [from | 1, from | 2, from | 4] {
                if to != from {
                    line(corner(from), corner(to), DRAIN);
                }
            }
        }
    }
    Ok(())
}
