//! What accuracy costs.
//!
//! A [`Problem`] is a scene with meshes from coarse to fine, something that is observed of it, and
//! what that is held against. A study solves problems at many settings and says what each costs
//! and how wrong it is.
//!
//! **Two errors are not one.** *Solver error* is the distance of an answer to the [converged]
//! one of the same mesh: its static equilibrium, or the f64 reference with small steps. *Mesh error* is the distance of
//! that converged answer to the continuum: a [closed form](Reference), or what the meshes tend to.
//! Springs and volumes have no Young's modulus, so many solids have no closed form, and none is
//! made up.
//!
//! Bodies at rest are found by [kinetic damping](rest); where a solver does too little, the rest
//! that is found is softer than asked, and that is the error. What moves is compared at the times
//! or over the periods that the problem names.
//!
//! [`run`] makes a study, keeping every piece in the [points file](journal) as it comes; [`merge`]
//! puts parts together; [`report::write`] writes the folder. [`probe`] does it for a world that is
//! there already: whoever shows one asks what it would cost and how wrong it would be at other
//! settings.

pub mod budget;
pub mod choose;
pub mod closed_form;
mod coincidence;
pub mod converge;
mod error;
pub mod floor;
pub mod growth;
mod hash;
pub mod journal;
mod losses;
mod nan;
pub mod observe;
mod overview;
pub mod pareto;
pub mod physics;
mod picture;
mod probe;
pub mod problem;
pub mod record;
pub mod registry;
pub mod report;
pub mod residual;
pub mod rest;
pub mod results;
pub mod rivalry;
pub mod setting;
mod state;
pub mod sweep;
mod timing;
mod words;

pub use budget::Budget;
pub use choose::{Choice, Goal, choose, choose_from};
pub use closed_form::Reference;
pub use error::StudyError;
pub use observe::{Observe, Observed};
pub use probe::{PROJECTIONS, Probe, ProbeNews, ProbePoint, ROUNDS, probe};
pub use problem::{Case, Problem};
pub use results::Study;
pub use setting::{Method, Setting};
pub use state::{BodyState, Solver, State};

use journal::Journal;
use record::{Header, ProblemText, Record};
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

/// What a study is to be of.
#[derive(Debug, Clone)]
pub struct Options {
    /// Names of built-in problems or paths of files; none for all that are built in.
    pub problems: Vec<String>,
    /// What it may spend.
    pub budget: Budget,
    /// The folder for its points.
    pub folder: PathBuf,
    /// Whether to go on with what is in that folder.
    pub resume: bool,
    /// Only the case of this name, as in `hanging_mass@1`.
    pub only: Option<String>,
}

/// Problems with all their cases, and what a study of them is.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The problems.
    pub problems: Vec<Problem>,
    /// All their cases.
    pub cases: Vec<Case>,
    /// What a study of them is.
    pub header: Header,
    texts: Vec<ProblemText>,
}

impl Plan {
    /// Reads problems and builds their cases.
    ///
    /// # Errors
    /// [`StudyError`] for a problem that is not there, is broken, or cannot be built.
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

    /// The case of this name.
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

/// Makes a study, or the part of it that is asked for; `told` hears the share that is done, from 0
/// to 1.
///
/// # Errors
/// [`StudyError`]; what was found until then is in the points file.
pub fn run(options: &Options, told: impl FnMut(f64) + Send) -> Result<Study, StudyError> {
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
    let found = sweep::run(&cases, &options.budget, &known, &mut journal, told)?;
    let records = [known, found].concat();
    Study::new(plan.header, &plan.problems, &options.budget, &records)
}

/// Puts the points of several folders together, in a new points file in `folder`.
///
/// # Errors
/// [`StudyError`] if one of them holds no points, or those of another study.
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
                // Times of one point from two machines must not be mixed: the first stand.
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
