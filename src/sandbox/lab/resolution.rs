//! Warns when substeps become too short for single precision, see
//! [`resolution`](crate::solver::resolution).

use crate::sandbox::ui::message::Notices;
use crate::simulation::{SimulationSettings, plain};
use bevy::prelude::*;

/// Warns when the number of substeps exceeds what single precision resolves.
pub struct ResolutionPlugin;

impl Plugin for ResolutionPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(Update, warn.run_if(resource_changed::<SimulationSettings>));
    }
}

/// Warns once when the limit is exceeded, not for every further step of a slider.
fn warn(world: &mut World, mut passed: Local<bool>) {
    let substeps = world.resource::<SimulationSettings>().substeps.get();
    let most = plain::capture(world).resolved_substeps();
    let beyond = most.filter(|most| substeps > *most);
    if let (Some(most), false) = (beyond, *passed) {
        world.resource_mut::<Notices>().warn(format!(
            "Single precision resolves at most {most} substeps here. Beyond that, rounding moves particles by \
             more than gravity does per substep: forces become noise, and more substeps no longer help."
        ));
    }
    *passed = beyond.is_some();
}
