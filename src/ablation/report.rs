//! An ablation as text and as JSON.

use super::{Ablation, Advice, Cost, Distance, Variant};
use serde_json::{Value, json};
use std::fmt::Write;

/// A table of the effects, and advice in sentences.
#[must_use]
pub fn text(title: &str, ablation: &Ablation) -> String {
    let mut text = format!(
        "{title}: {:.3} s in {} ticks of {} substeps; largest body {}; threads: {}\n\n",
        ablation.seconds,
        ablation.ticks,
        ablation.substeps,
        length(ablation.size),
        ablation.threads,
    );
    let head = [
        "without",
        "bodies",
        "ms per tick",
        "saves",
        "RMS distance",
        "maximum",
    ];
    let rows: Vec<[String; 6]> = ablation
        .without
        .iter()
        .map(|it| row(ablation, it))
        .collect();
    let whole = [
        "(nothing)".to_owned(),
        String::new(),
        milliseconds(ablation.cost),
        String::new(),
        String::new(),
        String::new(),
    ];
    let finer = ablation.finer.iter().map(|finer| {
        let mut cells = row(ablation, finer);
        "(twice the substeps)".clone_into(&mut cells[0]);
        cells[1].clear();
        cells[3].clear();
        cells
    });
    let all: Vec<[String; 6]> = [head.map(str::to_owned), whole]
        .into_iter()
        .chain(rows)
        .chain(finer)
        .collect();
    text += &table(&all);
    text.push('\n');
    for sentence in sentences(ablation) {
        text += &sentence;
        text.push('\n');
    }
    text
}

/// Advice in sentences: the yardstick, then what can be removed.
#[must_use]
pub fn sentences(ablation: &Ablation) -> Vec<String> {
    let yardstick = ablation.yardstick();
    if !yardstick.is_finite() {
        let unknown = "Twice the substeps diverge, leave other bodies or grains, or are out of range, so that \
                       the accuracy of the scene is unknown: no advice.";
        return vec![unknown.to_owned()];
    }
    if !ablation.is_conclusive() {
        return vec![format!(
            "Twice the substeps move the bodies by {}: the scene is chaotic or not converged, and \
             distances do not tell what an effect changes. Try more substeps or a shorter time.",
            of_size(yardstick, ablation.size)
        )];
    }
    let mut sentences = vec![format!(
        "Twice the substeps move the bodies by {}: ignore smaller distances.",
        of_size(yardstick, ablation.size)
    )];
    let advised = |advice| {
        let variants = ablation.without.iter();
        let found = variants.filter(move |it| ablation.advice(it) == advice);
        found.map(|it| it.name).collect::<Vec<_>>().join(", ")
    };
    for variant in &ablation.without {
        if ablation.advice(variant) == Advice::Remove {
            let (saved, _) = ablation.saved(variant);
            let seen = variant.distance.unwrap_or_default().rms;
            sentences.push(format!(
                "{}: {:.0} % of the tick, {} of what is seen. Removing it saves time.",
                variant.name,
                saved * 100.0,
                per_cent(seen / ablation.size),
            ));
        }
    }
    let negligible = advised(Advice::Negligible);
    if !negligible.is_empty() {
        sentences.push(format!(
            "Neither seen nor measurable in time: {negligible}."
        ));
    }
    if sentences.len() == 1 {
        sentences.push("Every effect changes what is seen.".to_owned());
    }
    sentences
}

