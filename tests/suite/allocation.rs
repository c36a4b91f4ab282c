//! The allocator of the suite: counts the allocations of each thread and the memory that it holds.

#![allow(unsafe_code, reason = "an allocator that counts")]

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
    sync::atomic::{AtomicU64, Ordering},
};

struct Counting;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
    static HELD: Cell<i64> = const { Cell::new(0) };
    static PEAK: Cell<i64> = const { Cell::new(0) };
    static IS_COUNTED: Cell<bool> = const { Cell::new(false) };
}

static TOTAL: AtomicU64 = AtomicU64::new(0);

/// Number of allocations of this thread.
pub fn count() -> u64 {
    COUNT.get()
}

/// Includes this thread in [`total_count`] from now on.
pub fn count_this_thread() {
    IS_COUNTED.set(true);
}

/// Total number of allocations of the included threads. For a single test: all of these are counted
/// together.
pub fn total_count() -> u64 {
    TOTAL.load(Ordering::Relaxed)
}

/// Bytes that this thread has allocated and not freed. Memory of another thread that it frees
/// counts as negative.
pub fn held() -> i64 {
    HELD.get()
}

/// The result of an action, and the peak memory of its thread during the action, relative to the
/// memory before [byte].
pub fn peak<T>(action: impl FnOnce() -> T) -> (T, u64) {
    let (before, outer) = (HELD.get(), PEAK.get());
    PEAK.set(before);
    let result = action();
    let peak_bytes = PEAK.get() - before;
    PEAK.set(outer.max(PEAK.get()));
    (result, u64::try_from(peak_bytes).unwrap_or_default())
}

fn change(bytes: i64) {
    let held = HELD.get() + bytes;
    HELD.set(held);
    PEAK.set(PEAK.get().max(held));
}

fn size(layout: Layout) -> i64 {
    i64::try_from(layout.size()).unwrap_or(i64::MAX)
}

// SAFETY: forwards to the system's allocator; counting allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        TOTAL.fetch_add(IS_COUNTED.get().into(), Ordering::Relaxed);
        change(size(layout));
        // SAFETY: upheld by the caller.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        change(-size(layout));
        // SAFETY: upheld by the caller.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;
