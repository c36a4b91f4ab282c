//! Pliant and its peers on the same scenes, in one run.
//!
//! [`scenes`] makes the meshes, a [`peer`] builds and ticks them, [`measure`] times the peers in
//! turn, [`sanity`] rejects runs that diverged, [`table`] writes the results. [`accuracy`] finds
//! the least time to an error instead.

mod accuracy;
mod contact;
#[cfg(all(test, any(jolt, bullet, feature = "rapier")))]
mod formulas;
mod machine;
mod measure;
#[cfg(any(jolt, bullet))]
mod native;
mod peer;
mod peers;
mod process;
mod sanity;
mod scenes;
mod table;

use anyhow::{Context, bail};
use clap::Parser;
use contact::Touching;
use machine::Machine;
use measure::Effort;
use peer::Peer;
use std::{
    fs,
    path::{Path, PathBuf},
    time::Duration,
};
use table::{Findings, Participant, Size};

/// Measures Pliant and its peers on the same scenes.
///
/// Writes a Markdown table to the standard output, and progress messages to the standard error.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Measure only these peers besides Pliant, for example jolt,rapier
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    only: Vec<String>,
    /// Measure only these scenes, for example bunny,cloth64, or problems with --accuracy
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    rows: Vec<String>,
    /// Measure the scenes in which bodies touch: folds64 and pile27
    #[arg(long, conflicts_with_all = ["rows", "quick"])]
    contact: bool,
    /// Find the least time to an error of 10 %, 1 % and 0.1 % on bodies at rest
    #[arg(long, conflicts_with_all = ["contact", "threads"])]
    accuracy: bool,
    /// Measure fewer and shorter rounds
    #[arg(long)]
    quick: bool,
    /// Number of rounds [default: 9, or 3 with --quick]
    #[arg(long)]
    rounds: Option<u32>,
    /// With --accuracy, most expensive setting that is tried, in milliseconds per simulated second; the processor time
    /// of each search for rest changes in proportion [default: 160, or 60 with --quick]
    #[arg(long, value_name = "MS", requires = "accuracy", value_parser = milliseconds)]
    limit: Option<f64>,
    /// Number of threads in the second column [default: all of the machine]
    #[arg(long)]
    threads: Option<usize>,
    /// Also run Newton, with this Python, in which it must be installed
    #[arg(long, value_name = "PYTHON", num_args = 0..=1, default_missing_value = "python3")]
    newton: Option<PathBuf>,
    /// Also write the table to this file
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Also write all measurements to this file, as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// With --accuracy, also draw the work–precision diagrams to this file, as SVG
    #[arg(long, value_name = "FILE", requires = "accuracy")]
    svg: Option<PathBuf>,
    /// With --accuracy, also replace the table between the markers of this Markdown file
    #[arg(long, value_name = "FILE", requires = "accuracy")]
    splice: Option<PathBuf>,
}

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    let (mut peers, left_out) = peers::all(arguments.newton.as_deref());
    for sentence in &left_out {
        eprintln!("{sentence}");
    }
    keep(&mut peers, &arguments.only)?;
    if arguments.accuracy {
        return measure_accuracy(&arguments, &peers, left_out);
    }
    let rows = rows(&arguments.rows, &scenes::NAMES)?;
    let mut machine = Machine::look();
    machine.threads = arguments.threads.unwrap_or(machine.threads).max(1);
    let mut effort = if arguments.quick {
        Effort {
            warm_up: 10,
            rounds: 3,
            slice: Duration::from_millis(60),
            budget: Duration::from_secs(4),
        }
    } else {
        Effort {
            warm_up: 10,
            rounds: 9,
            slice: Duration::from_millis(250),
            budget: Duration::from_secs(20),
        }
    };
    effort.rounds = arguments.rounds.unwrap_or(effort.rounds).max(1);

    if arguments.contact {
        let rounds = arguments.rounds.unwrap_or(CONTACT_ROUNDS).max(1);
        let outcomes = measure_contact(&peers, machine.threads, rounds)?;
        let Machine { cpu, os, rustc, .. } = &machine;
        let table = format!("{cpu}; {os}; {rustc}.\n{}", contact::markdown(&outcomes)?);
        return write_results(&arguments, &table, &outcomes);
    }
    let (mut sizes, mut outcomes) = (Vec::new(), Vec::new());
    for name in rows {
        let scene = scenes::build(name).with_context(|| format!("scene {name}"))?;
        eprintln!(
            "{name}: {} particles, {} edges, {} tetrahedra",
            scene.particles(),
            scene.edges(),
            scene.tetrahedra()
        );
        sizes.push(Size {
            name: scene.name,
            bodies: scene.offsets.len(),
            particles: scene.particles(),
            edges: scene.edges(),
            tetrahedra: scene.tetrahedra(),
        });
        outcomes.extend(measure::measure(&scene, &peers, machine.threads, &effort));
    }
    let participants = peers
        .iter()
        .map(|peer| participant(peer.as_ref()))
        .collect();
    let findings = Findings {
        machine,
        effort,
        participants,
        left_out,
        sizes,
        outcomes,
    };
    let table = findings.markdown()?;
    write_results(&arguments, &table, &findings)
}

