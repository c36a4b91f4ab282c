//! A thread pool whose caller does not wait for the workers to start.
//!
//! A tick of a body takes a few tenths of a millisecond, and waking a thread takes a twentieth.
//! Therefore the caller starts at once, workers join when they are awake, and the caller waits only
//! for those that have joined: [`rayon::ThreadPool::spawn_broadcast`] calls every worker. Each then
//! waits for the next piece of work for a tenth of a millisecond, because some effects have work for
//! all threads in each pass. (With `install`, where the caller waits, a cloth of 64² was slower on two
//! threads than on one at 4 substeps per tick, 0.68 ×, and 1.36 × as fast at 16.)

#![allow(
    unsafe_code,
    reason = "threads that outlive a piece of work are lent it"
)]

use super::wait::pause;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};
use std::{
    any::Any,
    panic::{AssertUnwindSafe, catch_unwind, resume_unwind},
    sync::{
        Arc, Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, AtomicUsize, Ordering},
    },
};

/// Spin iterations before a caller that waits for workers sleeps: about ten microseconds.
const PATIENCE: u32 = 256;

/// Iterations in which a worker waits for the next piece of work: most of them yield the core.
const LINGER: u32 = 512;

/// Work shared by the caller: called with 0 on its own thread, and with 1, 2 and so on by workers
/// as they join. Each call must be able to complete all of the work alone. A worker may call it again
/// while it is open, with another number.
pub type Job<'a> = dyn Fn(usize) + Sync + 'a;

/// Worker threads in addition to the calling thread.
#[derive(Debug)]
pub struct Pool {
    threads: ThreadPool,
    shared: Arc<PoolState>,
}

#[derive(Debug, Default)]
struct PoolState {
    state: Mutex<State>,
    /// Notified when the last worker leaves.
    left: Condvar,
    /// Number of workers inside; written under the lock, read without it.
    inside: AtomicUsize,
    /// Number of the newest piece of work; written under the lock.
    newest: AtomicU64,
    /// Number of workers that perform a piece of work or wait for the next one.
    awake: AtomicUsize,
    /// Number of workers that have been called and have not come yet.
    called: AtomicUsize,
    /// Number of the last call.
    call: AtomicU64,
}

#[derive(Debug, Default)]
struct State {
    /// The open piece of work.
    work: Option<Lent>,
    /// Whether a caller is active, from opening its work until it takes the result.
    is_taken: bool,
    /// Number for the next worker.
    next: usize,
    panic: Option<Panic>,
}

type Panic = Box<dyn Any + Send>;

