//! Rigid colliders, static or moving on a given path.

use crate::{ColliderMesh, ColliderShape, InvalidValue, Path, Pose, Settings};
use glam::{DVec3, Vec3};

/// A rigid shape that bodies with [`Collide`](crate::Collide) cannot enter. Contacts do not move it.
///
/// ```
/// use glam::{DVec3, Vec3};
/// use pliant_solver::{Collider, ColliderShape, Pose};
///
/// let table = ColliderShape::Box {
///     size: Vec3::new(1.0, 0.1, 1.0), // m
/// };
/// let table = Collider::new(table, Pose::at(DVec3::new(0.0, 0.7, 0.0)))?;
/// assert!(Collider::new(ColliderShape::Sphere { radius: -1.0 }, Pose::default()).is_err());
/// # Ok::<(), pliant_solver::InvalidValue>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "bevy", derive(bevy_ecs::component::Component))]
pub struct Collider {
    /// Shape, in the local frame.
    pub shape: ColliderShape,
    /// Initial pose.
    pub start: Pose,
    /// Motion from there.
    pub path: Path,
}

impl Collider {
    /// A static collider.
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn new(shape: ColliderShape, start: Pose) -> Result<Self, InvalidValue> {
        Self::moving(shape, start, Path::Still)
    }

    /// A collider that follows a path.
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn moving(shape: ColliderShape, start: Pose, path: Path) -> Result<Self, InvalidValue> {
        let collider = Self { shape, start, path };
        collider.check()?;
        Ok(collider)
    }

    /// Whether bodies can touch it.
    ///
    /// # Errors
    /// [`InvalidValue`] if a size is not finite and positive, the pose is not a finite rotation and
    /// translation, or the path has invalid parameters.
    pub fn check(&self) -> Result<(), InvalidValue> {
        self.shape.check()?;
        self.start.check()?;
        self.path.check()
    }

    /// Pose at a time [s].
    #[must_use]
    pub fn pose_at(&self, time: f64) -> Pose {
        self.path.pose(&self.start, time)
    }

    /// Its mesh, if it is one, with its pose at a time [s].
    #[must_use]
    pub fn mesh_at(&self, time: f64) -> Option<(&ColliderMesh, Pose)> {
        Some((self.shape.mesh()?, self.pose_at(time)))
    }

    /// Motion between two times [s].
    #[must_use]
    pub fn sweep(&self, from: f64, to: f64) -> SweptCollider {
        SweptCollider {
            shape: self.shape.clone(),
            from: self.pose_at(from),
            to: self.pose_at(to),
        }
    }
}

/// A collider over one substep.
#[derive(Debug, Clone, PartialEq)]
pub struct SweptCollider {
    /// Shape, in the local frame.
    pub shape: ColliderShape,
    /// Pose at the start.
    pub from: Pose,
    /// Pose at the end.
    pub to: Pose,
}

impl SweptCollider {
    /// Whether it moves.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.from != self.to
    }

    /// Whether it may touch anything in a box at any time during its motion.
    #[must_use]
    pub fn near(&self, low: Vec3, high: Vec3) -> bool {
        let (low, high) = (low.as_dvec3(), high.as_dvec3());
        let reach = DVec3::splat(self.shape.reach().into());
        let (a, b) = (self.from.translation, self.to.translation);
        (a.min(b) - reach).cmple(high).all() && (a.max(b) + reach).cmpge(low).all()
    }
}

/// Motion of all colliders in each substep of a tick. A cache that is reused between ticks and not
/// part of the state: any two compare equal.
#[derive(Debug, Clone, Default)]
pub struct Swept {
    /// One entry per substep, and the whole tick last.
    sweeps: Vec<SweptCollider>,
    colliders: usize,
}

impl Swept {
    /// Fills it for a tick that starts at `time` [s].
    pub fn fill<'c>(
        &mut self,
        colliders: impl Iterator<Item = &'c Collider> + Clone,
        settings: &Settings,
        time: f64,
    ) {
        let h = settings.substep_seconds();
        self.sweeps.clear();
        self.colliders = colliders.clone().count();
        for index in 0..settings.substeps.get() {
            let start = time + h * f64::from(index);
            let substep = colliders.clone().map(|c| c.sweep(start, start + h));
            self.sweeps.extend(substep);
        }
        let end = time + settings.tick_seconds();
        self.sweeps.extend(colliders.map(|c| c.sweep(time, end)));
    }

    /// Whether a collider is a mesh.
    #[must_use]
    pub fn has_meshes(&self) -> bool {
        self.whole_tick().iter().any(|it| it.shape.mesh().is_some())
    }

    /// Motion over the whole tick.
    #[must_use]
    pub fn whole_tick(&self) -> &[SweptCollider] {
        &self.sweeps[self.sweeps.len() - self.colliders..]
    }

    /// Motion in a substep.
    #[must_use]
    pub fn of(&self, substep: u32) -> &[SweptCollider] {
        let first = substep as usize * self.colliders;
        &self.sweeps[first..first + self.colliders]
    }
}

impl PartialEq for Swept {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
