//! The combined results of a study: errors, costs, Pareto fronts.

use super::{
    StudyError,
    budget::Budget,
    closed_form::Reference,
    converge::Converged,
    hash,
    observe::distance,
    pareto,
    problem::{Case, Problem},
    record::{Header, Record, ReferenceRecord, RunRecord, TimeRecord},
    setting::{Method, Setting},
};
use crate::bench::Spread;

/// A study, complete or assembled from parts.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Study {
    /// Its identity.
    pub header: Header,
    /// Its problems, in order.
    pub problems: Vec<ProblemResult>,
    /// The machines on which settings were timed.
    pub machines: Vec<String>,
}

/// The results of a problem.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct ProblemResult {
    /// The problem.
    pub problem: Problem,
    /// The value for the continuum, by a closed form or by mesh extrapolation, in its unit.
    pub reference: Option<f64>,
    /// Order of convergence under mesh refinement, where three meshes show one.
    pub mesh_order: Option<f64>,
    /// Its meshes, from coarse to fine.
    pub cases: Vec<CaseResult>,
}

/// The results on a mesh.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct CaseResult {
    /// The case.
    pub case: Case,
    /// The converged solution, if the budget allows it.
    pub converged: Option<Converged>,
    /// Normalization of errors, in the unit of the observed value.
    pub scale: Option<f64>,
    /// Error of the converged solution against the continuum: 0.01 is 1 %.
    pub mesh_error: Option<f64>,
    /// All settings, including those that were skipped.
    pub points: Vec<Point>,
}

/// A setting on a mesh.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Point {
    /// How it was solved.
    pub setting: Setting,
    /// Constraint projections per tick.
    pub projections_per_tick: u64,
    /// Substep [s].
    pub h: f64,
    /// The run; none if it was skipped as too expensive or has not been made yet.
    pub run: Option<RunRecord>,
    /// Distance to the converged solution: 0.01 is 1 %.
    pub error: Option<f64>,
    /// Whether the error is smaller than the uncertainty of the converged solution.
    pub below_reference: bool,
    /// The value that the discrete method itself should give, where a closed form is known.
    pub predicted: Option<f64>,
    /// Time per simulated second on one thread [ms].
    pub ms: Option<Spread>,
    /// Same with all threads, where the solver uses them, with their number.
    pub ms_all: Option<(usize, Spread)>,
    /// The machine that it was timed on.
    pub machine: Option<String>,
    /// Hash of its scene and settings.
    pub hash: String,
}

impl Point {
    /// Cost [ms per simulated second] and error, if the point is valid: it was timed, and its run
    /// produced a usable result.
    #[must_use]
    pub fn cost_and_error(&self) -> Option<(f64, f64)> {
        let settled = self.run.as_ref().is_some_and(|run| run.observed.settled);
        let (ms, error) = (self.ms?, self.error?);
        (settled && error.is_finite()).then_some((ms.median, error))
    }

    /// The observed value, if it is a single number.
    #[must_use]
    pub fn value(&self) -> Option<f64> {
        match self.run.as_ref()?.observed.values[..] {
            [value] => Some(value),
            _ => None,
        }
    }

    /// Whether it came to rest, or the awaited event occurred.
    #[must_use]
    pub fn settled(&self) -> bool {
        self.run.as_ref().is_some_and(|run| run.observed.settled)
    }

    /// Whether its time is within timing noise of another's: their ranges from lowest to highest
    /// overlap.
    #[must_use]
    pub fn is_within_noise_of(&self, other: &Self) -> bool {
        match (self.ms, other.ms) {
            (Some(a), Some(b)) => a.low <= b.high && b.low <= a.high,
            _ => false,
        }
    }
}

impl Study {
    /// Combines records. `cases` are those of `problems`, in order.
    ///
    /// # Errors
    /// [`StudyError`] for a problem whose scene cannot be built.
    pub fn new(
        header: Header,
        problems: &[Problem],
        budget: &Budget,
        records: &[Record],
    ) -> Result<Self, StudyError> {
        let mut machines: Vec<String> = Vec::new();
        for record in records {
            if let Record::Time(time) = record
                && !machines.contains(&time.machine)
            {
                machines.push(time.machine.clone());
            }
        }
        let problems = problems
            .iter()
            .map(|problem| problem_result(problem, budget, records))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            header,
            problems,
            machines,
        })
    }
}

