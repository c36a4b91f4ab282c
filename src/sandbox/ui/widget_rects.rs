//! Where each widget of the panel is, by name, for scripts that press the real window.

use std::collections::BTreeMap;

use bevy_egui::egui::{Rect, Response};

/// The widgets of the last drawing: name and rectangle [logical px], from the window's top left.
///
/// A widget that is scrolled out of sight has no entry; one that is cut has its visible part.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct WidgetRects(BTreeMap<String, Rect>);

impl WidgetRects {
    /// Notes a widget, given what the scroll area shows of it.
    pub fn note(&mut self, name: impl Into<String>, response: &Response, visible: Rect) {
        let rect = response.rect.intersect(visible);
        if rect.is_positive() {
            self.0.insert(name.into(), rect);
        }
    }

    /// The widgets in the order of their names.
    pub fn iter(&self) -> impl Iterator<Item = (&str, Rect)> {
        self.0.iter().map(|(name, rect)| (name.as_str(), *rect))
    }

    /// The place of one widget.
    pub fn get(&self, name: &str) -> Option<Rect> {
        self.0.get(name).copied()
    }

    /// Forgets all, for a new drawing.
    pub fn clear(&mut self) {
        self.0.clear();
    }
}
