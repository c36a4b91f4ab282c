//! Snapshots and their file format.
//!
//! A file begins with eight letters, the format version (u32), the number of bytes that follow
//! (u64) and their checksum (u64, FNV-1a), all numbers little-endian. The rest is
//! [postcard](https://postcard.jamesmunns.com). Of a mesh, it contains the rest shape and the
//! numbering of the particles; everything else is recomputed. Effects of an app follow at the end, if
//! there are any: of each body that carries one, its index, name and parameters as text, so that an
//! app may add parameters with defaults and still reads older files; then, of each body to which the app
//! does something, its index and what that is.

use super::{
    SnapshotError,
    stored::{Stored, StoredOwn, own_effects, set_controls, stored_controls},
};
use crate::{
    effect::{EffectRegistry, OwnEffects},
    file,
    scene::{Acceptance, BuiltScene, CameraSpec, CurrentScene, Look, Scene},
    simulation::{
        BodySkin, NewBody, SimulationClock, SpawnOrders,
        plain::{self, bodies_in_order, colliders_in_order},
    },
    solver::{self, measure::fnv1a},
};
use bevy::prelude::World;
use serde::de::DeserializeOwned;
use std::{
    fs::File,
    io::{self, Read},
    path::Path,
    sync::Arc,
};

/// Description of a snapshot's scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct About {
    /// Name in the registry, or path.
    pub name: String,
    /// Title.
    pub title: String,
    /// What to look at.
    pub look_at: String,
    /// Initial camera; `None` frames all bodies.
    pub camera: Option<CameraSpec>,
}

impl From<&CurrentScene> for About {
    fn from(current: &CurrentScene) -> Self {
        Self {
            name: current.name.clone(),
            title: current.scene.title.clone(),
            look_at: current.scene.look_at.clone(),
            camera: current.scene.camera,
        }
    }
}

/// The whole state of a simulation.
///
/// ```
/// use pliant::{
///     recording::{About, Snapshot},
///     scene::{Scene, run::headless},
///     simulation::{state_hash, tick},
/// };
///
/// let current = Scene::load("jelly_cube")?;
/// let mut app = headless(&current.scene.build()?);
/// tick(app.world_mut());
/// let bytes = Snapshot::take(app.world_mut(), About::from(&current))?.to_bytes();
///
/// let mut restored = headless(&Snapshot::from_bytes(&bytes)?.built);
/// assert_eq!(state_hash(app.world_mut()), state_hash(restored.world_mut()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Snapshot {
    /// Description of the scene.
    pub about: About,
    /// The state; [`scene::spawn`](crate::scene::spawn) puts it into a world.
    pub built: BuiltScene,
}

const MAGIC: &[u8; 8] = b"PLIANTsn";
/// Other versions are not read.
const VERSION: u32 = 20;
const HEAD: usize = 28;

impl Snapshot {
    /// A snapshot of a state, such as that of a scene at its start.
    #[must_use]
    pub const fn new(about: About, built: BuiltScene) -> Self {
        Self { about, built }
    }

    /// Takes a snapshot of a world between two ticks. Pending actions are not part of it.
    ///
    /// # Errors
    /// [`SnapshotError::MidTick`]; [`SnapshotError::Effect`] if a body carries an effect of an app that
    /// is not [saved](crate::effect::EffectPlugin::saved), and [`SnapshotError::EffectText`] if it cannot
    /// be written.
    pub fn take(world: &mut World, about: About) -> Result<Self, SnapshotError> {
        if world.resource::<SimulationClock>().mid_tick() {
            return Err(SnapshotError::MidTick);
        }
        let own = own_effects(world)?;
        let bodies = bodies_in_order(world);
        let skins = bodies
            .iter()
            .map(|&body| world.get::<BodySkin>(body).map(|skin| Arc::clone(&skin.0)))
            .collect();
        let looks = bodies
            .iter()
            .map(|&body| world.get::<Look>(body).copied().unwrap_or_default())
            .collect();
        let collider_looks = colliders_in_order(world)
            .into_iter()
            .map(|collider| world.get::<Look>(collider).copied().unwrap_or_default())
            .collect();
        let built = BuiltScene {
            world: plain::capture(world),
            skins,
            looks,
            collider_looks,
            places: Some(plain::places(world)),
            camera: about.camera,
            frame: None,
            notes: Vec::new(),
            own,
            own_effects: world.resource::<EffectRegistry>().own(),
        };
        Ok(Self { about, built })
    }

