//! The part of the window that the panel and the head-up line leave free, and what is seen in it.

use super::orbit::{FIELD_OF_VIEW, Orbit};
use crate::sandbox::state::view::ViewSettings;
use bevy::prelude::*;

/// Minimum distance of framed points from the edges of the free area, as a fraction of its size.
const MARGIN: f32 = 0.05;
/// Space above the lower edge of the window or the timeline [logical px].
const FOOT: f32 = 10.0;
/// Minimum size of the area in which points are framed [logical px].
const MIN_SIZE: f32 = 40.0;

/// The free area of a window [logical px], from the window's top left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeArea {
    /// Size of the window.
    pub window: Vec2,
    /// The area beside the panel, at full height. Its center is the center of the view.
    pub beside_panel: Rect,
    /// The area for framed points and marks: without the head-up line and the timeline.
    pub clear: Rect,
}

impl FreeArea {
    /// The area of a window of this size.
    #[must_use]
    pub fn new(view: &ViewSettings, window: Vec2) -> Self {
        let window = window.max(Vec2::splat(MIN_SIZE));
        let (left, right) = view.free(window.x);
        let right = right.max(left + MIN_SIZE);
        let beside_panel = Rect::new(left, 0.0, right, window.y);
        // Limited to a third of the height each, so that the center of the view is inside.
        let third = window.y / 3.0;
        let clear = Rect::new(
            left,
            view.head_up_height.min(third),
            right,
            window.y - (view.strip_height + FOOT).min(third),
        );
        Self {
            window,
            beside_panel,
            clear,
        }
    }

    /// The area of an image, which nothing covers.
    #[must_use]
    pub fn whole(window: Vec2) -> Self {
        let all = Rect::from_corners(Vec2::ZERO, window.max(Vec2::ONE));
        Self {
            window: all.max,
            beside_panel: all,
            clear: all,
        }
    }

    /// The clear area without its margin.
    #[must_use]
    pub fn framed(&self) -> Rect {
        self.clear
            .inflate(-MARGIN * self.clear.size().min_element())
    }

    /// Center of the view: where the camera's axis meets the screen.
    #[must_use]
    pub fn center(&self) -> Vec2 {
        self.beside_panel.center()
    }

    /// Size of a pixel at a distance of 1 m from the eye [m/px].
    #[must_use]
    pub fn pixel(&self) -> f32 {
        2.0 * (FIELD_OF_VIEW / 2.0).tan() / self.window.y
    }

    /// Position on the screen of a point in camera space (x right, y up, z towards the eye) [m];
    /// `None` behind the eye.
    #[must_use]
    pub fn project(&self, point: Vec3) -> Option<Vec2> {
        let depth = -point.z;
        (depth > 0.0).then(|| self.center() + Vec2::new(point.x, -point.y) / (depth * self.pixel()))
    }
}

impl Orbit {
    /// A point in camera space: x right, y up, z towards the eye [m].
    #[must_use]
    pub fn seen(self, point: Vec3) -> Vec3 {
        let eye = self.transform();
        eye.rotation.inverse() * (point - eye.translation)
    }

    /// The orbit with the same direction and the smallest distance at which all points [m] are in
    /// the framed area; unchanged without points. Exact: of the four edges of the area, two opposite
    /// ones are touched.
    #[must_use]
    pub fn fitting(self, points: &[Vec3], area: &FreeArea) -> Self {
        let framed = area.framed();
        let center = area.center();
        let pixel = area.pixel();
        // Slopes of the planes through the eye and the edges of the area.
        let right = (framed.max.x - center.x) * pixel;
        let left = (center.x - framed.min.x) * pixel;
        let up = (center.y - framed.min.y) * pixel;
        let down = (framed.max.y - center.y) * pixel;

        // A point q is inside if −left·d ≤ q.x − eye.x ≤ right·d with the depth d = eye.z − q.z.
        let rotation = self.transform().rotation;
        let inverse = rotation.inverse();
        let mut planes = Planes::EMPTY;
        for point in points.iter().filter(|point| point.is_finite()) {
            let q = inverse * *point;
            planes.right = planes.right.max(q.x + right * q.z);
            planes.left = planes.left.min(q.x - left * q.z);
            planes.up = planes.up.max(q.y + up * q.z);
            planes.down = planes.down.min(q.y - down * q.z);
            planes.near = planes.near.max(q.z);
            planes.far = planes.far.min(q.z);
        }
        if planes.far > planes.near {
            return self;
        }
        let z = ((planes.right - planes.left) / (right + left))
            .max((planes.up - planes.down) / (up + down))
            .max(planes.near + Self::CLEARANCE);
        // In the direction with room to spare, the points are centered.
        let x = ((planes.right - right * z) + (planes.left + left * z)) / 2.0;
        let y = ((planes.up - up * z) + (planes.down + down * z)) / 2.0;
        let distance = Self::valid_distance(z - planes.near.midpoint(planes.far));
        Self {
            focus: rotation * Vec3::new(x, y, z - distance),
            distance,
            ..self
        }
    }
}

