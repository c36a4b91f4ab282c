//! Named parts of a file: nodes and meshes of glTF, objects and groups of OBJ.

use std::{collections::BTreeSet, fs, ops::Range, path::Path, sync::Arc};

use super::{Beside, gltf, gmsh, medit, obj, tetgen};
use crate::{Bounds, CurveMesh, FileMesh, MeshError, SurfaceMesh};
use glam::DVec3;

/// A mesh file with its named parts, to make several bodies of one file.
///
/// A part is named by a node of glTF or an object (`o`) of OBJ; where none has the name, by a mesh of
/// glTF or a group (`g`) of OBJ. Names are case-sensitive. A name that occurs several times means all
/// parts of this name together. The nodes are those of the default scene, with their transforms; a
/// node without a mesh means all nodes below it. The name of an object is the rest of its line; each
/// word after `g` is a group.
///
/// ```
/// use pliant_mesh::{BuildOptions, build, read::Parts};
///
/// let file = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 3\no Left\nf 1 3 2\no Right\nf 1 2 4\n";
/// let parts = Parts::of_bytes("wings.obj", file.as_bytes(), &|_| Ok(Vec::new()))?;
/// assert_eq!(parts.names(), ["Left", "Right"]);
/// let options = BuildOptions {
///     size: Some(0.3), // m, of both together
///     bounds: Some(parts.bounds()),
///     treatment: pliant_mesh::Treatment::Shell,
///     ..BuildOptions::default()
/// };
/// let left = build(parts.part("Left")?, &options)?;
/// assert_eq!(left.shape.vertices[0], glam::Vec3::new(-0.05, -0.05, -0.15));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Parts {
    pub(super) file: String,
    pub(super) whole: FileMesh,
    /// Lines of a file whose mesh is a surface.
    pub(super) segments: Vec<[u32; 2]>,
    /// `None` if the format has none.
    pub(super) named: Option<Named>,
}

/// Parts of a format that has named ones.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Named {
    pub(super) parts: Vec<Part>,
    /// Notes about the file as a whole.
    pub(super) notes: Vec<String>,
    /// Description of elements that are ignored, for notes.
    pub(super) ignored: &'static str,
}

/// Consecutive elements of a file with a name.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Part {
    pub(super) label: Label,
    pub(super) elements: Range<Counts>,
}

/// What gives a part its name.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Label {
    /// A node of glTF, or an object of OBJ.
    Object(Arc<str>),
    /// A mesh of glTF, unless an object has the name.
    Mesh(Arc<str>),
    /// Groups of OBJ, separated by spaces, unless an object has the name.
    Groups(Arc<str>),
}

impl Label {
    fn is_object(&self) -> bool {
        matches!(self, Self::Object(_))
    }

    fn names(&self) -> impl Iterator<Item = &str> {
        let (one, several) = match self {
            Self::Object(name) | Self::Mesh(name) => (Some(&**name), ""),
            Self::Groups(names) => (None, &**names),
        };
        one.into_iter().chain(several.split_whitespace())
    }
}

/// Elements of a file up to a place in it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Counts {
    pub(super) triangles: usize,
    pub(super) segments: usize,
    /// Lines, of one segment or more.
    pub(super) lines: usize,
    pub(super) ignored: usize,
}

impl Counts {
    /// The later place of two.
    fn later(self, other: Self) -> Self {
        Self {
            triangles: self.triangles.max(other.triangles),
            segments: self.segments.max(other.segments),
            lines: self.lines.max(other.lines),
            ignored: self.ignored.max(other.ignored),
        }
    }

    fn has_mesh_until(self, end: Self) -> bool {
        self.triangles < end.triangles || self.segments < end.segments
    }
}

impl Part {
    fn has_mesh(&self) -> bool {
        self.elements.start.has_mesh_until(self.elements.end)
    }
}

impl Parts {
    /// Reads a mesh file, as [`file()`](super::file).
    ///
    /// # Errors
    /// As [`file()`](super::file).
    pub fn of_file(path: &Path) -> Result<Self, MeshError> {
        let name = path.display().to_string();
        super::format_of(&name)?;
        let contents = fs::read(path).map_err(|source| MeshError::Unreadable {
            file: name.clone(),
            source,
        })?;
        Self::of_bytes(&name, &contents, &|beside| {
            fs::read(path.with_file_name(beside))
        })
    }

    /// Reads a mesh file from memory, as [`bytes()`](super::bytes).
    ///
    /// # Errors
    /// As [`file()`](super::file).
    pub fn of_bytes(name: &str, bytes: &[u8], beside: &Beside) -> Result<Self, MeshError> {
        let whole = match super::format_of(name)?.as_str() {
            "obj" => return obj::read(name, bytes),
            "gltf" | "glb" => return gltf::read(name, bytes, beside),
            "msh" => gmsh::read(name, bytes),
            "node" | "ele" => tetgen::read(name, bytes, beside),
            _ => medit::read(name, bytes),
        }?;
        Ok(Self {
            file: name.into(),
            whole,
            segments: Vec::new(),
            named: None,
        })
    }

