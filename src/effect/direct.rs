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
fn explained(choice: &Choice, tolerance: Tolerance, settings: &Settings) -> String {
    let now = settings.substeps.get();
    let unit = if now == 1 { "substep" } else { "substeps" };
    let expected = format!("{} at {now} {unit}", in_words(choice.error));
    // A multiple of 0.001 %.
    let goal = (f64::from(tolerance.get()) * 1e5).round() / 1e3;
    match (choice.is_direct, choice.substeps) {
        (true, Some(substeps)) => format!(
            "Auto: solved directly. Gauss–Seidel is expected to leave it {expected}, and to need {substeps} for {goal} %, \
             {:.1} times the time of one direct substep.",
            choice.ratio
        ),
        (true, None) => format!(
            "Auto: solved directly. Gauss–Seidel is expected to leave it {expected}, and not to reach {goal} % with up to 1000."
        ),
        (false, _) if choice.error <= f64::from(tolerance.get()) => {
            format!("Auto: Gauss–Seidel, which is expected to leave it {expected}.")
        }
        (false, substeps) => {
            let needed = match substeps {
                Some(substeps) => format!("needs about {substeps} for {goal} %"),
                None => format!("does not reach {goal} % with up to 1000"),
            };
            let reason = match choice.ratio {
                0.0 => "the body cannot be solved directly",
                _ => "one direct substep takes longer",
            };
            format!(
                "Auto: Gauss–Seidel, although it is expected to leave it {expected}: it {needed}, but {reason}."
            )
        }
    }
}

/// A relative error of the stiffness, to two digits.
fn in_words(error: f64) -> String {
    let two_digits = |value: f64| {
        let unit = 10_f64.powf(value.log10().floor() - 1.0);
        let rounded = (value / unit).round() * unit;
        match value {
            small if small < 1.0 => format!("{rounded:.2}"),
            small if small < 10.0 => format!("{rounded:.1}"),
            _ => format!("{rounded:.0}"),
        }
    };
    match error {
        rigid if rigid.is_infinite() => "soft, although it is rigid,".to_owned(),
        large if large >= 1.0 => format!("{} times too soft", two_digits(1.0 + large)),
        small => format!("{} % too soft", two_digits(100.0 * small.max(1e-4))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_said_with_two_digits() {
        for (error, said) in [
            (0.0, "0.01 % too soft"),
            (0.001_234, "0.12 % too soft"),
            (0.0567, "5.7 % too soft"),
            (0.456, "46 % too soft"),
            (1.0, "2.0 times too soft"),
            (14_303.0, "14000 times too soft"),
        ] {
            assert_eq!(in_words(error), said);
        }
    }
}
