//! Substeps of a scene that does not give them, for bodies whose cells were chosen as well.

use super::BodySpec;
use crate::{
    mesh::Treatment,
    solver::{Body, Settings, Stretch, Substeps, World, effective::CLOSE},
};
use serde::{Deserialize, de::IgnoredAny};

/// Fewest substeps that are chosen, at [`RATE`] ticks per second. With 10, half of twenty shapes
/// that were dropped from 0.6 m ended with inverted elements.
const MIN_SUBSTEPS: f64 = 20.0;
/// Most substeps that are chosen, at [`RATE`] ticks per second: with 2000 particles, a tick takes a
/// few milliseconds.
const MAX_SUBSTEPS: f64 = 40.0;
/// Ticks per second of the limits.
const RATE: f64 = 60.0;

/// Whether a body's cells are chosen if it is filled.
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
    let sketch = super::parse::parse::<Sketch>("scene", text);
    sketch.is_ok_and(|sketch| sketch.world.substeps.is_none())
}

/// Substeps per tick for bodies that were filled with an automatic number of cells: the most that
/// any of them requires, from 20 to 40 at 60 ticks per second, and not below the default. Also a
/// note for each body.
pub(super) fn choose<'a>(
    bodies: impl Iterator<Item = &'a Body>,
    world: &World,
) -> Option<(Substeps, Vec<String>)> {
    let settings = &world.settings;
    let bodies: Vec<_> = bodies.collect();
    let required = bodies.iter().map(|body| required(body, settings)).max()?;
    let resolved = world.resolved_substeps().unwrap_or(u32::MAX);
    let chosen = required.min(resolved.max(Settings::default().substeps.get()));
    let substeps = Substeps::new(chosen).ok()?;
    let note = |body: &&Body| {
        let softness = softness(body, settings, chosen);
        format!(
            "{}: substeps set to {chosen} per tick (not given in the file){softness}",
            body.name
        )
    };
    Some((substeps, bodies.iter().map(note).collect()))
}

/// A note about the substeps of a world for a body that is added to it, if they leave its edges too
/// soft.
#[cfg(feature = "window")]
pub(crate) fn note_on(body: &Body, settings: &Settings) -> Option<String> {
    let substeps = settings.substeps.get();
    let softness = softness(body, settings, substeps);
    let required = required(body, settings);
    (!softness.is_empty()).then(|| {
        let advice = match required > substeps {
            true => format!("; a scene with it alone would get {required} substeps"),
            false => String::new(),
        };
        let unit = if substeps == 1 { "substep" } else { "substeps" };
        format!("the scene has {substeps} {unit} per tick{softness}{advice}")
    })
}

/// Substeps at which the edges are as stiff as requested, within the limits.
fn required(body: &Body, settings: &Settings) -> u32 {
    let scaled = |limit: f64| {
        let substeps = (limit * RATE / settings.rate.get()).ceil() as u32;
        substeps.max(Settings::default().substeps.get())
    };
    let (fewest, most) = (scaled(MIN_SUBSTEPS), scaled(MAX_SUBSTEPS));
    let Some(stretch) = &body.effects.stretch else {
        return fewest;
    };
    // The excess decreases with their square.
    let converged = (excess(body, stretch, settings, 1) / (CLOSE - 1.0)).sqrt();
    (converged.ceil() as u32).clamp(fewest, most)
}

/// What the substeps leave of the stiffness of a body's edges, in words; empty if they suffice, or
/// if the solver makes that up in another way.
fn softness(body: &Body, settings: &Settings, substeps: u32) -> String {
    let Some(stretch) = &body.effects.stretch else {
        return String::new();
    };
    let excess = excess(body, stretch, settings, substeps);
    let is_known = excess.is_finite() && excess > CLOSE - 1.0;
    if !is_known || settings.iterations.get() > 1 || body.effects.is_direct(settings.method) {
        return String::new();
    }
    format!(
        "; edges are about {:.1}× as soft as set (use more substeps or a higher compliance)",
        1.0 + excess
    )
}

/// Estimated excess of the effective over the requested compliance of the edges, relative to it;
/// infinite for rigid edges.
///
/// A substep moves the ends of an edge by h² (w₁ + w₂) per force, which other constraints leave
/// uncorrected ([`effective`](crate::solver::effective)). Twenty shapes at rest on the ground had
/// 0.2 to 6 times this excess, half of them between 0.5 and 1.2 times.
fn excess(body: &Body, stretch: &Stretch, settings: &Settings, substeps: u32) -> f64 {
    let positions = &body.particles.positions;
    let inverse: f64 = positions.iter().map(|position| f64::from(position.w)).sum();
    let lengths = &body.topology.edges.rest_length;
    let compliance: f64 = (lengths.iter())
        .map(|length| stretch.compliance_of(*length))
        .sum();
    if inverse == 0.0 || lengths.is_empty() {
        return 0.0;
    }
    let h = settings.tick_seconds() / f64::from(substeps);
    let mobility = 2.0 * inverse / positions.len() as f64;
    h * h * mobility / (compliance / lengths.len() as f64)
}

#[cfg(all(test, feature = "window"))]
mod tests {
    use super::*;
    use crate::{
        mesh::Primitive,
        scene::mesh_file::material,
        solver::{Body, Topology},
    };
    use std::sync::Arc;

    #[test]
    fn a_body_that_is_added_says_what_substeps_it_needs() {
        let sphere = Primitive::Sphere {
            radius: 0.2,
            cells: 8,
        };
        let mesh = sphere.build().expect("sound");
        let topology = Arc::new(Topology::new(mesh.shape).expect("sound"));
        let (density, effects) = material(&topology);
        let mut body = Body::new("ball", topology, density);
        body.effects = (&effects).into();
        let with = |substeps: u32| Settings {
            substeps: Substeps::new(substeps).expect("sound"),
            ..Settings::default()
        };
        let note = note_on(&body, &with(1)).expect("one substep is too few");
        assert!(note.starts_with("the scene has 1 substep per tick; edges are about"));
        assert!(note.contains("a scene with it alone would get"), "{note}");
        assert_eq!(note_on(&body, &with(1000)), None);
    }
}
