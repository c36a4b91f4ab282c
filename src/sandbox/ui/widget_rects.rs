//! Rectangles of the panel's widgets by name, for scripts that control the real window.

use std::collections::BTreeMap;

use bevy_egui::egui::{Rect, Response};

/// The widgets of the last frame: name and rectangle [logical px], from the window's top left.
///
/// A widget that is scrolled out of view has no entry; a clipped one has its visible part.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct WidgetRects(BTreeMap<String, Rect>);

impl WidgetRects {
    /// Records a widget, given the clip rectangle of the scroll area.
    pub fn note(&mut self, name: impl Into<String>, response: &Response, visible: Rect) {
        let rect = response.rect.intersect(visible);
        if rect.is_positive() {
            self.0.insert(name.into(), rect);
        }
    }

    /// The widgets, sorted by name.
    pub fn iter(&self) -> impl Iterator<Item = (&str, Rect)> {
        self.0.iter().map(|(name, rect)| (name.as_str(), *rect))
    }

    /// The rectangle of one widget.
    pub fn get(&self, name: &str) -> Option<Rect> {
        self.0.get(name).copied()
    }

    /// Removes all entries, before a new frame is drawn.
    pub fn clear(&mut self) {
        self.0.clear();
    }
}
