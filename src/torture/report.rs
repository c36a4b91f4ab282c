//! The output folder of a run: `report.md`, a self-contained `report.html`, `torture.json`, and for
//! each row a filmstrip and the energies of its worst member.

use super::{
    SuiteRow, TortureError, filmstrip, html,
    run::{Crews, run_member},
    table,
};
use crate::{
    file,
    output::{
        self, OutputError,
        document::{self, Block},
    },
};
use std::path::Path;

/// Runs the worst member of each row again with pictures, and writes all files.
///
/// # Errors
/// [`TortureError::Output`] with the file and the system's message.
pub fn write(folder: &Path, rows: &[SuiteRow]) -> Result<(), TortureError> {
    std::fs::create_dir_all(folder).map_err(|error| OutputError::new(folder, error))?;
    let save = |name: &str, text: &str| -> Result<(), OutputError> {
        let path = folder.join(name);
        file::replace(&path, text.as_bytes()).map_err(|error| OutputError::new(&path, error))
    };
    let mut blocks = vec![
        Block::Heading(1, "Robustness".to_owned()),
        Block::Text(table::summary(rows)),
        Block::table(
            "",
            &table::HEAD,
            rows.iter().map(|row| table::cells(row).to_vec()).collect(),
        ),
        Block::List(table::expected_failures(rows)),
        Block::List(table::slowest(rows).into_iter().collect()),
    ];
    let crews = Crews::start()?;
    let mut figures = Vec::new();
    let mut last = "";
    for row in rows {
        if row.case.name != last {
            blocks.push(Block::Heading(2, row.case.title.to_owned()));
            blocks.push(Block::Text(row.case.about.to_owned()));
            last = row.case.name;
        }
        blocks.push(Block::Heading(3, table::heading(row)));
        let failures = table::failures(row);
        if !failures.is_empty() {
            let commands = failures.iter().map(|line| format!("`{line}`"));
            blocks.push(Block::List(commands.collect()));
        }
        let pictures = pictures(folder, row, &crews)?;
        for picture in &pictures {
            if let Block::Figure { file, svg, .. } = picture {
                save(file, svg)?;
            }
        }
        blocks.extend(pictures.iter().cloned());
        figures.push(pictures);
    }
    save("report.md", &document::markdown(&blocks))?;
    save(
        "report.html",
        &output::page::html(&html::page(rows, &figures)),
    )?;
    let text = serde_json::to_string_pretty(&table::json(rows));
    let text = text.map_err(|error| OutputError::new(&folder.join("torture.json"), error))?;
    Ok(save("torture.json", &text)?)
}

/// The filmstrip and the energies of the worst member of a row.
fn pictures(folder: &Path, row: &SuiteRow, crews: &Crews) -> Result<Vec<Block>, TortureError> {
    let Some(worst) = row.worst() else {
        return Ok(Vec::new());
    };
    let film = run_member(row.case, (worst.number, &worst.member), crews, true)?;
    let figure = |what: &str, svg: String| Block::Figure {
        file: format!(
            "{}_{}_{}_{what}.svg",
            row.case.name,
            row.kind.name(),
            worst.number
        ),
        caption: format!("Worst member: {} {}: {what}.", worst.number, worst.member),
        svg,
    };
    let mut pictures: Vec<Block> = filmstrip::strip(&film)
        .map(|svg| figure("film", svg))
        .into_iter()
        .collect();
    if let Some(watch) = &film.watch {
        let svg = filmstrip::energies(watch).map_err(|error| OutputError::new(folder, error))?;
        pictures.push(figure("energy", svg));
    }
    Ok(pictures)
}
