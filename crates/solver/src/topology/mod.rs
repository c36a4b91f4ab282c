//! The immutable part of a body: rest shape, constraints with their rest values, and surface.
//!
//! Shared by all copies of a body through an `Arc`; a body whose rest values
//! [flow](crate::Plasticity) has its own. Particles keep the order of the input. Constraints are
//! sorted by color, an order that allows parallel execution and is stable (on rigid cloth,
//! Gauss–Seidel in an order sorted by vertex diverges). Rest values are rounded like the values
//! that the solver compares with them, so that a body in its rest shape does not move at all.

pub mod coloring;
pub mod edges;
pub mod enclosure;
mod flow;
pub mod partitions;
mod parts;
mod renewal;
pub mod tetrahedra;

pub mod facets;
pub mod frames;
pub mod hinges;
mod id;
mod index;
pub mod numbering;
pub mod order;
pub mod regions;
mod rest_shape;
mod struts;
pub mod surface;
pub mod tear;

pub use edges::Edges;
pub use enclosure::{Enclosure, NotClosed};
pub use facets::Facets;
pub use flow::RestValues;
pub use frames::Frames;
pub use hinges::{Cotangents, Hinges};
pub use id::{Identity, TopologyId};
pub use index::{ParticleIndex, VertexIndex};
pub use regions::Regions;
pub use renewal::{Birth, Renewal, Renewed};
pub use rest_shape::RestShape;
pub use surface::Surface;
pub use tear::{Tearing, Torn, TornOrder};
pub use tetrahedra::Tetrahedra;

use crate::{
    numbering::Numbering,
    partitions::{MIN_CUT, Partitions},
};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::sync::{Arc, OnceLock};

/// Kind of elements that carry the mass of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    /// Tetrahedra: density in kg/m³.
    Solid,
    /// Triangles: density in kg/m².
    Sheet,
    /// Edges: density in kg/m.
    Line,
    /// Balls of given radii: density in kg/m³.
    Grains,
}

/// Elements of the input that were left out, by reason.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeftOut {
    /// Tetrahedra without volume.
    pub flat_tetrahedra: usize,
    /// Repeated edges.
    pub repeated_edges: usize,
    /// Edges of a solid to a vertex without a valid tetrahedron. Such a vertex has no mass, and
    /// would fix the body like a pin.
    pub massless_edges: usize,
    /// Vertices without elements; they have no mass and never move.
    pub unused_vertices: usize,
}

/// The immutable part of a body. Copies share all but the rest values that can
/// [flow](crate::Plasticity).
#[derive(Debug, Clone, PartialEq)]
pub struct Topology {
    /// Rest positions [m].
    pub rest: Arc<[Vec3]>,
    /// Mapping of particles to the vertices of the input. Pins, added masses and everything that
    /// users see refer to vertices; everything else here refers to particles.
    pub numbering: Arc<Numbering>,
    /// Partitions of the particles.
    pub partitions: Arc<Partitions>,
    /// Edges, for stretch.
    pub edges: Edges,
    /// Tetrahedra, for volume.
    pub tetrahedra: Tetrahedra,
    /// The coarse surface: outward triangles; none for a rope.
    pub triangles: Arc<[[u32; 3]]>,
    /// Radius of each particle [m]; empty unless they are grains.
    pub radii: Arc<[f32]>,
    /// Kind of elements that carry the mass of the body.
    pub dimension: Dimension,
    /// Longest side of the bounding box at rest [m].
    pub size: f32,
    /// Omissions from the input.
    pub left_out: LeftOut,
    /// Hinges of the surface, for bending; computed on first use.
    hinges: Lazy<Hinges>,
    /// Data for the quadratic bending energy of the hinges; computed on first use.
    cotangents: Lazy<Cotangents>,
    /// Triangles of the surface, for membranes; computed on first use.
    facets: Lazy<Arc<Facets>>,
    /// Rest frames of the tetrahedra; computed on first use.
    frames: Lazy<Arc<Frames>>,
    /// Struts from surface to surface; computed on first use.
    struts: Lazy<Arc<Edges>>,
    /// The surface that can touch, computed on first use.
    surface: Lazy<Arc<Surface>>,
    /// Volume enclosed by the surface, for pressure, or the reason why there is none.
    enclosure: Lazy<Arc<Result<Enclosure, NotClosed>>>,
    /// Number of times a particle was split. The order of the constraints of a torn topology depends
    /// on its past.
    splits: u32,
    /// Whether grains have appeared or disappeared.
    is_renewed: bool,
    /// The topology before plastic flow.
    original: Option<Arc<Topology>>,
    identity: Identity,
}

