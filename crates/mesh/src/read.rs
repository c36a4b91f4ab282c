//! Reads mesh files: OBJ and glTF surfaces; Gmsh, TetGen and Medit tetrahedra.
//!
//! A reader gives back what the file says, in the file's unit, and mends nothing; but whatever it
//! gives back is finite and has its indices in range. Everything else is an error that names the
//! file and the line (in glTF, the mesh and the primitive). No count that a file claims is believed
//! before the data is there, and what a glTF scene shows many times has a limit, so a short file never
//! takes much memory.

use std::{fs, io, path::Path};

use super::{FileMesh, MeshError};

mod gltf;
mod gltf_data;
mod gmsh;
mod medit;
mod obj;
mod tetgen;
mod text;

/// The endings of the names of files that can be read, in lower case.
pub const ENDINGS: [&str; 7] = ["obj", "gltf", "glb", "msh", "node", "ele", "mesh"];

/// Gives the bytes of a file beside the one that is read, by its name.
pub type Beside<'a> = dyn Fn(&str) -> io::Result<Vec<u8>> + 'a;

/// Reads a mesh file. The ending of its name says the format ([`ENDINGS`], upper or lower case); a
/// TetGen pair is read by the name of either file.
///
/// # Errors
/// [`MeshError::Unreadable`], [`MeshError::UnknownFormat`], [`MeshError::Text`] or
/// [`MeshError::Content`].
pub fn file(path: &Path) -> Result<FileMesh, MeshError> {
    let name = path.display().to_string();
    format_of(&name)?;
    let contents = fs::read(path).map_err(|source| MeshError::Unreadable {
        file: name.clone(),
        source,
    })?;
    bytes(&name, &contents, &|beside| {
        fs::read(path.with_file_name(beside))
    })
}

/// Reads a mesh file that is in memory. `name` says the format, and is what errors call the file;
/// `beside` is asked for a file that the mesh refers to (a glTF buffer, the other file of a TetGen
/// pair).
///
/// # Errors
/// As [`file()`].
pub fn bytes(name: &str, bytes: &[u8], beside: &Beside) -> Result<FileMesh, MeshError> {
    match format_of(name)?.as_str() {
        "obj" => obj::read(name, bytes),
        "gltf" | "glb" => gltf::read(name, bytes, beside),
        "msh" => gmsh::read(name, bytes),
        "node" | "ele" => tetgen::read(name, bytes, beside),
        _ => medit::read(name, bytes),
    }
}

fn format_of(name: &str) -> Result<String, MeshError> {
    let ending = name
        .rsplit_once('.')
        .map(|(_, ending)| ending.to_ascii_lowercase())
        .filter(|ending| ENDINGS.contains(&ending.as_str()));
    ending.ok_or_else(|| MeshError::UnknownFormat { file: name.into() })
}
