//! What users are told of diverged bodies.

use super::{BodyQuarantined, body::shown_name};
use crate::solver::Quarantine;
use bevy::prelude::*;

/// The message for users.
pub(super) fn message(
    body: Entity,
    name: Option<&Name>,
    quarantine: &Quarantine,
) -> BodyQuarantined {
    let name = shown_name(body, name);
    let Quarantine { vertex, stage, .. } = quarantine;
    let (what, remedy) = match *stage {
        Quarantine::INPUT => (
            format!(
                "was given invalid input (vertex {vertex} is not finite, or columns of particles differ in length)"
            ),
            "Set finite values, one per particle in each column.",
        ),
        stage => (
            format!("diverged (non-finite state of vertex {vertex} after {stage})"),
            "Try more substeps, less damping or less stiffness.",
        ),
    };
    BodyQuarantined {
        body,
        text: format!(
            "body {name} {what}. It was restored to the start of the tick and paused. {remedy}"
        ),
    }
}
