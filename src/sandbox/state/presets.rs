//! Presets of the user: parameters of a body under a name.

use crate::{scene::BodyParameters, solver::topology::Dimension};
use bevy::prelude::*;

/// A preset of the user.
#[derive(Debug, Clone, PartialEq)]
pub struct Preset {
    /// Name.
    pub name: String,
    /// Dimension of the bodies for which it is.
    pub dimension: Dimension,
    /// The parameters.
    pub parameters: BodyParameters,
}

/// All presets of the user, by name.
#[derive(Resource, Debug, Clone, Default, Deref, DerefMut)]
pub struct Presets(pub Vec<Preset>);
