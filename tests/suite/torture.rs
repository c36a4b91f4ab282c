//! The hard cases: they pass, the documents state their results, and a solver with a defect would
//! be detected.

use glam::Vec4;
use pliant::{
    output::document::{self, Block},
    solver::{
        Threads, VertexIndex, World,
        deform::{Deformation, deform},
    },
    torture::{
        CASES, Case, EXPECTED_FAILURES, Figure, Job, Kind, Member, Options, Outside, Run, Shape,
        SuiteRow, Watch, jobs, run, run_given, table,
    },
};
use std::{collections::HashMap, env, fs, path::Path};

const BEGIN: &str = "<!-- hard cases: begin -->\n";
const END: &str = "<!-- hard cases: end -->";

fn quick() -> Options {
    Options {
        cases: Vec::new(),
        member: None,
        quick: true,
        mixtures: 1,
    }
}

fn rows(options: &Options, threads: usize) -> Vec<SuiteRow> {
    let jobs = jobs(options).expect("cases that there are");
    run(&jobs, threads, &|_| ()).expect("members that can be built")
}

fn of(case: &str) -> Options {
    Options {
        cases: vec![case.to_owned()],
        ..quick()
    }
}

/// The part of docs/results/robustness.md that is generated: the table, and the expected failures.
fn exhibit(rows: &[SuiteRow]) -> String {
    let cells = rows.iter().map(|row| table::cells(row).to_vec());
    document::markdown(&[
        Block::Text(table::summary(rows)),
        Block::table("", &table::HEAD, cells.collect()),
        Block::Heading(2, "Expected failures, one by one".to_owned()),
        Block::List(table::expected_failures(rows)),
    ])
}

/// The text of a file and the same with the part between the marks replaced.
fn renewed(file: &Path, between: &str) -> (String, String) {
    let text = fs::read_to_string(file).expect("the file is there");
    let (before, rest) = text.split_once(BEGIN).expect("where it begins");
    let (_, after) = rest.split_once(END).expect("where it ends");
    let right = format!("{before}{BEGIN}{between}{END}{after}");
    (text, right)
}

/// Fails with what was not expected of these members.
fn check(rows: &[SuiteRow]) {
    let (known, others): (Vec<_>, Vec<_>) = rows.iter().partition(|row| row.expected.is_some());
    let failures: Vec<String> = others.into_iter().flat_map(table::failures).collect();
    assert!(failures.is_empty(), "\n{}\n", failures.join("\n"));
    let outcomes = known.iter().flat_map(|row| &row.outcomes);
    let passes: Vec<String> = outcomes
        .filter(|outcome| outcome.passed())
        .map(|outcome| outcome.member.to_string())
        .collect();
    assert!(
        passes.is_empty(),
        "unexpected passes: {}",
        passes.join(", ")
    );
}

/// The rows of the documented table, by case and worst member.
fn documented(text: &str) -> HashMap<(String, String), [String; 8]> {
    let (_, after) = text.split_once(BEGIN).expect("where it begins");
    let (between, _) = after.split_once(END).expect("where it ends");
    let rows = between.lines().filter_map(|line| {
        let cells = line.strip_prefix("| ")?.strip_suffix(" |")?.split(" | ");
        let cells: Vec<String> = cells.map(|cell| cell.trim().to_owned()).collect();
        let cells = <[String; 8]>::try_from(cells).ok()?;
        cells[2].parse::<usize>().is_ok().then_some(cells)
    });
    let named = rows.map(|cells| ((cells[0].clone(), cells[3].clone()), cells));
    named.collect()
}

