//! A mesh file as a soft body: how its surface is filled, the material that it gets, and a scene of
//! its own, so that a mesh can be opened like a scene file.

use super::{Acceptance, BodySpec, MeshSpec, PartBounds, Scene, SceneEffects, SceneError};
use crate::{
    effect::OwnEffects,
    mesh::{BuildOptions, FileMesh, MeshError, SoftMesh, Treatment, build, read},
    solver::{
        Compliance, Contact, Density, Filling, Ground, Pressure, SelfContact, Settings, Stiffness,
        Stretch, Topology, Volume,
        rest::SleepSettings,
        topology::{Dimension, bounds},
    },
};
use glam::Vec3;
use std::{ops::RangeInclusive, path::Path};

/// Longest side of a mesh without a plausible size of its own [m].
pub const DEFAULT_SIZE: f32 = 0.6;
/// Plausible longest sides of a mesh file, which are taken as meters [m].
pub const PLAUSIBLE_SIZES: RangeInclusive<f64> = 0.05..=5.0;

/// Young's modulus of the material [Pa]: a firm jelly. An edge of length L carries about L² of it,
/// so its compliance is 1/(E·L).
const YOUNG: f32 = 4e4;
/// Air in a closed surface, which keeps it round.
const AIR: Pressure = Pressure {
    factor: Filling::of(1.05),
    bulk_modulus: Stiffness::of(101_325.0),
};
/// Clearance below the body, as a fraction of its height.
const CLEARANCE: f32 = 0.15;
/// Simulated time of a run without a window [s].
const SECONDS: f64 = 5.0;

/// A mesh file that is prepared for simulation.
#[derive(Debug)]
pub struct Fitted {
    /// The body.
    pub soft: SoftMesh,
    /// The options that worked.
    pub options: BuildOptions,
    /// What was chosen for the mesh: a size, or that it is a cloth.
    pub notes: Vec<String>,
}

/// The longest side of a mesh [m], if it is not plausible in meters.
fn implausible(mesh: &FileMesh) -> Option<f64> {
    let vertices = mesh.vertices();
    let low = vertices.iter().copied().reduce(|a, b| a.min(b));
    let high = vertices.iter().copied().reduce(|a, b| a.max(b));
    let extent = low
        .zip(high)
        .map_or(0.0, |(low, high)| (high - low).max_element());
    (!PLAUSIBLE_SIZES.contains(&extent)).then_some(extent)
}

/// Prepares a mesh for simulation, of this `size` [m], by default its own or, if that is not plausible,
/// [`DEFAULT_SIZE`]: fills a closed surface with `cells` along its longest side, by default few enough to
/// step the body in real time; an open surface becomes a cloth. May take seconds.
///
/// # Errors
/// Why the surface cannot be filled, if it cannot be a cloth either.
pub fn fit(mesh: FileMesh, size: Option<f32>, cells: Option<u32>) -> Result<Fitted, MeshError> {
    let mut notes = Vec::new();
    let scaled = implausible(&mesh).filter(|_| size.is_none());
    if let Some(own) = scaled {
        let ((low, high), own) = (PLAUSIBLE_SIZES.into_inner(), own as f32);
        notes.push(format!(
            "scaled from {own} m to {DEFAULT_SIZE} m, as its own size is not from {low} to {high} m; a scene \
             file with this mesh and no `size` keeps it"
        ));
    }
    let size = size.or(scaled.map(|_| DEFAULT_SIZE));
    let try_with = |mesh: FileMesh, cells, treatment| {
        let options = BuildOptions {
            size,
            cells,
            treatment,
            ..BuildOptions::default()
        };
        let soft = build(mesh, &options)?;
        Ok::<_, MeshError>((soft, options))
    };
    let (spare, cloth) = (mesh.clone(), mesh.clone());
    let mut filled = try_with(mesh, cells, Treatment::Fill);
    if filled.is_err() && cells.is_some() {
        // Parts finer than these cells may need others.
        filled = try_with(spare, None, Treatment::Fill);
    }
    let (soft, options) = filled.or_else(|error| {
        let Ok(shell) = try_with(cloth, None, Treatment::Shell) else {
            return Err(error);
        };
        notes.push(format!("imported as cloth: {error}"));
        Ok(shell)
    })?;
    Ok(Fitted {
        soft,
        options,
        notes,
    })
}

