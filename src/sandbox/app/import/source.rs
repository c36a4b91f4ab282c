//! Sources of bodies that are added to a running scene, and building their meshes.

use std::path::PathBuf;

use bevy::prelude::*;

use crate::{
    mesh::{MeshError, Primitive, SoftMesh, read},
    sandbox::{panel::Addition, ui::message::capitalised},
    scene::{
        MeshSpec, PartBounds, asset,
        mesh_file::{self, Fitted},
        save::MeshSource,
    },
};

/// Fineness of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Detail {
    /// For one body.
    Normal,
    /// For a hundred bodies in real time.
    Coarse,
}

impl Detail {
    /// Cells along the longest side of a surface that is filled; by default few enough to step the
    /// body in real time.
    fn cells(self) -> Option<u32> {
        match self {
            Self::Normal => None,
            Self::Coarse => Some(6),
        }
    }
}

/// Source of a body.
#[derive(Debug, Clone)]
pub(super) enum Source {
    /// Generated.
    Primitive(Primitive),
    /// Built-in mesh, and the length of its longest side [m].
    Asset(&'static str, f32, Detail),
    /// Mesh file.
    File(PathBuf),
}

impl Source {
    /// Source for an entry of the panel's list, with the length of its longest side [m].
    pub(super) fn named(name: &str, size: f32, detail: Detail) -> Option<Self> {
        let primitive = primitives(size, detail)
            .into_iter()
            .find(|(entry, _)| *entry == name)
            .map(|(_, primitive)| Self::Primitive(primitive));
        primitive.or_else(|| {
            let asset = asset::ASSETS.iter().find(|asset| asset.name == name)?;
            Some(Self::Asset(asset.name, size, detail))
        })
    }

    /// Reads or generates the mesh, and prepares it for simulation. May take seconds.
    /// Also returns how a scene file defines it.
    pub(super) fn soft_mesh(&self) -> Result<(SoftMesh, MeshSource), MeshError> {
        let (mesh, size, detail) = match self {
            Self::Primitive(primitive) => {
                let source = MeshSource::Primitive(*primitive);
                return Ok((primitive.build()?, source));
            }
            &Self::Asset(name, size, detail) => (asset::load(name)?, Some(size), detail),
            Self::File(path) => (read::file(path)?, None, Detail::Normal),
        };
        let Fitted {
            mut soft,
            options,
            notes,
        } = mesh_file::fit(mesh, size, detail.cells())?;
        soft.notes.extend(notes);
        let source = MeshSource::File(MeshSpec {
            file: self.file(),
            part: None,
            bounds: PartBounds::default(),
            size: options.size,
            cells: options.cells,
            treatment: options.treatment,
        });
        Ok((soft, source))
    }

    /// Name of a built-in mesh, or absolute path of a file.
    fn file(&self) -> String {
        match self {
            Self::Primitive(_) => String::new(),
            Self::Asset(name, ..) => (*name).to_owned(),
            Self::File(path) => {
                let path = std::path::absolute(path).unwrap_or_else(|_| path.clone());
                path.to_string_lossy().into_owned()
            }
        }
    }
}

/// Entries of the panel's list.
pub fn additions() -> Vec<Addition> {
    let primitives = primitives(mesh_file::DEFAULT_SIZE, Detail::Normal);
    let count = primitives.len();
    let names = primitives.into_iter().map(|(name, _)| name);
    let assets = asset::ASSETS.iter().map(|asset| asset.name);
    names
        .chain(assets)
        .enumerate()
        .map(|(index, name)| Addition {
            name: name.to_owned(),
            title: title(name),
            begins_group: index == count,
        })
        .collect()
}

/// Title of an entry: `bunny_coarse` becomes “Bunny (coarse)”.
fn title(name: &str) -> String {
    match name.split_once('_') {
        Some((name, variant)) => format!("{} ({variant})", capitalised(name)),
        None => capitalised(name),
    }
}

/// Generated bodies with the length of their longest side [m].
fn primitives(size: f32, detail: Detail) -> [(&'static str, Primitive); 8] {
    let by = |normal: u32, coarse: u32| match detail {
        Detail::Normal => normal,
        Detail::Coarse => coarse,
    };
    [
        (
            "box",
            Primitive::Box {
                size: Vec3::splat(size),
                cells: UVec3::splat(by(6, 2)),
            },
        ),
        (
            "sphere",
            Primitive::Sphere {
                radius: 0.5 * size,
                cells: by(8, 4),
            },
        ),
        (
            "torus",
            Primitive::Torus {
                major: 0.36 * size,
                minor: 0.14 * size,
                cells: by(6, 2),
            },
        ),
        (
            "cylinder",
            Primitive::Cylinder {
                radius: 0.2 * size,
                height: size,
                cells: by(8, 2),
            },
        ),
        (
            "cloth",
            Primitive::Cloth {
                size: Vec2::splat(size),
                cells: UVec2::splat(by(20, 8)),
                diagonals: default(),
                shear: true,
            },
        ),
        (
            "tube",
            Primitive::Tube {
                radius: 0.3 * size,
                height: size,
                cells: UVec2::new(by(32, 12), by(16, 6)),
            },
        ),
        (
            "balloon",
            Primitive::Balloon {
                radius: 0.5 * size,
                cells: by(8, 3),
            },
        ),
        (
            "rope",
            Primitive::Rope {
                length: size,
                segments: by(32, 16),
            },
        ),
    ]
}