    /// A snapshot of one body alone.
    pub(super) fn of(new: &NewBody) -> Self {
        let world = solver::World {
            bodies: vec![new.body.clone()],
            ..solver::World::default()
        };
        let places = SpawnOrders {
            bodies: vec![Default::default()],
            ..SpawnOrders::default()
        };
        Self {
            about: About::default(),
            built: BuiltScene {
                world,
                skins: vec![new.skin.clone()],
                looks: vec![Look::default()],
                collider_looks: Vec::new(),
                places: Some(places),
                camera: None,
                frame: None,
                notes: Vec::new(),
                own: vec![new.own.clone()],
                own_effects: OwnEffects::default(),
            },
        }
    }

    /// The snapshot as an open scene, without an acceptance.
    #[must_use]
    pub fn scene(&self) -> CurrentScene {
        CurrentScene {
            name: self.about.name.clone(),
            path: None,
            scene: Scene {
                title: self.about.title.clone(),
                look_at: self.about.look_at.clone(),
                world: self.built.world.settings,
                sleep: self.built.world.sleep,
                bodies: Vec::new(),
                colliders: Vec::new(),
                camera: self.about.camera,
                frame: None,
                answers: Vec::new(),
                acceptance: Acceptance {
                    seconds: 5.0,
                    checks: Vec::new(),
                },
                folder: Default::default(),
                own_effects: self.built.own_effects.clone(),
                chooses_substeps: false,
                notes: Vec::new(),
            },
        }
    }

    /// Encodes the snapshot as the bytes of a file.
    ///
    /// # Panics
    /// Never: every state can be encoded.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut content = postcard::to_stdvec(&Stored::of(self)).unwrap_or_default();
        let own = StoredOwn::all(&self.built);
        let controls = stored_controls(&self.built.world.bodies);
        if !own.is_empty() || !controls.is_empty() {
            content.extend(postcard::to_stdvec(&own).unwrap_or_default());
        }
        if !controls.is_empty() {
            content.extend(postcard::to_stdvec(&controls).unwrap_or_default());
        }
        let mut bytes = Vec::with_capacity(HEAD + content.len());
        bytes.extend(MAGIC);
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend((content.len() as u64).to_le_bytes());
        bytes.extend(fnv1a(&content).to_le_bytes());
        bytes.extend(content);
        bytes
    }

    /// Decodes the bytes of a file.
    ///
    /// # Errors
    /// [`SnapshotError`] for bytes of another kind or version, and for truncated, damaged or
    /// invalid ones; [`SnapshotError::UnknownEffect`] for one with effects of an app.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, SnapshotError> {
        Self::from_bytes_with(bytes, &OwnEffects::default())
    }

    /// The same for a snapshot with effects of an app.
    ///
    /// # Errors
    /// As [`from_bytes`](Self::from_bytes); [`SnapshotError::UnknownEffect`] if an effect is not among
    /// these, and [`SnapshotError::EffectText`] if its parameters are invalid.
    pub fn from_bytes_with(bytes: &[u8], own: &OwnEffects) -> Result<Self, SnapshotError> {
        let head = Head::read(bytes)?;
        let content = &bytes[HEAD..];
        if content.len() as u64 != head.length {
            return Err(SnapshotError::Length {
                expected: head.length,
                found: content.len() as u64,
            });
        }
        let found = fnv1a(content);
        if found != head.checksum {
            return Err(SnapshotError::Damaged {
                expected: head.checksum,
                found,
            });
        }
        let (stored, mut rest) = next::<Stored>(content)?;
        let mut snapshot = stored.into_snapshot()?;
        snapshot.built.own_effects = own.clone();
        let bodies = &mut snapshot.built.world.bodies;
        if !rest.is_empty() {
            let stored;
            (stored, rest) = next(rest)?;
            snapshot.built.own = StoredOwn::read_all(stored, bodies, own)?;
        }
        if !rest.is_empty() {
            let stored;
            (stored, rest) = next(rest)?;
            set_controls(stored, bodies)?;
        }
        if !rest.is_empty() {
            let rest = rest.len();
            return Err(SnapshotError::Encoding(format!(
                "{rest} unexpected bytes at the end"
            )));
        }
        Ok(snapshot)
    }

    /// Writes a file, or [replaces](file::replace) an existing one.
    ///
    /// # Errors
    /// [`SnapshotError::File`].
    pub fn write(&self, path: &Path) -> Result<(), SnapshotError> {
        file::replace(path, &self.to_bytes()).map_err(|error| file_error(path, error))
    }

    /// Reads a file.
    ///
    /// # Errors
    /// [`SnapshotError::File`] if it cannot be read, [`SnapshotError::In`] if its content is
    /// invalid. A file of another kind is rejected by its first bytes.
    pub fn read(path: &Path) -> Result<Self, SnapshotError> {
        Self::read_with(path, &OwnEffects::default())
    }

    /// The same for a snapshot with effects of an app.
    ///
    /// # Errors
    /// As [`read`](Self::read), with the errors of [`from_bytes_with`](Self::from_bytes_with).
    pub fn read_with(path: &Path, own: &OwnEffects) -> Result<Self, SnapshotError> {
        let mut file = File::open(path).map_err(|error| file_error(path, error))?;
        let mut bytes = Vec::new();
        let start = (&mut file).take(HEAD as u64).read_to_end(&mut bytes);
        start.map_err(|error| file_error(path, error))?;
        let content = Head::read(&bytes).and_then(|_| {
            let rest = file.read_to_end(&mut bytes);
            rest.map_err(|error| file_error(path, error))?;
            Self::from_bytes_with(&bytes, own)
        });
        content.map_err(|error| match error {
            SnapshotError::File { .. } => error,
            error => SnapshotError::In {
                path: path.to_owned(),
                error: Box::new(error),
            },
        })
    }
}

