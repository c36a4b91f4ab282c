//! Threads that wait, and share work with whoever has some.
//!
//! A tick of a body takes some tenths of a millisecond, and to wake a thread takes a twentieth. So
//! the caller does not hand its work over and sleep: it begins at once, the others join it when
//! they are awake, and one that has not come when the work is done is not waited for. (With a pool
//! that has the caller wait, a cloth of 64² was slower on two threads than on one at 4 substeps a
//! tick, 0.68 ×, and 1.36 × as fast at 16.) Nothing is allocated on the way.

#![allow(
    unsafe_code,
    reason = "threads that outlive a piece of work are lent it"
)]

use super::wait::pause;
use std::{
    any::Any,
    io,
    panic::{AssertUnwindSafe, catch_unwind, resume_unwind},
    sync::{
        Arc, Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, AtomicUsize, Ordering},
    },
    thread::{self, JoinHandle},
};

/// Turns of waiting for the next work before a thread goes to sleep: some ten microseconds.
const PATIENCE: u32 = 256;

/// Work that the caller shares: who calls it with number 0, and the others, as they come, with 1
/// and so on. It has to do all there is to do whoever comes.
pub type Work<'a> = dyn Fn(usize) + Sync + 'a;

/// Some threads beside the caller's.
#[derive(Debug)]
pub struct Team {
    shared: Arc<Shared>,
    helpers: Vec<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Shared {
    state: Mutex<State>,
    /// Told when there is work, or when all is over.
    begin: Condvar,
    /// Told when the last helper leaves.
    left: Condvar,
    /// How many pieces of work there have been, to look at without the lock.
    number: AtomicU64,
    /// Helpers at work, to look at without the lock.
    inside: AtomicUsize,
}

#[derive(Debug, Default)]
struct State {
    work: Option<Lent>,
    /// Which helper is the next to come.
    next: usize,
    panic: Option<Box<dyn Any + Send>>,
    over: bool,
}

/// Work that helpers may call while it is in [`State::work`], or while they are counted in
/// [`Shared::inside`].
#[derive(Debug, Clone, Copy)]
struct Lent(*const Work<'static>);

// SAFETY: the work is `Sync`, so any thread may call it.
unsafe impl Send for Lent {}

impl Team {
    /// So many threads.
    ///
    /// # Errors
    /// When the system refuses to start one.
    pub fn start(helpers: usize) -> io::Result<Self> {
        let mut team = Self {
            shared: Arc::default(),
            helpers: Vec::with_capacity(helpers),
        };
        for index in 1..=helpers {
            let shared = Arc::clone(&team.shared);
            let thread = thread::Builder::new().name(format!("solver {index}"));
            team.helpers.push(thread.spawn(move || shared.help())?);
        }
        Ok(team)
    }

    /// How many threads there are beside the caller's.
    pub fn helpers(&self) -> usize {
        self.helpers.len()
    }

    /// Does `work`, with the others as far as they come. If they are busy with the work of somebody
    /// else, the caller does it alone.
    ///
    /// # Panics
    /// When `work` does, on any of the threads.
    pub fn share(&self, work: &Work) {
        if !self.shared.lend(work) {
            return work(0);
        }
        let recall = Recall(&self.shared);
        work(0);
        drop(recall);
        let panic = self.shared.lock().panic.take();
        if let Some(panic) = panic {
            resume_unwind(panic);
        }
    }
}

impl Drop for Team {
    fn drop(&mut self) {
        self.shared.lock().over = true;
        self.shared.begin.notify_all();
        for helper in self.helpers.drain(..) {
            // What panicked in it was handed to the owner of the work.
            let _ended = helper.join();
        }
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether the helpers were free to be lent the work.
    fn lend(&self, work: &Work) -> bool {
        let mut state = self.lock();
        if state.work.is_some() || self.inside.load(Ordering::Relaxed) > 0 {
            return false;
        }
        let work: *const Work = work;
        // SAFETY: only the lifetime changes. `Recall` takes the work back, and waits for all who
        // are inside, before what it borrows from can go.
        let work = unsafe { std::mem::transmute::<*const Work<'_>, *const Work<'static>>(work) };
        state.work = Some(Lent(work));
        state.next = 1;
        self.number.fetch_add(1, Ordering::Relaxed);
        drop(state);
        self.begin.notify_all();
        true
    }

    /// The life of a helper.
    fn help(&self) {
        let mut seen = 0;
        loop {
            let mut turns = 0;
            while turns < PATIENCE && self.number.load(Ordering::Relaxed) == seen {
                pause(&mut turns);
            }
            let mut state = self.lock();
            let (work, member) = loop {
                if state.over {
                    return;
                }
                let number = self.number.load(Ordering::Relaxed);
                if number != seen {
                    seen = number;
                    if let Some(work) = state.work {
                        let member = state.next;
                        state.next += 1;
                        break (work, member);
                    }
                }
                state = self
                    .begin
                    .wait(state)
                    .unwrap_or_else(PoisonError::into_inner);
            };
            self.inside.fetch_add(1, Ordering::Relaxed);
            drop(state);
            // SAFETY: this helper was counted under the lock while the work was there.
            let ended = catch_unwind(AssertUnwindSafe(|| unsafe { (*work.0)(member) }));
            let mut state = self.lock();
            if let Err(panic) = ended {
                state.panic.get_or_insert(panic);
            }
            if self.inside.fetch_sub(1, Ordering::Release) == 1 {
                self.left.notify_one();
            }
        }
    }
}

/// Takes the work back from the helpers, also when the caller panics.
struct Recall<'a>(&'a Shared);

impl Drop for Recall<'_> {
    fn drop(&mut self) {
        self.0.lock().work = None;
        let mut turns = 0;
        while turns < PATIENCE && self.0.inside.load(Ordering::Acquire) > 0 {
            pause(&mut turns);
        }
        let mut state = self.0.lock();
        while self.0.inside.load(Ordering::Acquire) > 0 {
            state = self
                .0
                .left
                .wait(state)
                .unwrap_or_else(PoisonError::into_inner);
        }
        if thread::panicking() {
            state.panic = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn work_is_done_whoever_comes_and_the_team_lives_on() {
        let team = Team::start(3).expect("four threads can be had");
        for round in 0..1000 {
            let left = AtomicUsize::new(round % 50);
            let done = AtomicUsize::new(0);
            team.share(&|_| {
                let take = |left: usize| left.checked_sub(1);
                while left
                    .fetch_update(Ordering::Relaxed, Ordering::Relaxed, take)
                    .is_ok()
                {
                    done.fetch_add(1, Ordering::Relaxed);
                }
            });
            assert_eq!(done.into_inner(), round % 50);
        }
    }

    #[test]
    fn members_have_numbers_of_their_own() {
        let team = Team::start(3).expect("four threads can be had");
        let came = [const { AtomicUsize::new(0) }; 4];
        team.share(&|member| {
            came[member].fetch_add(1, Ordering::Relaxed);
            thread::sleep(Duration::from_millis(50));
        });
        let came = came.map(AtomicUsize::into_inner);
        assert_eq!(came[0], 1, "the caller");
        assert!(came.iter().all(|&count| count <= 1), "{came:?}");
        assert!(came.iter().sum::<usize>() > 1, "nobody came in 50 ms");
    }

    #[test]
    fn who_is_busy_is_not_waited_for() {
        let team = Team::start(1).expect("two threads can be had");
        let inner = AtomicUsize::new(0);
        team.share(&|_| {
            team.share(&|member| {
                assert_eq!(member, 0, "alone");
                inner.fetch_add(1, Ordering::Relaxed);
            });
        });
        assert!(inner.into_inner() > 0);
    }

    #[test]
    fn a_panic_of_anyone_comes_to_the_caller_and_breaks_nothing() {
        let team = Team::start(1).expect("two threads can be had");
        for culprit in 0..2 {
            let came = AtomicUsize::new(0);
            let caught = catch_unwind(AssertUnwindSafe(|| {
                team.share(&|member| {
                    came.fetch_add(1, Ordering::Relaxed);
                    // Both must have come before one goes.
                    while came.load(Ordering::Relaxed) < 2 {
                        thread::yield_now();
                    }
                    if member == culprit {
                        resume_unwind(Box::new("as meant"));
                    }
                });
            }));
            assert!(caught.is_err(), "member {culprit}");
        }
        let done = AtomicUsize::new(0);
        team.share(&|_| {
            done.fetch_add(1, Ordering::Relaxed);
        });
        assert!(done.into_inner() > 0);
    }
}
