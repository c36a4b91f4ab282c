//! Phase executor: steps one body on one thread or several.
//!
//! A piece begins when the phase before is done on its particles, so that several phases are in work
//! at the same time, each some pieces behind the one before: a body that does not fit into a cache
//! passes through it once per [`WINDOW`] phases and not in each.
//!
//! Every thread goes through the same phases and takes the pieces of its own queue, and those of
//! others when it has none. No thread waits for a piece that it has taken, for the whole body, or for
//! others to join: threads that join late find the work done. The result does not depend on which
//! thread takes a piece, or when.

use crate::{
    Threads, parallel::wait::pause, partitions::MAX_PARTITIONS, phases::Phase,
    step::stepper::NotFinite,
};
use std::{
    ops::Range,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicU32, AtomicU64, Ordering},
    },
};

/// Maximum number of queues. The pieces of a phase are distributed to one queue per thread.
const MAX_QUEUES: usize = 64;

/// Maximum number of phases that are in work at the same time.
///
/// More pass more seldom over a body, but what is in work between them must fit into a cache: on one
/// thread of an AMD EPYC (Zen 5, second-level cache of 1 MiB), a cloth of 200² was fastest with 8 of
/// 4, 8, 16 and 32 phases (1151, 1178, 1150 and 1110 million projections per second, 1063 phase by
/// phase), one of 512² with 32 (693, 797, 823 and 951, 694). Miri is too slow for as many.
const WINDOW: usize = if cfg!(miri) { 2 } else { 16 };

/// Attempts to find work before a thread takes pieces of other queues although its own one has some
/// that are not ready: about a microsecond.
const PATIENCE: u32 = 32;

/// Progress of one queue: for each phase of the window its number, counted from 1, in the upper half,
/// and the number of its pieces that were taken in the lower half. On a cache line of its own, because
/// mostly one thread accesses it.
#[derive(Debug)]
#[repr(align(128))]
struct Queue([AtomicU64; WINDOW]);

impl Queue {
    fn taken(&self, phase: u32) -> &AtomicU64 {
        &self.0[phase as usize % WINDOW]
    }

    /// Whether all of `count` pieces in this phase were taken.
    fn is_empty(&self, phase: u32, count: usize) -> bool {
        let taken = self.taken(phase).load(Ordering::Relaxed);
        count == 0 || taken >= (u64::from(phase) << 32) + count as u64
    }

    /// Takes the next of `count` pieces in this phase, if there is one and it is ready.
    fn take(&self, phase: u32, count: usize, is_ready: impl Fn(usize) -> bool) -> Option<usize> {
        let first = u64::from(phase) << 32;
        let all = self.taken(phase);
        let mut before = all.load(Ordering::Relaxed);
        loop {
            // An earlier phase in this place is done.
            let taken = before.max(first);
            if taken >= first + count as u64 {
                return None;
            }
            let place = (taken - first) as usize;
            if !is_ready(place) {
                return None;
            }
            let order = Ordering::Relaxed;
            match all.compare_exchange_weak(before, taken + 1, order, order) {
                Ok(_) => return Some(place),
                Err(now) => before = now,
            }
        }
    }
}

/// Number of the last phase that is done on a partition. On a cache line of its own: threads read it
/// while others write those of other partitions.
#[derive(Debug)]
#[repr(align(64))]
struct Progress(AtomicU32);

/// Synchronization of the threads.
#[derive(Debug)]
pub(crate) struct PhaseExecutor {
    queues: [Queue; MAX_QUEUES],
    progress: [Progress; MAX_PARTITIONS],
    /// Phase in which a piece failed; later ones do not start.
    failed: AtomicU32,
    /// The first error of that phase.
    error: Mutex<Option<(u32, NotFinite)>>,
}

impl PhaseExecutor {
    pub fn new() -> Self {
        Self {
            queues: [const { Queue([const { AtomicU64::new(0) }; WINDOW]) }; MAX_QUEUES],
            progress: [const { Progress(AtomicU32::new(0)) }; MAX_PARTITIONS],
            failed: AtomicU32::new(u32::MAX),
            error: Mutex::new(None),
        }
    }

