//! What the program is for, always in sight: the stiffness of the selected bodies and the substeps, and
//! what they do: the effective compliance, the time of a tick, and accuracy against cost.

use super::{
    Panel, effective, effects,
    model::{EffectModel, PanelModel, Parameter},
    section::{self, RowButton},
    world,
};
use crate::sandbox::{state::request::Request, ui::theme};
use bevy_egui::egui::{Frame, Label, Margin, RichText, Stroke, Ui, vec2};

/// Parameters by which an effect is soft or stiff.
const STIFFNESS: [&str; 2] = ["compliance", "youngs_modulus"];

/// The stiffness of the selected bodies: that of the first of their effects that has one.
pub(super) fn stiffness(model: &PanelModel) -> Option<(&EffectModel, &Parameter)> {
    let carried = model.effects.iter().filter(|it| it.carriers_shown > 0);
    let of = |effect: &'_ EffectModel| {
        let mut all = effect.parameters.iter();
        all.position(|it| STIFFNESS.contains(&it.name))
    };
    carried
        .filter_map(|effect| Some((effect, &effect.parameters[of(effect)?])))
        .next()
}

/// Draws them.
pub fn show(ui: &mut Ui, panel: &mut Panel, model: &PanelModel) {
    ui.add_space(4.0);
    let frame = Frame::new()
        .stroke(Stroke::new(1.0, theme::of(ui).line))
        .corner_radius(4)
        .inner_margin(Margin::symmetric(6, 4));
    frame.show(ui, |ui| {
        match stiffness(model) {
            Some((effect, parameter)) => effects::parameter_row(ui, panel, effect, parameter),
            None => section::note(ui, "No body with a compliance is selected."),
        }
        world::substeps(ui, panel, model);
        if let Some((effect, _)) = stiffness(model) {
            let changed = effects::changed(effect, model);
            effective::row(ui, panel, effect.name, effect.effective.as_ref(), changed);
        }
        ui.horizontal(|ui| {
            let time = format!("{:.2} ms per tick", model.ms_per_tick);
            let size = vec2(0.42 * ui.available_width(), theme::ROW);
            let label = RichText::new(time).color(theme::of(ui).strong);
            let time = ui.add_sized(size, Label::new(label).truncate());
            panel.note("ms_per_tick", &time, ui);
            time.on_hover_text(
                "Time of the solver in a tick, the median of the last 60. It keeps up with real time while this is less \
                 than the simulated time of a tick.",
            );
            let button = RowButton::new(
                "accuracy",
                "Accuracy vs. cost",
                "Measure error and time per tick at many settings, in the background (A)",
            );
            if section::button_row(ui, panel, &[button]).is_some() {
                panel.ask(Request::Accuracy);
            }
        });
    });
}