/// Members of the quick set pass except the expected failures, which all fail, and
/// docs/results/robustness.md and README contain their figures to the digit, as they are identical on
/// every machine.
///
/// The suite runs the members that the table of the documents names, all expected failures and every
/// sixteenth of the others: those of the table must still be the worst of their rows. On demand, all; and
/// after an intended change, all, and the documents are written anew:
///
/// ```sh
/// PLIANT_FUZZ=1 cargo test --release --test suite -- the_quick_set
/// PLIANT_MINT=1 cargo test --release --test suite -- the_quick_set
/// ```
#[test]
fn the_quick_set_passes_and_the_documents_state_its_results() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let [robustness, readme] =
        ["docs/results/robustness.md", "README.md"].map(|name| root.join(name));
    let mut jobs = jobs(&quick()).expect("cases that there are");
    let members = jobs.len();
    let [mints, is_whole] = ["PLIANT_MINT", "PLIANT_FUZZ"].map(|it| env::var_os(it).is_some());
    let threads = Threads::new(0).expect("threads").count();
    if mints || is_whole {
        let rows = run(&jobs, threads, &|_| ()).expect("members that can be built");
        check(&rows);
        let summary = format!("{}\n", table::summary(&rows));
        for (file, between) in [(robustness, exhibit(&rows)), (readme, summary)] {
            let (text, right) = renewed(&file, &between);
            if mints {
                fs::write(file, right).expect("writable");
            } else {
                assert!(text == right, "{} is stale", file.display());
            }
        }
        return;
    }

    let documented = documented(&fs::read_to_string(robustness).expect("the file is there"));
    let name = |job: &Job| {
        let member = format!("{} {}", job.number, job.member);
        (job.case.name.to_owned(), member)
    };
    let fails = |job: &Job| {
        let of_case = EXPECTED_FAILURES
            .iter()
            .filter(|it| it.case == job.case.name);
        let mut all = of_case.flat_map(|it| it.members);
        all.any(|member| *member == job.member.to_string())
    };
    let mut count = 0;
    jobs.retain(|job| {
        count += 1;
        count % 16 == 0 || documented.contains_key(&name(job)) || fails(job)
    });
    let rows = run(&jobs, threads, &|_| ()).expect("members that can be built");
    check(&rows);
    for row in &rows {
        let mut cells = table::cells(row);
        let said = documented.get(&(cells[0].clone(), cells[3].clone()));
        let said = said.unwrap_or_else(|| panic!("worse than documented: {cells:?}"));
        cells[2].clone_from(&said[2]);
        assert_eq!(cells, *said, "docs/results/robustness.md is stale");
    }
    assert_eq!(
        rows.len(),
        documented.len(),
        "rows of docs/results/robustness.md"
    );
    let all = documented.values().map(|cells| cells[2].parse::<usize>());
    let all: usize = all.map(|count| count.expect("a number")).sum();
    assert_eq!(all, members, "members of docs/results/robustness.md");
    let text = fs::read_to_string(readme).expect("the file is there");
    let said = text.contains(&format!("{members} members of "));
    assert!(said, "README.md is stale");
}

/// Every expected failure names a member of its case, and no member twice.
#[test]
fn expected_failures_name_existing_members() {
    let mut seen = Vec::new();
    for expected in EXPECTED_FAILURES {
        let case = Case::named(expected.case).expect("a case");
        let names: Vec<String> = (case.family)(1).iter().map(Member::to_string).collect();
        for &member in expected.members {
            assert!(
                names.iter().any(|name| name == member),
                "{}: {member}",
                case.name
            );
            assert!(
                !seen.contains(&(case.name, member)),
                "{}: {member}",
                case.name
            );
            seen.push((case.name, member));
        }
    }
}

#[test]
fn names_of_cases_and_of_their_members_are_all_different() {
    for (index, case) in CASES.iter().enumerate() {
        assert!(CASES[..index].iter().all(|other| other.name != case.name));
        let mut names: Vec<String> = (case.family)(1).iter().map(Member::to_string).collect();
        let count = names.len();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), count, "{}: two members of one name", case.name);
    }
}

/// The first quick member of each kind of body, in the initial state of a case.
fn beginnings(case: &'static Case) -> Vec<(Member, World)> {
    let members = (case.family)(1);
    let first = Kind::ALL.into_iter().filter_map(|kind| {
        members
            .iter()
            .find(|m| m.quick && m.shape.kind() == kind)
            .copied()
    });
    first
        .map(|member| {
            let mut world = member.world().expect("it can be built");
            case.begin(&member, &mut world).expect("it can begin");
            (member, world)
        })
        .collect()
}

/// Each case about shapes detects a solver that does nothing.
#[test]
fn a_body_that_is_left_in_its_hard_case_does_not_pass() {
    let shapes = [
        "squashed",
        "point",
        "line",
        "shuffled",
        "mirrored",
        "inside_out",
        "tenfold",
        "element",
        "edge",
        "meshes",
        "overlap",
    ];
    for name in shapes {
        let case = Case::named(name).expect("it is there");
        for (member, world) in beginnings(case) {
            if name == "line" && member.shape.kind() == Kind::Rope {
                continue; // It is one.
            }
            let run = Run {
                member: &member,
                watch: Watch::new(&world, case.outside, false),
                start: world.clone(),
                end: world,
            };
            let figures = (case.judge)(&run).expect("it can be judged");
            assert!(
                !figures.iter().all(Figure::holds),
                "{name} {member}: {figures:?}"
            );
        }
    }
}

