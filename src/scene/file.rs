//! The scene file: RON, by serde. Numbers with a checked type are validated during parsing, so that
//! errors have a line and column.

use super::{Acceptance, Answer, SceneEffects, SceneError, groups};
use crate::{
    effect::OwnEffects,
    mesh::{Bounds, BuildOptions, Primitive, Strands, Treatment},
    solver::{
        Compliance, Cut, Density, Force, GroupName, Mass, Path, Settings, Toughness, VertexIndex,
        deform::Deformation, rest::SleepSettings,
    },
};
use glam::{UVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// A scene.
///
/// ```
/// use pliant::scene::Scene;
///
/// let current = Scene::load("jelly_cube")?; // or the path of a file
/// assert_eq!(current.scene.bodies.len(), 1);
/// assert!(current.scene.build().is_ok());
/// # Ok::<(), pliant::scene::SceneError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Title.
    pub title: String,
    /// Description in one line: what to look at; default none.
    #[serde(default)]
    pub look_at: String,
    /// Gravity, rate, substeps, iterations.
    #[serde(default)]
    pub world: Settings,
    /// When bodies sleep; by default half a second after they came to rest.
    #[serde(default)]
    pub sleep: SleepSettings,
    /// The soft bodies.
    pub bodies: Vec<BodySpec>,
    /// Rigid colliders.
    #[serde(default)]
    pub colliders: Vec<ColliderSpec>,
    /// Direction of the initial view; by default from the front right and above. The distance is
    /// chosen so that everything fits the window.
    #[serde(default)]
    pub camera: Option<CameraSpec>,
    /// Region that the initial view shows in addition to the bodies and the ground below them: the
    /// space of the motion to come.
    #[serde(default)]
    pub frame: Option<Region>,
    /// Analytic solutions of bodies at rest.
    #[serde(default)]
    pub answers: Vec<Answer>,
    /// Acceptance criteria; by default 5 s without checks.
    #[serde(default)]
    pub acceptance: Acceptance,
    /// Folder to which paths of mesh files are relative; not in the file.
    #[serde(skip)]
    pub folder: PathBuf,
    /// Effects of the app that the file may contain; not in the file.
    #[serde(skip)]
    pub own_effects: OwnEffects,
    /// Whether [`build`](Self::build) chooses the substeps, from 20 to 40: where the file gives
    /// none, and no cells for a mesh that is filled.
    #[serde(skip)]
    pub chooses_substeps: bool,
    /// What [`of_mesh`](Self::of_mesh) chose for a mesh, as notes of what is built; not in the file.
    #[serde(skip)]
    pub notes: Vec<String>,
}

/// A soft body, or a grid of copies.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodySpec {
    /// Name; copies are numbered.
    pub name: String,
    /// Generated mesh.
    #[serde(default)]
    pub primitive: Option<Primitive>,
    /// Mesh file.
    #[serde(default)]
    pub mesh: Option<MeshSpec>,
    /// Hair on any surface.
    #[serde(default)]
    pub hair: Option<HairSpec>,
    /// Name of a [material](super::Material), which sets density and material effects; values given
    /// here take precedence.
    #[serde(default)]
    pub material: Option<String>,
    /// Mass per measure: kg/m³ of a solid, kg/m² of a cloth, kg/m of a rope. Defaults to that of
    /// the material, or 1000 without one.
    #[serde(default)]
    pub density: Option<Density>,
    /// Additional masses, by vertex [kg].
    #[serde(default)]
    pub added_mass: Vec<(VertexIndex, Mass)>,
    /// Position of the center of the mesh, or of the [bounds](PartBounds) of a part [m].
    #[serde(default)]
    pub position: Vec3,
    /// Rotation: degrees about x, then y, then z.
    #[serde(default)]
    pub rotation: Vec3,
    /// Initial velocity [m/s].
    #[serde(default)]
    pub velocity: Vec3,
    /// Initial angular velocity about the center of mass [rad/s].
    #[serde(default)]
    pub spin: Vec3,
    /// Effects.
    #[serde(default)]
    pub effects: SceneEffects,
    /// When it sleeps; by default as the scene says.
    #[serde(default)]
    pub sleep: Option<SleepSettings>,
    /// Named groups of vertices, at most 32, selected at the position of the body before its cuts and
    /// `start`; copies have the same ones. An entry may name a group before it.
    #[serde(default, with = "groups")]
    pub groups: Vec<(GroupName, Vec<VertexSelection>)>,
    /// Pinned vertices, selected in the initial pose of the body.
    #[serde(default)]
    pub pins: Vec<VertexSelection>,
    /// Points that are stitched together, to colliders, or to other bodies.
    #[serde(default)]
    pub stitches: Vec<StitchSpec>,
    /// Initial cuts, each by the triangle without end between two rays from a point, in the
    /// coordinates of the scene, before `start`. With copies, those of a body at its position.
    #[serde(default)]
    pub cuts: Vec<Cut>,
    /// Initial deformations, applied in order.
    #[serde(default)]
    pub start: Vec<Deformation>,
    /// Copies in a grid.
    #[serde(default)]
    pub copies: Option<Copies>,
    /// Color, as #rrggbb; defaults to the next one of the palette.
    #[serde(default, alias = "colour")]
    pub color: Option<String>,
}

