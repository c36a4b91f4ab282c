//! Bullet, as installed on the system; see also `native/bullet.cpp`.

use crate::peer::{Peer, PeerError};

/// Bullet, if it was found.
///
/// # Errors
/// [`PeerError::Missing`] with the build script's reason.
pub fn find() -> Result<Box<dyn Peer>, PeerError> {
    #[cfg(bullet)]
    return Ok(Box::new(linked::Bullet));
    #[cfg(not(bullet))]
    Err(PeerError::Missing(
        option_env!("PEERS_BULLET_MISSING")
            .unwrap_or("the build script did not find it")
            .into(),
    ))
}

#[cfg(bullet)]
mod linked {
    use crate::{
        native::BULLET,
        peer::{Peer, PeerError, Run},
        scenes::Scene,
    };

    pub struct Bullet;

    impl Peer for Bullet {
        fn name(&self) -> &'static str {
            "Bullet"
        }

        fn version(&self) -> String {
            BULLET.version()
        }

        fn settings(&self) -> &'static str {
            "Links only, for it has no volume of a tetrahedron in this solver: its figure counts \
             edges alone. `predictMotion` and `solveConstraints` a substep with one position \
             iteration, `integrateMotion` a tick, without its collision world; kLST = 2/3, which \
             gives way as the others' compliance does; links ordered by `ReoptimizeLinkOrder`; as \
             the system's library was compiled. One thread."
        }

        fn is_parallel(&self) -> bool {
            false
        }

        fn has_volume(&self) -> bool {
            false
        }

        fn build(&self, scene: &Scene, threads: usize) -> Result<Box<dyn Run>, PeerError> {
            BULLET.build(scene, threads)
        }
    }
}