/// Extreme values of the planes through the points, parallel to the edges of the framed area.
struct Planes {
    right: f32,
    left: f32,
    up: f32,
    down: f32,
    near: f32,
    far: f32,
}

impl Planes {
    const EMPTY: Self = Self {
        right: f32::NEG_INFINITY,
        left: f32::INFINITY,
        up: f32::NEG_INFINITY,
        down: f32::INFINITY,
        near: f32::NEG_INFINITY,
        far: f32::INFINITY,
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sandbox::state::display::Side;

    fn area(side: Side, panel: f32) -> FreeArea {
        let view = ViewSettings {
            panel_side: side,
            panel_width: panel,
            head_up_height: 52.0,
            ..default()
        };
        FreeArea::new(&view, Vec2::new(1280.0, 800.0))
    }

    /// Rounding of coordinates of a few meters, in pixels at a distance of a few meters.
    const ROUNDING: f32 = 0.02;

    #[test]
    fn fitted_points_touch_two_opposite_edges_and_leave_none() {
        let points = [
            Vec3::new(-3.0, 0.0, 1.0),
            Vec3::new(2.0, 0.5, -4.0),
            Vec3::new(0.3, 1.9, 0.2),
        ];
        for area in [
            area(Side::Left, 344.0),
            area(Side::Right, 344.0),
            area(Side::Right, 0.0),
        ] {
            for yaw in [0.0, 0.7, -2.5] {
                let orbit = Orbit { yaw, ..default() }.fitting(&points, &area);
                let framed = area.framed();
                let seen = points.map(|point| area.project(orbit.seen(point)).expect("in front"));
                let low = seen.into_iter().reduce(Vec2::min).expect("three");
                let high = seen.into_iter().reduce(Vec2::max).expect("three");
                let gaps = [
                    low.x - framed.min.x,
                    framed.max.x - high.x,
                    low.y - framed.min.y,
                    framed.max.y - high.y,
                ];
                assert!(gaps.iter().all(|gap| *gap > -ROUNDING), "{gaps:?}");
                let tight = |a: f32, b: f32| a.abs() < ROUNDING && b.abs() < ROUNDING;
                assert!(
                    tight(gaps[0], gaps[1]) || tight(gaps[2], gaps[3]),
                    "{gaps:?}"
                );
            }
        }
    }

    #[test]
    fn a_single_point_and_no_point_have_an_orbit_too() {
        let area = area(Side::Right, 344.0);
        let orbit = Orbit::default().fitting(&[Vec3::ONE], &area);
        assert!(orbit.distance > 0.0 && orbit.focus.distance(Vec3::ONE) < 0.1);
        assert_eq!(Orbit::default().fitting(&[], &area), Orbit::default());
        let nothing = [Vec3::NAN, Vec3::INFINITY];
        assert_eq!(Orbit::default().fitting(&nothing, &area), Orbit::default());
    }

    #[test]
    fn a_window_that_the_panel_covers_has_an_area_still() {
        let area = area(Side::Left, 1280.0);
        assert!(area.framed().width() > 0.0 && area.framed().height() > 0.0);
        let orbit = Orbit::default().fitting(&[Vec3::ZERO, Vec3::ONE], &area);
        assert!(orbit.distance.is_finite());
    }
}
