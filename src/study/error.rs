//! Errors of studies.

use crate::{
    output::OutputError,
    scene::SceneError,
    solver::{InvalidValue, ThreadsError},
    suggestion::similar,
};
use std::path::{Path, PathBuf};

/// An error of a study. The message says where it occurred and what was expected.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// Neither a built-in problem nor a file.
    #[error(
        "unknown problem “{name}”{}: expected the path of a problem file, or a built-in problem: {valid}",
        similar(.name, .valid)
    )]
    Unknown {
        /// The requested name.
        name: String,
        /// The built-in names.
        valid: String,
    },
    /// A file cannot be read.
    #[error("{path}: {error}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The system's message.
        error: std::io::Error,
    },
    /// A file is not a valid problem, or its scene cannot be built.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// An inconsistency in a problem.
    #[error("problem “{problem}”: {message}")]
    Problem {
        /// Its name.
        problem: String,
        /// What is wrong, and what was expected.
        message: String,
    },
    /// A scene cannot be refined.
    #[error(
        "a refinement needs a time above 0 and at least two runs within the range of substeps, but has \
         {seconds} s and {runs}: use fewer substeps, more runs or another time"
    )]
    NotRefined {
        /// Requested time [s].
        seconds: f64,
        /// Number of runs that are possible.
        runs: usize,
    },
    /// A setting is out of its range.
    #[error(transparent)]
    Value(#[from] InvalidValue),
    /// The threads cannot be started.
    #[error(transparent)]
    Threads(#[from] ThreadsError),
    /// A file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// No job has this name.
    #[error("unknown job “{id}”; expected a job from `--list`, such as {example}")]
    NoJob {
        /// The requested name.
        id: String,
        /// An existing name.
        example: String,
    },
    /// A folder contains no points.
    #[error("{path} contains no points of a study: expected a file {FILE}", FILE = super::journal::FILE)]
    NoPoints {
        /// The folder.
        path: PathBuf,
    },
    /// A line of the points file is invalid.
    #[error("{path}:{line}: {message}")]
    Broken {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// The points belong to another study.
    #[error("{path} belongs to another study ({found}), expected {wanted}; {remedy}")]
    Different {
        /// The file.
        path: PathBuf,
        /// The study that the points belong to.
        found: String,
        /// The expected study.
        wanted: String,
        /// What to do.
        remedy: &'static str,
    },
}

impl StudyError {
    pub(super) fn unwritable(path: &Path, error: impl std::fmt::Display) -> Self {
        Self::Output(OutputError::new(path, error))
    }
}
