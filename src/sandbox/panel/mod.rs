//! The panel: scene, bodies, effects and world settings as editable numbers.
//!
//! Three separate steps per frame: `gather` builds a plain [`PanelModel`] from the ECS, `draw`
//! turns it into a picture and a list of [`Request`]s, and the app [carries them
//! out](crate::sandbox::app::requests). Only the first and the last access the simulation; only the
//! second uses egui.

mod bodies;
pub mod browser;
mod draw;
mod drawn;
mod effective;
mod effects;
pub mod energy;
mod essentials;
pub mod figures;
mod file;
pub mod first_steps;
mod fractions;
pub(in crate::sandbox) mod gather;
mod hands;
pub mod help;
pub mod history;
pub mod hud;
pub mod model;
mod parameter;
pub mod query;
mod reference_overlay;
pub(in crate::sandbox) mod restart;
mod scene;
pub(in crate::sandbox) mod scene_defaults;
pub mod search;
mod section;
mod settings;
mod spawn;
pub mod time_strip;
mod world;

pub use drawn::Panel;
pub use model::{Addition, Additions, PanelModel};
pub use scene_defaults::{SceneDefaults, SceneSettings};

use bevy::prelude::*;
use bevy_egui::{
    EguiContext, EguiPrimaryContextPass, PrimaryEguiContext,
    egui::{
        Area, Context, CursorIcon, Frame, Id, Margin, Order, Rect, Sense, Stroke, Ui, pos2, vec2,
    },
};

use crate::sandbox::{
    render::{quality::EffectiveQuality, readiness::FirstPicture},
    state::{
        display::{DisplayChange, DisplaySettings, PANEL_WIDTHS, Side},
        event::SceneLoaded,
        keep::{RecentFiles, RecordingStatus},
        presets::Presets,
        request::{Request, RequestSystems, Requested},
        search::PanelSearch,
        selection::{Scope, Selection},
        time::TimeView,
        view::{LastGrab, ViewCommand, ViewSettings},
    },
    ui::{WidgetRects, message::Notices, scale::InterfaceScale, theme},
};
use crate::simulation::{Measuring, Profile};

/// Rectangles of the panel's widgets, for the journal.
#[derive(Resource, Debug, Default, Deref)]
pub struct PanelRects(WidgetRects);

/// The panel.
pub struct PanelPlugin;

impl Plugin for PanelPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<fractions::Fractions>()
            .init_resource::<effective::Works>()
            .init_resource::<history::History>()
            .init_resource::<energy::EnergyTrack>()
            .init_resource::<Selection>()
            .init_resource::<Additions>()
            .init_resource::<PanelRects>()
            .init_resource::<ViewSettings>()
            .init_resource::<DisplaySettings>()
            .init_resource::<EffectiveQuality>()
            .init_resource::<InterfaceScale>()
            .init_resource::<LastGrab>()
            .init_resource::<Notices>()
            .init_resource::<RecentFiles>()
            .init_resource::<RecordingStatus>()
            .init_resource::<SceneSettings>()
            .init_resource::<PanelSearch>()
            .init_resource::<Presets>()
            .add_message::<Requested>()
            .add_message::<ViewCommand>()
            .add_message::<SceneLoaded>()
            .add_systems(PreUpdate, scene_defaults::remember)
            .add_systems(
                Update,
                (
                    show_held.in_set(RequestSystems),
                    forget_what_was_shown.after(RequestSystems),
                    measure_what_is_shown,
                    tell_hidden,
                ),
            )
            .init_resource::<TimeView>()
            .init_resource::<time_strip::TimeStripRects>()
            .add_systems(EguiPrimaryContextPass, (panel, time_strip::strip).chain());
    }
}

/// Selects a body when it is grabbed, unless it is selected with others, and deselects bodies that
/// were removed.
pub(in crate::sandbox) fn show_held(
    grab: Res<LastGrab>,
    mut selection: ResMut<Selection>,
    bodies: Query<()>,
) {
    if let Some(grab) = grab.0.filter(|point| point.held && grab.is_changed())
        && !selection.0.names(grab.body.to_bits())
    {
        selection.0 = Scope::body(grab.body);
    }
    let exists = |key| Entity::try_from_bits(key).is_some_and(|body| bodies.contains(body));
    if selection.0.keys().any(|key| !exists(key)) {
        selection.0 = selection.0.retained(exists);
    }
}

/// Clears measurements when the selection changes.
fn forget_what_was_shown(selection: Res<Selection>, mut works: ResMut<effective::Works>) {
    if selection.is_changed() {
        works.clear();
    }
}

