//! How a thread waits for another.

/// Turns of waiting before a thread lets others have its core: some ten microseconds.
const PATIENCE: u32 = 256;

/// Waits a turn: at first busily, for what is about to happen; then others may have the core.
pub fn pause(turns: &mut u32) {
    *turns += 1;
    if *turns < PATIENCE {
        std::hint::spin_loop();
    } else {
        std::thread::yield_now();
    }
}
