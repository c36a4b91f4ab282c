//! Hashes that identify the scene and the settings of a result.

use crate::solver::measure::fnv1a;

/// Hash of a text, as 16 hexadecimal digits; identical on every machine.
#[must_use]
pub fn of(text: &str) -> String {
    format!("{:016x}", fnv1a(text.as_bytes()))
}
