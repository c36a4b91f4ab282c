//! The plots: what they take in from a simulation, and their cards, without a window.

use crate::{sandbox_panel::beside_the_panel, support_app::cubes};
use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_egui::egui::{
    self, Context, Event, Modifiers, PointerButton, Pos2, RawInput, Shape, vec2,
};
use pliant::{
    SoftBodyPlugins,
    sandbox::{
        lab::plots::{
            Card, PlotCommand, Plots, PlotsPlugin, Shown,
            curve::ForceCurve,
            figures::{FIGURES, find},
            show,
        },
        state::display::Theme,
        ui::{WidgetRects, theme},
    },
    simulation::{Action, Actions, Measuring, plain, state_hash},
    solver::{ParticleIndex, Particles, SurfacePoint},
};
use std::time::Duration;

/// An app with several ticks per update, and its bodies.
fn app() -> (App, Vec<Entity>) {
    let mut app = App::new();
    let ticks = Duration::from_millis(51);
    app.add_plugins((
        MinimalPlugins,
        SoftBodyPlugins::new(PostUpdate),
        PlotsPlugin,
    ))
    .insert_resource(Measuring(true))
    .insert_resource(TimeUpdateStrategy::ManualDuration(ticks));
    app.finish();
    app.cleanup();
    let (bodies, _) = plain::spawn(app.world_mut(), &cubes());
    app.update();
    (app, bodies)
}

fn plots(app: &App) -> &Plots {
    app.world().resource::<Plots>()
}

#[test]
fn every_tick_is_taken_in_also_if_a_frame_has_several() {
    let (mut app, _) = app();
    (0..10).for_each(|_| app.update());
    let multiples = plots(&app).multiples("cubes").expect("figures");
    let times = &multiples.axis.values;
    assert!(times.len() >= 30, "{}", times.len());
    for pair in times.windows(2) {
        assert!((pair[1] - pair[0] - 1.0 / 60.0).abs() < 1e-9, "{pair:?}");
    }
    assert_eq!(multiples.curves.len(), 3);
}

#[test]
fn figures_are_chosen_and_plots_can_be_frozen() {
    let (mut app, _) = app();
    (0..4).for_each(|_| app.update());
    app.world_mut()
        .write_message(PlotCommand::Figure("held_energy_j"));
    app.world_mut()
        .write_message(PlotCommand::Figure("kinetic_j"));
    app.world_mut().write_message(PlotCommand::Freeze(true));
    app.update();
    let names = |app: &App| -> Vec<String> {
        let multiples = plots(app).multiples("cubes").expect("figures");
        multiples.curves.into_iter().map(|it| it.name).collect()
    };
    assert_eq!(
        names(&app),
        ["kinetic_j", "volume_error_percent", "residual"]
    );
    let count = |app: &App| plots(app).multiples("").map(|it| it.axis.values.len());
    let before = count(&app);
    (0..4).for_each(|_| app.update());
    assert_eq!(count(&app), before);
    app.world_mut().write_message(PlotCommand::Freeze(false));
    (0..4).for_each(|_| app.update());
    assert!(count(&app) > before);
}

#[test]
fn the_force_of_a_drag_is_recorded_over_the_displacement_and_kept_after_the_release() {
    let (mut app, bodies) = app();
    let body = bodies[0];
    assert!(plots(&app).force_curve("").is_none());
    let point = SurfacePoint::new(&[(ParticleIndex(0), 1.0)]).expect("sound");
    let start = app
        .world()
        .get::<Particles>(body)
        .expect("a body")
        .positions[0]
        .truncate();
    let mut actions = app.world_mut().resource_mut::<Actions>();
    actions.push(Action::Grab {
        body,
        point,
        target: start,
    });
    actions.push(Action::MoveGrab {
        body,
        target: start + Vec3::Y * 0.5,
    });
    (0..20).for_each(|_| app.update());
    let now = app
        .world()
        .get::<Particles>(body)
        .expect("a body")
        .positions[0]
        .truncate();
    let curve = plots(&app).force_curve("cubes").expect("a curve");
    let (moved, force) = (&curve.axis.values, &curve.curves[0].values);
    assert_eq!(moved.len(), force.len());
    assert!(force.iter().any(|force| *force > 1.0), "{force:?}");
    let last = moved.last().expect("points");
    // It starts at the state before the grab, and positions are in single precision.
    let expected = 1e3 * f64::from(now.distance(start));
    assert!((last - expected).abs() < 0.1, "{last} mm, not {expected}");
    app.world_mut()
        .resource_mut::<Actions>()
        .push(Action::Release { body });
    let count = |app: &App| plots(app).force_curve("").map(|it| it.axis.values.len());
    app.update();
    let kept = count(&app);
    (0..4).for_each(|_| app.update());
    assert_eq!(count(&app), kept);
}