/// A derived part, computed on first use; ignored in comparisons of topologies.
#[derive(Debug, Clone)]
struct Lazy<T>(OnceLock<T>);

impl<T> Default for Lazy<T> {
    fn default() -> Self {
        Self(OnceLock::new())
    }
}

impl<T> PartialEq for Lazy<T> {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// Reason why a rest shape cannot become a body.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TopologyError {
    /// The shape has no vertices.
    #[error("the shape has no vertices; expected at least one")]
    Empty,
    /// The number of vertices exceeds a 32-bit index.
    #[error("the shape has {0} vertices, but at most {max} are supported", max = u32::MAX)]
    TooMany(usize),
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} is at {position}, but every coordinate must be finite")]
    NotFinite {
        /// Index of the vertex.
        vertex: usize,
        /// Its position.
        position: Vec3,
    },
    /// An element refers to a vertex that does not exist.
    #[error("{element} {index} refers to vertex {vertex}; expected 0 to {last}", last = vertices - 1)]
    NoSuchVertex {
        /// Kind of element.
        element: &'static str,
        /// Index of the element.
        index: usize,
        /// The invalid index.
        vertex: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// The numbering belongs to a different shape.
    #[error("the numbering has {particles} particles, but the shape has {vertices} vertices")]
    Numbering {
        /// Number of particles in the numbering.
        particles: usize,
        /// Number of vertices of the shape.
        vertices: usize,
    },
    /// The radii of grains do not fit the shape.
    #[error("the shape has {radii} radii and {vertices} vertices; expected one each, or none")]
    Radii {
        /// Number of radii.
        radii: usize,
        /// Number of vertices.
        vertices: usize,
    },
    /// The radius of a grain is not a positive number.
    #[error("vertex {vertex} has the radius {radius}; expected 1e-6 to 1e3 m")]
    Radius {
        /// Index of the vertex.
        vertex: usize,
        /// Its radius.
        radius: f32,
    },
    /// A shape of grains has elements.
    #[error("the shape has radii and {0} elements; grains have no edges, triangles or tetrahedra")]
    GrainsWithElements(usize),
    /// An element refers to a vertex twice.
    #[error("{element} {index} refers to vertex {vertex} more than once")]
    RepeatedVertex {
        /// Kind of element.
        element: &'static str,
        /// Index of the element.
        index: usize,
        /// The repeated vertex.
        vertex: u32,
    },
}

/// A tetrahedron is flat if its volume is below this fraction of the cube of its longest edge: it
/// is then within the rounding of its coordinates.
const FLAT: f64 = 1e-7;

impl Topology {
    /// Validates a rest shape and precomputes the data for the solver.
    ///
    /// # Errors
    /// [`TopologyError`] for an empty shape, a coordinate that is not finite, or an element with
    /// an index out of range or repeated.
    pub fn new(shape: RestShape) -> Result<Self, TopologyError> {
        Self::with(shape, |count, ends, corners| {
            Arc::new(if count < MIN_CUT {
                Numbering::default()
            } else {
                Numbering::new(count, ends, corners)
            })
        })
    }

    /// The same with a given numbering of the particles. With [`Self::rest_shape`] and the
    /// numbering of a topology it creates an equal one, except for the record of omissions.
    ///
    /// # Errors
    /// As [`Self::new`], and [`TopologyError::Numbering`] if the numbering has a different number
    /// of vertices.
    pub fn numbered(
        shape: RestShape,
        numbering: impl Into<Arc<Numbering>>,
    ) -> Result<Self, TopologyError> {
        let numbering = numbering.into();
        let vertices = shape.vertices.len();
        match numbering.len() {
            Some(particles) if particles != vertices => Err(TopologyError::Numbering {
                particles,
                vertices,
            }),
            _ => Self::with(shape, |_, _, _| numbering),
        }
    }

