//! Settings of a world, and parameters of a substep.

use crate::{
    CollisionIterations, InvalidValue, Iterations, KeepSpin, Method, Order, Rate,
    SmoothingIterations, Substeps,
    layout::order::Direction,
    method::{Averaging, Masses},
};
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Settings that all bodies of a world share.
///
/// ```
/// use glam::Vec3;
/// use pliant_solver::{Settings, Substeps, World};
///
/// // On the moon, at a high accuracy.
/// let settings = Settings {
///     gravity: Vec3::NEG_Y * 1.62, // m/s²
///     substeps: Substeps::of(40),
///     ..Settings::default()
/// };
/// let world = World { settings, ..World::default() };
/// # assert_ne!(world.settings, Settings::default());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, try_from = "Unchecked")]
pub struct Settings {
    /// Gravity [m/s²], finite; default (0, −9.81, 0).
    pub gravity: Vec3,
    /// Ticks per second; default 60.
    pub rate: Rate,
    /// Substeps per tick; default 10.
    pub substeps: Substeps,
    /// Iterations over all constraints per substep; default 1.
    pub iterations: Iterations,
    /// Passes over ground and colliders per substep, spread evenly over its iterations, with the
    /// last one after the last iteration; default 0, one after each iteration. If there are more
    /// than iterations, several follow one iteration.
    pub collision_iterations: CollisionIterations,
    /// Passes after the iterations of a substep in which every particle moves to the mean of the
    /// positions that the constraints of an effect require (Jacobi), so that residual errors are
    /// distributed evenly; default 0. They do not change multipliers. One more contact pass follows
    /// them.
    pub smoothing_iterations: SmoothingIterations,
    /// Method for solving the constraints of elastic effects; default XPBD.
    pub method: Method,
    /// Order of the time integration: 1, the default, is implicit Euler, 2 is
    /// [BDF2](crate::History).
    pub order: Order,
    /// Whether internal constraints [conserve the angular momentum](crate::spin) of bodies without
    /// pins: 1, the default, or 0, to compare. Ignored by other methods than XPBD, and by second-order steps,
    /// which lose little rotation.
    pub keep_spin: KeepSpin,
}

#[derive(Deserialize)]
#[serde(default, deny_unknown_fields, rename = "Settings")]
struct Unchecked {
    gravity: Vec3,
    rate: Rate,
    substeps: Substeps,
    iterations: Iterations,
    collision_iterations: CollisionIterations,
    smoothing_iterations: SmoothingIterations,
    method: Method,
    order: Order,
    keep_spin: KeepSpin,
}

impl Default for Unchecked {
    fn default() -> Self {
        let Settings {
            gravity,
            rate,
            substeps,
            iterations,
            collision_iterations,
            smoothing_iterations,
            method,
            order,
            keep_spin,
        } = Settings::default();
        Self {
            gravity,
            rate,
            substeps,
            iterations,
            collision_iterations,
            smoothing_iterations,
            method,
            order,
            keep_spin,
        }
    }
}

impl TryFrom<Unchecked> for Settings {
    type Error = InvalidValue;

    fn try_from(unchecked: Unchecked) -> Result<Self, InvalidValue> {
        let mut settings = Self {
            rate: unchecked.rate,
            substeps: unchecked.substeps,
            iterations: unchecked.iterations,
            collision_iterations: unchecked.collision_iterations,
            smoothing_iterations: unchecked.smoothing_iterations,
            method: unchecked.method,
            order: unchecked.order,
            keep_spin: unchecked.keep_spin,
            ..Self::default()
        };
        settings.set_gravity(unchecked.gravity)?;
        Ok(settings)
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            gravity: Vec3::new(0.0, -9.81, 0.0),
            rate: Rate::default(),
            substeps: Substeps::default(),
            iterations: Iterations::default(),
            collision_iterations: CollisionIterations::default(),
            smoothing_iterations: SmoothingIterations::default(),
            method: Method::default(),
            order: Order::default(),
            keep_spin: KeepSpin::default(),
        }
    }
}

impl Settings {
    /// Sets gravity [m/s²].
    ///
    /// # Errors
    /// [`InvalidValue`] for a component that is not finite or beyond 1e6 m/s².
    pub fn set_gravity(&mut self, gravity: Vec3) -> Result<(), InvalidValue> {
        for component in gravity.to_array() {
            InvalidValue::unless_finite("gravity", component)?;
            if component.abs() > 1e6 {
                return Err(InvalidValue {
                    quantity: "gravity",
                    value: f64::from(component),
                    valid: "between -1e6 and 1e6 m/s² along each axis",
                });
            }
        }
        self.gravity = gravity;
        Ok(())
    }

