//! Finding rest by kinetic damping.
//!
//! An undamped body vibrates for a long time before it comes to rest. Whenever its kinetic energy
//! has passed a peak, the body is put back to its state at the peak, without velocity (dynamic
//! relaxation; Cundall 1976, Barnes 1988): there it is near its equilibrium. The peak is that of a
//! parabola through the energies of three ticks. If the end of a tick were taken instead, a
//! vibration with a period of six ticks would be reset to its turning point and never decay. The
//! result is a fixed point of the substep, the same state that the body would reach without resets,
//! including the excess compliance of an unconverged solver.
//!
//! Rest requires small motion and balanced forces: a body that is reset so often that it only
//! creeps moves little, but part of its load is still unbalanced.

use super::state::{Solver, State};

/// How a search for rest ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rest {
    /// Whether the body came to rest within its time.
    pub settled: bool,
    /// Simulated time until rest [s].
    pub seconds: f64,
}

/// A body is at rest when its mean position over a [`WINDOW`] differs from the previous mean by at
/// most this in two successive windows, as a fraction of its size (root mean square over
/// particles), and it moves by no more than this in any tick of the window: the mean alone does not
/// detect vibrations. A mode of ω = 3/s that is displaced by A and reset in every second tick of
/// T = 1/60 s would still travel 0.075 A in a window, so the remaining error is about ten times
/// this value.
const FAST_STEP: f64 = 2e-6;

/// Same for the f64 reference, which has smaller rounding errors.
const REFERENCE_STEP: f64 = 2e-8;

/// Limit of the residual forces on all particles relative to their weight, computed from the change
/// of velocity over a [`WINDOW`], so that jitter cancels. A relative error of the load changes the
/// state of rest by about the same fraction, and 0.1 % is the smallest error target of a study.
const FAST_IMBALANCE: f64 = 1e-3;

/// Same for the f64 reference, whose step limit is a hundredth as well.
const REFERENCE_IMBALANCE: f64 = 1e-5;

/// See [`FAST_STEP`] [s].
const WINDOW: f64 = 0.5;

/// Steps until the body is at rest or `seconds` have passed. `size` [m] is the size of the largest
/// body.
pub fn find(solver: &mut Solver, size: f64, seconds: f64) -> Rest {
    let tick = solver.settings().tick_seconds();
    let (least, imbalance) = match solver {
        Solver::Fast(_) => {
            // A particle may alternate between two adjacent f32 values.
            let ulp = f64::from(f32::EPSILON) * solver.state().reach();
            ((FAST_STEP * size).max(ulp / 2.0), FAST_IMBALANCE)
        }
        Solver::Reference(_) => (REFERENCE_STEP * size, REFERENCE_IMBALANCE),
    };
    let gravity = solver.settings().gravity.as_dvec3().length();
    let window = (WINDOW / tick).ceil().max(2.0) as u64;
    let mut before = solver.state();
    let mut older = before.clone();
    // Kinetic energies of the last two ticks [J].
    let mut energies = [0.0; 2];
    let mut near = 0;
    let (mut sum, mut last) = (before.zero(), None::<State>);
    // Over a window: displacement of each particle in the last tick [m], its sum of changes from
    // tick to tick, and the maximum speed of the body [m/s].
    let (mut way, mut gained, mut fastest) = (before.zero(), before.zero(), 0.0_f64);
    for done in 1..=solver.ticks(seconds) {
        solver.tick();
        let mut now = solver.state();
        let (speed, energy) = now.motion_since(&before, tick);
        if !energy.is_finite() {
            break;
        }
        fastest = fastest.max(speed);
        gained.subtract(&way);
        way = now.clone();
        way.subtract(&before);
        gained.add(&way);
        if energy < energies[1] {
            let [rising, peak] = energies;
            let late = 0.5 * (rising - energy) / (rising - 2.0 * peak + energy);
            before.subtract(&older);
            before.scale(0.5 + late);
            before.add(&older);
            solver.place(&before);
            now = solver.state();
            way.scale(0.0);
            energies = [0.0; 2];
            older = now.clone();
        } else {
            energies = [energies[1], energy];
            older = before;
        }
        sum.add(&now);
        if done % window == 0 {
            sum.scale(1.0 / window as f64);
            let step = last.map_or(f64::INFINITY, |last| sum.motion_since(&last, 1.0).0);
            let pushed = gained.weighted_length() / (tick * tick * window as f64);
            let balanced = pushed <= imbalance * gravity * now.mass() || gravity == 0.0;
            near = if step.max(fastest * tick) <= least && balanced {
                near + 1
            } else {
                0
            };
            gained.scale(0.0);
            fastest = 0.0;
            if near == 2 {
                return Rest {
                    settled: true,
                    seconds: done as f64 * tick,
                };
            }
            last = Some(std::mem::replace(&mut sum, now.zero()));
        }
        before = now;
    }
    Rest {
        settled: false,
        seconds,
    }
}
