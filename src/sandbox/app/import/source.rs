//! Sources of bodies that are added to a running scene, and building their meshes.

use std::path::PathBuf;

use bevy::prelude::*;

use crate::{
    mesh::{BuildOptions, FileMesh, MeshError, Primitive, SoftMesh, Treatment, asset, build, read},
    sandbox::{panel::Addition, ui::message::capitalised},
};

/// Longest side of a mesh without a plausible size of its own [m].
const SIZE: f32 = 0.6;
/// Plausible longest sides of a mesh file, which are taken as meters [m].
const SENSIBLE: std::ops::RangeInclusive<f64> = 0.05..=5.0;

/// Cells along the longest side of a surface that is filled: few enough to step the body in real
/// time.
const CELLS: u32 = 16;

/// Source of a body.
#[derive(Debug, Clone)]
pub(super) enum Source {
    /// Generated.
    Primitive(Primitive),
    /// Built-in mesh.
    Asset(&'static str),
    /// Mesh file.
    File(PathBuf),
}

impl Source {
    /// Source for an entry of the panel's menu.
    pub(super) fn named(name: &str) -> Option<Self> {
        let primitive = primitives()
            .into_iter()
            .find(|(entry, _)| *entry == name)
            .map(|(_, primitive)| Self::Primitive(primitive));
        primitive.or_else(|| {
            let asset = asset::ASSETS.iter().find(|asset| asset.name == name)?;
            Some(Self::Asset(asset.name))
        })
    }

    /// Reads or generates the mesh, and prepares it for simulation. May take seconds.
    pub(super) fn soft_mesh(&self) -> Result<SoftMesh, MeshError> {
        let (mesh, size) = match self {
            Self::Primitive(primitive) => return primitive.build(),
            Self::Asset(name) => (asset::load(name)?, Some(SIZE)),
            Self::File(path) => {
                let mesh = read::file(path)?;
                let sensible = SENSIBLE.contains(&extent(&mesh));
                (mesh, (!sensible).then_some(SIZE))
            }
        };
        let options = |cells, treatment| BuildOptions {
            size,
            cells,
            treatment,
        };
        let (spare, cloth) = (mesh.clone(), mesh.clone());
        let mut soft = build(mesh, &options(Some(CELLS), Treatment::Fill))
            // Parts finer than these cells may need the mesh's own resolution.
            .or_else(|_| build(spare, &options(None, Treatment::Fill)))
            .or_else(|error| {
                // An open surface cannot be filled; it becomes a cloth.
                let mut cloth =
                    build(cloth, &options(None, Treatment::Shell)).map_err(|_| error)?;
                cloth
                    .notes
                    .push("mesh is not closed: imported as cloth".to_owned());
                Ok::<_, MeshError>(cloth)
            })?;
        if let (Some(size), Self::File(_)) = (size, self) {
            soft.notes.push(format!(
                "scaled to {size} m: its size is not between {} and {} m",
                SENSIBLE.start(),
                SENSIBLE.end()
            ));
        }
        Ok(soft)
    }
}

/// Longest side of a mesh, in the unit of its file.
fn extent(mesh: &FileMesh) -> f64 {
    let vertices = match mesh {
        FileMesh::Surface(surface) => &surface.vertices,
        FileMesh::Tetrahedra(solid) => &solid.vertices,
    };
    let low = vertices.iter().copied().reduce(|a, b| a.min(b));
    let high = vertices.iter().copied().reduce(|a, b| a.max(b));
    low.zip(high)
        .map_or(0.0, |(low, high)| (high - low).max_element())
}

/// Entries of the panel's menu.
pub fn additions() -> Vec<Addition> {
    let primitives = primitives();
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

fn primitives() -> [(&'static str, Primitive); 6] {
    [
        (
            "box",
            Primitive::Box {
                size: Vec3::splat(0.5),
                cells: UVec3::splat(6),
            },
        ),
        (
            "sphere",
            Primitive::Sphere {
                radius: 0.3,
                cells: 8,
            },
        ),
        (
            "torus",
            Primitive::Torus {
                major: 0.3,
                minor: 0.12,
                cells: 6,
            },
        ),
        (
            "cylinder",
            Primitive::Cylinder {
                radius: 0.2,
                height: 0.5,
                cells: 8,
            },
        ),
        (
            "cloth",
            Primitive::Cloth {
                size: Vec2::splat(1.0),
                cells: UVec2::splat(20),
                diagonals: default(),
                shear: true,
            },
        ),
        (
            "rope",
            Primitive::Rope {
                length: 1.2,
                segments: 32,
            },
        ),
    ]
}
