//! The per-body part of a snapshot.

use crate::{
    mesh::Skin,
    recording::error::{SnapshotError, nonsense},
    scene::Look,
    solver::{
        Body, Density, Effects, Mass, Particles, Quarantine, Stitch, Stitches, Topology,
        VertexIndex,
        advance::Stage,
        rest::{RestTimer, SleepSettings},
        topology::RestValues,
    },
};
use glam::Vec4;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The encoded form of a body. Its mesh and its skin are stored as indices.
#[derive(Serialize, Deserialize)]
pub struct StoredBody {
    name: String,
    mesh: u32,
    /// Index of its skin, if it has one.
    pub skin: Option<u32>,
    /// Its color as sRGB, if one was set.
    pub color: Option<[u8; 3]>,
    density: Density,
    added_mass: Vec<(VertexIndex, Mass)>,
    pins: Vec<VertexIndex>,
    effects: Effects,
    stitches: Vec<Stitch>,
    /// Rest values, if the body has deformed plastically.
    rest_values: Option<RestValues>,
    particles: Particles,
    tick_start: Vec<Vec4>,
    rest: RestTimer,
    sleep: Option<SleepSettings>,
    asleep: bool,
    quarantine: Option<(VertexIndex, String)>,
}

impl StoredBody {
    /// Encodes a body.
    pub fn of(body: &Body, mesh: u32, skin: Option<u32>, look: Look) -> Self {
        let Body {
            name,
            topology,
            particles,
            density,
            added_mass,
            pins,
            effects,
            // Derived from the body, or zero at the start of a substep.
            states: _,
            stitches,
            // Recomputed in each substep.
            direct: _,
            // At the end of the file, if there are any.
            controls: _,
            rest,
            sleep,
            asleep,
            quarantine,
            tick_start,
        } = body;
        Self {
            name: name.clone(),
            mesh,
            skin,
            color: look.color,
            density: *density,
            added_mass: added_mass.clone(),
            pins: pins.clone(),
            effects: *effects,
            stitches: stitches.all().to_vec(),
            rest_values: topology.rest_values(),
            particles: particles.clone(),
            tick_start: tick_start.positions.clone(),
            rest: *rest,
            sleep: *sleep,
            asleep: *asleep,
            quarantine: quarantine
                .as_ref()
                .map(|found| (found.vertex, found.stage.to_owned())),
        }
    }

    /// Decodes and validates a body.
    pub fn body(self, topologies: &[Arc<Topology>]) -> Result<Body, SnapshotError> {
        let wrong = |what: String| nonsense(format!("body “{}”: {what}", self.name));
        let Some(topology) = topologies.get(self.mesh as usize) else {
            let count = topologies.len();
            return Err(wrong(format!(
                "unknown mesh {}; expected less than {count}",
                self.mesh
            )));
        };
        let topology = match &self.rest_values {
            None => Arc::clone(topology),
            Some(values) => topology.flowed(values).ok_or_else(|| {
                wrong("the rest values do not match the mesh or are not finite".to_owned())
            })?,
        };
        let count = topology.particles();
        let start = ("positions at the start of the tick", &self.tick_start[..]);
        for (what, column) in self.particles.columns().into_iter().chain([start]) {
            if column.len() != count {
                let found = column.len();
                return Err(wrong(format!(
                    "{found} {what}, but the mesh has {count} vertices"
                )));
            }
        }
        for (what, found) in self.particles.history.columns() {
            if ![0, count].contains(&found) {
                return Err(wrong(format!(
                    "{found} {what}, but the mesh has {count} vertices"
                )));
            }
        }
        let spins = self.particles.spins.len();
        if ![0, count].contains(&spins) {
            return Err(wrong(format!(
                "{spins} rotations of grains, but the mesh has {count} vertices"
            )));
        }
        let repaired = self.particles.repair.len();
        if ![0, count].contains(&repaired) {
            return Err(wrong(format!(
                "{repaired} repair times, but the mesh has {count} vertices"
            )));
        }
        let masses = self.added_mass.iter().map(|(vertex, _)| *vertex);
        let frozen = self.quarantine.iter().map(|(vertex, _)| *vertex);
        let mut named = self.pins.iter().copied().chain(masses).chain(frozen);
        if let Some(vertex) = named.find(|vertex| vertex.index() >= count) {
            return Err(wrong(format!(
                "unknown vertex {vertex}; expected less than {count}"
            )));
        }
        if let Some(grab) = &self.effects.grab
            && !grab.point.fits(count)
        {
            return Err(wrong(
                "the grab refers to a particle that the body does not have".to_owned(),
            ));
        }
        let stitches = Stitches::new(self.stitches.clone(), count)
            .map_err(|error| wrong(error.to_string()))?;
        let quarantine = match &self.quarantine {
            None => None,
            Some((vertex, stage)) => Some(Quarantine::new(
                *vertex,
                stage_called(stage).ok_or_else(|| wrong(format!("unknown stage “{stage}”")))?,
            )),
        };
        let seconds = self.particles.substep_seconds();
        if !(seconds.is_finite() && seconds > 0.0) {
            return Err(wrong(format!(
                "the length of a substep is {seconds} s, but must be finite and above 0"
            )));
        }
        // The next tick overwrites this with the whole state; before it, only positions are read.
        let mut tick_start = self.particles.clone();
        tick_start.positions = self.tick_start;
        Ok(Body {
            particles: self.particles,
            added_mass: self.added_mass,
            pins: self.pins,
            effects: self.effects,
            rest: self.rest,
            sleep: self.sleep,
            asleep: self.asleep,
            quarantine,
            tick_start,
            stitches,
            ..Body::new(self.name, topology, self.density)
        })
    }
}

/// The name of a stage as stored in a quarantine.
fn stage_called(name: &str) -> Option<&'static str> {
    let stages = Stage::ALL.iter().map(|stage| stage.name());
    let mut all = stages.chain([Quarantine::INPUT, Quarantine::USER]);
    all.find(|stage| *stage == name)
}

/// Looks up a skin and checks that it refers only to particles of the body.
pub fn skin(body: &Body, skin: u32, skins: &[Arc<Skin>]) -> Result<Arc<Skin>, SnapshotError> {
    let name = &body.name;
    let Some(found) = skins.get(skin as usize) else {
        let count = skins.len();
        return Err(nonsense(format!(
            "body “{name}”: unknown skin {skin}; expected less than {count}"
        )));
    };
    let particles = body.topology.particles();
    let corners = found.triangles.as_flattened().iter();
    let hangs = found.anchors.iter().flat_map(|anchor| &anchor.vertices);
    let sound = corners
        .map(|&i| i as usize)
        .all(|i| i < found.anchors.len())
        && hangs.map(|vertex| vertex.index()).all(|i| i < particles);
    if sound {
        Ok(Arc::clone(found))
    } else {
        let what = "the skin refers to vertices that the body does not have";
        Err(nonsense(format!("body “{name}”: {what}")))
    }
}