/// A mesh file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshSpec {
    /// Name of a built-in mesh, or path of a file relative to the scene file.
    pub file: String,
    /// Name of a part, by default the whole file: of a node or a mesh of glTF, of an object or a group
    /// of OBJ, of a physical group of Gmsh. See [`Parts`](crate::mesh::read::Parts).
    #[serde(default)]
    pub part: Option<String>,
    /// What `size` and the position of the body refer to if there is a `part`.
    #[serde(default)]
    pub bounds: PartBounds,
    /// Length of the longest side of the bounds [m]; defaults to the file's numbers in meters.
    #[serde(default)]
    pub size: Option<f32>,
    /// Lattice cells along the longest side of a filled surface; by default 6 to 18, for at
    /// most about 2000 particles.
    #[serde(default)]
    pub cells: Option<u32>,
    /// Whether a surface is filled with tetrahedra, or simulated as a cloth.
    #[serde(default)]
    pub treatment: Treatment,
}

/// Strands of hair on a surface. The body has the coordinates of the surface, so that with the same
/// position and rotation they grow on the body or collider that has it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HairSpec {
    /// The surface.
    pub scalp: ScalpSpec,
    /// Number, shape and region of the strands.
    #[serde(default)]
    pub strands: Strands,
}

/// A surface on which hair grows. On a ball, without a mesh: the primitive [`Hair`](Primitive::Hair).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub enum ScalpSpec {
    /// The triangles of a mesh file, as those of a [collider](ShapeSpec::Mesh).
    Mesh {
        /// Name of a built-in mesh, or path of a file relative to the scene file.
        file: String,
        /// Name of a part, by default the whole file, as that of a [body](MeshSpec::part).
        #[serde(default)]
        part: Option<String>,
        /// What `size` and the position of the body refer to if there is a `part`.
        #[serde(default)]
        bounds: PartBounds,
        /// Length of the longest side of the bounds [m]; defaults to the file's numbers in meters.
        #[serde(default)]
        size: Option<f32>,
    },
    /// The surface of a generated mesh.
    Surface(Primitive),
}

/// The bounding box to which the size and the position of a part of a mesh file refer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum PartBounds {
    /// That of the whole file: parts with the same size, position and rotation fit together as in the
    /// file.
    #[default]
    File,
    /// That of the part.
    Part,
}

impl MeshSpec {
    pub(super) fn options(&self, bounds: Option<Bounds>) -> BuildOptions {
        BuildOptions {
            size: self.size,
            bounds,
            cells: self.cells,
            treatment: self.treatment,
        }
    }
}

/// Vertices of a body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub enum VertexSelection {
    /// One vertex, by its index. Older files call it `Particle`.
    #[serde(alias = "Particle")]
    Vertex(VertexIndex),
    /// All vertices in the upper part of the body, as a fraction of its height from 0 to 1; 0
    /// selects only the highest ones.
    Top(f32),
    /// All vertices in the lower part of the body, as a fraction of its height from 0 to 1.
    Bottom(f32),
    /// All vertices in the part with the smallest x, as a fraction of the body's width from 0 to 1.
    Left(f32),
    /// All vertices in the part with the largest x, likewise.
    Right(f32),
    /// All vertices in the part with the largest z, which is toward the viewer, as a fraction of the body's depth
    /// from 0 to 1.
    Front(f32),
    /// All vertices in the part with the smallest z, likewise.
    Back(f32),
    /// All vertices in a box in world space [m].
    Within {
        /// Minimum corner.
        low: Vec3,
        /// Maximum corner.
        high: Vec3,
    },
    /// The first vertices of each chain of a body of edges; two clamp a rod.
    Roots(u32),
    /// The vertices of a named group of the body.
    Group(GroupName),
    /// In `groups`, the vertices of a named [part](crate::mesh::read::Parts) of the mesh file of the body;
    /// of a filled surface, the corners of the tetrahedra that carry the surface of the part.
    Part(String),
}

/// A stitch from a point of a body to another, to a collider or to another body, defined where the
/// body is at the start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StitchSpec {
    /// The point.
    pub point: PointSpec,
    /// The other end.
    pub to: StitchTo,
    /// Compliance [m/N]; default 0, rigid.
    #[serde(default)]
    pub compliance: Compliance,
    /// Force at which it breaks [N]; default inf, never.
    #[serde(default)]
    pub strength: Force,
    /// Energy that it stores when it breaks [J], by its compliance; default inf, never.
    #[serde(default = "unlimited")]
    pub toughness: Toughness,
}

