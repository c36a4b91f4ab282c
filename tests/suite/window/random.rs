//! Random pointer, key and panel input in one scene after another: the window must survive it, stay
//! responsive, and what happened must replay to the same state.
//!
//! The suite takes two scenes of [`SECONDS_PER_SCENE`] each. More, with another seed:
//!
//! ```sh
//! PLIANT_RANDOM_SECONDS=3600 PLIANT_RANDOM_SEED=7 xvfb-run -a \
//!     cargo test --release --test suite -- window::random --nocapture
//! ```

use super::{POINTER, SIZE, Window, can_run, numbers, xdotool};
use serde_json::Value;
use std::{
    collections::BTreeMap,
    fs::File,
    io::{BufRead as _, BufReader},
    process::Command,
    time::{Duration, Instant},
};

/// Time of random input in a scene [s].
const SECONDS_PER_SCENE: u64 = 20;

/// Longest time after which an input must have had its effect, as processor time of the window: two
/// cores that are busy for 40 s. Shaders of a new scene are compiled in it. Processor time, because a
/// machine that does other things at the same time makes the window wait, which is no fault of it.
const RESPONSE: Duration = Duration::from_secs(80);

/// Longest time after which an input must have had its effect, however busy the machine is. A window
/// that hangs takes no processor time.
const WAIT: Duration = Duration::from_secs(600);

/// Scenes after which another window is opened. Software renderers of Mesa 22 keep about a megabyte
/// for each frame that they draw, here 10 to 25 MB per second: in 40 minutes they filled 22 GB.
const SCENES_PER_WINDOW: u64 = 15;

/// Keys of the window, as xdotool names them.
const KEYS: &[&str] = &[
    "space",
    "period",
    "comma",
    "ctrl+z",
    "ctrl+y",
    "r",
    "s",
    "e",
    "slash",
    "p",
    "u",
    "d",
    "x",
    "Delete",
    "Up",
    "Down",
    "Left",
    "Right",
    "f",
    "z",
    "l",
    "w",
    "t",
    "k",
    "m",
    "v",
    "o",
    "i",
    "a",
    "c",
    "g",
    "h",
    "F12",
    "shift+F12",
    "ctrl+s",
    "F9",
    "F10",
    "F1",
    "Escape",
    "ctrl+plus",
    "ctrl+minus",
    "ctrl+0",
    "Tab",
    "Return",
    "BackSpace",
    "question",
];

/// What is typed into fields.
const TEXTS: &[&str] = &[
    "0", "1", "-1", "1/3", "nan", "", "1e30", "1e-30", "0,5", "2*pi", "abc", "1e3", "10", "inf",
];

/// SplitMix64 (Steele, Lea, Flood 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }

    fn of<'a>(&mut self, all: &[&'a str]) -> &'a str {
        all[self.below(all.len())]
    }

    fn place(&mut self) -> [f64; 2] {
        [SIZE.0, SIZE.1].map(|size| self.below(size as usize) as f64)
    }
}

fn variable(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |value| value.parse().expect("a whole number"))
}

/// Moves of the pointer as arguments of xdotool.
fn moves(id: &str, places: &[[f64; 2]]) -> Vec<String> {
    let step = |[x, y]: &[f64; 2]| {
        let place = [x, y].map(|number| number.round().to_string());
        [
            "mousemove",
            "--window",
            id,
            &place[0],
            &place[1],
            "sleep",
            "0.03",
        ]
        .map(str::to_owned)
    };
    places.iter().flat_map(step).collect()
}

fn words(words: &[&str]) -> Vec<String> {
    words.iter().map(|word| (*word).to_owned()).collect()
}

/// What the journal says, read on from where it was left: an hour of it has a million lines.
struct Watch {
    journal: BufReader<File>,
    line: String,
    /// Widgets in sight by name: x, y, width, height [px].
    widgets: BTreeMap<String, [f64; 4]>,
    /// Where a body is [px], if it is in the window.
    body: Option<[f64; 2]>,
    /// Number of scenes that were opened, and the name of the last one.
    scenes: usize,
    scene: String,
    actions: usize,
    ticks: usize,
    /// Number of times that a widget came, moved or went.
    changes: usize,
    /// The newest figures.
    figures: Value,
}

