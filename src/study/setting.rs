//! A way to solve: a method, and how many substeps and iterations.

use crate::solver::{
    self, Compliance, InvalidValue, Iterations, Share, Stiffness, Substeps, World,
    elastic::{Elastic, Visit},
};
use serde::{Deserialize, Serialize};
use std::fmt;

/// A method that the project has. Adding one takes a variant, its name, and what it changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// What the scene has; extended position-based dynamics, sweep by sweep (Gauss–Seidel), unless it
    /// says otherwise.
    Xpbd,
    /// Classic position-based dynamics: the same with every compliance 0, so that stiffness is what
    /// the sweeps make of it.
    Pbd,
}

impl Method {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Xpbd, Self::Pbd];

    /// What reports and commands call it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Xpbd => "xpbd",
            Self::Pbd => "pbd",
        }
    }

    /// Makes a world use it.
    pub fn apply(self, world: &mut World) {
        if self == Self::Xpbd {
            return;
        }
        let stiffness = Share::default();
        world.settings.method = solver::Method::Pbd { stiffness };
        // What is rigid stores no energy.
        for body in &mut world.bodies {
            if let Some(stretch) = &mut body.effects.stretch {
                stretch.compliance = Compliance::default();
                stretch.axial_stiffness = Stiffness::default();
            }
            if let Some(volume) = &mut body.effects.volume {
                volume.compliance = Compliance::default();
                volume.bulk_modulus = Stiffness::default();
            }
        }
    }

    /// Whether it does anything else to this world than XPBD does.
    #[must_use]
    pub fn differs(self, world: &World) -> bool {
        struct Rigid(bool);
        impl Visit for Rigid {
            fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
                self.0 &= effect.is_rigid() && effect.damping().get() == 0.0;
            }
        }
        let mut rigid = Rigid(true);
        for body in &world.bodies {
            body.effects.visit(&mut rigid);
        }
        self == Self::Pbd && !rigid.0 && world.settings.method == solver::Method::Xpbd
    }
}

/// A method with its substeps and iterations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Setting {
    /// How constraints are solved.
    pub method: Method,
    /// Substeps a tick, from 1 to 10 000.
    pub substeps: u32,
    /// Sweeps over all constraints a substep, from 1 to 10 000.
    pub iterations: u32,
}

impl Setting {
    /// XPBD with so many substeps and iterations.
    #[must_use]
    pub const fn xpbd(substeps: u32, iterations: u32) -> Self {
        Self {
            method: Method::Xpbd,
            substeps,
            iterations,
        }
    }

    /// A copy of a world that is solved like this, and in which nothing falls asleep.
    ///
    /// # Errors
    /// [`InvalidValue`] for substeps or iterations out of their range.
    pub fn applied(&self, world: &World) -> Result<World, InvalidValue> {
        let mut world = world.clone();
        self.method.apply(&mut world);
        world.settings.substeps = Substeps::new(self.substeps)?;
        world.settings.iterations = Iterations::new(self.iterations)?;
        world.sleep.enabled = false;
        for body in &mut world.bodies {
            body.asleep = false;
        }
        Ok(world)
    }

    /// Projections of constraints a tick: constraints × substeps × iterations.
    #[must_use]
    pub fn projections(&self, world: &World) -> u64 {
        let constraints = constraints(world) as u64;
        constraints * u64::from(self.substeps) * u64::from(self.iterations)
    }
}

/// Constraints of all bodies.
#[must_use]
pub fn constraints(world: &World) -> usize {
    let bodies = world.bodies.iter();
    bodies
        .map(|body| body.effects.constraints(&body.topology))
        .sum()
}

/// As in `xpbd 16×4`: 16 substeps of 4 iterations.
impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            method,
            substeps,
            iterations,
        } = self;
        write!(f, "{} {substeps}×{iterations}", method.name())
    }
}
