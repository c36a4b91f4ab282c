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
    static MOST: Cell<i64> = const { Cell::new(0) };
    static IS_MEMBER: Cell<bool> = const { Cell::new(false) };
}

static OF_MEMBERS: AtomicU64 = AtomicU64::new(0);

/// Number of allocations of this thread.
pub fn count() -> u64 {
    COUNT.get()
}

/// Includes this thread in [`count_of_members`] from now on.
pub fn join() {
    IS_MEMBER.set(true);
}

/// Total number of allocations of the threads that have joined. For a single test: all joined
/// threads are counted together.
pub fn count_of_members() -> u64 {
    OF_MEMBERS.load(Ordering::Relaxed)
}

/// Bytes that this thread has allocated and not freed. Memory of another thread that it frees
/// counts as negative.
pub fn held() -> i64 {
    HELD.get()
}

/// The result of an action, and the peak memory of its thread during the action, relative to the
/// memory before [byte].
pub fn peak<T>(action: impl FnOnce() -> T) -> (T, u64) {
    let (before, outer) = (HELD.get(), MOST.get());
    MOST.set(before);
    let result = action();
    let most = MOST.get() - before;
    MOST.set(outer.max(MOST.get()));
    (result, u64::try_from(most).unwrap_or_default())
}

fn change(bytes: i64) {
    let held = HELD.get() + bytes;
    HELD.set(held);
    MOST.set(MOST.get().max(held));
}

fn size(layout: Layout) -> i64 {
    i64::try_from(layout.size()).unwrap_or(i64::MAX)
}

// SAFETY: forwards to the system's allocator; counting allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        OF_MEMBERS.fetch_add(IS_MEMBER.get().into(), Ordering::Relaxed);
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
