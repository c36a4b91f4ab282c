//! The section of the reference overlay: its settings, and its distance to the bodies over the last
//! seconds.

use crate::sandbox::state::request::Request;
use bevy::prelude::World;
use bevy_egui::egui::{
    Align2, Color32, FontSelection, Label, RichText, Sense, Shape, Stroke, TextStyle, Ui, pos2,
    vec2,
};

use super::{
    Panel,
    model::ReferenceModel,
    section::{self, RowButton, section},
};
use crate::{
    sandbox::{
        lab::reference_overlay::{
            ReferenceOverlay,
            distance::{Distance, TICKS, Trail},
        },
        ui::{number::format, theme},
    },
    simulation::SimulationSettings,
};

/// Height of the plot [logical px].
const HEIGHT: f32 = 64.0;
/// Colors of RMS and maximum; from the color-blind safe palette of Okabe and Ito.
const RMS: Color32 = Color32::from_rgb(86, 180, 233);
const LARGEST: Color32 = Color32::from_rgb(230, 159, 0);

/// The model of the section, if the reference overlay is on.
pub(super) fn model(world: &World) -> Option<ReferenceModel> {
    let reference_overlay = world.get_resource::<ReferenceOverlay>()?;
    let settings = world.resource::<SimulationSettings>();
    let compared = reference_overlay.compared();
    Some(ReferenceModel {
        trail: reference_overlay.trail().clone(),
        bodies: reference_overlay.bodies(),
        lost: compared.map_or(0, |it| it.lost),
        substeps: compared.map(|it| it.substeps),
        of: settings.substeps.get(),
        tick: settings.tick_seconds(),
        outset: reference_overlay.outset(),
        holds: reference_overlay.holds(),
        trouble: reference_overlay.trouble().map(str::to_owned),
    })
}

/// Draws the section while the reference overlay is on.
pub(super) fn show(ui: &mut Ui, panel: &mut Panel, reference_overlay: Option<&ReferenceModel>) {
    let Some(reference_overlay) = reference_overlay else {
        return;
    };
    section(ui, panel, "Reference", |ui, panel| {
        let warn = |ui: &mut Ui, text: &str, color| {
            ui.add(Label::new(RichText::new(text).small().color(color)).wrap());
        };
        match (&reference_overlay.trouble, reference_overlay.trail.now()) {
            (Some(trouble), _) => warn(ui, trouble, theme::of(ui).alarm),
            (None, None) => section::note(ui, "Computing the reference…"),
            (None, Some(now)) => {
                figures(ui, now);
                plot(ui, panel, &reference_overlay.trail);
                section::note(ui, &words(reference_overlay));
                if reference_overlay.holds {
                    let text = "Slowed down: waiting for the reference simulation.";
                    warn(ui, text, theme::of(ui).changed);
                }
                if reference_overlay.lost > 0 {
                    let text = match reference_overlay.lost {
                        1 => "1 reference body diverged and was removed.".to_owned(),
                        lost => format!("{lost} reference bodies diverged and were removed."),
                    };
                    warn(ui, &text, theme::of(ui).alarm);
                }
            }
        }
        let again = RowButton::new(
            "reference_overlay.again",
            "Restart from here",
            "Restart the reference from the current state, and measure again how many substeps run \
             in real time",
        );
        if section::button_row(ui, panel, &[again]).is_some() {
            panel.ask(Request::ReferenceAgain);
        }
    });
}

/// A distance in millimeters and in per cent.
fn measure(meters: f64, fraction: f64) -> String {
    let (millimeters, percent) = (format(meters * 1e3, 3), format(fraction * 100.0, 2));
    format!("{millimeters} mm  ·  {percent} %")
}

fn figures(ui: &mut Ui, now: &Distance) {
    for (color, name, value) in [
        (RMS, "RMS", measure(now.rms, now.rms_fraction)),
        (LARGEST, "Max.", measure(now.largest, now.largest_fraction)),
    ] {
        ui.horizontal(|ui| {
            let (rect, _) = ui.allocate_exact_size(vec2(64.0, theme::ROW), Sense::hover());
            let line = [rect.left_center(), rect.left_center() + vec2(10.0, 0.0)];
            let painter = ui.painter();
            painter.line_segment(line, Stroke::new(2.0, color));
            let font = FontSelection::Default.resolve(ui.style());
            let at = line[1] + vec2(6.0, 0.0);
            painter.text(at, Align2::LEFT_CENTER, name, font, theme::of(ui).weak);
            ui.label(RichText::new(value).monospace().color(theme::of(ui).strong));
        });
    }
}

