//! Reads mesh files: OBJ and glTF surfaces; Gmsh, TetGen and Medit tetrahedra.
//!
//! A reader returns the content of the file in the unit of the file, without repairs; returned
//! values are finite and indices are in range. Everything else is an error that names the file and
//! the line (in glTF, the mesh and the primitive). Counts in a file are not trusted before the data
//! is present, and repeated instances in a glTF scene are limited, so that a short file cannot
//! exhaust memory.
//!
//! A file is one mesh; [`Parts`] has the named parts of glTF, OBJ and Gmsh, for several bodies of one
//! file.

use std::{io, path::Path};

use super::{FileMesh, MeshError};

mod gltf;
mod gltf_data;
mod gltf_geometry;
mod gmsh;
mod medit;
mod obj;
mod parts;
mod tetgen;
mod text;

pub use parts::Parts;
pub(crate) use parts::shown;

/// Supported file name extensions, in lower case.
pub const ENDINGS: [&str; 7] = ["obj", "gltf", "glb", "msh", "node", "ele", "mesh"];

/// Reads a file next to the mesh file, by name.
pub type Beside<'a> = dyn Fn(&str) -> io::Result<Vec<u8>> + 'a;

/// Reads a mesh file. The extension selects the format ([`ENDINGS`], case-insensitive); a TetGen
/// pair is read by the name of either file.
///
/// # Errors
/// [`MeshError::Unreadable`], [`MeshError::UnknownFormat`], [`MeshError::Text`] or
/// [`MeshError::Content`].
pub fn file(path: &Path) -> Result<FileMesh, MeshError> {
    Parts::of_file(path).map(Parts::into_whole)
}

/// Reads a mesh file from memory. `name` selects the format and identifies the file in errors;
/// `beside` reads files that the mesh refers to (a glTF buffer, the other file of a TetGen pair).
///
/// # Errors
/// As [`file()`].
pub fn bytes(name: &str, bytes: &[u8], beside: &Beside) -> Result<FileMesh, MeshError> {
    Parts::of_bytes(name, bytes, beside).map(Parts::into_whole)
}

fn format_of(name: &str) -> Result<String, MeshError> {
    let ending = name
        .rsplit_once('.')
        .map(|(_, ending)| ending.to_ascii_lowercase())
        .filter(|ending| ENDINGS.contains(&ending.as_str()));
    ending.ok_or_else(|| MeshError::UnknownFormat { file: name.into() })
}
