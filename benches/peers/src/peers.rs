//! The peers, one per file, and the list of those in this build.

#[cfg(feature = "bullet")]
mod bullet;
#[cfg(feature = "jolt")]
mod jolt;
mod newton;
#[cfg(feature = "oxiphysics")]
mod oxiphysics;
mod pliant;
#[cfg(feature = "rapier")]
mod rapier;

pub use pliant::CrossingCounter;

use crate::peer::{Peer, PeerError};
use std::path::Path;

/// Available peers, Pliant first, and a sentence for each unavailable one.
#[must_use]
pub fn all(newton: Option<&Path>) -> (Vec<Box<dyn Peer>>, Vec<String>) {
    let (mut peers, mut left_out): (Vec<Box<dyn Peer>>, _) =
        (vec![Box::new(pliant::Pliant)], Vec::new());
    let mut take = |name: &str, peer: Result<Box<dyn Peer>, PeerError>| match peer {
        Ok(peer) => peers.push(peer),
        Err(reason) => left_out.push(format!("{name} is left out: {reason}.")),
    };
    take("Rapier", found("Rapier"));
    #[cfg(feature = "rapier")]
    take("Rapier FEM", Ok(Box::new(rapier::Rapier::Fem)));
    for name in ["Jolt", "OxiPhysics", "Bullet"] {
        take(name, found(name));
    }
    take(
        "Newton",
        newton.map_or_else(newton::not_asked_for, newton::find),
    );
    (peers, left_out)
}

fn found(name: &str) -> Result<Box<dyn Peer>, PeerError> {
    match name {
        #[cfg(feature = "rapier")]
        "Rapier" => Ok(Box::new(rapier::Rapier::Constraints)),
        #[cfg(feature = "jolt")]
        "Jolt" => jolt::find(),
        #[cfg(feature = "oxiphysics")]
        "OxiPhysics" => Ok(Box::new(oxiphysics::OxiPhysics)),
        #[cfg(feature = "bullet")]
        "Bullet" => bullet::find(),
        _ => Err(PeerError::Missing(format!(
            "built without the feature `{}`",
            name.to_lowercase()
        ))),
    }
}
