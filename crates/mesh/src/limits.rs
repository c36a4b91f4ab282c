//! Checks of parameters, and the limits that bound memory.

use super::MeshError;

/// Maximum number of tetrahedra of a body.
pub const MAX_TETRAHEDRA: usize = 2_000_000;
/// Maximum number of particles of a cloth or a rope.
pub const MAX_PARTICLES: usize = 1_000_000;

/// Valid sizes [m]: within them f32 represents the volume of a cell at full precision.
pub const SIZES: std::ops::RangeInclusive<f32> = 1e-7..=1e7;

pub fn sizes<const N: usize>(sizes: [(&'static str, f32); N]) -> Result<(), MeshError> {
    for (name, size) in sizes {
        if !SIZES.contains(&size) {
            return Err(MeshError::parameter(
                name,
                format!("{size} m"),
                "a length from 1e-7 m to 1e7 m",
            ));
        }
    }
    Ok(())
}

pub fn count(name: &'static str, count: u32, least: u32) -> Result<(), MeshError> {
    if count < least {
        return Err(MeshError::parameter(
            name,
            count,
            format!("a whole number from {least}"),
        ));
    }
    Ok(())
}

pub fn range(
    name: &'static str,
    value: impl ToString,
    is_valid: bool,
    expected: &str,
) -> Result<(), MeshError> {
    match is_valid {
        true => Ok(()),
        false => Err(MeshError::parameter(name, value.to_string(), expected)),
    }
}

pub fn product(factors: &[u32]) -> u64 {
    factors
        .iter()
        .fold(1, |product: u64, f| product.saturating_mul(u64::from(*f)))
}

pub fn limit(tetrahedra: u64) -> Result<(), MeshError> {
    too_large("tetrahedra", tetrahedra, MAX_TETRAHEDRA)
}

pub fn particles(particles: u64) -> Result<(), MeshError> {
    too_large("particles", particles, MAX_PARTICLES)
}

fn too_large(what: &'static str, count: u64, limit: usize) -> Result<(), MeshError> {
    if count > limit as u64 {
        return Err(MeshError::TooLarge {
            what,
            count,
            limit: limit as u64,
            remedy: "use fewer cells, segments or strands",
        });
    }
    Ok(())
}
