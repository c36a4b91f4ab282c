//! What is drawn between ticks: the instant, and the positions of a body at it.

use super::{Asleep, SimulationClock, TickStart};
use crate::solver::Particles;
use bevy::prelude::*;
use std::collections::VecDeque;

/// The simulated instant that is drawn. See [`SimulationClock::drawn`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DrawnInstant {
    /// Ticks between the end of the drawn tick and the current state; 0 for the last tick.
    pub ticks_back: usize,
    /// Fraction of the drawn tick, from 0 to 1.
    pub fraction: f32,
}

/// Positions of a body at the starts of the ticks before [`TickStart`], as many as drawing needs in
/// one of Bevy's fixed schedules whose rate is not that of the ticks; empty elsewhere.
///
/// ```
/// use bevy::prelude::*;
/// use pliant::{prelude::*, simulation::{PastStarts, SimulationClock, TickStart}, solver::Particles};
///
/// /// Draws the particles of all bodies.
/// fn draw(
///     clock: Res<SimulationClock>,
///     bodies: Query<(&PastStarts, &TickStart, &Particles)>,
///     mut gizmos: Gizmos,
/// ) {
///     for (past, start, now) in &bodies {
///         for particle in past.positions(clock.drawn(), start, now) {
///             gizmos.sphere(particle.truncate(), 0.01, Color::WHITE); // m
///         }
///     }
/// }
/// ```
#[derive(Component, Debug, Clone, PartialEq, Default)]
pub struct PastStarts(
    /// The newest first.
    VecDeque<Vec<Vec4>>,
);

impl PastStarts {
    /// Number of states that are kept.
    #[must_use]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether none are kept.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Positions of the particles at an instant [m], with their inverse masses. Of an instant before
    /// the oldest state, those of that state; a particle that did not exist has its first known position.
    pub fn positions<'a>(
        &'a self,
        at: DrawnInstant,
        start: &'a TickStart,
        now: &'a Particles,
    ) -> impl Iterator<Item = Vec4> + 'a {
        // A particle that is not in a state appeared after it.
        let at_start = |back: usize, i: usize| match back {
            0 => start.positions.get(i),
            back => self
                .0
                .get(back - 1)
                .or(self.0.back())
                .unwrap_or(&start.positions)
                .get(i),
        };
        now.positions.iter().enumerate().map(move |(i, newest)| {
            let back = at.ticks_back;
            let after = (0..back).rev().find_map(|back| at_start(back, i));
            let to = after.unwrap_or(newest);
            at_start(back, i).unwrap_or(to).lerp(*to, at.fraction)
        })
    }

    /// Renumbers the particles after those of the body have changed: particle `n` was `sources[n]`.
    pub(super) fn follow(&mut self, sources: &[u32]) {
        for state in &mut self.0 {
            // A state in which the last ones had not appeared yet has only others.
            let known = sources.iter().map_while(|&i| state.get(i as usize));
            *state = known.copied().collect();
        }
    }

    /// Ends the memory of a body that was put elsewhere.
    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }

    /// Adds the start of the last tick, and keeps this many states.
    fn push(&mut self, start: &[Vec4], most: usize) {
        self.0.truncate(most);
        if most == 0 {
            return;
        }
        let is_full = self.0.len() == most;
        let oldest = is_full.then(|| self.0.pop_back()).flatten();
        let mut state = oldest.unwrap_or_default();
        state.clear();
        state.extend_from_slice(start);
        self.0.push_front(state);
    }
}

/// Keeps the start of the last tick, before that of the next one takes its place.
pub(super) fn keep(
    clock: Res<SimulationClock>,
    mut bodies: Query<(&TickStart, &mut PastStarts, Has<Asleep>)>,
) {
    let most = clock.past_starts();
    for (start, mut past, is_asleep) in &mut bodies {
        // Of a body that sleeps, all are soon the same.
        let most = match is_asleep {
            true => most.min(past.len().saturating_sub(1)),
            false => most,
        };
        if most > 0 || !past.is_empty() {
            past.push(&start.positions, most);
        }
    }
}

/// A body whose state was replaced was nowhere else before.
pub(super) fn forget(replaced: On<Insert, TickStart>, mut bodies: Query<&mut PastStarts>) {
    if let Ok(mut past) = bodies.get_mut(replaced.entity)
        && !past.is_empty()
    {
        past.clear();
    }
}
