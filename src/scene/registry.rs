//! The built-in scenes, embedded in the program, so that an installed one needs no data folder.
//! This list is used by the scene browser, the command line and the tests, which compare it with
//! `docs/scene-list.md`.

/// Subject of a built-in scene, by which the scene browser groups it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Group {
    /// For the first minutes: one of each kind.
    Start,
    /// Solid bodies.
    Solids,
    /// Cloth.
    Cloth,
    /// Ropes and chains.
    Ropes,
    /// Sand and other loose balls.
    Grains,
    /// Closed surfaces under pressure, or held up from inside.
    Balloons,
    /// Contact between bodies, with colliders and with the ground.
    Contact,
    /// Stiffness and materials of beams and blocks.
    Stiffness,
    /// Bodies that come apart.
    Tearing,
    /// Recovery from an extreme initial state.
    Stress,
}

impl Group {
    /// All groups, in the order of the scene browser.
    pub const ALL: [Self; 10] = [
        Self::Start,
        Self::Solids,
        Self::Cloth,
        Self::Ropes,
        Self::Grains,
        Self::Balloons,
        Self::Contact,
        Self::Stiffness,
        Self::Tearing,
        Self::Stress,
    ];

    /// Title.
    #[must_use]
    pub const fn title(self) -> &'static str {
        match self {
            Self::Start => "Start here",
            Self::Solids => "Solids",
            Self::Cloth => "Cloth",
            Self::Ropes => "Ropes",
            Self::Grains => "Grains",
            Self::Balloons => "Balloons",
            Self::Contact => "Contact",
            Self::Stiffness => "Materials and beams",
            Self::Tearing => "Tearing",
            Self::Stress => "Recovery",
        }
    }
}

/// A built-in scene.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct BuiltinScene {
    /// Name in commands.
    pub name: &'static str,
    /// Its group.
    pub group: Group,
    /// Simulated time that its picture shows [s].
    pub moment: f64,
    /// The text of its file.
    pub text: &'static str,
    /// Its picture as PNG, written by `pliant scenes --pictures`.
    #[cfg(feature = "window")]
    pub picture: &'static [u8],
}

macro_rules! scenes {
    ($($(#[$condition:meta])? $name:literal $group:ident $moment:literal),* $(,)?) => {
        &[$($(#[$condition])? BuiltinScene {
            name: $name,
            group: Group::$group,
            moment: $moment,
            text: include_str!(concat!("../../assets/scenes/", $name, ".ron")),
            #[cfg(feature = "window")]
            picture: include_bytes!(concat!("../../assets/pictures/", $name, ".png")),
        }),*]
    };
}

/// All built-in scenes, the default one first. Those of [meshes of Stanford](super::asset::ASSETS) are
/// there with the feature `program` only.
pub const SCENES: &[BuiltinScene] = scenes![
    #[cfg(feature = "program")]
    "welcome" Start 0.5,
    "jelly_cube" Start 0.42,
    #[cfg(feature = "program")]
    "bunny" Start 0.5,
    "teapot" Solids 0.5,
    #[cfg(feature = "program")]
    "dragon" Solids 0.6,
    "shapes" Solids 0.55,
    "many_bodies" Contact 1.2,
    "pile" Contact 1.5,
    "bowl" Contact 2.0,
    "heap" Contact 3.0,
    "stairs" Contact 1.0,
    "dispenser" Contact 5.0,
    "all_together" Contact 1.2,
    "crates" Contact 0.6,
    "jelly_stack" Contact 1.0,
    "sheets" Contact 0.35,
    "tablecloth" Contact 1.5,
    "folds" Contact 4.0,
    "sleeve" Contact 3.0,
    "ring" Contact 4.0,
    "knot" Ropes 3.0,
    "post" Ropes 1.0,
    "compliance_ladder" Stiffness 0.6,
    "edges_and_volume" Stress 0.3,
    "rubber" Stiffness 2.0,
    "shape_matching" Stiffness 0.4,
    "cantilever" Stiffness 0.6,
    "stiff_beam" Stiffness 1.0,
    "squashed" Stress 0.02,
    "shuffled" Stress 0.02,
    "mirrored" Stress 0.02,
    "hanging_chain" Ropes 3.0,
    "rope" Ropes 4.0,
    "rods" Ropes 2.0,
    "coil_springs" Ropes 1.0,
    "hoops" Ropes 1.0,
    "twisted_ring" Ropes 4.0,
    "tree" Ropes 2.0,
    "hair" Start 1.2,
    "curls" Ropes 1.2,
    "soft_head" Ropes 1.2,
    #[cfg(feature = "program")]
    "fur" Ropes 1.0,
    "sand_pile" Grains 1.5,
    "hourglass" Grains 1.5,
    "marbles" Grains 1.2,
    "grains_on_cloth" Grains 1.0,
    "ball_pit" Grains 0.8,
    "fountain" Grains 3.0,
    "chute" Grains 2.5,
    "stream" Grains 1.5,
    "drape" Start 2.0,
    "bending" Cloth 3.0,
    "flag" Cloth 3.0,
    "whirl" Cloth 0.7,
    "materials" Cloth 3.0,
    "weave" Cloth 1.5,
    "strain_limit" Cloth 2.0,
    "long_cloth" Cloth 2.0,
    "balloon" Balloons 0.6,
    "struts" Balloons 1.5,
    "cloth_lab" Cloth 0.5,
    "plasticity" Stiffness 3.0,
    "stitches" Cloth 2.0,
    "colliders" Contact 1.5,
    "slope" Contact 0.6,
    "bounce" Contact 0.4,
    "sticky" Contact 0.4,
    "torn_banner" Start 3.0,
    "burst_balloon" Tearing 0.6,
    "needle" Tearing 1.9,
    "breakthrough" Tearing 0.9,
    "torn_jelly" Tearing 0.5,
    "trousers" Tearing 2.5,
    "overload" Tearing 3.5,
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
