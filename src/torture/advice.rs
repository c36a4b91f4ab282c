//! The cheapest settings with which a failing member passes.

use super::{
    Case, Member, Outcome, TortureError,
    run::{Crews, prepared, run_world},
};
use crate::solver::{Body, Direct, Iterations, Settings, Substeps, World, direct};
use std::fmt;

/// Settings with which a case passes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Advice {
    /// Substeps per tick.
    pub substeps: u32,
    /// Iterations per substep.
    pub iterations: u32,
    /// Whether the direct solver is used.
    pub direct: bool,
    /// Run time relative to that with the failing settings; from one run each.
    pub time: f64,
}

/// Settings to try in ascending order of cost: factors for substeps and for iterations, and whether
/// to use the direct solver. A factorization costs as much as a few tens of iterations of a small
/// body.
const TRIALS: [(u32, u32, bool); 13] = [
    (2, 1, false),
    (1, 2, false),
    (4, 1, false),
    (1, 4, false),
    (8, 1, false),
    (1, 8, false),
    (16, 1, false),
    (1, 16, false),
    (1, 1, true),
    (32, 1, false),
    (1, 32, false),
    (64, 1, false),
    (1, 64, false),
];

impl fmt::Display for Advice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            substeps,
            iterations,
            direct,
            time,
        } = self;
        let direct = if *direct { ", direct solver" } else { "" };
        write!(
            f,
            "passes at {substeps}×{iterations} (substeps × iterations){direct}, at about {time:.1}× the time"
        )
    }
}

impl Advice {
    /// The message where none of the settings tried passes.
    pub const NONE: &str = "passes with none of the settings tried: up to 64× the substeps, up to 64× the iterations, the direct solver";
}

/// The cheapest settings tried with which a member passes; `None` if it passes with none. `failed`
/// is its outcome at its own settings.
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
        |substeps, iterations, direct| {
            let member = Member {
                substeps,
                iterations,
                ..*member
            };
            let mut world = member.world()?;
            case.begin(&member, &mut world)?;
            if direct && !solve_directly(&mut world) {
                return Ok(None);
            }
            let seconds = (case.seconds)(&member);
            let run = run_world(
                case,
                (failed.number, &member),
                (world, seconds),
                crews,
                false,
            );
            run.map(Some)
        },
    )
}

/// The cheapest settings tried with which a user's body passes a case; `settings` are those of its
/// scene.
///
/// # Errors
/// [`TortureError`] if threads cannot be started.
pub fn advise_given(
    case: &Case,
    body: &Body,
    settings: Settings,
    failed: &Outcome,
) -> Result<Option<Advice>, TortureError> {
    let crews = Crews::start()?;
    let own = (settings.substeps.get(), settings.iterations.get());
    search(own, failed, |substeps, iterations, direct| {
        let settings = Settings {
            substeps: Substeps::new(substeps)?,
            iterations: Iterations::new(iterations)?,
            ..settings
        };
        let (member, mut world) = prepared(case, body.clone(), settings)?;
        if direct && !solve_directly(&mut world) {
            return Ok(None);
        }
        let seconds = (case.seconds)(&member);
        run_world(case, (1, &member), (world, seconds), &crews, false).map(Some)
    })
}

/// Enables the direct solver where it is supported. Returns whether any body was changed.
fn solve_directly(world: &mut World) -> bool {
    let method = world.settings.method;
    let mut any = false;
    for body in &mut world.bodies {
        let fits = direct::unfit(&body.topology, &body.effects, method).is_none();
        if fits && body.effects.direct.is_none() {
            body.effects.direct = Some(Direct);
            any = true;
        }
    }
    any
}

fn search(
    (substeps, iterations): (u32, u32),
    failed: &Outcome,
    run: impl Fn(u32, u32, bool) -> Result<Option<Outcome>, TortureError>,
) -> Result<Option<Advice>, TortureError> {
    for (times_substeps, times_iterations, direct) in TRIALS {
        let (substeps, iterations) = (substeps * times_substeps, iterations * times_iterations);
        if Substeps::new(substeps).is_err() || Iterations::new(iterations).is_err() {
            continue;
        }
        let Some(outcome) = run(substeps, iterations, direct)? else {
            continue;
        };
        if outcome.passed() {
            return Ok(Some(Advice {
                substeps,
                iterations,
                direct,
                time: outcome.seconds / failed.seconds,
            }));
        }
    }
    Ok(None)
}