    /// Length of a tick [s].
    #[must_use]
    pub fn tick_seconds(&self) -> f64 {
        1.0 / self.rate.get()
    }

    /// Length of a substep [s].
    #[must_use]
    pub fn substep_seconds(&self) -> f64 {
        1.0 / (self.rate.get() * f64::from(self.substeps.get()))
    }

    /// Whether each substep of a body requires initial work: not for first-order steps.
    #[must_use]
    pub fn begins_each_substep(&self) -> bool {
        self.order.get() > 1
    }

    /// Substep number `index` of a tick.
    #[must_use]
    pub fn substep(&self, index: u32) -> Substep {
        let count = self.substeps.get();
        let alternates = self.order.get() > 1 && self.method.averaging().is_none();
        Substep {
            h: self.substep_seconds() as f32,
            gravity: self.gravity,
            index,
            count,
            iterations: self.iterations.get() * if alternates { 2 } else { 1 },
            alternates,
            collision_iterations: self.collision_iterations,
            smoothing_iterations: self.smoothing_iterations.get(),
            method: self.method,
        }
    }
}

/// One substep.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Substep {
    /// Its length [s].
    pub h: f32,
    /// Gravity [m/s²].
    pub gravity: Vec3,
    /// Number of the substep in the tick, from 0.
    pub index: u32,
    /// Number of substeps in the tick.
    pub count: u32,
    /// Passes over all constraints: its iterations, or twice as many if it alternates.
    pub iterations: u32,
    /// Whether an iteration consists of two passes, the first in the opposite direction: in
    /// second-order steps.
    ///
    /// One pass in one direction acts like forces without an energy: its matrix is not symmetric. They
    /// feed a flutter, which implicit Euler damps and BDF2 does not. There and back the matrix is
    /// symmetric, and the forces have an energy.
    pub alternates: bool,
    /// Passes over all contacts.
    pub collision_iterations: CollisionIterations,
    /// Averaged passes after the iterations.
    pub smoothing_iterations: u32,
    /// Method for solving constraints.
    pub method: Method,
}

impl Substep {
    /// Whether it ends the tick. Multipliers are written then, for measurements.
    #[must_use]
    pub fn is_last(&self) -> bool {
        self.index + 1 == self.count
    }

    /// The direction in which a pass goes through the constraints.
    #[must_use]
    pub(crate) fn direction(&self, iteration: u32) -> Direction {
        // Forward last, so that the least damped constraints end an iteration.
        if self.alternates && iteration < self.iterations && iteration.is_multiple_of(2) {
            Direction::Backward
        } else {
            Direction::Forward
        }
    }

    /// Number of the iteration that a pass ends, for what is solved once in each; `None` if it ends
    /// none, or is averaged.
    pub(crate) fn ends_iteration(&self, iteration: u32) -> Option<u32> {
        let ends = iteration < self.iterations && self.direction(iteration) == Direction::Forward;
        ends.then_some(if self.alternates {
            iteration / 2
        } else {
            iteration
        })
    }

    /// Passes including the averaged ones after them.
    #[must_use]
    pub fn total_iterations(&self) -> u32 {
        self.iterations + self.smoothing_iterations
    }

    /// Number of passes over all contacts after an iteration.
    #[must_use]
    pub fn contacts_after(&self, iteration: u32) -> u32 {
        if iteration < self.iterations {
            self.collision_iterations.after(iteration, self.iterations)
        } else {
            u32::from(iteration + 1 == self.total_iterations())
        }
    }

    /// Total number of passes over all contacts.
    #[must_use]
    pub fn contact_passes(&self) -> u32 {
        let after_iterations = match self.collision_iterations.get() {
            0 => self.iterations,
            passes => passes,
        };
        after_iterations + u32::from(self.smoothing_iterations > 0)
    }

    /// Averaging in an iteration, if any.
    pub(crate) fn averaging(&self, iteration: u32) -> Option<Averaging> {
        let smooths = iteration >= self.iterations;
        let of_method = self.method.averaging();
        let smoothing = Averaging {
            masses: Masses::PinsLikeOthers,
            ..Averaging::default()
        };
        of_method.or(smooths.then_some(smoothing))
    }
}
