//! Operations on the selected bodies: duplicate, rename, presets, paste.

use crate::support_app::app_of;
use bevy::prelude::*;
use pliant::{
    sandbox::{
        app::{bodies, presets},
        state::{
            look::HiddenBody,
            presets::Presets,
            selection::{Scope, Selection},
        },
        ui::message::Notices,
    },
    scene::{BodyParameters, Look, Scene},
    simulation::{Actions, BodyDensity, plain},
    solver::{ForceMask, Particles, Stretch, Wind},
};

const TEXT: &str = r#"Scene(
    title: "Two", look_at: "It.",
    bodies: [
        (name: "cube", primitive: Box(size: (0.4, 0.4, 0.4), cells: (2, 2, 2)), position: (0, 1, 0),
         effects: (stretch: (compliance: 1e-3, damping: 0.02), volume: (), ground: (friction: 0.7)),
         pins: [Vertex(3)]),
        (name: "cloth", primitive: Cloth(size: (1, 1), cells: (4, 4)), position: (2, 1, 0),
         effects: (stretch: (), bend: (stiffness: 0.25))),
    ],
    acceptance: (seconds: 1, checks: []),
)"#;

fn window() -> (App, Vec<Entity>) {
    let scene: Scene = TEXT.parse().expect("sound");
    let (mut app, bodies, _) = app_of(&scene.build().expect("sound").world);
    app.init_resource::<Selection>()
        .init_resource::<Notices>()
        .init_resource::<Presets>();
    (app, bodies)
}

fn errors(app: &mut App) -> Vec<String> {
    Actions::apply(app.world_mut());
    let errors = app.world_mut().resource_mut::<Actions>().take_errors();
    errors.iter().map(ToString::to_string).collect()
}

#[test]
fn a_copy_has_all_parameters_and_a_name_of_its_own_and_stands_beside_the_original() {
    let (mut app, bodies) = window();
    let color = [1, 2, 3];
    bodies::color(app.world_mut(), &Scope::body(bodies[0]), color);
    bodies::duplicate(app.world_mut(), &Scope::body(bodies[0]));
    let world = app.world_mut();
    let all = plain::bodies_in_order(world);
    assert_eq!(all.len(), 3);
    assert_eq!(world.resource::<Selection>().0, Scope::body(all[2]));
    let [original, copy] =
        [all[0], all[2]].map(|body| plain::body(world.entity(body)).expect("a body"));
    assert_eq!(copy.name, "cube 2");
    assert_eq!(copy.effects, original.effects);
    assert_eq!(
        (copy.density, &copy.pins),
        (original.density, &original.pins)
    );
    assert_eq!(
        world.get::<Look>(all[2]).and_then(|look| look.color),
        Some(color)
    );
    // Along x, as there is no camera: 0.4 m and a tenth of it; two roundings at 1 m.
    for (a, b) in original
        .particles
        .positions
        .iter()
        .zip(&copy.particles.positions)
    {
        let moved = (*b - *a).truncate();
        assert!((moved - Vec3::X * 0.44).length() < 1e-6, "{moved}");
    }
}

#[test]
fn several_bodies_are_copied_together_and_their_copies_are_selected() {
    let (mut app, bodies) = window();
    let both = Scope::of(bodies.iter().map(|body| body.to_bits()));
    bodies::duplicate(app.world_mut(), &both);
    let world = app.world_mut();
    let all = plain::bodies_in_order(world);
    let copies = Scope::of(all[2..].iter().map(|body| body.to_bits()));
    assert_eq!(world.resource::<Selection>().0, copies);
    let middle = |body: Entity| {
        let positions = &world.get::<Particles>(body).expect("a body").positions;
        positions.iter().map(|x| x.truncate()).sum::<Vec3>() / positions.len() as f32
    };
    let moved: Vec<Vec3> = (0..2)
        .map(|n| middle(all[n + 2]) - middle(all[n]))
        .collect();
    assert!(moved[0].distance(moved[1]) < 1e-5, "{moved:?}");
}

#[test]
fn a_name_is_unique_and_an_empty_or_taken_one_is_refused() {
    let (mut app, all) = window();
    let key = all[0].to_bits();
    for refused in ["cloth", "", "  "] {
        bodies::rename(app.world_mut(), key, refused);
        assert_eq!(bodies::name_of(app.world(), all[0]), "cube", "{refused}");
    }
    bodies::rename(app.world_mut(), key, " Jelly ");
    assert_eq!(bodies::name_of(app.world(), all[0]), "Jelly");
    let captured = plain::capture(app.world_mut());
    assert_eq!(captured.bodies[0].name, "Jelly", "it is saved");
}

