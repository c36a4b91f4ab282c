//! The meshes that come with the program: in it, so that an installed program needs no folder.
//!
//! Where they are from and under which licence is in `assets/meshes/README.md`.

use std::io;

use super::{FileMesh, MeshError, read};

/// A mesh that comes with the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Asset {
    /// What scene files call it.
    pub name: &'static str,
    /// The name of its file, which says its format.
    pub file: &'static str,
    /// What it is, in a few words.
    pub title: &'static str,
    bytes: &'static [u8],
}

macro_rules! asset {
    ($name:literal, $file:literal, $title:literal) => {
        Asset {
            name: $name,
            file: $file,
            title: $title,
            bytes: include_bytes!(concat!("../../../assets/meshes/", $file)),
        }
    };
}

/// All of them, sorted by name.
pub const ASSETS: &[Asset] = &[
    asset!("bunny", "bunny.obj", "the Stanford bunny"),
    asset!(
        "bunny_coarse",
        "bunny_coarse.msh",
        "the Stanford bunny in 1970 tetrahedra"
    ),
    asset!("dragon", "dragon.obj", "the Stanford dragon"),
    asset!("teapot", "teapot.obj", "the Utah teapot"),
];

/// Reads the mesh of a name.
///
/// # Errors
/// [`MeshError::UnknownAsset`], with the names that there are.
pub fn load(name: &str) -> Result<FileMesh, MeshError> {
    let Some(asset) = ASSETS.iter().find(|asset| asset.name == name) else {
        let known: Vec<_> = ASSETS.iter().map(|asset| asset.name).collect();
        return Err(MeshError::UnknownAsset {
            name: name.into(),
            known: known.join(", "),
        });
    };
    read::bytes(asset.file, asset.bytes, &|_| {
        Err(io::ErrorKind::NotFound.into())
    })
}
