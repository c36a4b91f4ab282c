//! Diagrams and table of `docs/results/accuracy.md` are regenerated from the points in
//! `assets/readme/study`, and the points that they show are recomputed.

use pliant::study::{
    self, Budget, CaseResult, Method, Options, Plan, Point, Setting, Study,
    converge::{Converged, converge},
    journal::{self, Journal},
    record::Record,
    report,
    sweep::run_one,
};
use std::{
    fs,
    path::{Path, PathBuf},
};

/// Rows of the table.
const PROBLEMS: [&str; 10] = [
    "hanging_mass",
    "spring_energy",
    "pendulum_energy",
    "chain_0",
    "chain_1e-5",
    "chain_1e-3",
    "cantilever_4",
    "cantilever_8",
    "twisted_bar",
    "jelly_cube",
];

/// Problems with a diagram.
const DIAGRAMS: [&str; 3] = ["spring_energy", "chain_1e-3", "cantilever_8"];

/// Limits on the work of a run, and of a reference's runs, that are recomputed: all exhibits
/// together take a few seconds.
const AGAIN: (u64, u64) = (8_000_000, 30_000_000);

/// Numbers may change in the last digit when written and read, and so may the reference's where the
/// platform's sine differs, which affects rotated bodies of a scene.
const SAME: f64 = 1e-9;

/// Values below this [m] count as zero: meters in f64 are accurate to 2e-16 m, and about a thousand
/// iterations increase that to 1e-13 m.
const NOTHING: f64 = 1e-13 / SAME;

const BEGIN: &str = "<!-- what accuracy costs: begin -->\n";
const END: &str = "<!-- what accuracy costs: end -->";

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// An empty folder for this test.
fn temporary(name: &str) -> PathBuf {
    let name = format!("pliant-exhibits-{}-{name}", std::process::id());
    let folder = std::env::temp_dir().join(name);
    let _ = fs::remove_dir_all(&folder);
    folder
}

fn problems() -> Vec<String> {
    PROBLEMS.map(str::to_owned).to_vec()
}

/// Makes the study, and keeps the exhibited part of it.
fn mint(points: &Path) {
    let folder = temporary("mint");
    let options = Options {
        problems: problems(),
        budget: Budget::full(),
        folder: folder.clone(),
        resume: false,
        only: None,
    };
    let study = study::run(&options, |_| {}).expect("it can be made");
    let (header, records, _) = journal::read(&folder).expect("it was written");
    let mut kept = Journal::create(points, &header, &[]).expect("writable");
    for record in records.iter().filter(|record| shown(&study, record)) {
        kept.append(record).expect("writable");
    }
    fs::remove_dir_all(folder).expect("it was made here");
}

/// Whether a record is needed: all records of a diagram; for a row of the table, those that it is
/// derived from, and the converged solutions of the other meshes, which mesh errors refer to.
fn shown(study: &Study, record: &Record) -> bool {
    let case = match record {
        Record::Reference(reference) => &reference.case,
        Record::Run(run) => &run.case,
        Record::Time(time) => &time.case,
        _ => return true,
    };
    let of_case = |result: &&CaseResult| result.case.id() == *case;
    let problem = study.problems.iter().find(|problem| {
        let mut cases = problem.cases.iter();
        cases.any(|result| of_case(&result))
    });
    let problem = problem.expect("a record is of a problem");
    if DIAGRAMS.contains(&&problem.problem.name[..]) {
        return true;
    }
    let shown_case = problem.finest_with_errors().filter(of_case);
    let documented_settings = shown_case.map(documented_settings).unwrap_or_default();
    match record {
        Record::Reference(reference) => {
            // A path, with the positions of all particles, is not a single value of a mesh.
            let one = |converged: &Converged| converged.values.len() == 1;
            shown_case.is_some() || reference.converged.as_ref().is_some_and(one)
        }
        Record::Run(run) => documented_settings.contains(&run.setting),
        Record::Time(time) => documented_settings.contains(&time.setting),
        _ => true,
    }
}

