//! What the window shows of undo, redo and the timeline.

use bevy::prelude::*;

/// The last actions that can be undone and redone, and the timeline.
#[derive(Resource, Debug, Clone, Default, PartialEq)]
pub struct TimeView {
    /// Title of the action that undo takes back; `None` without one.
    pub undo: Option<String>,
    /// Title of the action that redo repeats; `None` without one.
    pub redo: Option<String>,
    /// The kept states.
    pub strip: TimeStrip,
}

/// The states of the last seconds that are kept, as a strip to scrub.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TimeStrip {
    /// Number of kept states.
    pub states: usize,
    /// Simulated time of the first kept state [s].
    pub start: f64,
    /// Simulated time of the last one, or of the current state if that is later [s].
    pub end: f64,
    /// Simulated time of the current state [s].
    pub now: f64,
    /// Ticks from one kept state to the next.
    pub every: u64,
    /// Actions of the user: simulated time [s] and title.
    pub marks: Vec<(f64, String)>,
}

impl TimeStrip {
    /// Whether there is anything to scrub.
    #[must_use]
    pub fn is_shown(&self) -> bool {
        self.states > 1
    }

    /// Place of a time [s] on the strip, from 0 to 1.
    #[must_use]
    pub fn place(&self, time: f64) -> f32 {
        let span = self.end - self.start;
        if span > 0.0 {
            ((time - self.start) / span).clamp(0.0, 1.0) as f32
        } else {
            1.0
        }
    }

    /// The time [s] at a place from 0 to 1.
    #[must_use]
    pub fn time(&self, place: f32) -> f64 {
        self.start + (self.end - self.start) * f64::from(place.clamp(0.0, 1.0))
    }
}

/// Number of mouse buttons and keys pressed so far: changes while one is held, or while a key
/// repeats, belong to one gesture, which is undone at once.
#[derive(Resource, Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Gesture(pub u64);