/// Failed figures of a watch after a change of the world between two ticks.
fn found(spoil: impl Fn(&mut World)) -> Vec<&'static str> {
    let mut world = Member::of(Shape::Cube(2)).world().expect("it can be built");
    let body = &mut world.bodies[0];
    body.pins = [0].map(VertexIndex).to_vec();
    body.update_masses();
    body.set_velocity(glam::Vec3::X);
    watch_it(world, spoil)
}

fn found_of_a_free_one(spoil: impl Fn(&mut World)) -> Vec<&'static str> {
    let mut world = Member::of(Shape::Cube(2)).world().expect("it can be built");
    world.bodies[0].set_velocity(glam::Vec3::X);
    watch_it(world, spoil)
}

fn watch_it(mut world: World, spoil: impl Fn(&mut World)) -> Vec<&'static str> {
    let mut watch = Watch::new(&world, Outside::Nothing, false);
    for _ in 0..10 {
        world.tick();
        watch.see(&world);
    }
    spoil(&mut world);
    world.tick();
    watch.see(&world);
    let figures = watch.figures();
    figures
        .iter()
        .filter(|figure| !figure.holds())
        .map(|figure| figure.name)
        .collect()
}

#[test]
fn violations_of_the_invariants_are_found() {
    assert_eq!(found(|_| ()), Vec::<&str>::new());
    assert_eq!(found_of_a_free_one(|_| ()), Vec::<&str>::new());
    let faster = |world: &mut World| {
        let particles = &mut world.bodies[0].particles;
        for i in 0..particles.len() {
            let v = particles.velocity(i);
            particles.set_velocity(i, v * 1.1);
        }
    };
    assert_eq!(
        found_of_a_free_one(faster),
        ["energy gained", "momentum gained"]
    );
    let pushed = |world: &mut World| world.bodies[0].translate(glam::Vec3::Y * 1e-6);
    assert_eq!(found(pushed), ["way of the pins"]);
    let spoilt = |world: &mut World| world.bodies[0].particles.positions[3].x = f32::NAN;
    assert!(found(spoilt).contains(&"bodies not finite"));
}

#[test]
fn a_figure_that_is_no_number_never_holds() {
    assert!(!Figure::new("x", f64::NAN, 1.0, "m").holds());
    assert_eq!(Figure::new("x", f64::NAN, 1.0, "m").load(), f64::INFINITY);
    assert!(Figure::none("x", 0, "m").holds() && !Figure::none("x", 1, "m").holds());
}

/// Members run in parallel; the result is the same for any number at once.
#[test]
fn rows_are_the_same_with_any_number_of_members_at_once() {
    let figures = |threads| -> Vec<_> {
        let rows = rows(&of("edge"), threads);
        let outcomes = rows.iter().flat_map(|row| row.outcomes.clone());
        outcomes
            .map(|outcome| (outcome.number, outcome.figures))
            .collect()
    };
    assert_eq!(figures(1), figures(3));
}

/// A case runs on a body of the user.
#[test]
fn a_case_runs_on_a_given_body() {
    let case = Case::named("squashed").expect("it is there");
    let world = Member::of(Shape::Cube(2)).world().expect("it can be built");
    let outcome = run_given(case, world.bodies[0].clone(), world.settings);
    let outcome = outcome.expect("it can be run");
    assert!(outcome.passed(), "{:?}", outcome.figures);
    let film = outcome.watch.expect("it was filmed").film;
    assert_ne!(film[0].1, film[2].1, "it moved");
}

#[test]
fn a_line_has_no_width_and_keeps_its_height() {
    let mut world = Member::of(Shape::Cube(2)).world().expect("it can be built");
    let particles = &mut world.bodies[0].particles;
    let before = particles.positions.clone();
    deform(particles, Deformation::Line);
    let on_line = |(x, was): (&Vec4, &Vec4)| x.x == 0.0 && x.z == 0.0 && x.y == was.y;
    assert!(particles.positions.iter().zip(&before).all(on_line));
}
