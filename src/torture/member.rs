//! A member of a case's family: a body with its size, compliance and settings.

use super::{Kind, Shape, TortureError};
use crate::solver::{
    Body, Compliance, Damping, Density, Effects, Iterations, RestShape, Settings, Stretch,
    Substeps, Topology, Volume, World, rest::SleepSettings,
};
use glam::Vec3;
use std::{fmt, sync::Arc};

/// A member of a family. Members with equal parameters are identical to the bit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Member {
    /// Its shape.
    pub shape: Shape,
    /// Its length [m].
    pub scale: f32,
    /// Compliance of an edge [m/N] at a length of 1 m. The body's compliance is this divided by the
    /// mass at its length, so that all lengths move alike.
    pub compliance: f32,
    /// Damping τ [s] of edges and volumes.
    pub damping: f32,
    /// Substeps per tick of 1/60 s.
    pub substeps: u32,
    /// Iterations per substep.
    pub iterations: u32,
    /// Seed for random numbers.
    pub seed: u32,
    /// Variant of the case; empty where it has none.
    pub variant: &'static str,
    /// A case-specific value, such as a mass ratio; 0 where it has none.
    pub value: f64,
    /// Whether a quick run includes it.
    pub quick: bool,
}

impl Member {
    /// A rigid, undamped member of 10 substeps.
    #[must_use]
    pub const fn of(shape: Shape) -> Self {
        Self {
            shape,
            scale: 1.0,
            compliance: 0.0,
            damping: 0.0,
            substeps: 10,
            iterations: 1,
            seed: 1,
            variant: "",
            value: 0.0,
            quick: true,
        }
    }

    /// A user's body as a member.
    #[must_use]
    pub fn given(body: &Body, settings: Settings) -> Self {
        let kind = Kind::of(body.topology.dimension);
        Self {
            scale: body.topology.size,
            substeps: settings.substeps.get(),
            iterations: settings.iterations.get(),
            ..Self::of(Shape::Given(kind))
        }
    }

    /// Gravity [m/s²] under which all lengths move alike: that of the Earth at 1 m.
    #[must_use]
    pub fn gravity(&self) -> Vec3 {
        Vec3::new(0.0, -9.81 * self.scale, 0.0)
    }

    /// Its effects.
    ///
    /// # Errors
    /// [`TortureError::Value`] for a compliance or damping out of range.
    pub fn effects(&self) -> Result<Effects, TortureError> {
        let kind = self.shape.kind();
        let damping = Damping::new(self.damping)?;
        let mut mass = 1.0;
        for _ in 0..kind.dimensions() {
            mass *= self.scale;
        }
        let stretch = Stretch {
            compliance: Compliance::new(self.compliance / mass)?,
            damping,
            ..Stretch::default()
        };
        let volume = Volume {
            damping,
            ..Volume::default()
        };
        Ok(Effects {
            stretch: Some(stretch),
            volume: (kind == Kind::Tetrahedra).then_some(volume),
            ..Effects::default()
        })
    }

    /// A body of a rest shape, with its effects.
    ///
    /// # Errors
    /// [`TortureError`] for a shape that cannot be a body, or a value out of range.
    pub fn body_of(&self, shape: RestShape) -> Result<Body, TortureError> {
        let topology = Arc::new(Topology::new(shape)?);
        let density = Density::new(self.shape.kind().density())?;
        Ok(Body {
            effects: self.effects()?,
            ..Body::new(self.shape.to_string(), topology, density)
        })
    }

    /// A world that contains only its body, in its rest shape, without gravity or sleeping.
    ///
    /// # Errors
    /// As [`Member::body_of`].
    pub fn world(&self) -> Result<World, TortureError> {
        let mut settings = Settings {
            substeps: Substeps::new(self.substeps)?,
            iterations: Iterations::new(self.iterations)?,
            ..Settings::default()
        };
        settings.set_gravity(Vec3::ZERO)?;
        Ok(World {
            settings,
            sleep: SleepSettings {
                enabled: false,
                ..SleepSettings::default()
            },
            bodies: vec![self.body_of(self.shape.build(self.scale)?)?],
            ..World::default()
        })
    }
}

/// Its name: the shape, and the differences to [`Member::of`], as in `cube3,scale=0.001,steps=4x1`.
impl fmt::Display for Member {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plain = Self::of(self.shape);
        write!(f, "{}", self.shape)?;
        if !self.variant.is_empty() {
            write!(f, ",{}", self.variant)?;
        }
        if self.value != plain.value {
            write!(f, ",value={}", self.value)?;
        }
        if self.scale != plain.scale {
            write!(f, ",scale={}", self.scale)?;
        }
        if self.compliance != plain.compliance {
            write!(f, ",compliance={:e}", self.compliance)?;
        }
        if self.damping != plain.damping {
            write!(f, ",damping={}", self.damping)?;
        }
        if (self.substeps, self.iterations) != (plain.substeps, plain.iterations) {
            write!(f, ",steps={}x{}", self.substeps, self.iterations)?;
        }
        if self.seed != plain.seed {
            write!(f, ",seed={}", self.seed)?;
        }
        Ok(())
    }
}
