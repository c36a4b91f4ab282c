//! Where a member fails at its settings: the cheapest settings with which it passes.

use super::{
    Case, Member, Outcome, TortureError,
    run::{Crews, prepared, run_world},
};
use crate::solver::{Body, Direct, Iterations, Settings, Substeps, World, direct};
use std::fmt;

/// Settings with which a case passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Advice {
    /// What to change.
    pub change: Change,
    /// Substeps a tick.
    pub substeps: u32,
    /// Iterations a substep.
    pub iterations: u32,
    /// What its ticks took over what they took at the settings that fail; of one run each.
    pub time: f64,
}

/// What is changed of settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// So many times the substeps.
    Substeps(u32),
    /// So many times the iterations.
    Iterations(u32),
    /// Bodies are solved directly.
    Direct,
}

/// What is tried, by the number of sweeps that it costs. A factorization costs some tens of sweeps of a small
/// body.
const TRIALS: [Change; 13] = {
    use Change::{Direct, Iterations, Substeps};
    [
        Substeps(2),
        Iterations(2),
        Substeps(4),
        Iterations(4),
        Substeps(8),
        Iterations(8),
        Substeps(16),
        Iterations(16),
        Direct,
        Substeps(32),
        Iterations(32),
        Substeps(64),
        Iterations(64),
    ]
};

impl fmt::Display for Advice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            change,
            substeps,
            iterations,
            time,
        } = self;
        let direct = match change {
            Change::Direct => ", solved directly",
            _ => "",
        };
        write!(
            f,
            "passes at {substeps}×{iterations} (substeps × iterations){direct}, in about {time:.1} × the time"
        )
    }
}

/// What is said where nothing that is tried passes.
pub const NOTHING: &str = "passes with none of these: up to 64 × the substeps, up to 64 × the iterations, solved directly";

/// The first of what is tried with which a member passes; none if it is none. `failed` is what came out at the
/// member's own settings.
///
/// # Errors
/// [`TortureError`] for a member that cannot be built.
pub fn advise(
    case: &Case,
    failed: &Outcome,
    crews: &Crews,
) -> Result<Option<Advice>, TortureError> {
    let member = &failed.member;
    search(
        (member.substeps, member.iterations),
        failed,
        |change, substeps, iterations| {
            let member = Member {
                substeps,
                iterations,
                ..*member
            };
            let mut world = member.world()?;
            case.begin(&member, &mut world)?;
            if change == Change::Direct && !solve_directly(&mut world) {
                return Ok(None);
            }
            let run = run_world(case, (failed.number, &member), world, crews, false);
            run.map(Some)
        },
    )
}

/// The same of a body that somebody has, at the settings of its scene.
///
/// # Errors
/// [`TortureError`] if threads cannot be had.
pub fn advise_given(
    case: &Case,
    body: &Body,
    settings: Settings,
    failed: &Outcome,
) -> Result<Option<Advice>, TortureError> {
    let crews = Crews::start()?;
    let own = (settings.substeps.get(), settings.iterations.get());
    search(own, failed, |change, substeps, iterations| {
        let settings = Settings {
            substeps: Substeps::new(substeps)?,
            iterations: Iterations::new(iterations)?,
            ..settings
        };
        let (member, mut world) = prepared(case, body.clone(), settings)?;
        if change == Change::Direct && !solve_directly(&mut world) {
            return Ok(None);
        }
        run_world(case, (1, &member), world, &crews, false).map(Some)
    })
}

/// Whether any body of a world can be solved directly that is not yet.
fn solve_directly(world: &mut World) -> bool {
    let method = world.settings.method;
    let mut any = false;
    for body in &mut world.bodies {
        let fits = direct::unfit(&body.topology, &body.effects, method).is_none();
        if fits && body.effects.direct.is_none() {
            body.effects.direct = Some(Direct {});
            any = true;
        }
    }
    any
}

fn search(
    (substeps, iterations): (u32, u32),
    failed: &Outcome,
    run: impl Fn(Change, u32, u32) -> Result<Option<Outcome>, TortureError>,
) -> Result<Option<Advice>, TortureError> {
    for change in TRIALS {
        let (substeps, iterations) = match change {
            Change::Substeps(times) => (substeps * times, iterations),
            Change::Iterations(times) => (substeps, iterations * times),
            Change::Direct => (substeps, iterations),
        };
        if Substeps::new(substeps).is_err() || Iterations::new(iterations).is_err() {
            continue;
        }
        let Some(outcome) = run(change, substeps, iterations)? else {
            continue;
        };
        if outcome.passed() {
            return Ok(Some(Advice {
                change,
                substeps,
                iterations,
                time: outcome.seconds / failed.seconds,
            }));
        }
    }
    Ok(None)
}
