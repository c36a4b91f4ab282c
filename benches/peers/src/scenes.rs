//! The scenes: one mesh each, in one or more copies, identical for all peers.
//!
//! Bodies hang from one or two pins under gravity, so that all constraints are active, and do not
//! touch anything; in the scenes of contact they are free, and fall on a floor at height 0. Units are meters, kilograms and seconds.

use glam::{DVec3, UVec2, UVec3, Vec2, Vec3};
use pliant::{
    mesh::{self, BuildOptions, Diagonals, MeshError, Primitive},
    scene::asset,
    solver::RestShape,
};

/// Ticks per second.
pub const RATE: f32 = 60.0;
/// Substeps per tick, each with one iteration over all constraints.
pub const SUBSTEPS: u32 = 16;
/// Gravity along y [m/s²].
pub const GRAVITY: f32 = -9.81;
/// Mass per m³ of a solid and per m² of a cloth.
pub const DENSITY: f32 = 1.0;
/// α/h² of an edge over the inverse mass of a particle of mean mass. At 1, a projection removes two
/// thirds of the error; that of a rigid edge removes all of it. It is above zero for peers that
/// solve edges in sorted order, in which the meshes have them and into which Jolt sorts them. In
/// that order, a large cloth of rigid edges diverges, as does one with a third of this value.
pub const SOFTNESS: f32 = 1.0;

/// A scene.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Name for `--rows`.
    pub name: &'static str,
    /// The mesh of one body.
    pub shape: RestShape,
    /// Inverse mass of each particle [1/kg]; 0 for pins.
    pub inverse_masses: Vec<f32>,
    /// The pinned particles.
    pub pins: Vec<u32>,
    /// Offsets of the copies of the body [m].
    pub offsets: Vec<Vec3>,
    /// Compliance of each edge [m/N].
    pub edge_compliance: f32,
    /// Distance that surfaces keep [m], with a floor; `None` without contact.
    pub thickness: Option<f32>,
}

/// The names of all scenes.
pub const NAMES: [&str; 8] = [
    "bunny", "bunny10", "bunny100", "block20", "cloth21", "cloth64", "cloth200", "cloth512",
];

/// The names of the scenes of contact.
pub const CONTACT: [&str; 2] = ["folds64", "pile27"];

/// Builds a scene by its name.
///
/// # Errors
/// [`MeshError`] of the mesh, or [`MeshError::Unusable`] for a name that is neither in [`NAMES`] nor
/// in [`CONTACT`].
pub fn build(name: &str) -> Result<Scene, MeshError> {
    match name {
        "bunny" => Ok(scene("bunny", bunny()?, 1)),
        "bunny10" => Ok(scene("bunny10", bunny()?, 10)),
        "bunny100" => Ok(scene("bunny100", bunny()?, 100)),
        "block20" => Ok(scene("block20", block(20)?, 1)),
        "cloth21" => Ok(scene("cloth21", cloth(21)?, 1)),
        "cloth64" => Ok(scene("cloth64", cloth(64)?, 1)),
        "cloth200" => Ok(scene("cloth200", cloth(200)?, 1)),
        "cloth512" => Ok(scene("cloth512", cloth(512)?, 1)),
        "folds64" => folds(),
        "pile27" => pile(),
        unknown => Err(MeshError::Unusable {
            problem: format!("unknown scene '{unknown}'"),
            remedy: format!(
                "expected one of: {}, {}",
                NAMES.join(", "),
                CONTACT.join(", ")
            ),
        }),
    }
}

/// The Stanford bunny, 1 m long, filled coarsely: about 333 particles.
fn bunny() -> Result<RestShape, MeshError> {
    let options = BuildOptions {
        size: Some(1.0),
        cells: Some(5),
        ..BuildOptions::default()
    };
    Ok(mesh::build(asset::load("bunny")?, &options)?.shape)
}

/// A cube of 5 cm cells of five tetrahedra each.
fn block(cells: u32) -> Result<RestShape, MeshError> {
    let block = Primitive::Box {
        size: Vec3::splat(cells as f32 * 0.05),
        cells: UVec3::splat(cells),
    };
    Ok(block.build()?.shape)
}

/// A square cloth with `side` particles along each side, 5 cm apart, and both diagonals.
fn cloth(side: u32) -> Result<RestShape, MeshError> {
    let cloth = Primitive::Cloth {
        size: Vec2::splat((side - 1) as f32 * 0.05),
        cells: UVec2::splat(side - 1),
        diagonals: Diagonals::default(),
        shear: true,
    };
    Ok(cloth.build()?.shape)
}

