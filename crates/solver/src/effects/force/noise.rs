//! Smooth noise over space, identical on every machine.

use glam::DVec3;

/// A vector with components from −1 to 1 that varies over lengths of 1: value noise on a lattice,
/// with interpolation by 3t² − 2t³.
pub fn vector(place: DVec3) -> DVec3 {
    let cell = place.floor();
    let t = place - cell;
    let t = t * t * (DVec3::splat(3.0) - 2.0 * t);
    let corner = |dx: i64, dy: i64, dz: i64| {
        at(
            (cell.x as i64).wrapping_add(dx),
            (cell.y as i64).wrapping_add(dy),
            (cell.z as i64).wrapping_add(dz),
        )
    };
    let along_x = |dy, dz| corner(0, dy, dz).lerp(corner(1, dy, dz), t.x);
    let along_y = |dz| along_x(0, dz).lerp(along_x(1, dz), t.y);
    along_y(0).lerp(along_y(1), t.z)
}

/// Vector of a lattice point, by a bit mixer on its coordinates (Steele, Lea and Flood, *Fast
/// Splittable Pseudorandom Number Generators*, 2014).
fn at(x: i64, y: i64, z: i64) -> DVec3 {
    let mut seed = 0;
    for number in [x, y, z] {
        seed = mix(seed ^ number as u64);
    }
    let mut number = || {
        seed = mix(seed);
        // 53 bits, from −1 to 1.
        (seed >> 11) as f64 * (2.0 / 9_007_199_254_740_992.0) - 1.0
    };
    DVec3::new(number(), number(), number())
}

fn mix(number: u64) -> u64 {
    let mut z = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
