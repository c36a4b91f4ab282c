//! glTF 2.0, `.gltf` and `.glb`: the triangles of the default scene, each mesh once per node that
//! refers to it, with the transform of the node.
//!
//! Materials, skins, morph targets and animations are ignored, and extensions that are about looks.
//! Points and lines are left out with a note. Positions may be quantized. Compressed and sparse data
//! is rejected. Nodes and meshes with a name are parts.

use std::{collections::BTreeSet, sync::Arc};

use glam::{DMat4, Mat4};
use gltf::{Document, Node, Semantic, mesh::Mode};

use super::{
    beside::Beside,
    gltf_data::Data,
    gltf_geometry::{Refused, geometry},
    parts::{Counts, Label, Named, Part, Parts},
};
use crate::{FileMesh, MeshError, SurfaceMesh};

pub fn read(file: &str, bytes: &[u8], beside: &Beside) -> Result<Parts, MeshError> {
    let (json, blob) = if bytes.starts_with(b"glTF") {
        chunks(bytes).map_err(|problem| content(file, "the GLB container", problem))?
    } else {
        (bytes, None)
    };
    let (json, notes) =
        geometry(json).map_err(|Refused { place, problem }| content(file, place, problem))?;
    let document = gltf::Gltf::from_slice(&json)
        .map_err(|error| content(file, "the JSON", error.to_string()))?
        .document;
    let data = Data::load(file, &document, blob, beside)?;
    let mut reader = Reader {
        file,
        data,
        surface: SurfaceMesh::default(),
        other_primitives: 0,
        visited: BTreeSet::new(),
        mesh_names: document.meshes().map(|mesh| named(mesh.name())).collect(),
        parts: Vec::new(),
    };
    reader.document(&document)?;
    let (mut surface, parts) = (reader.surface, reader.parts);
    if surface.triangles.is_empty() {
        let problem = missing(
            document.meshes().len(),
            reader.other_primitives,
            surface.vertices.is_empty(),
        );
        return Err(content(file, "the scene", problem));
    }
    surface.notes.clone_from(&notes);
    if reader.other_primitives > 0 {
        let note = format!("{IGNORED}: {}", reader.other_primitives);
        surface.notes.push(note);
    }
    Ok(Parts {
        file: file.into(),
        whole: FileMesh::Surface(surface),
        triangles: Vec::new(),
        segments: Vec::new(),
        named: Some(Named {
            parts,
            notes,
            ignored: IGNORED,
            problem: None,
        }),
    })
}

/// What a scene without triangles lacks: the meshes of the file, those of points or lines that it shows, and
/// whether it shows none of triangles.
fn missing(meshes: usize, other_primitives: usize, is_empty: bool) -> String {
    let why = match (meshes, other_primitives) {
        (0, _) => "the file has no meshes; export them with it".to_owned(),
        (_, 0) if is_empty => format!("no node of it shows a mesh, of {meshes} in the file"),
        (_, 0) => "its meshes have none".to_owned(),
        (_, others) => format!("only points or lines, in {others} of its primitives"),
    };
    format!("has no triangles: {why}")
}

/// Note about what is ignored.
const IGNORED: &str = "primitives of points or lines ignored";

/// The name of a node or a mesh, if it has one.
fn named(name: Option<&str>) -> Option<Arc<str>> {
    name.filter(|name| !name.is_empty()).map(Into::into)
}

/// An error in a part of the file.
pub(super) fn content(
    file: &str,
    place: impl Into<String>,
    problem: impl Into<String>,
) -> MeshError {
    MeshError::Content {
        file: file.into(),
        place: place.into(),
        problem: problem.into(),
    }
}

/// The JSON and the binary chunk of a GLB file. Reference: glTF 2.0, section 4.4.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let word = |at: usize| {
        let word = bytes.get(at..at + 4).and_then(|b| b.try_into().ok());
        word.map(u32::from_le_bytes)
            .ok_or_else(|| format!("ends after {} bytes, within a header", bytes.len()))
    };
    let version = word(4)?;
    if version != 2 {
        return Err(format!("is of version {version}; expected 2"));
    }
    let chunk = |at: usize, kind: &[u8; 4], name: &str| {
        let length = word(at)? as usize;
        if word(at + 4)? != u32::from_le_bytes(*kind) {
            return Err(format!("has another chunk where {name} was expected"));
        }
        let end = (at + 8).checked_add(length);
        end.and_then(|end| bytes.get(at + 8..end)).ok_or_else(|| {
            let left = bytes.len() - (at + 8).min(bytes.len());
            format!("says {length} bytes of {name}, but ends after {left} of them")
        })
    };
    let json = chunk(12, b"JSON", "JSON")?;
    let next = 20 + json.len();
    if next >= bytes.len() {
        return Ok((json, None));
    }
    Ok((json, Some(chunk(next, b"BIN\0", "binary data")?)))
}

/// Limit on vertices and triangles of a scene beyond those in its buffers. Nodes may share a mesh,
/// and primitives their data, so a short file could expand without limit.
const MAX_REPEATED: usize = 4_000_000;

struct Reader<'a> {
    file: &'a str,
    data: Data<'a>,
    surface: SurfaceMesh,
    other_primitives: usize,
    /// Visited nodes; a node may have only one parent.
    visited: BTreeSet<usize>,
    /// Name of each mesh, which many nodes may show.
    mesh_names: Vec<Option<Arc<str>>>,
    parts: Vec<Part>,
}

