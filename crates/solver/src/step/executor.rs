//! Phase executor: threads that step one body together.
//!
//! Every thread passes through the same phases and takes the pieces of its own queue before those
//! of others (so that particles stay in the cache of a core). A piece begins when the previous phase
//! is done on its particles: a thread waits for the neighbors of a piece, not for the whole body, and
//! goes on to the next phase while another thread is still in this one. Threads that join late find
//! the work done; no thread waits for others to join. The result does not depend on which thread
//! takes a piece.

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

/// Number of the last phase that is done on a partition. On a cache line of its own: a thread waits
/// for it while others write those of other partitions.
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
            queues: [const { Queue(AtomicU64::new(0)) }; MAX_QUEUES],
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
        &self,
        threads: &Threads,
        phases: impl Iterator<Item = Phase<'a>> + Clone + Send + Sync,
        work: &(impl Fn(&Phase, usize) -> Result<(), NotFinite> + Sync),
    ) -> Result<(), NotFinite> {
        let count = threads.count();
        threads.run(&|number| self.run_worker((number, count), phases.clone(), work));
        let mut error = self.error.lock().unwrap_or_else(PoisonError::into_inner);
        error.take().map_or(Ok(()), |(_, error)| Err(error))
    }

    fn run_worker<'a>(
        &self,
        (worker, workers): (usize, usize),
        phases: impl Iterator<Item = Phase<'a>>,
        work: &impl Fn(&Phase, usize) -> Result<(), NotFinite>,
    ) {
        let _guard = Guard(self);
        let queues = workers.min(MAX_QUEUES);
        for (number, phase) in (1..).zip(phases) {
            let pieces = phase.pieces.len();
            // The thread's own queue first, so that particles stay in the cache of a core.
            for queue in (0..queues).map(|next| (worker + next) % queues) {
                let first = pieces * queue / queues;
                let end = pieces * (queue + 1) / queues;
                while let Some(place) = self.queues[queue].take(number, end - first) {
                    // Neighboring queues begin where they meet, or both end there: what one of them
                    // needs from the other was done almost a phase ago.
                    let piece = match queue % 2 {
                        0 => end - 1 - place,
                        _ => first + place,
                    };
                    let partitions = phase.pieces[piece].partitions.clone();
                    if !self.wait(partitions.clone(), number) {
                        return;
                    }
                    if let Err(error) = work(&phase, piece) {
                        self.fail(number, error);
                    }
                    for partition in &self.progress[partitions] {
                        partition.0.store(number, Ordering::Release);
                    }
                }
            }
        }
    }

    /// Waits until the phase before this one is done on these partitions; false if an earlier phase
    /// failed. All pieces of that phase have been taken, so that each is done or in work.
    fn wait(&self, partitions: Range<usize>, phase: u32) -> bool {
        for partition in &self.progress[partitions] {
            let mut spins = 0;
            while partition.0.load(Ordering::Acquire) + 1 < phase {
                if self.failed.load(Ordering::Acquire) < phase {
                    return false;
                }
                pause(&mut spins);
            }
        }
        self.failed.load(Ordering::Acquire) >= phase
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
        partitions::{MIN_CUT, Partitions},
        phases::{Phases, Task},
        step::scope::Side,
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
        for count in [1, 2, 3, 4] {
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
