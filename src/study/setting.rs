//! A solver setting: method, substeps and iterations.

use crate::solver::{
    self, Body, Compliance, Direct, Fraction, InvalidValue, Iterations, Stiffness, Substeps, World,
    direct,
    effects::elastic::{Elastic, Visit},
};
use serde::{Deserialize, Serialize};
use std::fmt;

/// A solver method. Adding one takes a variant, its name, and its changes to the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// The scene's method; Gauss–Seidel XPBD by default.
    Xpbd,
    /// Classic position-based dynamics: XPBD with every compliance 0, so that stiffness is
    /// determined by the number of iterations.
    Pbd,
    /// XPBD's equations solved directly, one Newton step per iteration; for slender solids, through
    /// which Gauss–Seidel propagates a load slowly.
    Direct,
}

impl Method {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Xpbd, Self::Pbd, Self::Direct];

    /// Its name in reports and commands.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Xpbd => "xpbd",
            Self::Pbd => "pbd",
            Self::Direct => "direct",
        }
    }

    /// Configures a world to use it.
    pub fn apply(self, world: &mut World) {
        match self {
            Self::Xpbd => {}
            Self::Pbd => {
                let stiffness = Fraction::default();
                world.settings.method = solver::Method::Pbd { stiffness };
                for body in &mut world.bodies {
                    make_rigid(body);
                }
            }
            Self::Direct => {
                let method = world.settings.method;
                let bodies = world.bodies.iter_mut();
                for body in bodies.filter(|body| can_be_direct(body, method)) {
                    body.effects.direct = Some(Direct);
                }
            }
        }
    }

    /// Whether it differs from XPBD for this world.
    #[must_use]
    pub fn differs(self, world: &World) -> bool {
        match self {
            Self::Xpbd => false,
            Self::Pbd => world.settings.method == solver::Method::Xpbd && !all_rigid(world),
            Self::Direct => {
                let method = world.settings.method;
                world.bodies.iter().any(|body| can_be_direct(body, method))
            }
        }
    }
}

/// Removes the compliance of edges and volumes, so that rigid constraints store no energy.
fn make_rigid(body: &mut Body) {
    if let Some(stretch) = &mut body.effects.stretch {
        stretch.compliance = Compliance::default();
        stretch.axial_stiffness = Stiffness::default();
    }
    if let Some(volume) = &mut body.effects.volume {
        volume.compliance = Compliance::default();
        volume.bulk_modulus = Stiffness::default();
    }
}

/// Whether all constraints of a world are rigid and undamped.
fn all_rigid(world: &World) -> bool {
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
    rigid.0
}

/// Whether a body is slender and supported by the direct solver.
fn can_be_direct(body: &Body, method: solver::Method) -> bool {
    is_slender(body) && direct::unfit(&body.topology, &body.effects, method).is_none()
}

/// Whether a body is a solid whose length is at least four times its thickness.
fn is_slender(body: &Body) -> bool {
    let volumes = body.topology.tetrahedra.rest_volume.iter();
    let volume: f64 = volumes.map(|&volume| f64::from(volume).abs()).sum();
    let length = f64::from(body.topology.size);
    // A bar has length³ = 4 × 4 times its volume; reduced a little for rounding.
    volume > 0.0 && length * length * length >= 15.9 * volume
}

/// A method with its substeps and iterations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Setting {
    /// How constraints are solved.
    pub method: Method,
    /// Substeps per tick, from 1 to 10 000.
    pub substeps: u32,
    /// Constraint iterations per substep, from 1 to 10 000.
    pub iterations: u32,
}

impl Setting {
    /// XPBD with these substeps and iterations.
    #[must_use]
    pub const fn xpbd(substeps: u32, iterations: u32) -> Self {
        Self {
            method: Method::Xpbd,
            substeps,
            iterations,
        }
    }

    /// A copy of a world with this setting and with sleeping disabled.
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

    /// Constraint projections per tick: constraints × substeps × iterations.
    #[must_use]
    pub fn projections(&self, world: &World) -> u64 {
        let constraints = constraints(world) as u64;
        constraints * u64::from(self.substeps) * u64::from(self.iterations)
    }
}

/// Number of constraints of all bodies.
#[must_use]
pub(super) fn constraints(world: &World) -> usize {
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
