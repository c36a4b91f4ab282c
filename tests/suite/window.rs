//! The real window with a real pointer: pressed, dragged and closed as by a user.
//!
//! Requires an X11 display and `xdotool`; without them each test reports that it was skipped,
//! unless `PLIANT_WINDOW_TESTS=required`. The program's journal records its events.

mod random;

use serde_json::Value;
use std::{
    path::PathBuf,
    process::{Child, Command, Stdio},
    sync::{Mutex, OnceLock},
    time::{Duration, Instant},
};
use x11rb::{
    connection::Connection,
    protocol::xproto::{ClientMessageEvent, ConnectionExt, EventMask},
    rust_connection::RustConnection,
};

/// One window at a time: there is one pointer.
static POINTER: Mutex<()> = Mutex::new(());

/// Compiling shaders takes long with a software renderer on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

const SIZE: (f64, f64) = (1280.0, 800.0);

struct Window {
    program: Child,
    folder: PathBuf,
    id: u32,
}

/// The display, if there is one. Kept open, as a display server that loses its last client resets,
/// and rejects the next one for a moment.
fn display() -> Option<&'static RustConnection> {
    static DISPLAY: OnceLock<Option<RustConnection>> = OnceLock::new();
    let connect = || x11rb::connect(None).ok().map(|(connection, _)| connection);
    DISPLAY.get_or_init(connect).as_ref()
}

fn can_run() -> bool {
    let tool = Command::new("xdotool").arg("version").output().is_ok();
    let display = display().is_some();
    let required = std::env::var("PLIANT_WINDOW_TESTS").is_ok_and(|value| value == "required");
    assert!(
        (tool && display) || !required,
        "window tests are required, but xdotool is there: {tool}, an X11 display: {display}"
    );
    if !(tool && display) {
        println!("skipped: needs an X11 display and xdotool");
    }
    tool && display
}

fn xdotool(arguments: &[&str]) -> String {
    let output = Command::new("xdotool")
        .args(arguments)
        .output()
        .expect("xdotool runs");
    assert!(output.status.success(), "xdotool {arguments:?}: {output:?}");
    String::from_utf8(output.stdout).expect("xdotool writes UTF-8")
}

impl Window {
    /// Opens a scene and waits until it is drawn.
    fn open(scene: &str) -> Self {
        Self::open_with(scene, &[])
    }

