//! The section of the ghost: what it is, how far from the bodies, and over the last seconds.

use bevy::prelude::World;
use bevy_egui::egui::{
    Align2, Color32, FontSelection, Label, RichText, Sense, Shape, Stroke, TextStyle, Ui, pos2,
    vec2,
};

use super::{
    Panel,
    model::{GhostModel, Request},
    number::format,
    section::{self, RowButton, section},
};
use crate::{
    sandbox::{
        ghost::{
            Ghost,
            distance::{Distance, TICKS, Trail},
        },
        theme,
    },
    simulation::SimulationSettings,
};

/// Height of the plot [logical px].
const HEIGHT: f32 = 64.0;
/// Root mean square, and largest; of Okabe and Ito's, which the colour-blind can tell.
const RMS: Color32 = Color32::from_rgb(86, 180, 233);
const LARGEST: Color32 = Color32::from_rgb(230, 159, 0);

/// What is known of the ghost, if there is one.
pub(super) fn model(world: &World) -> Option<GhostModel> {
    let ghost = world.get_resource::<Ghost>()?;
    let settings = world.resource::<SimulationSettings>();
    let compared = ghost.compared();
    Some(GhostModel {
        trail: ghost.trail().clone(),
        bodies: ghost.bodies(),
        lost: compared.map_or(0, |it| it.lost),
        substeps: compared.map(|it| it.substeps),
        of: settings.substeps.get(),
        tick: settings.tick_seconds(),
        outset: ghost.outset(),
        holds: ghost.holds(),
        trouble: ghost.trouble().map(str::to_owned),
    })
}

/// Draws the section while there is a ghost.
pub(super) fn show(ui: &mut Ui, panel: &mut Panel, ghost: Option<&GhostModel>) {
    let Some(ghost) = ghost else {
        return;
    };
    section(ui, panel, "Ghost", |ui, panel| {
        let warn = |ui: &mut Ui, text: &str, colour| {
            ui.add(Label::new(RichText::new(text).small().color(colour)).wrap());
        };
        match (&ghost.trouble, ghost.trail.now()) {
            (Some(trouble), _) => warn(ui, trouble, theme::ALARM),
            (None, None) => section::note(ui, "The ghost is on its way."),
            (None, Some(now)) => {
                figures(ui, now);
                plot(ui, panel, &ghost.trail);
                section::note(ui, &words(ghost));
                if ghost.holds {
                    let text =
                        "It does not keep pace: the bodies wait for it, and time goes slower.";
                    warn(ui, text, theme::CHANGED);
                }
                if ghost.lost > 0 {
                    let text = "A ghost was given up: even its substeps did not hold the body \
                                together.";
                    warn(ui, text, theme::ALARM);
                }
            }
        }
        let again = RowButton::new(
            "ghost.again",
            "Start again from here",
            "Puts the ghost back onto the body, and measures anew how many substeps it can have",
        );
        if section::button_row(ui, panel, &[again]).is_some() {
            panel.ask(Request::GhostAgain);
        }
    });
}

/// A distance in millimetres and in per cent.
fn measure(metres: f64, share: f64) -> String {
    let (millimetres, percent) = (format(metres * 1e3, 3), format(share * 100.0, 2));
    format!("{millimetres} mm  ·  {percent} %")
}

fn figures(ui: &mut Ui, now: &Distance) {
    for (colour, name, value) in [
        (RMS, "RMS", measure(now.rms, now.rms_share)),
        (LARGEST, "Largest", measure(now.largest, now.largest_share)),
    ] {
        ui.horizontal(|ui| {
            let (rect, _) = ui.allocate_exact_size(vec2(64.0, theme::ROW), Sense::hover());
            let line = [rect.left_center(), rect.left_center() + vec2(10.0, 0.0)];
            let painter = ui.painter();
            painter.line_segment(line, Stroke::new(2.0, colour));
            let font = FontSelection::Default.resolve(ui.style());
            let at = line[1] + vec2(6.0, 0.0);
            painter.text(at, Align2::LEFT_CENTER, name, font, theme::WEAK);
            ui.label(RichText::new(value).monospace().color(theme::STRONG));
        });
    }
}

