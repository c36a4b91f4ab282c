//! The cards over the view: open a file, save under a name, and unsaved changes at closing. A card
//! is plain data and a function that draws it, so that it can be pressed in a test without a window.

use crate::sandbox::{
    state::keep::FileKind,
    ui::{WidgetRects, area, theme},
};
use bevy::prelude::Resource;
use bevy_egui::egui::{
    Align2, Area, Button, Context, Frame, Id, Key, Label, Margin, Order, Rect, RichText, Stroke,
    TextEdit, Ui, Vec2,
};
use std::path::PathBuf;

/// Width of a card [logical px].
const WIDTH: f32 = 420.0;

/// The card that is open.
#[derive(Resource, Debug, Clone, Default, PartialEq)]
pub enum Card {
    /// None.
    #[default]
    Closed,
    /// Asks for a file to open.
    Open {
        /// The path as it was typed.
        path: String,
        /// What was wrong with it.
        error: Option<String>,
    },
    /// Asks for a name to save under.
    Save(SaveCard),
    /// The window is about to close, and something is not saved.
    Closing {
        /// What has changed, in words.
        changes: Vec<String>,
        /// The file of the scene, if it has one.
        file: Option<PathBuf>,
    },
}

/// Asks for a name to save under.
#[derive(Debug, Clone, PartialEq)]
pub struct SaveCard {
    /// What is saved.
    pub kind: FileKind,
    /// The name as it was typed.
    pub name: String,
    /// The folder.
    pub folder: PathBuf,
    /// What was wrong at the last attempt.
    pub error: Option<String>,
    /// Why a scene file cannot describe the scene; a snapshot is offered then.
    pub reasons: Vec<String>,
    /// Whether a file of this name exists, and may be replaced.
    pub exists: bool,
    /// Whether the window is closed afterwards.
    pub then_close: bool,
}

/// What was pressed on a card.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Answer {
    /// Open the file.
    Open,
    /// Save.
    Save {
        /// Whether an existing file is replaced.
        replace: bool,
    },
    /// Save a snapshot instead of a scene.
    Snapshot,
    /// Close the window without saving.
    Discard,
    /// Close the card.
    Cancel,
}

/// Draws the card in the middle of the area that the panel leaves free.
pub fn draw(
    context: &Context,
    card: &mut Card,
    free: Rect,
    places: &mut WidgetRects,
) -> Option<Answer> {
    if *card == Card::Closed {
        return None;
    }
    let mut answer = None;
    Area::new(Id::new("keep card"))
        .order(Order::Foreground)
        .anchor(Align2::CENTER_CENTER, area::off_center(context, free))
        // Fading would leave a gray box: see `Palette::veil` about translucent colors.
        .fade_in(false)
        .show(context, |ui| {
            Frame::new()
                .fill(theme::of(ui).veil)
                .stroke(Stroke::new(1.0, theme::of(ui).accent))
                .corner_radius(8.0)
                .inner_margin(Margin::symmetric(18, 14))
                .show(ui, |ui| {
                    ui.set_width(WIDTH.min(free.width() - 60.0).max(200.0));
                    answer = match card {
                        Card::Closed => None,
                        Card::Open { path, error } => open(ui, path, error.as_deref(), places),
                        Card::Save(card) => save(ui, card, places),
                        Card::Closing { changes, file } => {
                            closing(ui, changes, file.is_some(), places)
                        }
                    };
                });
        });
    let escape = context.input(|input| input.key_pressed(Key::Escape));
    answer.or(escape.then_some(Answer::Cancel))
}

fn open(
    ui: &mut Ui,
    path: &mut String,
    error: Option<&str>,
    places: &mut WidgetRects,
) -> Option<Answer> {
    title(ui, "Open file");
    weak(
        ui,
        "Path of a scene (.ron), a snapshot (.snap) or a mesh. A file can also be dropped on the window: a mesh is then added to the scene.",
    );
    let entered = field(ui, "keep.path", path, "/home/me/scene.ron", places);
    if let Some(error) = error {
        alarm(ui, error);
    }
    let buttons = [("keep.open", "Open", Answer::Open), CANCEL];
    let pressed = row(ui, &buttons, places);
    pressed.or(entered.then_some(Answer::Open))
}

