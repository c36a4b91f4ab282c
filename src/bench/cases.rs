//! Benchmark cases: effects and bodies, from a few hundred particles to a million.
//!
//! There is no gravity and no contact, so that a tick consists of projections and the particle
//! passes around them. Particles of bodies with edges start with a small displacement; tetrahedra
//! alone do not resist shear and would flow indefinitely, so these start at rest. This does not
//! affect the code path of a projection: it branches only for degenerate elements.

use super::BenchError;
use crate::{
    mesh::{Diagonals, Primitive},
    solver::{
        Body, Compliance, Density, Effects, InvalidValue, RestShape, Stretch, Substeps, Topology,
        Volume, World,
    },
};
use glam::{UVec2, UVec3, Vec2, Vec3};
use std::{collections::BTreeMap, sync::Arc};

/// Substeps per tick.
pub const SUBSTEPS: u32 = 16;

/// Compliance of the edges [m/N]; volumes are rigid.
pub const EDGE_COMPLIANCE: f32 = 1e-6;

/// Side of a cell [m].
pub(super) const CELL: f32 = 0.05;

/// Initial displacement along x of the particles of bodies with edges [m], in alternating
/// directions. All particles vibrate, and no body moves as a whole.
const NUDGE: f32 = 0.005 * CELL;

/// Effects of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Elastic {
    /// Edges.
    Stretch,
    /// Tetrahedra.
    Volume,
    /// Edges and tetrahedra.
    Both,
}

/// Shape of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Shape {
    /// A square cloth with this many particles per side; cells have both diagonals.
    Cloth(u32),
    /// A cube with this many cells per side, five tetrahedra in each.
    Box(u32),
}

/// A row of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Case {
    /// Active effects.
    pub elastic: Elastic,
    /// The shape of each body.
    pub shape: Shape,
    /// Number of bodies.
    pub bodies: usize,
}

impl Case {
    /// All cases.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let one = |elastic, shape| Self {
            elastic,
            shape,
            bodies: 1,
        };
        let cloths = [21, 32, 64, 200, 512, 1000].map(Shape::Cloth);
        let boxes = [5, 10, 20, 36].map(Shape::Box);
        let mut all: Vec<Self> = cloths.map(|shape| one(Elastic::Stretch, shape)).into();
        all.extend(boxes.map(|shape| one(Elastic::Volume, shape)));
        all.extend(boxes.map(|shape| one(Elastic::Both, shape)));
        all.extend([10, 100].map(|bodies| Self {
            bodies,
            ..one(Elastic::Both, Shape::Box(5))
        }));
        all
    }

    /// Its name, such as `both_box_5_x10`.
    #[must_use]
    pub fn name(&self) -> String {
        let effect = match self.elastic {
            Elastic::Stretch => "stretch",
            Elastic::Volume => "volume",
            Elastic::Both => "both",
        };
        let shape = match self.shape {
            Shape::Cloth(side) => format!("cloth_{side}"),
            Shape::Box(cells) => format!("box_{cells}"),
        };
        match self.bodies {
            1 => format!("{effect}_{shape}"),
            bodies => format!("{effect}_{shape}_x{bodies}"),
        }
    }

    /// A world of these bodies, ready to be stepped.
    pub(super) fn world(&self, topology: &Arc<Topology>) -> World {
        let mut world = World::default();
        world.sleep.enabled = false;
        world.settings.gravity = Vec3::ZERO;
        world.settings.substeps = valid(Substeps::new(SUBSTEPS));
        world.bodies = (0..self.bodies).map(|_| self.body(topology)).collect();
        world
    }

    fn body(&self, topology: &Arc<Topology>) -> Body {
        let density = match self.shape {
            Shape::Cloth(_) => Density::new(0.1),
            Shape::Box(_) => Density::new(1000.0),
        };
        let mut body = Body::new(self.name(), topology.clone(), valid(density));
        let stretch = Stretch {
            compliance: valid(Compliance::new(EDGE_COMPLIANCE)),
            ..Stretch::default()
        };
        body.effects = Effects {
            stretch: (self.elastic != Elastic::Volume).then_some(stretch),
            volume: (self.elastic != Elastic::Stretch).then(Volume::default),
            ..Effects::default()
        };
        if body.effects.stretch.is_some() {
            for (place, x) in body.particles.positions.iter_mut().enumerate() {
                x.x += if place % 2 == 0 { NUDGE } else { -NUDGE };
            }
        }
        body
    }
}

impl Shape {
    /// Its topology, built if it is not among the given ones.
    pub(super) fn topology(
        self,
        made: &mut BTreeMap<Self, Arc<Topology>>,
    ) -> Result<Arc<Topology>, BenchError> {
        if let Some(topology) = made.get(&self) {
            return Ok(topology.clone());
        }
        let topology = Arc::new(Topology::new(self.rest_shape()?)?);
        made.insert(self, topology.clone());
        Ok(topology)
    }

    pub(super) fn rest_shape(self) -> Result<RestShape, BenchError> {
        Ok(self.primitive().build()?.shape)
    }

    fn primitive(self) -> Primitive {
        match self {
            Self::Cloth(side) => Primitive::Cloth {
                size: Vec2::splat((side - 1) as f32 * CELL),
                cells: UVec2::splat(side - 1),
                diagonals: Diagonals::Alternating,
                shear: true,
            },
            Self::Box(cells) => Primitive::Box {
                size: Vec3::splat(cells as f32 * CELL),
                cells: UVec3::splat(cells),
            },
        }
    }
}

pub(super) fn valid<T>(constant: Result<T, InvalidValue>) -> T {
    constant.expect("the constants above are within their ranges")
}
