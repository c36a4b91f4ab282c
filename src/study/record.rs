//! Results of a study as they are stored in the points file: one line of JSON per record.

use super::{converge::Converged, observe::Observed, residual::Residuals, setting::Setting};
use serde::{Deserialize, Serialize};

/// A line of the points file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Record {
    /// The first line.
    Study(Header),
    /// A problem with the text of its file.
    Problem(ProblemText),
    /// The converged solution of a case.
    Reference(ReferenceRecord),
    /// A run: the part that is identical on every machine.
    Run(RunRecord),
    /// The times of a setting: the part that differs between machines.
    Time(TimeRecord),
}

/// Identity of a study. Studies can be merged if their headers are equal.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
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
#[non_exhaustive]
pub struct ProblemText {
    /// Its name in commands.
    pub name: String,
    /// The text of its file.
    pub text: String,
    /// The parent folder of mesh files.
    pub folder: String,
}

/// The converged solution of a case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ReferenceRecord {
    /// The case.
    pub case: String,
    /// The solution; none if there is no static equilibrium and the f64 reference would exceed the
    /// budget.
    pub converged: Option<Converged>,
}

/// A run at one setting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct RunRecord {
    /// The case.
    pub case: String,
    /// Method, substeps and iterations.
    pub setting: Setting,
    /// The observed values.
    pub observed: Observed,
    /// Residuals of its last substep.
    pub residuals: Option<Residuals>,
    /// Largest distance of a particle from the origin at the end [m].
    #[serde(deserialize_with = "super::nan::number")]
    pub reach: f64,
}

/// Times of a setting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct TimeRecord {
    /// The case.
    pub case: String,
    /// Method, substeps and iterations.
    pub setting: Setting,
    /// Number of threads.
    pub threads: usize,
    /// Time per simulated second in each round [ms].
    pub ms_per_second: Vec<f64>,
    /// The machine that it was timed on.
    pub machine: String,
}

/// Description of this machine as stored with points: processor, threads, instruction set, system.
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
