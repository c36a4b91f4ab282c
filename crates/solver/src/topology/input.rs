//! Validation of rest shapes.

use super::{
    groups::{GroupName, MAX_GROUPS},
    index::{ParticleIndex, VertexIndex},
    numbering::Numbering,
    rest_shape::RestShape,
    volume,
};
use glam::{DVec3, Vec3};

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
    /// There are more groups than a body can have.
    #[error("the shape has {0} groups of vertices, but at most {MAX_GROUPS} are supported")]
    TooManyGroups(usize),
    /// A group has no name.
    #[error("group {0} of vertices has no name; expected 1 to 31 bytes")]
    UnnamedGroup(usize),
    /// Two groups have the same name.
    #[error("two groups of vertices have the name “{0}”; expected different names")]
    RepeatedGroup(GroupName),
    /// A group refers to a vertex that does not exist.
    #[error("group “{group}” refers to vertex {vertex}; expected 0 to {last}", last = vertices - 1)]
    GroupVertex {
        /// Name of the group.
        group: GroupName,
        /// The invalid index.
        vertex: u32,
        /// Number of vertices.
        vertices: usize,
    },
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

/// Radii of grains [m] that can be simulated.
const RADII: core::ops::RangeInclusive<f32> = 1e-6..=1e3;

pub(super) fn check_radii(shape: &RestShape) -> Result<(), TopologyError> {
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
pub(super) fn renumber(
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
pub(super) fn reaches<const N: usize>(elements: &[[u32; N]]) -> impl Iterator<Item = (u32, u32)> {
    elements
        .iter()
        .filter_map(|corners| Some((*corners.iter().min()?, *corners.iter().max()?)))
}

pub(super) fn check_vertices(vertices: &[Vec3]) -> Result<(), TopologyError> {
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

pub(super) fn check_elements<const N: usize>(
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

pub(super) fn without_flat(
    tetrahedra: Vec<[u32; 4]>,
    at: impl Fn(u32) -> DVec3,
) -> (Vec<[u32; 4]>, usize) {
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

pub(super) fn without_repeats(edges: Vec<[u32; 2]>) -> (Vec<[u32; 2]>, usize) {
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
