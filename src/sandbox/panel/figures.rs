//! The figures of the head-up line, with their tooltips.
//!
//! They are those of [`Statistics`], the same as in the CSV; the frame rate and the projections per
//! second are measured by the window.

use super::model::StoredEnergy;
use crate::{
    sandbox::ui::{count, format},
    simulation::Statistics,
};

/// A figure of the line.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Figure {
    /// The number with its unit.
    pub value: String,
    /// Label.
    pub name: &'static str,
    /// Whether it indicates a problem.
    pub alarm: bool,
    /// Heading of the tooltip.
    pub title: &'static str,
    /// The tooltip: what it measures.
    pub help: String,
    /// What it consists of, with values.
    pub parts: Vec<(&'static str, String)>,
}

/// The figures of the line, in order. The frame rate is `None` while the window is drawn only on
/// demand; `projections` are per second.
#[must_use]
pub fn figures(
    frames_per_second: Option<f32>,
    statistics: &Statistics,
    projections: Option<f64>,
) -> Vec<Figure> {
    let figure = |value: String, name, title, help: &str| Figure {
        value,
        name,
        title,
        help: help.to_owned(),
        ..Figure::default()
    };
    let by_effect = statistics.constraints.iter();
    vec![
        figure(
            frames_per_second.map_or_else(|| "idle".to_owned(), |rate| format!("{rate:.0} fps")),
            "frame rate",
            "Frame rate",
            "Frames drawn per second. While nothing moves, the window is drawn only on demand.",
        ),
        figure(
            format!("{:.2} ms", statistics.ms_per_tick),
            "per tick",
            "Time per tick",
            "Real time of the solver in a tick, without the ECS and without statistics: the \
             median of the last 60 ticks. It keeps up with real time while this is less than the simulated time of a tick.",
        ),
        figure(
            count(statistics.particles),
            "particles",
            "Particles",
            "Simulated points of all bodies, including sleeping ones.",
        ),
        Figure {
            parts: by_effect
                .map(|(effect, elements)| (*effect, count(*elements)))
                .collect(),
            ..figure(
                count(statistics.constraint_count()),
                "constraints",
                "Constraints",
                "Constraints of all effects, without contacts.",
            )
        },
        figure(
            millions(projections),
            "projections",
            "Projections per second",
            "Constraint projections per second of solver time: every constraint of every effect in \
             every iteration, and every contact in every contact pass. None while all bodies sleep.",
        ),
        energy(statistics.into()),
        figure(
            statistics
                .volume_error
                .map_or_else(|| "–".to_owned(), percent),
            "volume error",
            "Volume error",
            "Largest relative change of the volume of a body from its rest volume. A shell with \
             pressure has none: it is inflated on purpose.",
        ),
        Figure {
            alarm: !statistics.finite,
            ..figure(
                format(statistics.residual, 2),
                "residual",
                "Residual",
                "Root mean square of C + αλ/h² over all constraints, relative to rest lengths and \
                 volumes: the distance from a converged solve.",
            )
        },
    ]
}

/// The energy of all bodies.
fn energy(stored: StoredEnergy) -> Figure {
    let parts = [
        ("Kinetic", stored.kinetic),
        ("Potential (0 at height 0)", stored.potential),
        ("Elastic", stored.elastic),
        ("Unresolved", stored.unresolved),
    ];
    let mut help = "Kinetic, potential and elastic energy of all bodies.".to_owned();
    if stored.is_unresolved() {
        help.push_str(" * ");
        help.push_str(UNRESOLVED);
    }
    Figure {
        value: prefixed(stored.sum(), "J"),
        // The star marks that it is not the energy of the requested material.
        name: if stored.is_unresolved() {
            "energy *"
        } else {
            "energy"
        },
        title: "Energy",
        help,
        parts: parts
            .map(|(part, value)| (part, prefixed(value, "J")))
            .into(),
        ..Figure::default()
    }
}

/// What the unresolved part of the energy is.
pub(super) const UNRESOLVED: &str = "Unresolved: what the requested material would store at the current \
     strain beyond the elastic energy, because the unconverged solver holds a softer one. It is not \
     part of the sum. More substeps or iterations reduce it.";

