//! How many threads the solver may use.
//!
//! What is computed never depends on it: work is cut by the body, not by the threads, and threads
//! only take pieces that share no particle. Without the feature `parallel` there is one thread.

#[cfg(feature = "parallel")]
use std::sync::Arc;

/// Threads to step bodies with; one by default.
#[derive(Debug, Clone, Default)]
pub struct Threads {
    #[cfg(feature = "parallel")]
    pool: Option<Arc<rayon::ThreadPool>>,
}

/// The threads that were asked for cannot be had.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{count} threads cannot be started: {reason}")]
pub struct ThreadsError {
    /// How many were asked for.
    pub count: usize,
    /// Why not.
    pub reason: String,
}

/// More threads than this are refused: a slip of the pen, not a machine.
pub const MOST_THREADS: usize = 1024;

impl Threads {
    /// So many threads, from 1 to [`MOST_THREADS`]; 0 for one on each core.
    ///
    /// # Errors
    /// [`ThreadsError`] if there are too many, or the system refuses to start them.
    pub fn new(count: usize) -> Result<Self, ThreadsError> {
        let count = if count == 0 { available() } else { count };
        if count > MOST_THREADS {
            return Err(ThreadsError {
                count,
                reason: format!("at most {MOST_THREADS} make sense"),
            });
        }
        Self::start(count)
    }

    #[cfg(feature = "parallel")]
    fn start(count: usize) -> Result<Self, ThreadsError> {
        let pool = match count {
            1 => None,
            _ => Some(Arc::new(
                rayon::ThreadPoolBuilder::new()
                    .num_threads(count)
                    .thread_name(|index| format!("solver {index}"))
                    .build()
                    .map_err(|error| ThreadsError {
                        count,
                        reason: error.to_string(),
                    })?,
            )),
        };
        Ok(Self { pool })
    }

    #[cfg(not(feature = "parallel"))]
    fn start(_count: usize) -> Result<Self, ThreadsError> {
        Ok(Self {})
    }

    /// How many there are.
    #[must_use]
    pub fn count(&self) -> usize {
        #[cfg(feature = "parallel")]
        return self
            .pool
            .as_ref()
            .map_or(1, |pool| pool.current_num_threads());
        #[cfg(not(feature = "parallel"))]
        return 1;
    }

    /// Whether so many projections of constraints are worth more than one thread: some 0.1 ms.
    #[must_use]
    pub fn pays(&self, projections: usize) -> bool {
        self.count() > 1 && projections > 20_000
    }

    /// Does `work` on one of the threads, so that what it [joins](Self::join) is shared out.
    pub fn run<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        #[cfg(feature = "parallel")]
        if let Some(pool) = &self.pool {
            return pool.install(work);
        }
        work()
    }

    /// Does both, at the same time if there is a thread for it; to be called in [`run`](Self::run).
    pub fn join<A: Send, B: Send>(
        &self,
        a: impl FnOnce() -> A + Send,
        b: impl FnOnce() -> B + Send,
    ) -> (A, B) {
        #[cfg(feature = "parallel")]
        if self.pool.is_some() {
            return rayon::join(a, b);
        }
        (a(), b())
    }

    /// Does the same with each, at the same time if there are threads for it and so many
    /// projections of constraints are worth it.
    pub fn for_each<T: Send>(
        &self,
        items: &mut [T],
        projections: usize,
        work: &(impl Fn(&mut T) + Sync),
    ) {
        if items.len() > 1 && self.pays(projections) {
            self.run(|| self.each(items, work));
        } else {
            items.iter_mut().for_each(work);
        }
    }

    fn each<T: Send>(&self, items: &mut [T], work: &(impl Fn(&mut T) + Sync)) {
        match items {
            [] => {}
            [one] => work(one),
            _ => {
                let (left, right) = items.split_at_mut(items.len() / 2);
                self.join(|| self.each(left, work), || self.each(right, work));
            }
        }
    }
}

/// The same number.
impl PartialEq for Threads {
    fn eq(&self, other: &Self) -> bool {
        self.count() == other.count()
    }
}

/// Threads that this machine runs at the same time.
#[must_use]
pub fn available() -> usize {
    std::thread::available_parallelism().map_or(1, |count| count.get().min(MOST_THREADS))
}