/// Settings from which a row of the table is derived: the front, the points that show coincidental
/// agreement, those with costs within timing noise, and the best without coincidence.
fn documented_settings(case: &CaseResult) -> Vec<Setting> {
    let front = case.front();
    let coincidences = front.iter().filter_map(|point| case.coincidence(point));
    let mut points: Vec<&Point> = coincidences.chain(case.best_sound()).collect();
    for target in report::TARGETS {
        points.extend(case.cheapest_sound(target));
        points.extend(
            case.cheapest(target)
                .map(|(_, rivals)| rivals)
                .unwrap_or_default(),
        );
    }
    let all = front.iter().chain(&points);
    all.map(|point| point.setting).collect()
}

/// The table of the report, and its source.
fn exhibit(report: &str, study: &Study) -> String {
    let table = report.split("## What 1 % costs\n\n").nth(1);
    let table = table.and_then(|rest| rest.split("\n\n").next());
    format!(
        "{}\n\n*Milliseconds of one thread for a simulated second, at the setting that costs least, \
         as substeps × iterations a tick of 1/60 s; within noise where the times of another overlap; {}.*\n",
        table.expect("a report begins with it"),
        study.machines.join("; "),
    )
}

/// More substeps do not increase the error: from one number of substeps to its double, of XPBD and
/// of the direct solver, no error rises by more than a tenth. An error that passes through 0 may
/// rise again on the other side. Rest is accurate to 0.1 % of its load, the imbalance that counts
/// as rest. With one substep of one iteration, a stiff body hardly moves at all, which may be close
/// to the solution by coincidence.
#[test]
fn no_error_rises_with_the_substeps() {
    const IMBALANCE: f64 = 1e-3;
    let folder = temporary("rising");
    let points = file("assets/readme/study");
    let study = study::merge(&[points], &folder).expect("its points are there");
    fs::remove_dir_all(folder).expect("it was made here");
    let mut doublings = 0;
    for case in study.problems.iter().flat_map(|problem| &problem.cases) {
        let answer = case.converged.as_ref().map(|converged| &converged.values);
        let counts = |point: &&Point| {
            let method = point.setting.method;
            point.settled()
                && matches!(method, Method::Xpbd | Method::Direct)
                && point.h < 1.0 / 60.0
        };
        for coarse in case.points.iter().filter(counts) {
            let double = Setting {
                substeps: 2 * coarse.setting.substeps,
                ..coarse.setting
            };
            let mut finer = case.points.iter().filter(counts);
            let Some(fine) = finer.find(|point| point.setting == double) else {
                continue;
            };
            let (Some(before), Some(after)) = (coarse.error, fine.error) else {
                continue;
            };
            doublings += 1;
            let side = |point: &Point| match answer.map(|values| &values[..]) {
                Some([answer]) => point.value().map(|value| value < *answer),
                _ => None,
            };
            let passes = side(coarse) != side(fine);
            assert!(
                passes || after <= 1.1 * before + IMBALANCE,
                "{}: {before} at {}, {after} at {double}",
                case.case.id(),
                coarse.setting
            );
        }
    }
    assert!(doublings > 200, "only {doublings}");
}

