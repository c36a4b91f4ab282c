//! Output of a run: figures as CSV, a plot of them as SVG, a summary as JSON, warnings; documents of
//! text, tables and figures, and pages of HTML.

pub mod csv;
pub mod document;
mod free_path;
pub mod json;
pub mod page;
pub mod plot;
pub mod series;
pub mod warnings;

pub use free_path::{free_path, plain_name};

/// Error of writing an output file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// A file cannot be written.
    #[error("cannot write {path}: {message}")]
    Unwritable {
        /// The file.
        path: std::path::PathBuf,
        /// Message of the system.
        message: String,
    },
}

impl OutputError {
    pub(crate) fn new(path: &std::path::Path, error: impl std::fmt::Display) -> Self {
        Self::Unwritable {
            path: path.to_owned(),
            message: error.to_string(),
        }
    }
}
