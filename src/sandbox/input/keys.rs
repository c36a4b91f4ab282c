//! The keys: one table, read by the handler here and by the help overlay.
//!
//! A key never acts while a text is being typed into the panel, nor with Ctrl, Alt or the system
//! key held. Letters are those of the user's layout, not places on the keyboard.

mod hand;

use crate::sandbox::state::request::{RequestSystems, Requested};
use bevy::{
    input::{
        ButtonState,
        keyboard::{Key, KeyboardInput},
    },
    prelude::*,
};
use bevy_egui::input::EguiWantsInput;

use crate::sandbox::state::view::{LastGrab, ViewCommand, ViewSettings};
use hand::Hand;

/// What a key does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Command {
    /// Stops time or lets it run.
    Pause,
    /// One tick.
    Step,
    /// Begins the scene anew.
    Restart,
    /// A tenth of the speed, or the whole.
    Slow,
    /// The next scene.
    NextScene,
    /// The previous scene.
    PreviousScene,
    /// Pins the held point or frees it.
    Pin,
    /// Takes away the held body, or the one that is shown.
    Remove,
    /// Makes the held body, or the bodies shown, a quarter softer.
    Softer,
    /// The opposite of softer.
    Stiffer,
    /// One substep more.
    MoreSubsteps,
    /// One substep less.
    FewerSubsteps,
    /// Brings every body into sight.
    FrameAll,
    /// Draws the wireframe or not.
    Wireframe,
    /// Draws the tetrahedra or not.
    Tetrahedra,
    /// Draws the analytic solutions or not.
    Answers,
    /// Draws the constraints by partition, by color, by lane, or not.
    SolverView,
    /// Opens or closes the card with accuracy and cost.
    Accuracy,
    /// Opens or closes the gallery of stress tests.
    Gallery,
    /// Switches the reference overlay on or off.
    ReferenceOverlay,
    /// Shows or hides the panel.
    Panel,
    /// Saves a picture of the window.
    Screenshot,
    /// Shows or hides the keys.
    Help,
    /// Closes the overlay of keys.
    Close,
}

/// A row of the table.
#[derive(Debug, Clone, Copy)]
pub struct Binding {
    /// The keys that give the command.
    pub keys: &'static [KeyName],
    /// What the help calls them.
    pub cap: &'static str,
    /// What the help says.
    pub text: &'static str,
    /// What they do.
    pub command: Command,
    /// Whether holding the key repeats it.
    pub repeats: bool,
}

/// A key as the table names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeyName {
    /// The key that types this letter or sign, in small letters.
    Types(&'static str),
    /// The space bar.
    Space,
    /// Escape.
    Escape,
    /// Delete.
    Delete,
    /// A function key.
    Function(u8),
    /// Page up.
    PageUp,
    /// Page down.
    PageDown,
    /// An arrow.
    Up,
    /// An arrow.
    Down,
    /// An arrow.
    Left,
    /// An arrow.
    Right,
}

use KeyName::{Delete, Down, Escape, Function, Left, PageDown, PageUp, Right, Space, Types, Up};

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

/// Every key there is.
pub const BINDINGS: &[Binding] = &[
    row(&[Space], "Space", "run / pause", Command::Pause),
    repeated(row(&[Types(".")], ".", "advance one tick", Command::Step)),
    row(&[Types("r")], "R", "restart the scene", Command::Restart),
    row(
        &[Types("s")],
        "S",
        "slow motion (0.1× speed)",
        Command::Slow,
    ),
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
        "pin / unpin the grabbed point",
        Command::Pin,
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
    row(&[Types("w")], "W", "wireframe", Command::Wireframe),
    row(&[Types("t")], "T", "tet mesh", Command::Tetrahedra),
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
        &[Function(1), Types("?")],
        "F1 ?",
        "show / hide this help",
        Command::Help,
    ),
    row(&[Escape], "Esc", "close this help", Command::Close),
];

/// What the pointer does, for the help.
pub const GESTURES: &[(&str, &str)] = &[
    ("Left drag", "grab and drag a body"),
    ("Wheel", "while dragging: nearer / farther"),
    ("Wheel", "otherwise: zoom"),
    ("Right drag", "orbit the camera"),
    ("Middle drag", "pan the camera"),
    (
        "Drop a file",
        "import a mesh as a soft body, or open a scene",
    ),
];

/// The row of the table that a key belongs to.
pub fn binding(key: &Key) -> Option<&'static Binding> {
    BINDINGS
        .iter()
        .find(|binding| binding.keys.iter().any(|name| name.is(key)))
}

impl KeyName {
    fn is(self, key: &Key) -> bool {
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
            | (Function(1), Key::F1)
            | (Function(12), Key::F12) => true,
            _ => false,
        }
    }
}

/// Obeys the keys.
pub struct KeysPlugin;

impl Plugin for KeysPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<ViewSettings>()
            .init_resource::<LastGrab>()
            .add_message::<ViewCommand>()
            .add_message::<Requested>()
            .add_systems(Update, obey.before(RequestSystems));
    }
}

fn obey(
    mut pressed: MessageReader<KeyboardInput>,
    held: Res<ButtonInput<KeyCode>>,
    egui: Res<EguiWantsInput>,
    mut hand: Hand,
) {
    use KeyCode::{AltLeft, ControlLeft, ControlRight, SuperLeft, SuperRight};
    let typing = egui.wants_keyboard_input();
    let modified = held.any_pressed([AltLeft, ControlLeft, ControlRight, SuperLeft, SuperRight]);
    for input in pressed.read() {
        if input.state != ButtonState::Pressed || typing || modified {
            continue;
        }
        if let Some(binding) = binding(&input.logical_key)
            && (!input.repeat || binding.repeats)
        {
            hand.carry_out(binding.command);
        }
    }
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
        let command = |key: Key| binding(&key).map(|binding| binding.command);
        assert_eq!(command(Key::Character("r".into())), Some(Command::Restart));
        assert_eq!(command(Key::Character("R".into())), Some(Command::Restart));
        assert_eq!(command(Key::Space), Some(Command::Pause));
        assert_eq!(command(Key::Character("q".into())), None);
        assert_eq!(command(Key::Tab), None);
    }
}
