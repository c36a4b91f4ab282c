//! Shared state of the window, as plain data: view, selection, requests, events.

pub mod activity;
pub mod display;
pub mod event;
pub mod first_steps;
pub mod request;
pub mod selection;
pub mod spawn;
pub mod time;
pub mod view;
