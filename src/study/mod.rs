//! Accuracy versus cost.
//!
//! A [`Problem`] is a scene with meshes from coarse to fine, an observed quantity, and a reference
//! for it. A study solves problems at many settings and reports the cost and the error of each.
//!
//! **Two kinds of error.** *Solver error* is the distance of a result to the [converged](mod@converge) solution
//! on the same mesh: its static equilibrium, or the f64 reference with small steps. *Mesh error* is
//! the distance of that converged solution to the continuum: a [closed form](Reference), or the
//! limit of mesh refinement. Springs and volumes have no Young's modulus, so many solids have no
//! closed form, and none is substituted.
//!
//! Rest is found by kinetic damping. An unconverged solver rests in a softer state than the
//! requested compliance gives, and that is its error. Motion is compared at the times or over the
//! periods that the problem specifies.
//!
//! [`run`] makes a study and stores every record in the [points file](journal) immediately;
//! [`merge`] combines parts; [`report::write`] writes the folder. [`probe`] estimates cost and
//! error at other settings for an existing world, for example the one in the window.
//!
//! Problems have effects of the crate only, as the f64 reference knows no others. [`refine`](fn@refine)
//! compares a scene with effects of an app with its own finest run.

mod budget;
mod choose;
mod closed_form;
mod coincidence;
pub mod converge;
mod error;
mod floor;
mod growth;
mod hash;
mod html;
pub mod journal;
mod multiples;
mod nan;
mod numbers;
mod observe;
mod overview;
mod page;
pub mod pareto;
mod physics;
mod picture;
mod probe;
mod problem;
pub mod record;
mod refine;
pub mod registry;
pub mod report;
mod residual;
mod rest;
mod results;
mod rivalry;
mod setting;
mod state;
pub mod sweep;
mod timing;
mod weaknesses;

pub use budget::Budget;
pub use choose::{Choice, Goal, MAX_ITERATIONS_PER_TICK, choose, choose_from};
pub use closed_form::Reference;
pub use error::StudyError;
pub use observe::{Conserved, Observe, Observed, Quantity, Select};
pub use probe::{PROJECTIONS, Probe, ProbeNews, ProbePoint, ROUNDS, probe};
pub use problem::{Case, Level, Problem, ReferenceSettings};
pub use refine::{Refine, RefinedRun, Refinement, refine};
pub use results::{CaseResult, Point, ProblemResult, Study};
pub use setting::{Method, Setting};
pub use state::{BodyState, Solver, State};

use journal::Journal;
use record::{Header, ProblemText, Record};
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

/// What a study covers.
#[derive(Debug, Clone)]
pub struct Options {
    /// Names of built-in problems or paths of files; empty for all built-in problems.
    pub problems: Vec<String>,
    /// Limits and settings.
    pub budget: Budget,
    /// The folder for its points.
    pub folder: PathBuf,
    /// Whether to continue with the points in that folder.
    pub resume: bool,
    /// Only the case of this name, as in `hanging_mass@1`.
    pub only: Option<String>,
}

/// Problems with all their cases, and the identity of their study.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The problems.
    pub problems: Vec<Problem>,
    /// All their cases.
    pub cases: Vec<Case>,
    /// Identity of the study.
    pub header: Header,
    texts: Vec<ProblemText>,
}

impl Plan {
    /// Reads problems and builds their cases.
    ///
    /// # Errors
    /// [`StudyError`] for a problem that does not exist, is invalid, or cannot be built.
    pub fn new(names: &[String], budget: &Budget) -> Result<Self, StudyError> {
        let builtin: Vec<String> = registry::PROBLEMS
            .iter()
            .map(|problem| problem.name.to_owned())
            .collect();
        let names = if names.is_empty() { &builtin } else { names };
        let problems = names.iter().map(|name| Problem::load(name));
        Self::of(problems.collect::<Result<_, _>>()?, budget)
    }

