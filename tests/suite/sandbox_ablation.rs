//! The card with the cost and benefit of effects, drawn and clicked without a window.

use crate::sandbox_panel::beside_the_panel;
use bevy_egui::egui::{
    Context, Event, FullOutput, Modifiers, PointerButton, Pos2, RawInput, Rect, Shape, Vec2,
};
use pliant::{
    ablation::{Ablation, Cost, Distance, Variant},
    sandbox::{
        lab::ablation::{AblationCommand, Answer, Card, show},
        state::{display::Theme, request::Request, selection::Scope},
        ui::theme,
    },
};

fn measured() -> Ablation {
    let variant = |name, title, ms, rms| Variant {
        name,
        title,
        carriers: 1,
        cost: Cost { ms, noise: 0.01 },
        distance: Some(Distance {
            rms,
            max: rms,
            unmatched: 0,
        }),
    };
    Ablation {
        seconds: 1.0,
        ticks: 60,
        substeps: 10,
        threads: 1,
        size: 1.0,
        cost: Cost {
            ms: 1.0,
            noise: 0.01,
        },
        without: vec![
            variant("stretch", "Stretch", 0.4, 0.5),
            variant("bend", "Bend", 0.69, 1e-4),
        ],
        finer: Some(variant("substeps", "Twice the substeps", 2.0, 1e-3)),
    }
}

/// Draws the card in a window of a size, with events in one frame.
fn draw(context: &Context, card: &Card, size: Vec2, events: Vec<Event>) -> (Answer, Vec<String>) {
    let input = RawInput {
        screen_rect: Some(Rect::from_min_size(Pos2::ZERO, size)),
        events,
        ..RawInput::default()
    };
    let mut drawn = None;
    let output: FullOutput = context.run_ui(input, |ui| {
        drawn = Some(show(ui.ctx(), card, beside_the_panel(ui.ctx())));
    });
    let mut words = Vec::new();
    for clipped in &output.shapes {
        collect(&clipped.shape, &mut words);
    }
    output.drop_without_applying_deltas();
    (drawn.expect("run_ui draws at least once"), words)
}

fn collect(shape: &Shape, words: &mut Vec<String>) {
    match shape {
        Shape::Vec(shapes) => shapes.iter().for_each(|shape| collect(shape, words)),
        Shape::Text(text) => words.push(text.galley.text().to_owned()),
        _ => {}
    }
}

fn fresh() -> Context {
    let context = Context::default();
    theme::apply(&context, Theme::Dark);
    context
}

#[test]
fn the_card_fits_every_window_and_says_what_to_remove() {
    let card = Card {
        measured: Some(measured()),
        ..Card::default()
    };
    for size in [(1280.0, 800.0), (900.0, 600.0), (700.0, 500.0)] {
        let (context, size) = (fresh(), Vec2::from(size));
        (0..3).for_each(|_| drop(draw(&context, &card, size, Vec::new())));
        let (answer, words) = draw(&context, &card, size, Vec::new());
        let place = answer.places.get("ablation").expect("the card");
        let window = Rect::from_min_size(Pos2::ZERO, size);
        assert!(window.contains_rect(place), "{place} in {size}");
        for text in [
            "60 ± 1 %",
            "bend: 31 % of the tick, 0.01 % of what is seen. Removing it saves time.",
        ] {
            assert!(words.iter().any(|it| it.contains(text)), "{words:?}");
        }
    }
}

#[test]
fn remove_switches_the_effect_off_for_all_bodies_and_measures_again() {
    let card = Card {
        measured: Some(measured()),
        ..Card::default()
    };
    let (context, size) = (fresh(), Vec2::new(1280.0, 800.0));
    let mut last = Answer::default();
    for _ in 0..4 {
        last = draw(&context, &card, size, Vec::new()).0;
    }
    let button = last.places.get("ablation.remove.bend").expect("a button");
    let press = |pressed| Event::PointerButton {
        pos: button.center(),
        button: PointerButton::Primary,
        pressed,
        modifiers: Modifiers::NONE,
    };
    let mut requests = Vec::new();
    let mut commands = Vec::new();
    for events in [
        vec![Event::PointerMoved(button.center())],
        vec![press(true)],
        vec![press(false)],
        vec![],
    ] {
        let (answer, _) = draw(&context, &card, size, events);
        requests.extend(answer.requests);
        commands.extend(answer.commands);
    }
    let removal = Request::Effect {
        effect: "bend",
        on: false,
    };
    assert_eq!(requests, [Request::Show(Scope::All), removal]);
    assert_eq!(commands, [AblationCommand::Measure]);
}

#[test]
fn a_failure_and_a_measurement_under_way_are_said() {
    let card = Card {
        failure: Some("the scene has an effect that is not built in".to_owned()),
        ..Card::default()
    };
    let (context, size) = (fresh(), Vec2::new(1280.0, 800.0));
    draw(&context, &card, size, Vec::new());
    let (_, words) = draw(&context, &card, size, Vec::new());
    assert!(
        words.iter().any(|it| it.contains("not built in")),
        "{words:?}"
    );
    assert!(
        words.iter().any(|it| it == "Not measured yet."),
        "{words:?}"
    );
    let card = Card {
        progress: Some(0.5),
        ..Card::default()
    };
    let (_, words) = draw(&context, &card, size, Vec::new());
    assert!(
        words.iter().any(|it| it.contains("Running copies")),
        "{words:?}"
    );
}
