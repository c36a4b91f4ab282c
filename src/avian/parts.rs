//! What connects the bodies of both engines.

use crate::solver::ContactThickness;
use bevy::prelude::*;

/// Thickness of dynamic bodies.
#[derive(Resource, Debug, Clone, Copy)]
pub(super) struct ProxyThickness(pub(super) ContactThickness);

/// Entity that stands for one of Avian's bodies in the soft-body simulation. It is despawned with
/// the body.
#[derive(Component, Debug)]
#[relationship(relationship_target = Represented)]
pub(super) struct Represents(pub(super) Entity);

/// The entity that stands for a body of Avian's.
#[derive(Component, Debug)]
#[relationship_target(relationship = Represents, linked_spawn)]
pub(super) struct Represented(Vec<Entity>);

/// A body whose colliders have no surface, of which a warning has been given.
#[derive(Component, Debug)]
pub(super) struct Unseen;
