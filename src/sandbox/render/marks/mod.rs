//! Marks of bodies out of view: an arrow with the body's name at the edge of the free area. A click
//! frames the body.

mod draw;
mod place;

pub use draw::draw;
pub use place::{Mark, OutOfView, is_in_view, place};

use super::{camera::OrbitCamera, free_area::FreeArea, overlay::OverlaySystems};
use crate::{
    render::Drawn,
    sandbox::state::{
        request::{Request, Requested},
        view::ViewSettings,
    },
};
use bevy::{prelude::*, window::PrimaryWindow};
use bevy_egui::{EguiContexts, EguiPrimaryContextPass};

/// Points of a body that are tested.
const SAMPLES: usize = 48;

/// Draws the marks.
pub struct MarksPlugin;

impl Plugin for MarksPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(EguiPrimaryContextPass, show.after(OverlaySystems));
    }
}

fn show(
    mut contexts: EguiContexts,
    view: Res<ViewSettings>,
    window: Single<&Window, With<PrimaryWindow>>,
    camera: Single<&OrbitCamera>,
    bodies: Query<(Entity, &Name, &Drawn)>,
    mut requests: MessageWriter<Requested>,
) -> Result {
    let area = FreeArea::new(&view, window.size());
    let orbit = camera.now;
    let out = bodies.iter().filter_map(|(entity, name, drawn)| {
        let center = orbit.seen(drawn.center());
        let step = drawn.points.len().div_ceil(SAMPLES).max(1);
        let samples = drawn.points.iter().step_by(step);
        let seen = samples.map(|point| orbit.seen(*point));
        let hidden = center.is_finite() && !is_in_view([center].into_iter().chain(seen), &area);
        hidden.then(|| OutOfView {
            key: entity.to_bits(),
            name: name.to_string(),
            center,
        })
    });
    let marks = place(out, &area);
    if marks.is_empty() {
        return Ok(());
    }
    if let Some(bodies) = draw(contexts.ctx_mut()?, &marks) {
        requests.write(Requested(Request::Frame(bodies)));
    }
    Ok(())
}
