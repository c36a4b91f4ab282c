//! The rigid pose of a body, as a scene file gives it: a position, and angles about x, y and z.

use crate::solver::contact::rotation_degrees;
use glam::{DMat3, DQuat, DVec3, Vec3};

/// Angles [°] about x, then y, then z that give a rotation: the inverse of [`rotation_degrees`].
pub fn degrees(rotation: &DMat3) -> Vec3 {
    let [x_axis, y_axis, z_axis] = [rotation.x_axis, rotation.y_axis, rotation.z_axis];
    let y = (-x_axis.z).clamp(-1.0, 1.0).asin();
    let (x, z) = if x_axis.z.abs() < 1.0 - 1e-12 {
        (y_axis.z.atan2(z_axis.z), x_axis.y.atan2(x_axis.x))
    } else {
        // Turned by 90° about y, the other two axes coincide.
        (0.0, (-y_axis.x).atan2(y_axis.y))
    };
    DVec3::new(x, y, z)
        .to_array()
        .map(|angle| angle.to_degrees() as f32)
        .into()
}

/// A rigid pose, and the largest distance of a point from it relative to the size of the shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidPose {
    /// Position [m].
    pub position: Vec3,
    /// Angles [°] about x, then y, then z.
    pub rotation: Vec3,
    /// Deviation of the points, relative to the size of the shape.
    pub deviation: f64,
}

/// The rigid pose that takes `rest` nearest to `points`. The same number of points, at least one.
pub fn rigid(rest: &[Vec3], points: &[Vec3]) -> RigidPose {
    let middle = |all: &[Vec3]| {
        let sum: DVec3 = all.iter().map(|x| x.as_dvec3()).sum();
        sum / all.len().max(1) as f64
    };
    let (rest_middle, now_middle) = (middle(rest), middle(points));
    let pose = |rotation: Vec3| {
        let turn = rotation_degrees(rotation);
        let position = (now_middle - turn * rest_middle).as_vec3();
        RigidPose {
            position,
            rotation,
            deviation: deviation(rest, points, &turn, position),
        }
    };
    // Most bodies are only moved.
    let still = pose(Vec3::ZERO);
    if still.deviation < 1e-5 {
        return still;
    }
    let mut covariance = [DVec3::ZERO; 3];
    for (a, b) in rest.iter().zip(points) {
        let (a, b) = (a.as_dvec3() - rest_middle, b.as_dvec3() - now_middle);
        for (axis, sum) in covariance.iter_mut().enumerate() {
            *sum += b * a[axis];
        }
    }
    let turned = pose(degrees(&polar(&DMat3::from_cols_array_2d(
        &covariance.map(|column| column.to_array()),
    ))));
    if turned.deviation < still.deviation {
        turned
    } else {
        still
    }
}

/// The rotation nearest to a matrix, by Müller's iteration on quaternions, from several starts so
/// that half a turn is found too.
fn polar(matrix: &DMat3) -> DMat3 {
    let starts = [
        DQuat::IDENTITY,
        DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0),
        DQuat::from_xyzw(0.0, 1.0, 0.0, 0.0),
        DQuat::from_xyzw(0.0, 0.0, 1.0, 0.0),
    ];
    let overlap = |turn: &DMat3| {
        let columns = [turn.x_axis, turn.y_axis, turn.z_axis];
        let others = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
        columns
            .iter()
            .zip(others)
            .map(|(a, b)| a.dot(b))
            .sum::<f64>()
    };
    let found = starts.map(|start| {
        let mut turn = start;
        for _ in 0..200 {
            let now = DMat3::from_quat(turn);
            let columns = [now.x_axis, now.y_axis, now.z_axis];
            let others = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
            let torque: DVec3 = columns.iter().zip(others).map(|(a, b)| a.cross(b)).sum();
            let weight: f64 = columns.iter().zip(others).map(|(a, b)| a.dot(b)).sum();
            let step = torque / (weight.abs() + 1e-30);
            if step.length() < 1e-15 {
                break;
            }
            turn = (DQuat::from_scaled_axis(step) * turn).normalize();
        }
        DMat3::from_quat(turn)
    });
    let best = found
        .into_iter()
        .max_by(|a, b| overlap(a).total_cmp(&overlap(b)));
    best.unwrap_or(DMat3::IDENTITY)
}

fn deviation(rest: &[Vec3], points: &[Vec3], turn: &DMat3, position: Vec3) -> f64 {
    let (low, high) = crate::solver::topology::bounds(rest.iter().copied());
    let size = f64::from((high - low).max_element()).max(1e-30);
    let largest = rest.iter().zip(points).map(|(a, b)| {
        let there = *turn * a.as_dvec3() + position.as_dvec3();
        there.distance(b.as_dvec3())
    });
    largest.fold(0.0, f64::max) / size
}

#[cfg(test)]
mod tests {
    use super::*;

    const ANGLES: [Vec3; 6] = [
        Vec3::ZERO,
        Vec3::new(30.0, -40.0, 100.0),
        Vec3::new(180.0, 0.0, 0.0),
        Vec3::new(0.0, 90.0, 20.0),
        Vec3::new(10.0, -90.0, 0.0),
        Vec3::new(-170.0, 80.0, 179.0),
    ];

    #[test]
    fn angles_read_from_a_rotation_give_the_same_rotation() {
        for angles in ANGLES {
            let turn = rotation_degrees(angles);
            let again = rotation_degrees(degrees(&turn));
            // Angles are rounded to f32: 180° to 1e-5°, which is 2e-7 rad.
            assert!(turn.abs_diff_eq(again, 1e-6), "{angles}: {again}");
        }
    }

    #[test]
    fn the_pose_of_a_moved_and_turned_shape_is_found() {
        let rest = [
            Vec3::new(1.0, 0.0, 0.0),
            Vec3::new(0.0, 0.5, 0.0),
            Vec3::new(0.0, 0.0, 0.25),
            Vec3::new(-1.0, -0.2, 0.1),
        ];
        for angles in ANGLES {
            let place = Vec3::new(3.0, -2.0, 0.5);
            let turn = rotation_degrees(angles);
            let points = rest.map(|x| (turn * x.as_dvec3() + place.as_dvec3()).as_vec3());
            let pose = rigid(&rest, &points);
            assert!(pose.deviation < 1e-6, "{angles}: {pose:?}");
            assert!(pose.position.distance(place) < 1e-5, "{angles}: {pose:?}");
        }
        let squashed = rest.map(|x| x * Vec3::new(1.0, 0.1, 1.0));
        assert!(rigid(&rest, &squashed).deviation > 0.05);
    }
}
