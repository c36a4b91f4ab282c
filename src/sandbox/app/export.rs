//! Export of the plots: CSV and SVG files in the [folder for pictures](super::pictures).

use super::pictures;
use crate::{
    output::{OutputError, series::Multiples},
    sandbox::{lab::plots::Plots, ui::message::Notices},
    scene::CurrentScene,
    simulation::SimulationClock,
};
use bevy::prelude::*;
use std::path::{Path, PathBuf};

/// Writes the chosen figures over time, and the force–displacement curve, and says where.
pub fn plots(world: &mut World) {
    let scene = world.get_resource::<CurrentScene>();
    let (name, title) = scene.map_or_else(
        || ("pliant".to_owned(), "Pliant".to_owned()),
        |scene| (scene.name.clone(), scene.scene.title.clone()),
    );
    let time = world.resource::<SimulationClock>().time();
    let plots = world.resource::<Plots>();
    let figures = plots.multiples(&title).map(|it| (name.clone(), it));
    let force = plots
        .force_curve(&title)
        .map(|it| (format!("{name}-force"), it));
    let files: Vec<_> = figures.into_iter().chain(force).collect();
    let written = pictures::folder().and_then(|folder| write_all(&folder, &files, time));
    let mut notices = world.resource_mut::<Notices>();
    match written {
        Ok(written) if written.is_empty() => {
            notices.info("Nothing to export: choose a figure, or drag a body");
        }
        Ok(written) => {
            let names: Vec<_> = written
                .iter()
                .filter_map(|path| Some(path.file_name()?.to_string_lossy()))
                .collect();
            let folder = written[0].parent().unwrap_or(Path::new(""));
            let text = format!("Saved {} in {}", names.join(", "), folder.display());
            notices.info(text);
        }
        Err(error) => notices.error(format!("Cannot export the plots: {error}")),
    }
}

fn write_all(
    folder: &Path,
    files: &[(String, Multiples)],
    time: f64,
) -> Result<Vec<PathBuf>, String> {
    let mut written = Vec::new();
    for (name, multiples) in files {
        for extension in ["csv", "svg"] {
            let path = pictures::free_file(folder, name, time, extension);
            let done = match extension {
                "csv" => multiples.write_csv(&path),
                _ => multiples.write_svg(&path),
            };
            done.map_err(|error: OutputError| error.to_string())?;
            written.push(path);
        }
    }
    Ok(written)
}
