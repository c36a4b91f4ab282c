//! Substeps of a scene that does not give them, for bodies whose cells were chosen as well.

use super::BodySpec;
use crate::{
    mesh::Treatment,
    solver::{Body, Settings, Stretch, Substeps, effective::CLOSE},
};
use serde::{Deserialize, de::IgnoredAny};

/// Fewest substeps that are chosen. With 10, half of twenty shapes that were dropped from 0.6 m
/// ended with elements inside out.
const FEWEST: u32 = 20;
/// Most substeps that are chosen: with 2000 particles, a tick takes a few milliseconds.
const MOST: u32 = 40;

/// Whether a body's cells are chosen when it is built.
pub(super) fn is_automatic(spec: &BodySpec) -> bool {
    let mesh = spec.mesh.as_ref();
    mesh.is_some_and(|mesh| mesh.cells.is_none() && mesh.treatment == Treatment::Fill)
}

/// Whether the text of a valid scene leaves the substeps open.
pub(super) fn are_open(text: &str) -> bool {
    #[derive(Deserialize, Default)]
    #[serde(rename = "Settings")]
    struct World {
        #[serde(default)]
        substeps: Option<IgnoredAny>,
    }
    #[derive(Deserialize)]
    #[serde(rename = "Scene")]
    struct Sketch {
        #[serde(default)]
        world: World,
    }
    let sketch = super::file::parse::<Sketch>("scene", text);
    sketch.is_ok_and(|sketch| sketch.world.substeps.is_none())
}

/// Substeps per tick for a solid that was filled with tetrahedra, from 20 to 40, and a note that
/// says so and what they are worth.
///
/// Estimates the excess compliance of an edge at rest: a substep moves its ends by h² (w₁ + w₂) per
/// force, which other constraints leave uncorrected ([`effective`](crate::solver::effective)).
/// Twenty shapes had 0.2 to 6 times this excess, half of them between 0.5 and 1.2 times.
pub(super) fn choose(body: &Body, settings: &Settings) -> Option<(Substeps, String)> {
    let stretch = body.effects.stretch.as_ref()?;
    let excess = |substeps: u32| excess(body, stretch, settings.tick_seconds(), substeps);
    let converges = |substeps: &u32| excess(*substeps) <= CLOSE - 1.0;
    let chosen = (FEWEST..MOST).find(converges).unwrap_or(MOST);
    let converged = match converges(&chosen) {
        true => String::new(),
        false => format!(
            "; its edges will be about {:.0} times as soft as their compliance says (more substeps or a higher compliance)",
            1.0 + excess(chosen)
        ),
    };
    let note = format!("{chosen} substeps per tick, chosen for its cells{converged}");
    Some((Substeps::new(chosen).ok()?, note))
}

/// Estimated excess of the effective over the requested compliance of the edges, relative to it.
fn excess(body: &Body, stretch: &Stretch, tick: f64, substeps: u32) -> f64 {
    let inverse: f64 = (body.particles.positions.iter())
        .map(|position| f64::from(position.w))
        .sum();
    let mean = inverse / body.particles.len().max(1) as f64;
    let h = tick / f64::from(substeps);
    2.0 * h * h * mean / f64::from(stretch.compliance.get())
}
