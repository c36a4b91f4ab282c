//! The colliders of a saved scene.

use super::{Definition, pose};
use crate::scene::{BuiltScene, ColliderSpec, Look, ShapeSpec};
use crate::solver::{Collider, ColliderShape};

impl Definition {
    /// The colliders as they are now, in order.
    pub(super) fn colliders_of(
        &self,
        now: &BuiltScene,
        reasons: &mut Vec<String>,
    ) -> Vec<ColliderSpec> {
        let mut specs = Vec::new();
        for (index, collider) in now.world.colliders.iter().enumerate() {
            let look = now.collider_looks.get(index).copied().unwrap_or_default();
            match self.collider(self.origin(now, index), collider, look) {
                Some(spec) => specs.push(spec),
                None => reasons.push(format!(
                    "collider {}: the source of its mesh is unknown",
                    index + 1
                )),
            }
        }
        specs
    }

    /// Index in the file of the collider with an index now; `None` for an added one.
    pub(super) fn origin(&self, now: &BuiltScene, index: usize) -> Option<usize> {
        let Some(places) = &now.places else {
            // A scene that was just built.
            return (index < self.colliders.len()).then_some(index);
        };
        let order = places.colliders.get(index)?;
        // Colliders are numbered after the bodies.
        let first = self.bodies.len() as u64 + 1;
        let index = order.get().checked_sub(first)? as usize;
        (index < self.colliders.len()).then_some(index)
    }

    fn collider(
        &self,
        origin: Option<usize>,
        collider: &Collider,
        look: Look,
    ) -> Option<ColliderSpec> {
        let known = origin.map(|index| (&self.colliders[index], &self.scene.colliders[index]));
        let Some((before, spec)) = known else {
            return Some(ColliderSpec {
                shape: shape(&collider.shape)?,
                position: collider.start.translation.as_vec3(),
                rotation: pose::degrees(&collider.start.rotation),
                path: collider.path.clone(),
                color: color(look.color),
                opacity: look.opacity,
            });
        };
        let mut spec = spec.clone();
        if collider.shape != before.shape {
            spec.shape = shape(&collider.shape)?;
        }
        if collider.start.translation != before.start.translation {
            spec.position = collider.start.translation.as_vec3();
        }
        if collider.start.rotation != before.start.rotation {
            spec.rotation = pose::degrees(&collider.start.rotation);
        }
        spec.path = collider.path.clone();
        if Look::new(spec.color.as_deref()).is_ok_and(|it| it.color != look.color) {
            spec.color = color(look.color);
        }
        spec.opacity = look.opacity;
        Some(spec)
    }
}

/// The shape in a scene file; `None` for a mesh.
fn shape(shape: &ColliderShape) -> Option<ShapeSpec> {
    match *shape {
        ColliderShape::Sphere { radius } => Some(ShapeSpec::Sphere { radius }),
        ColliderShape::Box { size } => Some(ShapeSpec::Box { size }),
        ColliderShape::Capsule { radius, length } => Some(ShapeSpec::Capsule { radius, length }),
        ColliderShape::Mesh(_) => None,
    }
}

/// A color in a scene file.
pub(super) fn color(color: Option<[u8; 3]>) -> Option<String> {
    color.map(|[red, green, blue]| format!("#{red:02x}{green:02x}{blue:02x}"))
}
