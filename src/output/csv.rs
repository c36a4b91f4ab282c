//! Figures as CSV: one row per tick, with the unit of each column in its name.

use super::OutputError;
use crate::{file, simulation::Statistics};
use std::path::Path;

/// Names of the columns, with units.
pub const COLUMNS: [&str; 24] = [
    "tick",
    "time_s",
    "ms_per_tick",
    "bodies",
    "asleep",
    "particles",
    "constraints",
    "kinetic_j",
    "potential_j",
    "elastic_j",
    "unresolved_j",
    "energy_j",
    "momentum_x_kg_m_s",
    "momentum_y_kg_m_s",
    "momentum_z_kg_m_s",
    "angular_momentum_x_kg_m2_s",
    "angular_momentum_y_kg_m2_s",
    "angular_momentum_z_kg_m2_s",
    "volume_error",
    "residual",
    "inverted",
    "contacts",
    "smallest_gap_m",
    "crossings",
];

/// A row, in the order of [`COLUMNS`].
#[must_use]
pub fn row(figures: &Statistics) -> [String; COLUMNS.len()] {
    let [px, py, pz] = figures.momentum;
    let [lx, ly, lz] = figures.angular_momentum;
    [
        figures.tick.to_string(),
        figures.time.to_string(),
        figures.ms_per_tick.to_string(),
        figures.bodies.to_string(),
        figures.asleep.to_string(),
        figures.particles.to_string(),
        figures.constraint_count().to_string(),
        figures.kinetic.to_string(),
        figures.potential.to_string(),
        figures.elastic_sum().to_string(),
        figures.unresolved.to_string(),
        figures.energy().to_string(),
        px.to_string(),
        py.to_string(),
        pz.to_string(),
        lx.to_string(),
        ly.to_string(),
        lz.to_string(),
        optional(figures.volume_error),
        figures.residual.to_string(),
        figures.inverted.to_string(),
        optional(figures.contacts),
        optional(figures.smallest_gap),
        optional(figures.crossings),
    ]
}

/// The figure as text; empty if there is none.
fn optional(figure: Option<impl ToString>) -> String {
    figure.map_or_else(String::new, |figure| figure.to_string())
}

/// Writes rows to a file, with a header.
///
/// # Errors
/// [`OutputError`] with the file and the system's message.
pub fn write(path: &Path, history: &[Statistics]) -> Result<(), OutputError> {
    let text = text(history).map_err(|error| OutputError::new(path, error))?;
    file::replace(path, &text).map_err(|error| OutputError::new(path, error))
}

/// Rows as text, with a header.
///
/// # Errors
/// Of the CSV writer.
pub fn text(history: &[Statistics]) -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(COLUMNS)?;
    for figures in history {
        writer.write_record(row(figures))?;
    }
    Ok(writer.into_inner()?)
}

/// Creates a file with its header, for rows that are written one at a time.
///
/// # Errors
/// [`OutputError`] with the file and the system's message.
pub fn create(path: &Path) -> Result<csv::Writer<std::fs::File>, OutputError> {
    let mut writer = csv::Writer::from_path(path).map_err(|error| OutputError::new(path, error))?;
    writer
        .write_record(COLUMNS)
        .map_err(|error| OutputError::new(path, error))?;
    Ok(writer)
}
