//! Bodies colored by a quantity: what is written to their meshes, and the legend, without a window.

use crate::{sandbox_panel::beside_the_panel, support_app::cubes};
use bevy::{mesh::VertexAttributeValues, prelude::*, time::TimeUpdateStrategy};
use bevy_egui::egui::{
    self, Context, Event, Modifiers, PointerButton, Pos2, RawInput, Shape, vec2,
};
use pliant::{
    SoftBodyPlugins,
    render::SoftBodyMeshPlugin,
    sandbox::{
        render::{
            coloring::{ColoringPlugin, legend},
            material::SkinMaterial,
        },
        state::{
            color::{ColorMode, ColorScale},
            display::Theme,
            request::Request,
            view::{SolverView, ViewSettings},
        },
        ui::{WidgetRects, theme},
    },
    simulation::{RecordContacts, plain, state_hash},
};
use std::time::Duration;

/// An app with one tick per update, that makes meshes but draws none, and its bodies.
fn app() -> (App, Vec<Entity>) {
    let mut app = App::new();
    let tick = Duration::from_nanos(1_000_000_000 / 60 + 1);
    app.add_plugins((MinimalPlugins, AssetPlugin::default()))
        .init_asset::<Mesh>()
        .init_asset::<SkinMaterial>()
        .add_plugins((
            SoftBodyPlugins::new(PostUpdate),
            SoftBodyMeshPlugin,
            ColoringPlugin,
        ))
        .insert_resource(TimeUpdateStrategy::ManualDuration(tick));
    app.finish();
    app.cleanup();
    let (bodies, _) = plain::spawn(app.world_mut(), &cubes());
    app.update();
    (app, bodies)
}

fn updates(app: &mut App, count: usize) {
    (0..count).for_each(|_| app.update());
}

fn choose(app: &mut App, color: ColorMode) {
    app.world_mut().resource_mut::<ViewSettings>().color = color;
}