/// After an intended change, `PLIANT_MINT=1 cargo test --release the_documented_accuracy`
/// recomputes them in some minutes; no other load should run meanwhile.
#[test]
fn the_documented_accuracy_is_what_the_study_finds() {
    let minting = std::env::var_os("PLIANT_MINT").is_some();
    let points = file("assets/readme/study");
    if minting {
        mint(&points);
    }
    let folder = temporary("now");
    let study = study::merge(std::slice::from_ref(&points), &folder).expect("its points are there");
    report::write(&folder, &study).expect("writable");
    let budget = Budget::full();
    let plan = Plan::new(&problems(), &budget).expect("built-in problems");
    assert_eq!(
        plan.header.hash, study.header.hash,
        "problems or budget are others now"
    );

    let document = read(&file("docs/results/accuracy.md"));
    let (before, rest) = document.split_once(BEGIN).expect("where it begins");
    let (_, after) = rest.split_once(END).expect("where it ends");
    let table = exhibit(&read(&folder.join("report.md")), &study);
    let right = format!("{before}{BEGIN}{table}{END}{after}");
    if minting {
        fs::write(file("docs/results/accuracy.md"), &right).expect("writable");
    } else {
        assert_eq!(document, right);
    }
    for name in DIAGRAMS {
        let drawn = read(&folder.join(format!("{name}.svg")));
        let path = points.join(format!("{name}.svg"));
        if minting {
            fs::write(&path, &drawn).expect("writable");
        } else {
            assert!(drawn == read(&path), "{} is stale", path.display());
        }
        assert!(document.contains(&format!("(../../assets/readme/study/{name}.svg)")));
    }
    fs::remove_dir_all(folder).expect("it was made here");

    let cases = || study.problems.iter().flat_map(|problem| &problem.cases);
    std::thread::scope(|scope| {
        scope.spawn(|| cases().for_each(converges_again));
        for case in cases() {
            for point in case.front() {
                comes_out_again(case, point, &budget);
            }
        }
    });
}

fn same(then: &[f64], now: &[f64]) -> bool {
    let size = |values: &[f64]| {
        values
            .iter()
            .fold(0.0_f64, |most, value| most.max(value.abs()))
    };
    let deviation = then.iter().zip(now).map(|(a, b)| (a - b).abs());
    then.len() == now.len() && deviation.fold(0.0, f64::max) <= SAME * size(then).max(NOTHING)
}

fn converges_again(result: &CaseResult) {
    if let Some(then) = &result.converged
        && result.case.reference_work() <= AGAIN.1
    {
        let now = converge(&result.case).expect("sound settings");
        let id = result.case.id();
        assert!(
            same(&then.values, &now.values),
            "{id}: the reference's answer is {:?}, not {:?}",
            now.values,
            then.values
        );
    }
}

fn comes_out_again(result: &CaseResult, point: &Point, budget: &Budget) {
    let (case, setting) = (&result.case, point.setting);
    let then = point.run.as_ref().expect("a point of the front was run");
    if case.work(setting) <= AGAIN.0 {
        let seconds = budget.run_seconds(case, setting).expect("it was run");
        let now = run_one(case, setting, seconds).expect("sound settings");
        assert!(
            same(&then.observed.values, &now.observed.values),
            "{} at {setting}: {:?}, not {:?}",
            case.id(),
            now.observed.values,
            then.observed.values
        );
        assert_eq!(then.observed.settled, now.observed.settled);
        assert_eq!(point.projections_per_tick, setting.projections(&case.world));
    }
}

/// A rigid chain of 32 links coincidentally sags like a soft one as long as 4 × 2 iterations do not
/// propagate through it.
#[test]
fn coincidental_agreement_is_distinguished_from_accuracy() {
    let folder = temporary("coincidence");
    let points = file("assets/readme/study");
    let study = study::merge(&[points], &folder).expect("its points are there");
    fs::remove_dir_all(folder).expect("it was made here");
    let mut problems = study.problems.iter();
    let chain = problems.find(|problem| problem.problem.name == "chain_1e-3");
    let case = &chain.expect("it is shown").cases[0];
    let lucky = Setting {
        method: Method::Pbd,
        ..Setting::xpbd(4, 2)
    };
    let lucky = case.point(lucky).expect("it was tried");
    assert!(lucky.error.is_some_and(|error| error < 0.01));
    let shown = case.coincidence(lucky).expect("more iterations are worse");
    // Without compliance it hangs 5 cm too high of 1 m.
    assert!(shown.error.is_some_and(|error| error > 0.04));
    let sound = case.cheapest_sound(0.01).expect("1 % is reached");
    assert_eq!(sound.setting.method, Method::Xpbd);
    let mut sound = case
        .points
        .iter()
        .filter(|point| point.setting.method == Method::Xpbd);
    assert!(sound.all(|point| case.coincidence(point).is_none()));
}