#[test]
fn plots_change_no_bit_of_the_simulation() {
    let (mut with, _) = app();
    (0..20).for_each(|_| with.update());
    let mut without = App::new();
    let ticks = Duration::from_millis(51);
    without
        .add_plugins((MinimalPlugins, SoftBodyPlugins::new(PostUpdate)))
        .insert_resource(TimeUpdateStrategy::ManualDuration(ticks));
    without.finish();
    without.cleanup();
    plain::spawn(without.world_mut(), &cubes());
    (0..21).for_each(|_| without.update());
    assert_eq!(
        state_hash(with.world_mut()),
        state_hash(without.world_mut())
    );
}

/// Draws the cards for some frames, and presses a widget.
fn draw(
    card: &Card,
    size: egui::Vec2,
    theme: Theme,
    press: &str,
) -> (Vec<PlotCommand>, bool, WidgetRects, Vec<String>) {
    let context = Context::default();
    theme::apply(&context, theme);
    let mut places = WidgetRects::default();
    let (mut commands, mut export, mut words) = (Vec::new(), false, Vec::new());
    for frame in 0..6 {
        let at = places.get(press).map(|rect| rect.center());
        let button = |pos: Pos2, pressed| Event::PointerButton {
            pos,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        };
        let events = match (frame, at) {
            (3, Some(at)) => vec![Event::PointerMoved(at), button(at, true)],
            (4, Some(at)) => vec![button(at, false)],
            _ => Vec::new(),
        };
        let input = RawInput {
            screen_rect: Some(egui::Rect::from_min_size(Pos2::ZERO, size)),
            time: Some(f64::from(frame) / 60.0),
            events,
            ..RawInput::default()
        };
        let output = context.run_ui(input, |ui| {
            let answer = show(ui.ctx(), card, beside_the_panel(ui.ctx()));
            commands.extend(answer.commands);
            export |= answer.export;
            places = answer.places;
        });
        let texts = output
            .shapes
            .iter()
            .filter_map(|clipped| match &clipped.shape {
                Shape::Text(text) => Some(text.galley.text().to_owned()),
                _ => None,
            });
        words = texts.collect();
    }
    (commands, export, places, words)
}

fn card() -> Card {
    let mut curve = ForceCurve::new("cube".to_owned(), Vec3::ZERO);
    for tick in 0..50 {
        let displacement = 1e-3 * tick as f32;
        curve.push(Vec3::X * displacement, 250.0 * displacement);
    }
    let figure = |name| Shown {
        figure: find(name).expect("a figure"),
        points: (0..100)
            .map(|i| [f64::from(i) * 0.1, f64::from(i)])
            .collect(),
    };
    Card {
        over_time: Some(vec![figure("held_energy_j"), figure("residual")]),
        end: 9.9,
        frozen: false,
        curve: Some(curve),
        curve_shown: true,
    }
}

#[test]
fn both_cards_fit_beside_the_panel_and_say_stiffness_and_last_values() {
    for size in [vec2(1280.0, 800.0), vec2(900.0, 600.0)] {
        for theme in [Theme::Dark, Theme::Light] {
            let (_, _, places, words) = draw(&card(), size, theme, "");
            let words = words.join("\n");
            assert!(words.contains("Stiffness 250 N/m"), "{words}");
            assert!(
                words.contains("99 J") && words.contains("Residual"),
                "{words}"
            );
            let whole = places.get("plots").expect("it is drawn");
            let free = egui::Rect::from_min_max(Pos2::ZERO, egui::pos2(size.x - 344.0, size.y));
            assert!(free.contains_rect(whole), "{whole:?} in {free:?}");
        }
    }
}

#[test]
fn every_button_of_the_cards_makes_its_command() {
    let size = vec2(1280.0, 800.0);
    let press = |name| {
        let (commands, export, ..) = draw(&card(), size, Theme::Dark, name);
        (commands, export)
    };
    assert_eq!(press("plots.close"), (vec![PlotCommand::Toggle], false));
    assert_eq!(
        press("plots.freeze"),
        (vec![PlotCommand::Freeze(true)], false)
    );
    assert_eq!(
        press("plots.curve.close"),
        (vec![PlotCommand::Curve(false)], false)
    );
    assert_eq!(press("plots.export"), (vec![], true));
    assert!(FIGURES.len() > 8);
}
