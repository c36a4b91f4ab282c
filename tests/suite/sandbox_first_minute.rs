//! What a newcomer does first: nothing shows an alarm in the scenes that the program and its README open
//! with, at rest, while a hand drags something, and after it let go.

use crate::support_app::{push, ticks};
use bevy::prelude::*;
use pliant::{
    recording::{About, Snapshot},
    sandbox::panel::figures::figures,
    scene::{Scene, run::headless},
    simulation::{Action, SoftBody, Statistics, plain::bodies_in_order},
    solver::{ParticleIndex, Particles, SurfacePoint},
};

/// Ticks per second.
const RATE: usize = 60;
/// How far a hand drags [m]: more than a third of the height of a screen, as the scenes are framed.
const WAY: f32 = 0.45;
/// The least cosine between a drag and the way from the center of the body to where it is held.
const INTO: f32 = -0.3;

/// The places where a hand would take a body: the particle that lies farthest in each of some directions.
fn places(app: &App, body: Entity) -> Vec<usize> {
    let entity = app.world().entity(body);
    let particles = entity.get::<Particles>().expect("a body");
    let directions = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::Z];
    let along = |direction: Vec3| {
        let of = |particle: &usize| particles.position(*particle).as_vec3().dot(direction);
        (0..particles.len()).max_by(|a, b| of(a).total_cmp(&of(b)))
    };
    directions.iter().filter_map(|it| along(*it)).collect()
}

/// Advances, and asserts that no tick shows an alarm.
fn calm(app: &mut App, count: usize, what: &str) {
    for _ in 0..count {
        ticks(app, 1);
        let statistics = Statistics::measure(app.world_mut());
        let alarms = figures(None, &statistics, None);
        let alarms: Vec<_> = alarms.iter().filter(|it| it.alarm).collect();
        assert!(alarms.is_empty(), "{what}: {alarms:?}");
        let (inverted, tick) = (statistics.inverted, statistics.tick);
        assert_eq!(inverted, 0, "{what}: inverted elements in tick {tick}");
        let crossings = statistics.crossings.unwrap_or(0);
        assert_eq!(crossings, 0, "{what}: crossings in tick {tick}");
    }
}

/// The point of the surface at a particle that a pointer hits: within a triangle, where there is one.
fn point(app: &App, body: Entity, particle: usize) -> SurfacePoint {
    let topology = app.world().get::<SoftBody>(body).expect("a body");
    let particle = particle as u32;
    let triangle = topology.triangles.iter().find(|it| it.contains(&particle));
    let corners = triangle.map_or(vec![(particle, 1.0)], |corners| {
        let weight = |corner| if corner == particle { 0.5 } else { 0.25 };
        corners.iter().map(|it| (*it, weight(*it))).collect()
    });
    let corners = corners
        .into_iter()
        .map(|(corner, weight)| (ParticleIndex(corner), weight));
    SurfacePoint::new(&Vec::from_iter(corners)).expect("sound")
}

/// Directions in which a hand drags: up, to the sides, and to the viewer.
const DIRECTIONS: [Vec3; 4] = [Vec3::Y, Vec3::X, Vec3::NEG_X, Vec3::new(0.3, 0.3, 0.9)];

/// Drags each body of a scene at each of its places within half a second, holds it for half as long, and lets go.
///
/// Not through itself: a point that a hand pushes far into its body turns elements inside out for as long as
/// it is held there, with any material.
fn first_minute(name: &str) {
    let scene = Scene::load(name).expect("a built-in scene").scene;
    let built = scene.build().expect("it builds");
    let mut app = headless(&built);
    calm(&mut app, 2 * RATE, "at rest");
    let rest = Snapshot::take(app.world_mut(), About::default()).expect("between ticks");
    let count = bodies_in_order(app.world_mut()).len();
    let mut drags = 0;
    for index in 0..count {
        let body = bodies_in_order(app.world_mut())[index];
        for particle in places(&app, body) {
            for direction in DIRECTIONS.map(Vec3::normalize) {
                let particles = app.world().get::<Particles>(body).expect("a body");
                let start = particles.position(particle).as_vec3();
                let all = (0..particles.len()).map(|it| particles.position(it).as_vec3());
                let out = start - all.sum::<Vec3>() / particles.len() as f32;
                if out.normalize().dot(direction) < INTO {
                    continue;
                }
                drags += 1;
                let mut app = headless(&rest.built);
                let body = bodies_in_order(app.world_mut())[index];
                let what = format!("{name}: body {index}, particle {particle}, to {direction}");
                drag(&mut app, body, particle, direction, &what);
            }
        }
    }
    assert!(drags >= 8 * count, "{drags} drags of {count} bodies");
}

/// Drags a particle of a body.
fn drag(app: &mut App, body: Entity, particle: usize, direction: Vec3, what: &str) {
    let particles = app.world().get::<Particles>(body).expect("a body");
    let start = particles.position(particle).as_vec3();
    let point = point(app, body, particle);
    let grab = Action::Grab {
        body,
        point,
        target: start,
    };
    push(app, grab);
    for step in 1..=RATE / 2 {
        let target = start + direction * WAY * (2.0 * step as f32 / RATE as f32);
        push(app, Action::MoveGrab { body, target });
        calm(app, 1, what);
    }
    calm(app, RATE / 4, what);
    push(app, Action::Release { body });
    calm(app, RATE / 2, &format!("{what}, let go"));
}

#[test]
fn nothing_alarms_in_the_scene_that_the_program_opens_with() {
    first_minute("welcome");
}

#[test]
fn nothing_alarms_in_the_scene_that_the_readme_opens_with() {
    first_minute("bunny");
}
