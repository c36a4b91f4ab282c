//! The keys: one table, used by the handler here and by the help overlay.
//!
//! Keys are ignored while text is being typed in the panel, and while Alt or the system key is held;
//! while Ctrl is held, only combinations with Ctrl count. Letters follow the user's keyboard layout,
//! not physical key positions.

mod commands;

use crate::sandbox::state::request::{RequestSystems, Requested};
use bevy::{
    input::{
        ButtonState,
        keyboard::{Key, KeyboardInput},
    },
    prelude::*,
};
use bevy_egui::input::EguiWantsInput;

use super::pointer::Pointer;
use crate::sandbox::state::view::{HoveredPin, LastGrab, ViewCommand, ViewSettings};
use commands::Commander;

/// The command of a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Command {
    /// Pauses or resumes the simulation.
    Pause,
    /// One tick.
    Step,
    /// One tick back.
    StepBack,
    /// Takes the last action back.
    Undo,
    /// Repeats the action that was taken back last.
    Redo,
    /// Restarts the scene.
    Restart,
    /// Toggles between a tenth of the speed and full speed.
    Slow,
    /// Opens or closes the scene browser.
    Browser,
    /// Moves the keyboard focus to the panel's search.
    Search,
    /// The next scene.
    NextScene,
    /// The previous scene.
    PreviousScene,
    /// Pins or unpins the grabbed point.
    Pin,
    /// Unpins everything.
    UnpinAll,
    /// Drops a body under the pointer; held, more follow.
    Drop,
    /// Shoots a body from the camera towards the pointer.
    Shoot,
    /// Deletes the grabbed body, or the selected one.
    Remove,
    /// Makes the grabbed body, or the selected bodies, softer by one slider step (about a quarter).
    Softer,
    /// Makes them stiffer by one slider step.
    Stiffer,
    /// One substep more.
    MoreSubsteps,
    /// One substep less.
    FewerSubsteps,
    /// Frames all bodies.
    FrameAll,
    /// Frames the selected body.
    Focus,
    /// Follows the selected body, or ends it.
    Follow,
    /// Toggles the contact forces.
    Contacts,
    /// Toggles the wireframe.
    Wireframe,
    /// Toggles the tetrahedra.
    Tetrahedra,
    /// Toggles the analytic solutions.
    Answers,
    /// Cycles through the solver views: partition, color, lane, off.
    SolverView,
    /// Cycles through the quantities by which bodies are colored.
    Color,
    /// Opens or closes the plots.
    Plots,
    /// Opens or closes the accuracy card.
    Accuracy,
    /// Opens or closes the stress tests.
    Gallery,
    /// Toggles the reference overlay.
    ReferenceOverlay,
    /// Shows or hides the panel.
    Panel,
    /// Saves a screenshot of the window.
    Screenshot,
    /// Saves a picture of the view without the panel.
    PlainPicture,
    /// Saves the scene.
    Save,
    /// Starts or ends a recording.
    Record,
    /// Starts or ends a film.
    Film,
    /// Shows or hides the overlay of keys.
    Help,
    /// Closes the overlay of keys.
    Close,
}

/// A row of the table.
#[derive(Debug, Clone, Copy)]
pub struct Binding {
    /// Keys that trigger the command.
    pub keys: &'static [KeyName],
    /// Label of the keys in the help.
    pub cap: &'static str,
    /// Description in the help.
    pub text: &'static str,
    /// The command.
    pub command: Command,
    /// Whether holding the key repeats it.
    pub repeats: bool,
}

