//! Time to an error: the settings of all peers on bodies at rest, their errors against the f64
//! answer of the same mesh, and the least time to 10 %, 1 % and 0.1 %.
//!
//! [`problems`] makes the bodies, [`body`] finds the answer, [`solvers`] steps them, [`settle`]
//! finds rest, [`error`] measures the distance to the answer, [`sweep`] tries all settings,
//! [`choose`] finds the cheapest, [`table`] and [`diagram`] write.

mod body;
mod check;
mod choose;
mod diagram;
mod error;
pub mod problems;
mod settle;
pub mod solvers;
pub mod sweep;
mod table;

use crate::{machine::Machine, peer::Peer};
use anyhow::{Context, anyhow};
use serde::Serialize;
use settle::Patience;
use solvers::Solver;
use std::{path::Path, time::Duration};
use sweep::{Effort, Outcome};

/// A solver in the table.
#[derive(Debug, Clone, Serialize)]
pub struct Participant {
    /// Name.
    pub name: &'static str,
    /// Version of its peer.
    pub version: String,
    /// How it is set up.
    pub setup: &'static str,
}

/// Results of all problems.
#[derive(Debug, Clone, Serialize)]
pub struct Findings {
    /// The machine.
    pub machine: Machine,
    /// Duration of the measurement.
    pub effort: Effort,
    /// The solvers.
    pub solvers: Vec<Participant>,
    /// Peers that were left out, with the reasons.
    pub left_out: Vec<String>,
    /// The results.
    pub outcomes: Vec<Outcome>,
}

/// Duration of a measurement, thorough or quick.
#[must_use]
pub fn effort(quick: bool) -> Effort {
    if quick {
        return Effort {
            patience: Patience {
                seconds: 20,
                time: Duration::from_millis(500),
            },
            most: 60.0,
            rounds: 3,
            slice: Duration::from_millis(8),
        };
    }
    Effort {
        patience: Patience {
            seconds: 40,
            time: Duration::from_millis(1500),
        },
        most: 160.0,
        rounds: 7,
        slice: Duration::from_millis(15),
    }
}

/// Marks the table in a Markdown file.
const MARKERS: [&str; 2] = [
    "<!-- peers accuracy: begin -->",
    "<!-- peers accuracy: end -->",
];

/// The text with its part between the markers replaced by a table; `None` without markers.
#[must_use]
pub fn splice(text: &str, table: &str) -> Option<String> {
    let (before, rest) = text.split_once(MARKERS[0])?;
    let (_, after) = rest.split_once(MARKERS[1])?;
    let [begin, end] = MARKERS;
    Some(format!("{before}{begin}\n{table}{end}{after}"))
}

/// Measures the named problems with the solvers of these peers; those of Newton run in a Python.
///
/// # Errors
/// If a problem cannot be built or has no answer.
pub fn measure(
    names: &[&str],
    peers: &[Box<dyn Peer>],
    newton: Option<&Path>,
    left_out: Vec<String>,
    machine: Machine,
    effort: Effort,
) -> anyhow::Result<Findings> {
    let mut solvers = solvers::all(newton);
    solvers.retain(|solver| peers.iter().any(|peer| peer.name() == solver.peer()));
    let mut outcomes = Vec::new();
    for name in names {
        let problem = problems::build(name).with_context(|| format!("problem {name}"))?;
        let answer = body::answer(&problem)?;
        eprintln!("{name}: {} particles", problem.shape.vertices.len());
        outcomes.push(sweep::sweep(&problem, &answer, &solvers, &effort)?);
    }
    let participants = solvers
        .iter()
        .map(|solver| participant(solver.as_ref(), peers));
    Ok(Findings {
        solvers: participants.collect(),
        machine,
        effort,
        left_out,
        outcomes,
    })
}

fn participant(solver: &dyn Solver, peers: &[Box<dyn Peer>]) -> Participant {
    let peer = peers.iter().find(|peer| peer.name() == solver.peer());
    Participant {
        name: solver.name(),
        version: peer.map_or_else(String::new, |peer| peer.version()),
        setup: solver.setup(),
    }
}

impl Findings {
    /// The tables as Markdown.
    ///
    /// # Errors
    /// None in practice: writing to a string does not fail.
    pub fn markdown(&self) -> Result<String, std::fmt::Error> {
        table::markdown(self)
    }

    /// The diagrams as SVG.
    ///
    /// # Errors
    /// Errors of the plotting crate.
    pub fn diagram(&self) -> anyhow::Result<String> {
        diagram::draw(self).map_err(|error| anyhow!("drawing the diagram: {error}"))
    }
}

#[cfg(test)]
mod tests {
    use super::{body::inverse_masses, error::Measure, solvers::Setting, *};

    /// Error at rest of a solver with a setting.
    fn error_of(solver: &str, problem: &str, setting: Setting) -> f64 {
        error_with(&solvers::all(None), solver, problem, setting)
    }

