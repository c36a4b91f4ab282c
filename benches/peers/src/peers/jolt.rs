//! Jolt, compiled from its source; see also `native/jolt.cpp`.

use crate::peer::{Peer, PeerError};

/// Jolt, if it was compiled.
///
/// # Errors
/// [`PeerError::Missing`] with the build script's reason.
pub fn find() -> Result<Box<dyn Peer>, PeerError> {
    #[cfg(jolt)]
    return Ok(Box::new(linked::Jolt));
    #[cfg(not(jolt))]
    Err(PeerError::Missing(
        option_env!("PEERS_JOLT_MISSING")
            .unwrap_or("the build script did not compile it")
            .into(),
    ))
}

#[cfg(jolt)]
mod linked {
    use crate::{
        native::JOLT,
        peer::{Peer, PeerError, Run},
        scenes::Scene,
    };

    pub struct Jolt;

    impl Peer for Jolt {
        fn name(&self) -> &'static str {
            "Jolt"
        }

        fn version(&self) -> String {
            JOLT.version()
        }

        fn settings(&self) -> &'static str {
            "`PhysicsSystem::Update` with 16 iterations (its substeps), constraints ordered by \
             `SoftBodySharedSettings::Optimize`, no damping, no sleep, nothing that collides; \
             compiled with -O3 and, on x86-64, AVX2 and FMA, as Jolt's own build does. One thread \
             is `JobSystemSingleThreaded`, more are `JobSystemThreadPool`."
        }

        fn is_parallel(&self) -> bool {
            true
        }

        fn build(&self, scene: &Scene, threads: usize) -> Result<Box<dyn Run>, PeerError> {
            JOLT.build(scene, threads)
        }
    }
}
