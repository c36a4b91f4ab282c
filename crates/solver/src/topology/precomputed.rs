//! The immutable part of a body, and its construction from a rest shape.

use super::{
    Components, Cotangents, Dimension, Edges, Enclosure, Facets, Frames, Hinges, Identity, LeftOut,
    NotClosed, Surface, Tetrahedra, bounds,
    groups::{Group, GroupName, Groups},
    id::TopologyId,
    index::{ParticleIndex, VertexIndex},
    input::{
        TopologyError, check_elements, check_radii, check_vertices, reaches, renumber,
        without_flat, without_repeats,
    },
    lazy::Lazy,
    numbering::Numbering,
    partitions::{MIN_CUT, Partitions},
    rest_shape::RestShape,
    strips::Strips,
    volume,
};
use glam::Vec3;
use std::sync::Arc;

/// The immutable part of a body. Copies share all but the rest values that can
/// [flow](crate::Plasticity).
///
/// ```
/// use glam::Vec3;
/// use pliant_solver::{RestShape, Topology, topology::Dimension};
///
/// let tetrahedron = RestShape {
///     vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z], // m
///     edges: vec![[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]],
///     tetrahedra: vec![[0, 1, 2, 3]],
///     triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
///     ..RestShape::default()
/// };
/// let topology = Topology::new(tetrahedron)?;
/// assert_eq!(topology.dimension, Dimension::Solid);
/// assert_eq!(topology.particles(), 4);
/// # Ok::<(), pliant_solver::TopologyError>(())
/// ```
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
    /// Named groups of the particles.
    pub groups: Groups,
    /// Kind of elements that carry the mass of the body.
    pub dimension: Dimension,
    /// Lowest and highest corner of the bounding box at rest [m], of the centers of grains.
    pub bounds: [Vec3; 2],
    /// Longest side of the bounding box at rest [m].
    pub size: f32,
    /// Omissions from the input.
    pub left_out: LeftOut,
    /// Hinges of the surface, for bending; computed on first use.
    pub(super) hinges: Lazy<Hinges>,
    /// Data for the quadratic bending energy of the hinges; computed on first use.
    pub(super) cotangents: Lazy<Cotangents>,
    /// Triangles of the surface, for membranes; computed on first use.
    pub(super) facets: Lazy<Arc<Facets>>,
    /// Rest frames of the tetrahedra; computed on first use.
    pub(super) frames: Lazy<Arc<Frames>>,
    /// Struts from surface to surface; computed on first use.
    pub(super) struts: Lazy<Arc<Edges>>,
    /// The surface that can touch, computed on first use.
    pub(super) surface: Lazy<Arc<Surface>>,
    /// Its connected parts, computed on first use.
    pub(super) components: Lazy<Arc<Components>>,
    /// Volume enclosed by the surface, for pressure, or the reason why there is none.
    pub(super) enclosure: Lazy<Arc<Result<Enclosure, NotClosed>>>,
    /// Number of times a particle was split. The order of the constraints of a torn topology depends
    /// on its past.
    pub(super) splits: u32,
    /// Whether grains have appeared or disappeared.
    pub(super) is_renewed: bool,
    /// The topology before plastic flow.
    pub(super) original: Option<Arc<Topology>>,
    pub(super) identity: Identity,
}

impl Topology {
    /// Validates a rest shape and precomputes the data for the solver.
    ///
    /// # Errors
    /// [`TopologyError`] for an empty shape, a coordinate that is not finite, an element with an index
    /// out of range or repeated, or invalid groups.
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
        let groups = Groups::new(&shape.groups, &numbering, count)?;
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
        let strips = Strips::find(count, &ends, &corners, count >= MIN_CUT);
        let reaches = reaches(&ends).chain(reaches(&corners));
        let partitions = Partitions::cut(count, reaches, strips);
        let is_sheet = dimension == Dimension::Sheet;
        Ok(Self {
            edges: Edges::new(&ends, &rest, &partitions, is_sheet),
            tetrahedra: Tetrahedra::new(&corners, &rest, &partitions),
            partitions: Arc::new(partitions),
            triangles: triangles.into(),
            radii: radii.into(),
            groups,
            numbering,
            dimension,
            bounds: [low, high],
            size: (high - low).max_element() + diameter,
            left_out,
            rest: rest.into(),
            hinges: Lazy::default(),
            cotangents: Lazy::default(),
            facets: Lazy::default(),
            frames: Lazy::default(),
            struts: Lazy::default(),
            surface: Lazy::default(),
            components: Lazy::default(),
            enclosure: Lazy::default(),
            splits: 0,
            is_renewed: false,
            original: None,
            identity: Identity::default(),
        })
    }

    /// Adds a named group of vertices.
    ///
    /// # Errors
    /// [`TopologyError`] for an empty name, one that the body already has, more than 32 groups, and a
    /// vertex that does not exist; nothing has changed in this case.
    pub fn add_group(
        &mut self,
        name: GroupName,
        vertices: impl IntoIterator<Item = VertexIndex>,
    ) -> Result<(), TopologyError> {
        let mut groups = self.groups.of_vertices(&self.numbering);
        let vertices = vertices.into_iter().map(|vertex| vertex.0).collect();
        groups.push(Group { name, vertices });
        self.groups = Groups::new(&groups, &self.numbering, self.particles())?;
        // Rest values that flow are stored beside the shape that they began with.
        if let Some(original) = &mut self.original {
            Arc::make_mut(original).groups = self.groups.clone();
        }
        Ok(())
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
    /// particle have different colors, and each finds the lower ones taken as before. Patterns of strips are sorted by their places.
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
            groups: self.groups.of_vertices(&self.numbering),
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
