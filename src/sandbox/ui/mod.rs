//! The kit: theme, widgets, messages.

pub mod message;
pub mod number;
mod places;
pub mod slider;
pub mod theme;
pub mod track;

pub use number::{count, format};
pub use places::Places;