/// Name of a key in the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeyName {
    /// The key that types this letter or sign, in lower case.
    Types(&'static str),
    /// Ctrl and the key that types this letter or sign, in lower case, without Shift.
    Ctrl(&'static str),
    /// Ctrl, Shift and the key that types this letter or sign, in lower case.
    CtrlShift(&'static str),
    /// The space bar.
    Space,
    /// Escape.
    Escape,
    /// Delete.
    Delete,
    /// A function key, without Shift.
    Function(u8),
    /// Shift and a function key.
    ShiftFunction(u8),
    /// Page up.
    PageUp,
    /// Page down.
    PageDown,
    /// Arrow up.
    Up,
    /// Arrow down.
    Down,
    /// Arrow left.
    Left,
    /// Arrow right.
    Right,
}

use KeyName::{
    Ctrl, CtrlShift, Delete, Down, Escape, Function, Left, PageDown, PageUp, Right, ShiftFunction,
    Space, Types, Up,
};

const fn row(
    keys: &'static [KeyName],
    cap: &'static str,
    text: &'static str,
    command: Command,
) -> Binding {
    Binding {
        keys,
        cap,
        text,
        command,
        repeats: false,
    }
}

const fn repeated(binding: Binding) -> Binding {
    Binding {
        repeats: true,
        ..binding
    }
}

/// All key bindings.
pub const BINDINGS: &[Binding] = &[
    row(&[Space], "Space", "run / pause", Command::Pause),
    repeated(row(&[Types(".")], ".", "advance one tick", Command::Step)),
    repeated(row(
        &[Types(",")],
        ",",
        "go back one tick",
        Command::StepBack,
    )),
    repeated(row(&[Ctrl("z")], "Ctrl+Z", "undo", Command::Undo)),
    repeated(row(
        &[CtrlShift("z"), Ctrl("y")],
        "Ctrl+Y",
        "redo (also Ctrl+Shift+Z)",
        Command::Redo,
    )),
    row(&[Types("r")], "R", "restart the scene", Command::Restart),
    row(
        &[Types("s")],
        "S",
        "slow motion (0.1× speed)",
        Command::Slow,
    ),
    row(&[Types("e")], "E", "browse scenes", Command::Browser),
    row(&[Types("/")], "/", "search the panel", Command::Search),
    row(
        &[Types("n"), PageDown],
        "N",
        "next scene",
        Command::NextScene,
    ),
    row(
        &[Types("b"), PageUp],
        "B",
        "previous scene",
        Command::PreviousScene,
    ),
    row(
        &[Types("p")],
        "P",
        "pin / unpin the point under the pointer, or the grabbed one",
        Command::Pin,
    ),
    row(&[Types("u")], "U", "unpin all", Command::UnpinAll),
    repeated(row(
        &[Types("d")],
        "D",
        "drop a body under the pointer; hold for a stream",
        Command::Drop,
    )),
    row(
        &[Types("x")],
        "X",
        "shoot a ball towards the pointer",
        Command::Shoot,
    ),
    row(
        &[Delete],
        "Del",
        "delete the grabbed or selected body",
        Command::Remove,
    ),
    repeated(row(
        &[Up],
        "Up",
        "softer (works while dragging)",
        Command::Softer,
    )),
    repeated(row(
        &[Down],
        "Down",
        "stiffer (works while dragging)",
        Command::Stiffer,
    )),
    repeated(row(
        &[Right],
        "Right",
        "one more substep",
        Command::MoreSubsteps,
    )),
    repeated(row(
        &[Left],
        "Left",
        "one fewer substep",
        Command::FewerSubsteps,
    )),
    row(&[Types("f")], "F", "frame all", Command::FrameAll),
    row(
        &[Types("z")],
        "Z",
        "focus on the selected body",
        Command::Focus,
    ),
    row(
        &[Types("l")],
        "L",
        "follow the selected body / stop",
        Command::Follow,
    ),
    row(&[Types("w")], "W", "wireframe", Command::Wireframe),
    row(&[Types("t")], "T", "tet mesh", Command::Tetrahedra),
    row(&[Types("k")], "K", "contact forces", Command::Contacts),
    row(
        &[Types("m")],
        "M",
        "analytic solution, if the scene has one",
        Command::Answers,
    ),
    row(
        &[Types("v")],
        "V",
        "solver view: partitions, colors, lanes",
        Command::SolverView,
    ),
    row(
        &[Types("o")],
        "O",
        "color by strain, volume, speed, error, contact force",
        Command::Color,
    ),
    row(&[Types("i")], "I", "plots over time", Command::Plots),
    row(&[Types("a")], "A", "accuracy vs. cost", Command::Accuracy),
    row(&[Types("c")], "C", "stress tests", Command::Gallery),
    row(
        &[Types("g")],
        "G",
        "reference overlay (f64, finer substeps)",
        Command::ReferenceOverlay,
    ),
    row(&[Types("h")], "H", "show / hide the panel", Command::Panel),
    row(
        &[Function(12)],
        "F12",
        "save a screenshot",
        Command::Screenshot,
    ),
    row(
        &[ShiftFunction(12)],
        "Shift F12",
        "save a picture without the panel",
        Command::PlainPicture,
    ),
    row(&[Ctrl("s")], "Ctrl S", "save the scene", Command::Save),
    row(
        &[Function(9)],
        "F9",
        "start / end a recording",
        Command::Record,
    ),
    row(
        &[Function(10)],
        "F10",
        "start / end a film (GIF)",
        Command::Film,
    ),
    row(
        &[Function(1), Types("?")],
        "F1 ?",
        "show / hide this help",
        Command::Help,
    ),
    row(&[Escape], "Esc", "close this help", Command::Close),
];

/// Pointer gestures, for the help.
pub const GESTURES: &[(&str, &str)] = &[
    ("Left drag", "grab and drag a body, or a pin"),
    ("Shift drag", "cut the bodies under the stroke"),
    ("Ctrl click", "select or deselect a body"),
    ("Wheel", "while dragging: nearer / farther"),
    ("Wheel", "otherwise: zoom"),
    ("Right drag", "orbit the camera"),
    ("Middle drag", "pan the camera"),
    (
        "Drop a file",
        "import a mesh as a soft body, or open a scene",
    ),
];

/// Modifier keys that are held with a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Held {
    /// Ctrl.
    pub control: bool,
    /// Shift. Without Ctrl, it does not matter.
    pub shift: bool,
}

/// The binding of a key.
pub fn binding(key: &Key, held: Held) -> Option<&'static Binding> {
    BINDINGS
        .iter()
        .find(|binding| binding.keys.iter().any(|name| name.is(key, held)))
}

