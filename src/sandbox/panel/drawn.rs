//! What drawing the panel yields.

use crate::sandbox::{state::request::Request, ui::WidgetRects};
use bevy_egui::egui::{Response, Ui};

/// Result of drawing the panel: requests of the user, refused entries and widget rectangles.
#[derive(Debug, Default)]
pub struct Panel {
    requests: Vec<Request>,
    refusals: Vec<String>,
    places: WidgetRects,
}

impl Panel {
    /// Requests of the user, in order.
    pub fn requests(&self) -> &[Request] {
        &self.requests
    }

    /// Entries that were refused, each as a message with the reason.
    pub fn refusals(&self) -> &[String] {
        &self.refusals
    }

    /// Rectangles of the widgets.
    pub fn places(&self) -> &WidgetRects {
        &self.places
    }

    /// Adds a request.
    pub(super) fn ask(&mut self, request: Request) {
        self.requests.push(request);
    }

    /// Reports that an entry was refused.
    pub(super) fn refuse(&mut self, message: String) {
        self.refusals.push(message);
    }

    /// Records the rectangle of a widget.
    pub(super) fn note(&mut self, name: impl Into<String>, response: &Response, ui: &Ui) {
        self.places.note(name, response, ui.clip_rect());
    }
}
