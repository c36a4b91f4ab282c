//! The card of accuracy versus cost, drawn and clicked without a window; and its background thread.

use crate::sandbox_panel::beside_the_panel;
use crate::support::{self, cube, elastic_on_ground, settings, with, world};
use bevy_egui::egui::{
    Context, Event, Modifiers, PointerButton, Pos2, RawInput, Rect, Shape, Vec2,
};
use pliant::{
    sandbox::{
        lab::{
            accuracy::{AccuracyCommand, Card, Dot, Goals, News, Task, measure, show},
            worker::Worker,
        },
        state::display::Theme,
        ui::{WidgetRects, theme},
    },
    study::Goal,
};
use std::{thread, time::Duration};

fn dot(setting: (u32, u32), milliseconds: f64, error: f64) -> Dot {
    Dot {
        setting,
        milliseconds: (milliseconds * 0.9, milliseconds, milliseconds * 1.2),
        error,
    }
}

/// One cheap point, one accurate point, one that diverged.
fn card() -> Card {
    Card {
        dots: vec![
            dot((1, 1), 0.01, 0.5),
            dot((10, 2), 1.0, 0.005),
            dot((2, 1), 0.1, f64::NAN),
        ],
        here: (10, 2),
        uncertainty: 1e-4,
        goals: Goals::default(),
        half_lives: Some((6.5e-4, Some(5.8))),
        ..Card::default()
    }
}

/// Draws the card repeatedly and clicks it.
struct Pointer {
    context: Context,
    card: Card,
    size: Vec2,
    frames: u32,
    places: WidgetRects,
    commands: Vec<AccuracyCommand>,
    pressed: Option<(u32, u32)>,
    words: Vec<String>,
}

impl Pointer {
    fn new(card: Card, size: Vec2) -> Self {
        let context = Context::default();
        theme::apply(&context, Theme::Dark);
        let mut pointer = Self {
            context,
            card,
            size,
            frames: 0,
            places: WidgetRects::default(),
            commands: Vec::new(),
            pressed: None,
            words: Vec::new(),
        };
        (0..3).for_each(|_| pointer.draw(Vec::new()));
        pointer
    }

    fn draw(&mut self, events: Vec<Event>) {
        let input = RawInput {
            screen_rect: Some(Rect::from_min_size(Pos2::ZERO, self.size)),
            time: Some(f64::from(self.frames) / 60.0),
            events,
            ..RawInput::default()
        };
        self.frames += 1;
        let mut drawn = None;
        let output = self.context.run_ui(input, |ui| {
            drawn = Some(show(ui.ctx(), &self.card, beside_the_panel(ui.ctx())));
        });
        let answer = drawn.expect("run_ui draws at least once");
        self.places = answer.places;
        self.commands.extend(answer.commands);
        self.pressed = self.pressed.or(answer.pressed);
        self.words.clear();
        for clipped in &output.shapes {
            collect(&clipped.shape, &mut self.words);
        }
        output.drop_without_applying_deltas();
    }

    fn press(&mut self, at: Pos2) {
        let button = |pressed| Event::PointerButton {
            pos: at,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        };
        self.commands.clear();
        self.pressed = None;
        self.draw(vec![Event::PointerMoved(at)]);
        self.draw(vec![button(true)]);
        self.draw(vec![button(false)]);
        self.draw(Vec::new());
    }

    fn place(&self, name: &str) -> Rect {
        let place = self.places.get(name);
        place.unwrap_or_else(|| panic!("no widget {name}"))
    }

    fn says(&self, words: &str) -> bool {
        self.words.iter().any(|text| text.contains(words))
    }
}

/// All texts of a shape.
fn collect(shape: &Shape, words: &mut Vec<String>) {
    match shape {
        Shape::Vec(shapes) => shapes.iter().for_each(|shape| collect(shape, words)),
        Shape::Text(text) => words.push(text.galley.text().to_owned()),
        _ => {}
    }
}

#[test]
fn the_card_fits_every_window_and_shows_the_current_setting() {
    for size in [(1280.0, 800.0), (900.0, 600.0), (700.0, 500.0)] {
        let pointer = Pointer::new(card(), Vec2::from(size));
        let all = Rect::from_min_size(Pos2::ZERO, pointer.size);
        assert!(all.contains_rect(pointer.place("accuracy")), "{size:?}");
        for name in ["accuracy.chart", "accuracy.measure", "accuracy.reach_error"] {
            let place = pointer.place(name);
            assert!(
                pointer.place("accuracy").contains_rect(place),
                "{name}, {size:?}"
            );
        }
        assert!(
            pointer.says(
                "10 substeps of 2 iterations: 1 ms per tick (0.9–1.2), error 0.5 % of the body size"
            ),
            "{:?}",
            pointer.words
        );
        assert!(
            pointer.says("0.65 ms, the softest in 5.8 s"),
            "{:?}",
            pointer.words
        );
    }
}