/// What the ghost is, in sentences.
fn words(ghost: &GhostModel) -> String {
    let substeps = ghost.substeps.unwrap_or(ghost.of);
    let h = format(ghost.tick / f64::from(substeps) * 1e6, 3);
    let times = format(f64::from(substeps) / f64::from(ghost.of), 2);
    let mut text = format!(
        "The twin in f64: {substeps} substeps of {h} µs a tick, {times} times the body's. Per cent \
         are of the body's size."
    );
    let (there, asked) = ghost.bodies;
    if there < asked {
        let who = match there {
            1 => format!("the nearest of {asked} bodies has one"),
            _ => format!("the nearest {there} of {asked} bodies have one"),
        };
        text.push_str(&format!(
            " Only {who}; more would not keep pace. Take hold of another to give it the ghost."
        ));
    }
    if ghost.outset > 0.0 {
        text.push_str(&format!(
            " It began {} mm off (RMS), where nothing rigid is violated; what else coarser steps \
             left strained springs back first.",
            format(ghost.outset * 1e3, 2)
        ));
    }
    text
}

/// Draws both distances over the last ticks, and says what they are at the pointer.
fn plot(ui: &mut Ui, panel: &mut Panel, trail: &Trail) {
    let size = vec2(ui.available_width(), HEIGHT);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    panel.note("ghost.plot", &response, ui);
    let painter = ui.painter().with_clip_rect(rect);
    painter.rect_filled(rect, 3.0, theme::SUNKEN);
    let most = trail.most().max(f64::MIN_POSITIVE);
    let step = rect.width() / (TICKS - 1) as f32;
    let left = rect.right() - step * (trail.iter().len().max(1) - 1) as f32;
    let curves: [(Color32, fn(&Distance) -> f64); 2] =
        [(LARGEST, |tick| tick.largest), (RMS, |tick| tick.rms)];
    for (colour, of) in curves {
        let points = trail.iter().enumerate().map(|(place, tick)| {
            let height = (of(tick) / most) as f32 * (HEIGHT - 16.0);
            pos2(left + step * place as f32, rect.bottom() - 1.0 - height)
        });
        painter.add(Shape::line(points.collect(), Stroke::new(1.5, colour)));
    }
    let font = FontSelection::Style(TextStyle::Small).resolve(ui.style());
    let text = format!("{} mm at most", format(most * 1e3, 2));
    let at = rect.left_top() + vec2(4.0, 1.0);
    painter.text(at, Align2::LEFT_TOP, text, font, theme::WEAK);
    let pointed = response.hover_pos().and_then(|at| {
        let place = ((at.x - left) / step).round();
        (place >= 0.0).then(|| trail.iter().nth(place as usize))?
    });
    response.on_hover_ui(|ui| {
        ui.label(RichText::new("How far the particles are from their ghosts").strong());
        ui.label(pointed.map_or_else(
            || "Always at the same tick; the last 300 of them".to_owned(),
            |tick| {
                format!(
                    "RMS: {}\nlargest: {}",
                    measure(tick.rms, tick.rms_share),
                    measure(tick.largest, tick.largest_share)
                )
            },
        ));
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_ghost_is_is_said_with_its_units() {
        let ghost = GhostModel {
            bodies: (6, 36),
            substeps: Some(80),
            of: 10,
            tick: 1.0 / 60.0,
            outset: 8.3e-4,
            ..GhostModel::default()
        };
        assert_eq!(
            words(&ghost),
            "The twin in f64: 80 substeps of 208 µs a tick, 8 times the body's. Per cent are of \
             the body's size. Only the nearest 6 of 36 bodies have one; more would not keep pace. \
             Take hold of another to give it the ghost. It began 0.83 mm off (RMS), where nothing \
             rigid is violated; what else coarser steps left strained springs back first."
        );
        assert_eq!(measure(1.234e-3, 2.5e-3), "1.23 mm  ·  0.25 %");
    }
}