/// A step of the walk through the nodes.
enum Step<'a> {
    /// A node, with the transform of the one above.
    Enter(Node<'a>, DMat4),
    /// The end of the nodes below one, which are this part and begin here.
    Leave(usize, Counts),
}

impl Reader<'_> {
    fn document(&mut self, document: &Document) -> Result<(), MeshError> {
        let scene = document
            .default_scene()
            .or_else(|| document.scenes().next());
        let enter = |transform| move |node| Step::Enter(node, transform);
        let mut waiting: Vec<Step> = match scene {
            Some(scene) => scene.nodes().map(enter(DMat4::IDENTITY)).collect(),
            // A mesh library without a scene.
            None => {
                for mesh in document.meshes() {
                    self.mesh(&mesh, DMat4::IDENTITY)?;
                }
                Vec::new()
            }
        };
        waiting.reverse();
        while let Some(step) = waiting.pop() {
            let (node, above) = match step {
                Step::Enter(node, above) => (node, above),
                Step::Leave(part, begin) => {
                    let below = begin..self.counts();
                    self.parts[part].elements.push(below);
                    continue;
                }
            };
            if !self.visited.insert(node.index()) {
                let place = format!("node {}", node.index());
                let problem = "has two parents or is its own ancestor; expected a tree";
                return Err(content(self.file, place, problem));
            }
            let own = Mat4::from_cols_array_2d(&node.transform().matrix()).as_dmat4();
            let transform = above * own;
            let begin = self.counts();
            if let Some(mesh) = node.mesh() {
                self.mesh(&mesh, transform)?;
            }
            if let Some(name) = named(node.name()) {
                let elements = match node.mesh() {
                    Some(_) => vec![begin..self.counts()],
                    None => {
                        waiting.push(Step::Leave(self.parts.len(), begin));
                        Vec::new()
                    }
                };
                let label = Label::Object(name);
                self.parts.push(Part { label, elements });
            }
            let first = waiting.len();
            waiting.extend(node.children().map(enter(transform)));
            waiting[first..].reverse();
        }
        Ok(())
    }

    fn counts(&self) -> Counts {
        Counts {
            triangles: self.surface.triangles.len(),
            ignored: self.other_primitives,
            ..Counts::default()
        }
    }

    fn mesh(&mut self, mesh: &gltf::Mesh, transform: DMat4) -> Result<(), MeshError> {
        let begin = self.counts();
        for primitive in mesh.primitives() {
            let name = mesh
                .name()
                .map_or(String::new(), |name| format!(" '{name}'"));
            let (mesh, number) = (mesh.index(), primitive.index());
            let place = format!("mesh {mesh}{name}, primitive {number}");
            self.primitive(&primitive, transform)
                .map_err(|problem| content(self.file, place, problem))?;
        }
        if let Some(name) = self.mesh_names.get(mesh.index()).and_then(Clone::clone) {
            self.parts.push(Part {
                label: Label::Mesh(name),
                elements: vec![begin..self.counts()],
            });
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &gltf::Primitive, transform: DMat4) -> Result<(), String> {
        if !matches!(
            primitive.mode(),
            Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
        ) {
            self.other_primitives += 1;
            return Ok(());
        }
        let accessor = primitive
            .get(&Semantic::Positions)
            .ok_or("has no POSITION; expected the positions of its vertices")?;
        let positions = self.data.positions(&accessor)?;
        let indices = match primitive.indices() {
            Some(accessor) => self.data.indices(&accessor)?,
            None => (0..positions.len() as u32).collect(),
        };
        if let Some(wrong) = indices.iter().find(|i| **i as usize >= positions.len()) {
            let count = positions.len();
            return Err(format!("has the index {wrong}, but only {count} vertices"));
        }
        let base = self.surface.vertices.len();
        let shown = base + positions.len() + self.surface.triangles.len() + indices.len();
        let most = MAX_REPEATED + self.data.bytes();
        if shown > most {
            return Err(format!(
                "instances expand the scene to {shown} vertices and triangle indices, but at most {most} \
                 are read from a file of this size; remove instances"
            ));
        }
        for (number, position) in positions.into_iter().enumerate() {
            let placed = transform.transform_point3(position);
            if !placed.is_finite() {
                return Err(format!(
                    "vertex {number} is at {placed}; expected finite numbers"
                ));
            }
            self.surface.vertices.push(placed);
        }
        let corner = |i: u32| base as u32 + i;
        let mirrored = transform.determinant() < 0.0;
        for [a, b, c] in triangles(primitive.mode(), &indices)? {
            let [a, b, c] = [corner(a), corner(b), corner(c)];
            let facing = if mirrored { [a, c, b] } else { [a, b, c] };
            self.surface.triangles.push(facing);
        }
        Ok(())
    }
}

fn triangles(mode: Mode, indices: &[u32]) -> Result<Vec<[u32; 3]>, String> {
    match mode {
        Mode::TriangleStrip => Ok(indices
            .windows(3)
            .enumerate()
            .map(|(k, w)| {
                if k % 2 == 0 {
                    [w[0], w[1], w[2]]
                } else {
                    [w[1], w[0], w[2]]
                }
            })
            .collect()),
        Mode::TriangleFan => {
            let (first, rest) = indices.split_first().ok_or("has no indices")?;
            Ok(rest.windows(2).map(|w| [*first, w[0], w[1]]).collect())
        }
        _ if indices.len().is_multiple_of(3) => Ok(indices
            .chunks_exact(3)
            .map(|t| [t[0], t[1], t[2]])
            .collect()),
        _ => Err(format!(
            "has {} indices; expected a multiple of three",
            indices.len()
        )),
    }
}
