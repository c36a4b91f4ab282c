//! The scene file: RON, by serde. Every number that has a type of its own is checked while it is
//! read, so that an error has its line and column.

use super::{Acceptance, Answer, SceneError, registry, spawn::CurrentScene};
use crate::{
    mesh::{BuildOptions, Primitive, Treatment},
    solver::{
        self, ColliderShape, Compliance, Deformation, Density, Effects, Force, Mass, Path,
        Settings, VertexIndex,
    },
};
use glam::{UVec3, Vec3};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::{path::PathBuf, str::FromStr};

/// A scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Its title.
    pub title: String,
    /// A line that says what to look at.
    pub look_at: String,
    /// Gravity, rate, substeps, iterations.
    #[serde(default)]
    pub world: Settings,
    /// The soft bodies.
    pub bodies: Vec<BodySpec>,
    /// The rigid ones.
    #[serde(default)]
    pub colliders: Vec<ColliderSpec>,
    /// Where the camera stands at first; none frames everything.
    #[serde(default)]
    pub camera: Option<CameraSpec>,
    /// What mathematics says that bodies should look like at rest.
    #[serde(default)]
    pub answers: Vec<Answer>,
    /// What must hold after the scene ran.
    pub acceptance: Acceptance,
    /// The folder that mesh files are beside; not in the file.
    #[serde(skip)]
    pub folder: PathBuf,
}

/// A soft body, or several alike.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodySpec {
    /// Its name; several alike are numbered.
    pub name: String,
    /// A shape that is made.
    #[serde(default)]
    pub primitive: Option<Primitive>,
    /// A shape that is read.
    #[serde(default)]
    pub mesh: Option<MeshSpec>,
    /// Name of a [material](super::material), which gives it its density and the effects that make it up;
    /// what stands here besides takes the place of the material's.
    #[serde(default)]
    pub material: Option<String>,
    /// Mass per measure: kg/m³ of a solid, kg/m² of a cloth, kg/m of a rope; default that of the
    /// material, 1000 without one.
    #[serde(default)]
    pub density: Option<Density>,
    /// Masses on top of that, by particle [kg].
    #[serde(default)]
    pub added_mass: Vec<(VertexIndex, Mass)>,
    /// Where the middle of its mesh is put [m].
    #[serde(default)]
    pub position: Vec3,
    /// How it is turned: degrees about x, then y, then z.
    #[serde(default)]
    pub rotation: Vec3,
    /// Its velocity at first [m/s].
    #[serde(default)]
    pub velocity: Vec3,
    /// How fast it turns at first, about its centre of mass [rad/s].
    #[serde(default)]
    pub spin: Vec3,
    /// What it does.
    #[serde(default)]
    pub effects: SceneEffects,
    /// Particles that do not move.
    #[serde(default)]
    pub pins: Vec<Pins>,
    /// Points that are held together, or to colliders.
    #[serde(default)]
    pub stitches: Vec<StitchSpec>,
    /// Deformations that it starts from, one after the other.
    #[serde(default)]
    pub start: Vec<Deformation>,
    /// Several alike.
    #[serde(default)]
    pub copies: Option<Copies>,
    /// Colour, as #rrggbb; none takes the next of the palette.
    #[serde(default)]
    pub colour: Option<String>,
}

/// A mesh that is read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshSpec {
    /// Name of a built-in mesh, or path of a file beside the scene's.
    pub file: String,
    /// Length of the longest side [m]; none keeps the file's numbers as metres.
    #[serde(default)]
    pub size: Option<f32>,
    /// Lattice cells along the longest side when a surface is filled; none takes as many as its
    /// volume needs.
    #[serde(default)]
    pub cells: Option<u32>,
    /// Whether a surface is filled, or a cloth itself.
    #[serde(default)]
    pub treatment: Treatment,
}

impl MeshSpec {
    pub(super) fn options(&self) -> BuildOptions {
        BuildOptions {
            size: self.size,
            cells: self.cells,
            treatment: self.treatment,
        }
    }
}

