//! The card of the first steps: three hints at the first start, each of which disappears when it
//! has been followed.

use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPrimaryContextPass,
    egui::{
        Align2, Area, Button, Context, Frame, Id, Label, Margin, Order, Rect, RichText, Stroke,
        vec2,
    },
};

use crate::{
    sandbox::{
        lab::reference_overlay::ReferenceOverlay,
        state::{
            first_steps::{FirstStep, FirstSteps},
            view::{LastGrab, ViewSettings},
        },
        ui::{WidgetRects, area, theme},
    },
    simulation::{Action, Applied},
};

/// Width of the text [logical px].
const WIDTH: f32 = 240.0;
/// Distance of the card from the bottom of the window [logical px]: above the time strip.
const BOTTOM: f32 = 72.0;

/// Rectangles of the card's widgets, for the journal.
#[derive(Resource, Debug, Default, Deref)]
pub struct FirstStepRects(WidgetRects);

/// Shows the first steps.
pub struct FirstStepsPlugin;

impl Plugin for FirstStepsPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<FirstSteps>()
            .init_resource::<FirstStepRects>()
            .init_resource::<LastGrab>()
            .init_resource::<ViewSettings>()
            .add_message::<Applied>()
            .add_systems(Update, follow)
            .add_systems(EguiPrimaryContextPass, show);
    }
}

/// Completes the steps that the user has taken.
fn follow(
    mut steps: ResMut<FirstSteps>,
    grab: Res<LastGrab>,
    mut applied: MessageReader<Applied>,
    overlay: Option<Res<ReferenceOverlay>>,
) {
    let turned = applied.read().any(|applied| {
        matches!(
            applied.action,
            Action::SetParameter { .. } | Action::SetSetting { .. }
        )
    });
    let done = match steps.now() {
        None => return,
        // The step is complete when the body is released.
        Some(FirstStep::Drag) => grab.is_changed() && grab.0.is_some_and(|grab| !grab.held),
        Some(FirstStep::Turn) => turned,
        Some(FirstStep::Reference) => overlay.is_some(),
    };
    if let Some(step) = steps.now().filter(|_| done) {
        steps.complete(step);
    }
}

fn show(
    mut contexts: EguiContexts,
    mut steps: ResMut<FirstSteps>,
    mut rects: ResMut<FirstStepRects>,
    view: Res<ViewSettings>,
) -> Result {
    let Some(step) = steps.now() else {
        if rects.0 != WidgetRects::default() {
            rects.0.clear();
        }
        return Ok(());
    };
    let context = contexts.ctx_mut()?;
    let (skipped, places) = draw(context, step, area::free(context, &view));
    if rects.0 != places {
        rects.0 = places;
    }
    if skipped {
        steps.skip();
    }
    Ok(())
}

/// Title and text of a step.
const fn words(step: FirstStep) -> (&'static str, &'static str) {
    match step {
        FirstStep::Drag => (
            "Drag a body",
            "Press the left mouse button on it and pull. The force is shown in newtons.",
        ),
        FirstStep::Turn => (
            "Change a parameter",
            "Drag a slider in the panel, or press Up and Down to make the body softer and stiffer.",
        ),
        FirstStep::Reference => (
            "Compare with the reference",
            "Press G: the same body is simulated in double precision with smaller substeps, and \
             drawn over it.",
        ),
    }
}

/// Draws the card at the lower left of an area. Returns whether the steps are skipped, and the
/// rectangles of the widgets.
pub fn draw(context: &Context, step: FirstStep, free: Rect) -> (bool, WidgetRects) {
    let mut places = WidgetRects::default();
    let (title, text) = words(step);
    let corner = vec2(free.left() - context.content_rect().left() + 16.0, -BOTTOM);
    let skipped = Area::new(Id::new("first steps"))
        .order(Order::Middle)
        .anchor(Align2::LEFT_BOTTOM, corner)
        .show(context, |ui| {
            Frame::new()
                .fill(theme::of(ui).veil)
                .stroke(Stroke::new(1.0, theme::of(ui).accent))
                .corner_radius(8.0)
                .inner_margin(Margin::symmetric(14, 10))
                .show(ui, |ui| {
                    ui.set_width(WIDTH.min(free.width() - 64.0));
                    let number = format!("Step {} of 3", step.number());
                    ui.label(RichText::new(number).small().color(theme::of(ui).weak));
                    ui.label(RichText::new(title).heading().color(theme::of(ui).strong));
                    ui.add(Label::new(text).wrap());
                    ui.add_space(4.0);
                    let button = ui.add(Button::new("Skip")).on_hover_text(
                        "End the first steps. They can be shown again in the section Settings of \
                         the panel.",
                    );
                    places.note("first_steps.skip", &button, ui.clip_rect());
                    button.clicked()
                })
                .inner
        })
        .inner;
    (skipped, places)
}
