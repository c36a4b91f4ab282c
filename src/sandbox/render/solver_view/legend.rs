//! The legend of the solver view: what the colors of the constraints mean.

use crate::sandbox::state::view::SolverView;
use bevy_egui::egui::{
    self, Align2, Area, Color32, Frame, Id, Label, Margin, Order, Rect, RichText, Sense, TextStyle,
    vec2,
};

use super::place::{Filling, Summary};
use crate::{
    sandbox::{
        render::material::PALETTE,
        ui::{count, theme},
    },
    solver::{
        kernel::{MAX_WIDTH, WIDTH},
        topology::partitions::MIN_CUT,
    },
};

/// Maximum width of the legend [logical px].
const WIDEST: f32 = 330.0;

/// Description of a view.
#[must_use]
pub fn sentence(view: SolverView, summary: &Summary) -> String {
    let mut text = match view {
        SolverView::Off => String::new(),
        SolverView::Partitions => partitions(summary),
        SolverView::Colors => format!(
            "Colors per partition, at most: {}. Constraints of one color share no particle and \
             can be solved at the same time.",
            kinds(summary, |filling| filling.colors.to_string()),
        ),
        SolverView::Lanes => format!(
            "Blocks of {WIDTH} constraints are solved together, one SIMD lane each; in a grid, patterns of up to \
             {MAX_WIDTH}, of which every eighth has the same color. Lanes in use: {}.",
            kinds(summary, |filling| {
                let fraction = filling.fraction().unwrap_or_default();
                format!("{:.0} %", fraction * 100.0)
            }),
        ),
    };
    if summary.overflow > 0 && view != SolverView::Off {
        text.push_str(&format!(
            " {} in no partition (white), and solved one at a time.",
            several(summary.overflow, "constraint is", "constraints are"),
        ));
    }
    text
}

fn partitions(summary: &Summary) -> String {
    let partitions = several(summary.partitions, "partition", "partitions");
    let bodies = several(summary.bodies, "body", "bodies");
    let mut text = format!("{partitions} in {bodies}: the pieces that workers step concurrently.");
    if summary.partitions == summary.bodies {
        let smallest = count(MIN_CUT);
        text.push_str(&format!(
            " A body of fewer than {smallest} particles is not divided."
        ));
    }
    text
}

/// Text for the edges, the tetrahedra and the struts, if there are any.
fn kinds(summary: &Summary, say: impl Fn(Filling) -> String) -> String {
    let all = [
        ("edges", summary.edges),
        ("tetrahedra", summary.tetrahedra),
        ("struts", summary.struts),
    ];
    let there = all.iter().filter(|(_, filling)| filling.constraints > 0);
    let said: Vec<String> = there
        .map(|(kind, filling)| format!("{kind} {}", say(*filling)))
        .collect();
    said.join(", ")
}

fn several(number: usize, one: &str, more: &str) -> String {
    format!("{} {}", count(number), if number == 1 { one } else { more })
}

/// Draws the legend in the lower right corner of the area that the panel leaves free.
pub fn draw(context: &egui::Context, view: SolverView, summary: &Summary, free: Rect) {
    let width = (free.width() - 44.0).clamp(120.0, WIDEST);
    // Does not capture the pointer.
    Area::new(Id::new("solver legend"))
        .order(Order::Background)
        .interactable(false)
        .pivot(Align2::RIGHT_BOTTOM)
        .fixed_pos(free.max - vec2(10.0, 10.0))
        .constrain(false)
        .show(context, |ui| {
            ui.set_max_width(width);
            Frame::new()
                .fill(theme::of(ui).veil)
                .corner_radius(8.0)
                .inner_margin(Margin::symmetric(10, 6))
                .show(ui, |ui| {
                    if view == SolverView::Lanes {
                        lanes(ui);
                    }
                    let text = RichText::new(sentence(view, summary)).color(theme::of(ui).text);
                    ui.add(Label::new(text.small()).wrap());
                });
        });
}

/// The color of each lane under its number.
fn lanes(ui: &mut egui::Ui) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        for (lane, [red, green, blue]) in PALETTE.iter().enumerate() {
            let (rect, _) = ui.allocate_exact_size(vec2(22.0, 15.0), Sense::hover());
            let painter = ui.painter();
            painter.rect_filled(rect, 3.0, Color32::from_rgb(*red, *green, *blue));
            painter.text(
                rect.center(),
                Align2::CENTER_CENTER,
                lane.to_string(),
                TextStyle::Small.resolve(ui.style()),
                Color32::BLACK,
            );
        }
    });
}
