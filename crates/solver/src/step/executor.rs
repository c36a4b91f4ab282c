//! Threads that step one body together.
//!
//! Each goes through the same phases, takes the pieces that are its own before those of others
//! (so that particles stay in the cache of a core), and waits at the end of a phase until all
//! pieces of it are done. A thread that comes late finds the work done; nobody waits for it to
//! come. What is computed does not depend on who takes which piece.

use crate::{Threads, parallel::wait::pause, phases::Phase, step::stepper::NotFinite};
use std::sync::{
    Mutex, PoisonError,
    atomic::{AtomicU32, AtomicU64, AtomicUsize, Ordering},
};

/// The pieces of a phase are dealt out into as many shares as there are threads, up to this.
const MAX_QUEUES: usize = 64;

/// How far one share of the pieces has been taken: the phase, which counts from 1, in the upper
/// half, and in the lower how many of its pieces. On a cache line of its own, as the thread
/// whose share it is mostly takes from it alone.
#[derive(Debug)]
#[repr(align(128))]
struct Queue(AtomicU64);

impl Queue {
    /// The next of `count` pieces in this phase, if one is left.
    fn take(&self, phase: u32, count: usize) -> Option<usize> {
        let first = u64::from(phase) << 32;
        let take = |taken: u64| {
            let taken = taken.max(first);
            (taken < first + count as u64).then_some(taken + 1)
        };
        let before = self
            .0
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, take);
        before.ok().map(|taken| (taken.max(first) - first) as usize)
    }
}

/// What the threads of a crew tell each other.
#[derive(Debug)]
pub(crate) struct PhaseExecutor {
    queues: [Queue; MAX_QUEUES],
    /// Pieces done in all phases.
    done: AtomicUsize,
    /// The phase in which a piece failed; later ones are not begun.
    failed: AtomicU32,
    error: Mutex<Option<NotFinite>>,
}

impl PhaseExecutor {
    pub fn new() -> Self {
        Self {
            queues: [const { Queue(AtomicU64::new(0)) }; MAX_QUEUES],
            done: AtomicUsize::new(0),
            failed: AtomicU32::new(u32::MAX),
            error: Mutex::new(None),
        }
    }

    /// Goes through all phases with as many threads as there are.
    ///
    /// # Errors
    /// The first of the errors in the phase that had one.
    pub fn work<'a>(
        &self,
        threads: &Threads,
        phases: impl Iterator<Item = Phase<'a>> + Clone + Send + Sync,
        work: &(impl Fn(&Phase, usize) -> Result<(), NotFinite> + Sync),
    ) -> Result<(), NotFinite> {
        let count = threads.count();
        threads.share(&|number| self.member((number, count), phases.clone(), work));
        let mut error = self.error.lock().unwrap_or_else(PoisonError::into_inner);
        error.take().map_or(Ok(()), Err)
    }

    fn member<'a>(
        &self,
        (member, members): (usize, usize),
        phases: impl Iterator<Item = Phase<'a>>,
        work: &impl Fn(&Phase, usize) -> Result<(), NotFinite>,
    ) {
        let _guard = Guard(self);
        let queues = members.min(MAX_QUEUES);
        let mut all = 0;
        for (number, phase) in (1..).zip(phases) {
            let pieces = phase.pieces.len();
            let mut done = 0;
            // Its own share first, so that particles stay in the cache of a core.
            for share in (0..queues).map(|next| (member + next) % queues) {
                let first = pieces * share / queues;
                let count = pieces * (share + 1) / queues - first;
                while let Some(place) = self.queues[share].take(number, count) {
                    if let Err(error) = work(&phase, first + place) {
                        self.fail(number, error);
                    }
                    done += 1;
                }
            }
            // Once a phase, not once a piece: each time the line goes from core to core.
            self.done.fetch_add(done, Ordering::Release);
            all += pieces;
            if !self.wait(all, number) {
                return;
            }
        }
    }

    /// Waits until so many pieces are done; false if a piece of this phase or before failed.
    fn wait(&self, pieces: usize, phase: u32) -> bool {
        let mut turns = 0;
        while self.done.load(Ordering::Acquire) < pieces {
            if self.failed.load(Ordering::Acquire) < phase {
                return false;
            }
            pause(&mut turns);
        }
        self.failed.load(Ordering::Acquire) > phase
    }

    fn fail(&self, phase: u32, error: NotFinite) {
        let mut first = self.error.lock().unwrap_or_else(PoisonError::into_inner);
        let before =
            |other: NotFinite| (other.substep, other.particle) <= (error.substep, error.particle);
        if !first.is_some_and(before) {
            *first = Some(error);
        }
        self.failed.fetch_min(phase, Ordering::Release);
    }
}

/// Lets the others go home when a member panics.
struct Guard<'a>(&'a PhaseExecutor);

impl Drop for Guard<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.failed.store(0, Ordering::Release);
        }
    }
}