    /// Executes all phases on as many threads as there are.
    ///
    /// # Errors
    /// The first error of the phase that failed.
    pub fn work<'a>(
        self,
        threads: &Threads,
        phases: impl Iterator<Item = Phase<'a>> + Clone + Send + Sync,
        work: &(impl Fn(&Phase, usize) -> Result<(), NotFinite> + Sync),
    ) -> Result<(), NotFinite> {
        let count = threads.count();
        threads.run(&|number| self.run_worker((number, count), phases.clone(), work));
        let error = self.error.into_inner();
        let error = error.unwrap_or_else(PoisonError::into_inner);
        error.map_or(Ok(()), |(_, error)| Err(error))
    }

    fn run_worker<'a>(
        &self,
        (worker, workers): (usize, usize),
        phases: impl Iterator<Item = Phase<'a>>,
        work: &impl Fn(&Phase, usize) -> Result<(), NotFinite>,
    ) {
        let _guard = Guard(self);
        let queues = workers.min(MAX_QUEUES);
        let queue = |next: usize| ((worker + next) % queues, queues);
        let own = queue(0);
        let mut window = Window::new(phases);
        let mut turns = 0;
        // A phase after one that failed does not begin.
        while let Some(oldest) = window.oldest()
            && oldest.0 <= self.failed.load(Ordering::Acquire)
        {
            if (0..queues).all(|next| self.is_taken(oldest, queue(next))) {
                window.advance();
                continue;
            }
            // The oldest phase first, so that each is some pieces behind the one before.
            let mut has_worked = false;
            for phase in window.phases() {
                has_worked |= self.work_on_next(phase, own, work);
            }
            // Own pieces first, so that particles stay in the cache of a core.
            if !has_worked && (turns > PATIENCE || self.is_taken(oldest, own)) {
                has_worked = window.phases().any(|phase| {
                    (1..queues).any(|next| self.work_on_next(phase, queue(next), work))
                });
            }
            if has_worked {
                turns = 0;
            } else {
                pause(&mut turns);
            }
        }
    }

    /// Whether all pieces of a phase in one of the queues were taken.
    fn is_taken(&self, (number, phase): (u32, &Phase), queue: (usize, usize)) -> bool {
        let count = pieces(phase, queue).len();
        self.queues[queue.0].is_empty(number, count)
    }

    /// Works on the next piece of a phase in one of the queues, if there is one and the phase before
    /// is done on its particles; returns whether it did.
    fn work_on_next(
        &self,
        (number, phase): (u32, &Phase),
        queue: (usize, usize),
        work: &impl Fn(&Phase, usize) -> Result<(), NotFinite>,
    ) -> bool {
        let pieces = pieces(phase, queue);
        // Neighboring queues begin where they meet, or both end there, so that they are there at the
        // same time.
        let piece = |place: usize| match queue.0 % 2 {
            0 => pieces.end - 1 - place,
            _ => pieces.start + place,
        };
        let progress = |place: usize| &self.progress[phase.pieces[piece(place)].partitions.clone()];
        let is_ready = |place: usize| {
            let mut partitions = progress(place).iter();
            partitions.all(|it| it.0.load(Ordering::Acquire) + 1 >= number)
                && self.failed.load(Ordering::Acquire) >= number
        };
        let taken = self.queues[queue.0].take(number, pieces.len(), is_ready);
        let Some(place) = taken else {
            return false;
        };
        if let Err(error) = work(phase, piece(place)) {
            self.fail(number, error);
        }
        for partition in progress(place) {
            partition.0.store(number, Ordering::Release);
        }
        true
    }

    fn fail(&self, phase: u32, error: NotFinite) {
        let mut first = self.error.lock().unwrap_or_else(PoisonError::into_inner);
        let rank = |phase: u32, error: NotFinite| (phase, error.substep, error.particle);
        if !first.is_some_and(|(other, it)| rank(other, it) <= rank(phase, error)) {
            *first = Some((phase, error));
        }
        self.failed.fetch_min(phase, Ordering::Release);
    }
}

/// The pieces of a phase in one of some queues.
fn pieces(phase: &Phase, (queue, queues): (usize, usize)) -> Range<usize> {
    let count = phase.pieces.len();
    count * queue / queues..count * (queue + 1) / queues
}

/// The phases that are in work, with their numbers from 1.
struct Window<'a, I> {
    coming: I,
    phases: [Option<Phase<'a>>; WINDOW],
    numbers: Range<u32>,
}

