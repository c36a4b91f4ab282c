//! Sources of bodies that are added to a running scene, and building their meshes.

use std::path::PathBuf;

use bevy::prelude::*;

use crate::{
    mesh::{BuildOptions, FileMesh, MeshError, Primitive, SoftMesh, Treatment, build, read},
    sandbox::{panel::Addition, ui::message::capitalised},
    scene::asset,
};

/// Longest side of a mesh without a plausible size of its own [m].
const SIZE: f32 = 0.6;
/// Plausible longest sides of a mesh file, which are taken as meters [m].
const SENSIBLE: std::ops::RangeInclusive<f64> = 0.05..=5.0;

/// Fineness of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Detail {
    /// For one body.
    Normal,
    /// For a hundred bodies in real time.
    Coarse,
}

impl Detail {
    /// Cells along the longest side of a surface that is filled: few enough to step the body in
    /// real time.
    fn cells(self) -> u32 {
        match self {
            Self::Normal => 16,
            Self::Coarse => 6,
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
    pub(super) fn soft_mesh(&self) -> Result<SoftMesh, MeshError> {
        let (mesh, size, detail) = match self {
            Self::Primitive(primitive) => return primitive.build(),
            &Self::Asset(name, size, detail) => (asset::load(name)?, Some(size), detail),
            Self::File(path) => {
                let mesh = read::file(path)?;
                let sensible = SENSIBLE.contains(&extent(&mesh));
                (mesh, (!sensible).then_some(SIZE), Detail::Normal)
            }
        };
        let options = |cells, treatment| BuildOptions {
            size,
            cells,
            treatment,
        };
        let (spare, cloth) = (mesh.clone(), mesh.clone());
        let mut soft = build(mesh, &options(Some(detail.cells()), Treatment::Fill))
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
    let vertices = mesh.vertices();
    let low = vertices.iter().copied().reduce(|a, b| a.min(b));
    let high = vertices.iter().copied().reduce(|a, b| a.max(b));
    low.zip(high)
        .map_or(0.0, |(low, high)| (high - low).max_element())
}

/// Entries of the panel's list.
pub fn additions() -> Vec<Addition> {
    let primitives = primitives(SIZE, Detail::Normal);
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
