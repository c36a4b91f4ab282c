//! Soft bodies of simple shapes, in a line: `SoftBody::cloth(size, cells).at(place).pinned([0, 20]).build()`.

use super::{BodyDensity, Pins, SoftBody};
use crate::{
    mesh::{Diagonals, MeshError, Primitive},
    solver::{Density, RestShape, Topology, TopologyError, VertexIndex, topology::Dimension},
};
use bevy::prelude::*;
use std::sync::Arc;

/// Density of a solid unless another is given [kg/m³], that of water.
const SOLID: Density = Density::of(1000.0);

/// Density of a cloth [kg/m²].
const SHEET: Density = Density::of(0.3);

/// Density of a rope [kg/m].
const LINE: Density = Density::of(0.1);

/// A soft body that is being made. It begins with [`SoftBody::cuboid`] and the like and ends with [`build`](Self::build),
/// which gives the components of the body without effects.
///
/// ```
/// use bevy::prelude::*;
/// use pliant::prelude::*;
///
/// fn setup(mut commands: Commands) {
///     let cube = SoftBody::cuboid(Vec3::ONE, UVec3::splat(5)).at(Vec3::Y * 2.0);
///     let soft = Stretch {
///         compliance: Compliance::of(1e-4), // m/N
///         ..default()
///     };
///     commands.spawn((cube.build(), soft, Volume::default(), Ground::default()));
/// }
/// # let mut app = App::new();
/// # app.add_plugins((MinimalPlugins, pliant::SoftBodyPlugins::default())).add_systems(Startup, setup);
/// # app.update();
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SoftBodyBuilder {
    shape: RestShape,
    density: Option<Density>,
    pins: Vec<VertexIndex>,
}

impl SoftBody {
    /// A solid box of full side lengths [m], centered on the origin, with at least one cell along each.
    ///
    /// # Panics
    /// As [`primitive`](Self::primitive) has errors.
    #[must_use]
    pub fn cuboid(size: Vec3, cells: UVec3) -> SoftBodyBuilder {
        of(&Primitive::Box { size, cells })
    }

    /// A solid ball of a radius [m] around the origin, with at least 4 cells across.
    ///
    /// # Panics
    /// As [`primitive`](Self::primitive) has errors.
    #[must_use]
    pub fn sphere(radius: f32, cells: u32) -> SoftBodyBuilder {
        of(&Primitive::Sphere { radius, cells })
    }

    /// A level cloth of an extent along x and z [m], centered on the origin. Vertices are in rows along x, the row with
    /// the smallest z first: the corners of the first row are vertices 0 and `cells.x`.
    ///
    /// # Panics
    /// As [`primitive`](Self::primitive) has errors.
    #[must_use]
    pub fn cloth(size: Vec2, cells: UVec2) -> SoftBodyBuilder {
        of(&Primitive::Cloth {
            size,
            cells,
            diagonals: Diagonals::default(),
            shear: false,
        })
    }

    /// A rope of a length [m] along x from vertex 0, centered on the origin.
    ///
    /// # Panics
    /// As [`primitive`](Self::primitive) has errors.
    #[must_use]
    pub fn rope(length: f32, segments: u32) -> SoftBodyBuilder {
        of(&Primitive::Rope { length, segments })
    }

    /// Any primitive, of sizes that come from outside.
    ///
    /// # Errors
    /// [`MeshError`] for a size or a number of cells that is out of range, and for too many particles.
    pub fn primitive(primitive: &Primitive) -> Result<SoftBodyBuilder, MeshError> {
        Ok(Self::shape(primitive.build()?.shape))
    }

    /// A shape of one's own [m].
    #[must_use]
    pub fn shape(shape: RestShape) -> SoftBodyBuilder {
        SoftBodyBuilder {
            shape,
            density: None,
            pins: Vec::new(),
        }
    }
}

/// Sizes that are written in code.
fn of(primitive: &Primitive) -> SoftBodyBuilder {
    SoftBody::primitive(primitive).unwrap_or_else(|error| panic!("{error}"))
}

impl SoftBodyBuilder {
    /// Moved by `offset` [m].
    #[must_use]
    pub fn at(mut self, offset: Vec3) -> Self {
        for vertex in &mut self.shape.vertices {
            *vertex += offset;
        }
        self
    }

    /// Rotated about the origin.
    #[must_use]
    pub fn rotated(mut self, rotation: Quat) -> Self {
        for vertex in &mut self.shape.vertices {
            *vertex = rotation * *vertex;
        }
        self
    }

    /// Of a density in kg/m³, of a cloth in kg/m², of a rope in kg/m; by default 1000, 0.3 and 0.1.
    #[must_use]
    pub fn density(mut self, density: Density) -> Self {
        self.density = Some(density);
        self
    }

    /// With these vertices pinned.
    #[must_use]
    pub fn pinned(mut self, vertices: impl IntoIterator<Item = u32>) -> Self {
        self.pins.extend(vertices.into_iter().map(VertexIndex));
        self
    }

    /// The components of the body: a `Pins` beside it in a bundle would be a second one, see [`pinned`](Self::pinned).
    ///
    /// # Panics
    /// If it is a shape of one's own in which [`try_build`](Self::try_build) finds an error.
    #[must_use]
    pub fn build(self) -> (SoftBody, BodyDensity, Pins) {
        self.try_build().unwrap_or_else(|error| panic!("{error}"))
    }

    /// The components of the body, of a shape that comes from outside.
    ///
    /// # Errors
    /// [`TopologyError`] for an empty shape, a coordinate that is not finite, or an index out of range or repeated.
    pub fn try_build(self) -> Result<(SoftBody, BodyDensity, Pins), TopologyError> {
        let topology = Topology::new(self.shape)?;
        let density = self.density.unwrap_or(match topology.dimension {
            Dimension::Solid => SOLID,
            Dimension::Sheet => SHEET,
            Dimension::Line => LINE,
        });
        Ok((
            SoftBody(Arc::new(topology)),
            BodyDensity(density),
            Pins(self.pins),
        ))
    }
}
