//! Converts an imported mesh to a body: places, repairs, fills and embeds it.
//!
//! All geometry is computed in f64 at unit size around the origin, so that results do not depend on
//! scale, from micrometers to megameters. The last step scales and rounds to f32.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{
    Bounds, CurveMesh, FileMesh, MeshError, Skin, SoftMesh, SurfaceMesh, TetMesh,
    boundary_triangles,
    clean::{clean_segments, clean_tetrahedra, clean_triangles, counted, keep_used, weld},
    edges,
    elements::tetrahedron_volume,
    embed::embed,
    limits::MAX_TETRAHEDRA,
    orient::{borders, face_outwards},
};
use pliant_solver::RestShape;

mod fill;
mod thin;

/// Maximum number of cells along the longest side of a filled surface.
pub const MAX_CELLS: u32 = 128;

/// Maximum distance of a mesh from the center of its [`BuildOptions::bounds`], in sizes of the mesh:
/// farther away, rounding to f32 would take its detail. At this distance it is 6e-5 of the size.
pub const MAX_OFFSET: f64 = 1e3;

/// Valid body sizes [m]: within them f32 represents the volume of a cell at full precision.
const SIZES: std::ops::RangeInclusive<f64> = 1e-7..=1e7;

/// Options for converting a mesh to a body.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BuildOptions {
    /// Length of the longest side of the bounding box [m], from 1e-7 to 1e7; `None`, the default,
    /// keeps the file's numbers as meters.
    pub size: Option<f32>,
    /// The bounding box that `size` is about and whose center becomes the origin, so that the parts
    /// of a file fit together ([`Parts::bounds`](crate::read::Parts::bounds)); `None`, the default,
    /// is that of the mesh. The mesh is at most [`MAX_OFFSET`] times its size away from the center.
    pub bounds: Option<Bounds>,
    /// Cells along the longest side when a surface is filled, from 2 to [`MAX_CELLS`]; `None`, the
    /// default, takes as many as give at most about 2000 particles, from 6 to 18.
    pub cells: Option<u32>,
    /// Treatment of closed surfaces.
    pub treatment: Treatment,
}

/// Meaning of a closed surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Treatment {
    /// The boundary of a solid: it is filled with tetrahedra and follows them as a skin.
    #[default]
    Fill,
    /// The body itself: its triangles become a cloth.
    Shell,
}

/// Builds a body from a mesh: centers it on its bounding box, or on
/// [another one](BuildOptions::bounds), scales and repairs it, and, for a
/// surface with [`Treatment::Fill`], fills it with tetrahedra that it follows as a [`Skin`].
///
/// # Errors
/// [`MeshError::Parameter`] for an option out of its range, [`MeshError::TooLarge`] for too many
/// tetrahedra, and [`MeshError::Unusable`] for a mesh that cannot become a body: empty, without
/// extent, too far from the center of its bounds, not finite, with an index out of range, or to be filled although it encloses no volume.
pub fn build(mesh: FileMesh, options: &BuildOptions) -> Result<SoftMesh, MeshError> {
    if let Some(cells) = options
        .cells
        .filter(|cells| !(2..=MAX_CELLS).contains(cells))
    {
        let expected = format!("a whole number from 2 to {MAX_CELLS}");
        return Err(MeshError::parameter("cells", cells, expected));
    }
    match (mesh, options.treatment) {
        (FileMesh::Surface(surface), Treatment::Fill) => solid(surface, options),
        (FileMesh::Surface(surface), Treatment::Shell) => shell(surface, options),
        (FileMesh::Tetrahedra(mesh), Treatment::Fill) => tetrahedra(mesh, options),
        (FileMesh::Curves(curves), _) => ropes(curves, options),
        (FileMesh::Tetrahedra(mut mesh), Treatment::Shell) => {
            let placement = Placement::of(&mut mesh.vertices, &mesh.tetrahedra, options)?;
            let points = mend_tetrahedra(&mut mesh)?;
            let mut triangles = boundary_triangles(&mesh.tetrahedra);
            let kept = keep_used(&mut mesh.vertices, &mut triangles);
            let cloth = placement.cloth(mesh.vertices, triangles, mesh.notes);
            let on_surface = |point: Option<u32>| kept[point? as usize];
            Ok(SoftMesh {
                points: points.into_iter().map(on_surface).collect(),
                ..cloth
            })
        }
    }
}

fn shell(mut surface: SurfaceMesh, options: &BuildOptions) -> Result<SoftMesh, MeshError> {
    let placement = Placement::of(&mut surface.vertices, &surface.triangles, options)?;
    let points = mend_surface(&mut surface)?;
    let cloth = placement.cloth(surface.vertices, surface.triangles, surface.notes);
    Ok(SoftMesh { points, ..cloth })
}

