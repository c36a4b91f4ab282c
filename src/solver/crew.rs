//! Threads that step one body together.
//!
//! Each goes through the same phases, takes the pieces that are its own before those of others
//! (so that particles stay in the cache of a core), and waits at the end of a phase until all
//! pieces of it are done. A thread that comes late finds the work done; nobody waits for it to
//! come. What is computed does not depend on who takes which piece.

use super::{Threads, advance::NotFinite, phases::Phase};
use std::sync::{
    Mutex, PoisonError,
    atomic::{AtomicU32, AtomicUsize, Ordering},
};

/// A body is cut into at most so many pieces.
pub const MOST_PIECES: usize = 256;

/// Turns of waiting before a thread lets others have its core: some ten microseconds.
const PATIENCE: u32 = 256;

/// Waits a turn: at first busily, for what is about to happen; then others may have the core.
pub(super) fn pause(turns: &mut u32) {
    *turns += 1;
    if *turns < PATIENCE {
        std::hint::spin_loop();
    } else {
        std::thread::yield_now();
    }
}

/// What the threads of a crew tell each other.
#[derive(Debug)]
pub(super) struct Crew {
    /// For each piece, the last phase in which somebody took it; phases count from 1.
    taken: [AtomicU32; MOST_PIECES],
    /// Pieces done in all phases.
    done: AtomicUsize,
    /// The phase in which a piece failed; later ones are not begun.
    failed: AtomicU32,
    error: Mutex<Option<NotFinite>>,
}

impl Crew {
    pub fn new() -> Self {
        Self {
            taken: [const { AtomicU32::new(0) }; MOST_PIECES],
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
        let mut all = 0;
        for (number, phase) in (1..).zip(phases) {
            let pieces = phase.pieces.len();
            let home = pieces * member / members;
            for piece in (home..pieces).chain(0..home) {
                if self.take(piece, number) {
                    if let Err(error) = work(&phase, piece) {
                        self.fail(number, error);
                    }
                    self.done.fetch_add(1, Ordering::Release);
                }
            }
            all += pieces;
            if !self.wait(all, number) {
                return;
            }
        }
    }

    /// Whether the piece is left for the caller in this phase.
    fn take(&self, piece: usize, phase: u32) -> bool {
        let taken = &self.taken[piece];
        taken.load(Ordering::Relaxed) < phase && taken.fetch_max(phase, Ordering::Relaxed) < phase
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
struct Guard<'a>(&'a Crew);

impl Drop for Guard<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.failed.store(0, Ordering::Release);
        }
    }
}
