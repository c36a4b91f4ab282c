//! Interface of a peer: it builds a scene, ticks it, and reports its constraints and particles.
//! Measurement and checks are done elsewhere.

use crate::scenes::Scene;
use glam::Vec3;
use serde::Serialize;

/// Reason why a peer cannot be measured.
#[derive(Debug, thiserror::Error)]
pub enum PeerError {
    /// The peer was not compiled, or is not installed.
    #[error("{0}")]
    Missing(String),
    /// The peer cannot build the scene.
    #[error("cannot build {scene}: {reason}")]
    Scene {
        /// Name of the scene.
        scene: &'static str,
        /// Reason.
        reason: String,
    },
    /// Communication with the process of a peer failed.
    #[error("its process: {0}")]
    Process(String),
}

/// Number of constraints in a peer after the scene was built, over all bodies.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Distance constraints.
    pub edges: u64,
    /// Tetrahedra with a volume constraint.
    pub tetrahedra: u64,
    /// Constraints per tetrahedron.
    pub per_tetrahedron: u64,
}

impl Counts {
    /// Constraint projections of one iteration.
    #[must_use]
    pub fn projections(&self) -> u64 {
        self.edges + self.tetrahedra * self.per_tetrahedron
    }
}

/// Constraints and particles of a run.
#[derive(Debug, Clone)]
pub struct Report {
    /// Number of constraints.
    pub counts: Counts,
    /// Positions of the particles [m], body by body, in the order of the scene.
    pub positions: Vec<Vec3>,
}

/// One scene in one peer.
pub trait Run {
    /// Steps 1/60 s in [`SUBSTEPS`](crate::scenes::SUBSTEPS) substeps of one iteration each.
    ///
    /// # Errors
    /// [`PeerError::Process`].
    fn tick(&mut self) -> Result<(), PeerError>;

    /// Current constraints and positions.
    ///
    /// # Errors
    /// [`PeerError::Process`].
    fn report(&mut self) -> Result<Report, PeerError>;
}

/// A soft-body solver.
pub trait Peer {
    /// Name in the table and for `--only`.
    fn name(&self) -> &'static str;
    /// Version, with its build options.
    fn version(&self) -> String;
    /// Settings of the run, and what one projection is, in a sentence or two.
    fn settings(&self) -> &'static str;
    /// Whether it can use more than one thread.
    fn is_parallel(&self) -> bool;
    /// Whether it has volume constraints of tetrahedra.
    fn has_volume(&self) -> bool {
        true
    }
    /// Whether soft bodies touch each other and themselves.
    fn has_contact(&self) -> bool {
        false
    }
    /// Builds a scene that is ticked by a number of threads.
    ///
    /// # Errors
    /// [`PeerError`] if the scene cannot be built.
    fn build(&self, scene: &Scene, threads: usize) -> Result<Box<dyn Run>, PeerError>;
}
