//! Volumes of tetrahedra.

use glam::Vec3;

/// Signed volume [m³] and its four gradients [m²] by cross products.
#[must_use]
pub fn volume_and_gradients([x0, x1, x2, x3]: [Vec3; 4]) -> (f32, [Vec3; 4]) {
    const SIXTH: f32 = 1.0 / 6.0;
    let (a, b, c) = (x1 - x0, x2 - x0, x3 - x0);
    let bc = b.cross(c);
    let (g1, g2, g3) = (bc * SIXTH, c.cross(a) * SIXTH, a.cross(b) * SIXTH);
    (a.dot(bc) * SIXTH, [-(g1 + g2 + g3), g1, g2, g3])
}
