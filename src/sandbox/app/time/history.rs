//! The actions that can be undone and redone, one entry per gesture.

use super::{
    change::{self, Undoing},
    state::State,
    timeline::Timeline,
};
use crate::{
    sandbox::{
        state::{spawn::Spawn, time::Gesture},
        ui::message::Notices,
    },
    simulation::{Action, Actions, SimulationClock, SpawnOrder, end_tick},
};
use bevy::prelude::*;
use std::{
    collections::{HashSet, VecDeque},
    mem::{Discriminant, discriminant},
    sync::Arc,
};

/// Memory for the states of undo and redo, and as much again for the timeline [bytes].
pub const BUDGET: usize = 128 << 20;
/// Largest number of actions that can be undone.
pub const MAX_ENTRIES: usize = 200;

/// The history of the user's actions.
#[derive(Resource, Debug)]
pub struct History {
    undo: VecDeque<Entry>,
    redo: Vec<Entry>,
    /// The action that is being carried out, and the simulated time [s].
    pending: Option<(f64, Entry)>,
    timeline: Timeline,
    /// Index of the current state on the timeline, while an earlier state than the last is shown.
    pub(super) cursor: Option<usize>,
    /// Whether an action has changed the state since it was kept.
    pub(super) changed: bool,
    /// Whether actions are not noted, as they are not the user's.
    quiet: bool,
    /// Title of the actions of this frame, if they have one in common.
    label: Option<String>,
    frame: u64,
    budget: usize,
}

impl Default for History {
    fn default() -> Self {
        Self {
            undo: VecDeque::new(),
            redo: Vec::new(),
            pending: None,
            timeline: Timeline::default(),
            cursor: None,
            changed: false,
            quiet: false,
            label: None,
            frame: 0,
            budget: BUDGET,
        }
    }
}

/// An action of the user.
#[derive(Debug)]
struct Entry {
    title: String,
    /// Kind of action; `None` if it is not an action on the simulation.
    kind: Option<Discriminant<Action>>,
    gesture: u64,
    frame: u64,
    change: Change,
}

#[derive(Debug)]
enum Change {
    /// Actions that set other values.
    Values(Vec<Action<SpawnOrder>>),
    /// Another state.
    State(Saved),
}

/// A state with the timeline that led to it, unless memory was short.
#[derive(Debug)]
struct Saved {
    state: Arc<State>,
    timeline: Option<Timeline>,
    cursor: Option<usize>,
}

impl History {
    /// The states of the last seconds.
    #[must_use]
    pub const fn timeline(&self) -> &Timeline {
        &self.timeline
    }

    /// Title of the action that [`undo`] takes back.
    #[must_use]
    pub fn undo_title(&self) -> Option<&str> {
        self.undo.back().map(|entry| entry.title.as_str())
    }

    /// Title of the action that [`redo`] repeats.
    #[must_use]
    pub fn redo_title(&self) -> Option<&str> {
        self.redo.last().map(|entry| entry.title.as_str())
    }

    /// Number of actions that can be undone.
    #[must_use]
    pub fn len(&self) -> usize {
        self.undo.len()
    }

    /// Whether nothing can be undone.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.undo.is_empty()
    }

    /// Sets the memory for undo and redo, and as much again for the timeline [bytes].
    pub fn set_budget(&mut self, bytes: usize) {
        self.budget = bytes;
    }

    /// Memory of undo and redo [bytes], and of the timeline.
    #[must_use]
    pub fn bytes(&self) -> (usize, usize) {
        let mut counted = HashSet::new();
        let entries = self.undo.iter().chain(&self.redo);
        let bytes = entries.map(|entry| entry.count_bytes(&mut counted)).sum();
        (bytes, self.timeline.bytes())
    }

    /// Sets a common title for the actions that are carried out next.
    pub fn label(&mut self, title: impl Into<String>) {
        self.label = Some(title.into());
    }

    /// Begins a frame.
    pub(super) fn begin_frame(&mut self) {
        self.frame += 1;
        self.label = None;
    }

    /// An action was carried out: the one that [`before_action`] noted, or a quiet one.
    pub(super) fn applied(&mut self) {
        self.leave_cursor();
        self.changed = true;
        if let Some((time, entry)) = self.pending.take() {
            self.timeline.mark(time, &entry.title);
            self.push(entry);
        }
    }

    /// Goes to an index of the timeline, or to its end.
    pub(super) const fn set_cursor(&mut self, cursor: Option<usize>) {
        self.cursor = cursor;
    }

    /// The state follows the one at the cursor: drops the states after it.
    fn leave_cursor(&mut self) {
        if let Some(index) = self.cursor.take() {
            self.timeline.truncate(index);
        }
    }

    /// Adds a state to the timeline.
    pub(super) fn append(&mut self, state: Arc<State>) {
        let mut counted = HashSet::new();
        if let Some(last) = self.timeline.last() {
            last.count_bytes(&mut counted);
        }
        let new = state.count_bytes(&mut counted);
        self.timeline.push(state, new, self.budget);
        self.changed = false;
    }

    fn push(&mut self, entry: Entry) {
        self.redo.clear();
        self.undo.push_back(entry);
        self.trim();
    }

    /// Drops what the budget has no room for: first the timelines of old entries, then entries. The
    /// latest one stays.
    fn trim(&mut self) {
        while self.undo.len() > MAX_ENTRIES {
            self.undo.pop_front();
        }
        while self.bytes().0 > self.budget {
            let timeline = self.undo.iter_mut().find_map(Entry::timeline_mut);
            if let Some(timeline) = timeline {
                *timeline = None;
            } else if self.undo.len() > 1 {
                self.undo.pop_front();
            } else {
                break;
            }
        }
    }
}