    fn error_with(all: &[Box<dyn Solver>], solver: &str, problem: &str, setting: Setting) -> f64 {
        let problem = problems::build(problem).expect("it is a problem");
        let answer = body::answer(&problem).expect("it has an answer");
        let measure = Measure::new(&problem, answer.positions);
        let inverse = inverse_masses(&problem).expect("it has masses");
        let mass = |&w: &f32| if w > 0.0 { 1.0 / f64::from(w) } else { 0.0 };
        let masses: Vec<f64> = inverse.iter().map(mass).collect();
        let solver = all.iter().find(|it| it.name() == solver);
        let solver = solver.expect("it is a solver");
        let mut trial = solver.build(&problem, setting).expect("it can be built");
        let patience = Patience {
            seconds: 60,
            time: Duration::from_secs(60),
        };
        let rest = settle::settle(trial.as_mut(), &measure, &masses, &patience);
        let rest = rest.expect("it is finite");
        check::check(&problem, trial.as_mut()).expect("it holds all constraints");
        assert!(rest.settled, "{rest:?}");
        rest.error
    }

    #[test]
    fn a_table_replaces_the_one_between_the_markers() {
        let [begin, end] = MARKERS;
        let text = format!("a\n{begin}\r\nold\n{end}\nb\n");
        let new = format!("a\n{begin}\nnew\n{end}\nb\n");
        assert_eq!(splice(&text, "new\n"), Some(new));
        assert_eq!(splice("none", "new"), None);
    }

    #[test]
    fn every_answer_is_an_equilibrium() {
        for name in problems::NAMES {
            let problem = problems::build(name).expect("it is a problem");
            let answer = body::answer(&problem).expect("it has an answer");
            assert!(answer.residual < 1e-8, "{name}: {}", answer.residual);
            assert!(answer.uncertainty < 1e-4, "{name}: {}", answer.uncertainty);
        }
    }

    #[test]
    fn the_direct_solver_finds_the_answers() {
        for name in ["beam4", "springs4", "twist", "chain"] {
            let error = error_of("Pliant direct", name, Setting::new(8, 2));
            assert!(error < 1e-4, "{name}: {error}");
        }
    }

    /// An edge between two pins has no frequency.
    #[cfg(feature = "rapier")]
    #[test]
    fn rapier_is_finite_without_damping() {
        let setting = Setting {
            frequency: Some(1e6),
            damping: Some(0.0),
            ..Setting::new(64, 4)
        };
        assert!(error_of("Rapier", "springs4", setting).is_finite());
    }

    /// Each peer was given the compliances, as it converges to the reference.
    #[cfg(all(feature = "rapier", feature = "oxiphysics"))]
    #[test]
    fn peers_converge_to_the_same_equilibrium() {
        let rapier = Setting {
            damping: Some(0.1),
            ..Setting::new(32, 16)
        };
        for (solver, problem, setting, largest) in [
            ("Rapier", "chain", rapier, 1e-3),
            ("OxiPhysics", "jelly-springs", Setting::new(16, 2), 1e-3),
            #[cfg(jolt)]
            ("Jolt", "jelly-springs", Setting::new(16, 1), 1e-2),
        ] {
            let error = error_of(solver, problem, setting);
            assert!(error < largest, "{solver} {problem}: {error}");
        }
    }

    /// Newton was given the compliances, the bulk modulus and the Lamé parameters, as it converges to the reference.
    #[test]
    #[ignore = "needs Newton: PLIANT_NEWTON=PYTHON names a Python that has it"]
    fn newton_has_the_same_elastic_laws() {
        let python = std::env::var_os("PLIANT_NEWTON").expect("it names a Python");
        let all = solvers::all(Some(Path::new(&python)));
        for (solver, problem, substeps) in [
            ("Newton XPBD", "chain", 8),
            ("Newton XPBD", "jelly-springs", 16),
            ("Newton VBD", "chain", 16),
            ("Newton VBD", "jelly-springs", 16),
            ("Newton VBD", "jelly", 16),
        ] {
            let error = error_with(&all, solver, problem, Setting::new(substeps, 16));
            assert!(error < 1e-3, "{solver} {problem}: {error}");
        }
    }

    #[test]
    fn a_larger_limit_has_more_patience() {
        let [short, long] = [effort(false), effort(false).with_limit(1600.0)];
        assert_eq!(long.most, 1600.0);
        assert_eq!(long.patience.time, 10 * short.patience.time);
    }

    #[cfg(feature = "rapier")]
    #[test]
    fn rapier_has_the_same_elastic_law() {
        let setting = Setting {
            damping: Some(1.0),
            ..Setting::new(4, 320)
        };
        let error = error_of("Rapier FEM", "beam4", setting);
        assert!(error < 1e-3, "{error}");
    }
}
