//! Finding rest by kinetic damping.
//!
//! A body of XPBD swings for long before it rests. Here all speed is taken away whenever the
//! kinetic energy has passed a peak (dynamic relaxation; Cundall 1976, Barnes 1988): near a peak
//! the body is near its equilibrium. Where it ends is a state that a substep maps onto itself, the
//! same that it would reach by itself, and so with all the softness of a solver that does too
//! little.

use super::state::Solver;

/// How a search for rest ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rest {
    /// Whether it came to rest within its time.
    pub settled: bool,
    /// Simulated time that it took [s].
    pub seconds: f64,
}

/// A body is at rest when it has moved more slowly than this for [`QUIET`] seconds: sizes a second.
/// It is not stopped in that time, so a mode of ω that is off by A would reach Aω² · QUIET, and
/// what is left is below 2e-5/ω² of the size.
const FAST_SPEED: f64 = 1e-5;

/// The same for the twin, which does not round so early.
const TWIN_SPEED: f64 = 1e-7;

/// See [`FAST_SPEED`] [s].
const QUIET: f64 = 0.5;

/// Steps until nothing moves, or `seconds` are over. `size` [m] is that of the largest body.
pub fn find(solver: &mut Solver, size: f64, seconds: f64) -> Rest {
    let tick = solver.settings().tick_seconds();
    let least = match solver {
        // A particle that hops between two numbers of f32 is at rest.
        Solver::Fast(_) => {
            let ulp = f64::from(f32::EPSILON) * solver.state().reach();
            (FAST_SPEED * size).max(ulp / tick)
        }
        Solver::Twin(_) => TWIN_SPEED * size,
    };
    let quiet_ticks = (QUIET / tick).ceil().max(2.0) as u64;
    let (mut peak, mut quiet) = (0.0, 0);
    let mut before = solver.state();
    let ticks = solver.ticks(seconds);
    for done in 1..=ticks {
        solver.tick();
        let now = solver.state();
        let (speed, energy) = now.motion_since(&before, tick);
        before = now;
        if !speed.is_finite() {
            break;
        }
        quiet = if speed <= least { quiet + 1 } else { 0 };
        if quiet >= quiet_ticks {
            return Rest {
                settled: true,
                seconds: done as f64 * tick,
            };
        }
        if quiet == 0 && energy < peak {
            solver.stop();
            peak = 0.0;
        } else {
            peak = energy;
        }
    }
    Rest {
        settled: false,
        seconds,
    }
}