/// The ablation as one JSON object.
#[must_use]
pub fn json(scene: &str, ablation: &Ablation) -> Value {
    let distance = |distance: Option<Distance>| {
        distance.map(|it| {
            json!({
                "rms_m": it.rms,
                "max_m": it.max,
                "unmatched": it.unmatched,
                "rms_fraction_of_size": it.rms / ablation.size,
            })
        })
    };
    let without: Vec<Value> = ablation
        .without
        .iter()
        .map(|variant| {
            let (saved, noise) = ablation.saved(variant);
            json!({
                "effect": variant.name,
                "bodies": variant.carriers,
                "ms_per_tick": variant.cost.ms,
                "saved_fraction": saved,
                "saved_uncertainty": noise,
                "distance": distance(variant.distance),
                "diverged": variant.distance.is_none(),
                "advice": match ablation.advice(variant) {
                    Advice::Keep => "keep",
                    Advice::Remove => "remove",
                    Advice::Negligible => "negligible",
                },
            })
        })
        .collect();
    json!({
        "scene": scene,
        "seconds": ablation.seconds,
        "ticks": ablation.ticks,
        "substeps": ablation.substeps,
        "threads": ablation.threads,
        "size_m": ablation.size,
        "ms_per_tick": ablation.cost.ms,
        "ms_per_tick_noise": ablation.cost.noise,
        "without": without,
        "twice_the_substeps": ablation.finer.as_ref().map(|finer| json!({
            "ms_per_tick": finer.cost.ms,
            "distance": distance(finer.distance),
        })),
        "advice": sentences(ablation),
    })
}

fn row(ablation: &Ablation, variant: &Variant) -> [String; 6] {
    let (saved, noise) = ablation.saved(variant);
    let saves = if saved.abs() <= noise {
        "within noise".to_owned()
    } else {
        format!("{:.0} ± {:.0} %", saved * 100.0, noise * 100.0)
    };
    let (rms, max) = match variant.distance {
        Some(it) if it.unmatched > 0 => (others(it.unmatched), String::new()),
        Some(it) => (
            of_size(it.rms, ablation.size),
            of_size(it.max, ablation.size),
        ),
        None => ("diverges".to_owned(), String::new()),
    };
    [
        variant.name.to_owned(),
        variant.carriers.to_string(),
        milliseconds(variant.cost),
        saves,
        rms,
        max,
    ]
}

/// Columns padded to their widest cell; the first one is aligned to the left, others to the right.
fn table(rows: &[[String; 6]]) -> String {
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max();
    let widths: Vec<usize> = (0..6).map(|column| width(column).unwrap_or(0)).collect();
    let mut text = String::new();
    for row in rows {
        let mut line = format!("{:<1$}", row[0], widths[0]);
        for (cell, width) in row.iter().zip(&widths).skip(1) {
            // Writing to a string does not fail.
            let _ = write!(line, "  {cell:>width$}");
        }
        text += line.trim_end();
        text.push('\n');
    }
    text
}

fn milliseconds(cost: Cost) -> String {
    format!("{:.3}", cost.ms)
}

/// What only one of two runs has, in words.
#[must_use]
pub fn others(unmatched: usize) -> String {
    format!("{unmatched} more or fewer")
}

/// A distance with its unit, and relative to the size of the scene.
fn of_size(distance: f64, size: f64) -> String {
    format!("{} ({})", length(distance), per_cent(distance / size))
}

/// A length with three digits: in m from 1 m on, otherwise in mm.
#[must_use]
pub fn length(meters: f64) -> String {
    let (value, unit) = if meters >= 1.0 {
        (meters, "m")
    } else {
        (meters * 1e3, "mm")
    };
    match value {
        0.0 => format!("0 {unit}"),
        it if it < 1e-3 => format!("{it:.1e} {unit}"),
        it if it < 10.0 => format!("{it:.2} {unit}"),
        it if it < 100.0 => format!("{it:.1} {unit}"),
        it => format!("{it:.0} {unit}"),
    }
}

/// A ratio in per cent.
#[must_use]
pub fn per_cent(ratio: f64) -> String {
    match ratio * 100.0 {
        0.0 => "0 %".to_owned(),
        it if it < 0.01 => format!("{it:.0e} %"),
        it if it < 10.0 => format!("{it:.2} %"),
        it => format!("{it:.0} %"),
    }
}
