//! Builder for soft bodies with simple shapes: `SoftBody::cloth(size, cells).at(place).pinned([0,
//! 20]).build()`.

use super::{BodyDensity, Pins, SoftBody};
#[cfg(feature = "render")]
use crate::mesh::Skin;
use crate::{
    mesh::{Diagonals, MeshError, Primitive},
    solver::{
        Density, Group, GroupName, RestShape, Topology, TopologyError, VertexIndex,
        topology::Dimension,
    },
};
use bevy::prelude::*;
use bevy_math::curve::Curve;
use std::sync::Arc;

/// Default density of a solid [kg/m³], that of water.
const SOLID: Density = Density::of(1000.0);

/// Default density of a cloth [kg/m²].
const SHEET: Density = Density::of(0.3);

/// Default density of a rope [kg/m].
const LINE: Density = Density::of(0.1);

/// Minimum number of segments of a ring.
const MIN_RING: u32 = 3;

/// Distance of the ends of a closed curve, relative to the mean length of its segments.
const CLOSED: f32 = 1e-3;

/// Builder of a soft body. Starts with [`SoftBody::cuboid`] and similar functions and ends with
/// [`build`](Self::build), which returns the components of the body without effects.
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
/// # app.add_plugins((MinimalPlugins, pliant::SoftBodyPlugins::default()));
/// # app.add_systems(Startup, setup);
/// # app.update();
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SoftBodyBuilder {
    shape: RestShape,
    density: Option<Density>,
    pins: Vec<VertexIndex>,
    #[cfg(feature = "render")]
    skin: Option<Arc<Skin>>,
    /// For each vertex of the mesh that it was made from, the vertex of the skin or of the shape.
    #[cfg(feature = "render")]
    points: Vec<Option<u32>>,
}

impl SoftBody {
    /// A solid box with full side lengths [m], centered on the origin, with at least one cell along
    /// each axis.
    ///
    /// # Panics
    /// In the error cases of [`primitive`](Self::primitive).
    #[must_use]
    pub fn cuboid(size: Vec3, cells: UVec3) -> SoftBodyBuilder {
        of(&Primitive::Box { size, cells })
    }

    /// A solid ball with a radius [m] around the origin, with at least 4 cells across.
    ///
    /// # Panics
    /// In the error cases of [`primitive`](Self::primitive).
    #[must_use]
    pub fn sphere(radius: f32, cells: u32) -> SoftBodyBuilder {
        of(&Primitive::Sphere { radius, cells })
    }

    /// A horizontal cloth with an extent along x and z [m], centered on the origin. Vertices are in
    /// rows along x, the row with the smallest z first: the corners of the first row are vertices 0
    /// and `cells.x`.
    ///
    /// # Panics
    /// In the error cases of [`primitive`](Self::primitive).
    #[must_use]
    pub fn cloth(size: Vec2, cells: UVec2) -> SoftBodyBuilder {
        of(&Primitive::Cloth {
            size,
            cells,
            diagonals: Diagonals::default(),
            shear: false,
        })
    }

    /// A rope with a length [m] along x from vertex 0, centered on the origin.
    ///
    /// # Panics
    /// In the error cases of [`primitive`](Self::primitive).
    #[must_use]
    pub fn rope(length: f32, segments: u32) -> SoftBodyBuilder {
        of(&Primitive::Rope { length, segments })
    }

    /// A rope along a curve [m], with vertices at even steps of its parameter from vertex 0, and at
    /// least one segment. A closed curve becomes a ring of at least three segments: one whose ends are
    /// nearer to each other than a thousandth of the mean length of a segment. Its rest shape is
    /// curved: a [`Rod`](crate::effect::Rod) keeps it. A curve with an unbounded domain is an error
    /// of [`try_build`](SoftBodyBuilder::try_build).
    ///
    /// ```
    /// use bevy::prelude::*;
    /// use pliant::prelude::*;
    ///
    /// let points = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
    /// let curve = CubicBezier::new([points]).to_curve().expect("a segment");
    /// let (body, ..) = SoftBody::curve(&curve, 24).build();
    /// assert_eq!(body.particles(), 25);
    /// ```
    #[must_use]
    pub fn curve(curve: &impl Curve<Vec3>, segments: u32) -> SoftBodyBuilder {
        let domain = curve.domain();
        let along = |segments: u32| -> Vec<Vec3> {
            let place = |i: u32| {
                let part = i as f32 / segments as f32;
                curve.sample_clamped(domain.start() + part * (domain.end() - domain.start()))
            };
            (0..=segments).map(place).collect()
        };
        let mut vertices = along(segments.max(MIN_RING));
        let count = vertices.len() - 1;
        let length: f32 = vertices.windows(2).map(|it| it[0].distance(it[1])).sum();
        let is_closed = vertices[0].distance(vertices[count]) < CLOSED * length / count as f32;
        if is_closed {
            vertices.pop();
        } else if segments < MIN_RING {
            vertices = along(segments.max(1));
        }
        let count = vertices.len() as u32;
        let edges = if is_closed { count } else { count - 1 };
        let edges = (0..edges).map(|i| [i, (i + 1) % count]).collect();
        Self::shape(RestShape {
            vertices,
            edges,
            ..RestShape::default()
        })
    }

