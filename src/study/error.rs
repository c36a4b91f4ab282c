//! Errors of studies.

use crate::{
    output::OutputError,
    scene::SceneError,
    solver::{InvalidValue, ThreadsError},
};
use std::path::{Path, PathBuf};

/// Why a study cannot be made. The message says where, and what was expected.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// Neither a built-in problem nor a file.
    #[error(
        "unknown problem “{name}”: expected the path of a problem file, or a built-in problem: {valid}"
    )]
    Unknown {
        /// What was asked for.
        name: String,
        /// The built-in names.
        valid: String,
    },
    /// A file cannot be read.
    #[error("{path}: {error}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        error: std::io::Error,
    },
    /// A file is no problem, or its scene cannot be built.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Something in a problem makes no sense.
    #[error("problem “{problem}”: {message}")]
    Problem {
        /// Its name.
        problem: String,
        /// What is wrong, and what would be right.
        message: String,
    },
    /// A setting is out of its range.
    #[error(transparent)]
    Value(#[from] InvalidValue),
    /// The threads cannot be had.
    #[error(transparent)]
    Threads(#[from] ThreadsError),
    /// A file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// No job has such a name.
    #[error("unknown job “{id}”; expected a job from `--list`, such as {example}")]
    NoJob {
        /// What was asked for.
        id: String,
        /// One that there is.
        example: String,
    },
    /// A folder holds no points.
    #[error("{path} contains no points of a study: expected a file {FILE}", FILE = super::journal::FILE)]
    NoPoints {
        /// The folder.
        path: PathBuf,
    },
    /// A line of the points file cannot be understood.
    #[error("{path}:{line}: {message}")]
    Broken {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// What is there is from something else.
    #[error("{path} belongs to another study ({found}), expected {wanted}; {remedy}")]
    Different {
        /// The file.
        path: PathBuf,
        /// What it says.
        found: String,
        /// What is wanted.
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
