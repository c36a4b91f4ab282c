//! World settings by name.

/// Names, units and descriptions of the settings for [`Action::SetSetting`](super::Action::SetSetting).
pub const SETTINGS: [(&str, &str, &str); 10] = [
    ("gravity_x", "m/s²", "gravity along x (right)"),
    ("gravity_y", "m/s²", "gravity along y (up)"),
    ("gravity_z", "m/s²", "gravity along z (towards the viewer)"),
    ("rate", "Hz", "ticks per second"),
    ("substeps", "", "substeps per tick"),
    (
        "order",
        "",
        "order of the integrator: 1 is implicit Euler, 2 is BDF2",
    ),
    (
        "keep_spin",
        "",
        "whether free-flying bodies conserve angular momentum: 0 or 1",
    ),
    ("iterations", "", "passes over all constraints per substep"),
    (
        "smoothing_iterations",
        "",
        "averaged passes after the iterations of a substep",
    ),
    (
        "collision_iterations",
        "",
        "passes over all contacts per substep; 0 is one after each iteration",
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
