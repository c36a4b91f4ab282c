//! The built-in scenes, embedded in the program, so that an installed one needs no data folder.
//! This list is used by the picker, the command line and the tests, which compare it with
//! `docs/scenes.md`.

/// A built-in scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BuiltinScene {
    /// Name in commands.
    pub name: &'static str,
    /// The text of its file.
    pub text: &'static str,
}

macro_rules! scenes {
    ($($name:literal),* $(,)?) => {
        &[$(BuiltinScene {
            name: $name,
            text: include_str!(concat!("../../assets/scenes/", $name, ".ron")),
        }),*]
    };
}

/// All built-in scenes, the default one first.
pub const SCENES: &[BuiltinScene] = scenes![
    "jelly_cube",
    "bunny",
    "teapot",
    "dragon",
    "shapes",
    "many_bodies",
    "pile",
    "bowl",
    "heap",
    "stairs",
    "crates",
    "jelly_stack",
    "sheets",
    "tablecloth",
    "folds",
    "sleeve",
    "ring",
    "knot",
    "post",
    "compliance_ladder",
    "edges_and_volume",
    "rubber",
    "shape_matching",
    "cantilever",
    "stiff_beam",
    "squashed",
    "shuffled",
    "mirrored",
    "hanging_chain",
    "rope",
    "drape",
    "bending",
    "flag",
    "whirl",
    "materials",
    "weave",
    "strain_limit",
    "long_cloth",
    "balloon",
    "struts",
    "cloth_lab",
    "plasticity",
    "stitches",
    "colliders",
    "slope",
    "bounce",
    "sticky",
];

/// Looks up a built-in scene by name.
#[must_use]
pub fn find(name: &str) -> Option<&'static BuiltinScene> {
    SCENES.iter().find(|scene| scene.name == name)
}

/// All names, for messages.
#[must_use]
pub fn names() -> String {
    let names: Vec<_> = SCENES.iter().map(|scene| scene.name).collect();
    names.join(", ")
}
