//! Smooth noise over space, identical on every machine.

use crate::kernel::random::Draws;
use glam::DVec3;

/// Noise that remembers the cells of its lattice that it was evaluated in.
///
/// Drawing the vectors of a cell's corners takes much longer than to interpolate between them, and
/// neighboring triangles are in the same cell. The values do not depend on what is remembered.
#[derive(Debug, Default)]
pub struct Noise {
    /// By the parity of the cell's place along each axis, so that neighbors do not displace each
    /// other.
    cells: [Option<Cell>; 8],
}

/// A cell of the lattice, with the vectors of its corners: x changes first, z last.
#[derive(Debug)]
struct Cell {
    place: [i64; 3],
    corners: [DVec3; 8],
}

impl Noise {
    /// A vector with components from −1 to 1 that varies over lengths of 1: value noise on a
    /// lattice, with interpolation by 3t² − 2t³.
    pub fn at(&mut self, place: DVec3) -> DVec3 {
        let floor = DVec3::new(floor(place.x), floor(place.y), floor(place.z));
        let t = place - floor;
        let t = t * t * (DVec3::splat(3.0) - 2.0 * t);
        let [a, b, c, d, e, f, g, h] = self.corners(floor.to_array().map(|x| x as i64));
        let along_x = |from: DVec3, to: DVec3| from.lerp(to, t.x);
        let near = along_x(a, b).lerp(along_x(c, d), t.y);
        let far = along_x(e, f).lerp(along_x(g, h), t.y);
        near.lerp(far, t.z)
    }

    fn corners(&mut self, place: [i64; 3]) -> [DVec3; 8] {
        let [x, y, z] = place;
        let slot = &mut self.cells[(x & 1 | (y & 1) << 1 | (z & 1) << 2) as usize];
        if let Some(cell) = slot.as_ref().filter(|cell| cell.place == place) {
            return cell.corners;
        }
        let corners = std::array::from_fn(|i| {
            let step = |x: i64, bit: usize| x.wrapping_add((i >> bit & 1) as i64);
            drawn([step(x, 0), step(y, 1), step(z, 2)])
        });
        slot.insert(Cell { place, corners }).corners
    }
}

/// ⌊x⌋, without the call of a function where the instruction set has no operation for it.
fn floor(x: f64) -> f64 {
    /// All numbers from here on are integers.
    const INTEGERS: f64 = (1_u64 << 52) as f64;
    if x.abs() < INTEGERS {
        let toward_zero = x as i64 as f64;
        return toward_zero - f64::from(u8::from(toward_zero > x));
    }
    x
}

/// Vector of a lattice point.
fn drawn(place: [i64; 3]) -> DVec3 {
    let mut draws = Draws::new(place.map(|number| number as u64));
    let mut number = || draws.next() * 2.0 - 1.0;
    DVec3::new(number(), number(), number())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_remembered_does_not_change_the_noise() {
        let mut noise = Noise::default();
        let mut draws = Draws::new([7]);
        for i in 0..10_000 {
            // Neighboring cells, distant ones in the same slot, and the ends of the numbers.
            let size = [2.0, 9.0, 1e4, 1e300][i % 4];
            let place = DVec3::from_array([(); 3].map(|()| (draws.next() - 0.5) * size));
            let fresh = Noise::default().at(place);
            assert_eq!(noise.at(place).to_array(), fresh.to_array(), "{place}");
        }
    }

    #[test]
    fn the_noise_is_that_of_the_lattice_at_its_points_and_halfway() {
        let mut noise = Noise::default();
        let [a, b] = [[3, -2, 5], [3, -1, 5]];
        assert_eq!(noise.at(DVec3::new(3.0, -2.0, 5.0)), drawn(a));
        // 3t² − 2t³ is exactly 1/2 there.
        let half = noise.at(DVec3::new(3.0, -1.5, 5.0));
        assert_eq!(half, drawn(a).lerp(drawn(b), 0.5));
    }

    #[test]
    fn the_floor_is_that_of_the_standard_library() {
        let mut draws = Draws::new([9]);
        let drawn = (0..10_000).map(|i| (draws.next() - 0.5) * [3.0, 1e9, 1e17, 1e300][i % 4]);
        let edges = [0.0, -0.0, 1.0, -1.0, 0.5, -0.5, 4.5e15, -4.5e15, 1e16];
        for x in drawn.chain(edges) {
            assert_eq!(floor(x), x.floor(), "{x}");
        }
    }
}
