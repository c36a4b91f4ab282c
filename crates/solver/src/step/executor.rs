//! Phase executor: threads that step one body together.
//!
//! Every thread passes through the same phases and takes the pieces of its own queue before those
//! of others (so that particles stay in the cache of a core). At the end of a phase it waits until
//! all pieces are done. Threads that join late find the work done; no thread waits for others to
//! join. The result does not depend on which thread takes a piece.

use crate::{Threads, parallel::wait::pause, phases::Phase, step::stepper::NotFinite};
use std::sync::{
    Mutex, PoisonError,
    atomic::{AtomicU32, AtomicU64, AtomicUsize, Ordering},
};

/// Maximum number of queues. The pieces of a phase are distributed to one queue per thread.
const MAX_QUEUES: usize = 64;

/// Progress of one queue: the phase, counted from 1, in the upper half, and the number of its
/// pieces that were taken in the lower half. On a cache line of its own, because mostly one thread
/// accesses it.
#[derive(Debug)]
#[repr(align(128))]
struct Queue(AtomicU64);

impl Queue {
    /// Takes the next of `count` pieces in this phase, if any.
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

/// Synchronization of the threads.
#[derive(Debug)]
pub(crate) struct PhaseExecutor {
    queues: [Queue; MAX_QUEUES],
    /// Number of pieces done, over all phases.
    done: AtomicUsize,
    /// Phase in which a piece failed; later ones do not start.
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

    /// Executes all phases on as many threads as there are.
    ///
    /// # Errors
    /// The first error of the phase that failed.
    pub fn work<'a>(
        &self,
        threads: &Threads,
        phases: impl Iterator<Item = Phase<'a>> + Clone + Send + Sync,
        work: &(impl Fn(&Phase, usize) -> Result<(), NotFinite> + Sync),
    ) -> Result<(), NotFinite> {
        let count = threads.count();
        threads.run(&|number| self.run_worker((number, count), phases.clone(), work));
        let mut error = self.error.lock().unwrap_or_else(PoisonError::into_inner);
        error.take().map_or(Ok(()), Err)
    }

    fn run_worker<'a>(
        &self,
        (worker, workers): (usize, usize),
        phases: impl Iterator<Item = Phase<'a>>,
        work: &impl Fn(&Phase, usize) -> Result<(), NotFinite>,
    ) {
        let _guard = Guard(self);
        let queues = workers.min(MAX_QUEUES);
        let mut all = 0;
        for (number, phase) in (1..).zip(phases) {
            let pieces = phase.pieces.len();
            let mut done = 0;
            // The thread's own queue first, so that particles stay in the cache of a core.
            for queue in (0..queues).map(|next| (worker + next) % queues) {
                let first = pieces * queue / queues;
                let count = pieces * (queue + 1) / queues - first;
                while let Some(place) = self.queues[queue].take(number, count) {
                    if let Err(error) = work(&phase, first + place) {
                        self.fail(number, error);
                    }
                    done += 1;
                }
            }
            // Once per phase, not per piece: each access moves the cache line between cores.
            self.done.fetch_add(done, Ordering::Release);
            all += pieces;
            if !self.wait(all, number) {
                return;
            }
        }
    }

    /// Waits until this number of pieces is done; false if a piece of this phase or an earlier one
    /// failed.
    fn wait(&self, pieces: usize, phase: u32) -> bool {
        let mut spins = 0;
        while self.done.load(Ordering::Acquire) < pieces {
            if self.failed.load(Ordering::Acquire) < phase {
                return false;
            }
            pause(&mut spins);
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

/// Releases the other threads when one panics.
struct Guard<'a>(&'a PhaseExecutor);

impl Drop for Guard<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.failed.store(0, Ordering::Release);
        }
    }
}