fn ropes(mut curves: CurveMesh, options: &BuildOptions) -> Result<SoftMesh, MeshError> {
    let placement = Placement::of(&mut curves.vertices, &curves.segments, options)?;
    let CurveMesh {
        mut vertices,
        mut segments,
        mut notes,
    } = curves;
    let used = keep_used(&mut vertices, &mut segments);
    note_unused(&used, &mut notes);
    let welded = weld(&vertices, &mut segments, &mut notes);
    clean_segments(&mut segments, &mut notes);
    if segments.is_empty() {
        return Err(MeshError::unusable(
            "all segments of the curves have zero length",
            "use curves with distinct vertices",
        ));
    }
    let kept = keep_used(&mut vertices, &mut segments);
    Ok(SoftMesh {
        shape: RestShape {
            vertices: placement.vertices(&vertices),
            edges: segments,
            ..RestShape::default()
        },
        points: became(used, &welded, &kept),
        notes,
        ..SoftMesh::default()
    })
}

fn tetrahedra(mut mesh: TetMesh, options: &BuildOptions) -> Result<SoftMesh, MeshError> {
    if mesh.tetrahedra.len() > MAX_TETRAHEDRA {
        return Err(MeshError::TooLarge {
            what: "tetrahedra",
            count: mesh.tetrahedra.len() as u64,
            limit: MAX_TETRAHEDRA as u64,
            remedy: "use a coarser mesh",
        });
    }
    let placement = Placement::of(&mut mesh.vertices, &mesh.tetrahedra, options)?;
    let points = mend_tetrahedra(&mut mesh)?;
    let solid = placement.solid(mesh.vertices, mesh.tetrahedra, mesh.notes)?;
    Ok(SoftMesh { points, ..solid })
}

fn solid(mut surface: SurfaceMesh, options: &BuildOptions) -> Result<SoftMesh, MeshError> {
    let placement = Placement::of(&mut surface.vertices, &surface.triangles, options)?;
    let points = mend_surface(&mut surface)?;
    let mut notes = surface.notes;
    let filling = fill::fill(
        &surface.vertices,
        &surface.triangles,
        options.cells,
        &mut notes,
    )?;
    let (anchors, lost) = embed(&surface.vertices, &filling.vertices, &filling.tetrahedra);
    if lost > 0 {
        let lost = counted(lost, "vertex of the surface", "vertices of the surface");
        notes.push(format!(
            "{lost} too far from the tetrahedra, attached to the nearest one: use more cells for finer parts"
        ));
    }
    let body = placement.solid(filling.vertices, filling.tetrahedra, notes)?;
    Ok(SoftMesh {
        skin: Some(Skin {
            triangles: surface.triangles,
            anchors,
        }),
        points,
        ..body
    })
}

/// Mends a surface. Returns the vertex that each became; `None` for those that are removed.
fn mend_surface(surface: &mut SurfaceMesh) -> Result<Vec<Option<u32>>, MeshError> {
    let SurfaceMesh {
        vertices,
        triangles,
        notes,
    } = surface;
    let used = keep_used(vertices, triangles);
    note_unused(&used, notes);
    let welded = weld(vertices, triangles, notes);
    clean_triangles(vertices, triangles, notes);
    if triangles.is_empty() {
        return Err(MeshError::unusable(
            "all triangles of the mesh have zero area",
            "use triangles with three distinct corners that are not collinear",
        ));
    }
    let kept = keep_used(vertices, triangles);
    face_outwards(vertices, triangles, notes);
    let branching = borders(triangles).branching;
    if branching > 0 {
        notes.push(format!("non-manifold edges: {branching}"));
    }
    Ok(became(used, &welded, &kept))
}

/// The vertex that each became that was used, then welded, then kept.
fn became(used: Vec<Option<u32>>, welded: &[u32], kept: &[Option<u32>]) -> Vec<Option<u32>> {
    let became = |vertex: Option<u32>| kept[welded[vertex? as usize] as usize];
    used.into_iter().map(became).collect()
}

/// Mends tetrahedra. Returns the vertex that each became; `None` for those that are removed.
fn mend_tetrahedra(mesh: &mut TetMesh) -> Result<Vec<Option<u32>>, MeshError> {
    let used = keep_used(&mut mesh.vertices, &mut mesh.tetrahedra);
    note_unused(&used, &mut mesh.notes);
    let welded = weld(&mesh.vertices, &mut mesh.tetrahedra, &mut mesh.notes);
    clean_tetrahedra(&mesh.vertices, &mut mesh.tetrahedra, &mut mesh.notes);
    if mesh.tetrahedra.is_empty() {
        return Err(MeshError::unusable(
            "all tetrahedra of the mesh have zero volume",
            "use tetrahedra with four corners that are not coplanar",
        ));
    }
    let kept = keep_used(&mut mesh.vertices, &mut mesh.tetrahedra);
    Ok(became(used, &welded, &kept))
}

fn note_unused(numbers: &[Option<u32>], notes: &mut Vec<String>) {
    let unused = numbers.iter().filter(|number| number.is_none()).count();
    if unused > 0 {
        let unused = counted(unused, "unused vertex", "unused vertices");
        notes.push(format!("{unused} removed"));
    }
}

/// Maps a mesh of unit size to its final position and size.
struct Placement {
    /// Meters per unit.
    scale: f64,
    /// Position of the center [m]; `None` is the origin.
    center: Option<DVec3>,
}

