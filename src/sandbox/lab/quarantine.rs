//! The card of bodies in quarantine: which bodies, where and why, with a button to restore each
//! from its last finite state.

use crate::sandbox::state::request::{Request, Requested};
use std::collections::BTreeMap;

use bevy::prelude::*;
use bevy_egui::{
    EguiContext, EguiPrimaryContextPass, PrimaryEguiContext,
    egui::{
        self, Align2, Area, Button, Frame, Id, Label, Margin, Order, Rect, RichText, Stroke, Vec2,
        vec2,
    },
};

use crate::{
    sandbox::{
        state::view::ViewSettings,
        ui::{WidgetRects, area, theme},
    },
    simulation::{
        Action, Applied, BodyQuarantined, Quarantined, SimulationClock, plain::bodies_in_order,
    },
    solver::Quarantine,
};

/// Maximum number of bodies with a row of their own; for more, only their number is shown.
const MAX_ROWS: usize = 4;
/// Ticks after which a restored body counts as stable.
const SOON: u64 = 60;

/// A body in quarantine, as shown on the card.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct QuarantinedBody {
    /// Key of the body in requests.
    pub key: u64,
    /// Its name.
    pub name: String,
    /// Vertex and reason.
    pub reason: String,
    /// Whether it had just been restored when it diverged again.
    pub again: bool,
}

/// Rectangles of the buttons, for the journal.
#[derive(Resource, Debug, Default, Deref)]
pub struct QuarantineRects(WidgetRects);

/// Shown when a body diverges right after it was restored. Restarting would not help, as changes
/// made in the panel survive a restart.
const AGAIN: &str = "The body diverged right after it was restored, so the cause is still there: undo the \
                     last change, or reopen the scene.";

/// The tick in which each body was last restored, and whether it diverged again soon after.
#[derive(Resource, Debug, Default)]
struct Restored(BTreeMap<Entity, (u64, bool)>);

/// Shows the bodies that are in quarantine.
pub struct QuarantinePlugin;

impl Plugin for QuarantinePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<QuarantineRects>()
            .init_resource::<Restored>()
            .init_resource::<ViewSettings>()
            .add_message::<Requested>()
            .add_systems(Update, remember)
            .add_systems(EguiPrimaryContextPass, show);
    }
}

/// Location and reason, as part of a sentence.
#[must_use]
pub fn reason(quarantine: &Quarantine) -> String {
    let Quarantine { vertex, stage, .. } = quarantine;
    if *stage == Quarantine::INPUT {
        format!("non-finite input for vertex {vertex}")
    } else {
        format!("non-finite state of vertex {vertex} after {stage}")
    }
}

fn remember(
    mut restored: ResMut<Restored>,
    clock: Res<SimulationClock>,
    mut applied: MessageReader<Applied>,
    mut quarantined: MessageReader<BodyQuarantined>,
    bodies: Query<()>,
) {
    for Applied { tick, action, .. } in applied.read() {
        if let Action::Restore { body } = action {
            restored.0.insert(*body, (*tick, false));
        }
    }
    for message in quarantined.read() {
        if let Some((tick, in_vain)) = restored.0.get_mut(&message.body) {
            *in_vain = clock.tick().saturating_sub(*tick) <= SOON;
        }
    }
    restored.0.retain(|body, _| bodies.contains(*body));
}

fn show(world: &mut World) -> Result {
    let quarantine: Vec<QuarantinedBody> = bodies_in_order(world)
        .into_iter()
        .filter_map(|body| {
            let entity = world.entity(body);
            let quarantine = entity.get::<Quarantined>()?;
            let restored = world.resource::<Restored>().0.get(&body);
            Some(QuarantinedBody {
                key: body.to_bits(),
                name: entity
                    .get::<Name>()
                    .map_or_else(|| body.to_string(), Name::to_string),
                reason: reason(quarantine),
                again: restored.is_some_and(|(_, in_vain)| *in_vain),
            })
        })
        .collect();
    let mut places = WidgetRects::default();
    if !quarantine.is_empty() {
        let context = world
            .query_filtered::<&mut EguiContext, With<PrimaryEguiContext>>()
            .single_mut(world)?
            .get_mut()
            .clone();
        let free = area::free(&context, world.resource::<ViewSettings>());
        for key in draw(&context, &quarantine, free, &mut places) {
            world.write_message(Requested(Request::Restore(key)));
        }
    }
    let mut known = world.resource_mut::<QuarantineRects>();
    if known.0 != places {
        known.0 = places;
    }
    Ok(())
}

/// Draws the card over the area that the panel leaves free. Returns the keys of the bodies to
/// restore.
pub fn draw(
    context: &egui::Context,
    bodies: &[QuarantinedBody],
    free: Rect,
    places: &mut WidgetRects,
) -> Vec<u64> {
    let mut pressed = Vec::new();
    Area::new(Id::new("quarantine"))
        .order(Order::Foreground)
        .anchor(
            Align2::CENTER_TOP,
            area::off_center(context, free) + vec2(0.0, 64.0),
        )
        .show(context, |ui| {
            Frame::new()
                .fill(theme::of(ui).veil)
                .stroke(Stroke::new(1.0, theme::of(ui).alarm))
                .corner_radius(6.0)
                .inner_margin(Margin::symmetric(14, 10))
                .show(ui, |ui| {
                    ui.set_max_width(460.0);
                    for body in bodies.iter().take(MAX_ROWS) {
                        if line(ui, body, places) {
                            pressed.push(body.key);
                        }
                    }
                    if bodies.iter().any(|body| body.again) {
                        let text = RichText::new(AGAIN).color(theme::of(ui).changed);
                        ui.add(Label::new(text).wrap());
                    }
                    if bodies.len() > 1 && all(ui, bodies.len(), places) {
                        pressed = bodies.iter().map(|body| body.key).collect();
                    }
                });
        });
    pressed
}

/// The row of one body; true if it is to be restored.
fn line(ui: &mut egui::Ui, body: &QuarantinedBody, places: &mut WidgetRects) -> bool {
    let QuarantinedBody { name, reason, .. } = body;
    let again = if body.again { " again" } else { "" };
    let text = format!("{name} diverged{again} and is paused: {reason}");
    ui.add(Label::new(RichText::new(text).color(theme::of(ui).strong)).wrap());
    let help = "Resume from the last finite state, the start of the tick in which the body diverged, at zero velocity";
    let button = Button::new("Restore last finite state").min_size(Vec2::new(0.0, theme::ROW));
    let response = ui.add(button).on_hover_text(help);
    places.note(format!("restore.{name}"), &response, ui.clip_rect());
    ui.add_space(4.0);
    response.clicked()
}

/// The row with the number of bodies; true if all are to be restored.
fn all(ui: &mut egui::Ui, count: usize, places: &mut WidgetRects) -> bool {
    let text = match count.saturating_sub(MAX_ROWS) {
        0 => format!("Restore all {count}"),
        more => format!("Restore all {count} (these and {more} more)"),
    };
    let response = ui.add(Button::new(text).min_size(Vec2::new(0.0, theme::ROW)));
    places.note("restore.all", &response, ui.clip_rect());
    response.clicked()
}