/// Prints the table, and writes it and the measurements to the requested files.
fn write_results(
    arguments: &Arguments,
    table: &str,
    measurements: &impl serde::Serialize,
) -> anyhow::Result<()> {
    print!("{table}");
    if let Some(file) = &arguments.out {
        fs::write(file, table).with_context(|| format!("writing {}", file.display()))?;
    }
    if let Some(file) = &arguments.json {
        let json = serde_json::to_string_pretty(measurements)?;
        fs::write(file, json).with_context(|| format!("writing {}", file.display()))?;
    }
    Ok(())
}

/// Finds the least time to an error, and writes it.
fn measure_accuracy(
    arguments: &Arguments,
    peers: &[Box<dyn Peer>],
    left_out: Vec<String>,
) -> anyhow::Result<()> {
    let names = rows(&arguments.rows, &accuracy::problems::NAMES)?;
    let mut effort = accuracy::effort(arguments.quick);
    effort.rounds = arguments.rounds.unwrap_or(effort.rounds).max(1);
    if let Some(limit) = arguments.limit {
        effort = effort.with_limit(limit);
    }
    // Before minutes of measurement, not after them.
    let document = arguments.splice.as_deref().map(spliced).transpose()?;
    let _only_thread = one_thread()?;
    let newton = arguments.newton.as_deref();
    let findings = accuracy::measure(&names, peers, newton, left_out, Machine::look(), effort)?;
    let table = findings.markdown()?;
    write_results(arguments, &table, &findings)?;
    if let (Some(file), Some(text)) = (&arguments.splice, document) {
        let text = accuracy::splice(&text, &table).unwrap_or(text);
        fs::write(file, text).with_context(|| format!("writing {}", file.display()))?;
    }
    if let Some(file) = &arguments.svg {
        fs::write(file, findings.diagram()?)
            .with_context(|| format!("writing {}", file.display()))?;
    }
    Ok(())
}

/// A file with the markers of the table.
fn spliced(file: &Path) -> anyhow::Result<String> {
    let text = fs::read_to_string(file).with_context(|| format!("reading {}", file.display()))?;
    accuracy::splice(&text, "")
        .with_context(|| format!("{} has no markers of this table", file.display()))?;
    Ok(text)
}

/// Makes this thread the only one of a pool, in which peers that use Rayon run, as long as it is kept:
/// handing each tick to another thread would cost them more than a small body does.
fn one_thread() -> anyhow::Result<rayon::ThreadPool> {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(1);
    let pool = builder.use_current_thread().build();
    pool.context("starting a pool of one thread")
}

/// A positive time [ms] of up to an hour.
fn milliseconds(text: &str) -> Result<f64, String> {
    let most = 3.6e6;
    let number = text.parse().ok();
    number
        .filter(|ms: &f64| *ms > 0.0 && *ms <= most)
        .ok_or_else(|| format!("expected a number above 0 and up to {most}"))
}

/// Default number of rounds of scenes in which bodies touch, each a run of some seconds.
const CONTACT_ROUNDS: u32 = 3;

fn measure_contact(
    peers: &[Box<dyn Peer>],
    threads: usize,
    rounds: u32,
) -> anyhow::Result<Vec<Touching>> {
    let mut all = Vec::new();
    for name in scenes::CONTACT {
        let scene = scenes::build(name).with_context(|| format!("scene {name}"))?;
        eprintln!("{name}: {} particles", scene.particles());
        all.extend(contact::measure(&scene, peers, threads, rounds));
    }
    Ok(all)
}

fn participant(peer: &dyn Peer) -> Participant {
    Participant {
        name: peer.name(),
        version: peer.version(),
        settings: peer.settings(),
        parallel: peer.is_parallel(),
    }
}

/// Keeps Pliant and the named peers; all if none is named.
fn keep(peers: &mut Vec<Box<dyn Peer>>, names: &[String]) -> anyhow::Result<()> {
    let is = |peer: &dyn Peer, name: &String| {
        peer.name().eq_ignore_ascii_case(name)
            || peer.name().replace(' ', "-").eq_ignore_ascii_case(name)
    };
    for name in names {
        if !peers.iter().any(|peer| is(peer.as_ref(), name)) {
            let known: Vec<_> = peers.iter().map(|peer| peer.name()).collect();
            bail!(
                "no peer is called {name}; this build has {}",
                known.join(", ")
            );
        }
    }
    peers.retain(|peer| {
        names.is_empty()
            || peer.name() == "Pliant"
            || names.iter().any(|name| is(peer.as_ref(), name))
    });
    Ok(())
}

/// The named ones of all scenes, in their order; all if none is named.
fn rows(names: &[String], all: &[&'static str]) -> anyhow::Result<Vec<&'static str>> {
    for name in names {
        if !all.contains(&name.as_str()) {
            bail!("no scene is called {name}; there are {}", all.join(", "));
        }
    }
    let is_named = |scene: &&str| names.is_empty() || names.iter().any(|name| name == scene);
    Ok(all.iter().copied().filter(is_named).collect())
}