    fn of(problems: Vec<Problem>, budget: &Budget) -> Result<Self, StudyError> {
        let mut cases = Vec::new();
        for (place, problem) in problems.iter().enumerate() {
            if problems[..place]
                .iter()
                .any(|other| other.name == problem.name)
            {
                return Err(StudyError::Problem {
                    problem: problem.name.clone(),
                    message: "two problems have this name; rename one of the files".to_owned(),
                });
            }
            cases.extend(problem.cases()?);
        }
        let all: Vec<&str> = problems.iter().map(|problem| &problem.hash[..]).collect();
        let header = Header {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            budget: budget.name.to_owned(),
            hash: hash::of(&format!("{} {}", budget.words(), all.join(" "))),
        };
        let texts = problems.iter().map(Problem::to_record).collect();
        Ok(Self {
            problems,
            cases,
            header,
            texts,
        })
    }

    /// The case with this name.
    ///
    /// # Errors
    /// [`StudyError::NoJob`].
    pub fn case(&self, id: &str) -> Result<&Case, StudyError> {
        let found = self.cases.iter().find(|case| case.id() == id);
        found.ok_or_else(|| StudyError::NoJob {
            id: id.to_owned(),
            example: self.cases.first().map(Case::id).unwrap_or_default(),
        })
    }
}

/// Makes a study, or the requested part of it. `progress` receives the completed fraction, from 0
/// to 1.
///
/// # Errors
/// [`StudyError`]; the results so far are in the points file.
pub fn run(options: &Options, progress: impl FnMut(f64) + Send) -> Result<Study, StudyError> {
    let plan = Plan::new(&options.problems, &options.budget)?;
    let cases = match &options.only {
        Some(id) => vec![plan.case(id)?.clone()],
        None => plan.cases.clone(),
    };
    let (mut journal, known) = if options.resume {
        Journal::resume(&options.folder, &plan.header)?
    } else {
        let journal = Journal::create(&options.folder, &plan.header, &plan.texts)?;
        (journal, Vec::new())
    };
    let found = sweep::run(&cases, &options.budget, &known, &mut journal, progress)?;
    let records = [known, found].concat();
    Study::new(plan.header, &plan.problems, &options.budget, &records)
}

/// Merges the points of several folders into a new points file in `folder`.
///
/// # Errors
/// [`StudyError`] if a folder contains no points, or those of another study.
pub fn merge(parts: &[PathBuf], folder: &Path) -> Result<Study, StudyError> {
    let mut first: Option<Header> = None;
    let mut texts: Vec<ProblemText> = Vec::new();
    let mut records: Vec<Record> = Vec::new();
    let mut seen = BTreeSet::new();
    for part in parts {
        let (header, found, _) = journal::read(part)?;
        match &first {
            Some(first) if *first != header => {
                let remedy = "merge only jobs with the same problems and the same budget";
                return Err(journal::different(part, &header, first, remedy));
            }
            _ => first = Some(header),
        }
        for record in found {
            let threads = match &record {
                Record::Time(time) => time.threads,
                _ => 0,
            };
            match record {
                Record::Problem(text) if texts.contains(&text) => {}
                Record::Problem(text) => texts.push(text),
                // Times of a point must not be mixed between machines: the first ones are kept.
                record if !seen.insert((sweep::key(&record), threads)) => {}
                record => records.push(record),
            }
        }
    }
    let header = first.ok_or_else(|| StudyError::NoPoints {
        path: folder.to_owned(),
    })?;
    let budget = match header.budget.as_str() {
        "quick" => Budget::quick(),
        _ => Budget::full(),
    };
    let problems = texts.iter().map(Problem::from_record);
    let plan = Plan::of(problems.collect::<Result<_, _>>()?, &budget)?;
    let mut journal = Journal::create(folder, &header, &texts)?;
    for record in &records {
        journal.append(record)?;
    }
    Study::new(header, &plan.problems, &budget, &records)
}
