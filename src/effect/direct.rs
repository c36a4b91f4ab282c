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
        tolerance: Tolerance, "Error threshold", "",
        "Use the direct solver only if Gauss–Seidel would leave the body softer than requested by more than this \
         fraction, and would take longer at the substeps that reach it. 0: always.",
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
        let workspace = body.get::<BodyDirectWorkspace>();
        if settings.method.has_direct()
            && workspace.is_some_and(|it| it.0.has_plan(topology, &effects))
        {
            return None;
        }
        direct::refused(topology, &effects, settings.method).map(|reason| reason.to_string())
    }

    fn note(&self, body: &EntityRef, settings: &Settings) -> Option<String> {
        if !settings.method.has_direct() {
            let reason = "Fell back to Gauss–Seidel: the direct solver needs the method XPBD.";
            return Some(reason.to_owned());
        }
        let workspace = &body.get::<BodyDirectWorkspace>()?.0;
        let fallback = workspace.status().explanation().map(str::to_owned);
        let tolerance = f64::from(self.tolerance.get());
        let choice = workspace.choice();
        let choice = choice.filter(|choice| choice.tolerance == tolerance);
        let chosen = choice.map(|choice| explained(&choice));
        match (chosen, fallback) {
            (Some(chosen), Some(fallback)) => Some(format!("{chosen} {fallback}")),
            (chosen, fallback) => chosen.or(fallback),
        }
    }
}

/// The choice of the solver with its figures, in words.
fn explained(choice: &Choice) -> String {
    let &Choice {
        substeps,
        error,
        needed,
        tolerance,
        ..
    } = choice;
    let unit = if substeps == 1 { "substep" } else { "substeps" };
    let expected = format!("{} at {substeps} {unit}", in_words(error));
    let goal = format!("{} %", two_digits(100.0 * tolerance));
    let needs = match needed {
        Some(needed) => format!("{needed} substeps for {goal}"),
        None => format!("more than 1000 substeps for {goal}"),
    };
    match choice.ratio {
        None if error <= tolerance => format!("Gauss–Seidel in use: about {expected}."),
        None => format!(
            "Gauss–Seidel in use: about {expected}; {needs}. The body cannot be solved directly."
        ),
        Some(ratio) if choice.is_direct => format!(
            "Direct solver in use. Gauss–Seidel: about {expected}; {needs} ({}× the time).",
            two_digits(ratio)
        ),
        Some(ratio) => format!(
            "Gauss–Seidel in use: about {expected}; {needs}. The direct solver would take {}× the time of those.",
            two_digits(1.0 / ratio)
        ),
    }
}

/// A relative excess of a displacement.
fn in_words(error: f64) -> String {
    match error {
        0.0 => "as stiff as requested".to_owned(),
        rigid if rigid.is_infinite() => "soft instead of rigid".to_owned(),
        large if large >= 1.0 => format!("{} times too soft", two_digits(1.0 + large)),
        small => format!("{} % too soft", two_digits(100.0 * small)),
    }
}

/// A positive number, rounded to two digits.
fn two_digits(value: f64) -> String {
    let rounded = format!("{value:.1e}").parse().unwrap_or(value);
    let digits = 1.0 - f64::log10(rounded).floor();
    format!("{rounded:.*}", digits.clamp(0.0, 20.0) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_said_with_two_digits() {
        for (error, said) in [
            (0.0, "as stiff as requested"),
            (0.000_004_2, "0.00042 % too soft"),
            (0.001_234, "0.12 % too soft"),
            (0.0567, "5.7 % too soft"),
            (0.0996, "10 % too soft"),
            (0.456, "46 % too soft"),
            (1.0, "2.0 times too soft"),
            (14_303.0, "14000 times too soft"),
        ] {
            assert_eq!(in_words(error), said);
        }
    }

    #[test]
    fn the_choice_is_explained_with_its_figures() {
        let mut choice = Choice {
            is_direct: true,
            tolerance: 0.01_f32.into(),
            substeps: 10,
            error: 0.5,
            needed: Some(71),
            ratio: Some(3.123),
        };
        assert_eq!(
            explained(&choice),
            "Direct solver in use. Gauss–Seidel: about 50 % too soft at 10 substeps; 71 substeps for 1.0 % (3.1× the \
             time)."
        );
        (choice.is_direct, choice.ratio) = (false, Some(0.5));
        assert!(explained(&choice).ends_with("would take 2.0× the time of those."));
        (choice.needed, choice.ratio) = (None, None);
        let said = explained(&choice);
        assert!(said.contains("cannot be solved directly") && said.contains("more than 1000"));
        (choice.error, choice.needed, choice.substeps) = (0.004, Some(1), 1);
        assert_eq!(
            explained(&choice),
            "Gauss–Seidel in use: about 0.40 % too soft at 1 substep."
        );
    }
}