    fn with(
        shape: RestShape,
        number: impl FnOnce(usize, &[[u32; 2]], &[[u32; 4]]) -> Arc<Numbering>,
    ) -> Result<Self, TopologyError> {
        check_vertices(&shape.vertices)?;
        let count = shape.vertices.len();
        check_elements("edge", &shape.edges, count)?;
        check_elements("tetrahedron", &shape.tetrahedra, count)?;
        check_elements("triangle", &shape.triangles, count)?;
        check_radii(&shape)?;

        let (mut ends, repeated_edges) = without_repeats(shape.edges);
        let (mut corners, mut triangles) = (shape.tetrahedra, shape.triangles);
        let mut rest = shape.vertices;
        let mut radii = shape.radii;
        let numbering = number(count, &ends, &corners);
        renumber(
            &numbering,
            &mut rest,
            &mut ends,
            &mut corners,
            &mut triangles,
        );
        if !radii.is_empty() {
            let given = std::mem::take(&mut radii);
            let particles = 0..given.len() as u32;
            let vertex = |particle| numbering.vertex(ParticleIndex(particle)).index();
            radii.extend(particles.map(|particle| given[vertex(particle)]));
        }
        let at = |i: u32| rest[i as usize].as_dvec3();
        let (corners, flat_tetrahedra) = without_flat(corners, at);
        let dimension = if !radii.is_empty() {
            Dimension::Grains
        } else if !corners.is_empty() {
            Dimension::Solid
        } else if !triangles.is_empty() {
            Dimension::Sheet
        } else {
            Dimension::Line
        };
        let before = ends.len();
        if dimension == Dimension::Solid {
            let mut has_mass = vec![false; count];
            for &i in corners.iter().flatten() {
                has_mass[i as usize] = true;
            }
            ends.retain(|edge| edge.iter().all(|&i| has_mass[i as usize]));
        }
        let massless_edges = before - ends.len();
        let mut used = vec![!radii.is_empty(); count];
        for &i in ends.iter().flatten().chain(corners.iter().flatten()) {
            used[i as usize] = true;
        }
        for &i in triangles.iter().flatten() {
            used[i as usize] = true;
        }
        let left_out = LeftOut {
            flat_tetrahedra,
            repeated_edges,
            massless_edges,
            unused_vertices: used.iter().filter(|&&used| !used).count(),
        };

        let (low, high) = bounds(rest.iter().copied());
        let diameter = 2.0 * radii.iter().copied().fold(0.0, f32::max);
        let partitions = Partitions::cut(count, reaches(&ends).chain(reaches(&corners)));
        let is_sheet = dimension == Dimension::Sheet;
        Ok(Self {
            edges: Edges::new(&ends, &rest, &partitions, is_sheet),
            tetrahedra: Tetrahedra::new(&corners, &rest, &partitions),
            partitions: Arc::new(partitions),
            triangles: triangles.into(),
            radii: radii.into(),
            numbering,
            dimension,
            size: (high - low).max_element() + diameter,
            left_out,
            rest: rest.into(),
            hinges: Lazy::default(),
            cotangents: Lazy::default(),
            facets: Lazy::default(),
            frames: Lazy::default(),
            struts: Lazy::default(),
            surface: Lazy::default(),
            enclosure: Lazy::default(),
            splits: 0,
            is_renewed: false,
            original: None,
            identity: Identity::default(),
        })
    }

    /// Memory use of the lazily computed parts in bytes.
    pub(crate) fn lazy_bytes(&self) -> usize {
        self.hinges.0.get().map_or(0, Hinges::bytes)
            + self.cotangents.0.get().map_or(0, Cotangents::bytes)
            + self.facets.0.get().map_or(0, |it| it.bytes())
            + self.frames.0.get().map_or(0, |it| it.bytes())
            + self.struts.0.get().map_or(0, |it| it.bytes())
    }

    /// Input of the topology without omissions: vertices in their original order, and elements in
    /// solver order.
    ///
    /// Unless the topology was torn, coloring these again assigns each element the same color: elements with the same lowest
    /// particle have different colors, and each finds the lower ones taken as before.
    #[must_use]
    pub fn rest_shape(&self) -> RestShape {
        let vertex = |particle: u32| self.numbering.vertex(ParticleIndex(particle)).0;
        let vertices_in_order = (0..self.rest.len() as u32).map(VertexIndex);
        RestShape {
            vertices: vertices_in_order
                .clone()
                .map(|vertex| self.rest[self.numbering.particle(vertex).index()])
                .collect(),
            edges: self.edges.ends().map(|ends| ends.map(vertex)).collect(),
            tetrahedra: self
                .tetrahedra
                .corners()
                .map(|corners| corners.map(vertex))
                .collect(),
            triangles: self
                .triangles
                .iter()
                .map(|corners| corners.map(vertex))
                .collect(),
            radii: match self.radii.is_empty() {
                true => Vec::new(),
                false => vertices_in_order
                    .map(|vertex| self.radii[self.numbering.particle(vertex).index()])
                    .collect(),
            },
        }
    }

