//! Runs a case on a separate thread while the window stays responsive.

use super::Verdict;
use crate::{
    effect::OwnEffects,
    recording::{About, record},
    sandbox::lab::worker::{Reporter, Worker},
    scene::{BuiltScene, Look},
    solver::{Body, Settings},
    torture::{
        self, Advice, Case, Crews, Options, SuiteRow, TortureError, advise, advise_given, jobs,
        prepared, run_given, run_member,
    },
};
use std::{
    io,
    path::Path,
    sync::{Mutex, PoisonError},
};

/// The subject of a case.
#[derive(Debug)]
pub enum Subject {
    /// A copy of the body on screen, with the settings of its scene.
    This(Box<Body>, Settings),
    /// The case's own family, with the members of a quick run.
    Own,
}

/// Messages of the thread.
#[derive(Debug)]
pub enum News {
    /// Completed fraction of the members, from 0 to 1.
    Progress(f32),
    /// The run has ended, with its verdict or the reason why it could not be run.
    Ended(Result<Verdict, String>),
    /// Settings with which the case passes, as text, or the reason why the search failed.
    Advised(Result<String, String>),
}

/// Runs a case on a body and records it, so that `pliant replay` runs it again anywhere.
///
/// # Errors
/// Why the case cannot be built or the file cannot be written.
pub fn save(
    case: &'static Case,
    body: Body,
    settings: Settings,
    path: &Path,
) -> Result<(), String> {
    let name = body.name.clone();
    let prepared = prepared(case, body, settings).map_err(|error| error.to_string())?;
    let (member, world) = prepared;
    let built = BuiltScene {
        skins: vec![None; world.bodies.len()],
        looks: vec![Look::default(); world.bodies.len()],
        collider_looks: vec![Look::default(); world.colliders.len()],
        world,
        places: None,
        camera: None,
        frame: None,
        notes: Vec::new(),
        own: Vec::new(),
        own_effects: OwnEffects::default(),
    };
    let about = About {
        name: format!("{}, {name}", case.name),
        title: format!("{}: {name}", case.title),
        look_at: case.about.to_owned(),
        camera: None,
    };
    let done = record(&built, about, (case.seconds)(&member), path);
    done.map(|_| ()).map_err(|error| error.to_string())
}

/// Starts to run a case on a separate thread.
///
/// # Errors
/// If the thread cannot be started.
pub fn run_case(case: &'static Case, subject: Subject) -> io::Result<Worker<News>> {
    Worker::start("hard case", move |reporter| {
        let outcome = match subject {
            Subject::This(body, settings) => {
                run_given(case, *body, settings).map(|outcome| Verdict::of_this(&outcome))
            }
            Subject::Own => own(case, reporter),
        };
        reporter.tell(News::Ended(outcome.map_err(|error| error.to_string())));
    })
}

/// Starts to find settings with which a case passes, on a body or on the named member of the case's
/// own family.
///
/// # Errors
/// If the thread cannot be started.
pub fn start_advice(
    case: &'static Case,
    subject: Subject,
    member: String,
) -> io::Result<Worker<News>> {
    Worker::start("advice", move |reporter| {
        let advice = find_settings(case, subject, member);
        let words = advice
            .map(|advice| advice.map_or_else(|| Advice::NONE.to_owned(), |it| it.to_string()));
        reporter.tell(News::Advised(words.map_err(|error| error.to_string())));
    })
}

fn find_settings(
    case: &'static Case,
    subject: Subject,
    member: String,
) -> Result<Option<Advice>, TortureError> {
    match subject {
        Subject::This(body, settings) => {
            let failed = run_given(case, (*body).clone(), settings)?;
            advise_given(case, &body, settings, &failed)
        }
        Subject::Own => {
            let options = Options {
                cases: vec![case.name.to_owned()],
                member: Some(member),
                quick: false,
                mixtures: 1,
            };
            let crews = Crews::start()?;
            let Some(job) = jobs(&options)?.pop() else {
                return Ok(None);
            };
            let failed = run_member(case, (job.number, &job.member), &crews, false)?;
            advise(case, &failed, &crews)
        }
    }
}

/// Runs the quick members of a case one after the other, then the worst again to capture its
/// pictures.
fn own(case: &'static Case, reporter: &Reporter<News>) -> Result<Verdict, TortureError> {
    let jobs = jobs(&Options {
        cases: vec![case.name.to_owned()],
        member: None,
        quick: true,
        mixtures: 1,
    })?;
    let reporter = Mutex::new(reporter);
    let progress = |done: usize| {
        let reporter = reporter.lock().unwrap_or_else(PoisonError::into_inner);
        reporter.tell(News::Progress(done as f32 / jobs.len().max(1) as f32));
    };
    let rows = torture::run(&jobs, 1, &progress)?;
    let load = |row: &&SuiteRow| {
        let worst = row.worst().and_then(|outcome| outcome.worst());
        worst.map_or(0.0, torture::Figure::load)
    };
    let worst = |expected: bool| {
        let rows = rows.iter().filter(|row| row.expected.is_some() == expected);
        rows.max_by(|a, b| load(a).total_cmp(&load(b)))
    };
    let row = worst(false).or_else(|| worst(true));
    let Some((row, outcome)) = row.and_then(|row| Some((row, row.worst()?))) else {
        return Err(TortureError::NoCase {
            name: case.name.to_owned(),
            valid: String::new(),
        });
    };
    let member = (outcome.number, &outcome.member);
    let film = run_member(case, member, &Crews::start()?, true)?;
    let expected = row.expected.map(|it| it.reason);
    Ok(Verdict::of_family(&rows, &film, expected))
}
