//! The machine of the measurement, and versions of the packages.

use serde::Serialize;
use std::{fs, process::Command, thread};

/// The machine.
#[derive(Debug, Clone, Serialize)]
pub struct Machine {
    /// Model of the processor.
    pub cpu: String,
    /// Number of available threads.
    pub threads: usize,
    /// Operating system and architecture.
    pub os: String,
    /// Version of the compiler on the path, which should be the one that built this program.
    pub rustc: String,
}

impl Machine {
    /// Detects the machine; unavailable fields are "unknown".
    #[must_use]
    pub fn look() -> Self {
        let unknown = || "unknown".to_owned();
        Self {
            cpu: cpu().unwrap_or_else(unknown),
            threads: thread::available_parallelism().map_or(1, usize::from),
            os: format!(
                "{} ({})",
                distribution().unwrap_or_else(|| std::env::consts::OS.into()),
                std::env::consts::ARCH
            ),
            rustc: said_by("rustc", &["--version"]).unwrap_or_else(unknown),
        }
    }
}

fn cpu() -> Option<String> {
    fs::read_to_string("/proc/cpuinfo")
        .ok()
        .and_then(|text| value_of(&text, "model name", ':'))
        .or_else(|| said_by("sysctl", &["-n", "machdep.cpu.brand_string"]))
}

fn distribution() -> Option<String> {
    let text = fs::read_to_string("/etc/os-release").ok()?;
    value_of(&text, "PRETTY_NAME", '=')
}

fn value_of(text: &str, key: &str, separator: char) -> Option<String> {
    text.lines()
        .filter_map(|line| line.split_once(separator))
        .find(|(name, _)| name.trim() == key)
        .map(|(_, value)| value.trim().trim_matches('"').to_owned())
}

fn said_by(program: &str, arguments: &[&str]) -> Option<String> {
    let output = Command::new(program).args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}

/// Version of a package in the lock file of this package.
#[must_use]
pub fn locked_version(package: &str) -> String {
    let name = format!("name = \"{package}\"");
    include_str!("../Cargo.lock")
        .lines()
        .skip_while(|line| *line != name)
        .find_map(|line| value_of(line, "version", '='))
        .unwrap_or_else(|| "unknown".into())
}
