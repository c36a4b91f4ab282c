//! Number of threads that the solver may use.
//!
//! It never affects results: work is divided by the body, not by the threads, and threads only take
//! pieces that share no particle. Without the feature `parallel` there is one thread.

#[cfg(feature = "parallel")]
use crate::parallel::pool::Pool;
#[cfg(feature = "parallel")]
use std::sync::Arc;
use std::sync::{Mutex, PoisonError};

/// Threads for stepping bodies; one by default.
#[derive(Debug, Clone, Default)]
pub struct Threads {
    #[cfg(feature = "parallel")]
    pool: Option<Arc<Pool>>,
}

/// Work estimate for a body.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct WorkEstimate {
    /// Number of constraint projections.
    pub projections: usize,
    /// Number of pieces.
    pub pieces: usize,
}

/// Error: the requested number of threads is not available.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("cannot start {count} threads: {reason}")]
pub struct ThreadsError {
    /// Requested number.
    pub count: usize,
    /// Reason.
    pub reason: String,
}

/// Up to this number of projections a second thread does not pay: about 0.1 ms. Lower under Miri,
/// which takes milliseconds per projection.
const MIN_PROJECTIONS: usize = if cfg!(miri) { 100 } else { 20_000 };

/// Maximum number of items that all threads take one after the other.
const MAX_LARGE: usize = 64;

fn address<T>(item: &T) -> usize {
    std::ptr::from_ref(item).addr()
}

/// Maximum number of threads; larger requests are assumed to be typing errors.
pub const MAX_THREADS: usize = 1024;

impl Threads {
    /// Starts threads, from 1 to [`MAX_THREADS`]; 0 for one on each core.
    ///
    /// # Errors
    /// [`ThreadsError`] if there are too many, or the system refuses to start them.
    pub fn new(count: usize) -> Result<Self, ThreadsError> {
        let count = if count == 0 { available() } else { count };
        if count > MAX_THREADS {
            return Err(ThreadsError {
                count,
                reason: format!("at most {MAX_THREADS} are supported"),
            });
        }
        Self::start(count)
    }

    #[cfg(feature = "parallel")]
    fn start(count: usize) -> Result<Self, ThreadsError> {
        let start = || Pool::start(count - 1).map(Arc::new);
        let pool = (count > 1).then(start).transpose();
        let pool = pool.map_err(|error| ThreadsError {
            count,
            reason: error.to_string(),
        })?;
        Ok(Self { pool })
    }

    #[cfg(not(feature = "parallel"))]
    fn start(_count: usize) -> Result<Self, ThreadsError> {
        Ok(Self {})
    }

    /// Number of threads.
    #[must_use]
    pub fn count(&self) -> usize {
        #[cfg(feature = "parallel")]
        return self.pool.as_ref().map_or(1, |pool| pool.workers() + 1);
        #[cfg(not(feature = "parallel"))]
        return 1;
    }

    /// Whether this number of projections justifies more than one thread.
    #[must_use]
    pub fn pays(&self, projections: usize) -> bool {
        self.count() > 1 && projections > MIN_PROJECTIONS
    }

    /// Calls `work` on the caller's thread with 0, and on others, as they join in time, with 1 and
    /// so on. Each call must be able to complete all of the work alone.
    pub fn run(&self, work: &(dyn Fn(usize) + Sync)) {
        #[cfg(feature = "parallel")]
        if let Some(pool) = &self.pool {
            return pool.run(work);
        }
        work(0);
    }

    /// Performs `work` for each of the items with these work estimates: divisible items that are a
    /// large fraction of the total on all threads one after the other, the others on one thread
    /// each.
    pub fn for_each<T: Send>(
        &self,
        items: &mut [T],
        load: impl Fn(&T) -> WorkEstimate + Sync,
        work: &(impl Fn(&mut T, &Self) + Sync),
    ) {
        let never = |_: &T, _: &T| false;
        self.for_each_group(items, (never, |_, _, _| 1), load, &|group, threads| {
            group.iter_mut().for_each(|item| work(item, threads));
        });
    }

    /// The same for groups of items: in a run of items each of which is `like` the one before, `size`
    /// gives the size of the groups, at least 1, by the first item, the number of items, and that of the
    /// threads. An item that all threads take together is in no group.
    pub fn for_each_group<T: Send>(
        &self,
        items: &mut [T],
        (like, size): (
            impl Fn(&T, &T) -> bool + Sync,
            impl Fn(&T, usize, usize) -> usize + Sync,
        ),
        load: impl Fn(&T) -> WorkEstimate + Sync,
        work: &(impl Fn(&mut [T], &Self) + Sync),
    ) {
        let one = Self::default();
        let projections = |item: &T| load(item).projections;
        let all: usize = items.iter().map(projections).sum();
        let threads = match self.pays(all) {
            true => self.count(),
            false => 1,
        };
        // Decided before any work, which can change the estimates.
        let mut large = [0; MAX_LARGE];
        if threads > 1 {
            let is_large = |item: &&T| {
                let WorkEstimate {
                    projections,
                    pieces,
                } = load(item);
                pieces > 1 && projections * 2 * threads > all
            };
            for (place, item) in large.iter_mut().zip(items.iter().filter(is_large)) {
                *place = address(item);
            }
        }
        let (is_large, size) = (|item: &T| large.contains(&address(item)), &size);
        let groups = |items| {
            let runs =
                <[T]>::chunk_by_mut(items, |a, b| !is_large(a) && !is_large(b) && like(a, b));
            runs.flat_map(move |run: &mut [T]| {
                let size = match &*run {
                    [_] => 1,
                    run => size(&run[0], run.len(), threads),
                };
                run.chunks_mut(size)
            })
        };
        if threads == 1 {
            return groups(items).for_each(|group| work(group, &one));
        }
        let small = || items.iter().filter(|item| !is_large(item));
        // A single remaining item does not justify waking other threads.
        let count = small().count();
        let projections = match count {
            0 | 1 => 0,
            _ => small().map(projections).sum(),
        };
        // They come while the caller does what comes before the divisible work of a large item.
        #[cfg(feature = "parallel")]
        if let Some(pool) = self.pool.as_ref().filter(|_| count < items.len()) {
            pool.wake();
        }
        let large = items.chunks_mut(1).filter(|item| is_large(&item[0]));
        large.for_each(|item| work(item, self));
        let small = groups(items).filter(|group| !is_large(&group[0]));
        self.distribute(small, projections, &|group: &mut [T]| work(group, &one));
    }

    /// Performs `work` for each of the items, on all threads if this number of projections
    /// justifies that.
    pub fn distribute<T>(
        &self,
        items: impl Iterator<Item = T> + Send,
        projections: usize,
        work: &(impl Fn(T) + Sync),
    ) {
        if !self.pays(projections) {
            return items.for_each(work);
        }
        let rest = Mutex::new(items);
        let next = || rest.lock().unwrap_or_else(PoisonError::into_inner).next();
        self.run(&|_| {
            while let Some(item) = next() {
                work(item);
            }
        });
    }
}

/// Compares the number of threads.
impl PartialEq for Threads {
    fn eq(&self, other: &Self) -> bool {
        self.count() == other.count()
    }
}

/// Number of threads that this machine runs simultaneously.
#[must_use]
pub fn available() -> usize {
    std::thread::available_parallelism().map_or(1, |count| count.get().min(MAX_THREADS))
}