    /// Part of the body's measure that belongs to each particle [m³, m² or m by `dimension`].
    ///
    /// Measures are added, so that a particle's mass is the sum of its parts of the masses of its
    /// elements. (Adding inverse masses instead would make a particle lighter the more elements it
    /// has.)
    #[must_use]
    pub fn measure(&self) -> Vec<f32> {
        let at = |i: u32| self.rest[i as usize].as_dvec3();
        let mut measure = vec![0.0_f64; self.rest.len()];
        let mut distribute = |corners: &[u32], total: f64| {
            for &corner in corners {
                measure[corner as usize] += total / corners.len() as f64;
            }
        };
        match self.dimension {
            Dimension::Solid => {
                for corners in self.tetrahedra.corners() {
                    distribute(&corners, volume(corners.map(at)).abs());
                }
            }
            Dimension::Sheet => {
                for corners in self.triangles.iter() {
                    let [a, b, c] = corners.map(at);
                    distribute(corners, (b - a).cross(c - a).length() / 2.0);
                }
            }
            Dimension::Line => {
                for corners in self.edges.ends() {
                    let [a, b] = corners.map(at);
                    distribute(&corners, a.distance(b));
                }
            }
            Dimension::Grains => {
                for (measure, &radius) in measure.iter_mut().zip(&*self.radii) {
                    let radius = f64::from(radius);
                    *measure = 4.0 / 3.0 * core::f64::consts::PI * radius * radius * radius;
                }
            }
        }
        measure.iter().map(|&m| m as f32).collect()
    }

    /// Radius of a particle [m]: 0 unless it is a grain.
    #[must_use]
    pub fn radius(&self, particle: usize) -> f32 {
        self.radii.get(particle).copied().unwrap_or(0.0)
    }

    /// The largest radius of a particle [m]: 0 unless they are grains.
    #[must_use]
    pub fn largest_radius(&self) -> f32 {
        self.radii.iter().copied().fold(0.0, f32::max)
    }

    /// Vertex of the rest shape of a particle.
    #[must_use]
    pub fn vertex(&self, particle: usize) -> VertexIndex {
        self.numbering.vertex(ParticleIndex(particle as u32))
    }

    /// Index of the particle of a vertex of the rest shape.
    #[must_use]
    pub fn particle(&self, vertex: VertexIndex) -> usize {
        self.numbering.particle(vertex).index()
    }

    /// Identity of the mesh.
    #[must_use]
    pub fn id(&self) -> TopologyId {
        self.identity.id()
    }

    pub(crate) fn identity(&self) -> Identity {
        self.identity.clone()
    }

    /// Number of times a particle was split by tearing or a cut.
    #[must_use]
    pub fn splits(&self) -> usize {
        self.splits as usize
    }

    /// Number of particles of a body with this topology.
    #[must_use]
    pub fn particles(&self) -> usize {
        self.rest.len()
    }
}

/// Radii of grains [m] that can be simulated.
const RADII: core::ops::RangeInclusive<f32> = 1e-6..=1e3;

fn check_radii(shape: &RestShape) -> Result<(), TopologyError> {
    let (radii, vertices) = (shape.radii.len(), shape.vertices.len());
    if radii == 0 {
        return Ok(());
    }
    if radii != vertices {
        return Err(TopologyError::Radii { radii, vertices });
    }
    let elements = shape.edges.len() + shape.triangles.len() + shape.tetrahedra.len();
    if elements > 0 {
        return Err(TopologyError::GrainsWithElements(elements));
    }
    let invalid = shape
        .radii
        .iter()
        .position(|radius| !RADII.contains(radius));
    invalid.map_or(Ok(()), |vertex| {
        Err(TopologyError::Radius {
            vertex,
            radius: shape.radii[vertex],
        })
    })
}