    /// The same with additional arguments.
    fn open_with(scene: &str, arguments: &[&str]) -> Self {
        let folder =
            std::env::temp_dir().join(format!("pliant-window-{}-{scene}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder for temporary files");
        let journal = folder.join("journal.jsonl");
        let errors = std::fs::File::create(folder.join("errors.txt")).expect("a file");
        let program = Command::new(env!("CARGO_BIN_EXE_pliant"))
            .args([scene, "--size", "1280x800", "--no-settings", "--journal"])
            .arg(&journal)
            .args(arguments)
            .env("XDG_CONFIG_HOME", &folder)
            // What is saved without a name goes here.
            .current_dir(&folder)
            .env_remove("WAYLAND_DISPLAY")
            .stderr(Stdio::from(errors))
            .stdout(Stdio::null())
            .spawn()
            .expect("the program starts");
        let mut window = Self {
            program,
            folder,
            id: 0,
        };
        window.wait("the first picture", |event| {
            (event["event"] == "ready").then_some(())
        });
        window.id = window.find();
        xdotool(&["windowfocus", &window.id.to_string()]);
        window
    }

    /// The window's number, as soon as the display shows it.
    fn find(&self) -> u32 {
        let start = Instant::now();
        loop {
            let search = Command::new("xdotool")
                .args(["search", "--onlyvisible", "--name", "^Pliant"])
                .output()
                .expect("xdotool runs");
            let found = String::from_utf8_lossy(&search.stdout).trim().parse();
            if let Ok(id) = found {
                return id;
            }
            assert!(start.elapsed() < PATIENCE, "no window is shown: {found:?}");
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    /// Grabs a body in its middle. At a few frames per second a press may arrive before the program
    /// has processed the pointer motion; like a user, the test then presses again.
    fn grab(&mut self) -> ([f64; 2], [f64; 3]) {
        let grabs = |event: &Value| event["action"]["do"] == "grab";
        let before = self.count(grabs);
        for _ in 0..10 {
            let (place, center) = self.body();
            self.point([place[0] - 2.0, place[1]]);
            self.point(place);
            std::thread::sleep(Duration::from_millis(400));
            xdotool(&["mousedown", "1"]);
            for _ in 0..20 {
                if self.count(grabs) > before {
                    return (place, center);
                }
                std::thread::sleep(Duration::from_millis(100));
            }
            xdotool(&["mouseup", "1"]);
        }
        panic!("pressing on the body ten times does not grab it");
    }

    fn events(&self) -> Vec<Value> {
        let text = std::fs::read_to_string(self.folder.join("journal.jsonl")).unwrap_or_default();
        // The last line may be incomplete.
        text.lines()
            .filter_map(|line| serde_json::from_str(line).ok())
            .collect()
    }

    /// Waits for the newest event that `find` accepts.
    fn wait<T>(&mut self, what: &str, find: impl Fn(&Value) -> Option<T>) -> T {
        let start = Instant::now();
        loop {
            if let Some(found) = self.events().iter().rev().find_map(&find) {
                return found;
            }
            let ended = self.program.try_wait().expect("the program can be asked");
            if ended.is_some() || start.elapsed() > PATIENCE {
                let errors = std::fs::read_to_string(self.folder.join("errors.txt"));
                panic!("no {what}; exit {ended:?}; {errors:?}");
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Moves the pointer to a position in the window [px].
    fn point(&self, [x, y]: [f64; 2]) {
        let (x, y) = (x.round().to_string(), y.round().to_string());
        xdotool(&["mousemove", "--window", &self.id.to_string(), &x, &y]);
        std::thread::sleep(Duration::from_millis(60));
    }

    /// Position of a body: on the screen [px], and in the world [m].
    fn body(&mut self) -> ([f64; 2], [f64; 3]) {
        self.wait("body in sight", |event| {
            (event["event"] == "body").then_some(())?;
            Some((numbers(&event["screen"])?, numbers(&event["center"])?))
        })
    }

    /// Current rectangle of a widget of the panel: x, y, width, height [px].
    fn widget(&mut self, name: &str) -> [f64; 4] {
        self.wait(name, |event| {
            (event["event"] == "widget" && event["name"] == name)
                .then(|| numbers(&event["rect"]))?
        })
    }

    /// Presses a widget of the panel until the journal has one more event `done` than before.
    fn press(&mut self, name: &str, done: impl Fn(&Value) -> bool) {
        let before = self.count(&done);
        for _ in 0..10 {
            self.press_once(name);
            for _ in 0..30 {
                if self.count(&done) > before {
                    return;
                }
                std::thread::sleep(Duration::from_millis(100));
            }
        }
        panic!("pressing {name} ten times does nothing");
    }

    fn press_once(&mut self, name: &str) {
        let [x, y, width, height] = self.widget(name);
        self.point([x + width * 0.5, y + height / 2.0]);
        std::thread::sleep(Duration::from_millis(400));
        xdotool(&["mousedown", "1"]);
        std::thread::sleep(Duration::from_millis(400));
        xdotool(&["mouseup", "1"]);
    }

    /// Chooses an entry of a menu, which may close again while the program is slow.
    fn choose(&mut self, menu: &str, entry: &str, done: impl Fn(&Value) -> bool) {
        let before = self.count(&done);
        for _ in 0..10 {
            if !self.in_sight(entry) {
                self.press_once(menu);
                std::thread::sleep(Duration::from_millis(1500));
            }
            if self.in_sight(entry) {
                self.press_once(entry);
                std::thread::sleep(Duration::from_millis(1500));
            }
            if self.count(&done) > before {
                return;
            }
        }
        panic!("choosing {entry} ten times does nothing");
    }

    /// Whether a widget is visible.
    fn in_sight(&self, name: &str) -> bool {
        let events = self.events();
        let last = events.iter().rev().find(|event| event["name"] == name);
        last.is_some_and(|event| !event["rect"].is_null())
    }

    /// Presses a key and waits until the journal has one more event `done` than before.
    fn key(&mut self, key: &str, done: impl Fn(&Value) -> bool) {
        let before = self.count(&done);
        xdotool(&["key", key]);
        let start = Instant::now();
        while self.count(&done) == before {
            assert!(start.elapsed() < PATIENCE, "key {key} does nothing");
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    fn count(&self, matches: impl Fn(&Value) -> bool) -> usize {
        self.events().iter().filter(|event| matches(event)).count()
    }

    /// Requests the window to close, like its frame's button, and waits for the program to end.
    fn close(mut self) {
        let connection = display().expect("the display is there");
        let atom = |name: &str| {
            let cookie = connection
                .intern_atom(false, name.as_bytes())
                .expect("asked");
            cookie.reply().expect("an atom").atom
        };
        let message = ClientMessageEvent::new(
            32,
            self.id,
            atom("WM_PROTOCOLS"),
            [atom("WM_DELETE_WINDOW"), 0, 0, 0, 0],
        );
        connection
            .send_event(false, self.id, EventMask::NO_EVENT, message)
            .expect("sent");
        connection.flush().expect("sent");
        let start = Instant::now();
        let status = loop {
            if let Some(status) = self.program.try_wait().expect("the program can be asked") {
                break status;
            }
            assert!(start.elapsed() < PATIENCE, "it does not close");
            std::thread::sleep(Duration::from_millis(50));
        };
        let errors = std::fs::read_to_string(self.folder.join("errors.txt")).expect("there");
        assert!(status.success(), "it ended with {status}: {errors}");
        assert!(!errors.contains("panicked"), "{errors}");
        assert!(!errors.contains("ERROR"), "{errors}");
        let last = self.events().pop().expect("a journal");
        assert_eq!(last["event"], "closing", "the journal is whole: {last}");
        std::fs::remove_dir_all(&self.folder).expect("it was made here");
    }
}

impl Drop for Window {
    fn drop(&mut self) {
        // A failed test must not leave its window open; a closed one is not affected.
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

fn numbers<const N: usize>(value: &Value) -> Option<[f64; N]> {
    let numbers: Vec<f64> = value.as_array()?.iter().filter_map(Value::as_f64).collect();
    numbers.try_into().ok()
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b) * (a - b))
        .sum::<f64>()
        .sqrt()
}

#[test]
fn a_body_is_dragged_by_the_pointer_and_let_go() {
    if !can_run() {
        return;
    }
    let _alone = POINTER
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner());
    let mut window = Window::open("jelly_cube");
    // It falls and settles first, so that only the grab moves it afterwards.
    window.wait("two seconds of simulation", |event| {
        (event["event"] == "tick" && event["time"].as_f64()? > 2.0).then_some(())
    });
    let (place, before) = window.grab();
    for step in 1..=10 {
        let up = f64::from(step) * 24.0;
        window.point([place[0] - up, place[1] - up]);
    }
    let start = Instant::now();
    let lifted = loop {
        let (_, now) = window.body();
        if now[1] > before[1] + 0.1 && distance(now, before) > 0.15 {
            break now;
        }
        assert!(start.elapsed() < PATIENCE, "it stays at {now:?}");
        std::thread::sleep(Duration::from_millis(100));
    };
    let camera_moves = window.count(|event| event["event"] == "camera");
    assert_eq!(camera_moves, 0, "the camera stays while a body is dragged");
    xdotool(&["mouseup", "1"]);
    window.wait("release", |event| {
        (event["action"]["do"] == "release").then_some(())
    });
    let start = Instant::now();
    loop {
        let (_, now) = window.body();
        if now[1] < lifted[1] - 0.05 {
            break;
        }
        assert!(
            start.elapsed() < PATIENCE,
            "it does not fall from {lifted:?}: {now:?}"
        );
        std::thread::sleep(Duration::from_millis(100));
    }
    window.close();
}

/// Bevy drops an image that arrives after the end, and reports an error.
#[test]
fn films_and_pictures_are_finished_before_the_window_closes() {
    if !can_run() {
        return;
    }
    let _alone = POINTER
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner());
    let mut window = Window::open("jelly_cube");
    window.wait("a second of simulation", |event| {
        (event["event"] == "tick" && event["time"].as_f64()? > 1.0).then_some(())
    });
    xdotool(&["key", "F10"]);
    // Some frames of it.
    std::thread::sleep(Duration::from_secs(3));
    xdotool(&["key", "--delay", "4", "shift+F12", "F12"]);
    window.close();
}

#[test]
fn the_compliance_slider_changes_the_component() {
    if !can_run() {
        return;
    }
    let _alone = POINTER
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner());
    let mut window = Window::open("jelly_cube");
    // The panel determines its layout in the first frames.
    std::thread::sleep(Duration::from_secs(2));
    let value_at = |window: &mut Window, fraction: f64| {
        let is_set = |event: &Value| event["action"]["parameter"] == "stretch.compliance";
        let before = window.count(is_set);
        for _ in 0..10 {
            let [x, y, width, height] = window.widget("stretch.compliance");
            let inside = x >= 0.0 && x + width <= SIZE.0 && y + height <= SIZE.1;
            assert!(inside, "it is in sight");
            window.point([x + width * fraction, y + height / 2.0]);
            std::thread::sleep(Duration::from_millis(400));
            xdotool(&["mousedown", "1"]);
            std::thread::sleep(Duration::from_millis(400));
            xdotool(&["mouseup", "1"]);
            std::thread::sleep(Duration::from_millis(600));
            if window.count(is_set) > before {
                return window.wait("value", |event| {
                    is_set(event).then(|| event["action"]["value"].as_f64())?
                });
            }
        }
        panic!("pressing the slider ten times sets nothing");
    };
    let stiff = value_at(&mut window, 0.2);
    let soft = value_at(&mut window, 0.8);
    // The slider is logarithmic over many decades: three fifths of it are more than one decade.
    assert!(soft > 10.0 * stiff, "{stiff} m/N, then {soft} m/N");
    window.close();
}

/// Everything that changes the simulation goes through the list of actions, or is a new scene: user
/// input in the window is replayed without one, to the same hash.
#[test]
fn what_is_done_in_the_window_replays_without_one_on_any_number_of_threads() {
    if !can_run() {
        return;
    }
    let _alone = POINTER
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner());
    let file = std::env::temp_dir().join(format!("pliant-window-{}.rec", std::process::id()));
    let path = file.to_str().expect("UTF-8");
    let mut window = Window::open_with("jelly_cube", &["--record", path]);
    let done = |what: &'static str| move |event: &Value| event["action"]["do"] == what;
    let opened = |event: &Value| event["event"] == "scene";
    let (place, _) = window.grab();
    for step in 1..=6 {
        let up = f64::from(step) * 20.0;
        window.point([place[0] - up, place[1] - up]);
    }
    window.key("p", done("pin"));
    window.key("Up", done("set"));
    window.key("Right", done("set"));
    xdotool(&["mouseup", "1"]);
    window.wait("release", |event| done("release")(event).then_some(()));
    window.press("squash", done("deform"));
    // The menu stays open.
    window.choose("spawn", "spawn.add", done("spawn"));
    window.key("d", done("spawn"));
    window.press("spawn", |event| {
        event["name"] == "spawn.add" && event["rect"].is_null()
    });
    window.press("effect.volume", done("remove effect"));
    window.press("shuffle", done("deform"));
    window.key("r", opened);
    window.press("stretch.compliance", done("set"));
    window.press("world.substeps", done("set"));
    window.key("n", opened);
    window.grab();
    xdotool(&["mouseup", "1"]);
    window.key("Delete", done("despawn"));
    // A second of the scene that is left.
    std::thread::sleep(Duration::from_secs(1));
    let actions = window.count(|event| event["event"] == "action");
    window.close();
    for threads in ["1", "2", "8"] {
        let output = Command::new(env!("CARGO_BIN_EXE_pliant"))
            .args(["replay", path, "--json", "--threads", threads])
            .output()
            .expect("the program starts");
        let replay: Value = serde_json::from_slice(&output.stdout)
            .unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&output.stderr)));
        assert_eq!(replay["same"], true, "{replay:#}");
        assert_eq!(replay["complete"], true, "{replay:#}");
        assert_eq!(replay["restarts"], 1);
        assert_eq!(replay["scenes"].as_array().map(Vec::len), Some(2));
        let replayed = replay["actions"].as_u64().expect("a count");
        assert!(
            replayed >= actions as u64 && replayed > 10,
            "{replayed} of {actions}"
        );
    }
    std::fs::remove_file(&file).expect("it was made here");
}

#[test]
fn a_body_that_diverges_by_a_typed_number_is_named_until_it_is_restored() {
    if !can_run() {
        return;
    }
    let _alone = POINTER
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner());
    let mut window = Window::open("bounce");
    // All plates are on one ground; it is raised at a speed beyond the range of f32.
    let raise = |window: &mut Window, height: &str| {
        let is_set = |event: &Value| event["action"]["parameter"] == "ground.height";
        for _ in 0..10 {
            let before = window.count(is_set);
            let [x, y, width, height_of] = window.widget("ground.height.entry");
            window.point([x + width / 2.0, y + height_of / 2.0]);
            std::thread::sleep(Duration::from_millis(400));
            xdotool(&["click", "1"]);
            std::thread::sleep(Duration::from_millis(600));
            // A click selects the current text.
            xdotool(&["type", "--delay", "150", height]);
            std::thread::sleep(Duration::from_millis(400));
            xdotool(&["key", "Return"]);
            std::thread::sleep(Duration::from_millis(1500));
            if window.count(is_set) > before {
                return;
            }
        }
        panic!("ten times a height was typed, and nothing is set");
    };
    raise(&mut window, "3e38");
    let card = |event: &Value| {
        let is = event["event"] == "widget" && event["name"] == "restore.all";
        is.then(|| event["rect"].is_null())
    };
    let gone = window.wait("the card", card);
    assert!(!gone);
    // It remains visible for longer than a note would.
    std::thread::sleep(Duration::from_secs(16));
    assert!(!window.wait("the card", card));
    raise(&mut window, "0");
    window.press("restore.all", |event| event["action"]["do"] == "restore");
    let start = Instant::now();
    while !window.wait("the card", card) {
        assert!(start.elapsed() < PATIENCE, "the card stays");
        std::thread::sleep(Duration::from_millis(100));
    }
    window.wait("finite bodies", |event| {
        (event["event"] == "tick" && event["finite"] == true).then_some(())
    });
    window.close();
}

