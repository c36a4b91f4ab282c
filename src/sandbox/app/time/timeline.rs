//! The states of the last seconds, within a memory budget.

use super::state::State;
use std::{
    collections::{HashSet, VecDeque},
    sync::Arc,
};

/// Simulated time that is kept [s].
pub const SPAN: f64 = 10.0;

/// Number of states between two exact counts of memory.
const RECOUNT: u32 = 60;

/// Kept states, the oldest first, and the actions between them.
///
/// If the states of the last ten seconds do not fit into the budget, every second one is kept, or
/// every fourth, and so on, so that the span stays the same.
#[derive(Debug, Clone)]
pub struct Timeline {
    states: VecDeque<Arc<State>>,
    /// Simulated time of an action [s], and its title.
    marks: Vec<(f64, String)>,
    /// Ticks from one kept state to the next.
    every: u64,
    /// Memory of the states [bytes]; exact at every [`RECOUNT`]th.
    bytes: usize,
    uncounted: u32,
}

impl Default for Timeline {
    fn default() -> Self {
        Self {
            states: VecDeque::new(),
            marks: Vec::new(),
            every: 1,
            bytes: 0,
            uncounted: 0,
        }
    }
}

impl Timeline {
    /// Number of kept states.
    pub fn len(&self) -> usize {
        self.states.len()
    }

    /// Whether no state is kept.
    pub fn is_empty(&self) -> bool {
        self.states.is_empty()
    }

    /// Ticks from one kept state to the next.
    pub const fn every(&self) -> u64 {
        self.every
    }

    /// Memory of the states [bytes].
    pub const fn bytes(&self) -> usize {
        self.bytes
    }

    /// Actions of the user.
    pub fn marks(&self) -> &[(f64, String)] {
        &self.marks
    }

    /// The states, the oldest first.
    pub fn states(&self) -> impl DoubleEndedIterator<Item = &Arc<State>> {
        self.states.iter()
    }

    /// A state by its index.
    pub fn get(&self, index: usize) -> Option<&Arc<State>> {
        self.states.get(index)
    }

    /// The newest state.
    pub fn last(&self) -> Option<&Arc<State>> {
        self.states.back()
    }

    /// Simulated time of the first and of the last state [s].
    pub fn span(&self) -> Option<(f64, f64)> {
        Some((self.states.front()?.time(), self.states.back()?.time()))
    }

    /// Index of the state nearest to a time [s].
    pub fn nearest(&self, time: f64) -> Option<usize> {
        let distance = |state: &State| (state.time() - time).abs();
        (0..self.states.len())
            .min_by(|&a, &b| distance(&self.states[a]).total_cmp(&distance(&self.states[b])))
    }

    /// Whether the state of a tick is kept.
    pub const fn wants(&self, tick: u64) -> bool {
        tick.is_multiple_of(self.every)
    }

    /// Adds a state that is `new` bytes larger than what it shares with the previous one, and drops
    /// what is too old or too much for a budget [bytes].
    pub fn push(&mut self, state: Arc<State>, new: usize, budget: usize) {
        let oldest = state.time() - SPAN - 1e-9;
        self.states.push_back(state);
        self.bytes += new;
        let count = self.states.len();
        while self.states.front().is_some_and(|it| it.time() < oldest) {
            self.states.pop_front();
        }
        self.uncounted += 1;
        // What was dropped may be shared, so that it is counted exactly before anything is thinned.
        let dropped = self.states.len() < count;
        if self.bytes > budget || self.uncounted >= RECOUNT && dropped {
            self.recount();
        }
        while self.bytes > budget && self.states.len() > 2 {
            self.every *= 2;
            let every = self.every;
            self.states.retain(|it| it.tick().is_multiple_of(every));
            self.recount();
        }
        let start = self.states.front().map_or(0.0, |state| state.time());
        self.marks.retain(|(time, _)| *time >= start);
    }

    /// Marks an action at a time [s].
    pub fn mark(&mut self, time: f64, title: &str) {
        self.marks.push((time, title.to_owned()));
    }

    /// Drops all states after one.
    pub fn truncate(&mut self, index: usize) {
        self.states.truncate(index + 1);
        if let Some(last) = self.states.back() {
            let end = last.time();
            self.marks.retain(|(time, _)| *time <= end);
        }
        self.recount();
    }

    fn recount(&mut self) {
        self.uncounted = 0;
        let mut counted = HashSet::new();
        let states = self.states.iter();
        self.bytes = states.map(|state| state.count_bytes(&mut counted)).sum();
    }
}