/// The values in the mesh of a body: place in the color map, and in the range.
fn values(app: &App, body: Entity) -> Option<Vec<[f32; 2]>> {
    let mesh = app.world().get::<Mesh3d>(body).expect("a mesh");
    let meshes = app.world().resource::<Assets<Mesh>>();
    let mesh = meshes.get(&mesh.0).expect("it is loaded");
    match mesh.attribute(Mesh::ATTRIBUTE_UV_1)? {
        VertexAttributeValues::Float32x2(values) => {
            assert_eq!(values.len(), mesh.count_vertices());
            Some(values.clone())
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn meshes_have_values_only_while_bodies_are_colored() {
    let (mut app, bodies) = app();
    updates(&mut app, 1);
    assert_eq!(values(&app, bodies[0]), None);
    choose(&mut app, ColorMode::Speed);
    updates(&mut app, 3);
    let fast = values(&app, bodies[1]).expect("it is colored");
    let slow = values(&app, bodies[0]).expect("it is colored");
    let mean = |all: &[[f32; 2]]| all.iter().map(|it| it[1]).sum::<f32>() / all.len() as f32;
    // The one was thrown at 2.3 m/s, the other has fallen for five ticks.
    assert!(mean(&fast) > mean(&slow) + 0.2, "{fast:?} {slow:?}");
    // Constraints are drawn instead of the bodies.
    app.world_mut().resource_mut::<ViewSettings>().solver = SolverView::Colors;
    updates(&mut app, 2);
    assert_eq!(values(&app, bodies[0]), None);
    app.world_mut().resource_mut::<ViewSettings>().solver = SolverView::Off;
    updates(&mut app, 3);
    assert!(values(&app, bodies[0]).is_some());
    choose(&mut app, ColorMode::Off);
    updates(&mut app, 2);
    assert_eq!(values(&app, bodies[0]), None);
}

#[test]
fn another_quantity_or_range_is_painted_at_once_also_while_paused() {
    let (mut app, bodies) = app();
    updates(&mut app, 20);
    choose(&mut app, ColorMode::Speed);
    updates(&mut app, 3);
    app.world_mut()
        .resource_mut::<pliant::simulation::SimulationClock>()
        .paused = true;
    let speed = values(&app, bodies[0]);
    app.world_mut().resource_mut::<ColorScale>().fixed = Some((-2.0, -1.0));
    app.update();
    let beyond = values(&app, bodies[0]).expect("it is colored");
    assert!(beyond.iter().all(|it| it[1] > 1.0), "{beyond:?}");
    choose(&mut app, ColorMode::Tension);
    app.world_mut().resource_mut::<ColorScale>().fixed = None;
    app.update();
    assert_ne!(values(&app, bodies[0]), speed);
    assert!(
        values(&app, bodies[0])
            .expect("colored")
            .iter()
            .all(|it| it[1] < 50.0)
    );
}

#[test]
fn coloring_changes_no_bit_of_the_simulation() {
    let run = |color| {
        let (mut app, _) = app();
        choose(&mut app, color);
        updates(&mut app, 60);
        let record = app.world().resource::<RecordContacts>().0;
        assert_eq!(record, color == ColorMode::ContactForce);
        state_hash(app.world_mut())
    };
    let plain = run(ColorMode::Off);
    for color in ColorMode::ALL {
        assert_eq!(run(color), plain, "{color:?}");
    }
}

/// Draws the legend for some frames, with these events in the last but one.
fn legend(
    mode: ColorMode,
    scale: &ColorScale,
    theme: Theme,
    press: Option<&str>,
) -> (Option<Request>, WidgetRects, Vec<String>) {
    let context = Context::default();
    theme::apply(&context, theme);
    let quantity = mode.quantity().expect("a quantity");
    let mut places = WidgetRects::default();
    let mut request = None;
    let mut words = Vec::new();
    for frame in 0..6 {
        let at = press
            .and_then(|name| places.get(name))
            .map(|rect: egui::Rect| rect.center());
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
            screen_rect: Some(egui::Rect::from_min_size(Pos2::ZERO, vec2(1280.0, 800.0))),
            time: Some(f64::from(frame) / 60.0),
            events,
            ..RawInput::default()
        };
        let output = context.run_ui(input, |ui| {
            let free = beside_the_panel(ui.ctx());
            let (asked, now) = legend::draw(ui.ctx(), &quantity, scale, free);
            request = asked.or(request.take());
            places = now;
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
    (request, places, words)
}

#[test]
fn the_legend_names_quantity_unit_range_and_extremes_of_every_mode_in_both_themes() {
    let scale = ColorScale {
        fixed: None,
        automatic: (-0.05, 0.05),
        extremes: Some((-0.012, 0.31)),
    };
    for mode in ColorMode::ALL.into_iter().skip(1) {
        for theme in [Theme::Dark, Theme::Light] {
            let (_, places, words) = legend(mode, &scale, theme, None);
            let quantity = mode.quantity().expect("a quantity");
            let words = words.join("\n");
            assert!(
                words.contains(quantity.symbol) && words.contains(quantity.unit),
                "{words}"
            );
            for figure in [-0.05, 0.05, -0.012, 0.31] {
                let figure = pliant::sandbox::ui::format(figure * quantity.factor, 3);
                assert!(words.contains(&figure), "{figure} in {words}");
            }
            let whole = places.get("legend").expect("it is drawn");
            assert!(whole.left() >= 0.0 && whole.bottom() <= 800.0);
        }
    }
}

#[test]
fn the_button_holds_the_current_range_and_releases_it() {
    let mut scale = ColorScale {
        automatic: (-0.012_345, 0.012_345),
        ..ColorScale::default()
    };
    let press =
        |scale: &ColorScale| legend(ColorMode::Tension, scale, Theme::Dark, Some("legend.hold")).0;
    let Some(Request::ColorRange(Some(range))) = press(&scale) else {
        panic!("it holds the range");
    };
    assert_eq!(range, (-0.0123, 0.0123));
    scale.fixed = Some(range);
    assert_eq!(press(&scale), Some(Request::ColorRange(None)));
}
