//! The results as Markdown.

use super::{
    Findings,
    choose::{best_error, cheapest, winner},
    sweep::{Entry, Outcome, TARGETS},
};
use std::fmt::{self, Write};

/// Writes the tables: one for each error target.
///
/// # Errors
/// None in practice: writing to a string does not fail.
pub fn markdown(findings: &Findings) -> Result<String, fmt::Error> {
    let mut text = String::new();
    for target in TARGETS {
        writeln!(
            text,
            "**Error of at most {} %**, milliseconds of processor time per simulated second, with one thread:\n",
            percent(target)
        )?;
        grid(&mut text, findings, target)?;
    }
    caption(&mut text, findings)?;
    problems(&mut text, findings)?;
    solvers(&mut text, findings)?;
    Ok(text)
}

fn grid(text: &mut String, findings: &Findings, target: f64) -> fmt::Result {
    let names: Vec<_> = findings.solvers.iter().map(|solver| solver.name).collect();
    writeln!(text, "| problem | {} |", names.join(" | "))?;
    writeln!(text, "|---|{}", "---|".repeat(names.len()))?;
    for outcome in &findings.outcomes {
        let won = winner(outcome, target);
        let cells: Vec<_> = outcome
            .entries
            .iter()
            .map(|entry| cell(entry, target, won))
            .collect();
        writeln!(text, "| `{}` | {} |", outcome.problem, cells.join(" | "))?;
    }
    writeln!(text)
}

/// Time and setting of a solver; bold for the winner.
fn cell(entry: &Entry, target: f64, won: Option<(&'static str, bool)>) -> String {
    if entry.refusal.is_some() {
        return "–".into();
    }
    let Some(found) = cheapest(entry, target) else {
        return match best_error(entry) {
            Some(error) => format!("not reached (best {} %)", percent(error)),
            None if entry.failure.is_some() => "failed".into(),
            None => "does not come to rest".into(),
        };
    };
    let words = format!("{} ({})", significant(found.ms.median), found.point.label);
    match won {
        Some((name, overlaps)) if name == entry.solver => {
            let noise = if overlaps { " *within noise*" } else { "" };
            format!("**{words}**{noise}")
        }
        _ => words,
    }
}

fn caption(text: &mut String, findings: &Findings) -> fmt::Result {
    let effort = &findings.effort;
    writeln!(
        text,
        "*Bold: least time; within noise where the times of another overlap. In parentheses, \
         substeps × iterations of a tick of 1/60 s. Medians of {} rounds of {} ms at rest; \
         settings up to {} ms per simulated second; {}, {}, {}.*\n",
        effort.rounds,
        effort.slice.as_millis(),
        effort.most,
        findings.machine.cpu,
        findings.machine.os,
        findings.machine.rustc
    )
}

fn problems(text: &mut String, findings: &Findings) -> fmt::Result {
    writeln!(
        text,
        "| problem | body | particles | edges | tetrahedra | largest displacement |\n\
         |---|---|---|---|---|---|"
    )?;
    for outcome in &findings.outcomes {
        let Outcome {
            problem,
            title,
            particles,
            edges,
            tetrahedra,
            displacement,
            relative_displacement,
            ..
        } = outcome;
        writeln!(
            text,
            "| `{problem}` | {title} | {particles} | {edges} | {tetrahedra} | {} mm, {} % of the \
             size |",
            significant(displacement * 1e3),
            percent(*relative_displacement)
        )?;
    }
    writeln!(text)
}

fn solvers(text: &mut String, findings: &Findings) -> fmt::Result {
    for solver in &findings.solvers {
        writeln!(
            text,
            "- **{}** {}: {}",
            solver.name, solver.version, solver.setup
        )?;
    }
    for outcome in &findings.outcomes {
        for entry in &outcome.entries {
            if let Some(reason) = &entry.failure {
                let (solver, problem) = (entry.solver, outcome.problem);
                writeln!(text, "- {solver} failed on `{problem}`: {reason}.")?;
            }
        }
    }
    for sentence in &findings.left_out {
        writeln!(text, "- {sentence}")?;
    }
    Ok(())
}

/// A fraction in per cent, with two significant digits and without trailing zeros.
#[must_use]
pub fn percent(fraction: f64) -> String {
    let value = fraction * 100.0;
    if value >= 10.0 {
        return format!("{value:.0}");
    }
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let digits = (1.0 - value.log10().floor()).max(0.0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') {
        return text.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    text
}

/// A number with three significant digits.
#[must_use]
pub fn significant(value: f64) -> String {
    match value {
        v if v >= 100.0 => format!("{v:.0}"),
        v if v >= 10.0 => format!("{v:.1}"),
        v if v >= 1.0 => format!("{v:.2}"),
        v if v >= 0.1 => format!("{v:.3}"),
        v => format!("{v:.4}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentages_have_two_digits() {
        assert_eq!(percent(0.1), "10");
        assert_eq!(percent(0.01), "1");
        assert_eq!(percent(0.001), "0.1");
        assert_eq!(percent(0.000_123), "0.012");
        assert_eq!(percent(0.0567), "5.7");
        assert_eq!(percent(2.5), "250");
    }

    #[test]
    fn times_have_three_digits() {
        assert_eq!(significant(123.4), "123");
        assert_eq!(significant(1.234), "1.23");
        assert_eq!(significant(0.0123), "0.0123");
    }
}
