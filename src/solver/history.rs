//! BDF2: steps of second order, each as one of implicit Euler from a state that the last two tell.
//!
//! With x and v at the start of a substep of length h, and x₋ and v₋ one substep before, BDF2 asks for
//!
//! x₊ = (4x − x₋)/3 + ⅔h v₊, v₊ = (4v − v₋)/3 + ⅔h a₊,
//!
//! which is a step of implicit Euler of length ⅔h from (4x − x₋)/3 and (4v − v₋)/3. So a substep puts
//! these in the place of x and v, and then does all that it does with a length of ⅔h: α̃ = 9α/4h², and
//! λ is a force times (⅔h)².
//!
//! What happened before a blow says nothing of what comes after it. After a contact, before one that is
//! about to be made, and wherever somebody wrote positions or velocities, a substep is one of Euler.
//! Forces other than gravity act as at the start of a substep, which leaves them of first order where
//! they depend on place, speed or time.

use super::Particles;
use glam::Vec4;
use serde::{Deserialize, Serialize};

/// The length of a step of BDF2 as implicit Euler has it, as a share of its own.
pub(super) const SHARE: f64 = 2.0 / 3.0;

/// What x − p may be off from hv, as a share of it: some roundings.
const SAME: f32 = 1e-5;

/// What a body was one substep ago; empty for one that is stepped by Euler's method.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct History {
    /// Positions then [m].
    positions: Vec<Vec4>,
    /// Velocities then [m/s].
    velocities: Vec<Vec4>,
    /// Length of the substep that was asked for last [s].
    h: f64,
    /// Whether that is one of BDF2.
    second: bool,
    /// Whether something was touched in it.
    touched: bool,
}

impl History {
    /// Length of the substep under way as implicit Euler has it, for one of `h` seconds.
    #[must_use]
    pub fn seconds(&self, h: f64) -> f64 {
        if self.second { h * SHARE } else { h }
    }

    /// Whether the substep under way is of second order.
    #[must_use]
    pub fn is_second_order(&self) -> bool {
        self.second
    }

    /// A contact was made, if anybody wants to know.
    pub fn touch(&mut self) {
        self.touched = !self.positions.is_empty();
    }

    /// Keeps nothing any more.
    pub fn forget(&mut self) {
        if !self.positions.is_empty() {
            *self = Self::default();
        }
    }

    /// Bytes of what is kept.
    #[must_use]
    pub fn bytes(&self) -> usize {
        (self.positions.len() + self.velocities.len()) * size_of::<Vec4>()
    }

    /// Columns with their names, if there are any.
    #[must_use]
    pub fn columns(&self) -> [(&'static str, &[Vec4]); 2] {
        [
            ("positions of the substep before", &self.positions),
            ("velocities of the substep before", &self.velocities),
        ]
    }
}

impl Particles {
    /// Begins a substep of `h` seconds with what BDF2 makes of the last two states, unless it
    /// `restarts` or there are none.
    pub(super) fn look_back(&mut self, h: f64, restarts: bool) {
        let count = self.positions.len();
        let history = &self.history;
        let kept = history.positions.len() == count && history.velocities.len() == count;
        let goes_on = kept && !restarts && !history.touched && history.h == h && self.unwritten();
        let History {
            positions,
            velocities,
            ..
        } = &mut self.history;
        if goes_on {
            let then = positions.iter_mut().zip(velocities);
            let now = self.positions.iter_mut().zip(&mut self.velocities);
            for ((x, v), (x_then, v_then)) in now.zip(then) {
                let (place, speed) = (*x, *v);
                if x.w > 0.0 {
                    *x += (*x - x_then.truncate().extend(x.w)) / 3.0;
                    *v += (*v - *v_then) / 3.0;
                }
                (*x_then, *v_then) = (place, speed);
            }
        } else {
            positions.clone_from(&self.positions);
            velocities.clone_from(&self.velocities);
        }
        self.history.h = h;
        self.history.second = goes_on;
        self.history.touched = false;
    }

    /// Whether positions and velocities are what the last substep left: v = (x − p)/h.
    fn unwritten(&self) -> bool {
        let h = self.history.seconds(self.history.h) as f32;
        let state = self.positions.iter().zip(&self.previous);
        state.zip(&self.velocities).all(|((x, p), v)| {
            let way = (*x - *p).truncate();
            let off = way - v.truncate() * h;
            x.w == 0.0 || off.length_squared() <= SAME * SAME * way.length_squared()
        })
    }
}