    /// Any primitive, with sizes that are not known at compile time.
    ///
    /// # Errors
    /// [`MeshError`] for a size or a number of cells that is out of range, and for too many
    /// particles.
    pub fn primitive(primitive: &Primitive) -> Result<SoftBodyBuilder, MeshError> {
        Ok(Self::shape(primitive.build()?.shape))
    }

    /// A custom shape [m].
    #[must_use]
    pub fn shape(shape: RestShape) -> SoftBodyBuilder {
        SoftBodyBuilder {
            shape,
            density: None,
            pins: Vec::new(),
            #[cfg(feature = "render")]
            skin: None,
            #[cfg(feature = "render")]
            points: Vec::new(),
        }
    }
}

/// For sizes that are constants in code.
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

    /// Sets the density in kg/m³, of a cloth in kg/m², of a rope in kg/m; by default 1000, 0.3 and
    /// 0.1.
    #[must_use]
    pub fn density(mut self, density: Density) -> Self {
        self.density = Some(density);
        self
    }

    /// Pins these vertices.
    #[must_use]
    pub fn pinned(mut self, vertices: impl IntoIterator<Item = u32>) -> Self {
        self.pins.extend(vertices.into_iter().map(VertexIndex));
        self
    }

    /// Names these vertices as a group, at most 32 of them, on which a
    /// [`ForceMask`](crate::effect::ForceMask) lets forces act.
    ///
    /// ```
    /// use bevy::prelude::*;
    /// use pliant::{effect::ForceMask, prelude::*};
    ///
    /// const TAIL: GroupName = GroupName::of("tail");
    ///
    /// fn setup(mut commands: Commands) {
    ///     let kite = SoftBody::cloth(Vec2::ONE, UVec2::splat(10)).group(TAIL, 0..11);
    ///     let mask = ForceMask { group: TAIL, ..default() };
    ///     commands.spawn((kite.build(), Stretch::default(), Wind::default(), mask));
    /// }
    /// # let mut app = App::new();
    /// # app.add_plugins((MinimalPlugins, pliant::SoftBodyPlugins::default()));
    /// # app.add_systems(Startup, setup);
    /// # app.update();
    /// ```
    #[must_use]
    pub fn group(mut self, name: GroupName, vertices: impl IntoIterator<Item = u32>) -> Self {
        let vertices = vertices.into_iter().collect();
        self.shape.groups.push(Group { name, vertices });
        self
    }

    /// Made from a mesh, whose vertices became these `points` of the fine surface that follows the
    /// shape, or of the shape without one.
    #[cfg(feature = "render")]
    pub(crate) fn of_mesh(mut self, skin: Option<Arc<Skin>>, points: Vec<Option<u32>>) -> Self {
        (self.skin, self.points) = (skin, points);
        self
    }

    /// The points that the vertices of its mesh became, and the triangles over them.
    #[cfg(feature = "render")]
    pub(crate) fn points_of_mesh(&self) -> (&[Option<u32>], &[[u32; 3]]) {
        let triangles = match &self.skin {
            Some(skin) => &skin.triangles,
            None => &self.shape.triangles,
        };
        (&self.points, triangles)
    }

    /// The fine surface, if there is one.
    #[cfg(feature = "render")]
    pub(crate) fn fine_surface(&self) -> Option<&Arc<Skin>> {
        self.skin.as_ref()
    }

    /// The components of the body. They include `Pins`: a bundle with them must not contain a
    /// second one, see [`pinned`](Self::pinned).
    ///
    /// # Panics
    /// If the shape is custom or has groups, and [`try_build`](Self::try_build) returns an error.
    #[must_use]
    pub fn build(self) -> (SoftBody, BodyDensity, Pins) {
        self.try_build().unwrap_or_else(|error| panic!("{error}"))
    }

    /// The components of the body, for a custom shape or groups that may be invalid.
    ///
    /// # Errors
    /// [`TopologyError`] for an empty shape, a coordinate that is not finite, an index out of range or
    /// repeated, or invalid groups.
    pub fn try_build(self) -> Result<(SoftBody, BodyDensity, Pins), TopologyError> {
        let topology = Topology::new(self.shape)?;
        let density = self.density.unwrap_or(match topology.dimension {
            Dimension::Solid | Dimension::Grains => SOLID,
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
