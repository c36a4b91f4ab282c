//! Recordings and snapshots from the command line.

use serde_json::Value;
use std::{
    fs,
    path::PathBuf,
    process::{Command, Output},
};

fn pliant(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_pliant"))
        .args(arguments)
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .output()
        .expect("the program starts")
}

fn words(output: &Output) -> String {
    let text = [&output.stdout[..], &output.stderr[..]].concat();
    String::from_utf8(text).expect("UTF-8")
}

fn json(arguments: &[&str]) -> Value {
    let output = pliant(arguments);
    serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", words(&output)))
}

/// A temporary folder for a test, removed when dropped.
pub struct Folder(PathBuf);

impl Folder {
    pub fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("pliant-{name}-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder for temporary files");
        Self(folder)
    }

    pub fn file(&self, name: &str) -> String {
        self.0.join(name).to_str().expect("UTF-8").to_owned()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // A folder that cannot be removed is no reason to fail.
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn a_run_that_was_stopped_and_goes_on_from_its_snapshot_has_the_same_hash() {
    let folder = Folder::new("snapshot");
    let file = folder.file("state.snap");
    for scene in ["bunny", "colliders"] {
        let set = ["--set", "substeps=6"];
        let hash = |arguments: &[&str]| {
            let all = [arguments, &["--json"]].concat();
            json(&all)["state_hash"]
                .as_str()
                .expect("a hash")
                .to_owned()
        };
        let whole = hash(&[&["run", scene, "--seconds", "1.5"][..], &set].concat());
        let half = ["run", scene, "--seconds", "0.75", "--snapshot", &file];
        let middle = hash(&[&half[..], &set].concat());
        assert_ne!(middle, whole);
        for threads in ["1", "2"] {
            let rest = [
                "run",
                "--from",
                &file,
                "--seconds",
                "0.75",
                "--threads",
                threads,
            ];
            assert_eq!(hash(&rest), whole, "{scene} on {threads} threads");
        }
    }
}

#[test]
fn a_recorded_run_replays_to_the_same_hash_and_says_so() {
    let folder = Folder::new("record");
    let file = folder.file("run.rec");
    let run = json(&[
        "run",
        "jelly_cube",
        "--seconds",
        "1",
        "--record",
        &file,
        "--json",
    ]);
    for threads in ["1", "2", "8"] {
        if threads != "1" && cfg!(not(feature = "parallel")) {
            continue;
        }
        let done = json(&["replay", &file, "--threads", threads, "--json"]);
        assert_eq!(done["same"], true);
        assert_eq!(done["complete"], true);
        assert_eq!(done["ticks"], 60);
        assert_eq!(done["state_hash"], run["state_hash"]);
    }
    let output = pliant(&["replay", &file]);
    assert_eq!(output.status.code(), Some(0));
    let said = words(&output);
    for word in ["identical: ", "60 ticks", "jelly_cube"] {
        assert!(said.contains(word), "{said}");
    }
}

#[test]
fn a_recording_of_another_run_is_exit_code_1_with_the_tick() {
    let folder = Folder::new("differs");
    let file = folder.file("run.rec");
    pliant(&["run", "jelly_cube", "--seconds", "1", "--record", &file]);
    let text = fs::read_to_string(&file).expect("written");
    let at = text.find("Hash(tick:30,hash:\"").expect("a hash") + 19;
    let other = if &text[at..=at] == "0" { "1" } else { "0" };
    fs::write(&file, [&text[..at], other, &text[at + 1..]].concat()).expect("written");
    let output = pliant(&["replay", &file]);
    assert_eq!(output.status.code(), Some(1));
    let said = words(&output);
    assert!(said.contains("different: at tick 30"), "{said}");
    assert!(said.contains("identical at tick 20"), "{said}");
    let done = json(&["replay", &file, "--json"]);
    assert_eq!(done["same"], false);
    assert_eq!(done["difference"]["tick"], 30);
    assert_eq!(done["difference"]["agreed_at_tick"], 20);
}

#[test]
fn files_of_another_kind_are_exit_code_2_with_the_reason() {
    let folder = Folder::new("foreign");
    let file = folder.file("foreign");
    fs::write(&file, "Scene(title: \"t\")").expect("written");
    let short = folder.file("short");
    // Too short for its acceptance; the snapshot is written all the same.
    pliant(&[
        "run",
        "jelly_cube",
        "--seconds",
        "0.1",
        "--snapshot",
        &short,
    ]);
    let whole = fs::read(&short).expect("a snapshot");
    fs::write(&short, &whole[..12]).expect("written");
    for (arguments, wanted) in [
        (&["replay", &file][..], "not a Pliant recording"),
        (&["replay", "./missing.rec"], "missing.rec"),
        (&["replay"], "FILE"),
        (&["run", "--from", &file], "not a Pliant snapshot"),
        (&["run", "--from", &short], "expected 28 bytes"),
        (&[short.as_str()], "expected 28 bytes"),
        (
            &["run", "jelly_cube", "--from", &file],
            "cannot be used with",
        ),
        (
            &["run", "jelly_cube", "--record", "no/such/x.rec"],
            "no/such",
        ),
        (
            &["run", "jelly_cube", "--snapshot", "no/such/x.snap"],
            "no/such",
        ),
    ] {
        let output = pliant(arguments);
        let said = words(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains(wanted), "{arguments:?}: {said}");
        assert!(!said.contains("panicked"), "{said}");
    }
}

#[test]
fn help_shows_how_to_record_to_replay_and_to_go_on() {
    for (arguments, wanted) in [
        (&["replay", "--help"][..], "pliant replay session.rec"),
        (&["run", "--help"], "pliant run --from cube.snap"),
    ] {
        let said = words(&pliant(arguments));
        assert!(said.contains("Example") && said.contains(wanted), "{said}");
    }
}