/// Many interactions at once and very fast: a body is thrown from corner to corner while its
/// compliance and the substeps are moved across their ranges, effects are added and removed, and
/// the window is made small and large, and minimized.
#[test]
fn rapid_pointer_and_key_input_breaks_nothing() {
    if !can_run() {
        return;
    }
    let _alone = POINTER
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner());
    let mut window = Window::open("jelly_cube");
    let id = window.id.to_string();
    let corners = [[40.0, 100.0], [880.0, 700.0], [880.0, 100.0], [40.0, 700.0]];
    let rush = |keys: &[&str]| {
        for place in corners.iter().cycle().take(12) {
            let [x, y] = place.map(|number: f64| number.to_string());
            xdotool(&["mousemove", "--window", &id, &x, &y]);
            let all: Vec<&str> = [&["key", "--delay", "1"][..], keys].concat();
            xdotool(&all);
        }
    };
    window.grab();
    rush(&["Up", "Up", "Up", "Up", "Up", "Up"]);
    rush(&["Right", "Right", "Right", "Right"]);
    rush(&["Down", "Down", "Down", "Down", "Down", "Down"]);
    rush(&["Left", "Left", "Left", "Left"]);
    rush(&["p", "s", "space", "space", "w", "v"]);
    xdotool(&["mouseup", "1"]);
    let wide = |window: &mut Window, name: &str| {
        let [x, y, width, height] = window.widget(name);
        window.point([x + 1.0, y + height / 2.0]);
        xdotool(&["mousedown", "1"]);
        for fraction in [1.0, 0.0, 1.5, -0.5, 0.5] {
            window.point([x + width * fraction, y + height / 2.0]);
        }
        xdotool(&["mouseup", "1"]);
    };
    for name in ["stretch.compliance", "world.substeps", "volume.compliance"] {
        wide(&mut window, name);
    }
    for effect in [
        "effect.stretch",
        "effect.volume",
        "effect.stretch",
        "effect.volume",
    ] {
        window.press_once(effect);
    }
    for [width, height] in [["500", "400"], ["1280", "300"], ["1280", "800"]] {
        xdotool(&["windowsize", &id, width, height]);
        rush(&["r"]);
    }
    xdotool(&["windowunmap", &id]);
    std::thread::sleep(Duration::from_millis(500));
    xdotool(&["windowmap", &id]);
    xdotool(&["windowfocus", &id]);
    let ticks = window.count(|event| event["event"] == "tick");
    let start = Instant::now();
    while window.count(|event| event["event"] == "tick") < ticks + 5 {
        assert!(start.elapsed() < PATIENCE, "time stands still");
        assert!(
            window
                .program
                .try_wait()
                .expect("it can be asked")
                .is_none(),
            "it ended"
        );
        std::thread::sleep(Duration::from_millis(100));
    }
    window.wait("figures", |event| {
        (event["event"] == "tick").then(|| assert_eq!(event["finite"], true, "{event}"))
    });
    window.close();
}
