//! Plots as parts of a panel: neither dragged nor zoomed, and without a cursor of their own.

use egui_plot::Plot;

/// A plot of a height [logical px] over the whole width.
#[must_use]
pub fn fixed<'a>(name: &'static str, height: f32) -> Plot<'a> {
    Plot::new(name)
        .height(height)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_axis_zoom_drag(false)
        .allow_boxed_zoom(false)
        .allow_double_click_reset(false)
        .show_crosshair(false)
}
