//! The report of the stress tests: what it says about failures that are known and about others.

use pliant::torture::{EXPECTED_FAILURES, Options, SuiteRow, jobs, report, run};
use std::fs;

/// Real outcomes of a small case.
fn rows() -> Vec<SuiteRow> {
    let options = Options {
        cases: vec!["edge".to_owned()],
        member: None,
        quick: true,
        mixtures: 1,
    };
    let jobs = jobs(&options).expect("a case");
    run(&jobs, 1, &|_| ()).expect("members that can be built")
}

/// The page of these rows.
fn page(name: &str, rows: &[SuiteRow]) -> String {
    let folder = std::env::temp_dir().join(format!("pliant-report-{}-{name}", std::process::id()));
    report::write(&folder, rows).expect("a folder that can be written");
    let page = fs::read_to_string(folder.join("report.html")).expect("a page");
    fs::remove_dir_all(folder).expect("it was made here");
    page
}

#[test]
fn an_unexpected_failure_is_named_in_the_verdict_and_its_case_is_open() {
    let mut rows = rows();
    let passed = page("passed", &rows);
    assert!(passed.contains("class=\"verdict passed\""));
    assert!(passed.contains("<strong>Passed: no unexpected failures</strong>"));
    assert!(passed.contains("<details id=\"case-edge\">"));

    let outcome = &mut rows[0].outcomes[0];
    outcome.figures[0].value = f64::NAN;
    let (number, measure) = (outcome.number, outcome.figures[0].name);
    let failed = page("failed", &rows);
    assert!(failed.contains("class=\"verdict failed\""));
    assert!(failed.contains("<strong>1 unexpected failure</strong>"));
    assert!(failed.contains("<title>Robustness: 1 unexpected failure</title>"));
    assert!(failed.contains(&format!("<span>edge {number} ")));
    assert!(failed.contains("<details id=\"case-edge\" open>"));
    let crosses = failed.matches("<i class=\"u\"").count();
    assert_eq!(crosses, 2, "one in the legend, one in the map");
    let command = format!("<code>pliant torture edge --member {number}</code>");
    assert!(failed.contains(&command) && failed.contains(measure));
}

#[test]
fn a_known_failure_does_not_fail_and_a_pass_of_it_needs_attention() {
    let mut rows = rows();
    rows[0].expected = Some(&EXPECTED_FAILURES[0]);
    let all = rows[0].outcomes.len();
    let surprise = page("surprise", &rows);
    assert!(surprise.contains("class=\"verdict attention\""));
    assert!(surprise.contains(&format!("Passed, with {all} unexpected passes")));
    for outcome in &mut rows[0].outcomes {
        outcome.figures[0].value = f64::NAN;
    }
    let known = page("known", &rows);
    assert!(known.contains("class=\"verdict passed\""));
    assert!(known.contains(&format!("{all} expected failures")));
    assert!(known.contains("<details id=\"case-edge\">"));
}
