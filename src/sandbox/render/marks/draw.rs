//! Draws marks with egui.

use super::Mark;
use crate::sandbox::ui::{number::format, theme};
use bevy::math::Vec2;
use bevy_egui::egui::{
    self, Align2, Area, Color32, CursorIcon, FontId, Id, Order, Pos2, Sense, Shape, Stroke, Ui,
    pos2, vec2,
};

/// Height of a mark [logical px].
const HEIGHT: f32 = 22.0;
/// Width of the arrow [logical px].
const ARROW: f32 = 20.0;
/// Maximum number of characters of a name.
const LETTERS: usize = 16;
/// Maximum number of bodies that the tooltip lists.
const LISTED: usize = 12;

/// Draws the marks. Returns the keys of the bodies of a mark that was clicked.
pub fn draw(context: &egui::Context, marks: &[Mark]) -> Option<Vec<u64>> {
    let mut clicked = None;
    for (index, mark) in marks.iter().enumerate() {
        // The label is on the inner side of the tip.
        let pivot = if mark.direction.x > 0.3 {
            Align2::RIGHT_CENTER
        } else if mark.direction.x < -0.3 {
            Align2::LEFT_CENTER
        } else if mark.direction.y > 0.0 {
            Align2::CENTER_BOTTOM
        } else {
            Align2::CENTER_TOP
        };
        let response = Area::new(Id::new(("mark", index)))
            .order(Order::Middle)
            .fixed_pos(pos2(mark.tip.x, mark.tip.y))
            .pivot(pivot)
            .constrain(false)
            .fade_in(false)
            .show(context, |ui| label(ui, mark))
            .inner;
        if response.clicked() {
            clicked = Some(mark.bodies.iter().map(|body| body.key).collect());
        }
    }
    clicked
}

fn label(ui: &mut Ui, mark: &Mark) -> egui::Response {
    let colors = theme::of(ui);
    let text = words(mark);
    let font = FontId::proportional(11.5);
    let galley = ui.painter().layout_no_wrap(text, font, colors.text);
    let size = vec2(galley.size().x + ARROW + 10.0, HEIGHT);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    let stroke = if response.hovered() {
        Stroke::new(1.0, colors.accent)
    } else {
        Stroke::new(1.0, colors.line)
    };
    let painter = ui.painter();
    painter.rect(
        rect,
        HEIGHT / 2.0,
        colors.veil,
        stroke,
        egui::StrokeKind::Inside,
    );
    // The arrow is at the outer end.
    let right = mark.direction.x > 0.0;
    let (arrow, text) = if right {
        (rect.right() - ARROW / 2.0 - 1.0, rect.left() + 10.0)
    } else {
        (rect.left() + ARROW / 2.0 + 1.0, rect.left() + ARROW)
    };
    painter.galley(
        pos2(text, rect.center().y - galley.size().y / 2.0),
        galley,
        colors.text,
    );
    let center = pos2(arrow, rect.center().y);
    painter.add(triangle(center, mark.direction, colors.accent));
    response
        .on_hover_text(details(mark))
        .on_hover_cursor(CursorIcon::PointingHand)
}

/// A triangle that points in a direction.
fn triangle(center: Pos2, direction: Vec2, color: Color32) -> Shape {
    let along = vec2(direction.x, direction.y);
    let points = [
        center + 6.0 * along,
        center - 4.0 * along + 4.5 * along.rot90(),
        center - 4.0 * along - 4.5 * along.rot90(),
    ];
    Shape::convex_polygon(points.to_vec(), color, Stroke::NONE)
}

/// The name of the body, or how many there are.
fn words(mark: &Mark) -> String {
    match &mark.bodies[..] {
        [body] if body.name.chars().count() > LETTERS => {
            let start: String = body.name.chars().take(LETTERS - 1).collect();
            format!("{start}…")
        }
        [body] => body.name.clone(),
        bodies => format!("{} bodies", bodies.len()),
    }
}

/// Names and distances, and what a click does.
fn details(mark: &Mark) -> String {
    let mut lines: Vec<String> = mark
        .bodies
        .iter()
        .take(LISTED)
        .map(|body| {
            let distance = format(body.center.length().into(), 2);
            format!("{}, {distance} m from the camera", body.name)
        })
        .collect();
    if mark.bodies.len() > LISTED {
        lines.push(format!("and {} more", mark.bodies.len() - LISTED));
    }
    lines.push("Out of view. Click to frame.".to_owned());
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sandbox::render::marks::OutOfView;
    use bevy::math::Vec3;
    use bevy_egui::egui::{Event, Modifiers, PointerButton, RawInput, Rect};

    fn mark(names: &[&str]) -> Mark {
        let bodies = names.iter().zip(1..).map(|(name, key)| OutOfView {
            key,
            name: (*name).to_owned(),
            center: Vec3::new(3.0, 0.0, -4.0),
        });
        Mark {
            tip: Vec2::new(922.0, 400.0),
            direction: Vec2::X,
            bodies: bodies.collect(),
        }
    }

    #[test]
    fn a_mark_names_its_body_or_counts_its_bodies() {
        assert_eq!(words(&mark(&["ball"])), "ball");
        assert_eq!(
            words(&mark(&["a very long name of a body"])),
            "a very long nam…"
        );
        assert_eq!(words(&mark(&["ball", "cube"])), "2 bodies");
        let text = details(&mark(&["ball", "cube"]));
        assert!(text.contains("cube, 5 m from the camera"), "{text}");
    }

    #[test]
    fn a_click_on_a_mark_frames_its_bodies_and_a_click_beside_it_does_nothing() {
        let context = egui::Context::default();
        let marks = [mark(&["ball", "cube"])];
        let frame = |events: Vec<Event>| {
            let screen = Rect::from_min_size(Pos2::ZERO, vec2(1280.0, 800.0));
            let input = RawInput {
                screen_rect: Some(screen),
                events,
                ..RawInput::default()
            };
            let mut clicked = None;
            let _ = context.run_ui(input, |ui| clicked = draw(ui.ctx(), &marks));
            clicked
        };
        let click = |pos: Pos2| {
            let press = |pressed| Event::PointerButton {
                pos,
                button: PointerButton::Primary,
                pressed,
                modifiers: Modifiers::NONE,
            };
            frame(vec![Event::PointerMoved(pos)]);
            frame(vec![press(true)]).or(frame(vec![press(false)]))
        };
        frame(Vec::new());
        frame(Vec::new());
        let rect = context.memory(|memory| memory.area_rect(Id::new(("mark", 0_usize))));
        let rect = rect.expect("it is drawn");
        assert!((rect.right() - 922.0).abs() < 2.0, "{rect:?}");
        assert_eq!(click(rect.center()), Some(vec![1, 2]));
        assert_eq!(click(pos2(400.0, 400.0)), None);
    }
}
