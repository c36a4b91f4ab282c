//! The panel: what is simulated and how, as numbers that can be moved.
//!
//! Three steps a frame, each on its own: `gather` makes a plain [`PanelModel`] of the ECS,
//! `draw` turns it into a picture and a list of [`Request`]s, and `apply` carries those out.
//! Only the first and the last know the simulation; only the second knows egui.

mod apply;
mod bodies;
mod delivered;
mod draw;
mod effects;
pub mod energy;
mod gather;
pub mod help;
pub mod history;
pub mod hud;
pub mod model;
mod parameter;
mod picker;
mod reference_overlay;
mod restart;
mod scene;
mod scene_defaults;
mod section;
mod world;

pub use draw::Panel;
pub use model::{Addition, PanelModel, Request, SceneEntry, Scope};
pub use scene_defaults::{SceneDefaults, SceneSettings};

use std::collections::BTreeMap;

use bevy::prelude::*;
use bevy_egui::{
    EguiContext, EguiPrimaryContextPass, PrimaryEguiContext,
    egui::{Area, Context, Frame, Id, Margin, Order, Rect, Stroke, pos2},
};

use crate::sandbox::{
    app::load::SceneLoaded,
    render::view::{LastGrab, ViewCommand, ViewSettings},
    ui::{WidgetRects, theme},
};
use crate::simulation::{Measuring, Profile};

/// Something was asked for, by the panel or by a key.
#[derive(Message, Debug, Clone, PartialEq, Deref)]
pub struct PanelRequest(pub Request);

/// What the panel itself remembers.
#[derive(Resource, Debug, Default)]
pub struct PanelState {
    /// Whose parameters are shown.
    pub scope: Scope,
    /// Shares of time by effect and stage, smoothed over about a second so that they can be read.
    shares: BTreeMap<&'static str, f32>,
    /// What the solver delivered of late, by effect.
    works: delivered::Works,
    /// Where the time of the last ticks went.
    history: history::History,
    /// What bodies held after the last ticks.
    energies: energy::EnergyTrack,
    /// How often bodies were shuffled; the seed of the next time.
    shuffles: u32,
}

/// Where the panel's widgets are; for the journal.
#[derive(Resource, Debug, Default, Deref)]
pub struct PanelRects(WidgetRects);

/// Systems that carry out what was asked for, in `Update`.
#[derive(SystemSet, Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct PanelSystems;

/// The panel.
pub struct PanelPlugin;

impl Plugin for PanelPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<PanelState>()
            .init_resource::<PanelRects>()
            .init_resource::<ViewSettings>()
            .init_resource::<LastGrab>()
            .init_resource::<SceneSettings>()
            .init_resource::<picker::Picker>()
            .init_resource::<restart::Carried>()
            .add_message::<PanelRequest>()
            .add_message::<ViewCommand>()
            .add_message::<SceneLoaded>()
            .add_systems(
                PreUpdate,
                (restart::begin, scene_defaults::remember).chain(),
            )
            .add_systems(
                Update,
                (
                    (show_held, apply::carry_out, apply::report_refusals)
                        .chain()
                        .in_set(PanelSystems),
                    measure_what_is_shown,
                ),
            )
            .add_systems(EguiPrimaryContextPass, panel);
    }
}

/// Taking hold of a body shows its own parameters; a body that is gone is not shown.
fn show_held(grab: Res<LastGrab>, mut state: ResMut<PanelState>, bodies: Query<()>) {
    if let Some(grab) = grab.0.filter(|point| point.held && grab.is_changed()) {
        state.scope = Scope::Body(grab.body.to_bits());
        state.works.clear();
    }
    if let Scope::Body(key) = state.scope
        && Entity::try_from_bits(key).is_none_or(|body| !bodies.contains(body))
    {
        state.scope = Scope::All;
    }
}

/// Times by part cost something, so they are taken only while somebody can see them.
fn measure_what_is_shown(
    view: Res<ViewSettings>,
    mut profile: ResMut<Profile>,
    mut measuring: ResMut<Measuring>,
) {
    profile.by_part = view.panel_visible;
    measuring.0 = true;
}

/// Width of the panel in a window of a width [logical px].
fn width(window: f32) -> f32 {
    if window < 1000.0 { 328.0 } else { 344.0 }
}

fn panel(world: &mut World) -> Result {
    let context = world
        .query_filtered::<&mut EguiContext, With<PrimaryEguiContext>>()
        .single_mut(world)?
        .get_mut()
        .clone();
    if !world.resource::<ViewSettings>().panel_visible {
        world.resource_mut::<PanelRects>().0.clear();
        world.resource_mut::<ViewSettings>().panel_width = 0.0;
        return Ok(());
    }
    let model = gather::model(world);
    let (panel, covered) = show(&context, &model);
    let mut places = world.resource_mut::<PanelRects>();
    if places.0 != *panel.places() {
        places.0 = panel.places().clone();
    }
    let mut view = world.resource_mut::<ViewSettings>();
    if view.panel_width != covered {
        view.panel_width = covered;
    }
    for request in panel.requests() {
        world.write_message(PanelRequest(request.clone()));
    }
    Ok(())
}

/// Draws the panel at the right side of the window; with it, the width that it covers.
///
/// An area of its own, not one of egui's side panels: those lie in the background layer, where
/// egui takes the pointer over them for the pointer over the scene.
pub fn show(context: &Context, model: &PanelModel) -> (Panel, f32) {
    let window = context.content_rect();
    let width = width(window.width()).min(window.width());
    let rect = Rect::from_min_max(pos2(window.right() - width, window.top()), window.max);
    let margin = Margin::symmetric(12, 10);
    let area = Area::new(Id::new("panel"))
        .order(Order::Middle)
        .fixed_pos(rect.min)
        .constrain(false)
        .show(context, |ui| {
            Frame::new()
                .fill(theme::GROUND)
                .stroke(Stroke::new(1.0, theme::LINE))
                .inner_margin(margin)
                .show(ui, |ui| {
                    let inside = rect.size() - margin.sum() - bevy_egui::egui::Vec2::splat(2.0);
                    ui.set_width(inside.x);
                    ui.set_height(inside.y);
                    Panel::draw(ui, model)
                })
                .inner
        });
    (area.inner, width)
}
