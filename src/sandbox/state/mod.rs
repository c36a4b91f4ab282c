//! What the rooms of the window share, as plain state: what is shown, what is selected, what was asked for, what happened.

pub mod event;
pub mod request;
pub mod selection;
pub mod view;