#[test]
fn a_hidden_body_is_still_simulated() {
    let (mut app, all) = window();
    bodies::hide(app.world_mut(), &Scope::body(all[0]), true);
    assert!(app.world().get::<HiddenBody>(all[0]).is_some());
    let height = |app: &App| {
        let positions = &app
            .world()
            .get::<Particles>(all[0])
            .expect("a body")
            .positions;
        positions.iter().map(|x| x.y).sum::<f32>()
    };
    let before = height(&app);
    crate::support_app::ticks(&mut app, 10);
    assert!(height(&app) < before);
    bodies::hide(app.world_mut(), &Scope::All, false);
    assert!(app.world().get::<HiddenBody>(all[0]).is_none());
}

#[test]
fn pasted_parameters_replace_effects_and_density() {
    let (mut app, all) = window();
    let text = "density: 250, effects: (stretch: (compliance: 2e-4), ground: (friction: 0.1))";
    let parameters = BodyParameters::parse("test", text).expect("sound");
    bodies::apply(app.world_mut(), &Scope::body(all[0]), &parameters);
    assert_eq!(errors(&mut app), Vec::<String>::new());
    let found = bodies::parameters(app.world(), all[0]);
    assert_eq!(found, Some(Ok(parameters)));
    // The volume constraints are gone; the other body is as it was.
    let other = app.world().get::<Stretch>(all[1]).expect("carried");
    assert_eq!(other.compliance.get(), 0.0);
}

#[test]
fn parameters_that_a_body_cannot_have_are_refused_with_the_reason() {
    let (mut app, all) = window();
    let text = "effects: (stretch: (), pressure: ())";
    let parameters = BodyParameters::parse("test", text).expect("sound");
    bodies::apply(app.world_mut(), &Scope::body(all[1]), &parameters);
    let errors = errors(&mut app);
    assert!(
        errors.iter().any(|error| error.contains("pressure")),
        "{errors:?}"
    );
}

#[test]
fn a_mask_of_a_group_that_the_body_has_not_is_not_pasted() {
    let (mut app, all) = window();
    let text = "effects: (stretch: (), wind: (z: 8), force_mask: (group: \"sail\"))";
    let parameters = BodyParameters::parse("test", text).expect("sound");
    bodies::apply(app.world_mut(), &Scope::body(all[1]), &parameters);
    assert_eq!(errors(&mut app), Vec::<String>::new());
    let cloth = app.world().entity(all[1]);
    assert!(cloth.contains::<Wind>() && !cloth.contains::<ForceMask>());
    let notices = app.world().resource::<Notices>();
    let said: Vec<_> = notices.iter().map(|notice| notice.text.clone()).collect();
    assert_eq!(said, ["“cloth” has no group “sail”: it gets no force mask"]);
}

#[test]
fn a_preset_is_applied_to_bodies_of_its_dimension_alone() {
    let (mut app, all) = window();
    presets::save(app.world_mut(), &Scope::body(all[0]), " Soft cube ");
    let names: Vec<String> = app
        .world()
        .resource::<Presets>()
        .iter()
        .map(|preset| preset.name.clone())
        .collect();
    assert_eq!(names, ["Soft cube"]);
    let density = |app: &App, n: usize| {
        app.world()
            .get::<BodyDensity>(all[n])
            .expect("a body")
            .get()
    };
    let before = density(&app, 1);
    let softer = BodyParameters::parse("test", "density: 5, effects: ()").expect("sound");
    bodies::apply(app.world_mut(), &Scope::All, &softer);
    assert_eq!(errors(&mut app), Vec::<String>::new());
    presets::apply(app.world_mut(), &Scope::All, "Soft cube");
    assert_eq!(errors(&mut app), Vec::<String>::new());
    assert_eq!(density(&app, 0), 1000.0);
    assert_eq!(
        density(&app, 1),
        5.0,
        "the preset is for solids; it was {before}"
    );
    presets::delete(app.world_mut(), "Soft cube");
    assert!(app.world().resource::<Presets>().is_empty());
    for refused in ["", "Rubber"] {
        presets::save(app.world_mut(), &Scope::All, refused);
        assert!(app.world().resource::<Presets>().is_empty(), "{refused}");
    }
}
