//! Smooth noise over space, identical on every machine.

use crate::kernel::random::Draws;
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

/// Vector of a lattice point.
fn at(x: i64, y: i64, z: i64) -> DVec3 {
    let mut draws = Draws::new([x, y, z].map(|number| number as u64));
    let mut number = || draws.next() * 2.0 - 1.0;
    DVec3::new(number(), number(), number())
}