impl Entry {
    fn count_bytes(&self, counted: &mut HashSet<usize>) -> usize {
        match &self.change {
            Change::Values(_) => 0,
            Change::State(Saved {
                state, timeline, ..
            }) => {
                let own = state.count_bytes(counted);
                let states = timeline.iter().flat_map(Timeline::states);
                own + states.map(|it| it.count_bytes(counted)).sum::<usize>()
            }
        }
    }

    /// The timeline, if it has one.
    fn timeline_mut(&mut self) -> Option<&mut Option<Timeline>> {
        match &mut self.change {
            Change::State(saved) if saved.timeline.is_some() => Some(&mut saved.timeline),
            _ => None,
        }
    }
}

/// Ends a tick under way, and carries out waiting actions.
pub(super) fn settle(world: &mut World) {
    end_tick(world);
    Actions::apply(world);
}

/// The current state, with the timeline.
fn save(world: &mut World) -> Option<Saved> {
    let history = world.resource::<History>();
    let previous = history.timeline.last().cloned();
    // The states of an undisturbed timeline are the current state: no copy is needed.
    let clock = world.resource::<SimulationClock>();
    let kept = previous.as_ref().filter(|state| {
        !history.changed && history.cursor.is_none() && state.tick() == clock.tick()
    });
    let state = match kept {
        Some(state) => Arc::clone(state),
        None => Arc::new(State::take(world, previous.as_deref())?),
    };
    let history = world.resource::<History>();
    Some(Saved {
        state,
        timeline: Some(history.timeline.clone()),
        cursor: history.cursor,
    })
}

/// Notes an action that is about to be carried out.
pub(super) fn before_action(world: &mut World, action: &Action) {
    let mut history = world.resource_mut::<History>();
    history.pending = None;
    if history.quiet {
        return;
    }
    let (undoing, mut title) = change::undoing(world, action);
    let history = world.resource::<History>();
    if let Some(label) = &history.label {
        title.clone_from(label);
    }
    let gesture = world.resource::<Gesture>().0;
    let frame = history.frame;
    let rains = matches!(action, Action::Spawn(_))
        && world
            .get_resource::<Spawn>()
            .is_some_and(|spawn| spawn.rains);
    let kind = Some(discriminant(action));
    let same = |entry: &&Entry| {
        let same_kind = entry.kind == kind;
        let same_value = matches!(undoing, Undoing::State) || entry.title == title;
        let same_gesture = entry.gesture == gesture;
        same_kind && rains || same_gesture && (same_kind && same_value || entry.frame == frame)
    };
    let top = history.undo.back().filter(same);
    let top = top.filter(|_| history.redo.is_empty());
    let merged = match (&undoing, top.map(|entry| &entry.change)) {
        (Undoing::Part, _)
        | (Undoing::State, Some(Change::State(_)))
        | (Undoing::Values(_), Some(Change::Values(_))) => true,
        (Undoing::State | Undoing::Values(_), _) => false,
    };
    let mut history = world.resource_mut::<History>();
    let entry = match undoing {
        Undoing::Values(values) if merged => {
            if let Some(Entry {
                change: Change::Values(known),
                ..
            }) = history.undo.back_mut()
            {
                let new = values
                    .into_iter()
                    .filter(|value| !known.iter().any(|other| change::same_target(other, value)));
                let new: Vec<_> = new.collect();
                known.splice(0..0, new);
            }
            None
        }
        Undoing::State if merged => {
            if matches!(action, Action::Spawn(_))
                && let Some(entry) = history.undo.back_mut()
            {
                "Add bodies".clone_into(&mut entry.title);
            }
            None
        }
        Undoing::Part => None,
        Undoing::Values(values) => (!values.is_empty()).then_some(Change::Values(values)),
        Undoing::State => save(world).map(Change::State),
    };
    let time = world.resource::<SimulationClock>().time();
    let mut history = world.resource_mut::<History>();
    history.pending = entry.map(|change| {
        let entry = Entry {
            title,
            kind,
            gesture,
            frame,
            change,
        };
        (time, entry)
    });
}

