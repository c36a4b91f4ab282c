//! The settings of the world by name.

/// Names, units and meanings of the settings that [`Action::SetSetting`] reaches.
pub const SETTINGS: [(&str, &str, &str); 10] = [
    ("gravity_x", "m/s²", "gravity to the right"),
    ("gravity_y", "m/s²", "gravity upwards"),
    ("gravity_z", "m/s²", "gravity towards the viewer"),
    ("rate", "1/s", "ticks a second"),
    ("substeps", "", "substeps a tick"),
    (
        "order",
        "",
        "order of the steps in time: 1 is implicit Euler, 2 is BDF2",
    ),
    (
        "keep_spin",
        "",
        "whether free bodies keep their angular momentum: 0 or 1",
    ),
    ("iterations", "", "sweeps over all constraints a substep"),
    (
        "smoothing_iterations",
        "",
        "averaged passes after the sweeps of a substep",
    ),
    (
        "collision_iterations",
        "",
        "passes over all contacts a substep; 0 is one after each sweep",
    ),
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
        "order" => settings.order.get().into(),
        "keep_spin" => settings.keep_spin.get().into(),
        "smoothing_iterations" => settings.smoothing_iterations.get().into(),
        "collision_iterations" => settings.collision_iterations.get().into(),
        _ => return None,
    })
}
