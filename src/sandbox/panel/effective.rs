//! The effective compliance of an effect, next to the requested one.

use crate::sandbox::state::request::Request;
use bevy::prelude::*;
use bevy_egui::egui::{Color32, Label, RichText, Ui};
use std::collections::BTreeMap;

use super::{
    Panel,
    model::EffectiveModel,
    section::{self, RowButton},
};
use crate::{
    sandbox::ui::{number::format, theme},
    simulation::{Active, SimulationClock, SimulationSettings, SoftBody, plain::effects},
    solver::{
        EffectStates, ElasticKind, Particles,
        effective::ConstraintWork,
        effects::elastic::{Elastic, Visit},
    },
};

/// Decay of the sums per tick: they cover about the last second.
const KEPT: f64 = 0.95;

/// Ticks between evaluations, which cost as much as a few substeps.
const EVERY: u64 = 10;

/// Exponentially weighted sums over ticks for the selected bodies, by effect.
#[derive(Resource, Debug, Default)]
pub(super) struct Works {
    sums: BTreeMap<&'static str, ConstraintWork>,
    /// The tick that was evaluated last.
    tick: Option<u64>,
}

impl Works {
    /// Forgets everything, so that the next tick is evaluated.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Whether a tick is to be evaluated: the first one, and one in [`EVERY`].
    fn is_due(&self, tick: u64) -> bool {
        self.tick
            .is_none_or(|last| tick < last || tick >= last + EVERY)
    }

    /// Takes in the works of a tick.
    fn push(&mut self, tick: u64, works: BTreeMap<&'static str, ConstraintWork>) {
        let passed = tick.saturating_sub(self.tick.unwrap_or(tick));
        let kept = KEPT.powi(i32::try_from(passed).unwrap_or(i32::MAX));
        self.tick = Some(tick);
        for (name, new) in works {
            let sum = self.sums.entry(name).or_default();
            sum.fade(kept);
            sum.add(new);
        }
    }
}

/// Adds up the works of all elastic effects of a body.
struct Gather<'a> {
    body: &'a SoftBody,
    particles: &'a Particles,
    states: &'a EffectStates,
    h: f64,
    fresh: &'a mut BTreeMap<&'static str, ConstraintWork>,
}

impl Visit for Gather<'_> {
    fn visit<const N: usize, const M: usize, E: Elastic<N, M>>(&mut self, effect: &E) {
        let lambdas = self.states.multipliers(E::KIND);
        let work = ConstraintWork::of(effect, self.body, self.particles, lambdas, self.h);
        self.fresh.entry(E::KIND.name()).or_default().add(work);
    }
}

/// Evaluates the last substep of one tick in ten; to be called between ticks, as multipliers and positions
/// belong to different times in the middle of a tick. Sleeping bodies are skipped.
pub(super) fn gather(world: &mut World, shown: &[Entity]) {
    let tick = world.resource::<SimulationClock>().tick();
    if !world.resource::<Works>().is_due(tick) {
        return;
    }
    let h = world.resource::<SimulationSettings>().substep_seconds();
    let mut bodies = world.query_filtered::<(&SoftBody, &Particles, &EffectStates), Active>();
    let mut fresh = BTreeMap::new();
    for &entity in shown {
        if let Ok((body, particles, states)) = bodies.get(world, entity) {
            effects(world.entity(entity)).visit(&mut Gather {
                body,
                particles,
                states,
                h,
                fresh: &mut fresh,
            });
        }
    }
    world.resource_mut::<Works>().push(tick, fresh);
}

/// The effective compliance of an effect on the selected bodies.
pub(super) fn model(world: &World, effect: &str, shown: &[Entity]) -> Option<EffectiveModel> {
    let effective = world.resource::<Works>().sums.get(effect)?.compliance()?;
    let kind = ElasticKind::ALL
        .into_iter()
        .find(|kind| kind.name() == effect)?;
    let damping = |body: &Entity| effects(world.entity(*body)).damping(kind);
    let damping = shown.iter().find_map(damping)?;
    Some(EffectiveModel {
        effective: effective.effective,
        unit: kind.unit(),
        factor: effective.factor(),
        limited: effective.is_limited(),
        substeps: effective.substeps(world.resource::<SimulationSettings>(), damping),
    })
}

/// Draws the effective compliance below the parameters of the effect. A difference from the
/// requested one is a warning only after the user `changed` something; at the settings of the scene
/// it is a figure like others.
pub(super) fn show(
    ui: &mut Ui,
    panel: &mut Panel,
    effect: &str,
    effective: &EffectiveModel,
    changed: bool,
) {
    let text = RichText::new(words(effective)).small();
    let text = text.color(color(ui, effective, changed));
    let response = ui.add(Label::new(text).wrap()).on_hover_text(HELP);
    panel.note(format!("{effect}.effective"), &response, ui);
    use_substeps(ui, panel, effective);
}

