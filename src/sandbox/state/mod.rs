//! Shared state of the window, as plain data: view, selection, requests, events.

pub mod activity;
pub mod browser;
pub mod collider;
pub mod color;
pub mod display;
pub mod event;
pub mod first_steps;
pub mod hands;
pub mod keep;
pub mod look;
pub mod presets;
pub mod request;
pub mod search;
pub mod selection;
pub mod spawn;
pub mod time;
pub mod view;
