//! Actions: user input, carried out between ticks, in order.

use crate::support_app::{app_of, cubes, done, push, set, ticks};
use bevy::{ecs::message::Messages, prelude::*};
use pliant::{
    effect::{Collide, Stretch},
    mesh::Skin,
    scene::Scene,
    simulation::{Action, Applied, BodyDensity, BodySkin, Pins, Quarantined, SoftBody, state_hash},
    solver::{
        Cut, Density, Grab, ParticleIndex, Particles, SurfacePoint, VertexIndex,
        deform::Deformation, measure,
    },
};
use std::sync::Arc;

fn point() -> SurfacePoint {
    SurfacePoint::new(&[(ParticleIndex(0), 0.5), (ParticleIndex(1), 0.5)]).expect("sound")
}

fn particles(app: &App, body: Entity) -> &Particles {
    app.world().get::<Particles>(body).expect("a body")
}

#[test]
fn a_grabbed_body_follows_the_pointer_and_keeps_its_speed_when_released() {
    let (mut app, bodies, _) = app_of(&cubes());
    let body = bodies[0];
    let target = Vec3::new(0.0, 2.0, 0.0);
    let grab = Action::Grab {
        body,
        point: point(),
        target,
    };
    assert!(done(&mut app, grab).is_empty());
    ticks(&mut app, 240);
    let held = point().position(&particles(&app, body).positions);
    // Its spring stretches by 0.02 m under the weight, a twentieth of the body's size, and a body
    // that swings down from level pulls three times as hard.
    assert!(held.distance(target) < 0.06, "{held}");

    for step in 1..=30 {
        let target = target + Vec3::X * 0.05 * step as f32;
        push(&mut app, Action::MoveGrab { body, target });
        ticks(&mut app, 1);
    }
    let speed = |app: &App| particles(app, body).velocities().map(|v| v.x).sum::<f32>() / 8.0;
    let before = speed(&app);
    assert!(done(&mut app, Action::Release { body }).is_empty());
    assert!(app.world().get::<Grab>(body).is_none());
    ticks(&mut app, 1);
    let after = speed(&app);
    assert!(
        (after - before).abs() < 1e-3,
        "{before} m/s becomes {after}"
    );
    // It hangs on its corner as a pendulum, which swings by as much as its pivot has begun to move.
    assert!(
        (0.0..6.1).contains(&after),
        "it goes on at {after} m/s of the pointer's 3"
    );
}

#[test]
fn parameters_are_set_by_name_in_their_units() {
    let (mut app, bodies, _) = app_of(&cubes());
    assert!(done(&mut app, set(bodies[0], "stretch", "compliance", 2e-5)).is_empty());
    let stretch = app.world().get::<Stretch>(bodies[0]).expect("carried");
    assert_eq!(stretch.compliance.get(), 2e-5);
    assert!(done(&mut app, set(bodies[0], "ground", "height", -0.5)).is_empty());
}

#[test]
fn pinning_holds_a_particle_where_it_is_and_unpinning_lets_it_go() {
    let (mut app, bodies, _) = app_of(&cubes());
    let (body, vertex) = (bodies[0], VertexIndex(3));
    let before = particles(&app, body).positions[3].truncate();
    push(&mut app, Action::Pin { body, vertex });
    push(&mut app, Action::Pin { body, vertex });
    ticks(&mut app, 60);
    assert_eq!(particles(&app, body).positions[3].truncate(), before);
    assert_eq!(
        app.world().get::<Pins>(body).expect("has them").0,
        [vertex],
        "only once"
    );
    assert!(done(&mut app, Action::Unpin { body, vertex }).is_empty());
    ticks(&mut app, 60);
    assert_ne!(particles(&app, body).positions[3].truncate(), before);
}