impl Watch {
    fn new(window: &Window) -> Self {
        let journal = File::open(window.folder.join("journal.jsonl")).expect("a journal");
        Self {
            journal: BufReader::new(journal),
            line: String::new(),
            widgets: BTreeMap::new(),
            body: None,
            scenes: 0,
            scene: String::new(),
            actions: 0,
            ticks: 0,
            changes: 0,
            figures: Value::Null,
        }
    }

    fn read(&mut self) {
        while self.journal.read_line(&mut self.line).expect("UTF-8") > 0 {
            if !self.line.ends_with('\n') {
                // The rest of the line follows.
                return;
            }
            let event: Value = serde_json::from_str(&self.line).expect("a line of JSON");
            self.line.clear();
            self.take(event);
        }
    }

    fn take(&mut self, event: Value) {
        let name = event["name"].as_str().unwrap_or_default();
        match event["event"].as_str().unwrap_or_default() {
            "widget" => {
                self.changes += 1;
                match numbers(&event["rect"]) {
                    Some(rect) => self.widgets.insert(name.to_owned(), rect),
                    None => self.widgets.remove(name),
                };
            }
            "body" => {
                let inside =
                    |[x, y]: &[f64; 2]| (0.0..SIZE.0).contains(x) && (0.0..SIZE.1).contains(y);
                self.body = numbers(&event["screen"]).filter(inside);
            }
            "scene" if event["error"].is_null() => {
                self.scenes += 1;
                name.clone_into(&mut self.scene);
            }
            "action" => self.actions += 1,
            "tick" => {
                self.ticks += 1;
                self.figures = event;
            }
            _ => {}
        }
    }
}

/// Processor time that a process and its threads have taken so far.
fn processor_time(process: u32) -> Duration {
    let line = std::fs::read_to_string(format!("/proc/{process}/stat")).expect("it runs");
    // The name in parentheses may have spaces; user and system time are the 14th and 15th field.
    let fields = line.rsplit(')').next().expect("text").split_whitespace();
    let ticks: u64 = fields
        .skip(11)
        .take(2)
        .map(|field| field.parse::<u64>().expect("a whole number"))
        .sum();
    // Linux counts them in hundredths of a second on every machine that has a window.
    Duration::from_millis(10 * ticks)
}

/// One random input; returns its description.
fn act(id: &str, watch: &mut Watch, random: &mut Random) -> Vec<String> {
    let button = ["1", "1", "1", "1", "2", "3"][random.below(6)];
    let path: Vec<[f64; 2]> = (0..2 + random.below(6)).map(|_| random.place()).collect();
    let drag = |from: [f64; 2], path: &[[f64; 2]], keys: &[&str]| {
        let mut all = moves(id, &[from]);
        all.extend(words(&["mousedown", button]));
        all.extend(moves(id, path));
        for key in keys {
            all.extend(words(&["key", key]));
        }
        all.extend(words(&["mouseup", button]));
        all
    };
    watch.read();
    match random.below(20) {
        0..7 => {
            let keys = [random.of(KEYS), random.of(KEYS)];
            drag(
                watch.body.unwrap_or(path[0]),
                &path,
                &keys[..random.below(3)],
            )
        }
        7..11 => words(&["key", random.of(KEYS)]),
        11..15 => {
            let count = watch.widgets.len().max(1);
            let chosen = watch.widgets.values().nth(random.below(count));
            let [x, y, width, height] = chosen.copied().unwrap_or([100.0; 4]);
            let center = [x + width / 2.0, y + height / 2.0];
            let aside = [x + width * random.below(100) as f64 / 100.0, center[1]];
            let to = if random.below(3) == 0 { aside } else { center };
            drag(center, &[to], &[])
        }
        15..17 => {
            let text = random.of(TEXTS);
            let mut all = moves(id, &[random.place()]);
            all.extend(words(&["click", "1", "type", "--delay", "20", "--", text]));
            // `type` takes all that follows as text.
            xdotool(&all.iter().map(String::as_str).collect::<Vec<_>>());
            words(&["key", random.of(&["Return", "Escape", "Tab"])])
        }
        17..19 => {
            let mut all = moves(id, &path[..1]);
            all.extend(words(&["click", "--repeat", "4", random.of(&["4", "5"])]));
            all
        }
        _ => {
            let sizes = [
                ["500", "400"],
                ["1280", "300"],
                ["320", "800"],
                ["1280", "800"],
            ];
            let [width, height] = sizes[random.below(4)];
            words(&["windowsize", id, width, height])
        }
    }
}

