//! What an app does to bodies, in a snapshot.

use crate::{
    recording::error::{SnapshotError, nonsense},
    solver::{Body, Controls},
};

/// What an app does to bodies, with the index of each to which it does something.
pub fn stored_controls(bodies: &[Body]) -> Vec<(u32, &Controls)> {
    let all = (0..)
        .zip(bodies)
        .filter_map(|(index, body)| Some((index, &**body.controls.as_ref()?)));
    all.filter(|(_, controls)| !controls.is_empty()).collect()
}

/// Gives bodies what was stored.
pub fn set_controls(
    stored: Vec<(u32, Controls)>,
    bodies: &mut [Body],
) -> Result<(), SnapshotError> {
    for (index, controls) in stored {
        let body = bodies.get_mut(index as usize);
        let Some(body) = body.filter(|body| controls.fit(&body.topology)) else {
            return Err(nonsense(format!(
                "what an app does to body {index} is invalid"
            )));
        };
        *body.control() = controls;
    }
    Ok(())
}
