//! The slider: a rail with marks for powers of ten and for the scene default, and a handle.
//!
//! Replaces egui's slider, which has no fixed-width stops for 0 and infinity and no mark. Handles
//! the pointer and the arrow keys; [`Track`] maps positions to values.

use bevy_egui::egui::{
    EventFilter, Key, Rect, Response, Sense, Shape, Stroke, Ui, Vec2, WidgetInfo, WidgetType, pos2,
};

use crate::sandbox::ui::theme;
use crate::sandbox::ui::track::Track;

const RADIUS: f32 = 6.0;
const RAIL: f32 = 4.0;

/// A slider of a width [logical px] for a value on a track. `mark` is the position of the scene
/// default, if the value differs from it. Returns the new value, if the user moved the handle.
pub fn slider(
    ui: &mut Ui,
    width: f32,
    track: &Track,
    value: f64,
    mark: Option<f64>,
    title: &str,
) -> (Response, Option<f64>) {
    let (rect, mut response) =
        ui.allocate_exact_size(Vec2::new(width, theme::ROW), Sense::click_and_drag());
    let moved = by_pointer(&response, rect, track).or_else(|| by_keys(ui, &response, track, value));
    // The solver uses f32: a value that rounds to the same f32 has not changed.
    let moved = moved.filter(|moved| *moved as f32 != value as f32);
    if moved.is_some() {
        response.mark_changed();
    }
    let shown = moved.unwrap_or(value);
    response.widget_info(|| {
        let mut info = WidgetInfo::new(WidgetType::Slider);
        info.label = Some(title.to_owned());
        info.value = Some(shown);
        info
    });
    if ui.is_rect_visible(rect) {
        paint(ui, rect, &response, track, shown, mark);
    }
    (response, moved)
}

/// The rail ends one handle radius inside the widget, so that the handle stays inside.
fn rail(rect: Rect) -> Rect {
    Rect::from_center_size(rect.center(), Vec2::new(rect.width() - 2.0 * RADIUS, RAIL))
}

fn by_pointer(response: &Response, rect: Rect, track: &Track) -> Option<f64> {
    let rail = rail(rect);
    let pressed = response.is_pointer_button_down_on() || response.dragged() || response.clicked();
    let pointer = response.interact_pointer_pos().filter(|_| pressed)?;
    let position = (pointer.x - rail.left()) / rail.width();
    Some(track.value(f64::from(position)))
}

fn by_keys(ui: &Ui, response: &Response, track: &Track, value: f64) -> Option<f64> {
    if !response.has_focus() {
        return None;
    }
    // Without the filter, arrow keys would move the focus to the next widget.
    let filter = EventFilter {
        horizontal_arrows: true,
        ..Default::default()
    };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
    let (back, forth) = ui.input(|input| {
        (
            input.num_presses(Key::ArrowLeft),
            input.num_presses(Key::ArrowRight),
        )
    });
    let mut moved = value;
    for _ in 0..back {
        moved = track.step(moved, false);
    }
    for _ in 0..forth {
        moved = track.step(moved, true);
    }
    (back + forth > 0).then_some(moved)
}

fn paint(ui: &Ui, rect: Rect, response: &Response, track: &Track, value: f64, mark: Option<f64>) {
    let rail = rail(rect);
    let at = |position: f64| rail.left() + position as f32 * rail.width();
    let painter = ui.painter();
    let tick = Stroke::new(1.0, theme::of(ui).tick);
    for position in track.ticks() {
        let x = painter.round_to_pixel_center(at(position));
        painter.vline(x, rail.bottom() + 1.0..=rail.bottom() + 4.0, tick);
    }
    painter.rect_filled(rail, RAIL / 2.0, theme::of(ui).raised);
    let x = at(track.position(value));
    let enabled = if ui.is_enabled() { 1.0 } else { 0.4 };
    let accent = theme::of(ui).accent.gamma_multiply(enabled);
    let origin = at(track.origin());
    let filled = Rect::from_x_y_ranges(origin.min(x)..=origin.max(x), rail.y_range());
    painter.rect_filled(filled, RAIL / 2.0, accent.gamma_multiply(0.7));
    if let Some(mark) = mark {
        let x = at(track.position(mark));
        let points = vec![
            pos2(x, rail.top() - 1.0),
            pos2(x - 3.5, rail.top() - 6.0),
            pos2(x + 3.5, rail.top() - 6.0),
        ];
        painter.add(Shape::convex_polygon(
            points,
            theme::of(ui).changed,
            Stroke::NONE,
        ));
    }
    let lit = response.hovered() || response.dragged() || response.has_focus();
    let radius = if lit { RADIUS } else { RADIUS - 1.0 };
    let color = if lit { theme::of(ui).strong } else { accent };
    let center = pos2(x, rail.center().y);
    painter.circle(
        center,
        radius,
        color,
        Stroke::new(2.0, theme::of(ui).ground),
    );
    if response.has_focus() {
        painter.circle_stroke(center, radius + 1.0, Stroke::new(1.0, theme::of(ui).accent));
    }
}
