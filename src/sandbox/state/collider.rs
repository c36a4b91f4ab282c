//! Where a collider is for the user.

use crate::{
    simulation::SimulationClock,
    solver::{Collider, Path, Pose},
};

/// Pose at which a collider is drawn and pressed at a simulated time [s]. It moves with the ticks;
/// while the simulation is paused, one that was dragged is shown where the next tick takes it.
#[must_use]
pub fn shown_pose(collider: &Collider, time: f64, clock: &SimulationClock) -> Pose {
    match collider.path {
        Path::Glide { .. } if clock.paused => collider.start,
        _ => collider.pose_at(time),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::ColliderShape;
    use glam::DVec3;

    #[test]
    fn a_collider_that_is_dragged_in_a_pause_is_shown_where_it_was_dragged_to() {
        let from = Pose::default();
        let to = Pose {
            translation: DVec3::X,
            ..from
        };
        let glide = Path::Glide {
            from,
            begin: 0.0,
            end: 0.5,
        };
        let shape = ColliderShape::Sphere { radius: 1.0 };
        let dragged = Collider::moving(shape, to, glide).expect("it is valid");
        let mut clock = SimulationClock::default();
        assert_eq!(shown_pose(&dragged, 0.0, &clock), from);
        assert_eq!(shown_pose(&dragged, 0.5, &clock), to);
        clock.paused = true;
        assert_eq!(shown_pose(&dragged, 0.0, &clock), to);
    }
}
