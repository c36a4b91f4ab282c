//! The points file. Every record is written and flushed as soon as it is available, so that an
//! aborted study loses at most the runs in progress.

use super::{
    StudyError,
    record::{Header, ProblemText, Record},
};
use std::{
    fs::{File, OpenOptions},
    io::{BufRead, BufReader, Write},
    path::{Path, PathBuf},
};

/// Its name in the folder of a study.
pub const FILE: &str = "points.jsonl";

/// The points file of a running study.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
}

impl Journal {
    /// Creates a new points file with this header.
    ///
    /// # Errors
    /// [`StudyError::Output`] if the folder cannot be made or written to.
    pub fn create(
        folder: &Path,
        header: &Header,
        problems: &[ProblemText],
    ) -> Result<Self, StudyError> {
        std::fs::create_dir_all(folder).map_err(|error| StudyError::unwritable(folder, error))?;
        let path = folder.join(FILE);
        let file = File::create(&path).map_err(|error| StudyError::unwritable(&path, error))?;
        let mut journal = Self { path, file };
        journal.append(&Record::Study(header.clone()))?;
        for problem in problems {
            journal.append(&Record::Problem(problem.clone()))?;
        }
        Ok(journal)
    }

    /// Opens an existing points file for appending and returns its records. A truncated last line
    /// is dropped.
    ///
    /// # Errors
    /// [`StudyError::NoPoints`], [`StudyError::Different`] if it is from another study,
    /// [`StudyError::Broken`] for an invalid line.
    pub fn resume(folder: &Path, header: &Header) -> Result<(Self, Vec<Record>), StudyError> {
        let path = folder.join(FILE);
        let (found, records, whole) = read(folder)?;
        if found != *header {
            return Err(different(
                &path,
                &found,
                header,
                "use another --out, or omit --resume to start over",
            ));
        }
        let file = OpenOptions::new()
            .append(true)
            .open(&path)
            .map_err(|error| StudyError::unwritable(&path, error))?;
        file.set_len(whole)
            .map_err(|error| StudyError::unwritable(&path, error))?;
        Ok((Self { path, file }, records))
    }

    /// Adds a record.
    ///
    /// # Errors
    /// [`StudyError::Output`] with the file and the system's message.
    pub fn append(&mut self, record: &Record) -> Result<(), StudyError> {
        let unwritable = |error: &dyn std::fmt::Display| StudyError::unwritable(&self.path, error);
        let mut line = serde_json::to_string(record).map_err(|error| unwritable(&error))?;
        line.push('\n');
        self.file
            .write_all(line.as_bytes())
            .map_err(|error| unwritable(&error))
    }
}

/// Reads the points of a folder: header, records, and the length of the complete lines in bytes.
///
/// # Errors
/// [`StudyError::NoPoints`] or [`StudyError::Broken`].
pub fn read(folder: &Path) -> Result<(Header, Vec<Record>, u64), StudyError> {
    let path = folder.join(FILE);
    let no_points = || StudyError::NoPoints {
        path: folder.to_owned(),
    };
    let file = File::open(&path).map_err(|_| no_points())?;
    let mut reader = BufReader::new(file);
    let (mut header, mut records, mut whole) = (None, Vec::new(), 0);
    for number in 1.. {
        let mut line = Vec::new();
        let length =
            reader
                .read_until(b'\n', &mut line)
                .map_err(|error| StudyError::Unreadable {
                    path: path.clone(),
                    error,
                })?;
        if length == 0 || line.last() != Some(&b'\n') {
            break;
        }
        let record = serde_json::from_slice(&line).map_err(|error| StudyError::Broken {
            path: path.clone(),
            line: number,
            message: error.to_string(),
        })?;
        match record {
            Record::Study(found) => header = Some(found),
            record => records.push(record),
        }
        whole += length as u64;
    }
    Ok((header.ok_or_else(no_points)?, records, whole))
}

/// The error for points that belong to a different study.
pub(super) fn different(
    path: &Path,
    found: &Header,
    wanted: &Header,
    remedy: &'static str,
) -> StudyError {
    let words = |header: &Header| {
        format!(
            "{}, {} budget, {}",
            header.version, header.budget, header.hash
        )
    };
    StudyError::Different {
        path: path.to_owned(),
        found: words(found),
        wanted: words(wanted),
        remedy,
    }
}
