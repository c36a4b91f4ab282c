//! Named parts of a file: nodes and meshes of glTF, objects and groups of OBJ, physical groups of Gmsh.

use std::{collections::BTreeSet, ops::Range, sync::Arc};

use crate::{Bounds, CurveMesh, FileMesh, MeshError, SurfaceMesh, TetMesh, error::shown};
use glam::DVec3;

/// A mesh file with its named parts, to make several bodies of one file.
///
/// A part is named by a node of glTF, an object (`o`) of OBJ or a physical group of Gmsh; where none
/// has the name, by a mesh of glTF, a group (`g`) of OBJ or the number of a physical group without a
/// name. Names are case-sensitive. A name that occurs several times means all parts of this name
/// together. The nodes are those of the default scene, with their transforms; a node without a mesh
/// means all nodes below it. The name of an object is the rest of its line; each word after `g` is a
/// group. Physical groups of one name, or without a name and of one number, are one part, also if
/// their dimensions differ: its tetrahedra, or its triangles if it has no tetrahedra.
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
    /// Triangles of a file whose mesh consists of tetrahedra.
    pub(super) triangles: Vec<[u32; 3]>,
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
    /// Why the parts are unknown, although the mesh could be read.
    pub(super) problem: Option<String>,
}

/// Elements of a file with a name.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Part {
    pub(super) label: Label,
    /// Runs of consecutive elements.
    pub(super) elements: Vec<Range<Counts>>,
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
    /// Physical groups of Gmsh: those with a name, and the numbers of the others, unless one has the
    /// name.
    Physical {
        names: Vec<Arc<str>>,
        numbers: Vec<Arc<str>>,
    },
}

/// Which of two parts a name means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Rank {
    First,
    /// If no part with a mesh has the name in the first rank.
    Second,
}

impl Label {
    fn names(&self, rank: Rank) -> impl Iterator<Item = &str> {
        let (one, words, several): (_, _, &[Arc<str>]) = match (self, rank) {
            (Self::Object(name), Rank::First) | (Self::Mesh(name), Rank::Second) => {
                (Some(&**name), "", &[])
            }
            (Self::Groups(names), Rank::Second) => (None, &**names, &[]),
            (Self::Physical { names, .. }, Rank::First) => (None, "", names),
            (Self::Physical { numbers, .. }, Rank::Second) => (None, "", numbers),
            _ => (None, "", &[]),
        };
        let several = several.iter().map(|name| &**name);
        one.into_iter()
            .chain(words.split_whitespace())
            .chain(several)
    }

    fn has(&self, name: &str, rank: Rank) -> bool {
        self.names(rank).any(|other| other == name)
    }
}

/// Elements of a file up to a place in it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Counts {
    pub(super) tetrahedra: usize,
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
            tetrahedra: self.tetrahedra.max(other.tetrahedra),
            triangles: self.triangles.max(other.triangles),
            segments: self.segments.max(other.segments),
            lines: self.lines.max(other.lines),
            ignored: self.ignored.max(other.ignored),
        }
    }

    fn has_mesh_until(self, end: Self) -> bool {
        self.tetrahedra < end.tetrahedra
            || self.triangles < end.triangles
            || self.segments < end.segments
    }
}

/// The elements of a part.
struct Elements {
    tetrahedra: Vec<[u32; 4]>,
    triangles: Vec<[u32; 3]>,
    segments: Vec<[u32; 2]>,
    notes: Vec<String>,
}

impl Part {
    fn has_mesh(&self) -> bool {
        let mut runs = self.elements.iter();
        runs.any(|run| run.start.has_mesh_until(run.end))
    }
}

impl Parts {
    /// A file of a format without named parts.
    pub(super) fn unnamed(file: &str, whole: FileMesh) -> Self {
        Self {
            file: file.into(),
            whole,
            triangles: Vec::new(),
            segments: Vec::new(),
            named: None,
        }
    }

    /// Names of parts that have a mesh, each once: nodes or objects in the order of the file, then
    /// meshes or groups; in Gmsh names, then numbers, those of volumes before those of surfaces. Empty
    /// for a format without named parts.
    #[must_use]
    pub fn names(&self) -> Vec<&str> {
        let parts = self.named.iter().flat_map(|named| &named.parts);
        let with_mesh: Vec<_> = parts.filter(|it| it.has_mesh()).collect();
        let mut seen = BTreeSet::new();
        [Rank::First, Rank::Second]
            .into_iter()
            .flat_map(|rank| with_mesh.iter().flat_map(move |it| it.label.names(rank)))
            .filter(|name| seen.insert(*name))
            .collect()
    }