/// Projections per second in millions; a dash if there are none, which keeps the layout.
pub fn millions(projections: Option<f64>) -> String {
    projections.map_or_else(
        || "–".to_owned(),
        |projections| format!("{} M/s", format(projections / 1e6, 3)),
    )
}

/// A quantity with three digits and an SI prefix: `1.25 mJ`.
pub(super) fn prefixed(value: f64, unit: &str) -> String {
    const PREFIXES: [(f64, &str); 7] = [
        (1e9, "G"),
        (1e6, "M"),
        (1e3, "k"),
        (1.0, ""),
        (1e-3, "m"),
        (1e-6, "µ"),
        (1e-9, "n"),
    ];
    let size = value.abs();
    match PREFIXES.iter().find(|(factor, _)| size >= *factor) {
        Some((factor, prefix)) => format!("{} {prefix}{unit}", format(value / factor, 3)),
        None => format!("0 {unit}"),
    }
}

/// A ratio in per cent with its sign, to 0.01 %.
fn percent(ratio: f64) -> String {
    let percent = ratio * 100.0;
    if percent.abs() < 0.005 {
        "0 %".to_owned()
    } else {
        format!("{percent:+.2} %")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_has_the_eight_figures_with_their_units_and_tooltips() {
        let statistics = Statistics {
            ms_per_tick: 1.236,
            particles: 12_288,
            constraints: [("stretch", 1200), ("volume", 34)].into(),
            kinetic: 12.0,
            potential: 0.345,
            volume_error: Some(-0.001_24),
            residual: 1.24e-5,
            finite: true,
            ..Statistics::default()
        };
        let figures = figures(Some(59.7), &statistics, Some(212.34e6));
        let values: Vec<_> = figures.iter().map(|figure| figure.value.as_str()).collect();
        let constraints = count(1234);
        let wanted = [
            "60 fps",
            "1.24 ms",
            "12 288",
            &constraints,
            "212 M/s",
            "12.3 J",
            "-0.12 %",
            "1.2e-5",
        ];
        assert_eq!(values, wanted);
        for figure in &figures {
            assert!(!figure.title.is_empty() && !figure.help.is_empty());
        }
        let parts = [("stretch", count(1200)), ("volume", count(34))];
        assert_eq!(figures[3].parts, parts);
    }

    #[test]
    fn what_is_not_there_is_a_dash_and_an_idle_window_has_no_frame_rate() {
        assert_eq!(millions(None), "–");
        assert_eq!(millions(Some(0.834e6)), "0.834 M/s");
        let figures = figures(None, &Statistics::default(), None);
        let values = [0, 4, 6].map(|place| figures[place].value.as_str());
        assert_eq!(values, ["idle", "–", "–"]);
    }

    #[test]
    fn energy_that_the_solver_does_not_hold_is_marked_and_left_out() {
        let statistics = |unresolved| Statistics {
            kinetic: 10.0,
            potential: 20.0,
            elastic: [("stretch", 400.0), ("volume", 5.0)].into(),
            unresolved,
            ..Statistics::default()
        };
        let marked = energy((&statistics(390.0)).into());
        assert_eq!((marked.value.as_str(), marked.name), ("45 J", "energy *"));
        let parts: Vec<_> = marked
            .parts
            .iter()
            .map(|(_, value)| value.as_str())
            .collect();
        assert_eq!(parts, ["10 J", "20 J", "15 J", "390 J"]);
        assert!(marked.help.contains("Unresolved"));
        let whole = energy((&statistics(1.0)).into());
        assert_eq!((whole.value.as_str(), whole.name), ("434 J", "energy"));
        assert!(!whole.help.contains("Unresolved"));
    }

    #[test]
    fn an_energy_has_the_prefix_of_its_size() {
        assert_eq!(prefixed(-1.254e-3, "J"), "-1.25 mJ");
        assert_eq!(prefixed(0.0, "J"), "0 J");
        assert_eq!(prefixed(98_100.0, "J"), "98.1 kJ");
    }
}
