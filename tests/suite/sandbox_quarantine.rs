//! The card that lists bodies in quarantine, drawn and clicked without a window.

use crate::sandbox_panel::beside_the_panel;
use bevy_egui::egui::{
    Context, Event, Modifiers, PointerButton, Pos2, RawInput, Rect, Shape, Vec2, pos2,
};
use pliant::{
    sandbox::{
        lab::quarantine::{QuarantinedBody, draw, reason},
        state::display::Theme,
        ui::{WidgetRects, theme},
    },
    solver::{Quarantine, VertexIndex},
};

fn body(key: u64, again: bool) -> QuarantinedBody {
    QuarantinedBody {
        key,
        name: format!("cube {key}"),
        reason: "non-finite state of vertex 3 after stretch".to_owned(),
        again,
    }
}

/// The card in a window of this size.
struct Card {
    context: Context,
    bodies: Vec<QuarantinedBody>,
    size: Vec2,
    places: WidgetRects,
    pressed: Vec<u64>,
}

impl Card {
    fn new(bodies: Vec<QuarantinedBody>, size: Vec2) -> Self {
        let context = Context::default();
        theme::apply(&context, Theme::Dark);
        let mut card = Self {
            context,
            bodies,
            size,
            places: WidgetRects::default(),
            pressed: Vec::new(),
        };
        // egui knows the position of a widget from the previous frame.
        (0..3).for_each(|_| drop(card.draw(Vec::new())));
        card
    }

    /// All texts of a drawing.
    fn draw(&mut self, events: Vec<Event>) -> String {
        let input = RawInput {
            screen_rect: Some(Rect::from_min_size(Pos2::ZERO, self.size)),
            events,
            ..RawInput::default()
        };
        let mut places = WidgetRects::default();
        let mut pressed = Vec::new();
        let output = self.context.run_ui(input, |ui| {
            pressed.extend(draw(
                ui.ctx(),
                &self.bodies,
                beside_the_panel(ui.ctx()),
                &mut places,
            ));
        });
        self.places = places;
        self.pressed.extend(pressed);
        let mut texts = String::new();
        for shape in &output.shapes {
            collect(&shape.shape, &mut texts);
        }
        output.drop_without_applying_deltas();
        texts
    }

    fn press(&mut self, name: &str) -> Vec<u64> {
        let at = self.places.get(name).expect("it is in sight").center();
        let button = |pressed| Event::PointerButton {
            pos: at,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        };
        self.draw(vec![Event::PointerMoved(at)]);
        self.draw(vec![button(true)]);
        self.draw(vec![button(false)]);
        std::mem::take(&mut self.pressed)
    }
}

fn collect(shape: &Shape, texts: &mut String) {
    match shape {
        Shape::Text(text) => texts.push_str(&format!("{}\n", text.galley.text())),
        Shape::Vec(shapes) => shapes.iter().for_each(|shape| collect(shape, texts)),
        _ => {}
    }
}

#[test]
fn the_card_shows_body_vertex_and_cause_and_its_button_restores_that_body() {
    let mut card = Card::new(vec![body(7, false)], Vec2::new(1280.0, 800.0));
    let said = card.draw(Vec::new());
    for words in ["cube 7", "vertex 3", "stretch", "Restore last finite state"] {
        assert!(said.contains(words), "{said}");
    }
    assert!(!said.contains("again"), "{said}");
    assert_eq!(card.press("restore.cube 7"), [7]);
    assert_eq!(card.places.get("restore.all"), None, "one is all");
}

#[test]
fn for_a_body_that_diverges_again_the_card_suggests_a_remedy() {
    let mut card = Card::new(vec![body(1, true)], Vec2::new(1280.0, 800.0));
    let said = card.draw(Vec::new());
    assert!(said.contains("undo the last change"), "{said}");
}

#[test]
fn of_many_bodies_each_can_be_restored_and_the_card_stays_in_the_smallest_window() {
    let bodies: Vec<_> = (1..=36).map(|key| body(key, key % 2 == 0)).collect();
    let mut card = Card::new(bodies, Vec2::new(900.0, 600.0));
    assert_eq!(card.press("restore.cube 2"), [2]);
    let all = card.press("restore.all");
    assert_eq!(all, (1..=36).collect::<Vec<_>>());
    let window = Rect::from_min_max(Pos2::ZERO, pos2(900.0 - 344.0, 600.0));
    for (name, place) in card.places.iter() {
        assert!(window.contains_rect(place), "{name} at {place:?}");
    }
}

#[test]
fn non_finite_input_is_not_attributed_to_a_stage() {
    let quarantine = |stage| Quarantine::new(VertexIndex(4), stage);
    assert_eq!(
        reason(&quarantine("input")),
        "non-finite input for vertex 4"
    );
    assert_eq!(
        reason(&quarantine("volume")),
        "non-finite state of vertex 4 after volume"
    );
}
