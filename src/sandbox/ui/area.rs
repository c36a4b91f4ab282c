//! The area of the window that the panel and the timeline leave free.

use crate::sandbox::state::view::ViewSettings;
use bevy_egui::egui::{Context, Id, LayerId, Order, Rect, Vec2, vec2};

/// The free area [logical px].
#[must_use]
pub fn free(context: &Context, view: &ViewSettings) -> Rect {
    let window = context.content_rect();
    let (left, right) = view.free(window.width());
    Rect::from_x_y_ranges(
        window.left() + left..=window.left() + right.max(left),
        window.top()..=window.bottom() - view.strip_height,
    )
}

/// Offset of the center of an area from the center of the window [logical px].
#[must_use]
pub fn off_center(context: &Context, area: Rect) -> Vec2 {
    vec2(area.center().x - context.content_rect().center().x, 0.0)
}

/// Offset of a card in the lower left corner of an area from that corner of the window [logical px].
#[must_use]
pub fn lower_left(context: &Context, area: Rect) -> Vec2 {
    let window = context.content_rect();
    vec2(
        area.left() - window.left() + 10.0,
        area.bottom() - window.bottom() - 10.0,
    )
}

/// The rectangle of a card over the view [logical px], by the identity and order of its area; `None`
/// while it is not shown.
#[must_use]
pub fn card(context: &Context, name: &str, order: Order) -> Option<Rect> {
    let id = Id::new(name);
    context.memory(|memory| {
        let is_shown = memory.areas().is_visible(&LayerId::new(order, id));
        memory.area_rect(id).filter(|_| is_shown)
    })
}
