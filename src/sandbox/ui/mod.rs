//! Theme, widgets, messages.

pub mod area;
mod expression;
pub mod message;
pub mod number;
pub mod paint;
pub mod plot;
pub mod scale;
pub mod slider;
pub mod theme;
pub mod track;
mod widget_rects;

pub use number::{count, format};
pub use widget_rects::WidgetRects;