impl KeyName {
    fn is(self, key: &Key, held: Held) -> bool {
        if let Ctrl(text) | CtrlShift(text) = self {
            let shift = matches!(self, CtrlShift(_));
            let typed = matches!(key, Key::Character(typed) if typed.to_lowercase() == text);
            return typed && held.control && held.shift == shift;
        }
        if held.control {
            return false;
        }
        match (self, key) {
            (Types(text), Key::Character(typed)) => typed.to_lowercase() == text,
            (Space, Key::Character(typed)) => typed == " ",
            (Space, Key::Space)
            | (Escape, Key::Escape)
            | (Delete, Key::Delete)
            | (PageUp, Key::PageUp)
            | (PageDown, Key::PageDown)
            | (Up, Key::ArrowUp)
            | (Down, Key::ArrowDown)
            | (Left, Key::ArrowLeft)
            | (Right, Key::ArrowRight)
            | (Function(1), Key::F1) => true,
            (Function(9), Key::F9) | (Function(10), Key::F10) | (Function(12), Key::F12) => {
                !held.shift
            }
            (ShiftFunction(12), Key::F12) => held.shift,
            _ => false,
        }
    }
}

/// Handles the keys.
pub struct KeysPlugin;

impl Plugin for KeysPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<ViewSettings>()
            .init_resource::<LastGrab>()
            .init_resource::<HoveredPin>()
            .init_resource::<Pointer>()
            .add_message::<ViewCommand>()
            .add_message::<Requested>()
            .add_systems(Update, obey.before(RequestSystems));
    }
}

fn obey(
    mut pressed: MessageReader<KeyboardInput>,
    held: Res<ButtonInput<KeyCode>>,
    egui: Res<EguiWantsInput>,
    mut commander: Commander,
    mut modifiers: Local<Held>,
) {
    use KeyCode::{
        AltLeft, ControlLeft, ControlRight, ShiftLeft, ShiftRight, SuperLeft, SuperRight,
    };
    let typing = egui.wants_keyboard_input();
    let modified = held.any_pressed([AltLeft, SuperLeft, SuperRight]);
    for input in pressed.read() {
        // In the order of the events: in a long frame, Ctrl may be released already.
        let down = input.state == ButtonState::Pressed;
        match input.key_code {
            ControlLeft | ControlRight => modifiers.control = down,
            ShiftLeft | ShiftRight => modifiers.shift = down,
            _ => {}
        }
        if input.state != ButtonState::Pressed || typing || modified {
            continue;
        }
        if let Some(binding) = binding(&input.logical_key, *modifiers)
            && (!input.repeat || binding.repeats)
        {
            commander.carry_out(binding.command, input.repeat);
        }
    }
    *modifiers = Held {
        control: held.any_pressed([ControlLeft, ControlRight]),
        shift: held.any_pressed([ShiftLeft, ShiftRight]),
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn no_key_has_two_meanings() {
        let mut seen = Vec::new();
        for key in BINDINGS.iter().flat_map(|binding| binding.keys) {
            assert!(!seen.contains(key), "{key:?} is bound twice");
            seen.push(*key);
        }
    }

    #[test]
    fn every_row_of_the_help_says_something_of_its_own() {
        let texts: BTreeSet<_> = BINDINGS.iter().map(|binding| binding.text).collect();
        let caps: BTreeSet<_> = BINDINGS.iter().map(|binding| binding.cap).collect();
        assert_eq!(texts.len(), BINDINGS.len());
        assert_eq!(caps.len(), BINDINGS.len());
    }

    #[test]
    fn letters_are_found_whatever_shift_does() {
        let command = |key: Key| binding(&key, Held::default()).map(|binding| binding.command);
        assert_eq!(command(Key::Character("r".into())), Some(Command::Restart));
        assert_eq!(command(Key::Character("R".into())), Some(Command::Restart));
        assert_eq!(command(Key::Space), Some(Command::Pause));
        assert_eq!(command(Key::Character("q".into())), None);
        assert_eq!(command(Key::Tab), None);
    }

    #[test]
    fn control_and_shift_distinguish_combinations_of_a_letter() {
        let z = |text: &str| Key::Character(text.into());
        let [plain, control, both] = [(false, false), (true, false), (true, true)]
            .map(|(control, shift)| Held { control, shift });
        for (name, held) in [
            (Types("z"), plain),
            (Ctrl("z"), control),
            (CtrlShift("z"), both),
        ] {
            for other in [plain, control, both] {
                assert_eq!(name.is(&z("z"), other), other == held, "{name:?} {other:?}");
                assert_eq!(name.is(&z("Z"), other), other == held, "{name:?} {other:?}");
            }
            assert!(!name.is(&z("y"), held));
        }
        assert!(!Space.is(&Key::Space, control));
    }
}