/// Renumbers the elements of a shape from vertices to particles.
fn renumber(
    numbering: &Numbering,
    rest: &mut Vec<Vec3>,
    edges: &mut [[u32; 2]],
    tetrahedra: &mut [[u32; 4]],
    triangles: &mut [[u32; 3]],
) {
    let given = std::mem::take(rest);
    let vertices =
        (0..given.len() as u32).map(|particle| numbering.vertex(ParticleIndex(particle)));
    rest.extend(vertices.map(|vertex| given[vertex.index()]));
    let corners = edges
        .as_flattened_mut()
        .iter_mut()
        .chain(tetrahedra.as_flattened_mut())
        .chain(triangles.as_flattened_mut());
    for corner in corners {
        *corner = numbering.particle(VertexIndex(*corner)).0;
    }
}

/// Lowest and highest particle of each element.
fn reaches<const N: usize>(elements: &[[u32; N]]) -> impl Iterator<Item = (u32, u32)> {
    elements
        .iter()
        .filter_map(|corners| Some((*corners.iter().min()?, *corners.iter().max()?)))
}

/// Signed volume of a tetrahedron [m³].
#[must_use]
pub fn volume([a, b, c, d]: [DVec3; 4]) -> f64 {
    (b - a).cross(c - a).dot(d - a) / 6.0
}

/// Minimum and maximum coordinate along each axis; zeros without points.
#[must_use]
pub fn bounds(mut points: impl Iterator<Item = Vec3>) -> (Vec3, Vec3) {
    let Some(first) = points.next() else {
        return (Vec3::ZERO, Vec3::ZERO);
    };
    points.fold((first, first), |(low, high), x| (low.min(x), high.max(x)))
}

fn check_vertices(vertices: &[Vec3]) -> Result<(), TopologyError> {
    if vertices.is_empty() {
        return Err(TopologyError::Empty);
    }
    if vertices.len() > u32::MAX as usize {
        return Err(TopologyError::TooMany(vertices.len()));
    }
    match vertices.iter().position(|x| !x.is_finite()) {
        Some(vertex) => Err(TopologyError::NotFinite {
            vertex,
            position: vertices[vertex],
        }),
        None => Ok(()),
    }
}

fn check_elements<const N: usize>(
    element: &'static str,
    elements: &[[u32; N]],
    vertices: usize,
) -> Result<(), TopologyError> {
    for (index, corners) in elements.iter().enumerate() {
        for (place, &vertex) in corners.iter().enumerate() {
            if vertex as usize >= vertices {
                return Err(TopologyError::NoSuchVertex {
                    element,
                    index,
                    vertex,
                    vertices,
                });
            }
            if corners[..place].contains(&vertex) {
                return Err(TopologyError::RepeatedVertex {
                    element,
                    index,
                    vertex,
                });
            }
        }
    }
    Ok(())
}

fn without_flat(tetrahedra: Vec<[u32; 4]>, at: impl Fn(u32) -> DVec3) -> (Vec<[u32; 4]>, usize) {
    let before = tetrahedra.len();
    let kept: Vec<_> = tetrahedra
        .into_iter()
        .filter(|&corners| {
            let x = corners.map(&at);
            let longest = (0..4)
                .flat_map(|i| (0..i).map(move |j| (i, j)))
                .map(|(i, j)| x[i].distance(x[j]))
                .fold(0.0, f64::max);
            volume(x).abs() > FLAT * longest * longest * longest
        })
        .collect();
    let flat = before - kept.len();
    (kept, flat)
}

fn without_repeats(edges: Vec<[u32; 2]>) -> (Vec<[u32; 2]>, usize) {
    let before = edges.len();
    let mut order: Vec<usize> = (0..before).collect();
    let key = |i: usize| {
        (
            edges[i][0].min(edges[i][1]),
            edges[i][0].max(edges[i][1]),
            i,
        )
    };
    order.sort_unstable_by_key(|&i| key(i));
    let mut repeats = vec![false; before];
    for pair in order.windows(2) {
        let (a, b) = (key(pair[0]), key(pair[1]));
        repeats[pair[1]] = (a.0, a.1) == (b.0, b.1);
    }
    let kept: Vec<_> = edges
        .iter()
        .zip(&repeats)
        .filter(|(_, repeat)| !**repeat)
        .map(|(edge, _)| *edge)
        .collect();
    let repeated = before - kept.len();
    (kept, repeated)
}
