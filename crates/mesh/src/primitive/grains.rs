//! Loose balls in a region.

use super::{GrainRegion, MeshError, product};
use glam::{UVec3, Vec3};
use pliant_solver::RestShape;

/// Distance of neighboring grains, as a multiple of the largest diameter.
const SPACING: f32 = 1.05;

/// Largest displacement of a grain from its place in the lattice along each axis, as a fraction of
/// the largest diameter: two that approach each other do not touch.
const JITTER: f32 = 0.02;

/// Height of a layer, as a multiple of the distance of neighbors: each grain lies above the middle of
/// four. Columns of grains above each other would stand.
const LAYER: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// Places of the lattice along each axis.
fn places(size: Vec3, radius: f32) -> UVec3 {
    let spacing = 2.0 * radius * SPACING;
    // The last one needs no gap. Casts saturate.
    let along = |length: f32, spacing: f32| {
        ((length - 2.0 * radius) / spacing + 1.0 + 1e-4).max(0.0) as u32
    };
    UVec3::new(
        along(size.x, spacing),
        along(size.y, spacing * LAYER),
        along(size.z, spacing),
    )
}

/// Number of grains that fill a box.
pub(super) fn largest_count(size: Vec3, radius: f32) -> u64 {
    product(&places(size, radius).to_array())
}

/// Fills a region.
pub(super) fn fill(
    size: Vec3,
    region: GrainRegion,
    radius: f32,
    variation: f32,
) -> Result<RestShape, MeshError> {
    let places = places(size, radius);
    let spacing = 2.0 * radius * SPACING;
    let low = (places.as_vec3() - 1.0) * Vec3::new(-0.5, -0.5 * LAYER, -0.5) * spacing;
    let free = (size * 0.5 - radius).max(Vec3::splat(f32::MIN_POSITIVE));
    let mut shape = RestShape::default();
    let mut random = Hash(0);
    for y in 0..places.y {
        // Every other layer lies between the grains of the one below.
        let last = y % 2;
        let shift = 0.5 * last as f32;
        for z in 0..places.z.saturating_sub(last) {
            for x in 0..places.x.saturating_sub(last) {
                let place = Vec3::new(x as f32 + shift, y as f32 * LAYER, z as f32 + shift);
                let at = low + place * spacing;
                let relative = at / free;
                let is_inside = match region {
                    GrainRegion::Box => true,
                    GrainRegion::Cylinder => relative.with_y(0.0).length_squared() <= 1.0,
                    GrainRegion::Ball => relative.length_squared() <= 1.0,
                };
                let jitter = Vec3::from_array([(); 3].map(|()| 2.0 * random.next() - 1.0));
                let part = 1.0 - variation * random.next();
                if is_inside {
                    shape.vertices.push(at + jitter * (2.0 * radius * JITTER));
                    shape.radii.push(radius * part);
                }
            }
        }
    }
    if shape.vertices.is_empty() {
        let expected = format!("at most half of the shortest side of the region, {size} m");
        return Err(MeshError::parameter(
            "radius",
            format!("{radius} m"),
            expected,
        ));
    }
    Ok(shape)
}

/// Pseudo-random numbers by their ordinal: SplitMix64 (Steele, Lea and Flood 2014).
struct Hash(u64);

impl Hash {
    /// The next number, from 0 to 1.
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1_u64 << 24) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grains_lie_inside_and_apart() {
        let size = Vec3::new(0.3, 0.2, 0.25);
        for region in [GrainRegion::Box, GrainRegion::Cylinder, GrainRegion::Ball] {
            let shape = fill(size, region, 0.01, 0.4).expect("valid");
            let count = shape.vertices.len();
            assert!(count > 500, "{count}");
            for (i, (&x, &r)) in shape.vertices.iter().zip(&shape.radii).enumerate() {
                assert!((0.006..=0.01).contains(&r), "{r}");
                // Jitter takes at most its own length outside.
                let most = size / 2.0 + 0.02 * JITTER;
                assert!((x.abs() + r).cmple(most).all(), "{x} {r}");
                for (&y, &s) in shape.vertices[..i].iter().zip(&shape.radii) {
                    assert!(x.distance(y) >= r + s, "{x} {y}");
                }
            }
        }
    }

    #[test]
    fn a_region_that_is_too_small_for_a_grain_is_refused() {
        let size = Vec3::new(0.3, 0.01, 0.3);
        let error = fill(size, GrainRegion::Box, 0.01, 0.0).expect_err("too thin");
        assert!(error.to_string().contains("radius"), "{error}");
        assert_eq!(
            fill(size, GrainRegion::Box, 0.005, 0.0)
                .expect("one layer")
                .vertices
                .len(),
            28 * 28
        );
    }
}
