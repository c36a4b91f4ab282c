//! BDF2.

use crate::Particles;
use glam::{DVec3, Vec4};
use serde::{Deserialize, Serialize};

/// Length of a BDF2 step for implicit Euler, as a fraction of its own.
pub(crate) const STEP_FRACTION: f64 = 2.0 / 3.0;

/// Relative tolerance between the displacement of a substep and hv: a few rounding errors.
const TOLERANCE: f64 = 1e-5;

/// State of a body one substep ago; empty with implicit Euler.
///
/// BDF2: second-order steps, each as a step of implicit Euler from a combination of the last two
/// states.
///
/// With x and v at the start of a substep of length h, and x₋ and v₋ one substep before, BDF2
/// requires
///
/// x₊ = (4x − x₋)/3 + ⅔h v₊, v₊ = (4v − v₋)/3 + ⅔h a₊,
///
/// which is a step of implicit Euler of length ⅔h from (4x − x₋)/3 and (4v − v₋)/3. A substep
/// therefore replaces x and v by these, through [carry and displacement](crate::Particles), and
/// then proceeds with the length ⅔h: α̃ = 9α/4h², and λ is a force times (⅔h)².
///
/// The history before an impact does not apply after it. After a contact, before a predicted one,
/// and after external changes of positions or velocities, a substep uses implicit Euler. Forces
/// other than gravity are evaluated at the start of a substep, which makes them first-order where
/// they depend on position, velocity or time.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct History(Option<Box<Past>>);

#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
struct Past {
    /// Its positions p [m].
    positions: Vec<Vec4>,
    /// Its carry c [m].
    carry: Vec<Vec4>,
    /// Its velocities [m/s].
    velocities: Vec<DVec3>,
    /// Offset of the start of that substep from p + c [m]: (x − x₋)/3 at that time.
    lead: Vec<DVec3>,
    /// Length of the last requested substep [s].
    h: f64,
    /// Whether it used BDF2.
    second: bool,
    /// Whether the body touched something in it.
    touched: bool,
}

impl Clone for History {
    fn clone(&self) -> Self {
        let mut copy = Self::default();
        copy.clone_from(self);
        copy
    }

    /// Reuses allocations.
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
    /// Length of the current substep for implicit Euler, for a substep of `h` seconds.
    #[must_use]
    pub fn seconds(&self, h: f64) -> f64 {
        if self.is_second_order() {
            h * STEP_FRACTION
        } else {
            h
        }
    }

    /// Whether the current substep is second-order.
    #[must_use]
    pub fn is_second_order(&self) -> bool {
        self.0.as_ref().is_some_and(|past| past.second)
    }

    /// Records a contact, if the history is used.
    pub fn touch(&mut self) {
        if let Some(past) = &mut self.0 {
            past.touched = true;
        }
    }

    /// Clears the history.
    pub fn forget(&mut self) {
        self.0 = None;
    }

    /// Memory use in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.0.as_ref().map_or(0, |past| {
            (past.positions.len() + past.carry.len()) * size_of::<Vec4>()
                + (past.velocities.len() + past.lead.len()) * size_of::<DVec3>()
        })
    }

    /// Number of particles in each column, by name; 0 where no history is stored.
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
    /// Position of a particle at that time [m].
    fn position(&self, i: usize) -> DVec3 {
        to_f64(self.positions[i]) + to_f64(self.carry[i])
    }
}

impl Particles {
    /// Begins a substep of `h` seconds with the BDF2 combination of the last two states, unless it
    /// `restarts` or there is no history.
    pub(crate) fn begin_second_order(&mut self, h: f64, restarts: bool) {
        let count = self.len();
        let kept = self.history.columns().iter().all(|(_, len)| *len == count);
        let mut history = self.history.0.take().unwrap_or_default();
        let continues = kept
            && !restarts
            && !history.touched
            && history.h == h
            && (0..count).all(|i| self.positions[i].w == 0.0 || self.is_unwritten(&history, i));
        let seconds = length(h, continues);
        history.positions.resize(count, Vec4::ZERO);
        history.carry.resize(count, Vec4::ZERO);
        history.velocities.resize(count, DVec3::ZERO);
        history.lead.resize(count, DVec3::ZERO);
        for i in 0..count {
            let (x, c, v) = (self.positions[i], self.carry[i], self.velocity_f64(i));
            let mut lead = DVec3::ZERO;
            if continues && x.w > 0.0 {
                lead = (self.position(i) - history.position(i)) / 3.0;
                let v = v + (v - history.velocities[i]) / 3.0;
                self.carry[i] = (to_f64(c) + lead).as_vec3().extend(0.0);
                let u = to_f64(self.carry[i]) + v * seconds;
                self.displacements[i] = u.as_vec3().extend(0.0);
            }
            history.positions[i] = x;
            history.carry[i] = c;
            history.velocities[i] = v;
            history.lead[i] = lead;
        }
        if continues {
            self.begin_with_substep(seconds as f32);
        } else {
            self.set_substep_seconds(seconds as f32);
        }
        history.h = h;
        history.second = continues;
        history.touched = false;
        self.history.0 = Some(history);
    }

    /// Whether position and velocity of a particle are those left by the last substep: it moved by
    /// hv from the start of that.
    fn is_unwritten(&self, history: &Past, i: usize) -> bool {
        let start = history.position(i) + history.lead[i];
        let displacement = self.position(i) - start;
        let error = displacement - self.motion(i);
        error.length_squared() <= TOLERANCE * TOLERANCE * displacement.length_squared()
    }
}

/// Length of a substep for implicit Euler [s], as stored in particles.
fn length(h: f64, second: bool) -> f64 {
    let seconds = if second { h * STEP_FRACTION } else { h };
    f64::from(seconds as f32)
}

fn to_f64(x: Vec4) -> DVec3 {
    x.truncate().as_dvec3()
}
