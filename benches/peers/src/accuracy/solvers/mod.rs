//! The solvers of the peers on the problems, with the settings that are tried.

#[cfg(jolt)]
mod jolt;
mod newton;
#[cfg(feature = "oxiphysics")]
mod oxiphysics;
mod pliant;
#[cfg(feature = "rapier")]
mod rapier;

use super::problems::Problem;
use crate::peer::{Counts, PeerError};
use cpu_time::ProcessTime;
use glam::DVec3;
use serde::Serialize;
use std::{path::Path, time::Duration};

/// A setting of a solver.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Setting {
    /// Substeps of a tick of 1/60 s.
    pub substeps: u32,
    /// Iterations of a substep.
    pub iterations: u32,
    /// Natural frequency of rigid volumes [Hz], for a solver that has no rigid ones.
    pub frequency: Option<f32>,
    /// Fraction of critical damping, for a solver in which it affects the state of rest.
    pub damping: Option<f32>,
    /// Relative residual of its linear systems, unless it is the default.
    pub tolerance: Option<f32>,
    /// Bulk modulus of rigid volumes [Pa], for a solver that has no rigid ones.
    pub bulk: Option<f32>,
    /// Factor of the corrections of tetrahedra, for a solver that adds them up.
    pub relaxation: Option<f32>,
}

/// Parameters of a setting other than substeps and iterations.
pub type Family = [Option<f32>; 5];

impl Setting {
    /// Its other parameters.
    #[must_use]
    pub const fn family(&self) -> Family {
        [
            self.frequency,
            self.damping,
            self.tolerance,
            self.bulk,
            self.relaxation,
        ]
    }

    /// Whether it is on the coarser grid of substeps, which are powers of four, and
    /// of iterations.
    #[must_use]
    pub fn is_coarse(&self) -> bool {
        let power_of_four = |n: u32| n.is_power_of_two() && n.trailing_zeros().is_multiple_of(2);
        power_of_four(self.substeps) && !(self.iterations == 2 || self.iterations == 1000)
    }

    /// Substeps of some iterations.
    #[must_use]
    pub const fn new(substeps: u32, iterations: u32) -> Self {
        Self {
            substeps,
            iterations,
            frequency: None,
            damping: None,
            tolerance: None,
            bulk: None,
            relaxation: None,
        }
    }

    /// Iterations of a tick.
    #[must_use]
    pub const fn work(&self) -> u64 {
        self.substeps as u64 * self.iterations as u64
    }
}

/// As in `16×4, 1 kHz, ζ 0.1`: 16 substeps of 4 iterations.
impl std::fmt::Display for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}×{}", self.substeps, self.iterations)?;
        if let Some(frequency) = self.frequency {
            write!(f, ", {} kHz", frequency / 1e3)?;
        }
        if let Some(damping) = self.damping {
            write!(f, ", ζ {damping}")?;
        }
        if let Some(tolerance) = self.tolerance {
            write!(f, ", ε {tolerance}")?;
        }
        if let Some(bulk) = self.bulk {
            write!(f, ", K {:.2} MPa", bulk / 1e6)?;
        }
        if let Some(relaxation) = self.relaxation {
            write!(f, ", ω {relaxation}")?;
        }
        Ok(())
    }
}

/// A problem in a solver, with a setting.
pub trait Trial {
    /// Steps 1/60 s, with one thread.
    fn tick(&mut self);
    /// Steps a number of ticks, and returns the processor time that they took.
    fn advance(&mut self, ticks: u32) -> Duration {
        let start = ProcessTime::now();
        (0..ticks).for_each(|_| self.tick());
        start.elapsed()
    }
    /// Writes the positions [m], in the order of the mesh.
    fn positions(&mut self, positions: &mut Vec<DVec3>);
    /// Moves the movable particles to positions [m], in the order of the mesh, without velocity.
    fn place(&mut self, positions: &[DVec3]);
    /// Number of constraints; elastic tetrahedra count as tetrahedra.
    fn counts(&self) -> Counts;
    /// Why it steps no more, if its process failed.
    fn failure(&self) -> Option<&str> {
        None
    }
}

/// A solver of a peer.
pub trait Solver {
    /// Name in the table.
    fn name(&self) -> &'static str;
    /// Name of the peer, for `--only`.
    fn peer(&self) -> &'static str {
        self.name()
    }
    /// How it is set up, in a sentence or two.
    fn setup(&self) -> &'static str;
    /// The reason why it cannot take a problem, if any.
    fn refusal(&self, problem: &Problem) -> Option<&'static str>;
    /// The settings that are tried.
    fn settings(&self, problem: &Problem) -> Vec<Setting>;
    /// Builds a problem in its rest shape.
    ///
    /// # Errors
    /// [`PeerError`] if it cannot be built.
    fn build(&self, problem: &Problem, setting: Setting) -> Result<Box<dyn Trial>, PeerError>;
}

/// The solvers of this build, and those of Newton in a Python.
#[must_use]
pub fn all(newton: Option<&Path>) -> Vec<Box<dyn Solver>> {
    let mut all: Vec<Box<dyn Solver>> = Vec::new();
    all.push(Box::new(pliant::Pliant::GaussSeidel));
    all.push(Box::new(pliant::Pliant::Direct));
    #[cfg(feature = "rapier")]
    {
        all.push(Box::new(rapier::Rapier::Constraints));
        all.push(Box::new(rapier::Rapier::Fem));
    }
    #[cfg(jolt)]
    all.push(Box::new(jolt::Jolt));
    #[cfg(feature = "oxiphysics")]
    all.push(Box::new(oxiphysics::OxiPhysics));
    if let Some(python) = newton {
        for solver in newton::Newton::all(python) {
            all.push(Box::new(solver));
        }
    }
    all
}

/// All pairs of substeps and iterations whose product is at most `most`.
fn grid(substeps: &[u32], iterations: &[u32], most: u64) -> Vec<Setting> {
    let pairs = substeps
        .iter()
        .flat_map(|&s| iterations.iter().map(move |&i| Setting::new(s, i)));
    pairs.filter(|setting| setting.work() <= most).collect()
}