impl Placement {
    /// Checks a mesh and normalizes it to unit size around the origin. Unused vertices are ignored.
    fn of<const N: usize>(
        vertices: &mut [DVec3],
        elements: &[[u32; N]],
        options: &BuildOptions,
    ) -> Result<Self, MeshError> {
        let what = ["segment", "triangle", "tetrahedron"][N - 2];
        if elements.is_empty() {
            return Err(MeshError::unusable(
                format!("the mesh has no {what}"),
                "expected triangles, tetrahedra or curves",
            ));
        }
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for (number, element) in elements.iter().enumerate() {
            for &corner in element {
                let Some(&p) = vertices.get(corner as usize) else {
                    return Err(MeshError::unusable(
                        format!("{what} {number} refers to vertex {corner}"),
                        format!("the mesh has {} vertices, counted from 0", vertices.len()),
                    ));
                };
                if !p.is_finite() {
                    return Err(MeshError::unusable(
                        format!("vertex {corner} is at {p}"),
                        "coordinates must be finite",
                    ));
                }
                (low, high) = (low.min(p), high.max(p));
            }
        }
        let longest = (high - low).max_element();
        let center = low + (high - low) * 0.5;
        let whole = options.bounds.map_or(longest, |bounds| bounds.size);
        let size = options.size.map_or(whole, f64::from);
        // Below this, the offset from the origin uses up the precision of the coordinates.
        if longest <= center.abs().max_element() * 1e-12 {
            return Err(MeshError::unusable(
                "the mesh has no extent: all its vertices coincide",
                "use distinct vertices, or move the mesh nearer to the origin",
            ));
        }
        if !SIZES.contains(&size) {
            return Err(MeshError::parameter(
                "size",
                format!("{size} m"),
                "a longest side from 1e-7 m to 1e7 m: set the size",
            ));
        }
        let placement = match options.bounds {
            Some(bounds) => Self::within(bounds, size, center, longest)?,
            None => Self {
                scale: size,
                center: None,
            },
        };
        for p in vertices {
            *p = (*p - center) / longest;
        }
        Ok(placement)
    }

    /// A mesh of this center and longest side in bounds that get this size [m].
    fn within(bounds: Bounds, size: f64, center: DVec3, longest: f64) -> Result<Self, MeshError> {
        if !(bounds.center.is_finite() && bounds.size.is_finite() && bounds.size > 0.0) {
            return Err(MeshError::unusable(
                format!("bounds of {} m at {}", bounds.size, bounds.center),
                "bounds must be finite and larger than 0",
            ));
        }
        let meters = size / bounds.size;
        let scale = longest * meters;
        let offset = (center - bounds.center) * meters;
        if !SIZES.contains(&scale) {
            return Err(MeshError::parameter(
                "size",
                format!("{} m, with {} m for this mesh", size as f32, scale as f32),
                "1e-7 m to 1e7 m for both: use another size, or the bounds of the mesh itself (in scene files `bounds: Part`)",
            ));
        }
        let distance = offset.abs().max_element();
        if !(distance.is_finite() && distance <= MAX_OFFSET * scale) {
            return Err(MeshError::unusable(
                format!(
                    "the mesh, of {} m, is {} m from the center of its bounds",
                    scale as f32, distance as f32
                ),
                format!(
                    "at most {MAX_OFFSET} times its size are precise: use its own bounds (in scene files \
                     `bounds: Part`)"
                ),
            ));
        }
        Ok(Self {
            scale,
            center: Some(offset),
        })
    }

    fn vertices(&self, unit: &[DVec3]) -> Vec<glam::Vec3> {
        let placed = |p: &DVec3| {
            let scaled = *p * self.scale;
            self.center.map_or(scaled, |center| scaled + center)
        };
        unit.iter().map(|p| placed(p).as_vec3()).collect()
    }

    fn cloth(
        &self,
        vertices: Vec<DVec3>,
        triangles: Vec<[u32; 3]>,
        notes: Vec<String>,
    ) -> SoftMesh {
        SoftMesh {
            shape: RestShape {
                vertices: self.vertices(&vertices),
                edges: edges(&[], &triangles),
                tetrahedra: Vec::new(),
                triangles,
                ..RestShape::default()
            },
            notes,
            ..SoftMesh::default()
        }
    }

    fn solid(
        &self,
        vertices: Vec<DVec3>,
        tetrahedra: Vec<[u32; 4]>,
        notes: Vec<String>,
    ) -> Result<SoftMesh, MeshError> {
        let vertices = self.vertices(&vertices);
        let flat = tetrahedra
            .iter()
            .position(|t| tetrahedron_volume(t.map(|i| vertices[i as usize].as_dvec3())) <= 0.0);
        if let Some(flat) = flat {
            return Err(MeshError::unusable(
                format!("tetrahedron {flat} has zero volume in single precision"),
                "use a mesh with fewer or less flat tetrahedra",
            ));
        }
        Ok(SoftMesh {
            shape: RestShape {
                edges: edges(&tetrahedra, &[]),
                triangles: boundary_triangles(&tetrahedra),
                vertices,
                tetrahedra,
                ..RestShape::default()
            },
            notes,
            ..SoftMesh::default()
        })
    }
}