    /// Names of parts that have a mesh, each once: nodes or objects in the order of the file, then
    /// meshes or groups. Empty for a format without named parts.
    #[must_use]
    pub fn names(&self) -> Vec<&str> {
        let parts = self.named.iter().flat_map(|named| &named.parts);
        let with_mesh = parts.filter(|it| it.has_mesh());
        let (objects, others): (Vec<_>, Vec<_>) = with_mesh.partition(|it| it.label.is_object());
        let names = objects.into_iter().chain(others);
        let mut seen = BTreeSet::new();
        names
            .flat_map(|part| part.label.names())
            .filter(|name| seen.insert(*name))
            .collect()
    }

    /// The mesh of a part, in the coordinates of the file, with the vertices that it uses, in their
    /// order. A part without faces, in OBJ, consists of its lines.
    ///
    /// # Errors
    /// [`MeshError::UnknownPart`] for an unknown name, [`MeshError::Unusable`] if the file or its
    /// format has no named parts, or the part no mesh.
    pub fn part(&self, name: &str) -> Result<FileMesh, MeshError> {
        let file = &self.file;
        let Some(named) = &self.named else {
            return Err(MeshError::unusable(
                format!("{file}: this format has no named parts"),
                "use the whole file, or save it as OBJ or glTF",
            ));
        };
        let of_name = |part: &&Part| part.label.names().any(|other| other == name);
        let spans = |is_object| {
            let parts = named.parts.iter().filter(of_name);
            let parts = parts.filter(|it| it.label.is_object() == is_object && it.has_mesh());
            parts.map(|it| it.elements.clone()).collect::<Vec<_>>()
        };
        let mut spans = Some(spans(true))
            .filter(|spans| !spans.is_empty())
            .unwrap_or_else(|| spans(false));
        if spans.is_empty() {
            if named.parts.iter().any(|part| of_name(&part)) {
                return Err(MeshError::unusable(
                    format!("{file}: the part “{}” has no mesh", shown(name)),
                    "use one with triangles, or with lines in OBJ",
                ));
            }
            let names = self.names();
            if names.is_empty() {
                return Err(MeshError::unusable(
                    format!("{file}: the file has no named parts"),
                    "use the whole file, or give its objects names",
                ));
            }
            return Err(MeshError::UnknownPart {
                file: file.clone(),
                part: name.into(),
                names: names.into_iter().map(Into::into).collect(),
            });
        }
        // A node may have the name of one above it; its elements count once.
        spans.sort_by_key(|span| span.start);
        let (mut triangles, mut segments) = (Vec::new(), Vec::new());
        let (mut lines, mut ignored) = (0, 0);
        let mut done = Counts::default();
        let all = match &self.whole {
            FileMesh::Surface(surface) => surface.triangles.as_slice(),
            _ => &[],
        };
        let all_segments = match &self.whole {
            FileMesh::Curves(curves) => &curves.segments,
            _ => &self.segments,
        };
        for Range { start, end } in spans {
            let (start, end) = (start.later(done), end.later(done));
            triangles.extend_from_slice(&all[start.triangles..end.triangles]);
            segments.extend_from_slice(&all_segments[start.segments..end.segments]);
            lines += end.lines - start.lines;
            ignored += end.ignored - start.ignored;
            done = end;
        }
        let mut notes = named.notes.clone();
        if !triangles.is_empty() {
            ignored += lines;
        }
        if ignored > 0 {
            notes.push(format!("{}: {ignored}", named.ignored));
        }
        Ok(if triangles.is_empty() {
            FileMesh::Curves(CurveMesh {
                vertices: take_used(self.whole.vertices(), &mut segments),
                segments,
                notes,
            })
        } else {
            FileMesh::Surface(SurfaceMesh {
                vertices: take_used(self.whole.vertices(), &mut triangles),
                triangles,
                notes,
            })
        })
    }

    /// The mesh of the whole file.
    #[must_use]
    pub fn whole(&self) -> &FileMesh {
        &self.whole
    }

    /// The mesh of the whole file.
    #[must_use]
    pub fn into_whole(self) -> FileMesh {
        self.whole
    }

    /// Bounding box of the whole file, to which [`BuildOptions::bounds`](crate::BuildOptions::bounds)
    /// may refer, so that the bodies of several parts fit together as in the file.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        self.whole.bounds()
    }
}

/// The vertices that elements use, in their order, by which the elements are renumbered. In a time that
/// does not depend on the other vertices: a file may have many parts.
fn take_used<const N: usize>(all: &[DVec3], elements: &mut [[u32; N]]) -> Vec<DVec3> {
    let mut used: Vec<u32> = elements.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    for corner in elements.iter_mut().flatten() {
        // Each is among those that are used.
        *corner = used.partition_point(|&other| other < *corner) as u32;
    }
    used.iter().map(|&it| all[it as usize]).collect()
}

/// A name for a message: without control characters, and not too long.
pub(crate) fn shown(name: &str) -> String {
    const LONGEST: usize = 60;
    let shown = name.chars().take(LONGEST).map(|c| match c.is_control() {
        true => char::REPLACEMENT_CHARACTER,
        false => c,
    });
    let more = (name.chars().count() > LONGEST).then_some('…');
    shown.chain(more).collect()
}
