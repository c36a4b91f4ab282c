//! Hashes that say which scene and which settings a figure is from.

use crate::solver::measure::fnv1a;

/// Hash of a text, as 16 hexadecimal digits: the same on every machine.
#[must_use]
pub fn of(text: &str) -> String {
    format!("{:016x}", fnv1a(text.as_bytes()))
}
