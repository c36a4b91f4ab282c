//! Direct solver: all elastic constraints of a body as one sparse system per iteration.

use super::{Effect, Parameter, Scale, parameter};
use crate::{
    simulation::{BodyDirectWorkspace, SoftBody, plain},
    solver::{
        Direct, Settings, Tolerance,
        advance::Stage,
        direct::{self, Choice},
    },
};
use bevy::prelude::*;

impl Effect for Direct {
    const NAME: &'static str = "direct";
    const TITLE: &'static str = "Direct solver";
    const SUMMARY: &'static str = "Solves all elastic constraints of the body as one sparse system per \
                                   iteration, for slender and stiff bodies that Gauss–Seidel leaves too soft.";
    const PARAMETERS: &'static [Parameter<Self>] = &[parameter!(
        tolerance: Tolerance, "Auto above error", "",
        "Relative error of the stiffness that Gauss–Seidel may leave: 0.01 solves directly only where it is \
         expected to be off by more than 1 %, and to take longer for 1 %; 0 always solves directly.",
        (0.0, 0.1), Scale::Linear
    )];

    type State = BodyDirectWorkspace;
    const STAGES: &'static [Stage] = &[Stage::Direct];

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }

    fn unfit(body: &EntityRef, settings: &Settings) -> Option<String> {
        let topology = &body.get::<SoftBody>()?.0;
        let effects = plain::effects(*body);
        if effects.direct.is_some_and(|it| it.tolerance.get() > 0.0) {
            // Gauss–Seidel is used, and the note says so.
            return None;
        }
        direct::unfit(topology, &effects, settings.method).map(|reason| reason.to_string())
    }

    fn note(&self, body: &EntityRef, settings: &Settings) -> Option<String> {
        if !settings.method.has_direct() {
            let reason = "Fell back to Gauss–Seidel: the direct solver needs the method XPBD.";
            return Some(reason.to_owned());
        }
        let workspace = &body.get::<BodyDirectWorkspace>()?.0;
        let fallback = workspace.status().explanation().map(str::to_owned);
        if self.tolerance.get() == 0.0 {
            return fallback;
        }
        let choice = workspace.choice()?;
        let chosen = explained(&choice, self.tolerance, settings);
        Some(match fallback.filter(|_| choice.is_direct) {
            Some(fallback) => format!("{chosen} {fallback}"),
            None => chosen,
        })
    }
}

/// The choice of the solver with its figures, in one or two sentences.
pub(crate) fn explained(choice: &Choice, tolerance: Tolerance, settings: &Settings) -> String {
    let count = settings.substeps.get();
    let unit = if count == 1 { "substep" } else { "substeps" };
    let percent = |error: f64| match error {
        rigid if rigid.is_infinite() => "any amount".to_owned(),
        large if large >= 0.1 => format!("about {:.0} %", 100.0 * large),
        small => format!("about {:.2} %", 100.0 * small),
    };
    let error = percent(choice.error);
    let goal = 100.0 * tolerance.get();
    let substeps = choice.substeps;
    match (choice.is_direct, substeps) {
        (true, Some(substeps)) => format!(
            "Auto: solved directly. Gauss–Seidel is expected to be off by {error} at {count} {unit}, and to need {substeps} \
             for {goal:.3} %, {:.1} times the time of one direct substep.",
            choice.ratio
        ),
        (true, None) => format!(
            "Auto: solved directly. Gauss–Seidel is expected to be off by {error} at {count} {unit}, and by more than \
             {goal:.3} % at any number up to 1000."
        ),
        (false, _) if choice.error <= f64::from(tolerance.get()) => {
            format!("Auto: Gauss–Seidel, which is expected to be off by {error} at {count} {unit}.")
        }
        (false, substeps) => {
            let reason = match choice.ratio {
                0.0 => "the body cannot be solved directly",
                _ => "a direct substep takes longer",
            };
            let needed = match substeps {
                Some(substeps) => format!("it needs about {substeps} substeps for {goal:.3} %"),
                None => format!("it does not reach {goal:.3} % with up to 1000"),
            };
            format!(
                "Auto: Gauss–Seidel, although it is expected to be off by {error} at {count} {unit}: {needed}, and {reason}."
            )
        }
    }
}
