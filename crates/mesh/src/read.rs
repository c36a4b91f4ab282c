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

use std::{fs, path::Path};

use super::{FileMesh, MeshError};

mod beside;
mod gltf;
mod gltf_data;
mod gltf_geometry;
mod gmsh;
mod medit;
mod obj;
mod parts;
mod tetgen;
mod text;

pub use beside::Beside;
pub use parts::Parts;

/// Supported file name extensions, in lower case.
pub const ENDINGS: [&str; 7] = ["obj", "gltf", "glb", "msh", "node", "ele", "mesh"];

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

impl Parts {
    /// Reads a mesh file, as [`file()`].
    ///
    /// # Errors
    /// As [`file()`].
    pub fn of_file(path: &Path) -> Result<Self, MeshError> {
        let name = path.display().to_string();
        format_of(&name)?;
        let contents = fs::read(path).map_err(|source| MeshError::Unreadable {
            file: name.clone(),
            source,
        })?;
        Self::of_bytes(&name, &contents, &|beside| {
            fs::read(path.with_file_name(beside))
        })
    }

    /// Reads a mesh file from memory, as [`bytes()`].
    ///
    /// # Errors
    /// As [`file()`].
    pub fn of_bytes(name: &str, bytes: &[u8], beside: &Beside) -> Result<Self, MeshError> {
        let whole = match format_of(name)?.as_str() {
            "obj" => return obj::read(name, bytes),
            "gltf" | "glb" => return gltf::read(name, bytes, beside),
            "msh" => return gmsh::read(name, bytes),
            "node" | "ele" => tetgen::read(name, bytes, beside),
            _ => medit::read(name, bytes),
        }?;
        Ok(Self::unnamed(name, whole))
    }
}

fn format_of(name: &str) -> Result<String, MeshError> {
    let ending = name
        .rsplit_once('.')
        .map(|(_, ending)| ending.to_ascii_lowercase())
        .filter(|ending| ENDINGS.contains(&ending.as_str()));
    ending.ok_or_else(|| MeshError::UnknownFormat { file: name.into() })
}
