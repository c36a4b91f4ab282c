//! Growth of time and memory with the size of a body that lies on a table.
//!
//! Unlike the other cases these have gravity and contact: a block of soft cubes lies on a table that is
//! a [mesh collider](crate::solver::ColliderMesh), so that a tick includes the search for contacts of
//! the whole surface of the block and the contacts of its lower face.

use super::{
    BenchError, Shape, Spread,
    cases::{CELL, EDGE_COMPLIANCE, SUBSTEPS, valid},
    measure::{self, Probe},
};
use crate::solver::{
    Body, Collide, Collider, ColliderMesh, ColliderShape, Compliance, Contact, ContactThickness,
    Density, Effects, Pose, Stretch, Substeps, Threads, Topology, Volume, World,
    measure::shape_error, memory::solver_bytes,
};
use glam::Vec3;
use std::{sync::Arc, time::Duration};

/// Cells along the sides of the blocks: a thousand, ten thousand, a hundred thousand and a million
/// tetrahedra.
const CELLS: [u32; 4] = [6, 13, 27, 59];

/// Limit on the root mean square distance to the rest shape, relative to the size of the block.
const SOUND: f64 = 0.02;

/// Thickness of its contact [m].
const THICKNESS: f32 = 0.1 * CELL;

/// Distance of the block from the table at the start, as a fraction of that thickness, so that it is
/// supported from the first substep on.
const GAP: f32 = 0.9;

/// The figures of a block.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct GrowthRow {
    /// Its tetrahedra.
    pub tetrahedra: usize,
    /// Its particles.
    pub particles: usize,
    /// Contacts that pushed in the last substep.
    pub contacts: usize,
    /// Memory of the solver for it [byte], with the workspace of its contacts.
    pub bytes: usize,
    /// Constraint projections per tick.
    pub projections: usize,
    /// Whether it stayed near its rest shape and on the table.
    pub sound: bool,
    /// Numbers of threads with the times of a tick [ms].
    pub stepped: Vec<(usize, Spread)>,
}

impl GrowthRow {
    /// Time of a tick per projection [ns] with the number of threads at this place: with contact, so
    /// above that of a projection alone.
    #[must_use]
    pub fn nanoseconds(&self, place: usize) -> Option<f64> {
        let (_, milliseconds) = self.stepped.get(place)?;
        Some(milliseconds.median * 1e6 / self.projections as f64)
    }
}

/// Steps a block with each of several numbers of threads; its figures are milliseconds per tick.
#[derive(Debug)]
pub(super) struct Growing {
    crews: Vec<Threads>,
    world: World,
    beginning: Vec<Body>,
    contacts: usize,
    sound: bool,
}

impl Growing {
    /// All blocks.
    pub fn all(crews: &[Threads]) -> Result<Vec<Self>, BenchError> {
        CELLS
            .map(|cells| Self::new(cells, crews))
            .into_iter()
            .collect()
    }

    fn new(cells: u32, crews: &[Threads]) -> Result<Self, BenchError> {
        let topology = Arc::new(Topology::new(Shape::Box(cells).rest_shape()?)?);
        let mut body = Body::new("block", topology, valid(Density::new(1000.0)));
        let contact = Contact {
            thickness: valid(ContactThickness::new(THICKNESS)),
            ..Contact::default()
        };
        let half = 0.5 * cells as f32 * CELL;
        body.translate(Vec3::Y * (half + GAP * THICKNESS));
        body.effects = Effects {
            stretch: Some(Stretch {
                compliance: valid(Compliance::new(EDGE_COMPLIANCE)),
                ..Stretch::default()
            }),
            volume: Some(Volume::default()),
            contact: Some(contact),
            collide: Some(Collide::default()),
            ..Effects::default()
        };
        let mut world = World::default();
        world.sleep.enabled = false;
        world.settings.substeps = valid(Substeps::new(SUBSTEPS));
        world.colliders.push(table(4.0 * half));
        world.bodies.push(body);
        Ok(Self {
            beginning: world.bodies.clone(),
            crews: crews.to_vec(),
            world,
            contacts: 0,
            sound: true,
        })
    }

    /// Its row, with figures from [`sample`](Probe::sample).
    pub fn row(&self, figures: &[Spread]) -> GrowthRow {
        let topology = &self.beginning[0].topology;
        let tetrahedra = topology.tetrahedra.corners().len();
        let constraints = tetrahedra + topology.edges.ends().len();
        let counts = self.crews.iter().map(Threads::count);
        GrowthRow {
            tetrahedra,
            particles: topology.particles(),
            contacts: self.contacts,
            bytes: solver_bytes(&self.world.bodies) + self.world.contacts().bytes(),
            projections: constraints * SUBSTEPS as usize,
            sound: self.sound,
            stepped: counts.zip(figures.iter().copied()).collect(),
        }
    }
}

/// A square table of a side [m] at height 0, of two triangles.
fn table(side: f32) -> Collider {
    let corner = |x: f32, z: f32| Vec3::new(x, 0.0, z) * 0.5 * side;
    let corners = [
        corner(-1.0, -1.0),
        corner(1.0, -1.0),
        corner(1.0, 1.0),
        corner(-1.0, 1.0),
    ];
    let mesh = ColliderMesh::new(&corners, &[[0, 2, 1], [0, 3, 2]]).expect("two triangles");
    let shape = ColliderShape::Mesh(mesh);
    Collider::new(shape, Pose::default()).expect("a sound shape")
}

impl Probe for Growing {
    fn sample(&mut self, slot: Duration) -> Vec<f64> {
        let Self {
            world,
            beginning,
            contacts,
            sound,
            ..
        } = self;
        let figures = self.crews.iter().map(|threads| {
            world.bodies.clone_from(beginning);
            world.threads = threads.clone();
            // The first tick allocates.
            world.tick();
            let rate = measure::rate(slot, || {
                world.tick();
                1
            });
            *contacts = world.contacts().counts().acting;
            let body = &world.bodies[0];
            let error = shape_error(&body.topology, &body.particles.positions);
            *sound &= body.quarantine.is_none() && error < SOUND && *contacts > 0;
            1e3 / rate
        });
        figures.collect()
    }
}