/// Draws it in a row of constant height, so that nothing below moves: in few words, with the button beside
/// them.
pub(super) fn row(
    ui: &mut Ui,
    panel: &mut Panel,
    effect: &str,
    effective: Option<&EffectiveModel>,
    changed: bool,
) {
    ui.horizontal(|ui| {
        ui.set_min_height(theme::ROW + 2.0);
        let Some(effective) = effective else {
            let text = RichText::new("Effective compliance: not measured").small();
            ui.label(text.color(theme::of(ui).weak));
            return;
        };
        let text = RichText::new(few_words(effective)).small();
        let text = text.color(color(ui, effective, changed));
        let response = ui.add(Label::new(text).truncate());
        let more = format!("{}\n{HELP}", words(effective));
        panel.note(
            format!("{effect}.effective"),
            &response.on_hover_text(more),
            ui,
        );
        use_substeps(ui, panel, effective);
    });
}

/// How it is computed.
const HELP: &str = "Computed from multipliers and residual strains of the bodies shown, averaged over about a \
     second. Valid near rest; unreliable while the body swings or is hit.";

fn color(ui: &Ui, effective: &EffectiveModel, changed: bool) -> Color32 {
    let differs = effective.limited && effective.factor.is_some();
    match (differs, changed) {
        (true, true) => theme::of(ui).changed,
        (true, false) => theme::of(ui).text,
        (false, _) => theme::of(ui).weak,
    }
}

/// The button that sets the substeps which would reach the requested compliance, if any would.
fn use_substeps(ui: &mut Ui, panel: &mut Panel, effective: &EffectiveModel) {
    let Some(substeps) = effective.substeps.filter(|_| effective.limited) else {
        return;
    };
    let text = match substeps {
        1 => "Use 1 substep".to_owned(),
        _ => format!("Use {substeps} substeps"),
    };
    let help = "Set the substeps per tick to the number that reaches the requested compliance";
    let button = RowButton::new("use_substeps", &text, help);
    if section::button_row(ui, panel, &[button]).is_some() {
        panel.ask(Request::Setting {
            name: "substeps",
            value: Some(substeps.into()),
        });
    }
}

fn few_words(effective: &EffectiveModel) -> String {
    let value = format!(
        "Effective {} {}",
        format(effective.effective, 2),
        effective.unit
    );
    match effective.factor {
        None => format!("{value}, requested: rigid"),
        Some(_) if !effective.limited => format!("{value}, as requested"),
        Some(factor) => format!("{value}: {}×", format(factor, 2)),
    }
}

fn words(effective: &EffectiveModel) -> String {
    let value = format!("{} {}", format(effective.effective, 2), effective.unit);
    match (effective.factor, effective.substeps) {
        (None, _) => format!("Effective compliance {value} (requested: rigid)."),
        (Some(_), _) if !effective.limited => {
            format!("Effective compliance {value}, as requested.")
        }
        (Some(factor), Some(_)) => {
            format!(
                "Effective compliance {value}: {}× the requested value.",
                format(factor, 2)
            )
        }
        (Some(factor), None) => format!(
            "Effective compliance {value}: {}× the requested value. More substeps will not help; try \
             more iterations.",
            format(factor, 2)
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_tick_in_ten_is_evaluated_and_weighs_as_much_as_the_last_second() {
        let mut works = Works::default();
        let work = |effective| ConstraintWork {
            force_squared: 1.0,
            requested: 1.0,
            effective,
            ..ConstraintWork::default()
        };
        let mut evaluated = 0;
        for tick in 1..=600 {
            if works.is_due(tick) {
                evaluated += 1;
                let effective = if tick <= 300 { 2.0 } else { 4.0 };
                works.push(tick, [("stretch", work(effective))].into());
            }
        }
        assert_eq!(evaluated, 60);
        let compliance = works.sums["stretch"].compliance().expect("it is known");
        // 0.95^300 = 2e-7 of the older value remains.
        assert!((compliance.effective - 4.0).abs() < 1e-5, "{compliance:?}");
        assert!(works.is_due(3), "the scene was restarted");
        works.clear();
        assert!(works.is_due(601), "other bodies were selected");
    }

    #[test]
    fn what_the_solver_limits_is_said_with_what_would_help() {
        let softer = EffectiveModel {
            effective: 4e-4,
            unit: "m/N",
            factor: Some(4.0),
            limited: true,
            substeps: Some(24),
        };
        assert_eq!(
            words(&softer),
            "Effective compliance 4e-4 m/N: 4× the requested value."
        );
        let rigid = EffectiveModel {
            factor: None,
            substeps: None,
            ..softer.clone()
        };
        assert_eq!(
            words(&rigid),
            "Effective compliance 4e-4 m/N (requested: rigid)."
        );
        let exact = EffectiveModel {
            factor: Some(1.02),
            limited: false,
            ..softer
        };
        assert_eq!(
            words(&exact),
            "Effective compliance 4e-4 m/N, as requested."
        );
    }
}
