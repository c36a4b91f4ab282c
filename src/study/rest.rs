//! Finding rest by kinetic damping.
//!
//! An undamped body vibrates for long before it rests. Here it is put back, without velocity, to where its kinetic energy
//! had a peak, whenever that has passed (dynamic relaxation; Cundall 1976, Barnes 1988): there it is near its equilibrium.
//! The peak is that of a parabola through the energies of three ticks: taken for the end of a tick, it would be the
//! turning point of a vibration of six ticks, which would go on for ever. The result is a state that a substep maps onto
//! itself, the same that the body would reach by itself, with all the compliance of a solver that has not converged.
//!
//! It counts as rest when particles hardly move and forces balance: a body that is stopped so often that it only creeps is
//! still pushed by what is left of its load.

use super::state::{Solver, State};

/// How a search for rest ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rest {
    /// Whether it came to rest within its time.
    pub settled: bool,
    /// Simulated time that it took [s].
    pub seconds: f64,
}

/// A body is at rest when its mean position over [`WINDOW`] is twice so near to the one before, as a fraction of its size
/// (root mean square over particles), and when it moves by no more in any tick of the window: a mean alone does not see
/// vibrations. Stopped in every second tick of T = 1/60 s, a mode of ω = 3/s that is off by A would still go 0.075 A in a
/// window, so what is left is some ten times this.
const FAST_STEP: f64 = 2e-6;

/// The same for the f64 reference, which does not round so early.
const REFERENCE_STEP: f64 = 2e-8;

/// What is left of the forces on all particles, over their weight, is at most this. It is the change of
/// velocity over a [`WINDOW`], so that what trembles cancels. A load that is off by a share moves what
/// rests by about the same share, and 0.1 % is the smallest error that a study asks for.
const FAST_IMBALANCE: f64 = 1e-3;

/// The same for the f64 reference, whose steps are a hundredth too.
const REFERENCE_IMBALANCE: f64 = 1e-5;

/// See [`FAST_STEP`] [s].
const WINDOW: f64 = 0.5;

/// Steps until nothing moves, or `seconds` are over. `size` [m] is that of the largest body.
pub fn find(solver: &mut Solver, size: f64, seconds: f64) -> Rest {
    let tick = solver.settings().tick_seconds();
    let (least, imbalance) = match solver {
        Solver::Fast(_) => {
            // A particle may hop between two numbers of f32.
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
    // Where a particle goes in a tick [m], and how much farther than in the one before, over a window; and the largest
    // speed of the body in it [m/s].
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
