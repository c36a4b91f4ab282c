//! What a study finds, piece by piece, as it is kept in the points file: a line of JSON each.

use super::{converge::Converged, observe::Observed, residual::Residuals, setting::Setting};
use serde::{Deserialize, Serialize};

/// A line of the points file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Record {
    /// The first line.
    Study(Header),
    /// A problem, as its file has it.
    Problem(ProblemText),
    /// The converged answer of a case.
    Reference(ReferenceRecord),
    /// A run: what is the same on every machine.
    Run(RunRecord),
    /// What a setting takes: what differs by machine.
    Time(TimeRecord),
}

/// What a study is of. Two that are to be put together have the same.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// Version of the program.
    pub version: String,
    /// Name of the budget, `quick` or `full`.
    pub budget: String,
    /// Hash of the budget and of all problems.
    pub hash: String,
}

/// A problem of the study.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProblemText {
    /// What commands call it.
    pub name: String,
    /// The text of its file.
    pub text: String,
    /// The folder that mesh files are beside.
    pub folder: String,
}

/// The converged answer of a case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReferenceRecord {
    /// The case.
    pub case: String,
    /// The answer; none if there is no static equilibrium and the f64 reference would take more than the budget
    /// has.
    pub converged: Option<Converged>,
}

/// A run at one setting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// The case.
    pub case: String,
    /// How it was solved.
    pub setting: Setting,
    /// What came out.
    pub observed: Observed,
    /// What its last substep left of its equations.
    pub residuals: Option<Residuals>,
    /// Farthest that a particle was from the origin at the end [m].
    #[serde(deserialize_with = "super::nan::number")]
    pub reach: f64,
}

/// Times of one setting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TimeRecord {
    /// The case.
    pub case: String,
    /// How it was solved.
    pub setting: Setting,
    /// Threads that it was given.
    pub threads: usize,
    /// Time of a simulated second in each round [ms].
    pub ms_per_second: Vec<f64>,
    /// On what.
    pub machine: String,
}

/// The machine that this is, as points carry it: processor, threads, instructions, system.
#[must_use]
pub fn machine() -> String {
    let processor = std::fs::read_to_string("/proc/cpuinfo")
        .ok()
        .and_then(|text| {
            let line = text.lines().find(|line| line.starts_with("model name"))?;
            Some(line.split_once(':')?.1.trim().to_owned())
        })
        .unwrap_or_else(|| std::env::consts::ARCH.to_owned());
    format!(
        "{processor}, {} threads, {} instructions, {}",
        crate::solver::available(),
        crate::solver::Instructions::default().name(),
        std::env::consts::OS,
    )
}
