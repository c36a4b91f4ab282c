//! Primitive bodies: parameters and validation.
//!
//! The shapes are built in [`solid`] and [`sheet`]. This module has their parameters and
//! ranges. All shapes are centered on the origin,
//! but for a tree, which begins there.

use glam::{UVec2, UVec3, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::{
    MeshError, SoftMesh, Strands,
    limits::{count, limit, particles, product, range, sizes},
};

mod grains;
mod hair;
mod sheet;
mod solid;
mod tree;

/// Maximum `minor` over `major`; beyond it the inner side of the tube has no space for cells.
const FATTEST_TORUS: f32 = 0.95;

/// A parametric shape. Sizes are in meters, from 1e-7 to 1e7.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub enum Primitive {
    /// A solid box. Each cell has five tetrahedra, mirrored from cell to cell to avoid a preferred
    /// direction.
    Box {
        /// Sides [m].
        size: Vec3,
        /// Cells along each side, from 1; 6 each by default.
        #[serde(default = "defaults::solid_box")]
        cells: UVec3,
    },
    /// A solid ball.
    Sphere {
        /// Radius [m].
        radius: f32,
        /// Cells across the diameter, from 4; 8 by default.
        #[serde(default = "defaults::sphere")]
        cells: u32,
    },
    /// A solid ring around the y axis.
    Torus {
        /// Distance from the axis to the center of the tube [m].
        major: f32,
        /// Radius of the tube [m], at most 0.95 × `major`.
        minor: f32,
        /// Cells across the tube, from 2; default 6. Odd numbers are rounded up to even.
        #[serde(default = "defaults::torus")]
        cells: u32,
    },
    /// A solid cylinder around the y axis.
    Cylinder {
        /// Radius [m].
        radius: f32,
        /// Height along y [m].
        height: f32,
        /// Cells across the diameter, from 2; default 8. Odd numbers are rounded up to even.
        #[serde(default = "defaults::cylinder")]
        cells: u32,
    },
    /// A rectangular cloth in the plane y = 0. Particles are in rows along x, the row with the
    /// smallest z first, so the corners of the first row are particles 0 and `cells.x`.
    Cloth {
        /// Extent along x and z [m].
        size: Vec2,
        /// Cells along x and z, from 1; 20 each by default.
        #[serde(default = "defaults::cloth")]
        cells: UVec2,
        /// Split of the cells into triangles.
        #[serde(default)]
        diagonals: Diagonals,
        /// Whether cells have an edge along both diagonals, or only along that of their triangles
        /// (default).
        #[serde(default)]
        shear: bool,
    },
    /// A hollow ball of cloth: a subdivided icosahedron projected onto the sphere, with nearly
    /// equilateral triangles. It is closed and faces outwards.
    Balloon {
        /// Radius [m].
        radius: f32,
        /// Subdivisions of each edge of the icosahedron, from 1; default 8, 642 particles.
        #[serde(default = "defaults::balloon")]
        cells: u32,
    },
    /// An open tube of cloth around the y axis. Particles are in rings, the lowest first; in a ring
    /// they begin at the largest x and turn toward the smallest z.
    Tube {
        /// Radius [m].
        radius: f32,
        /// Height along y [m].
        height: f32,
        /// Cells around the axis, from 3, and along it, from 1; 24 and 12 by default.
        #[serde(default = "defaults::tube")]
        cells: UVec2,
    },
    /// A rope along x, a chain of edges without surface. The particle with the smallest x is
    /// particle 0.
    Rope {
        /// Length [m].
        length: f32,
        /// Edges, from 1; 32 by default.
        #[serde(default = "defaults::rope")]
        segments: u32,
    },
    /// Loose balls that fill a box, a cylinder about y or a ball, in a lattice with small gaps. They
    /// are rows along x, the lowest layer first.
    Grains {
        /// Extent of the filled region [m].
        size: Vec3,
        /// Form of the region; a box by default.
        #[serde(default)]
        region: GrainRegion,
        /// Radius of a grain [m].
        radius: f32,
        /// Variation of the radius: grains have radii from `radius` × (1 − variation) to `radius`,
        /// from 0 to 0.9; default 0.2. Equal grains pile up like a crystal.
        #[serde(default = "defaults::variation")]
        variation: f32,
    },
    /// A helix about y, downwards from vertex 0: a chain of edges without surface.
    Coil {
        /// Radius of the helix [m].
        radius: f32,
        /// Height along y [m].
        height: f32,
        /// Number of turns, from 1/8 to 1e4; 6 by default.
        #[serde(default = "defaults::turns")]
        turns: f32,
        /// Edges, from 1; 96 by default. Sixteen or more per turn follow the helix closely.
        #[serde(default = "defaults::coil")]
        segments: u32,
    },
    /// A ring of edges without surface, upright in the plane z = 0. Vertices begin at the largest x
    /// and turn toward the largest y.
    Hoop {
        /// Radius [m].
        radius: f32,
        /// Edges, from 3; 48 by default.
        #[serde(default = "defaults::hoop")]
        segments: u32,
    },
    /// A tree of edges without surface. Its trunk goes up from vertex 0, at the origin; the end of
    /// each branch forks.
    Tree {
        /// Length of the trunk [m].
        trunk: f32,
        /// Branches at a fork, from 1; 3 by default.
        #[serde(default = "defaults::forks")]
        forks: u32,
        /// How often branches fork between the trunk and a tip, from 0 to 20; 3 by default.
        #[serde(default = "defaults::levels")]
        levels: u32,
        /// Angle between a branch and those that leave it, from 0 to 120°; 35° by default.
        #[serde(default = "defaults::spread")]
        spread: f32,
        /// Length of a branch as a fraction of that which it leaves, from 0.1 to 1; 0.75 by
        /// default.
        #[serde(default = "defaults::shrink")]
        shrink: f32,
        /// Edges of the trunk and of each branch, from 1; 6 by default.
        #[serde(default = "defaults::branch")]
        segments: u32,
    },
    /// Strands of hair on the upper part of a ball, as many chains of edges in one body. Roots cover
    /// the ball evenly; vertices are numbered strand by strand, from root to tip. On other surfaces:
    /// [`Strands`].
    Hair {
        /// Radius of the ball [m].
        radius: f32,
        /// Largest angle of a root from the top, above 0 to 180°; 90° by default.
        #[serde(default = "defaults::coverage")]
        coverage: f32,
        /// Number of strands, from 1; 100 by default.
        #[serde(default = "defaults::strands")]
        strands: u32,
        /// Length of a strand along its axis [m].
        length: f32,
        /// Segments of a strand, from 1; 16 by default.
        #[serde(default = "defaults::strand")]
        segments: u32,
        /// Radius of the curls [m], from 0; 0 by default.
        #[serde(default)]
        curl: f32,
        /// Turns of a curl, from 0 to 1e3; 3 by default.
        #[serde(default = "defaults::curl_turns")]
        turns: f32,
    },
}