/// Density and effects of the default soft material, for any mesh size.
#[must_use]
pub fn material(topology: &Topology) -> (Density, SceneEffects) {
    let density = match topology.dimension {
        Dimension::Solid | Dimension::Grains => 1000.0,
        Dimension::Sheet => 0.3,
        Dimension::Line => 0.1,
    };
    let edges = topology.edges.ends();
    let count = edges.len().max(1);
    let length = |ends: [u32; 2]| {
        let [a, b] = ends.map(|end| topology.rest[end as usize]);
        a.distance(b)
    };
    let mean = edges.map(length).sum::<f32>() / count as f32;
    let compliance = match topology.dimension {
        Dimension::Solid => 1.0 / (YOUNG * mean),
        Dimension::Sheet | Dimension::Line | Dimension::Grains => 1e-5,
    };
    let solid = topology.dimension == Dimension::Solid;
    let is_hollow = topology.dimension == Dimension::Sheet && topology.enclosure().is_ok();
    let effects = SceneEffects {
        stretch: Some(Stretch {
            compliance: Compliance::new(compliance).unwrap_or_default(),
            ..Stretch::default()
        }),
        volume: solid.then(Volume::default),
        contact: Some(Contact::default()),
        self_contact: (!solid).then(SelfContact::default),
        pressure: is_hollow.then_some(AIR),
        ..SceneEffects::default()
    };
    (Density::new(density).unwrap_or_default(), effects)
}

/// What to look at: the file, and what it became.
fn look_at(file: &str, options: &BuildOptions) -> String {
    let kind = match options.treatment {
        Treatment::Shell => "cloth, as its surface is not closed",
        _ => "soft body",
    };
    format!("The mesh {file} as a {kind}.")
}

impl Scene {
    /// A scene with the body of a mesh file above the ground.
    ///
    /// # Errors
    /// [`SceneError::Mesh`] or [`SceneError::Topology`].
    pub fn of_mesh(path: &Path) -> Result<Self, SceneError> {
        let name = |part: Option<&std::ffi::OsStr>| {
            part.map_or_else(|| "mesh".to_owned(), |it| it.to_string_lossy().into_owned())
        };
        let (body, file) = (name(path.file_stem()), name(path.file_name()));
        let failed = |error| SceneError::Mesh {
            body: body.clone(),
            error,
        };
        let mesh = read::file(path).map_err(failed)?;
        let Fitted {
            soft,
            options,
            notes,
        } = fit(mesh, None, None).map_err(failed)?;
        let topology = Topology::new(soft.shape).map_err(|error| SceneError::Topology {
            body: body.clone(),
            error,
        })?;
        let (low, high) = bounds(topology.rest.iter().copied());
        let height = (high - low).y.max(0.1 * (high - low).max_element());
        let (density, effects) = material(&topology);
        let spec = BodySpec {
            name: body.clone(),
            primitive: None,
            mesh: Some(MeshSpec {
                file: file.clone(),
                part: None,
                bounds: PartBounds::default(),
                size: options.size,
                cells: options.cells,
                treatment: options.treatment,
            }),
            hair: None,
            material: None,
            density: Some(density),
            added_mass: Vec::new(),
            position: Vec3::Y * height * (0.5 + CLEARANCE),
            rotation: Vec3::ZERO,
            velocity: Vec3::ZERO,
            spin: Vec3::ZERO,
            sleep: None,
            effects: SceneEffects {
                ground: Some(Ground::default()),
                ..effects
            },
            groups: Vec::new(),
            pins: Vec::new(),
            stitches: Vec::new(),
            cuts: Vec::new(),
            start: Vec::new(),
            copies: None,
            color: None,
        };
        let notes = notes.into_iter().map(|note| format!("{body}: {note}"));
        Ok(Self {
            notes: notes.collect(),
            title: body,
            look_at: look_at(&file, &options),
            world: Settings::default(),
            sleep: SleepSettings::default(),
            bodies: vec![spec],
            colliders: Vec::new(),
            camera: None,
            frame: None,
            answers: Vec::new(),
            acceptance: Acceptance {
                seconds: SECONDS,
                checks: Vec::new(),
            },
            folder: path.parent().map(Into::into).unwrap_or_default(),
            own_effects: OwnEffects::default(),
            chooses_substeps: true,
        })
    }
}