/// Notes that the state is about to be replaced by something that is not an action, such as a
/// restart. Ends the tick under way.
pub fn before_scene(world: &mut World, title: &str) {
    settle(world);
    let Some(saved) = save(world) else {
        return;
    };
    note(world, title, saved);
}

/// Adds an entry that restores a saved state.
fn note(world: &mut World, title: &str, saved: Saved) {
    let gesture = world.resource::<Gesture>().0;
    let mut history = world.resource_mut::<History>();
    let frame = history.frame;
    history.push(Entry {
        title: title.to_owned(),
        kind: None,
        gesture,
        frame,
        change: Change::State(saved),
    });
}

/// Begins the timeline anew, after a scene was opened or restarted.
pub fn begin(world: &mut World) {
    let first = State::take(world, None).map(Arc::new);
    let mut history = world.resource_mut::<History>();
    history.timeline = Timeline::default();
    history.cursor = None;
    if let Some(first) = first {
        history.append(first);
    }
}

/// Carries out waiting actions that are not the user's, so that they cannot be undone one by one.
pub fn quietly(world: &mut World) {
    world.resource_mut::<History>().quiet = true;
    Actions::apply(world);
    world.resource_mut::<History>().quiet = false;
}

/// Keeps the state after a tick.
pub(super) fn keep(world: &mut World) {
    let tick = world.resource::<SimulationClock>().tick();
    let mut history = world.resource_mut::<History>();
    history.leave_cursor();
    if !history.timeline.wants(tick) {
        history.changed = true;
        return;
    }
    let previous = history.timeline.last().cloned();
    if let Some(state) = State::take(world, previous.as_deref()) {
        world.resource_mut::<History>().append(Arc::new(state));
    }
}

/// Takes the last action back. Returns its title.
pub fn undo(world: &mut World) -> Option<String> {
    settle(world);
    let entry = world.resource_mut::<History>().undo.pop_back();
    let Some(entry) = entry else {
        world.resource_mut::<Notices>().info("Nothing to undo");
        return None;
    };
    let title = entry.title.clone();
    let back = exchange(world, entry);
    let mut history = world.resource_mut::<History>();
    history.redo.extend(back);
    history.trim();
    world
        .resource_mut::<Notices>()
        .info(format!("Undo: {title}"));
    Some(title)
}

/// Repeats the action that was taken back last. Returns its title.
pub fn redo(world: &mut World) -> Option<String> {
    settle(world);
    let entry = world.resource_mut::<History>().redo.pop();
    let Some(entry) = entry else {
        world.resource_mut::<Notices>().info("Nothing to redo");
        return None;
    };
    let title = entry.title.clone();
    let back = exchange(world, entry);
    let mut history = world.resource_mut::<History>();
    history.undo.extend(back);
    history.trim();
    world
        .resource_mut::<Notices>()
        .info(format!("Redo: {title}"));
    Some(title)
}

/// Carries out an entry, and returns the one that leads back.
fn exchange(world: &mut World, entry: Entry) -> Option<Entry> {
    let change = match entry.change {
        Change::Values(actions) => {
            let mut back = Vec::new();
            for action in actions {
                let Some(action) = change::resolve(world, action) else {
                    continue;
                };
                let inverse = change::inverse(world, &action);
                back.splice(0..0, inverse);
                world.resource_mut::<Actions>().push(action);
                quietly(world);
            }
            Change::Values(back)
        }
        Change::State(saved) => {
            let now = save(world)?;
            saved.state.restore(world);
            let mut history = world.resource_mut::<History>();
            match saved.timeline {
                Some(timeline) => {
                    // The saved state may differ from the last one of its timeline by an action.
                    let last = timeline.last();
                    history.changed = !last.is_some_and(|it| Arc::ptr_eq(it, &saved.state));
                    history.timeline = timeline;
                    history.cursor = saved.cursor;
                }
                None => {
                    history.timeline = Timeline::default();
                    history.cursor = None;
                    history.append(saved.state);
                }
            }
            Change::State(now)
        }
    };
    Some(Entry { change, ..entry })
}

/// Notes that the user leaves the current state for another one of the timeline, so that undo
/// leads back, and makes the current state the last of the timeline. Nothing happens if an earlier
/// state is shown already.
pub(super) fn depart(world: &mut World, title: &str) {
    settle(world);
    if world.resource::<History>().cursor.is_some() {
        return;
    }
    let Some(saved) = save(world) else {
        return;
    };
    let state = Arc::clone(&saved.state);
    note(world, title, saved);
    let mut history = world.resource_mut::<History>();
    let is_last = history
        .timeline
        .last()
        .is_some_and(|last| Arc::ptr_eq(last, &state));
    if !is_last {
        history.append(state);
    }
    let last = history.timeline.len().checked_sub(1);
    history.set_cursor(last);
}
