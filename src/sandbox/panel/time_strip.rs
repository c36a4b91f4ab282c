//! The timeline at the bottom edge: the states of the last seconds, to scrub.

use crate::sandbox::{
    state::{
        request::{Request, Requested},
        time::{TimeStrip, TimeView},
        view::ViewSettings,
    },
    ui::{WidgetRects, area, theme},
};
use bevy::prelude::*;
use bevy_egui::{
    EguiContexts,
    egui::{
        Align2, Area, Context, CornerRadius, CursorIcon, FontSelection, Id, Order, Rect, Response,
        Sense, Stroke, TextStyle, Ui, UiKind, pos2, vec2,
    },
};

/// Height of the strip with its margins [logical px].
pub const HEIGHT: f32 = 34.0;
/// Margin at its ends [logical px], with room for the times.
const SIDE: f32 = 62.0;
/// Distance from a mark within which its title is shown [logical px].
const NEAR: f32 = 5.0;

/// Rectangles of the strip, for the journal.
#[derive(Resource, Debug, Default, Deref)]
pub struct TimeStripRects(WidgetRects);

/// Draws the strip, and requests what is scrubbed.
pub(super) fn strip(
    mut contexts: EguiContexts,
    time: Res<TimeView>,
    mut view: ResMut<ViewSettings>,
    mut rects: ResMut<TimeStripRects>,
    mut requests: MessageWriter<Requested>,
) -> Result {
    let shown = time.strip.is_shown();
    let height = if shown { HEIGHT } else { 0.0 };
    if view.strip_height != height {
        view.strip_height = height;
    }
    let mut places = WidgetRects::default();
    if shown {
        let context = contexts.ctx_mut()?;
        let free = area::free(context, &view);
        let rect = Rect::from_min_size(free.left_bottom(), vec2(free.width(), HEIGHT));
        let (response, scrubbed) = show(context, rect, &time.strip);
        places.note("timeline", &response, rect);
        if let Some(seconds) = scrubbed {
            requests.write(Requested(Request::Scrub(seconds)));
        }
    }
    if rects.0 != places {
        rects.0 = places;
    }
    Ok(())
}

/// Draws the strip into a rectangle. Returns its track, and the time [s] to which it was dragged.
pub fn show(context: &Context, rect: Rect, strip: &TimeStrip) -> (Response, Option<f64>) {
    Area::new(Id::new("timeline"))
        .kind(UiKind::GenericArea)
        .order(Order::Middle)
        .fixed_pos(rect.min)
        .constrain(false)
        .fade_in(false)
        .show(context, |ui| track(ui, rect, strip))
        .inner
}

fn track(ui: &mut Ui, rect: Rect, strip: &TimeStrip) -> (Response, Option<f64>) {
    let colors = theme::of(ui);
    let side = SIDE.min(0.25 * rect.width());
    let bar = Rect::from_center_size(
        rect.center(),
        vec2((rect.width() - 2.0 * side).max(1.0), 6.0),
    );
    let touched = Rect::from_x_y_ranges(
        bar.left() - 8.0..=bar.right() + 8.0,
        rect.top() + 4.0..=rect.bottom() - 4.0,
    );
    let response = ui
        .allocate_rect(touched, Sense::click_and_drag())
        .on_hover_cursor(CursorIcon::ResizeHorizontal);
    let font = FontSelection::Style(TextStyle::Small).resolve(ui.style());
    let painter = ui.painter();
    let back = Rect::from_x_y_ranges(
        rect.left() + 6.0..=rect.right() - 6.0,
        rect.top() + 3.0..=rect.bottom() - 5.0,
    );
    painter.rect_filled(
        back,
        CornerRadius::same(8),
        colors.ground.gamma_multiply(0.9),
    );
    painter.rect_filled(bar, 3.0, colors.raised);
    let x = |time: f64| bar.left() + strip.place(time) * bar.width();
    let head = x(strip.now);
    let past = Rect::from_min_max(bar.min, pos2(head, bar.bottom()));
    painter.rect_filled(past, 3.0, colors.accent);
    for (time, _) in &strip.marks {
        let line = Stroke::new(1.5, colors.strong);
        painter.vline(x(*time), bar.top() - 4.0..=bar.bottom() + 4.0, line);
    }
    painter.circle(
        pos2(head, bar.center().y),
        6.5,
        colors.strong,
        Stroke::new(1.5, colors.accent),
    );
    let middle = rect.center().y;
    painter.text(
        pos2(bar.left() - 12.0, middle),
        Align2::RIGHT_CENTER,
        format!("−{:.1} s", strip.end - strip.start),
        font.clone(),
        colors.weak,
    );
    painter.text(
        pos2(bar.right() + 12.0, middle),
        Align2::LEFT_CENTER,
        format!("{:.2} s", strip.now),
        font,
        colors.text,
    );
    let pointed = response.hover_pos().map(|at| at.x);
    let response = response.on_hover_ui(|ui| {
        if let Some(at) = pointed {
            let time = strip.time((at - bar.left()) / bar.width());
            ui.label(format!("{time:.2} s"));
            let near = strip
                .marks
                .iter()
                .filter(|(time, _)| (x(*time) - at).abs() < NEAR);
            near.for_each(|(_, title)| {
                ui.label(title);
            });
        }
        ui.label(words(strip));
    });
    let pointer = response.interact_pointer_pos();
    let dragged = response.dragged() || response.clicked() || response.drag_started();
    let scrubbed = pointer.filter(|_| dragged).map(|at| {
        let place = (at.x - bar.left()) / bar.width();
        strip.time(place)
    });
    (response, scrubbed)
}

/// Description of the strip.
fn words(strip: &TimeStrip) -> String {
    let kept = match strip.every {
        1 => "every tick".to_owned(),
        every => format!("every {every} ticks, as memory is limited"),
    };
    format!(
        "Timeline: the last {:.1} s, {} states, {kept}.\nDrag to go back in time; the simulation \
         pauses. Space goes on from there.",
        strip.end - strip.start,
        strip.states
    )
}