/// Description of the reference.
fn words(reference_overlay: &ReferenceModel) -> String {
    let substeps = reference_overlay.substeps.unwrap_or(reference_overlay.of);
    let h = format(reference_overlay.tick / f64::from(substeps) * 1e6, 3);
    let times = format(f64::from(substeps) / f64::from(reference_overlay.of), 2);
    let mut text = format!(
        "f64 reference: {substeps} substeps of {h} µs per tick, {times}× the body's. Percentages are \
         relative to the size of the body."
    );
    let (followed, candidates) = reference_overlay.bodies;
    if followed < candidates {
        let which = match followed {
            1 => format!("the nearest of {candidates} bodies has a reference"),
            _ => format!("the nearest {followed} of {candidates} bodies have a reference"),
        };
        text.push_str(&format!(
            " Only {which}; more would not run in real time. Grab another body to give it the reference."
        ));
    }
    if reference_overlay.outset > 0.0 {
        text.push_str(&format!(
            " Started {} mm apart (RMS): the reference first relaxes what the coarse steps left \
             unsolved.",
            format(reference_overlay.outset * 1e3, 2)
        ));
    }
    text
}

/// Draws both distances over the last ticks, and shows the values at the pointer.
fn plot(ui: &mut Ui, panel: &mut Panel, trail: &Trail) {
    let size = vec2(ui.available_width(), HEIGHT);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    panel.note("reference_overlay.plot", &response, ui);
    let painter = ui.painter().with_clip_rect(rect);
    painter.rect_filled(rect, 3.0, theme::of(ui).sunken);
    let most = trail.most().max(f64::MIN_POSITIVE);
    let step = rect.width() / (TICKS - 1) as f32;
    let left = rect.right() - step * (trail.iter().len().max(1) - 1) as f32;
    let curves: [(Color32, fn(&Distance) -> f64); 2] =
        [(LARGEST, |tick| tick.largest), (RMS, |tick| tick.rms)];
    for (color, of) in curves {
        let points = trail.iter().enumerate().map(|(place, tick)| {
            let height = (of(tick) / most) as f32 * (HEIGHT - 16.0);
            pos2(left + step * place as f32, rect.bottom() - 1.0 - height)
        });
        painter.add(Shape::line(points.collect(), Stroke::new(1.5, color)));
    }
    let font = FontSelection::Style(TextStyle::Small).resolve(ui.style());
    let text = format!("peak {} mm", format(most * 1e3, 2));
    let at = rect.left_top() + vec2(4.0, 1.0);
    painter.text(at, Align2::LEFT_TOP, text, font, theme::of(ui).weak);
    let pointed = response.hover_pos().and_then(|at| {
        let place = ((at.x - left) / step).round();
        (place >= 0.0).then(|| trail.iter().nth(place as usize))?
    });
    response.on_hover_ui(|ui| {
        ui.label(RichText::new("Distance of particles to the reference").strong());
        ui.label(pointed.map_or_else(
            || "Compared at the same tick, over the last 300 ticks".to_owned(),
            |tick| {
                format!(
                    "RMS: {}\nMax.: {}",
                    measure(tick.rms, tick.rms_fraction),
                    measure(tick.largest, tick.largest_fraction)
                )
            },
        ));
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_reference_overlay_is_is_said_with_its_units() {
        let reference_overlay = ReferenceModel {
            bodies: (6, 36),
            substeps: Some(80),
            of: 10,
            tick: 1.0 / 60.0,
            outset: 8.3e-4,
            ..ReferenceModel::default()
        };
        assert_eq!(
            words(&reference_overlay),
            "f64 reference: 80 substeps of 208 µs per tick, 8× the body's. Percentages are relative \
             to the size of the body. Only the nearest 6 of 36 bodies have a reference; more would \
             not run in real time. Grab another body to give it the reference. Started 0.83 mm apart \
             (RMS): the reference first relaxes what the coarse steps left unsolved."
        );
        assert_eq!(measure(1.234e-3, 2.5e-3), "1.23 mm  ·  0.25 %");
    }
}
