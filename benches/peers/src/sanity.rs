//! Checks that a run has all constraints of the scene and has not diverged.
//!
//! No speed is given for a run that fails: that of a solver that lost its constraints, or whose
//! positions are not finite, means nothing.

use crate::{
    peer::Report,
    scenes::{Scene, volume},
};
use glam::Vec3;
use serde::Serialize;

/// Maximum root mean square strain of the edges.
const MAX_STRAIN: f64 = 0.5;
/// Maximum diagonal of the bounding box of a body, over its initial one.
const MAX_GROWTH: f32 = 3.0;
/// Maximum displacement of a pin [m].
const MAX_SLIP: f32 = 1e-2;
/// Minimum displacement of the particle that moved most during the warm-up [m].
const MIN_MOTION: f32 = 1e-4;

/// Residual of the constraints of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Residual {
    /// Root mean square of length over rest length, minus 1.
    pub edge_strain: f64,
    /// Root mean square of volume over rest volume, minus 1.
    pub volume_strain: f64,
}

/// Checks a run, and returns its residual.
///
/// # Errors
/// The reason why the run is rejected, in a few words.
pub fn examine(scene: &Scene, has_volume: bool, report: &Report) -> Result<Residual, String> {
    let counts = report.counts;
    let tetrahedra = if has_volume { scene.tetrahedra() } else { 0 };
    if (counts.edges, counts.tetrahedra) != (scene.edges(), tetrahedra) {
        return Err(format!(
            "holds {} edges and {} tetrahedra, not {} and {tetrahedra}",
            counts.edges,
            counts.tetrahedra,
            scene.edges()
        ));
    }
    if report.positions.len() != scene.particles() {
        return Err(format!("has {} particles", report.positions.len()));
    }
    if !report.positions.iter().all(|x| x.is_finite()) {
        return Err("not finite".into());
    }
    let bodies = || report.positions.chunks(scene.shape.vertices.len());
    for (body, offset) in bodies().zip(&scene.offsets) {
        check_body(scene, body, *offset)?;
    }
    let residual = residual(scene, bodies());
    if residual.edge_strain > MAX_STRAIN {
        return Err(format!(
            "edges strained by {:.0} %",
            residual.edge_strain * 100.0
        ));
    }
    Ok(residual)
}

/// Root mean square strain of the edges at these positions.
#[must_use]
pub fn strain(scene: &Scene, positions: &[Vec3]) -> f64 {
    residual(scene, positions.chunks(scene.shape.vertices.len())).edge_strain
}

fn check_body(scene: &Scene, body: &[Vec3], offset: Vec3) -> Result<(), String> {
    let rest = &scene.shape.vertices;
    let slip = |&pin: &u32| body[pin as usize].distance(rest[pin as usize] + offset);
    if scene.pins.iter().map(slip).any(|slip| slip > MAX_SLIP) {
        return Err("a pin moved".into());
    }
    let growth = diagonal(body) / diagonal(rest);
    if growth > MAX_GROWTH {
        return Err(format!("fell apart to {growth:.1} times its size"));
    }
    let moved = body.iter().zip(rest).map(|(x, r)| x.distance(*r + offset));
    if moved.fold(0.0, f32::max) < MIN_MOTION {
        return Err("does not move".into());
    }
    Ok(())
}

fn diagonal(points: &[Vec3]) -> f32 {
    let low = points.iter().copied().fold(Vec3::INFINITY, Vec3::min);
    let high = points.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
    low.distance(high)
}

fn residual<'a>(scene: &Scene, bodies: impl Iterator<Item = &'a [Vec3]>) -> Residual {
    let (mut edges, mut volumes) = (Mean::default(), Mean::default());
    let rest = |i: u32| scene.shape.vertices[i as usize].as_dvec3();
    for body in bodies {
        let now = |i: u32| body[i as usize].as_dvec3();
        for &[a, b] in &scene.shape.edges {
            edges.add(now(a).distance(now(b)) / rest(a).distance(rest(b)) - 1.0);
        }
        for corners in &scene.shape.tetrahedra {
            volumes.add(volume(corners.map(now)) / volume(corners.map(rest)) - 1.0);
        }
    }
    Residual {
        edge_strain: edges.root(),
        volume_strain: volumes.root(),
    }
}

#[derive(Default)]
struct Mean {
    squares: f64,
    count: usize,
}

impl Mean {
    fn add(&mut self, value: f64) {
        self.squares += value * value;
        self.count += 1;
    }

    fn root(&self) -> f64 {
        (self.squares / self.count.max(1) as f64).sqrt()
    }
}
