//! The settings of the world by name.

/// Names, units and meanings of the settings that [`Action::SetSetting`] reaches.
pub const SETTINGS: [(&str, &str, &str); 6] = [
    ("gravity_x", "m/s²", "gravity to the right"),
    ("gravity_y", "m/s²", "gravity upwards"),
    ("gravity_z", "m/s²", "gravity towards the viewer"),
    ("rate", "1/s", "ticks a second"),
    ("substeps", "", "substeps a tick"),
    ("iterations", "", "sweeps over all constraints a substep"),
];

/// The value of a setting by its name.
#[must_use]
pub fn setting(settings: &crate::solver::Settings, name: &str) -> Option<f64> {
    Some(match name {
        "gravity_x" => settings.gravity.x.into(),
        "gravity_y" => settings.gravity.y.into(),
        "gravity_z" => settings.gravity.z.into(),
        "rate" => settings.rate.get(),
        "substeps" => settings.substeps.get().into(),
        "iterations" => settings.iterations.get().into(),
        _ => return None,
    })
}