/// Region that is filled with grains.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub enum GrainRegion {
    /// The whole box.
    #[default]
    Box,
    /// The elliptic cylinder about y in the box.
    Cylinder,
    /// The ellipsoid in the box.
    Ball,
}

/// Split of the cells of a cloth into triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Diagonals {
    /// Mirrored from cell to cell, without a preferred direction.
    #[default]
    Alternating,
    /// The same diagonal in all cells.
    OneWay,
}

mod defaults {
    use glam::{UVec2, UVec3};

    pub fn solid_box() -> UVec3 {
        UVec3::splat(6)
    }
    pub fn sphere() -> u32 {
        8
    }
    pub fn torus() -> u32 {
        6
    }
    pub fn cylinder() -> u32 {
        8
    }
    pub fn cloth() -> UVec2 {
        UVec2::splat(20)
    }
    pub fn tube() -> UVec2 {
        UVec2::new(24, 12)
    }
    pub fn balloon() -> u32 {
        8
    }
    pub fn rope() -> u32 {
        32
    }
    pub fn variation() -> f32 {
        0.2
    }
    pub fn turns() -> f32 {
        6.0
    }
    pub fn coil() -> u32 {
        96
    }
    pub fn hoop() -> u32 {
        48
    }
    pub fn forks() -> u32 {
        3
    }
    pub fn levels() -> u32 {
        3
    }
    pub fn spread() -> f32 {
        35.0
    }
    pub fn shrink() -> f32 {
        0.75
    }
    pub fn branch() -> u32 {
        6
    }
    pub fn coverage() -> f32 {
        90.0
    }
    pub fn strands() -> u32 {
        100
    }
    pub fn strand() -> u32 {
        16
    }
    pub fn curl_turns() -> f32 {
        3.0
    }
}