macro_rules! named_by_a_scene {
    (
        { $($first:ident { $($kind1:ident $field1:ident $(($($numbers:tt)*))? $does1:literal;)* })* }
        $stitches:ident $stitched:ident
        { $($second:ident { $($kind2:ident $field2:ident $does2:literal;)* })* }
        $grab:ident $grabbed:ident
        { $($third:ident { $($kind3:ident $field3:ident $does3:literal;)* })* }
    ) => {
        /// The effects that a scene file may name.
        #[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct SceneEffects {
            $($(#[doc = $does1] pub $field1: Option<solver::$kind1>,)*)*
            $($(#[doc = $does2] pub $field2: Option<solver::$kind2>,)*)*
            $($(#[doc = $does3] pub $field3: Option<solver::$kind3>,)*)*
        }

        impl From<SceneEffects> for Effects {
            fn from(effects: SceneEffects) -> Self {
                Self {
                    $($($field1: effects.$field1,)*)*
                    $($($field2: effects.$field2,)*)*
                    $grabbed: None,
                    $($($field3: effects.$field3,)*)*
                }
            }
        }
    };
}

solver::effects!(named_by_a_scene);

/// Vertices that do not move, chosen where the body stands at first.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Pins {
    /// One vertex by its number. Older files call it `Particle`.
    #[serde(alias = "Particle")]
    Vertex(VertexIndex),
    /// All in the highest part of the body's height, as a share from 0 to 1; 0 takes only the
    /// very highest.
    Top(f32),
    /// All in the part of the body with the smallest x, as a share of its width from 0 to 1.
    Left(f32),
    /// All in a box of the world [m].
    Within {
        /// Lowest corner.
        low: Vec3,
        /// Highest corner.
        high: Vec3,
    },
}

/// A point of a body that is held to another or to a collider, chosen where the body stands at first.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StitchSpec {
    /// The point.
    pub point: PointSpec,
    /// What it is held to.
    pub to: StitchTo,
    /// Compliance [m/N]; default 0, rigid.
    #[serde(default)]
    pub compliance: Compliance,
    /// It breaks when it pulls harder than this [N]; default inf, never.
    #[serde(default)]
    pub strength: Force,
}

/// A point of a body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum PointSpec {
    /// A vertex by its number. Older files call it `Particle`.
    #[serde(alias = "Particle")]
    Vertex(VertexIndex),
    /// A point of a triangle: its corners, and their weights, which are scaled to a sum of 1.
    Triangle([VertexIndex; 3], [f32; 3]),
}

/// What a point is held to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum StitchTo {
    /// Another point of the body: the two are drawn together.
    Point(PointSpec),
    /// A collider of the scene, from 1, at the place where the point is at first.
    Collider(u32),
}

/// Several bodies alike, in a grid.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Copies {
    /// How many along each axis.
    pub count: UVec3,
    /// Distance from one to the next along each axis [m].
    pub spacing: Vec3,
}

/// A rigid shape.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ColliderSpec {
    /// Its shape.
    pub shape: ColliderShape,
    /// Where it is put [m].
    #[serde(default)]
    pub position: Vec3,
    /// How it is turned: degrees about x, then y, then z.
    #[serde(default)]
    pub rotation: Vec3,
    /// How it moves from there.
    #[serde(default)]
    pub path: Path,
}

/// Where the camera stands.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraSpec {
    /// The eye [m].
    pub eye: Vec3,
    /// What it looks at [m].
    pub target: Vec3,
}

impl Scene {
    /// Reads a built-in scene by its name, or a file by its path.
    ///
    /// # Errors
    /// [`SceneError::Unknown`], [`SceneError::Unreadable`] or [`SceneError::Syntax`].
    pub fn load(name: &str) -> Result<CurrentScene, SceneError> {
        if let Some(builtin) = registry::find(name) {
            return Ok(CurrentScene {
                name: name.to_owned(),
                path: None,
                scene: Self::parse(&format!("{name}.ron"), builtin.text)?,
            });
        }
        let path = PathBuf::from(name);
        let text = std::fs::read_to_string(&path).map_err(|error| {
            let looks_like_a_path = name.contains(['/', '\\', '.']);
            if error.kind() == std::io::ErrorKind::NotFound && !looks_like_a_path {
                SceneError::Unknown {
                    name: name.to_owned(),
                    valid: registry::names(),
                }
            } else {
                let path = path.clone();
                SceneError::Unreadable { path, error }
            }
        })?;
        let mut scene = Self::parse(name, &text)?;
        scene.folder = path.parent().map(PathBuf::from).unwrap_or_default();
        Ok(CurrentScene {
            name: name.to_owned(),
            path: Some(path),
            scene,
        })
    }

    /// Reads the text of a scene file; `file` is what errors call it.
    ///
    /// # Errors
    /// [`SceneError::Syntax`] with line, column and what was expected.
    pub fn parse(file: &str, text: &str) -> Result<Self, SceneError> {
        parse(file, text)
    }

    /// The scene as the text of a file.
    ///
    /// # Errors
    /// What RON cannot write, which no valid scene has.
    pub fn to_text(&self) -> Result<String, ron::Error> {
        let options = ron::Options::default()
            .with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
        options.to_string_pretty(self, ron::ser::PrettyConfig::new().struct_names(true))
    }
}

/// Reads the text of a file of any kind in the format of scene files; `file` is what errors call it.
///
/// # Errors
/// [`SceneError::Syntax`] with line, column and what was expected.
pub fn parse<T: DeserializeOwned>(file: &str, text: &str) -> Result<T, SceneError> {
    let options =
        ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
    options.from_str(text).map_err(|error| SceneError::Syntax {
        file: file.to_owned(),
        line: error.span.start.line,
        column: error.span.start.col,
        message: error.code.to_string(),
    })
}

impl FromStr for Scene {
    type Err = SceneError;

    fn from_str(text: &str) -> Result<Self, SceneError> {
        Self::parse("scene", text)
    }
}