fn save(ui: &mut Ui, card: &mut SaveCard, places: &mut WidgetRects) -> Option<Answer> {
    let (heading, note) = match card.kind {
        FileKind::Scene => (
            "Save scene",
            "Saves the initial state with your changes. For current motion and deformation, save a \
             snapshot.",
        ),
        FileKind::Snapshot => (
            "Save snapshot",
            "Saves the complete state. Continuing from it is bit-identical.",
        ),
    };
    title(ui, heading);
    weak(ui, note);
    let before = card.name.clone();
    let entered = field(ui, "keep.name", &mut card.name, "name", places);
    if card.name != before {
        (card.error, card.exists) = (None, false);
    }
    let ending = card.kind.extension();
    weak(ui, &format!("in {} · .{ending}", card.folder.display()));
    if let Some(error) = &card.error {
        alarm(ui, error);
    }
    if !card.reasons.is_empty() {
        alarm(ui, "A scene file cannot describe this state:");
        for reason in card.reasons.iter().take(4) {
            weak(ui, &format!("· {reason}"));
        }
        let buttons = [
            ("keep.snapshot", "Save snapshot instead", Answer::Snapshot),
            CANCEL,
        ];
        return row(ui, &buttons, places);
    }
    if card.exists {
        alarm(
            ui,
            "A file of this name exists. Replace it, or enter another name.",
        );
        let replace = Answer::Save { replace: true };
        return row(ui, &[("keep.replace", "Replace", replace), CANCEL], places);
    }
    let save = Answer::Save { replace: false };
    let pressed = row(ui, &[("keep.save", "Save", save), CANCEL], places);
    pressed.or(entered.then_some(save))
}

fn closing(
    ui: &mut Ui,
    changes: &[String],
    has_file: bool,
    places: &mut WidgetRects,
) -> Option<Answer> {
    title(ui, "Save changes before closing?");
    weak(ui, &format!("{}.", changes.join(", ")));
    let save = if has_file { "Save" } else { "Save as…" };
    let buttons = [
        ("keep.save", save, Answer::Save { replace: true }),
        ("keep.discard", "Discard", Answer::Discard),
        CANCEL,
    ];
    row(ui, &buttons, places)
}

const CANCEL: (&str, &str, Answer) = ("keep.cancel", "Cancel", Answer::Cancel);

fn title(ui: &mut Ui, text: &str) {
    ui.label(RichText::new(text).heading().color(theme::of(ui).strong));
    ui.add_space(4.0);
}

fn weak(ui: &mut Ui, text: &str) {
    ui.add(Label::new(RichText::new(text).color(theme::of(ui).weak)).wrap());
}

fn alarm(ui: &mut Ui, text: &str) {
    ui.add(Label::new(RichText::new(text).color(theme::of(ui).alarm)).wrap());
}

/// A text field that has the keyboard from the start; true if Enter was pressed.
fn field(ui: &mut Ui, name: &str, text: &mut String, hint: &str, places: &mut WidgetRects) -> bool {
    ui.add_space(6.0);
    let id = Id::new(name);
    let response = ui.add(
        TextEdit::singleline(text)
            .id(id)
            .hint_text(hint)
            .desired_width(f32::INFINITY),
    );
    places.note(name, &response, ui.clip_rect());
    let entered = response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
    // The card is modal: the field keeps the keyboard unless a button takes it.
    if ui.memory(|memory| memory.focused().is_none()) {
        response.request_focus();
    }
    ui.add_space(4.0);
    entered
}

fn row(ui: &mut Ui, buttons: &[(&str, &str, Answer)], places: &mut WidgetRects) -> Option<Answer> {
    let mut pressed = None;
    ui.add_space(8.0);
    ui.horizontal(|ui| {
        for (name, text, answer) in buttons {
            let size = Vec2::new(84.0, theme::ROW + 4.0);
            let response = ui.add(Button::new(*text).min_size(size));
            places.note(*name, &response, ui.clip_rect());
            if response.clicked() {
                pressed = Some(*answer);
            }
        }
    });
    pressed
}
