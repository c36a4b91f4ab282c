//! The output folder of a run: `report.md`, a self-contained `report.html`, `torture.json`, and for
//! each row a filmstrip and the energies of its worst member.

use super::{
    SuiteRow, TortureError, filmstrip,
    run::{Crews, run_member},
    table,
};
use crate::output::{
    OutputError,
    document::{self, Block},
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
        std::fs::write(&path, text).map_err(|error| OutputError::new(&path, error))
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
    let mut last = "";
    for row in rows {
        if row.case.name != last {
            blocks.push(Block::Heading(2, row.case.title.to_owned()));
            blocks.push(Block::Text(row.case.about.to_owned()));
            last = row.case.name;
        }
        blocks.push(Block::Heading(3, heading(row)));
        let failures = table::failures(row);
        if !failures.is_empty() {
            let commands = failures.iter().map(|line| format!("`{line}`"));
            blocks.push(Block::List(commands.collect()));
        }
        let Some(worst) = row.worst() else { continue };
        let film = run_member(row.case, (worst.number, &worst.member), &crews, true)?;
        let caption = format!("Worst member: {} {}", worst.number, worst.member);
        let name = format!("{}_{}_{}", row.case.name, row.kind.name(), worst.number);
        let mut figure = |what: &str, svg: String| -> Result<(), TortureError> {
            let file = format!("{name}_{what}.svg");
            save(&file, &svg)?;
            let caption = format!("{caption}: {what}.");
            blocks.push(Block::Figure { file, caption, svg });
            Ok(())
        };
        if let Some(svg) = filmstrip::strip(&film) {
            figure("film", svg)?;
        }
        if let Some(watch) = &film.watch {
            let svg = filmstrip::energies(watch);
            let path = folder.join(format!("{name}_energy.svg"));
            figure(
                "energy",
                svg.map_err(|error| OutputError::new(&path, error))?,
            )?;
        }
    }
    save("report.md", &document::markdown(&blocks))?;
    save("report.html", &document::html("Robustness", &blocks))?;
    let text = serde_json::to_string_pretty(&table::json(rows));
    let text = text.map_err(|error| OutputError::new(&folder.join("torture.json"), error))?;
    Ok(save("torture.json", &text)?)
}

fn heading(row: &SuiteRow) -> String {
    let count = row.outcomes.len();
    format!(
        "{}: {count} members, {}",
        row.kind.name(),
        table::verdict(row)
    )
}