fn problem_result(
    problem: &Problem,
    budget: &Budget,
    records: &[Record],
) -> Result<ProblemResult, StudyError> {
    let mut cases: Vec<CaseResult> = problem
        .cases()?
        .into_iter()
        .map(|case| case_result(case, budget, records))
        .collect();
    let mut reference = problem.reference.value();
    let mut mesh_order = None;
    if problem.reference == Reference::FinestMesh {
        let answers: Vec<f64> = cases.iter().filter_map(CaseResult::answer).collect();
        (reference, mesh_order) = tend_to(&answers);
    }
    let finest = cases.iter().rposition(|case| case.answer().is_some());
    for (place, case) in cases.iter_mut().enumerate() {
        // The finest mesh would be compared with itself: the error of 0 means nothing.
        let itself = problem.reference == Reference::FinestMesh
            && mesh_order.is_none()
            && finest == Some(place);
        if let (Some(reference), Some(answer), Some(scale), false) =
            (reference, case.answer(), case.scale, itself)
        {
            case.mesh_error = Some((answer - reference).abs() / scale);
        }
    }
    Ok(ProblemResult {
        problem: problem.clone(),
        reference,
        mesh_order,
        cases,
    })
}

/// Orders of mesh convergence at which extrapolation is accepted.
const MESH_ORDERS: std::ops::RangeInclusive<f64> = 0.5..=4.0;

/// The limit of results on successively finer meshes, each with twice the cells of the one before,
/// and the order if there is one; otherwise the result of the finest of two or more.
fn tend_to(answers: &[f64]) -> (Option<f64>, Option<f64>) {
    match *answers {
        [.., a, b, c] => {
            let order = ((b - a) / (c - b)).log2();
            if MESH_ORDERS.contains(&order) {
                (Some(c + (c - b) / (order.exp2() - 1.0)), Some(order))
            } else {
                (Some(c), None)
            }
        }
        [_, b] => (Some(b), None),
        _ => (None, None),
    }
}

fn case_result(case: Case, budget: &Budget, records: &[Record]) -> CaseResult {
    let id = case.id();
    let mut converged = None;
    let mut runs: Vec<&RunRecord> = Vec::new();
    let mut times: Vec<&TimeRecord> = Vec::new();
    for record in records {
        match record {
            Record::Reference(ReferenceRecord {
                case,
                converged: found,
            }) if *case == id => converged.clone_from(found),
            Record::Run(run) if run.case == id => runs.push(run),
            Record::Time(time) if time.case == id => times.push(time),
            _ => {}
        }
    }
    // If one of the f64 reference's runs diverged, the other alone has no known uncertainty.
    converged = converged.filter(|converged: &Converged| converged.uncertainty.is_finite());
    let scale = case
        .problem
        .percent_of
        .or_else(|| case.problem.observe.natural_scale(&case.start, &case.world))
        .or_else(|| match converged.as_ref()?.values[..] {
            [value] => Some(value.abs()),
            _ => None,
        })
        .filter(|&scale| scale > 0.0);
    let points = budget
        .settings(&case)
        .into_iter()
        .map(|setting| {
            let run = runs.iter().find(|run| run.setting == setting);
            point(
                &case,
                setting,
                run.copied(),
                &times,
                converged.as_ref(),
                scale,
            )
        })
        .collect();
    CaseResult {
        case,
        converged,
        scale,
        mesh_error: None,
        points,
    }
}

