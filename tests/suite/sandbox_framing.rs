//! Framing: each built-in scene opens with all of its bodies in the free area of the window, at any
//! size and with the panel anywhere, and shows them later or marks where they are.

use crate::scene_runs::is_whole;
use bevy::math::{Mat4, Rect, Vec2, Vec3, Vec4};
use pliant::{
    sandbox::{
        render::{
            framing::Subject,
            free_area::FreeArea,
            marks::{OutOfView, is_in_view, place},
            orbit::{FIELD_OF_VIEW, Orbit},
        },
        state::{display::Side, view::ViewSettings},
    },
    scene::{BuiltScene, Scene, registry::SCENES},
    solver::{Body, World},
};

/// Sizes of the window [px].
const SIZES: [Vec2; 3] = [
    Vec2::new(1280.0, 800.0),
    Vec2::new(900.0, 600.0),
    Vec2::new(1920.0, 1080.0),
];

/// Width of the panel [px]; 0 is hidden.
const PANELS: [(Side, f32); 3] = [
    (Side::Left, 344.0),
    (Side::Right, 344.0),
    (Side::Right, 0.0),
];

/// Height of the head-up line in two rows [px].
const HEAD_UP: f32 = 84.0;

fn area(window: Vec2, (panel_side, panel_width): (Side, f32)) -> FreeArea {
    let view = ViewSettings {
        panel_side,
        panel_width,
        head_up_height: HEAD_UP,
        ..ViewSettings::default()
    };
    FreeArea::new(&view, window)
}

fn built(name: &str) -> (Scene, BuiltScene) {
    let scene = Scene::load(name).expect("a sound scene").scene;
    let built = scene.build().expect("a sound scene");
    (scene, built)
}

/// The view with which a scene opens.
fn opening(scene: &Scene, built: &BuiltScene, area: &FreeArea) -> Orbit {
    let direction = scene
        .camera
        .map_or_else(Orbit::default, |it| Orbit::look(it.eye, it.target));
    direction.fitting(&Subject::with_motion(built).points, area)
}

fn positions(body: &Body) -> impl Iterator<Item = Vec3> + '_ {
    body.particles.positions.iter().map(|x| x.truncate())
}

/// Position on the screen [px] by the projection matrix of the renderer, whose center is moved by
/// half of the panel's width.
fn on_screen(orbit: Orbit, window: Vec2, panel: (Side, f32), point: Vec3) -> Vec2 {
    let view = orbit.transform().to_matrix().inverse();
    let lens = Mat4::perspective_infinite_reverse_rh(FIELD_OF_VIEW, window.x / window.y, 0.01);
    let clip: Vec4 = lens * view * point.extend(1.0);
    assert!(clip.w > 0.0, "{point} is behind the camera");
    let at = Vec2::new(clip.x, -clip.y) / clip.w;
    let shift = match panel.0 {
        Side::Left => panel.1 / 2.0,
        Side::Right => -panel.1 / 2.0,
    };
    (at + 1.0) / 2.0 * window + Vec2::X * shift
}

#[test]
fn every_scene_opens_with_all_bodies_in_the_free_area_whatever_the_window() {
    for builtin in SCENES {
        let (scene, built) = built(builtin.name);
        for window in SIZES {
            for panel in PANELS {
                let orbit = opening(&scene, &built, &area(window, panel));
                let (left, right) = match panel.0 {
                    Side::Left => (panel.1, window.x),
                    Side::Right => (0.0, window.x - panel.1),
                };
                let free = Rect::new(left, HEAD_UP, right, window.y);
                for body in &built.world.bodies {
                    for point in positions(body) {
                        let at = on_screen(orbit, window, panel, point);
                        assert!(
                            free.contains(at),
                            "{}: {} is at {at} of {window} with panel {panel:?}",
                            builtin.name,
                            body.name
                        );
                    }
                }
            }
        }
    }
}

/// A view that is filled, not a speck: the bodies, the ground below and the named region touch the
/// margins.
#[test]
fn every_scene_fills_the_free_area_in_one_direction() {
    for builtin in SCENES {
        let (scene, built) = built(builtin.name);
        let area = area(SIZES[0], PANELS[1]);
        let orbit = opening(&scene, &built, &area);
        let points = Subject::with_motion(&built).points;
        let seen = points.iter().map(|point| area.project(orbit.seen(*point)));
        let seen: Vec<Vec2> = seen.map(|at| at.expect("in front")).collect();
        let low = seen.iter().copied().reduce(Vec2::min).expect("bodies");
        let high = seen.iter().copied().reduce(Vec2::max).expect("bodies");
        let filled = (high - low) / area.framed().size();
        // A pixel of rounding.
        assert!(
            (filled.max_element() - 1.0).abs() < 2e-3,
            "{} fills {filled}",
            builtin.name
        );
    }
}

/// What one sees of a run, from the view with which the scene opens.
pub struct View {
    area: FreeArea,
    orbit: Orbit,
    /// Why it is no good view.
    pub problems: Vec<String>,
}

impl View {
    pub fn opening(scene: &Scene, built: &BuiltScene) -> Self {
        let area = area(SIZES[0], PANELS[1]);
        Self {
            orbit: opening(scene, built, &area),
            area,
            problems: Vec::new(),
        }
    }

    /// What has left the view has a mark, and most bodies have not.
    pub fn see(&mut self, world: &World) {
        let Self { area, orbit, .. } = self;
        let mut out = Vec::new();
        for (body, key) in world.bodies.iter().zip(0..) {
            let seen = || positions(body).map(|point| orbit.seen(point));
            if !is_in_view(seen(), area) {
                let center = seen().sum::<Vec3>() / body.particles.positions.len() as f32;
                let name = body.name.clone();
                out.push(OutOfView { key, name, center });
            }
        }
        let hidden = out.len();
        let marks = place(out, area);
        let marked: usize = marks.iter().map(|mark| mark.bodies.len()).sum();
        let at_edge = marks.iter().all(|mark| area.clear.contains(mark.tip));
        let (of, time) = (world.bodies.len(), world.time);
        if marked != hidden || !at_edge {
            let problem = format!("{marked} of {hidden} marked at {time:.2} s");
            self.problems.push(problem);
        }
        if 2 * hidden > of {
            let problem = format!("{hidden} of {of} bodies are out of view at {time:.2} s");
            self.problems.push(problem);
        }
    }

    /// At last, most particles are in view.
    pub fn see_last(&mut self, world: &World) {
        // Pieces of a torn body and emitted grains may fly away.
        let whole = world.bodies.iter().filter(|body| is_whole(body));
        let all: Vec<Vec3> = whole.flat_map(positions).collect();
        let visible = all.iter().filter(|point| {
            let at = self.area.project(self.orbit.seen(**point));
            at.is_some_and(|at| self.area.beside_panel.contains(at))
        });
        let visible = visible.count() as f32 / all.len() as f32;
        if visible < 0.75 {
            let percent = 100.0 * visible;
            self.problems
                .push(format!("only {percent:.0} % of it is in view"));
        }
    }
}