const fn unlimited() -> Toughness {
    Toughness::of(f32::INFINITY)
}

/// A point of a body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub enum PointSpec {
    /// A vertex, by its index. Older files call it `Particle`.
    #[serde(alias = "Particle")]
    Vertex(VertexIndex),
    /// A point of a triangle: its corners, and their weights, which are normalized to a sum of 1.
    Triangle([VertexIndex; 3], [f32; 3]),
    /// The first vertices of each chain of a body of edges, each with a stitch of its own to a
    /// collider or another body; two clamp a rod.
    Roots(u32),
    /// All vertices in a box [m], at their initial positions, each with a stitch of its own to a
    /// collider or another body.
    Within {
        /// Minimum corner.
        low: Vec3,
        /// Maximum corner.
        high: Vec3,
    },
    /// All vertices of a named group of the body, each with a stitch of its own to a collider or another
    /// body.
    Group(GroupName),
}

/// The other end of a stitch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub enum StitchTo {
    /// Another point of the body; the two are pulled together.
    Point(PointSpec),
    /// A collider of the scene, by its number from 1, at the initial position of the point.
    Collider(u32),
    /// Another body, by its name, at the initial position of the point, which is in or on it.
    Body(String),
    /// A point of another body, by its name; the two are pulled together.
    BodyPoint(String, PointSpec),
}

/// A grid of copies.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Copies {
    /// Number along each axis.
    pub count: UVec3,
    /// Distance along each axis [m].
    pub spacing: Vec3,
}

/// A rigid collider.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ColliderSpec {
    /// Its shape.
    pub shape: ShapeSpec,
    /// Position [m].
    #[serde(default)]
    pub position: Vec3,
    /// Rotation: degrees about x, then y, then z.
    #[serde(default)]
    pub rotation: Vec3,
    /// Motion.
    #[serde(default)]
    pub path: Path,
    /// Color, as #rrggbb; defaults to pale gray.
    #[serde(default, alias = "colour")]
    pub color: Option<String>,
    /// Opacity, from 0 (clear glass) to 1 (the default); below 1 no shadow is cast.
    #[serde(default = "opaque")]
    pub opacity: f32,
}

const fn opaque() -> f32 {
    1.0
}

/// Shape of a collider.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub enum ShapeSpec {
    /// A ball.
    Sphere {
        /// Radius [m].
        radius: f32,
    },
    /// A box.
    Box {
        /// Full side lengths [m].
        size: Vec3,
    },
    /// A cylinder along y with hemispherical caps.
    Capsule {
        /// Radius [m].
        radius: f32,
        /// Length of the cylinder without the caps [m].
        length: f32,
    },
    /// The triangles of a mesh file, centered on their bounding box, or on that of the file of which
    /// they are a part.
    Mesh {
        /// Name of a built-in mesh, or path of a file relative to the scene file.
        file: String,
        /// Name of a part, by default the whole file, as that of a [body](MeshSpec::part).
        #[serde(default)]
        part: Option<String>,
        /// What `size` and the position of the collider refer to if there is a `part`.
        #[serde(default)]
        bounds: PartBounds,
        /// Length of the longest side of the bounds [m]; defaults to the file's numbers in meters.
        #[serde(default)]
        size: Option<f32>,
    },
    /// The surface of a generated mesh.
    Surface(Primitive),
}

/// Direction of the view: from an eye to a target. Their distance has no effect.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraSpec {
    /// The eye [m].
    pub eye: Vec3,
    /// Point that it looks at [m].
    pub target: Vec3,
}

/// A box in world space.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Minimum corner [m].
    pub low: Vec3,
    /// Maximum corner [m].
    pub high: Vec3,
}

impl BodySpec {
    /// An error in it.
    pub(super) fn wrong(&self, message: String) -> SceneError {
        SceneError::Body {
            body: self.name.clone(),
            message,
        }
    }

    /// Position of each copy: `position` is the center of the lowest layer of the grid.
    pub(super) fn places(&self) -> Vec<Vec3> {
        let Some(copies) = self.copies else {
            return vec![self.position];
        };
        let middle = Vec3::new(
            (copies.count.x - 1) as f32 / 2.0,
            0.0,
            (copies.count.z - 1) as f32 / 2.0,
        );
        let mut places = Vec::new();
        for y in 0..copies.count.y {
            for z in 0..copies.count.z {
                for x in 0..copies.count.x {
                    let cell = Vec3::new(x as f32, y as f32, z as f32) - middle;
                    places.push(self.position + cell * copies.spacing);
                }
            }
        }
        places
    }
}