fn point(
    case: &Case,
    setting: Setting,
    run: Option<&RunRecord>,
    times: &[&TimeRecord],
    converged: Option<&Converged>,
    scale: Option<f64>,
) -> Point {
    let h = 1.0 / (case.world.settings.rate.get() * f64::from(setting.substeps));
    let off = run
        .zip(converged)
        .map(|(run, converged)| distance(&run.observed.values, &converged.values));
    let timed = |alone: bool| {
        let mut all = times.iter().filter(|time| time.setting == setting);
        let time = all.find(|time| (time.threads == 1) == alone)?;
        Some((time, Spread::of(time.ms_per_second.clone())))
    };
    let predicted = match setting.method {
        Method::Xpbd | Method::Direct => case
            .problem
            .reference
            .predicted(h, case.world.settings.order),
        Method::Pbd => None,
    };
    Point {
        setting,
        projections_per_tick: setting.projections(&case.world),
        h,
        run: run.cloned(),
        error: off.zip(scale).map(|(off, scale)| off / scale),
        below_reference: off
            .zip(converged)
            .is_some_and(|(off, converged)| off < converged.uncertainty),
        predicted,
        ms: timed(true).map(|(_, spread)| spread),
        ms_all: timed(false).map(|(time, spread)| (time.threads, spread)),
        machine: timed(true).map(|(time, _)| time.machine.clone()),
        hash: hash::of(&format!("{} {} {setting}", case.problem.hash, case.id())),
    }
}

impl CaseResult {
    /// The converged value, if it is a single number and was found.
    #[must_use]
    pub fn answer(&self) -> Option<f64> {
        match self.converged.as_ref()?.values[..] {
            [value] if value.is_finite() => Some(value),
            _ => None,
        }
    }

    /// Hash of the scene and all settings.
    #[must_use]
    pub fn hash(&self) -> String {
        let all: Vec<&str> = self.points.iter().map(|point| &point.hash[..]).collect();
        hash::of(&all.join(" "))
    }

    /// Indices of the valid points, and their costs and errors.
    fn counting(&self) -> (Vec<usize>, Vec<(f64, f64)>) {
        let all = self.points.iter().enumerate();
        all.filter_map(|(place, point)| Some((place, point.cost_and_error()?)))
            .unzip()
    }

    /// Points on the Pareto front of cost and error, from the cheapest.
    #[must_use]
    pub fn front(&self) -> Vec<&Point> {
        let (places, figures) = self.counting();
        let front = pareto::front(&figures).into_iter();
        front.map(|place| &self.points[places[place]]).collect()
    }

    /// The cheapest point whose error is at most `error`, and others within timing noise of it.
    #[must_use]
    pub fn cheapest(&self, error: f64) -> Option<(&Point, Vec<&Point>)> {
        let (places, figures) = self.counting();
        let best = &self.points[places[pareto::cheapest(&figures, error)?]];
        let rivals = places
            .iter()
            .zip(&figures)
            .filter(|(_, figure)| figure.1 <= error)
            .map(|(&place, _)| &self.points[place])
            .filter(|point| point.setting != best.setting && best.is_within_noise_of(point))
            .collect();
        Some((best, rivals))
    }

    /// The smallest error of all valid points.
    #[must_use]
    pub fn best(&self) -> Option<&Point> {
        self.front().last().copied()
    }
}

impl ProblemResult {
    /// Whether there is a point to plot.
    #[must_use]
    pub fn drawable(&self) -> bool {
        self.cases.iter().any(|case| case.best().is_some())
    }
}

impl ProblemResult {
    /// The finest mesh among those with errors at the most settings; statements about a problem
    /// refer to it.
    #[must_use]
    pub fn finest_with_errors(&self) -> Option<&CaseResult> {
        let count = |case: &CaseResult| {
            let points = case.points.iter();
            points
                .filter(|point| point.cost_and_error().is_some())
                .count()
        };
        self.cases
            .iter()
            .filter(|case| count(case) > 0)
            .max_by_key(|case| (count(case), case.case.level))
    }
}

impl CaseResult {
    /// The point with this setting.
    #[must_use]
    pub fn point(&self, setting: Setting) -> Option<&Point> {
        self.points.iter().find(|point| point.setting == setting)
    }

    /// Uncertainty of the converged solution: 0.01 is 1 %.
    #[must_use]
    pub fn doubt(&self) -> Option<f64> {
        let converged = self.converged.as_ref()?;
        Some(converged.uncertainty / self.scale?)
    }

    /// Number of machines on which it was timed.
    #[must_use]
    pub fn machines(&self) -> usize {
        let all = self
            .points
            .iter()
            .filter_map(|point| point.machine.as_ref());
        all.collect::<std::collections::BTreeSet<_>>().len()
    }
}
