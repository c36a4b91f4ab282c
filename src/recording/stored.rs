//! The encoded form of a snapshot, and its validation.
//!
//! Meshes and embedded surfaces that bodies share are stored once.

mod body;
mod controls;
mod own;

use super::{
    About, Snapshot,
    error::{SnapshotError, nonsense},
};
use crate::{
    effect::OwnEffects,
    mesh::Skin,
    scene::{BuiltScene, CameraSpec, Look},
    simulation::{SpawnOrder, SpawnOrders},
    solver::{
        self, Collider, ColliderShape, Glide, Grab, Hold, Path, Pose, RestShape, Settings,
        Topology,
        rest::SleepSettings,
        topology::{LeftOut, TornOrder, numbering::Numbering},
    },
};
use body::StoredBody;
pub use controls::{set_controls, stored_controls};
pub use own::{StoredOwn, own_effects};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The encoded form of a snapshot.
#[derive(Serialize, Deserialize)]
pub struct Stored {
    name: String,
    title: String,
    look_at: String,
    camera: Option<CameraSpec>,
    settings: Settings,
    sleep: SleepSettings,
    time: f64,
    tick: u64,
    meshes: Vec<StoredMesh>,
    skins: Vec<Skin>,
    bodies: Vec<StoredBody>,
    colliders: Vec<StoredCollider>,
    places: SpawnOrders,
    grabs: Vec<StoredGrab>,
}

/// What a grab is beyond the grab of one point.
#[derive(Serialize, Deserialize)]
struct StoredGrab {
    /// Index of the body.
    body: u32,
    hold: Hold,
    glide: Glide,
}

#[derive(Serialize, Deserialize)]
struct StoredMesh {
    shape: RestShape,
    numbering: Vec<u32>,
    left_out: [u64; 4],
    torn: Option<TornOrder>,
}

#[derive(Serialize, Deserialize)]
struct StoredCollider {
    shape: ColliderShape,
    start: Pose,
    path: Path,
    color: Option<[u8; 3]>,
    opacity: f32,
}

impl Stored {
    /// Encodes a snapshot.
    pub fn of(snapshot: &Snapshot) -> Self {
        let Snapshot { about, built } = snapshot;
        let world = &built.world;
        let mut topologies = Interned::default();
        let mut skins = Interned::default();
        let bodies = world
            .bodies
            .iter()
            .zip(&built.skins)
            .zip(&built.looks)
            .map(|((body, skin), look)| {
                let skin = skin.as_ref().map(|skin| skins.place(skin));
                // Plastic flow is stored per body, so the mesh is the original one.
                let mesh = body.topology.original().unwrap_or(&body.topology);
                StoredBody::of(body, topologies.place(mesh), skin, *look)
            })
            .collect();
        Self {
            name: about.name.clone(),
            title: about.title.clone(),
            look_at: about.look_at.clone(),
            camera: about.camera,
            settings: world.settings,
            sleep: world.sleep,
            time: world.time,
            tick: world.tick,
            meshes: topologies.0.iter().map(|it| StoredMesh::of(it)).collect(),
            skins: skins.0.iter().map(|skin| Skin::clone(skin)).collect(),
            bodies,
            colliders: world
                .colliders
                .iter()
                .zip(&built.collider_looks)
                .map(|(collider, look)| StoredCollider::of(collider, *look))
                .collect(),
            places: built.places.clone().unwrap_or_default(),
            grabs: (0..)
                .zip(&world.bodies)
                .filter_map(|(body, it)| {
                    let Grab { hold, glide, .. } = it.effects.grab?;
                    let is_plain = hold == Hold::Point && glide == Glide::default();
                    (!is_plain).then_some(StoredGrab { body, hold, glide })
                })
                .collect(),
        }
    }

