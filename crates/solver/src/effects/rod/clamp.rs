//! Clamped segments: those between two pins turn as these move.

use glam::{DQuat, DVec3};

/// Angle [rad] below which a clamped segment is not turned. The rounding of pins that move together
/// turns the direction between them by less.
const ALIGNED: f64 = 1e-7;
/// Cosine of the largest turn of a substep; the rest is left to the next one.
const REVERSED: f64 = 1e-6 - 1.0;

/// Rotation vector that [turns](super::system::turned) a clamped segment of an `orientation` to the
/// direction `along` [m] between its pins, by the shortest rotation (parallel transport), and about
/// that direction by an angle α, given as tan(α/2).
///
/// Rotations q ∝ (g, 1) with g = tan(θ/2) and its axis (Rodrigues' vector): that of first b and then a
/// is (a + b + a × b)/(1 − a·b), where a·b = 0 here.
pub fn carried(orientation: DQuat, along: DVec3, tangent: f64) -> DVec3 {
    let axis = orientation * DVec3::Z;
    let direction = along.normalize_or(axis);
    let (sine, cosine) = (axis.cross(direction), axis.dot(direction));
    let swing = if cosine < REVERSED {
        axis.any_orthonormal_vector() / ALIGNED
    } else if cosine > 0.0 && sine.length_squared() < ALIGNED * ALIGNED {
        DVec3::ZERO
    } else {
        sine / (1.0 + cosine)
    };
    let turn = direction * tangent;
    2.0 * (turn + swing + turn.cross(swing))
}

#[cfg(test)]
mod tests {
    use super::{super::system::turned, *};

    #[test]
    fn a_clamp_follows_its_pins_and_turns_about_them_by_the_angle() {
        let start = DQuat::from_xyzw(0.3, -0.2, 0.5, 0.4).normalize();
        for along in [
            DVec3::new(1.0, 2.0, -3.0),
            start * DVec3::Z,
            start * DVec3::X,
            start * DVec3::new(0.1, 0.0, -1.0),
        ] {
            let shortest = DQuat::from_rotation_arc(start * DVec3::Z, along.normalize());
            for angle in [0.0_f64, 0.3, -2.0, 3.0] {
                let found = turned(start, carried(start, along, libm::tan(0.5 * angle)));
                let about = DQuat::from_axis_angle(along.normalize(), angle);
                let expected = about * shortest * start;
                // Rounding of f64, ten times where the turn is almost half a turn.
                let off = 1.0 - found.dot(expected).abs();
                assert!(off < 1e-14, "{along}, {angle}: {off}");
            }
        }
    }

    #[test]
    fn a_clamp_that_points_the_other_way_turns_around() {
        let mut found = DQuat::IDENTITY;
        for _ in 0..2 {
            found = turned(found, carried(found, -DVec3::Z, 0.0));
        }
        assert!((found * DVec3::Z).distance(-DVec3::Z) < 1e-6, "{found}");
    }

    #[test]
    fn pins_that_stay_keep_every_bit() {
        let start = DQuat::from_xyzw(0.3, -0.2, 0.5, 0.4).normalize();
        let rounded = (start * DVec3::Z).as_vec3().as_dvec3();
        assert_eq!(carried(start, rounded, 0.0), DVec3::ZERO);
        assert_eq!(carried(start, DVec3::ZERO, 0.0), DVec3::ZERO);
    }
}