/// Decodes the next part of the content; returns the rest.
fn next<T: DeserializeOwned>(bytes: &[u8]) -> Result<(T, &[u8]), SnapshotError> {
    postcard::take_from_bytes(bytes).map_err(|error| SnapshotError::Encoding(error.to_string()))
}

/// The header of a file.
struct Head {
    length: u64,
    checksum: u64,
}

impl Head {
    fn read(bytes: &[u8]) -> Result<Self, SnapshotError> {
        let Some((magic, rest)) = bytes.split_first_chunk::<8>() else {
            return Err(SnapshotError::Foreign);
        };
        if magic != MAGIC {
            return Err(SnapshotError::Foreign);
        }
        let short = || SnapshotError::Length {
            expected: HEAD as u64,
            found: bytes.len() as u64,
        };
        let (version, rest) = rest.split_first_chunk().ok_or_else(short)?;
        let found = u32::from_le_bytes(*version);
        if found != VERSION {
            return Err(SnapshotError::Version {
                found,
                known: VERSION,
            });
        }
        let (length, rest) = rest.split_first_chunk().ok_or_else(short)?;
        let (checksum, _) = rest.split_first_chunk().ok_or_else(short)?;
        Ok(Self {
            length: u64::from_le_bytes(*length),
            checksum: u64::from_le_bytes(*checksum),
        })
    }
}

fn file_error(path: &Path, error: io::Error) -> SnapshotError {
    SnapshotError::File {
        path: path.to_owned(),
        error,
    }
}

/// Whether a file begins with the snapshot header.
#[must_use]
pub fn is_snapshot(path: &Path) -> bool {
    let mut start = [0; MAGIC.len()];
    let read = File::open(path).and_then(|mut file| file.read_exact(&mut start));
    read.is_ok() && start == *MAGIC
}

/// Opens a snapshot by its path, or a scene by its name or path.
///
/// # Errors
/// [`SnapshotError`]; [`SnapshotError::Scene`] for a scene.
pub fn open(name: &str) -> Result<(CurrentScene, BuiltScene), SnapshotError> {
    open_with(name, &OwnEffects::default())
}

/// The same for a snapshot or a scene with effects of an app.
///
/// # Errors
/// As [`open`], with the errors of [`Snapshot::from_bytes_with`].
pub fn open_with(
    name: &str,
    own: &OwnEffects,
) -> Result<(CurrentScene, BuiltScene), SnapshotError> {
    let path = Path::new(name);
    if is_snapshot(path) {
        let snapshot = Snapshot::read_with(path, own)?;
        let current = CurrentScene {
            name: name.to_owned(),
            path: Some(path.to_owned()),
            ..snapshot.scene()
        };
        return Ok((current, snapshot.built));
    }
    let current = Scene::load_with(name, own)?;
    let built = current.scene.build()?;
    Ok((current, built))
}