impl<'a, I: Iterator<Item = Phase<'a>>> Window<'a, I> {
    fn new(coming: I) -> Self {
        let mut window = Self {
            coming,
            phases: [const { None }; WINDOW],
            numbers: 1..1,
        };
        for _ in 0..WINDOW {
            window.add();
        }
        window
    }

    /// Adds the next phase, if any.
    fn add(&mut self) {
        if let Some(phase) = self.coming.next() {
            self.phases[self.numbers.end as usize % WINDOW] = Some(phase);
            self.numbers.end += 1;
        }
    }

    /// Drops the oldest phase, all of whose pieces were taken.
    fn advance(&mut self) {
        self.numbers.start += 1;
        self.add();
    }

    /// From the oldest to the newest.
    fn phases(&self) -> impl Iterator<Item = (u32, &Phase<'a>)> {
        self.numbers.clone().filter_map(|number| {
            let phase = self.phases[number as usize % WINDOW].as_ref();
            phase.map(|phase| (number, phase))
        })
    }

    fn oldest(&self) -> Option<(u32, &Phase<'a>)> {
        self.phases().next()
    }
}

/// Releases the other threads when one panics.
struct Guard<'a>(&'a PhaseExecutor);

impl Drop for Guard<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.failed.store(0, Ordering::Release);
        }
    }
}

#[cfg(all(test, feature = "parallel"))]
mod tests {
    use super::*;
    use crate::{
        parallel::scope::Side,
        partitions::{MIN_CUT, Partitions},
        phases::{Phases, Task},
    };
    use std::{hint::spin_loop, iter};

    const PHASES: u32 = if cfg!(miri) { 20 } else { 200 };

    /// A phase per substep: mostly of the even and of the odd partitions in turn.
    fn phases(
        partitions: &Partitions,
    ) -> Phases<'_, impl Iterator<Item = (Task, Side)> + Clone + Send + Sync> {
        let tasks = (0..PHASES).map(|substep| {
            let side = match substep % 7 {
                6 => Side::Whole,
                it if it % 2 == 0 => Side::Even,
                _ => Side::Odd,
            };
            (Task::End { substep }, side)
        });
        Phases::new(tasks, partitions)
    }

    fn substep(phase: &Phase) -> u32 {
        match phase.tasks() {
            &[Task::End { substep }] => substep,
            tasks => panic!("one task per phase, not {tasks:?}"),
        }
    }

    #[test]
    fn a_piece_begins_when_the_phase_before_is_done_on_its_particles() {
        let partitions = Partitions::cut(4 * MIN_CUT, iter::empty(), None);
        // The last has more threads than there are pieces.
        for count in [1, 2, 3, 20] {
            let threads = Threads::new(count).expect("the system starts threads");
            let done: Vec<_> = (0..partitions.count()).map(|_| AtomicU32::new(0)).collect();
            let work = |phase: &Phase, piece: usize| {
                let number = substep(phase);
                let piece = &phase.pieces[piece];
                let done = || done[piece.partitions.clone()].iter();
                for partition in done() {
                    assert_eq!(partition.load(Ordering::Relaxed), number);
                }
                // Pieces take different times.
                let turns = piece.particles.start * 7 + number as usize * 13;
                (0..turns % 97).for_each(|_| spin_loop());
                for partition in done() {
                    partition.store(number + 1, Ordering::Relaxed);
                }
                Ok(())
            };
            let result = PhaseExecutor::new().work(&threads, phases(&partitions), &work);
            assert_eq!(result, Ok(()));
            for partition in &done {
                assert_eq!(partition.load(Ordering::Relaxed), PHASES, "{count} threads");
            }
        }
    }

    #[test]
    fn the_error_is_that_of_the_earliest_phase_on_any_number_of_threads() {
        let partitions = Partitions::cut(4 * MIN_CUT, iter::empty(), None);
        let middle = partitions.pieces(true)[2].particles.start;
        let work = |phase: &Phase, piece: usize| {
            let substep = substep(phase);
            let particle = phase.pieces[piece].particles.start;
            // In substep 8 pieces from the third on fail, later all.
            match (substep, particle) {
                (8, it) if it < middle => Ok(()),
                (8.., _) => Err(NotFinite { particle, substep }),
                _ => Ok(()),
            }
        };
        for count in [1, 2, 3, 4] {
            let threads = Threads::new(count).expect("the system starts threads");
            for _ in 0..if cfg!(miri) { 1 } else { 100 } {
                let result = PhaseExecutor::new().work(&threads, phases(&partitions), &work);
                let first = NotFinite {
                    particle: middle,
                    substep: 8,
                };
                assert_eq!(result, Err(first), "{count} threads");
            }
        }
    }
}