/// Work that workers may call: its caller does not return before they have left.
#[derive(Debug, Clone, Copy)]
struct Lent(*const Job<'static>);

// SAFETY: the work is `Sync`, so any thread may call it.
unsafe impl Send for Lent {}

impl Pool {
    /// Starts this number of workers.
    ///
    /// # Errors
    /// When the system refuses to start one.
    pub fn start(workers: usize) -> Result<Self, ThreadPoolBuildError> {
        let threads = ThreadPoolBuilder::new()
            .num_threads(workers)
            .thread_name(|index| format!("solver {}", index + 1))
            .build()?;
        Ok(Self {
            threads,
            shared: Arc::default(),
        })
    }

    /// Number of workers.
    pub fn workers(&self) -> usize {
        self.threads.current_num_threads()
    }

    /// Performs `work`, together with the workers that join in time. While they are busy with
    /// another caller's work, the caller performs it alone.
    ///
    /// # Panics
    /// If `work` panics on any of the threads.
    pub fn run(&self, work: &Job) {
        if !self.shared.lend(work) {
            return work(0);
        }
        // Even after a panic, the work is recalled before the caller leaves.
        let ended = catch_unwind(AssertUnwindSafe(|| {
            self.wake();
            work(0);
        }));
        let theirs = self.shared.recall();
        if let Some(panic) = ended.err().or(theirs) {
            resume_unwind(panic);
        }
    }

    /// Wakes the workers that are not awake. They sleep again soon if no work follows.
    pub fn wake(&self) {
        if let Some(call) = self.shared.calls(self.workers()) {
            let shared = Arc::clone(&self.shared);
            self.threads.spawn_broadcast(move |_| shared.join(call));
        }
    }
}

impl PoolState {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Opens a piece of work, unless there is another.
    fn lend(&self, work: &Job) -> bool {
        let mut state = self.lock();
        if state.is_taken {
            return false;
        }
        let work: *const Job = work;
        // SAFETY: only the lifetime changes. Workers call it only between being counted as inside,
        // under the lock while the work is open, and being counted out. `run` does not end, by
        // return or by panic, before `recall` has closed the work and no worker is counted as
        // inside.
        let work = unsafe { std::mem::transmute::<*const Job<'_>, *const Job<'static>>(work) };
        state.work = Some(Lent(work));
        state.is_taken = true;
        state.next = 1;
        self.newest.fetch_add(1, Ordering::SeqCst);
        true
    }

    /// Number of the call, if workers must be called: not if all of them are awake, or have been called
    /// and have not come yet.
    fn calls(&self, workers: usize) -> Option<u64> {
        if self.awake.load(Ordering::SeqCst) == workers {
            return None;
        }
        // One of several callers calls them.
        self.called
            .compare_exchange(0, workers, Ordering::AcqRel, Ordering::Acquire)
            .ok()?;
        Some(self.call.fetch_add(1, Ordering::AcqRel) + 1)
    }

    /// Follows a call, with this number: performs the open piece of work, if any, and those that follow
    /// soon.
    fn join(&self, call: u64) {
        self.awake.fetch_add(1, Ordering::SeqCst);
        self.called.fetch_sub(1, Ordering::AcqRel);
        let mut seen = 0;
        loop {
            self.follow(&mut seen, call);
            self.awake.fetch_sub(1, Ordering::SeqCst);
            // Work that was opened in between counts on this worker, unless it has been called again.
            if self.newest.load(Ordering::SeqCst) == seen || self.is_older(call) {
                return;
            }
            self.awake.fetch_add(1, Ordering::SeqCst);
        }
    }

    /// Whether all workers have been called again since. They follow that call next.
    fn is_older(&self, call: u64) -> bool {
        self.call.load(Ordering::Acquire) != call
    }

    /// Performs work until none has come for a while; `seen` is the number of the last piece.
    fn follow(&self, seen: &mut u64, call: u64) {
        let mut turns = 0;
        while turns < LINGER && !self.is_older(call) {
            let newest = self.newest.load(Ordering::Acquire);
            if newest == *seen {
                pause(&mut turns);
                continue;
            }
            *seen = newest;
            if let Some(performed) = self.perform() {
                (*seen, turns) = (performed, 0);
            }
        }
    }

    /// Performs the open piece of work, if any, and returns its number.
    fn perform(&self) -> Option<u64> {
        let mut state = self.lock();
        let work = state.work?;
        let number = self.newest.load(Ordering::Relaxed);
        let member = state.next;
        state.next += 1;
        self.inside.fetch_add(1, Ordering::Relaxed);
        drop(state);
        // SAFETY: this worker was counted under the lock while the work was open.
        let ended = catch_unwind(AssertUnwindSafe(|| unsafe { (*work.0)(member) }));
        let mut state = self.lock();
        if let Err(panic) = ended {
            state.panic.get_or_insert(panic);
        }
        if self.inside.fetch_sub(1, Ordering::Release) == 1 {
            self.left.notify_one();
        }
        Some(number)
    }

    /// Closes the work, waits for the workers inside, and releases them for others. Returns the
    /// panic of one of them, if any.
    fn recall(&self) -> Option<Panic> {
        self.lock().work = None;
        let mut turns = 0;
        while turns < PATIENCE && self.inside.load(Ordering::Acquire) > 0 {
            pause(&mut turns);
        }
        let mut state = self.lock();
        while self.inside.load(Ordering::Acquire) > 0 {
            state = self
                .left
                .wait(state)
                .unwrap_or_else(PoisonError::into_inner);
        }
        state.is_taken = false;
        state.panic.take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::thread;

    #[test]
    fn work_is_done_whoever_comes_and_the_pool_lives_on() {
        let pool = Pool::start(3).expect("the system starts threads");
        for round in 0..1000 {
            let left = AtomicUsize::new(round % 50);
            let done = AtomicUsize::new(0);
            pool.run(&|_| {
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
    fn workers_have_numbers_of_their_own() {
        let pool = Pool::start(3).expect("the system starts threads");
        let came = [const { AtomicUsize::new(0) }; 4];
        pool.run(&|member| {
            came[member].fetch_add(1, Ordering::Relaxed);
            // All must have arrived before one leaves.
            while came
                .iter()
                .map(|it| it.load(Ordering::Relaxed))
                .sum::<usize>()
                < 4
            {
                thread::yield_now();
            }
        });
        let came = came.map(AtomicUsize::into_inner);
        assert_eq!(came, [1; 4], "the caller is number 0");
    }

    #[test]
    fn a_worker_that_is_busy_is_not_waited_for() {
        let pool = Pool::start(1).expect("the system starts a thread");
        let inner = AtomicUsize::new(0);
        pool.run(&|_| {
            pool.run(&|member| {
                assert_eq!(member, 0, "alone");
                inner.fetch_add(1, Ordering::Relaxed);
            });
        });
        assert!(inner.into_inner() > 0);
    }

    #[test]
    fn a_panic_on_any_thread_comes_to_the_caller_and_breaks_nothing() {
        let pool = Pool::start(1).expect("the system starts a thread");
        for culprit in 0..2 {
            let came = AtomicUsize::new(0);
            let caught = catch_unwind(AssertUnwindSafe(|| {
                pool.run(&|member| {
                    came.fetch_add(1, Ordering::Relaxed);
                    // Both must have arrived before one leaves.
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
        pool.run(&|_| {
            done.fetch_add(1, Ordering::Relaxed);
        });
        assert!(done.into_inner() > 0);
    }

    #[test]
    fn several_callers_call_each_worker_once() {
        let pool = Pool::start(2).expect("the system starts threads");
        thread::scope(|scope| {
            for _ in 0..3 {
                scope.spawn(|| {
                    for _ in 0..300 {
                        pool.wake();
                        pool.run(&|_| (0..50).for_each(|_| std::hint::spin_loop()));
                        assert!(pool.shared.called.load(Ordering::SeqCst) <= pool.workers());
                    }
                });
            }
        });
        // All calls are followed in the end.
        while pool.shared.called.load(Ordering::SeqCst) > 0 {
            thread::yield_now();
        }
    }

    /// With several callers of one pool, a panic is propagated to the caller whose work it was.
    #[test]
    fn a_panic_comes_to_its_own_caller() {
        let pool = Pool::start(2).expect("the system starts threads");
        let caught = AtomicUsize::new(0);
        thread::scope(|scope| {
            scope.spawn(|| {
                // Until a worker has arrived.
                while caught.load(Ordering::Relaxed) < 100 {
                    let ended = catch_unwind(AssertUnwindSafe(|| {
                        pool.run(&|member| {
                            if member > 0 {
                                resume_unwind(Box::new("as meant"));
                            }
                            (0..200).for_each(|_| std::hint::spin_loop());
                        });
                    }));
                    caught.fetch_add(usize::from(ended.is_err()), Ordering::Relaxed);
                }
            });
            for _ in 0..2000 {
                pool.run(&|_| (0..200).for_each(|_| std::hint::spin_loop()));
            }
        });
        assert_eq!(caught.into_inner(), 100);
    }
}
