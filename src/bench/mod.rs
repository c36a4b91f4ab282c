//! Throughput of the solver on this machine, and the limits of the hardware.
//!
//! Every body of [`Case`] is stepped on one thread and on all threads, in turn with the
//! measurements of memory and arithmetic in [`Roofline`], round by round, so that other load on the
//! machine affects all figures equally. A [`Report`] holds medians with their spread, as a table
//! and as JSON; [`plot`] draws it.
//!
//! Only the plain [`World`](crate::solver::World) is measured, without Bevy. Figures are wall-clock
//! times, so no two reports are equal.

mod cases;
mod growth;
mod loading;
mod measure;
mod options;
pub mod plot;
mod report;
mod roofline;
mod steps;

pub use cases::{Case, Elastic, Shape};
pub use growth::GrowthRow;
pub use loading::Loading;
pub use measure::Spread;
pub use options::{BenchError, Options};
pub use report::{BenchRow, Report, Stepped};
pub use roofline::Roofline;

use crate::solver::{Threads, ThreadsError};
use growth::Growing;
use measure::Probe;
use roofline::{Arithmetic, Memory};
use std::collections::BTreeMap;
use steps::Steps;

/// Runs the measurement; `progress` receives the completed fraction, from 0 to 1.
///
/// # Errors
/// [`BenchError`] before anything is measured.
pub fn run(options: &Options, mut progress: impl FnMut(f64)) -> Result<Report, BenchError> {
    let crews = crews(options.threads)?;
    let counts: Vec<usize> = crews.iter().map(Threads::count).collect();
    let mut topologies = BTreeMap::new();
    let mut steps = Vec::new();
    for case in chosen(&options.only)? {
        let topology = case.shape.topology(&mut topologies)?;
        steps.push(Steps::new(case, topology, &crews));
    }
    let loading = options.loading.then(Loading::measure).transpose()?;
    let mut blocks = match options.growth {
        true => Growing::all(&crews)?,
        false => Vec::new(),
    };
    let mut memory: Vec<Memory> = roofline::sizes(options.largest)
        .map(|bytes| Memory::new(bytes, &counts))
        .collect();
    let mut arithmetic = Arithmetic::new(&counts);

    let mut probes: Vec<&mut dyn Probe> = Vec::new();
    probes.extend(steps.iter_mut().map(|probe| probe as &mut dyn Probe));
    probes.extend(blocks.iter_mut().map(|probe| probe as &mut dyn Probe));
    probes.extend(memory.iter_mut().map(|probe| probe as &mut dyn Probe));
    probes.push(&mut arithmetic);
    let mut figures = measure::in_turn(&mut probes, options, &mut progress).into_iter();

    let stepped: Vec<_> = figures.by_ref().take(steps.len()).collect();
    let grown: Vec<_> = figures.by_ref().take(blocks.len()).collect();
    let remembered: Vec<_> = figures.by_ref().take(memory.len()).collect();
    let calculated: Vec<Spread> = figures.flatten().collect();
    let roofline = Roofline::new(options.largest, &counts, &remembered, &calculated);
    let rows = steps
        .iter()
        .zip(stepped)
        .map(|(steps, figures)| BenchRow::new(steps, &figures, &roofline))
        .collect();
    Ok(Report {
        options: options.clone(),
        threads: counts,
        instructions: crate::solver::Instructions::default().name(),
        roofline,
        rows,
        growth: blocks
            .iter()
            .zip(grown)
            .map(|(block, figures)| block.row(&figures))
            .collect(),
        loading,
    })
}

/// One thread; and all threads if there are several.
fn crews(threads: usize) -> Result<Vec<Threads>, ThreadsError> {
    let (one, all) = (Threads::new(1)?, Threads::new(threads)?);
    Ok(if all.count() > 1 {
        vec![one, all]
    } else {
        vec![one]
    })
}

fn chosen(only: &str) -> Result<Vec<Case>, BenchError> {
    let (chosen, others): (Vec<_>, Vec<_>) = Case::all()
        .into_iter()
        .partition(|case| case.name().contains(only));
    if chosen.is_empty() {
        return Err(BenchError::NoCase {
            only: only.to_owned(),
            names: others.iter().map(Case::name).collect(),
        });
    }
    Ok(chosen)
}
