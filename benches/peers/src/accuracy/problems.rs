//! The problems: bodies that hang or stand on pins under gravity and touch nothing, one mesh each,
//! identical for all peers. Units are meters, kilograms and seconds.

use crate::scenes::GRAVITY;
use glam::{UVec2, UVec3, Vec2, Vec3};
use pliant::{
    mesh::{Diagonals, MeshError, Primitive},
    solver::RestShape,
};

/// Constraint on the volume of each tetrahedron.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Volumes {
    /// None.
    Free,
    /// Its rest volume is kept exactly.
    Rigid,
    /// A bulk modulus K [Pa]: the energy is ½K(V − V₀)²/V₀.
    Bulk(f32),
}

/// Elastic law of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Elasticity {
    /// Edges with a compliance, and volumes.
    Springs {
        /// Compliance of each edge [m/N].
        compliance: f32,
        /// Constraint on volumes.
        volumes: Volumes,
    },
    /// Stable neo-Hookean tetrahedra of Smith, de Goes and Kim (2018).
    NeoHookean {
        /// Young's modulus [Pa].
        youngs_modulus: f32,
        /// Poisson's ratio.
        poisson_ratio: f32,
    },
}

/// A problem.
#[derive(Debug, Clone)]
pub struct Problem {
    /// Name for `--rows`.
    pub name: &'static str,
    /// What it is, in a few words.
    pub title: &'static str,
    /// The mesh, in its rest shape.
    pub shape: RestShape,
    /// The pinned particles.
    pub pins: Vec<u32>,
    /// Mass per m, m² or m³.
    pub density: f32,
    /// Further masses of particles [kg].
    pub added: Vec<(u32, f32)>,
    /// Elastic law.
    pub elasticity: Elasticity,
}

/// The names of all problems.
pub const NAMES: [&str; 14] = [
    "springs4",
    "springs4-stiff",
    "springs8",
    "springs8-stiff",
    "twist",
    "chain",
    "chain-stiff",
    "cloth",
    "jelly-springs",
    "beam4",
    "beam4-stiff",
    "beam10",
    "beam10-stiff",
    "jelly",
];

/// Builds a problem by its name.
///
/// # Errors
/// [`MeshError`] of the mesh, or [`MeshError::Unusable`] for a name that is not in [`NAMES`].
pub fn build(name: &str) -> Result<Problem, MeshError> {
    match name {
        "springs4" => spring_beam("springs4", "beam 4:1 of springs", 8, 3e-4),
        "springs4-stiff" => spring_beam("springs4-stiff", "the same, 10 times as stiff", 8, 3e-5),
        "springs8" => spring_beam("springs8", "beam 8:1 of springs", 16, 5e-5),
        "springs8-stiff" => spring_beam("springs8-stiff", "the same, 10 times as stiff", 16, 5e-6),
        "twist" => twisted_bar(),
        "chain" => chain("chain", "chain of 32 links, 1e-3 m/N", 1e-3),
        "chain-stiff" => chain("chain-stiff", "the same, 1e-4 m/N", 1e-4),
        "cloth" => cloth(),
        "jelly-springs" => jelly(
            "jelly-springs",
            "block of springs under its own weight",
            Elasticity::Springs {
                compliance: 5e-4,
                volumes: Volumes::Bulk(1e4),
            },
        ),
        "beam4" => beam("beam4", "neo-Hookean beam 4:1", 0.8, 5e5),
        "beam4-stiff" => beam("beam4-stiff", "the same, 10 times as stiff", 0.8, 5e6),
        "beam10" => beam("beam10", "neo-Hookean beam 10:1", 2.0, 2e6),
        "beam10-stiff" => beam("beam10-stiff", "the same, 10 times as stiff", 2.0, 2e7),
        "jelly" => jelly(
            "jelly",
            "neo-Hookean block under its own weight",
            Elasticity::NeoHookean {
                youngs_modulus: 5e4,
                poisson_ratio: 0.3,
            },
        ),
        unknown => Err(MeshError::Unusable {
            problem: format!("unknown problem '{unknown}'"),
            remedy: format!("expected one of: {}", NAMES.join(", ")),
        }),
    }
}

/// A clamped beam of springs with rigid volumes, 0.1 × 0.1 m thick, in cells of 5 cm.
fn spring_beam(
    name: &'static str,
    title: &'static str,
    cells: u32,
    compliance: f32,
) -> Result<Problem, MeshError> {
    let shape = bar(
        Vec3::new(0.05 * cells as f32, 0.1, 0.1),
        UVec3::new(cells, 2, 2),
    )?;
    let springs = Elasticity::Springs {
        compliance,
        volumes: Volumes::Rigid,
    };
    Ok(Problem::new(name, title, shape, 200.0, springs).pinned(|x| x.x < 1e-4))
}

