//! What a peer is to the bench: something that builds a scene and ticks it.
//!
//! A peer measures nothing and judges nothing; it says what it holds and where its particles are.

use crate::scenes::Scene;
use glam::Vec3;
use serde::Serialize;

/// Why a peer cannot take part, or stopped doing so.
#[derive(Debug, thiserror::Error)]
pub enum PeerError {
    /// It was not compiled, or is not installed.
    #[error("{0}")]
    Missing(String),
    /// It refused the scene.
    #[error("cannot build {scene}: {reason}")]
    Scene {
        /// Name of the scene.
        scene: &'static str,
        /// What it said.
        reason: String,
    },
    /// A peer in a process of its own stopped talking.
    #[error("its process: {0}")]
    Process(String),
}

/// The constraints that a peer holds after it was built, over all bodies.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Distances.
    pub edges: u64,
    /// Tetrahedra that it keeps the volume of.
    pub tetrahedra: u64,
    /// Constraints that it solves for each of those.
    pub per_tetrahedron: u64,
}

impl Counts {
    /// Constraint projections of one sweep.
    #[must_use]
    pub fn projections(&self) -> u64 {
        self.edges + self.tetrahedra * self.per_tetrahedron
    }
}

/// What a run holds and where it is.
#[derive(Debug, Clone)]
pub struct Report {
    /// The constraints.
    pub counts: Counts,
    /// Particles [m], body by body, in the scene's order.
    pub positions: Vec<Vec3>,
}

/// One scene in one peer.
pub trait Run {
    /// Steps 1/60 s in [`SUBSTEPS`](crate::scenes::SUBSTEPS) substeps of one sweep each.
    ///
    /// # Errors
    /// [`PeerError::Process`].
    fn tick(&mut self) -> Result<(), PeerError>;

    /// What it holds, and where its particles are now.
    ///
    /// # Errors
    /// [`PeerError::Process`].
    fn report(&mut self) -> Result<Report, PeerError>;
}

/// A solver of soft bodies.
pub trait Peer {
    /// Its name in the table; also what `--only` takes.
    fn name(&self) -> &'static str;
    /// Its version, with what its build was told.
    fn version(&self) -> String;
    /// The settings that it runs with and what its projection means, in a sentence or two.
    fn settings(&self) -> &'static str;
    /// Whether it uses more than one thread if it may.
    fn is_parallel(&self) -> bool;
    /// Whether it keeps the volume of tetrahedra.
    fn has_volume(&self) -> bool {
        true
    }
    /// Builds a scene, to be ticked by so many threads.
    ///
    /// # Errors
    /// [`PeerError`], if it cannot.
    fn build(&self, scene: &Scene, threads: usize) -> Result<Box<dyn Run>, PeerError>;
}