/// Time per part is measured only while the panel is visible, as it is not free.
fn measure_what_is_shown(
    view: Res<ViewSettings>,
    mut profile: ResMut<Profile>,
    mut measuring: ResMut<Measuring>,
) {
    profile.by_part = view.panel_visible;
    measuring.0 = true;
}

/// Says how a hidden panel is shown, when it is hidden and when the window opens without it.
fn tell_hidden(
    view: Res<ViewSettings>,
    first: Option<Res<FirstPicture>>,
    mut notices: ResMut<Notices>,
    mut told: Local<bool>,
) {
    let seen = first.is_none_or(|first| first.is_done());
    if view.panel_visible {
        *told = false;
    } else if seen && !*told {
        *told = true;
        notices.info("The panel is hidden: H shows it");
    }
}

/// Width of the panel [logical px] in a window of a width: the chosen one, if it leaves two fifths
/// of the window to the view.
fn width(chosen: f32, window: f32) -> f32 {
    chosen
        .min(0.6 * window)
        .max(*PANEL_WIDTHS.start())
        .min(window)
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
    if model.search.focus {
        world.resource_mut::<PanelSearch>().focus = false;
    }
    let mut places = world.resource_mut::<PanelRects>();
    if places.0 != *panel.places() {
        places.0 = panel.places().clone();
    }
    let mut view = world.resource_mut::<ViewSettings>();
    if (view.panel_width, view.panel_side) != (covered, model.display.side) {
        (view.panel_width, view.panel_side) = (covered, model.display.side);
    }
    for request in panel.requests() {
        world.write_message(Requested(request.clone()));
    }
    for message in panel.refusals() {
        world.resource_mut::<Notices>().warn(message.as_str());
    }
    Ok(())
}

/// Draws the panel at one side of the window, and returns it with the width that it covers. Its
/// inner edge can be dragged.
///
/// A separate area instead of one of egui's side panels: those are in the background layer, where
/// egui treats a pointer over them as over the scene.
pub fn show(context: &Context, model: &PanelModel) -> (Panel, f32) {
    let window = context.content_rect();
    let width = width(model.display.panel_width, window.width());
    let left = match model.display.side {
        Side::Left => window.left(),
        Side::Right => window.right() - width,
    };
    let rect = Rect::from_min_size(pos2(left, window.top()), vec2(width, window.height()));
    let margin = Margin::symmetric(12, 10);
    let area = Area::new(Id::new("panel"))
        .order(Order::Middle)
        .fixed_pos(rect.min)
        .constrain(false)
        // A fading panel would show through.
        .fade_in(false)
        .show(context, |ui| {
            let mut panel = Frame::new()
                .fill(theme::of(ui).ground)
                .stroke(Stroke::new(1.0, theme::of(ui).line))
                .inner_margin(margin)
                .show(ui, |ui| {
                    let inside = rect.size() - margin.sum() - bevy_egui::egui::Vec2::splat(2.0);
                    ui.set_width(inside.x);
                    ui.set_height(inside.y);
                    Panel::draw(ui, model)
                })
                .inner;
            drag_edge(ui, &mut panel, rect, model.display.side);
            panel
        });
    (area.inner, width)
}

/// The inner edge of the panel, which changes its width when it is dragged.
fn drag_edge(ui: &Ui, panel: &mut Panel, rect: Rect, side: Side) {
    /// Width of the part that can be dragged [logical px].
    const GRIP: f32 = 5.0;
    let edge = match side {
        Side::Left => rect.right(),
        Side::Right => rect.left(),
    };
    let grip = match side {
        Side::Left => Rect::from_x_y_ranges(edge - GRIP..=edge, rect.y_range()),
        Side::Right => Rect::from_x_y_ranges(edge..=edge + GRIP, rect.y_range()),
    };
    let response = ui.interact(grip, ui.id().with("edge"), Sense::drag());
    panel.note("panel.edge", &response, ui);
    if response.hovered() || response.dragged() {
        ui.set_cursor_icon(CursorIcon::ResizeHorizontal);
        let line = Stroke::new(2.0, theme::of(ui).accent);
        ui.painter().vline(grip.center().x, rect.y_range(), line);
    }
    if let Some(pointer) = response
        .interact_pointer_pos()
        .filter(|_| response.dragged())
    {
        let width = match side {
            Side::Left => pointer.x - rect.left(),
            Side::Right => rect.right() - pointer.x,
        };
        panel.ask(Request::Display(DisplayChange::PanelWidth(width)));
    }
}
