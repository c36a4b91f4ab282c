//! Where marks are placed, as plain functions.

use crate::sandbox::render::free_area::FreeArea;
use bevy::prelude::*;

/// Distance of marks from the edges of the free area [logical px].
const INSET: f32 = 14.0;
/// Marks closer than this are grouped [logical px].
const GROUPED: Vec2 = Vec2::new(130.0, 28.0);

/// A body of which nothing is in view.
#[derive(Debug, Clone, PartialEq)]
pub struct OutOfView {
    /// Key of the body.
    pub key: u64,
    /// Its name.
    pub name: String,
    /// Its center in camera space: x right, y up, z towards the eye [m].
    pub center: Vec3,
}

/// A mark at the edge of the free area.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// Tip of the arrow [logical px].
    pub tip: Vec2,
    /// Direction of the arrow on the screen, of length 1; y is down.
    pub direction: Vec2,
    /// The bodies in this direction, the first one at the tip.
    pub bodies: Vec<OutOfView>,
}

/// Whether at least one of the points in camera space [m] is in the part of the window beside the
/// panel and above the timeline.
pub fn is_in_view(points: impl IntoIterator<Item = Vec3>, area: &FreeArea) -> bool {
    points
        .into_iter()
        .filter_map(|point| area.project(point))
        .any(|at| area.beside_panel.contains(at) && at.y <= area.clear.max.y)
}

/// One mark for each body, grouped where they would overlap.
pub fn place(bodies: impl IntoIterator<Item = OutOfView>, area: &FreeArea) -> Vec<Mark> {
    let mut marks: Vec<Mark> = Vec::new();
    for body in bodies {
        // The same for points behind the eye: the side to which the view must turn.
        let direction = Vec2::new(body.center.x, -body.center.y);
        let direction = direction.try_normalize().unwrap_or(Vec2::Y);
        let tip = on_edge(area, direction);
        let near = |mark: &&mut Mark| (mark.tip - tip).abs().cmplt(GROUPED).all();
        match marks.iter_mut().find(near) {
            Some(mark) => mark.bodies.push(body),
            None => marks.push(Mark {
                tip,
                direction,
                bodies: vec![body],
            }),
        }
    }
    marks
}

/// Where a ray from the center of the view leaves the clear area.
fn on_edge(area: &FreeArea, direction: Vec2) -> Vec2 {
    let center = area.center();
    let inset = INSET.min(area.clear.size().min_element() / 4.0);
    let edges = area.clear.inflate(-inset);
    let reach = |from: f32, low: f32, high: f32, along: f32| {
        if along == 0.0 {
            return f32::INFINITY;
        }
        ((if along > 0.0 { high } else { low }) - from) / along
    };
    let x = reach(center.x, edges.min.x, edges.max.x, direction.x);
    let y = reach(center.y, edges.min.y, edges.max.y, direction.y);
    (center + x.min(y) * direction).clamp(edges.min, edges.max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sandbox::state::{display::Side, view::ViewSettings};

    fn area() -> FreeArea {
        let view = ViewSettings {
            panel_width: 344.0,
            panel_side: Side::Right,
            head_up_height: 52.0,
            strip_height: 34.0,
            ..default()
        };
        FreeArea::new(&view, Vec2::new(1280.0, 800.0))
    }

    fn body(x: f32, y: f32, z: f32) -> OutOfView {
        OutOfView {
            key: 7,
            name: "ball".to_owned(),
            center: Vec3::new(x, y, z),
        }
    }

    #[test]
    fn marks_are_at_the_edge_on_the_side_of_the_body_also_behind_the_camera() {
        let area = area();
        for z in [-1.0, 1.0] {
            let [mark] = &place([body(50.0, 0.0, z)], &area)[..] else {
                panic!("one mark");
            };
            assert_eq!(mark.tip, Vec2::new(936.0 - INSET, 400.0));
            assert_eq!(mark.direction, Vec2::X);
            let [mark] = &place([body(0.0, -50.0, z)], &area)[..] else {
                panic!("one mark");
            };
            assert_eq!(mark.tip, Vec2::new(468.0, 756.0 - INSET));
        }
        let [mark] = &place([body(0.0, 0.0, 1.0)], &area)[..] else {
            panic!("one mark");
        };
        assert!(mark.tip.is_finite());
    }

    #[test]
    fn bodies_in_one_direction_share_a_mark_and_others_do_not() {
        let bodies = [
            body(50.0, 0.0, -1.0),
            body(60.0, 1.0, -1.0),
            body(-50.0, 0.0, -1.0),
        ];
        let counts: Vec<_> = place(bodies, &area())
            .iter()
            .map(|it| it.bodies.len())
            .collect();
        assert_eq!(counts, [2, 1]);
    }

    #[test]
    fn what_the_panel_covers_or_is_behind_the_eye_is_out_of_view() {
        let area = area();
        let at = |x: f32| Vec3::new((x - area.center().x) * area.pixel(), 0.0, -1.0);
        assert!(is_in_view([at(900.0)], &area));
        assert!(!is_in_view([at(1000.0)], &area));
        assert!(!is_in_view([Vec3::Z], &area));
    }
}