/// The twisted bar of `pliant study` on its second mesh, with rigid volumes: clamped at one end,
/// with 0.5 kg along one side of the other.
fn twisted_bar() -> Result<Problem, MeshError> {
    let shape = bar(Vec3::new(0.4, 0.1, 0.1), UVec3::new(8, 2, 2))?;
    let springs = Elasticity::Springs {
        compliance: 2.25e-5,
        volumes: Volumes::Rigid,
    };
    let mut bar = Problem::new("twist", "bar twisted by a load", shape, 1000.0, springs)
        .pinned(|x| x.x < 1e-4);
    bar.added = vec![(62, 0.125), (71, 0.25), (80, 0.125)];
    Ok(bar)
}

/// A clamped neo-Hookean beam of 8×2×2 cells, 0.2 × 0.2 m thick, as Rapier's own example has it.
fn beam(
    name: &'static str,
    title: &'static str,
    length: f32,
    youngs_modulus: f32,
) -> Result<Problem, MeshError> {
    let shape = bar(Vec3::new(length, 0.2, 0.2), UVec3::new(8, 2, 2))?;
    let law = Elasticity::NeoHookean {
        youngs_modulus,
        poisson_ratio: 0.3,
    };
    Ok(Problem::new(name, title, shape, 100.0, law).pinned(|x| x.x < 1e-4))
}

/// A cube of 0.4 m of 4³ cells that is clamped at its lower face.
fn jelly(name: &'static str, title: &'static str, law: Elasticity) -> Result<Problem, MeshError> {
    let cube = Primitive::Box {
        size: Vec3::splat(0.4),
        cells: UVec3::splat(4),
    };
    let shape = cube.build()?.shape;
    Ok(Problem::new(name, title, shape, 1000.0, law).pinned(|x| x.y < -0.1999))
}

/// A hanging chain of 32 links of 10 g; the last particle has a whole link's mass.
fn chain(name: &'static str, title: &'static str, compliance: f32) -> Result<Problem, MeshError> {
    let rope = Primitive::Rope {
        length: 1.0,
        segments: 32,
    };
    let mut shape = rope.build()?.shape;
    for x in &mut shape.vertices {
        *x = Vec3::new(0.0, -x.x, 0.0);
    }
    let springs = Elasticity::Springs {
        compliance,
        volumes: Volumes::Free,
    };
    let mut chain = Problem::new(name, title, shape, 0.32, springs);
    chain.pins = vec![0];
    chain.added = vec![(32, 0.005)];
    Ok(chain)
}

/// A horizontal cloth of 1 × 1 m with both diagonals that hangs in a frame.
fn cloth() -> Result<Problem, MeshError> {
    let cloth = Primitive::Cloth {
        size: Vec2::ONE,
        cells: UVec2::splat(16),
        diagonals: Diagonals::default(),
        shear: true,
    };
    let shape = cloth.build()?.shape;
    let springs = Elasticity::Springs {
        compliance: 1e-3,
        volumes: Volumes::Free,
    };
    let cloth = Problem::new("cloth", "cloth hanging in a frame", shape, 0.2, springs);
    Ok(cloth.pinned(|x| x.x.abs().max(x.z.abs()) > 0.4999))
}

/// A box that begins at x = 0.
fn bar(size: Vec3, cells: UVec3) -> Result<RestShape, MeshError> {
    let mut shape = Primitive::Box { size, cells }.build()?.shape;
    for x in &mut shape.vertices {
        x.x += 0.5 * size.x;
    }
    Ok(shape)
}

impl Problem {
    fn new(
        name: &'static str,
        title: &'static str,
        shape: RestShape,
        density: f32,
        elasticity: Elasticity,
    ) -> Self {
        Self {
            name,
            title,
            shape,
            pins: Vec::new(),
            density,
            added: Vec::new(),
            elasticity,
        }
    }

    /// Pins the particles at which `is_pin` is true.
    fn pinned(mut self, is_pin: impl Fn(&Vec3) -> bool) -> Self {
        let all = (0..).zip(&self.shape.vertices);
        self.pins = all.filter(|(_, x)| is_pin(x)).map(|(i, _)| i).collect();
        self
    }

    /// Gravity [m/s²].
    #[must_use]
    pub fn gravity(&self) -> Vec3 {
        Vec3::new(0.0, GRAVITY, 0.0)
    }

    /// Number of edges and of tetrahedra that carry a constraint.
    #[must_use]
    pub fn constraints(&self) -> (u64, u64) {
        let (edges, tetrahedra) = (self.shape.edges.len(), self.shape.tetrahedra.len());
        match self.elasticity {
            Elasticity::Springs {
                volumes: Volumes::Free,
                ..
            } => (edges as u64, 0),
            Elasticity::Springs { .. } => (edges as u64, tetrahedra as u64),
            Elasticity::NeoHookean { .. } => (0, tetrahedra as u64),
        }
    }
}
