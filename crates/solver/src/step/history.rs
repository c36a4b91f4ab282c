//! BDF2: steps of second order, each as one of implicit Euler from a state that the last two tell.
//!
//! With x and v at the start of a substep of length h, and x₋ and v₋ one substep before, BDF2 asks for
//!
//! x₊ = (4x − x₋)/3 + ⅔h v₊, v₊ = (4v − v₋)/3 + ⅔h a₊,
//!
//! which is a step of implicit Euler of length ⅔h from (4x − x₋)/3 and (4v − v₋)/3. So a substep puts
//! these in the place of x and v, by [carry and displacement](crate::particles), and then does all that
//! it does with a length of ⅔h: α̃ = 9α/4h², and λ is a force times (⅔h)².
//!
//! What happened before a blow says nothing of what comes after it. After a contact, before one that is
//! about to be made, and wherever somebody wrote positions or velocities, a substep is one of Euler.
//! Forces other than gravity act as at the start of a substep, which leaves them of first order where
//! they depend on place, speed or time.

use crate::Particles;
use glam::{DVec3, Vec4};
use serde::{Deserialize, Serialize};

/// The length of a step of BDF2 as implicit Euler has it, as a share of its own.
pub(crate) const SHARE: f64 = 2.0 / 3.0;

/// What the way of a substep may be off from hv, as a share of it: some roundings.
const SAME: f64 = 1e-5;

/// What a body was one substep ago; empty for one that is stepped by Euler's method.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct History(Option<Box<Past>>);

#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
struct Past {
    /// Positions p then [m].
    positions: Vec<Vec4>,
    /// Carry c then [m].
    carry: Vec<Vec4>,
    /// Velocities then [m/s].
    velocities: Vec<DVec3>,
    /// By how much the substep began beside p + c [m]: (x − x₋)/3 of then.
    lead: Vec<DVec3>,
    /// Length of the substep that was asked for last [s].
    h: f64,
    /// Whether that is one of BDF2.
    second: bool,
    /// Whether something was touched in it.
    touched: bool,
}

impl Clone for History {
    fn clone(&self) -> Self {
        let mut copy = Self::default();
        copy.clone_from(self);
        copy
    }

    /// Into the room that is there.
    fn clone_from(&mut self, from: &Self) {
        let Some(from) = &from.0 else {
            self.0 = None;
            return;
        };
        let past = self.0.get_or_insert_default();
        past.positions.clone_from(&from.positions);
        past.carry.clone_from(&from.carry);
        past.velocities.clone_from(&from.velocities);
        past.lead.clone_from(&from.lead);
        (past.h, past.second, past.touched) = (from.h, from.second, from.touched);
    }
}

impl History {
    /// Length of the substep under way as implicit Euler has it, for one of `h` seconds.
    #[must_use]
    pub fn seconds(&self, h: f64) -> f64 {
        if self.is_second_order() { h * SHARE } else { h }
    }

    /// Whether the substep under way is of second order.
    #[must_use]
    pub fn is_second_order(&self) -> bool {
        self.0.as_ref().is_some_and(|past| past.second)
    }

    /// A contact was made, if anybody wants to know.
    pub fn touch(&mut self) {
        if let Some(past) = &mut self.0 {
            past.touched = true;
        }
    }

    /// Keeps nothing any more.
    pub fn forget(&mut self) {
        self.0 = None;
    }

    /// Bytes of what is kept.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.0.as_ref().map_or(0, |past| {
            (past.positions.len() + past.carry.len()) * size_of::<Vec4>()
                + (past.velocities.len() + past.lead.len()) * size_of::<DVec3>()
        })
    }

    /// How many particles each column is of, by its name; none where nothing is kept.
    #[must_use]
    pub fn columns(&self) -> [(&'static str, usize); 4] {
        let counts = self.0.as_ref().map_or([0; 4], |past| {
            [
                past.positions.len(),
                past.carry.len(),
                past.velocities.len(),
                past.lead.len(),
            ]
        });
        [
            ("positions of the substep before", counts[0]),
            ("carries of the substep before", counts[1]),
            ("velocities of the substep before", counts[2]),
            ("leads of the substep before", counts[3]),
        ]
    }
}

impl Past {
    /// Where a particle was then [m].
    fn position(&self, i: usize) -> DVec3 {
        wide(self.positions[i]) + wide(self.carry[i])
    }
}

impl Particles {
    /// Begins a substep of `h` seconds with what BDF2 makes of the last two states, unless it
    /// `restarts` or there are none.
    pub(crate) fn look_back(&mut self, h: f64, restarts: bool) {
        let count = self.len();
        let kept = self.history.columns().iter().all(|(_, len)| *len == count);
        let mut history = self.history.0.take().unwrap_or_default();
        let goes_on = kept
            && !restarts
            && !history.touched
            && history.h == h
            && (0..count).all(|i| self.positions[i].w == 0.0 || self.is_unwritten(&history, i));
        let seconds = length(h, goes_on);
        history.positions.resize(count, Vec4::ZERO);
        history.carry.resize(count, Vec4::ZERO);
        history.velocities.resize(count, DVec3::ZERO);
        history.lead.resize(count, DVec3::ZERO);
        for i in 0..count {
            let (x, c, v) = (self.positions[i], self.carry[i], self.velocity_f64(i));
            let mut lead = DVec3::ZERO;
            if goes_on && x.w > 0.0 {
                lead = (self.position(i) - history.position(i)) / 3.0;
                let v = v + (v - history.velocities[i]) / 3.0;
                self.carry[i] = (wide(c) + lead).as_vec3().extend(0.0);
                let u = wide(self.carry[i]) + v * seconds;
                self.displacements[i] = u.as_vec3().extend(0.0);
            }
            history.positions[i] = x;
            history.carry[i] = c;
            history.velocities[i] = v;
            history.lead[i] = lead;
        }
        if goes_on {
            self.begin_with_substep(seconds as f32);
        } else {
            self.set_substep_seconds(seconds as f32);
        }
        history.h = h;
        history.second = goes_on;
        history.touched = false;
        self.history.0 = Some(history);
    }

    /// Whether position and velocity of a particle are what the last substep left: it went from where
    /// that began by hv.
    fn is_unwritten(&self, history: &Past, i: usize) -> bool {
        let start = history.position(i) + history.lead[i];
        let way = self.position(i) - start;
        (way - self.motion(i)).length_squared() <= SAME * SAME * way.length_squared()
    }
}

/// Length of a substep as implicit Euler has it [s], as particles keep it.
fn length(h: f64, second: bool) -> f64 {
    let seconds = if second { h * SHARE } else { h };
    f64::from(seconds as f32)
}

fn wide(x: Vec4) -> DVec3 {
    x.truncate().as_dvec3()
}
