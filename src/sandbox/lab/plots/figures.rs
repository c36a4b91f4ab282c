//! Figures over time: those of the status line and of the CSV, after each tick.

use crate::simulation::Statistics;
use std::collections::VecDeque;

/// Simulated time that is kept [s].
pub const SECONDS: f64 = 10.0;
/// Maximum number of ticks that are kept.
const MAX_TICKS: usize = 20_000;

/// Figures after a tick.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sample {
    /// Those of the simulation.
    pub statistics: Statistics,
    /// Frames per second of the window.
    pub frames_per_second: f64,
    /// Constraint projections per second, if there are any.
    pub projections: Option<f64>,
}

/// A figure that can be plotted.
#[derive(Debug, Clone, Copy)]
pub struct Figure {
    /// Name in commands, widget rectangles, and the CSV.
    pub name: &'static str,
    /// Title.
    pub title: &'static str,
    /// Unit in which it is shown; empty for a pure number.
    pub unit: &'static str,
    /// Its value in that unit, if there is one.
    pub value: fn(&Sample) -> Option<f64>,
}

const fn figure(
    name: &'static str,
    title: &'static str,
    unit: &'static str,
    value: fn(&Sample) -> Option<f64>,
) -> Figure {
    Figure {
        name,
        title,
        unit,
        value,
    }
}

/// All figures, in the order of the menu.
pub const FIGURES: [Figure; 21] = [
    // As in the status line: without what the unconverged solver does not hold.
    figure("held_energy_j", "Energy", "J", |it| {
        Some(it.statistics.energy() - it.statistics.unresolved)
    }),
    figure("unresolved_j", "Unresolved energy", "J", |it| {
        Some(it.statistics.unresolved)
    }),
    figure("kinetic_j", "Kinetic energy", "J", |it| {
        Some(it.statistics.kinetic)
    }),
    figure("potential_j", "Potential energy", "J", |it| {
        Some(it.statistics.potential)
    }),
    figure("elastic_j", "Elastic energy", "J", |it| {
        Some(it.statistics.elastic.values().sum())
    }),
    figure("volume_error_percent", "Volume error", "%", |it| {
        it.statistics.volume_error.map(|error| 100.0 * error)
    }),
    figure("residual", "Residual", "", |it| {
        Some(it.statistics.residual)
    }),
    figure("overpressure_pa", "Overpressure", "Pa", |it| {
        it.statistics.overpressure
    }),
    figure("momentum_kg_m_s", "Momentum", "kg·m/s", |it| {
        Some(length(it.statistics.momentum))
    }),
    figure(
        "angular_momentum_kg_m2_s",
        "Angular momentum",
        "kg·m²/s",
        |it| Some(length(it.statistics.angular_momentum)),
    ),
    figure("inverted", "Inverted elements", "", |it| {
        Some(it.statistics.inverted as f64)
    }),
    figure("contacts", "Contacts", "", |it| {
        it.statistics.contacts.map(|count| count as f64)
    }),
    figure("smallest_gap_mm", "Smallest gap", "mm", |it| {
        it.statistics.smallest_gap.map(|gap| 1e3 * gap)
    }),
    figure("crossings", "Crossings", "", |it| {
        it.statistics.crossings.map(|count| count as f64)
    }),
    figure("ms_per_tick", "Time per tick", "ms", |it| {
        Some(it.statistics.ms_per_tick)
    }),
    figure("frames_per_second", "Frame rate", "fps", |it| {
        Some(it.frames_per_second)
    }),
    figure("projections_m_per_s", "Projections", "M/s", |it| {
        it.projections.map(|count| count / 1e6)
    }),
    figure("bodies", "Bodies", "", |it| {
        Some(it.statistics.bodies as f64)
    }),
    figure("asleep", "Sleeping bodies", "", |it| {
        Some(it.statistics.asleep as f64)
    }),
    figure("particles", "Particles", "", |it| {
        Some(it.statistics.particles as f64)
    }),
    figure("constraints", "Constraints", "", |it| {
        Some(it.statistics.constraint_count() as f64)
    }),
];

fn length(vector: [f64; 3]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The figure of a name.
#[must_use]
pub fn find(name: &str) -> Option<&'static Figure> {
    FIGURES.iter().find(|figure| figure.name == name)
}

/// The last ticks, oldest first.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Track(VecDeque<Sample>);

impl Track {
    /// Adds a tick, and drops those that are older than [`SECONDS`]. Ticks that are later than the
    /// new one belong to a course of events that was undone, and are dropped too.
    pub fn push(&mut self, sample: Sample) {
        let now = &sample.statistics;
        while self
            .0
            .back()
            .is_some_and(|it| it.statistics.tick >= now.tick)
        {
            self.0.pop_back();
        }
        let is_old = |it: &Sample| it.statistics.time < now.time - SECONDS;
        while self.0.front().is_some_and(is_old) || self.0.len() >= MAX_TICKS {
            self.0.pop_front();
        }
        self.0.push_back(sample);
    }

    /// Removes all ticks.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// The ticks.
    pub fn samples(&self) -> impl ExactSizeIterator<Item = &Sample> {
        self.0.iter()
    }

    /// Time of the last tick [s].
    #[must_use]
    pub fn end(&self) -> Option<f64> {
        Some(self.0.back()?.statistics.time)
    }

    /// Points of a figure: time [s] and value. Ticks without a finite value are left out.
    #[must_use]
    pub fn points(&self, figure: &Figure) -> Vec<[f64; 2]> {
        let point = |sample: &Sample| {
            let value = (figure.value)(sample)?;
            value.is_finite().then_some([sample.statistics.time, value])
        };
        self.0.iter().filter_map(point).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(tick: u64) -> Sample {
        let statistics = Statistics {
            tick,
            time: tick as f64 / 60.0,
            kinetic: tick as f64,
            ..Statistics::default()
        };
        Sample {
            statistics,
            ..Sample::default()
        }
    }

    fn ticks(track: &Track) -> Vec<u64> {
        track.samples().map(|it| it.statistics.tick).collect()
    }

    #[test]
    fn the_last_ten_seconds_are_kept() {
        let mut track = Track::default();
        (0..2000).for_each(|tick| track.push(sample(tick)));
        let ticks = ticks(&track);
        // Rounding decides about the tick that is ten seconds old.
        assert!([1399, 1400].contains(&ticks[0]) && ticks.last() == Some(&1999));
    }

    #[test]
    fn what_was_undone_is_dropped() {
        let mut track = Track::default();
        (0..10).for_each(|tick| track.push(sample(tick)));
        track.push(sample(4));
        assert_eq!(ticks(&track), [0, 1, 2, 3, 4]);
    }

    #[test]
    fn a_figure_without_a_value_has_no_points() {
        let mut track = Track::default();
        track.push(sample(1));
        let points = |name| track.points(find(name).expect("a figure"));
        assert_eq!(points("contacts"), [[0.0; 2]; 0]);
        assert_eq!(points("kinetic_j"), [[1.0 / 60.0, 1.0]]);
    }

    #[test]
    fn every_figure_has_a_name_and_a_title_of_its_own() {
        for (n, one) in FIGURES.iter().enumerate() {
            for other in &FIGURES[..n] {
                assert_ne!((one.name, one.title), (other.name, other.title));
                assert!(one.name != other.name && one.title != other.title);
            }
        }
    }
}