#[test]
fn a_squashed_body_starts_anew_from_there_and_leaves_quarantine() {
    let (mut app, bodies, _) = app_of(&cubes());
    let body = bodies[0];
    ticks(&mut app, 10);
    app.world_mut()
        .get_mut::<Particles>(body)
        .expect("a body")
        .positions[0]
        .x = f32::NAN;
    ticks(&mut app, 1);
    assert!(app.world().get::<Quarantined>(body).is_some());
    let deformation = Deformation::Squash(0.5);
    assert!(done(&mut app, Action::Deform { body, deformation }).is_empty());
    assert!(app.world().get::<Quarantined>(body).is_none());
    ticks(&mut app, 300);
    assert!(particles(&app, body).first_not_finite().is_none());
}

#[test]
fn a_crushed_body_gets_its_shape_back_and_leaves_quarantine() {
    let (mut app, bodies, _) = app_of(&cubes());
    let body = bodies[0];
    let deformation = Deformation::Shuffle(3);
    assert!(done(&mut app, Action::Deform { body, deformation }).is_empty());
    ticks(&mut app, 1);
    app.world_mut()
        .get_mut::<Particles>(body)
        .expect("a body")
        .positions[0]
        .x = f32::NAN;
    ticks(&mut app, 1);
    assert!(app.world().get::<Quarantined>(body).is_some());
    assert!(done(&mut app, Action::ResetShape { body }).is_empty());
    assert!(app.world().get::<Quarantined>(body).is_none());
    let topology = app.world().get::<SoftBody>(body).expect("a body");
    let error = measure::shape_error(topology, &particles(&app, body).positions);
    // Positions near 1 m are rounded by 6e-8 m.
    assert!(error < 1e-6, "{error}");
}

#[test]
fn effects_are_added_and_removed_by_name() {
    let (mut app, bodies, _) = app_of(&cubes());
    let body = bodies[0];
    let effect = String::from("collide");
    assert!(
        done(
            &mut app,
            Action::AddEffect {
                body,
                effect: effect.clone()
            }
        )
        .is_empty()
    );
    assert!(app.world().get::<Collide>(body).is_some());
    assert!(done(&mut app, Action::RemoveEffect { body, effect }).is_empty());
    assert!(app.world().get::<Collide>(body).is_none());
}

#[test]
fn a_body_is_made_heavier_from_the_next_tick_on() {
    let (mut app, bodies, _) = app_of(&cubes());
    let body = bodies[0];
    let weight = |app: &App| -> f64 {
        let positions = &particles(app, body).positions;
        positions.iter().map(|x| 1.0 / f64::from(x.w)).sum()
    };
    ticks(&mut app, 1);
    let before = weight(&app);
    let old = app
        .world()
        .get::<BodyDensity>(body)
        .expect("a body")
        .0
        .get();
    let density = Density::new(2.0 * old).expect("in range");
    assert!(done(&mut app, Action::SetDensity { body, density }).is_empty());
    // Twice in f32, with w the inverse: an ulp or two.
    assert!((weight(&app) / before - 2.0).abs() < 1e-6);
}

#[test]
fn an_effect_that_is_there_keeps_its_parameters_when_it_is_added_again() {
    let (mut app, bodies, _) = app_of(&cubes());
    let body = bodies[0];
    assert!(done(&mut app, set(body, "stretch", "compliance", 2e-5)).is_empty());
    let effect = String::from("stretch");
    assert!(done(&mut app, Action::AddEffect { body, effect }).is_empty());
    let stretch = app.world().get::<Stretch>(body).expect("carried");
    assert_eq!(stretch.compliance.get(), 2e-5);
}

#[test]
fn actions_are_reported_with_their_ticks_in_order_and_can_be_repeated() {
    let record = |app: &mut App| -> Vec<Applied> {
        app.world_mut()
            .resource_mut::<Messages<Applied>>()
            .drain()
            .collect()
    };
    let (mut app, bodies, _) = app_of(&cubes());
    let body = bodies[0];
    ticks(&mut app, 5);
    push(&mut app, set(body, "stretch", "compliance", 1e-4));
    push(
        &mut app,
        Action::Pin {
            body,
            vertex: VertexIndex(2),
        },
    );
    ticks(&mut app, 5);
    push(
        &mut app,
        Action::Unpin {
            body,
            vertex: VertexIndex(2),
        },
    );
    ticks(&mut app, 50);
    let applied = record(&mut app);
    assert_eq!(
        applied.iter().map(|a| a.tick).collect::<Vec<_>>(),
        [5, 5, 10]
    );

    let (mut again, ..) = app_of(&cubes());
    for tick in 0..60 {
        for done in applied.iter().filter(|done| done.tick == tick) {
            push(&mut again, done.action.clone());
        }
        ticks(&mut again, 1);
    }
    assert_eq!(state_hash(again.world_mut()), state_hash(app.world_mut()));
}

