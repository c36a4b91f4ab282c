//! Built-in meshes, embedded in the binary so that an installed program needs no data folder.
//!
//! Sources and licenses are listed in `assets/meshes/README.md`.

use std::io;

use crate::{
    mesh::{FileMesh, MeshError, read::Parts},
    suggestion::similar,
};

/// A built-in mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Asset {
    /// Name used in scene files.
    pub name: &'static str,
    /// File name; its extension gives the format.
    pub file: &'static str,
    /// Short description.
    pub title: &'static str,
    bytes: &'static [u8],
}

macro_rules! asset {
    ($name:literal, $file:literal, $title:literal) => {
        Asset {
            name: $name,
            file: $file,
            title: $title,
            bytes: include_bytes!(concat!("../../assets/meshes/", $file)),
        }
    };
}

/// All built-in meshes, sorted by name. Those of Stanford, whose terms exclude commercial purposes, are
/// there with the feature `program` only.
pub const ASSETS: &[Asset] = &[
    asset!("arch", "arch.obj", "a rope over half a cylinder"),
    asset!("bowl", "bowl.obj", "a bowl"),
    #[cfg(feature = "program")]
    asset!("bunny", "bunny.obj", "the Stanford bunny"),
    #[cfg(feature = "program")]
    asset!(
        "bunny_coarse",
        "bunny_coarse.msh",
        "the Stanford bunny in 1970 tetrahedra"
    ),
    asset!("coil", "coil.obj", "a rope around a post"),
    #[cfg(feature = "program")]
    asset!("dragon", "dragon.obj", "the Stanford dragon"),
    asset!("knot", "knot.obj", "a rope with a knot"),
    asset!("stairs", "stairs.obj", "a staircase"),
    asset!("teapot", "teapot.obj", "the Utah teapot"),
];

/// Loads the built-in mesh with this name.
///
/// # Errors
/// [`MeshError::Unusable`] for another name, with the list of known names.
pub fn load(name: &str) -> Result<FileMesh, MeshError> {
    parts(name).map(Parts::into_whole)
}

/// Loads the built-in mesh with this name, with its named parts.
///
/// # Errors
/// As [`load`].
pub fn parts(name: &str) -> Result<Parts, MeshError> {
    let Some(asset) = ASSETS.iter().find(|asset| asset.name == name) else {
        let known: Vec<_> = ASSETS.iter().map(|asset| asset.name).collect();
        let known = known.join(", ");
        return Err(MeshError::Unusable {
            problem: format!("unknown built-in mesh '{name}'{}", similar(name, &known)),
            remedy: format!("expected one of: {known}"),
        });
    };
    Parts::of_bytes(asset.file, asset.bytes, &|_| {
        Err(io::ErrorKind::NotFound.into())
    })
}