impl Primitive {
    /// Builds the shape.
    ///
    /// # Errors
    /// [`MeshError::Parameter`] if a size or a number of cells is out of its range,
    /// [`MeshError::TooLarge`] beyond [`MAX_TETRAHEDRA`](crate::MAX_TETRAHEDRA) or [`MAX_PARTICLES`](crate::MAX_PARTICLES); checked before
    /// anything is allocated.
    pub fn build(&self) -> Result<SoftMesh, MeshError> {
        let shape = match *self {
            Self::Box { size, cells } => {
                sizes([("size.x", size.x), ("size.y", size.y), ("size.z", size.z)])?;
                count("cells", cells.min_element(), 1)?;
                limit(product(&[5, cells.x, cells.y, cells.z]))?;
                solid::cuboid(size, cells)
            }
            Self::Sphere { radius, cells } => {
                sizes([("radius", radius)])?;
                count("cells", cells, 4)?;
                // A cube of the lattice has twelve tetrahedra, and the ball fills π/6 of its
                // bounding box.
                limit(product(&[6, cells, cells, cells]))?;
                solid::sphere(radius, cells)?
            }
            Self::Torus {
                major,
                minor,
                cells,
            } => {
                sizes([("major", major), ("minor", minor)])?;
                if minor > FATTEST_TORUS * major {
                    let expected = format!("at most 0.95 of the major radius ({major} m)");
                    return Err(MeshError::parameter("minor", minor, expected));
                }
                count("cells", cells, 2)?;
                limit(solid::torus_tetrahedra(major, minor, cells))?;
                solid::torus(major, minor, cells)
            }
            Self::Cylinder {
                radius,
                height,
                cells,
            } => {
                sizes([("radius", radius), ("height", height)])?;
                count("cells", cells, 2)?;
                limit(solid::cylinder_tetrahedra(radius, height, cells))?;
                solid::cylinder(radius, height, cells)
            }
            Self::Cloth {
                size,
                cells,
                diagonals,
                shear,
            } => {
                sizes([("size.x", size.x), ("size.y", size.y)])?;
                count("cells", cells.min_element(), 1)?;
                particles(product(&[
                    cells.x.saturating_add(1),
                    cells.y.saturating_add(1),
                ]))?;
                sheet::cloth(size, cells, diagonals, shear)
            }
            Self::Balloon { radius, cells } => {
                sizes([("radius", radius)])?;
                count("cells", cells, 1)?;
                particles(product(&[10, cells, cells]).saturating_add(2))?;
                sheet::balloon(radius, cells)
            }
            Self::Tube {
                radius,
                height,
                cells,
            } => {
                sizes([("radius", radius), ("height", height)])?;
                count("cells.x", cells.x, 3)?;
                count("cells.y", cells.y, 1)?;
                particles(product(&[cells.x, cells.y.saturating_add(1)]))?;
                sheet::tube(radius, height, cells)
            }
            Self::Rope { length, segments } => {
                sizes([("length", length)])?;
                count("segments", segments, 1)?;
                particles(u64::from(segments) + 1)?;
                sheet::rope(length, segments)
            }
            Self::Grains {
                size,
                region,
                radius,
                variation,
            } => {
                sizes([("size.x", size.x), ("size.y", size.y), ("size.z", size.z)])?;
                sizes([("radius", radius)])?;
                let valid = (0.0..=0.9).contains(&variation);
                range("variation", variation, valid, "a number from 0 to 0.9")?;
                particles(grains::largest_count(size, radius))?;
                grains::fill(size, region, radius, variation)?
            }
            Self::Coil {
                radius,
                height,
                turns,
                segments,
            } => {
                sizes([("radius", radius), ("height", height)])?;
                count("segments", segments, 1)?;
                particles(u64::from(segments) + 1)?;
                let valid = (0.125..=1e4).contains(&turns);
                range("turns", turns, valid, "a number from 0.125 to 10000")?;
                sheet::coil(radius, height, turns, segments)
            }
            Self::Hoop { radius, segments } => {
                sizes([("radius", radius)])?;
                count("segments", segments, 3)?;
                particles(u64::from(segments))?;
                sheet::hoop(radius, segments)
            }
            Self::Tree {
                trunk,
                forks,
                levels,
                spread,
                shrink,
                segments,
            } => {
                sizes([("trunk", trunk)])?;
                count("forks", forks, 1)?;
                count("segments", segments, 1)?;
                range(
                    "levels",
                    levels,
                    levels <= 20,
                    "a whole number from 0 to 20",
                )?;
                let valid = (0.0..=120.0).contains(&spread);
                range("spread", spread, valid, "a number from 0 to 120")?;
                let valid = (0.1..=1.0).contains(&shrink);
                range("shrink", shrink, valid, "a number from 0.1 to 1")?;
                let tree = tree::Tree {
                    trunk,
                    forks,
                    levels,
                    spread,
                    shrink,
                    segments,
                };
                particles(tree.vertices())?;
                tree.grow()
            }
            Self::Hair {
                radius,
                coverage,
                strands,
                length,
                segments,
                curl,
                turns,
            } => {
                sizes([("radius", radius)])?;
                let strands = Strands {
                    count: strands,
                    length,
                    segments,
                    curl,
                    turns,
                    coverage,
                    offset: 0.0,
                };
                strands.check("strands")?;
                hair::grow(radius, &strands)
            }
        };
        Ok(SoftMesh {
            shape,
            ..SoftMesh::default()
        })
    }
}