/// Points of a skin stay where they are when the body is cut, and no triangle is left between the pieces.
#[test]
fn a_skin_comes_apart_with_its_body() {
    let text = "Scene(title: \"\", look_at: \"\", world: (gravity: (0, 0, 0)), bodies: [(name: \"bunny\", \
                mesh: (file: \"bunny\", size: 1, cells: 8), effects: (stretch: (), volume: ()))], \
                acceptance: (seconds: 1))";
    let built = text.parse::<Scene>().expect("a scene").build();
    let built = built.expect("a world");
    let skin = built.skins[0].clone().expect("a skin");
    let (mut app, bodies, _) = app_of(&built.world);
    let bunny = bodies[0];
    app.world_mut().entity_mut(bunny).insert(BodySkin(skin));
    let state = |app: &App| {
        let entity = app.world().entity(bunny);
        let (body, particles, skin) = entity.components::<(&SoftBody, &Particles, &BodySkin)>();
        let mut at = Vec::new();
        skin.0.deform(&body.0, particles, &mut at);
        (Arc::clone(&body.0), Arc::clone(&skin.0), at)
    };
    let longest = |skin: &Skin, at: &[Vec3]| {
        let sides = skin
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let lengths = sides.map(|[a, b]| at[a as usize].distance(at[b as usize]));
        lengths.fold(0.0, f32::max)
    };
    let (_, before, start) = state(&app);
    let cut = Cut {
        eye: Vec3::new(0.0, 9.0, 0.0),
        rays: [Vec3::new(0.0, -1.0, -1.0), Vec3::new(0.0, -1.0, 1.0)],
    };
    let refused = done(&mut app, Action::Cut { body: bunny, cut });
    assert!(refused.is_empty(), "{refused:?}");
    let (topology, after, at) = state(&app);
    // It is at rest in the tick of the cut, but for rounding.
    let moved = start.iter().zip(&at).map(|(a, b)| a.distance(*b));
    assert!(moved.fold(0.0, f32::max) < 1e-5);
    let removed = 1.0 - after.triangles.len() as f64 / before.triangles.len() as f64;
    // Those that the faces of the crack cross, in a strip around the body that is one of its own triangles wide.
    assert!(0.0 < removed && removed < 0.1, "{removed}");

    // Pieces, by the tetrahedra.
    let mut piece: Vec<usize> = (0..topology.particles()).collect();
    let mut changed = true;
    while std::mem::take(&mut changed) {
        for corners in topology.tetrahedra.corners() {
            let first = corners.map(|i| piece[i as usize]).into_iter().min();
            for i in corners {
                changed |= Some(std::mem::replace(
                    &mut piece[i as usize],
                    first.expect("four"),
                )) != first;
            }
        }
    }
    assert!(piece.iter().any(|it| *it != piece[0]), "it is cut in two");
    let mut particles = app.world_mut().get_mut::<Particles>(bunny).expect("a body");
    let mut sides = vec![0.0; piece.len()];
    for (i, piece) in piece.iter().enumerate() {
        sides[*piece] += particles.positions[i].x;
    }
    for i in 0..topology.particles() {
        particles.set_velocity(i, Vec3::X * sides[piece[i]].signum());
    }
    ticks(&mut app, 60);
    let (_, skin, at) = state(&app);
    // The pieces have gone a meter to the left or right, and are as they were.
    let (was, is) = (longest(&before, &start), longest(&skin, &at));
    assert!(is < 1.01 * was, "{was} m, then {is} m");
}