    /// Decodes and validates a snapshot.
    pub fn into_snapshot(self) -> Result<Snapshot, SnapshotError> {
        if !(self.time.is_finite() && self.time >= 0.0) {
            return Err(nonsense(format!(
                "the time is {} s, but must be finite and not negative",
                self.time
            )));
        }
        check_places("body", &self.places.bodies, self.bodies.len(), &self.places)?;
        let colliders = self.colliders.len();
        check_places("collider", &self.places.colliders, colliders, &self.places)?;
        let topologies = self
            .meshes
            .into_iter()
            .enumerate()
            .map(|(mesh, stored)| stored.topology(mesh).map(Arc::new))
            .collect::<Result<Vec<_>, _>>()?;
        let skins: Vec<_> = self.skins.into_iter().map(Arc::new).collect();
        let mut world = solver::World {
            settings: self.settings,
            sleep: self.sleep,
            time: self.time,
            tick: self.tick,
            ..solver::World::default()
        };
        let (mut body_skins, mut looks) = (Vec::new(), Vec::new());
        for stored in self.bodies {
            looks.push(Look {
                color: stored.color,
                ..Look::default()
            });
            let skin = stored.skin;
            let body = stored.body(&topologies)?;
            body_skins.push(
                skin.map(|skin| body::skin(&body, skin, &skins))
                    .transpose()?,
            );
            world.bodies.push(body);
        }
        // A body alone, as it is added, is checked where it is.
        if world.bodies.len() > 1 {
            check_joints(&world)?;
        }
        for StoredGrab { body, hold, glide } in self.grabs {
            let held = world.bodies.get_mut(body as usize);
            let grab = held.and_then(|body| body.effects.grab.as_mut());
            let radius = match hold {
                Hold::Patch { radius } => radius,
                Hold::Point | Hold::Pins => 0.0,
            };
            let sound = radius >= 0.0
                && glide.seconds >= 0.0
                && (glide.goal + radius + glide.seconds).is_finite();
            let Some(grab) = grab.filter(|_| sound) else {
                return Err(nonsense(format!("the grab of body {body} is invalid")));
            };
            (grab.hold, grab.glide) = (hold, glide);
        }
        let mut collider_looks = Vec::new();
        for (index, stored) in self.colliders.into_iter().enumerate() {
            let look = Look {
                color: stored.color,
                opacity: stored.opacity,
            };
            if !look.is_valid() {
                return Err(nonsense(format!(
                    "collider {index}: the opacity is {}, but must be between 0 and 1",
                    look.opacity
                )));
            }
            collider_looks.push(look);
            let collider = Collider::moving(stored.shape, stored.start, stored.path)
                .map_err(|error| nonsense(format!("collider {index}: {error}")))?;
            world.colliders.push(collider);
        }
        Ok(Snapshot {
            about: About {
                name: self.name,
                title: self.title,
                look_at: self.look_at,
                camera: self.camera,
            },
            built: BuiltScene {
                world,
                skins: body_skins,
                looks,
                collider_looks,
                places: Some(self.places),
                camera: self.camera,
                frame: None,
                notes: Vec::new(),
                own: Vec::new(),
                own_effects: OwnEffects::default(),
            },
        })
    }
}

/// Shared values, each stored once.
struct Interned<T>(Vec<Arc<T>>);

impl<T> Default for Interned<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> Interned<T> {
    /// The index of a value.
    fn place(&mut self, thing: &Arc<T>) -> u32 {
        // Searched from the end, as copies of a body follow each other.
        let known = self.0.iter().rposition(|other| Arc::ptr_eq(other, thing));
        known.unwrap_or_else(|| {
            self.0.push(Arc::clone(thing));
            self.0.len() - 1
        }) as u32
    }
}

impl StoredMesh {
    fn of(topology: &Topology) -> Self {
        let LeftOut {
            flat_tetrahedra,
            repeated_edges,
            massless_edges,
            unused_vertices,
        } = topology.left_out;
        Self {
            shape: topology.rest_shape(),
            numbering: topology.numbering.vertices().to_vec(),
            left_out: [
                flat_tetrahedra,
                repeated_edges,
                massless_edges,
                unused_vertices,
            ]
            .map(|count| count as u64),
            torn: topology.torn_order(),
        }
    }

    fn topology(self, mesh: usize) -> Result<Topology, SnapshotError> {
        let numbering = Numbering::from_vertices(self.numbering)
            .ok_or_else(|| nonsense(format!("mesh {mesh}: the numbering is not a permutation")))?;
        let mut topology = match &self.torn {
            None => Topology::numbered(self.shape, numbering)
                .map_err(|error| SnapshotError::Mesh { mesh, error })?,
            Some(order) => Topology::torn(self.shape, numbering, order).ok_or_else(|| {
                nonsense(format!("mesh {mesh}: the order of its elements is invalid"))
            })?,
        };
        let [
            flat_tetrahedra,
            repeated_edges,
            massless_edges,
            unused_vertices,
        ] = self.left_out.map(|count| count as usize);
        topology.left_out = LeftOut {
            flat_tetrahedra,
            repeated_edges,
            massless_edges,
            unused_vertices,
        };
        Ok(topology)
    }
}

impl StoredCollider {
    fn of(collider: &Collider, look: Look) -> Self {
        let Collider { shape, start, path } = collider;
        Self {
            shape: shape.clone(),
            start: *start,
            path: path.clone(),
            color: look.color,
            opacity: look.opacity,
        }
    }
}

/// Checks that stitches to other bodies lead to particles that exist.
fn check_joints(world: &solver::World) -> Result<(), SnapshotError> {
    let counts: Vec<_> = world.bodies.iter().map(|it| it.particles.len()).collect();
    for body in &world.bodies {
        for (_, number, point) in body.stitches.intact_joints() {
            let count = counts.get(number as usize);
            if !count.is_some_and(|&count| point.fits(count)) {
                return Err(nonsense(format!(
                    "body “{}” is stitched to a particle of body {number} that does not exist",
                    body.name
                )));
            }
        }
    }
    Ok(())
}

/// Checks that spawn orders are ascending, one per item, and not beyond the last one.
fn check_places(
    what: &str,
    given: &[SpawnOrder],
    count: usize,
    places: &SpawnOrders,
) -> Result<(), SnapshotError> {
    if given.len() != count {
        let found = given.len();
        return Err(nonsense(format!(
            "the order of kind {what} has {found} entries, expected {count}"
        )));
    }
    let ascending = given.windows(2).all(|pair| pair[0] < pair[1]);
    if !ascending || given.last().is_some_and(|last| *last > places.last) {
        return Err(nonsense(format!(
            "the order entries of kind {what} are not ascending"
        )));
    }
    Ok(())
}
