//! Spin-waiting between threads.

/// Spin iterations before a thread yields its core: about ten microseconds.
const PATIENCE: u32 = 256;

/// Waits for one iteration: spins at first, then yields the core.
pub fn pause(turns: &mut u32) {
    *turns += 1;
    if *turns < PATIENCE {
        std::hint::spin_loop();
    } else {
        std::thread::yield_now();
    }
}
