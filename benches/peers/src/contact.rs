//! Scenes in which bodies touch: time per tick, and the quality of contact beside it.
//!
//! Time without quality means nothing here: an engine that lets surfaces pass through each other has
//! less to compute. The crossings of surfaces are counted in all peers by the same exact test of
//! Pliant, after every tick of the first round.

use crate::{
    measure::Spread,
    peer::{Peer, PeerError},
    peers::CrossingCounter,
    sanity::strain,
    scenes::Scene,
};
use serde::Serialize;
use std::{fmt::Write, time::Instant};

/// Ticks of a run: 2 s.
const TICKS: u32 = 120;

/// A run ends earlier after this time [s].
const BUDGET: f64 = 60.0;

/// Outcome of one scene in one peer, with a number of threads.
#[derive(Debug, Clone, Serialize)]
pub struct Touching {
    /// Name of the scene.
    pub scene: &'static str,
    /// Name of the peer.
    pub peer: &'static str,
    /// Number of threads.
    pub threads: usize,
    /// Contact thickness [m].
    pub thickness: Option<f32>,
    /// The figures, or the reason why there are none.
    pub figures: Result<Figures, String>,
}

/// The figures of the runs.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Figures {
    /// Mean time of a tick [ms], over the rounds.
    pub tick: Spread,
    /// Number of ticks that were run.
    pub ticks: u32,
    /// Number of ticks after which surfaces crossed.
    pub crossed_ticks: u32,
    /// Maximum number of crossings after a tick.
    pub max_crossings: usize,
    /// Crossings after the last tick.
    pub last_crossings: usize,
    /// Root mean square strain of the edges after the last tick.
    pub edge_strain: f64,
    /// Height of the lowest particle after the last tick [m]; the floor is at 0.
    pub lowest: f32,
}

/// Runs a scene in all peers that have contact, in turn, in some rounds.
pub fn measure(
    scene: &Scene,
    peers: &[Box<dyn Peer>],
    all_threads: usize,
    rounds: u32,
) -> Vec<Touching> {
    let mut all = Vec::new();
    let peers = peers.iter().map(Box::as_ref);
    for peer in peers.filter(|peer| peer.has_contact()) {
        for threads in [1, all_threads] {
            all.push((peer, threads, Ok((Figures::default(), Vec::new()))));
        }
    }
    for round in 0..rounds {
        for (peer, threads, outcome) in &mut all {
            if let Ok((figures, ticks)) = outcome {
                let first = (round == 0).then_some(figures);
                match run(scene, *peer, *threads, first) {
                    Ok(milliseconds) => ticks.push(milliseconds),
                    Err(reason) => *outcome = Err(reason),
                }
            }
        }
    }
    let finish = |(peer, threads, outcome): (&dyn Peer, usize, Result<_, String>)| Touching {
        scene: scene.name,
        peer: peer.name(),
        threads,
        thickness: scene.thickness,
        figures: outcome.map(|(figures, ticks): (Figures, Vec<f64>)| Figures {
            tick: Spread::of(&ticks),
            ..figures
        }),
    };
    all.into_iter().map(finish).collect()
}

/// Mean time of a tick [ms]; examines every tick where figures are requested.
fn run(
    scene: &Scene,
    peer: &dyn Peer,
    threads: usize,
    mut figures: Option<&mut Figures>,
) -> Result<f64, String> {
    let failed = |error: PeerError| error.to_string();
    let mut run = peer.build(scene, threads).map_err(failed)?;
    let mut counter = CrossingCounter::new(scene).map_err(failed)?;
    let mut seconds = 0.0;
    let mut ticks = 0;
    while ticks < TICKS && seconds < BUDGET {
        ticks += 1;
        let start = Instant::now();
        run.tick().map_err(failed)?;
        seconds += start.elapsed().as_secs_f64();
        let Some(figures) = figures.as_deref_mut() else {
            continue;
        };
        let positions = run.report().map_err(failed)?.positions;
        if positions.len() != scene.particles() || !positions.iter().all(|x| x.is_finite()) {
            return Err("not finite".into());
        }
        let crossings = counter.count(&positions);
        figures.ticks = ticks;
        figures.crossed_ticks += u32::from(crossings > 0);
        figures.max_crossings = figures.max_crossings.max(crossings);
        figures.last_crossings = crossings;
        figures.edge_strain = strain(scene, &positions);
        let heights = positions.iter().map(|x| x.y);
        figures.lowest = heights.fold(f32::INFINITY, f32::min);
    }
    eprintln!(
        "  {}, threads: {threads}, {ticks} ticks in {seconds:.1} s",
        peer.name()
    );
    Ok(seconds * 1e3 / f64::from(ticks))
}

/// The table.
///
/// # Errors
/// None in practice: writing to a string does not fail.
pub fn markdown(all: &[Touching]) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    writeln!(
        text,
        "\n**Bodies that touch**: {TICKS} ticks from the start, or as many as take {BUDGET} s; mean milliseconds per tick; ticks after \
         which surfaces crossed, maximum and last number of crossings:\n\n\
         | scene | peer | threads | ms a tick | ticks with crossings | maximum | last | strain of edges \
         (RMS) | lowest particle |\n|---|---|---|---|---|---|---|---|---|"
    )?;
    for it in all {
        write!(text, "| {} | {} | {} |", it.scene, it.peer, it.threads)?;
        match &it.figures {
            Ok(f) => writeln!(
                text,
                " {:.2} ({:.2}..{:.2}) | {} of {} | {} | {} | {:.2} % | {:.1} mm |",
                f.tick.median,
                f.tick.least,
                f.tick.most,
                f.crossed_ticks,
                f.ticks,
                f.max_crossings,
                f.last_crossings,
                f.edge_strain * 100.0,
                f.lowest * 1e3
            )?,
            Err(reason) => writeln!(text, " {reason} | | | | | |")?,
        }
    }
    Ok(text)
}
