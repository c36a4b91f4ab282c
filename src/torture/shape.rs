//! The bodies of the robustness suite. All are 1 m long at scale 1.

use super::TortureError;
use crate::{
    mesh::{BuildOptions, Primitive, build},
    scene::asset,
    solver::{RestShape, topology::Dimension},
};
use glam::{UVec2, UVec3, Vec2, Vec3};
use std::fmt;

/// How a body is held together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Edges and volumes of tetrahedra.
    Tetrahedra,
    /// Edges of triangles.
    Cloth,
    /// Edges of a chain.
    Rope,
}

impl Kind {
    /// The kind of a user's body: grains count as solids.
    #[must_use]
    pub const fn of(dimension: Dimension) -> Self {
        match dimension {
            Dimension::Solid | Dimension::Grains => Self::Tetrahedra,
            Dimension::Sheet => Self::Cloth,
            Dimension::Line => Self::Rope,
        }
    }

    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Tetrahedra, Self::Cloth, Self::Rope];

    /// Its name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tetrahedra => "tetrahedra",
            Self::Cloth => "cloth",
            Self::Rope => "rope",
        }
    }

    /// The exponent with which mass grows with length.
    #[must_use]
    pub const fn dimensions(self) -> i32 {
        match self {
            Self::Tetrahedra => 3,
            Self::Cloth => 2,
            Self::Rope => 1,
        }
    }

    /// Density [kg/m³, kg/m², kg/m].
    #[must_use]
    pub const fn density(self) -> f32 {
        match self {
            Self::Tetrahedra => 1000.0,
            Self::Cloth => 0.2,
            Self::Rope => 0.1,
        }
    }
}

/// A shape; the number is the number of cells along its longest side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// A single tetrahedron: a corner of a cube.
    Tetrahedron,
    /// A single tetrahedron whose width is a hundred times its height.
    Sliver,
    /// A cube.
    Cube(u32),
    /// A ball.
    Ball(u32),
    /// A ring; the number is the number of cells across its tube.
    Ring(u32),
    /// A bar; the number is its ratio of length to thickness.
    Bar(u32),
    /// The coarse Stanford bunny.
    Bunny,
    /// A square cloth.
    Cloth(u32),
    /// A rope.
    Rope(u32),
    /// A rope with an overhand knot, not tightened.
    Knot,
    /// A user's body.
    Given(Kind),
}

impl Shape {
    /// How it is held together.
    #[must_use]
    pub const fn kind(self) -> Kind {
        match self {
            Self::Cloth(_) => Kind::Cloth,
            Self::Rope(_) | Self::Knot => Kind::Rope,
            Self::Given(kind) => kind,
            _ => Kind::Tetrahedra,
        }
    }

    /// Whether a quick run leaves it out: more than a few thousand constraints.
    #[must_use]
    pub const fn is_large(self) -> bool {
        match self {
            Self::Cube(cells) => cells > 5,
            Self::Ball(cells) => cells > 6,
            Self::Cloth(cells) => cells > 40,
            Self::Bunny => true,
            _ => false,
        }
    }

    /// Builds the shape with a length of `scale` meters.
    ///
    /// # Errors
    /// [`TortureError`] if the mesh rejects its size.
    pub fn build(self, scale: f32) -> Result<RestShape, TortureError> {
        let primitive = match self {
            Self::Tetrahedron => return Ok(tetrahedron(scale, 1.0)),
            Self::Sliver => return Ok(tetrahedron(scale, 0.01)),
            Self::Bunny => return built_in("bunny_coarse", scale),
            Self::Knot => return built_in("knot", scale),
            Self::Given(_) => return Ok(RestShape::default()),
            Self::Cube(cells) => Primitive::Box {
                size: Vec3::splat(scale),
                cells: UVec3::splat(cells),
            },
            Self::Ball(cells) => Primitive::Sphere {
                radius: scale / 2.0,
                cells,
            },
            Self::Ring(cells) => Primitive::Torus {
                major: 0.35 * scale,
                minor: 0.15 * scale,
                cells,
            },
            Self::Bar(cells) => Primitive::Box {
                size: Vec3::new(scale, scale / cells as f32, scale / cells as f32),
                cells: UVec3::new(cells, 1, 1),
            },
            Self::Cloth(cells) => Primitive::Cloth {
                size: Vec2::splat(scale),
                cells: UVec2::splat(cells),
                diagonals: Default::default(),
                shear: false,
            },
            Self::Rope(segments) => Primitive::Rope {
                length: scale,
                segments,
            },
        };
        Ok(primitive.build()?.shape)
    }
}

impl fmt::Display for Shape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tetrahedron => write!(f, "tetrahedron"),
            Self::Sliver => write!(f, "sliver"),
            Self::Cube(cells) => write!(f, "cube{cells}"),
            Self::Ball(cells) => write!(f, "ball{cells}"),
            Self::Ring(cells) => write!(f, "ring{cells}"),
            Self::Bar(cells) => write!(f, "bar{cells}"),
            Self::Bunny => write!(f, "bunny"),
            Self::Cloth(cells) => write!(f, "cloth{cells}"),
            Self::Rope(segments) => write!(f, "rope{segments}"),
            Self::Knot => write!(f, "knot"),
            Self::Given(_) => write!(f, "given"),
        }
    }
}

fn built_in(name: &str, scale: f32) -> Result<RestShape, TortureError> {
    let options = BuildOptions {
        size: Some(scale),
        ..BuildOptions::default()
    };
    Ok(build(asset::load(name)?, &options)?.shape)
}

/// Corners at 0 and along x, y, z; the last at a distance of `height` times the side.
fn tetrahedron(side: f32, height: f32) -> RestShape {
    RestShape {
        vertices: vec![
            Vec3::ZERO,
            Vec3::X * side,
            Vec3::Y * side,
            Vec3::Z * (side * height),
        ],
        edges: vec![[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]],
        tetrahedra: vec![[0, 1, 2, 3]],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        ..RestShape::default()
    }
}