#[test]
fn only_a_pressed_point_is_requested() {
    let mut pointer = Pointer::new(card(), Vec2::new(1280.0, 800.0));
    let chart = pointer.place("accuracy.chart");
    // Points may be anywhere in the chart: click all of it, a few pixels apart.
    let mut found = Vec::new();
    for across in 0..50 {
        for down in 0..24 {
            let fraction = Vec2::new(across as f32 / 49.0, down as f32 / 23.0);
            pointer.press(chart.min + chart.size() * fraction);
            found.extend(pointer.pressed);
            assert_eq!(pointer.commands, []);
        }
    }
    found.sort_unstable();
    found.dedup();
    assert_eq!(found, [(1, 1), (2, 1), (10, 2)]);
    pointer.press(chart.left_bottom() + Vec2::new(2.0, -2.0));
    assert_eq!(pointer.pressed, None, "there is no dot on the axis");
}

#[test]
fn each_button_sends_its_command() {
    let mut pointer = Pointer::new(card(), Vec2::new(1280.0, 800.0));
    for (name, command) in [
        ("accuracy.measure", AccuracyCommand::Measure),
        ("accuracy.close", AccuracyCommand::Toggle),
        (
            "accuracy.reach_ms",
            AccuracyCommand::Reach(Goal::Milliseconds(1.0)),
        ),
        (
            "accuracy.reach_error",
            AccuracyCommand::Reach(Goal::Error(0.01)),
        ),
    ] {
        pointer.press(pointer.place(name).center());
        assert_eq!(pointer.commands, [command], "{name}");
    }
    pointer.card.progress = Some(0.5);
    (0..2).for_each(|_| pointer.draw(Vec::new()));
    pointer.press(pointer.place("accuracy.measure").center());
    assert_eq!(pointer.commands, [AccuracyCommand::Stop]);
    pointer.press(pointer.place("accuracy.reach_ms").center());
    assert_eq!(pointer.commands, [], "not while something is measured");
}

#[test]
fn an_empty_card_says_that_nothing_has_been_measured() {
    let pointer = Pointer::new(Card::default(), Vec2::new(1280.0, 800.0));
    assert!(pointer.says("Not measured yet."), "{:?}", pointer.words);
}

/// A scene with little work.
fn small() -> pliant::solver::World {
    let body = with(
        support::body("cube", cube(0.4, 1), 1000.0),
        elastic_on_ground(),
    );
    world(settings(9.81, 60.0, 2, 1), body)
}

fn until_ended(worker: &Worker<News>) -> Vec<News> {
    let mut all = Vec::new();
    // A minute is a hundred times the usual duration.
    for _ in 0..6000 {
        all.extend(worker.news());
        if all.last() == Some(&News::Ended) {
            return all;
        }
        thread::sleep(Duration::from_millis(10));
    }
    panic!("it has not ended: {:?}", all.last());
}

#[test]
fn a_survey_reports_modes_and_many_settings_and_a_search_chooses_one() {
    let worker = measure(small(), Task::Survey).expect("a thread");
    let news = until_ended(&worker);
    assert!(news.iter().any(|news| matches!(news, News::Modes(_))));
    let points = news.iter().filter_map(|news| match news {
        News::Point(point) => Some((point.setting.substeps, point.setting.iterations)),
        _ => None,
    });
    let mut settings: Vec<_> = points.collect();
    assert_eq!(
        settings.first(),
        Some(&(2, 1)),
        "the scene's own goes first"
    );
    settings.sort_unstable();
    settings.dedup();
    // Substeps up to 128, 64, 32, 16, 8 with 1, 2, 4, 8, 16 iterations.
    assert_eq!(settings.len(), 8 + 7 + 6 + 5 + 4);

    let worker = measure(small(), Task::Reach(Goal::Error(0.1))).expect("a thread");
    let news = until_ended(&worker);
    let chosen = news.iter().find_map(|news| match news {
        News::Chosen(Some(choice)) => Some(choice),
        _ => None,
    });
    assert!(chosen.is_some_and(|choice| choice.met), "{chosen:?}");
}
