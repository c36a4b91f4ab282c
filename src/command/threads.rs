//! The option `--threads`, shared by the window and the headless commands.

use crate::solver::{Threads, ThreadsError};
use clap::Args;

/// How many threads to step bodies on.
#[derive(Debug, Clone, Copy, Args)]
pub struct ThreadsOption {
    /// Number of solver threads; 0 for one per core. Results are bit-identical for any number
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = count, allow_negative_numbers = true)]
    threads: usize,
}

/// A number of threads.
pub fn count(text: &str) -> Result<usize, String> {
    let found = text.parse();
    found.map_err(|_| "expected a whole number from 0, which is one per core".to_owned())
}

impl ThreadsOption {
    /// Starts the threads.
    pub fn start(self) -> Result<Threads, ThreadsError> {
        if self.threads > 1 && cfg!(not(feature = "parallel")) {
            return Err(ThreadsError {
                count: self.threads,
                reason: "this program was built without the feature `parallel`; use 0 or 1"
                    .to_owned(),
            });
        }
        Threads::new(self.threads)
    }
}
