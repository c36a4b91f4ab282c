//! Where bodies come from that arrive in a running scene, and how their meshes are made.

use std::path::PathBuf;

use bevy::prelude::*;

use crate::{
    mesh::{BuildOptions, FileMesh, MeshError, Primitive, SoftMesh, Treatment, asset, build, read},
    sandbox::{panel::Addition, ui::message::capitalised},
};

/// Longest side of a mesh that says no size of its own that fits the stage [m].
const SIZE: f32 = 0.6;
/// Longest sides that are taken as metres [m].
const SENSIBLE: std::ops::RangeInclusive<f64> = 0.05..=5.0;

/// Cells along the longest side of a surface that is filled: few enough that a body of them is
/// stepped in real time.
const CELLS: u32 = 16;

/// Where a body comes from.
#[derive(Debug, Clone)]
pub(super) enum Source {
    /// Made.
    Primitive(Primitive),
    /// Comes with the program.
    Asset(&'static str),
    /// Read.
    File(PathBuf),
}

impl Source {
    /// The source of an entry of the panel's menu.
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

    /// Reads or makes the mesh, and makes a body's of it. May take seconds.
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
            // Finer parts than such cells may need the mesh's own resolution.
            .or_else(|_| build(spare, &options(None, Treatment::Fill)))
            .or_else(|error| {
                // An open surface cannot be filled, but it can be a cloth.
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

/// Longest side of a mesh in its own unit.
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

/// The entries of the panel's menu.
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

/// The title of an entry: `bunny_coarse` is “Bunny (coarse)”.
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
