//! The area of the window that the panel and the timeline leave free.

use crate::sandbox::state::view::ViewSettings;
use bevy_egui::egui::{Context, Rect, Vec2, vec2};

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