#[test]
fn random_input_in_one_scene_after_another_breaks_nothing() {
    if !can_run() {
        return;
    }
    let _alone = POINTER
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner());
    let seed = variable("PLIANT_RANDOM_SEED", 1);
    let seconds = variable("PLIANT_RANDOM_SECONDS", 2 * SECONDS_PER_SCENE);
    println!("seed {seed}, {seconds} s");
    let mut random = Random(seed);
    let mut scenes = seconds / SECONDS_PER_SCENE;
    while scenes > 0 {
        let round = scenes.min(SCENES_PER_WINDOW);
        one_window(round, &mut random);
        scenes -= round;
    }
}

/// Random input in a number of scenes, one after another, and a replay of it.
fn one_window(scenes: u64, random: &mut Random) {
    let file = std::env::temp_dir().join(format!("pliant-random-{}.rec", std::process::id()));
    let path = file.to_str().expect("UTF-8");
    let mut window = Window::open_with("jelly_cube", &["--record", path]);
    let id = window.id.to_string();
    let mut watch = Watch::new(&window);
    for _ in 0..scenes {
        let start = Instant::now();
        let (mut inputs, before) = (0, watch.actions);
        while start.elapsed() < Duration::from_secs(SECONDS_PER_SCENE) {
            let input = act(&id, &mut watch, random);
            xdotool(&input.iter().map(String::as_str).collect::<Vec<_>>());
            inputs += 1;
            std::thread::sleep(Duration::from_millis(30 + random.next() % 150));
            let ended = window.program.try_wait().expect("it can be asked");
            let errors = std::fs::read_to_string(window.folder.join("errors.txt"));
            assert!(ended.is_none(), "after {input:?}: {ended:?}; {errors:?}");
        }
        // Nothing is held, typed or covered; then a key works as ever.
        xdotool(&["mouseup", "1", "mouseup", "2", "mouseup", "3"]);
        xdotool(&["windowsize", &id, "1280", "800"]);
        watch.read();
        let (scenes, actions) = (watch.scenes, watch.actions - before);
        let (ticks, changes) = (watch.ticks, watch.changes);
        let process = window.program.id();
        let (asked, used) = (Instant::now(), processor_time(process));
        while watch.scenes == scenes {
            let errors = std::fs::read_to_string(window.folder.join("errors.txt"));
            let busy = processor_time(process) - used;
            let waits = busy < RESPONSE && asked.elapsed() < WAIT;
            assert!(
                waits,
                "the next scene does not open in {:.0?}, {busy:.0?} of them at work, with {} ticks and {} changes of \
                 widgets; {errors:?}",
                asked.elapsed(),
                watch.ticks - ticks,
                watch.changes - changes
            );
            // Each time: a window that was too busy to be mapped anew has not taken the focus.
            xdotool(&["windowfocus", &id]);
            xdotool(&["key", "Escape", "key", "Escape", "key", "n"]);
            std::thread::sleep(Duration::from_millis(1500));
            watch.read();
        }
        let (response, ticks) = (asked.elapsed(), watch.ticks);
        while watch.ticks < ticks + 3 {
            let busy = processor_time(process) - used;
            let waits = busy < 2 * RESPONSE && asked.elapsed() < 2 * WAIT;
            assert!(waits, "no figures");
            std::thread::sleep(Duration::from_millis(100));
            watch.read();
        }
        assert_eq!(watch.figures["finite"], true, "{}", watch.figures);
        println!(
            "{inputs} inputs, {actions} actions, then {} after {response:.1?}",
            watch.scene
        );
    }
    window.close();
    let output = Command::new(env!("CARGO_BIN_EXE_pliant"))
        .args(["replay", path, "--json"])
        .output()
        .expect("the program starts");
    let replay: Value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&output.stderr)));
    assert_eq!(replay["same"], true, "{replay:#}");
    println!("replayed {} actions", replay["actions"]);
    std::fs::remove_file(&file).expect("it was made here");
}
