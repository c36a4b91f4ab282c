//! The tables, as Markdown.

use crate::{
    machine::Machine,
    measure::{Effort, Figures, Outcome},
    scenes::{NAMES, RATE, SUBSTEPS},
};
use serde::Serialize;
use std::fmt::Write;

/// A measured peer.
#[derive(Debug, Clone, Serialize)]
pub struct Participant {
    /// Name.
    pub name: &'static str,
    /// Version.
    pub version: String,
    /// Settings.
    pub settings: &'static str,
    /// Whether it was also measured with more than one thread.
    pub parallel: bool,
}

/// Size of a scene.
#[derive(Debug, Clone, Serialize)]
pub struct Size {
    /// Name of the scene.
    pub name: &'static str,
    /// Number of bodies.
    pub bodies: usize,
    /// Particles of all bodies.
    pub particles: usize,
    /// Edges of all bodies.
    pub edges: u64,
    /// Tetrahedra of all bodies.
    pub tetrahedra: u64,
}

/// Results of all measurements.
#[derive(Debug, Clone, Serialize)]
pub struct Findings {
    /// The machine.
    pub machine: Machine,
    /// Duration of the measurement.
    pub effort: Effort,
    /// The measured peers.
    pub participants: Vec<Participant>,
    /// Peers that were left out, with the reasons.
    pub left_out: Vec<String>,
    /// The scenes.
    pub sizes: Vec<Size>,
    /// The figures.
    pub outcomes: Vec<Outcome>,
}

impl Findings {
    /// The tables.
    ///
    /// # Errors
    /// None in practice: writing to a string does not fail.
    pub fn markdown(&self) -> Result<String, std::fmt::Error> {
        let mut text = String::new();
        self.heading(&mut text)?;
        let threads = self.machine.threads;
        writeln!(
            text,
            "\n**Million constraint projections a second**, one thread / {threads} threads:\n"
        )?;
        self.grid(&mut text, &|_, f| rounded(f.rate.median))?;
        writeln!(
            text,
            "\n**How many times as fast Pliant is**, by those figures:\n"
        )?;
        self.grid(&mut text, &|outcome, f| {
            self.ratio(outcome, f)
                .map_or_else(|| "–".into(), |ratio| format!("{ratio:.1}×"))
        })?;
        writeln!(
            text,
            "\n**Milliseconds a tick** of {SUBSTEPS} substeps, one thread / {threads} threads:\n"
        )?;
        self.grid(&mut text, &|_, f| rounded(f.tick.median))?;
        self.details(&mut text)?;
        Ok(text)
    }

    fn heading(&self, text: &mut String) -> std::fmt::Result {
        let Machine {
            cpu,
            threads,
            os,
            rustc,
        } = &self.machine;
        let Effort {
            warm_up,
            rounds,
            slice,
            ..
        } = self.effort;
        writeln!(text, "{cpu}, {threads} threads; {os}; {rustc}.\n")?;
        writeln!(
            text,
            "A tick is 1/{RATE} s in {SUBSTEPS} substeps of one iteration. Medians of {rounds} \
             rounds of {} ms, peers in turn, after {warm_up} ticks.\n",
            slice.as_millis()
        )?;
        for peer in &self.participants {
            writeln!(
                text,
                "- **{}** {}: {}",
                peer.name, peer.version, peer.settings
            )?;
        }
        for sentence in &self.left_out {
            writeln!(text, "- {sentence}")?;
        }
        writeln!(
            text,
            "\n| scene | bodies | particles | edges | tetrahedra |\n|---|---|---|---|---|"
        )?;
        for size in &self.sizes {
            writeln!(
                text,
                "| {} | {} | {} | {} | {} |",
                size.name, size.bodies, size.particles, size.edges, size.tetrahedra
            )?;
        }
        Ok(())
    }

    /// A table with a row for each scene and a column for each peer.
    fn grid(
        &self,
        text: &mut String,
        cell: &dyn Fn(&Outcome, &Figures) -> String,
    ) -> std::fmt::Result {
        write!(text, "| scene |")?;
        for peer in &self.participants {
            write!(text, " {} |", peer.name)?;
        }
        writeln!(text, "\n|---|{}", "---|".repeat(self.participants.len()))?;
        for scene in NAMES {
            let row: Vec<_> = self.outcomes.iter().filter(|o| o.scene == scene).collect();
            if row.is_empty() {
                continue;
            }
            write!(text, "| {scene} |")?;
            for peer in &self.participants {
                let cells: Vec<_> = row
                    .iter()
                    .filter(|outcome| outcome.peer == peer.name)
                    .map(|outcome| match &outcome.figures {
                        Ok(figures) => cell(outcome, figures),
                        Err(_) => "diverged".into(),
                    })
                    .collect();
                write!(text, " {} |", cells.join(" / "))?;
            }
            writeln!(text)?;
        }
        Ok(())
    }

    /// Rate of Pliant over that of an outcome, with the same number of threads, or with one if
    /// Pliant was not measured with that number.
    fn ratio(&self, outcome: &Outcome, figures: &Figures) -> Option<f64> {
        let pliant = |threads: usize| {
            self.outcomes
                .iter()
                .find(|o| o.scene == outcome.scene && o.peer == "Pliant" && o.threads == threads)
                .and_then(|o| o.figures.as_ref().ok())
        };
        let own = pliant(outcome.threads).or_else(|| pliant(1))?;
        Some(own.rate.median / figures.rate.median)
    }

    fn details(&self, text: &mut String) -> std::fmt::Result {
        writeln!(
            text,
            "\n| scene | peer | threads | million projections a second | ms a tick | constraints | \
             strain of edges, volumes (RMS) |\n|---|---|---|---|---|---|---|"
        )?;
        for outcome in &self.outcomes {
            let Outcome {
                scene,
                peer,
                threads,
                figures,
            } = outcome;
            write!(text, "| {scene} | {peer} | {threads} |")?;
            match figures {
                Ok(f) => writeln!(
                    text,
                    " {} ({}..{}) | {} | {} | {:.2} %, {:.2} % after {} ticks |",
                    rounded(f.rate.median),
                    rounded(f.rate.least),
                    rounded(f.rate.most),
                    rounded(f.tick.median),
                    f.counts.projections(),
                    f.residual.edge_strain * 100.0,
                    f.residual.volume_strain * 100.0,
                    f.residual_after
                )?,
                Err(reason) => writeln!(text, " diverged: {reason} | | | |")?,
            }
        }
        Ok(())
    }
}

/// A number with three significant digits, or three decimals below 1.
fn rounded(value: f64) -> String {
    match value {
        v if v >= 100.0 => format!("{v:.0}"),
        v if v >= 10.0 => format!("{v:.1}"),
        v if v >= 1.0 => format!("{v:.2}"),
        v => format!("{v:.3}"),
    }
}
