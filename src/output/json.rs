//! A run as one JSON object.

use super::warnings::warnings;
use crate::{scene::run::Run, simulation::EnergyLedger, solver::memory::solver_bytes};
use serde_json::{Value, json};

/// The summary that `pliant run --json` prints.
#[must_use]
pub fn run(scene: &str, run: &Run) -> Value {
    let last = run.history.last().cloned().unwrap_or_default();
    let times = run.median_times();
    let mut object = json!({
        "scene": scene,
        "seconds": run.seconds,
        "rate": run.settings.rate.get(),
        "substeps": run.settings.substeps.get(),
        "iterations": run.settings.iterations.get(),
        "solver_bytes": solver_bytes(&run.world.bodies),
        "threads": run.world.threads.count(),
        "ticks": last.tick,
        "bodies": last.bodies,
        "asleep": last.asleep,
        "particles": last.particles,
        "constraints": last.constraints,
        "systems": run.systems,
        "ms_per_tick": times.solver,
        "measuring_ms_per_tick": times.measuring,
        "ecs_ms_per_tick": times.ecs,
        "resolved_substeps": run.world.resolved_substeps(),
        "finite": last.finite,
        "energy_j": last.energy(),
        "kinetic_j": last.kinetic,
        "potential_j": last.potential,
        "elastic_j": last.elastic,
        "unresolved_j": last.unresolved,
        "momentum": last.momentum,
        "angular_momentum": last.angular_momentum,
        "volume_error": last.volume_error,
        "residual": last.residual,
        "overpressure_pa": last.overpressure,
        "inverted": last.inverted,
        "contacts": last.contacts,
        "touched": touched(run),
        "touched_surfaces": touched_surfaces(run),
        "smallest_gap_m": run.smallest_gap(),
        "crossings": run.crossings(),
        "state_hash": format!("{:016x}", run.state_hash),
        "stopped": run.stopped,
        "accepted": run.accepted(),
        "criteria": run.criteria,
        "reasons": run.reasons,
        "warnings": warnings(run),
    });
    object["contacts_apart"] = json!(last.contacts_apart);
    object["repeated_ticks"] = json!(last.repeated_ticks);
    if let Some(ledger) = &run.ledger {
        object["ledger_j"] = ledger_json(ledger);
    }
    object
}

/// Pairs of bodies that touched.
fn touched(run: &Run) -> Vec<Value> {
    let all = run.touched.iter();
    let pairs = all.map(|pair| {
        json!({
            "bodies": pair.bodies,
            "seconds": pair.seconds,
            "mean_force_n": pair.mean_force,
            "largest_force_n": pair.largest_force,
        })
    });
    pairs.collect()
}

/// Bodies that touched a collider or the ground.
fn touched_surfaces(run: &Run) -> Vec<Value> {
    let all = run.touched_surfaces.iter();
    let surfaces = all.map(|it| {
        json!({
            "body": it.body,
            "collider": it.collider,
            "seconds": it.seconds,
            "mean_force_n": it.mean_force,
            "largest_force_n": it.largest_force,
        })
    });
    surfaces.collect()
}

/// Sources and sinks of energy [J].
fn ledger_json(ledger: &EnergyLedger) -> Value {
    let mut rows = json!({
        "change": ledger.change(),
        "unaccounted": ledger.gap(),
    });
    for (name, energy) in ledger.rows() {
        rows[name] = energy.into();
    }
    rows
}
