//! The tables, as Markdown.

use crate::{
    machine::Machine,
    measure::{Effort, Figures, Outcome},
    scenes::{NAMES, RATE, SUBSTEPS},
};
use serde::Serialize;
use std::fmt::Write;

/// A peer as it took part.
#[derive(Debug, Clone, Serialize)]
pub struct Participant {
    /// Its name.
    pub name: &'static str,
    /// Its version.
    pub version: String,
    /// Its settings.
    pub settings: &'static str,
    /// Whether it ran with more than one thread, too.
    pub parallel: bool,
}

/// A scene's size.
#[derive(Debug, Clone, Serialize)]
pub struct Size {
    /// Name of the scene.
    pub name: &'static str,
    /// Bodies.
    pub bodies: usize,
    /// Particles over all of them.
    pub particles: usize,
    /// Edges over all of them.
    pub edges: u64,
    /// Tetrahedra over all of them.
    pub tetrahedra: u64,
}

/// Everything that was found out.
#[derive(Debug, Clone, Serialize)]
pub struct Findings {
    /// Where.
    pub machine: Machine,
    /// How long.
    pub effort: Effort,
    /// Who.
    pub participants: Vec<Participant>,
    /// Who not, and why.
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
            "A tick is 1/{RATE} s in {SUBSTEPS} substeps of one sweep. Medians of {rounds} rounds \
             of {} ms, peers in turn, after {warm_up} ticks.\n",
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

    /// Pliant's rate over that of an outcome; Pliant with as many threads, or its best if it has
    /// not run with so many.
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

/// Three digits, as far as there are any.
fn rounded(value: f64) -> String {
    match value {
        v if v >= 100.0 => format!("{v:.0}"),
        v if v >= 10.0 => format!("{v:.1}"),
        v if v >= 1.0 => format!("{v:.2}"),
        v => format!("{v:.3}"),
    }
}
