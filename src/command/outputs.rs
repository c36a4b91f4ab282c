//! Output files of a command, checked before anything runs: nothing that is there is lost by a slip.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// The file for the standard output.
pub const STANDARD_OUTPUT: &str = "-";

/// Output files of a command, and the files that it reads.
#[derive(Debug, Default)]
pub struct Outputs {
    /// Option and file.
    files: Vec<(&'static str, PathBuf)>,
    /// What it is, and the file.
    inputs: Vec<(&'static str, PathBuf)>,
}

impl Outputs {
    /// Adds the output of an option, if it is given.
    pub fn output(&mut self, option: &'static str, file: Option<&PathBuf>) {
        self.files.extend(file.map(|file| (option, file.clone())));
    }

    /// Adds a file that is read, such as `the scene`.
    pub fn input(&mut self, what: &'static str, file: impl Into<PathBuf>) {
        self.inputs.push((what, file.into()));
    }

    /// Refuses `-`, the standard output, for files that are not text.
    ///
    /// # Errors
    /// The option, and how to write a file of this name.
    pub fn refuse_standard_output(&self, options: &[&str]) -> anyhow::Result<()> {
        let is_dash = |(option, file): &&(&str, PathBuf)| {
            options.contains(option) && file.as_os_str() == STANDARD_OUTPUT
        };
        match self.files.iter().find(is_dash) {
            Some((option, _)) => anyhow::bail!(
                "{option} does not write to the standard output; use ./- for a file of this name"
            ),
            None => Ok(()),
        }
    }

    /// Checks that each file can be written, that no two outputs are the same file, and, unless
    /// `--overwrite` is given, that none is an input. `None` for a command without that option.
    ///
    /// # Errors
    /// The option, the file, the reason and what to do.
    pub fn check(&self, overwrite: Option<bool>) -> anyhow::Result<()> {
        for (place, (option, file)) in self.files.iter().enumerate() {
            if file.as_os_str() == STANDARD_OUTPUT {
                continue;
            }
            let name = file.display();
            check_folder(file)?;
            if file.is_dir() {
                anyhow::bail!(
                    "cannot write {name} ({option}): it is a folder; add the name of a file"
                );
            }
            let is_same = |other: &Path| same_file(file, other);
            let before = self.files[..place].iter();
            if let Some((other, _)) = before.into_iter().find(|(_, file)| is_same(file)) {
                anyhow::bail!(
                    "{other} and {option} would both write {name}; give each a file of its own"
                );
            }
            let mut inputs = self.inputs.iter();
            if overwrite != Some(true)
                && let Some((what, _)) = inputs.find(|(_, input)| is_same(input))
            {
                let or = overwrite.map_or("", |_| " or pass --overwrite");
                anyhow::bail!("{option} would overwrite {name} ({what}): choose another file{or}");
            }
        }
        Ok(())
    }
}

/// Checks the extension of an output file.
///
/// # Errors
/// The option, the file and the expected extension.
pub fn check_extension(
    option: &str,
    file: Option<&PathBuf>,
    what: &str,
    extension: &str,
) -> anyhow::Result<()> {
    let is_right = |file: &PathBuf| {
        let found = file.extension();
        found.is_some_and(|found| found.eq_ignore_ascii_case(extension))
    };
    match file {
        Some(file) if !is_right(file) => anyhow::bail!(
            "cannot write {} ({option}): {what} as {}; use a name that ends in .{extension}",
            file.display(),
            extension.to_uppercase()
        ),
        _ => Ok(()),
    }
}

/// Checks that the folder of an output file exists.
///
/// # Errors
/// The file and the folder.
pub fn check_folder(file: &Path) -> anyhow::Result<()> {
    let folder = file
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    if let Some(folder) = folder
        && !folder.is_dir()
    {
        anyhow::bail!(
            "cannot write {}: the folder {} does not exist",
            file.display(),
            folder.display()
        );
    }
    Ok(())
}

/// Whether two paths are the same regular file, or would be.
fn same_file(a: &Path, b: &Path) -> bool {
    let is_special = |path: &Path| fs::metadata(path).is_ok_and(|found| !found.is_file());
    if a.as_os_str() == STANDARD_OUTPUT || is_special(a) {
        return false;
    }
    #[cfg(unix)]
    if let (Ok(a), Ok(b)) = (fs::metadata(a), fs::metadata(b)) {
        use std::os::unix::fs::MetadataExt;
        // Also by another name of the same file.
        return (a.dev(), a.ino()) == (b.dev(), b.ino());
    }
    place(a) == place(b)
}

/// A path without links and relative parts, also of a file that does not exist.
fn place(path: &Path) -> PathBuf {
    let of_folder = || {
        let folder = path.parent().unwrap_or(Path::new(""));
        let folder = match folder.as_os_str().is_empty() {
            true => Path::new("."),
            false => folder,
        };
        let folder = fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
        folder.join(path.file_name().unwrap_or_default())
    };
    fs::canonicalize(path).unwrap_or_else(|_| of_folder())
}