/// A cloth of 64² particles, 2 cm apart, stands on its edge, slightly curved, and folds over itself.
fn folds() -> Result<Scene, MeshError> {
    let mut shape = cloth(64)?;
    for x in &mut shape.vertices {
        let along = 0.4 * x.z + 0.63;
        *x = Vec3::new(0.4 * x.x, 0.01 + along, 0.05 * (5.0 * along).sin());
    }
    Ok(scene("folds64", shape, 1).free(0.004))
}

/// Twenty-seven cubes of 0.3 m, of 125 particles each, fall onto each other.
fn pile() -> Result<Scene, MeshError> {
    let cube = Primitive::Box {
        size: Vec3::splat(0.3),
        cells: UVec3::splat(4),
    };
    let mut scene = scene("pile27", cube.build()?.shape, 27).free(0.008);
    for (number, offset) in (0_u32..).zip(&mut scene.offsets) {
        let [x, y, z] = [number % 3, number / 9, number / 3 % 3].map(|it| it as f32);
        // Each layer lies a quarter of a cube beside the one below.
        *offset = Vec3::new(0.34 * x + 0.08 * y, 0.2 + 0.4 * y, 0.34 * z + 0.06 * y);
    }
    Ok(scene)
}

fn scene(name: &'static str, shape: RestShape, copies: usize) -> Scene {
    let pins = pins(&shape);
    let masses = masses(&shape);
    let mean = masses.iter().sum::<f32>() / masses.len() as f32;
    let mut inverse_masses: Vec<f32> = masses.iter().map(|mass| 1.0 / mass).collect();
    for &pin in &pins {
        inverse_masses[pin as usize] = 0.0;
    }
    let h = 1.0 / (RATE * SUBSTEPS as f32);
    let side = (copies as f32).sqrt().ceil() as usize;
    let place = |copy: usize| Vec3::new((copy % side) as f32, 0.0, (copy / side) as f32) * 3.0;
    Scene {
        name,
        inverse_masses,
        pins,
        offsets: (0..copies).map(place).collect(),
        edge_compliance: SOFTNESS * h * h / mean,
        thickness: None,
        shape,
    }
}

/// The highest particle on the left and the one on the right: two corners of a block or a cloth;
/// only one particle if they are the same.
fn pins(shape: &RestShape) -> Vec<u32> {
    let highest = |lean: f32| {
        let height = |v: &Vec3| v.y + lean * v.x - 1e-4 * v.z;
        (0..shape.vertices.len())
            .max_by(|&a, &b| height(&shape.vertices[a]).total_cmp(&height(&shape.vertices[b])))
    };
    let mut pins: Vec<u32> = [-1e-3, 1e-3]
        .into_iter()
        .filter_map(highest)
        .map(|pin| pin as u32)
        .collect();
    pins.dedup();
    pins
}

/// Mass of each particle [kg]: the mass of each element is divided equally among its corners.
fn masses(shape: &RestShape) -> Vec<f32> {
    let mut masses = vec![0.0_f64; shape.vertices.len()];
    let at = |i: u32| shape.vertices[i as usize].as_dvec3();
    let mut distribute = |corners: &[u32], measure: f64| {
        for &corner in corners {
            masses[corner as usize] += measure * f64::from(DENSITY) / corners.len() as f64;
        }
    };
    if shape.tetrahedra.is_empty() {
        for corners in &shape.triangles {
            let [a, b, c] = corners.map(at);
            distribute(corners, (b - a).cross(c - a).length() / 2.0);
        }
    } else {
        for corners in &shape.tetrahedra {
            distribute(corners, volume(corners.map(at)).abs());
        }
    }
    masses.into_iter().map(|mass| mass as f32).collect()
}

/// Signed volume of a tetrahedron [m³].
#[must_use]
pub fn volume([a, b, c, d]: [DVec3; 4]) -> f64 {
    (b - a).cross(c - a).dot(d - a) / 6.0
}

impl Scene {
    /// The scene without pins, with contact at a distance [m].
    fn free(mut self, thickness: f32) -> Self {
        let masses = masses(&self.shape);
        self.inverse_masses = masses.iter().map(|mass| 1.0 / mass).collect();
        self.pins.clear();
        self.thickness = Some(thickness);
        self
    }

    /// Particles over all bodies.
    #[must_use]
    pub fn particles(&self) -> usize {
        self.shape.vertices.len() * self.offsets.len()
    }

    /// Edges over all bodies.
    #[must_use]
    pub fn edges(&self) -> u64 {
        (self.shape.edges.len() * self.offsets.len()) as u64
    }

    /// Tetrahedra over all bodies.
    #[must_use]
    pub fn tetrahedra(&self) -> u64 {
        (self.shape.tetrahedra.len() * self.offsets.len()) as u64
    }
}