    /// The mesh of a part, in the coordinates of the file, with the vertices that it uses, in their
    /// order. A part without faces, in OBJ, consists of its lines.
    ///
    /// # Errors
    /// [`MeshError::UnknownPart`] for an unknown name, [`MeshError::Unusable`] if the file or its
    /// format has no named parts, or the part no mesh, or the physical groups of a Gmsh file are
    /// damaged.
    pub fn part(&self, name: &str) -> Result<FileMesh, MeshError> {
        let Elements {
            mut tetrahedra,
            mut triangles,
            mut segments,
            notes,
        } = self.elements(name)?;
        let all = self.whole.vertices();
        Ok(if !tetrahedra.is_empty() {
            FileMesh::Tetrahedra(TetMesh {
                vertices: take_used(all, &mut tetrahedra),
                tetrahedra,
                notes,
            })
        } else if !triangles.is_empty() {
            FileMesh::Surface(SurfaceMesh {
                vertices: take_used(all, &mut triangles),
                triangles,
                notes,
            })
        } else {
            FileMesh::Curves(CurveMesh {
                vertices: take_used(all, &mut segments),
                segments,
                notes,
            })
        })
    }

    /// The vertices of the mesh of the whole file that a part uses, ascending: those of
    /// [`part`](Self::part), in the same order.
    ///
    /// # Errors
    /// As [`part`](Self::part).
    pub fn vertices(&self, name: &str) -> Result<Vec<u32>, MeshError> {
        let elements = self.elements(name)?;
        let Elements {
            tetrahedra,
            triangles,
            segments,
            ..
        } = &elements;
        Ok(if !tetrahedra.is_empty() {
            used(tetrahedra)
        } else if !triangles.is_empty() {
            used(triangles)
        } else {
            used(segments)
        })
    }

    /// The elements of a part, with vertices of the whole file.
    fn elements(&self, name: &str) -> Result<Elements, MeshError> {
        let file = &self.file;
        let Some(named) = &self.named else {
            return Err(MeshError::unusable(
                format!("{file}: this format has no named parts"),
                "use the whole file, or save it as OBJ, glTF or Gmsh",
            ));
        };
        if let Some(problem) = &named.problem {
            return Err(MeshError::unusable(
                problem,
                "use the whole file, or save it again",
            ));
        }
        let spans = |rank| {
            let parts = named.parts.iter();
            let parts = parts.filter(|it| it.label.has(name, rank) && it.has_mesh());
            parts.flat_map(|it| it.elements.clone()).collect::<Vec<_>>()
        };
        let mut spans = Some(spans(Rank::First))
            .filter(|spans| !spans.is_empty())
            .unwrap_or_else(|| spans(Rank::Second));
        if spans.is_empty() {
            let ranks = [Rank::First, Rank::Second];
            let mut parts = named.parts.iter();
            if parts.any(|part| ranks.iter().any(|&rank| part.label.has(name, rank))) {
                return Err(MeshError::unusable(
                    format!("{file}: the part “{}” has no mesh", shown(name)),
                    "use one with triangles, tetrahedra in Gmsh or lines in OBJ",
                ));
            }
            let names = self.names();
            if names.is_empty() {
                return Err(MeshError::unusable(
                    format!("{file}: the file has no named parts"),
                    "use the whole file, or give its objects names (in Gmsh: physical groups)",
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
        let (mut tetrahedra, mut triangles, mut segments) = (Vec::new(), Vec::new(), Vec::new());
        let (mut lines, mut ignored) = (0, 0);
        let mut done = Counts::default();
        let all_tetrahedra = match &self.whole {
            FileMesh::Tetrahedra(mesh) => mesh.tetrahedra.as_slice(),
            _ => &[],
        };
        let all_triangles = match &self.whole {
            FileMesh::Surface(surface) => &surface.triangles,
            _ => &self.triangles,
        };
        let all_segments = match &self.whole {
            FileMesh::Curves(curves) => &curves.segments,
            _ => &self.segments,
        };
        for Range { start, end } in spans {
            let (start, end) = (start.later(done), end.later(done));
            tetrahedra.extend_from_slice(&all_tetrahedra[start.tetrahedra..end.tetrahedra]);
            triangles.extend_from_slice(&all_triangles[start.triangles..end.triangles]);
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
        Ok(Elements {
            tetrahedra,
            triangles,
            segments,
            notes,
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

/// The vertices that elements use, ascending.
fn used<const N: usize>(elements: &[[u32; N]]) -> Vec<u32> {
    let mut used: Vec<u32> = elements.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    used
}

/// The vertices that elements use, in their order, by which the elements are renumbered. In a time that
/// does not depend on the other vertices: a file may have many parts.
fn take_used<const N: usize>(all: &[DVec3], elements: &mut [[u32; N]]) -> Vec<DVec3> {
    let used = used(elements);
    for corner in elements.iter_mut().flatten() {
        // Each is among those that are used.
        *corner = used.partition_point(|&other| other < *corner) as u32;
    }
    used.iter().map(|&it| all[it as usize]).collect()
}
