//! The card of the scene browser, drawn from plain data.

use bevy_egui::egui::{
    Align2, Area, Button, Color32, Context, CornerRadius, FontSelection, Frame, Id, Key, Label,
    Margin, Modifiers, Order, Pos2, Rect, Response, RichText, ScrollArea, Sense, Stroke,
    StrokeKind, TextEdit, TextStyle, TextureId, Ui, Vec2, WidgetInfo, WidgetText, WidgetType, pos2,
    style::ScrollAnimation, vec2,
};

use super::catalog::SceneEntry;
use crate::{
    sandbox::ui::{WidgetRects, theme},
    scene::registry::Group,
};

/// Maximum size of the card [logical px].
const SIZE: Vec2 = vec2(1000.0, 760.0);
/// Distance from the edges of the window [logical px].
const MARGIN: f32 = 20.0;
/// Minimum width of a tile [logical px].
const TILE: f32 = 180.0;
/// Size of the pictures [px].
pub const PICTURE: [u32; 2] = [200, 125];
/// Height of a picture as a fraction of its width.
const ASPECT: f32 = PICTURE[1] as f32 / PICTURE[0] as f32;
/// Height of the title below a picture [logical px].
const CAPTION: f32 = 22.0;
/// Height of the description of the marked scene [logical px].
const DETAILS: f32 = 64.0;
/// Title of the group of files.
const FILES: &str = "Your files";

/// The scenes of the card.
pub struct Card<'a> {
    /// All scenes, ordered by group.
    pub entries: &'a [SceneEntry],
    /// Name of the scene that is open.
    pub open: &'a str,
    /// The picture of a scene, by its name.
    pub picture: &'a dyn Fn(&str) -> Option<TextureId>,
}

/// What the user has typed and marked.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CardState {
    /// The search.
    pub query: String,
    /// The only group that is shown; `None` shows all.
    pub group: Option<Option<Group>>,
    /// Index of the marked scene among those that are shown.
    pub marked: usize,
    /// Whether the list has to scroll to the marked scene.
    scrolls: bool,
}

impl CardState {
    /// The state in which the browser opens: the open scene is marked.
    #[must_use]
    pub fn at(card: &Card) -> Self {
        let here = card.entries.iter().position(|it| it.name == card.open);
        Self {
            marked: here.unwrap_or(0),
            scrolls: true,
            ..Self::default()
        }
    }
}

/// Result of drawing the card.
#[derive(Debug, Default)]
pub struct Outcome {
    /// Name of the chosen scene.
    pub chosen: Option<String>,
    /// Whether the browser closes.
    pub closes: bool,
    /// Rectangles of the widgets.
    pub places: WidgetRects,
}

/// A direction in the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Left,
    Right,
    Up,
    Down,
}

impl Card<'_> {
    /// Draws the card over the middle of the window and handles its keys.
    pub fn draw(&self, context: &Context, state: &mut CardState) -> Outcome {
        let screen = context.content_rect();
        let mut outcome = Outcome::default();
        let veil = Area::new(Id::new("browser veil"))
            .order(Order::Foreground)
            .fixed_pos(screen.min)
            .constrain(false)
            .fade_in(false)
            .show(context, |ui| {
                let response = ui.allocate_response(screen.size(), Sense::click());
                let shade = Color32::from_black_alpha(120);
                ui.painter().rect_filled(screen, 0.0, shade);
                response.clicked()
            });
        let size = (screen.size() - Vec2::splat(2.0 * MARGIN)).min(SIZE);
        let rect = Rect::from_center_size(screen.center(), size);
        let page = Area::new(Id::new("browser"))
            .order(Order::Foreground)
            .fixed_pos(rect.min)
            .constrain(false)
            .fade_in(false)
            .show(context, |ui| {
                let margin = Margin::same(16);
                Frame::window(ui.style())
                    .inner_margin(margin)
                    .show(ui, |ui| {
                        let inside = rect.size() - margin.sum() - Vec2::splat(2.0);
                        ui.set_min_size(inside);
                        ui.set_max_size(inside);
                        self.contents(ui, state, &mut outcome);
                    });
            });
        context.move_to_top(page.response.layer_id);
        outcome.closes |= veil.inner || outcome.chosen.is_some();
        outcome
    }

    fn contents(&self, ui: &mut Ui, state: &mut CardState, outcome: &mut Outcome) {
        let (enters, step) = keys(ui, outcome);
        head(ui, state, outcome);
        self.groups(ui, state, outcome);
        ui.add_space(4.0);
        let shown: Vec<&SceneEntry> = self
            .entries
            .iter()
            .filter(|it| state.group.is_none_or(|group| it.group == group))
            .filter(|it| it.matches(&state.query))
            .collect();
        state.marked = state.marked.min(shown.len().saturating_sub(1));
        let height = ui.available_height() - DETAILS - 8.0;
        if shown.is_empty() {
            nothing(ui, state, outcome);
            return;
        }
        ScrollArea::vertical()
            .id_salt("scenes")
            .auto_shrink([false, false])
            .max_height(height)
            .min_scrolled_height(height)
            .show(ui, |ui| {
                let columns = (ui.available_width() / TILE).floor().max(1.0) as usize;
                let rows = rows(&shown, columns);
                if let Some(step) = step {
                    state.marked = moved(&rows, state.marked, step);
                    state.scrolls = true;
                }
                self.grid(ui, (&shown, &rows, columns), state, outcome);
            });
        state.scrolls = false;
        if let Some(marked) = shown.get(state.marked) {
            details(ui, marked);
            if enters {
                outcome.chosen = Some(marked.name.clone());
            }
        }
    }

    /// The groups, one of which can be shown alone.
    fn groups(&self, ui: &mut Ui, state: &mut CardState, outcome: &mut Outcome) {
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = theme::GAP;
            let mut chip = |ui: &mut Ui, group: Option<Option<Group>>, text: &str| {
                let is_shown = state.group == group;
                let button = ui.add(Button::new(text).selected(is_shown));
                let name = group.map_or("all", title).to_lowercase();
                outcome
                    .places
                    .note(format!("browser.group.{name}"), &button, ui.clip_rect());
                if button.clicked() {
                    state.group = group;
                    state.marked = 0;
                    state.scrolls = true;
                }
            };
            chip(ui, None, &format!("All {}", self.entries.len()));
            for group in Group::ALL.map(Some).into_iter().chain([None]) {
                let count = self.entries.iter().filter(|it| it.group == group).count();
                if count > 0 {
                    chip(ui, Some(group), &format!("{} {count}", title(group)));
                }
            }
        });
    }

    fn grid(
        &self,
        ui: &mut Ui,
        (shown, rows, columns): (&[&SceneEntry], &[Vec<usize>], usize),
        state: &mut CardState,
        outcome: &mut Outcome,
    ) {
        let gap = 10.0;
        let count = columns as f32;
        let width = (ui.available_width() - gap * (count - 1.0) - 10.0) / count;
        let size = vec2(width, width * ASPECT + CAPTION);
        let mut group = None;
        for row in rows {
            let of = shown[row[0]].group;
            if group != Some(of) {
                group = Some(of);
                ui.add_space(6.0);
                ui.label(RichText::new(title(of)).color(theme::of(ui).strong));
            }
            ui.horizontal(|ui| {
                ui.spacing_mut().item_spacing.x = gap;
                for &index in row {
                    let entry = shown[index];
                    let is_marked = index == state.marked;
                    let response = self.tile(ui, entry, size, is_marked);
                    outcome.places.note(
                        format!("browser.scene.{}", entry.name),
                        &response,
                        ui.clip_rect(),
                    );
                    if is_marked && state.scrolls {
                        response.scroll_to_me_animation(None, ScrollAnimation::none());
                    }
                    if response.clicked() {
                        outcome.chosen = Some(entry.name.clone());
                    }
                    response.on_hover_ui(|ui| {
                        ui.set_max_width(280.0);
                        ui.label(&entry.note);
                        ui.label(RichText::new(&entry.name).monospace().weak());
                    });
                }
            });
            ui.add_space(6.0);
        }
    }

    fn tile(&self, ui: &mut Ui, entry: &SceneEntry, size: Vec2, is_marked: bool) -> Response {
        let (rect, response) = ui.allocate_exact_size(size, Sense::click());
        let title = entry.title.as_str();
        response.widget_info(|| WidgetInfo::labeled(WidgetType::Button, true, title));
        if !ui.is_rect_visible(rect) {
            return response;
        }
        let colors = theme::of(ui);
        let picture = Rect::from_min_size(rect.min, vec2(size.x, size.x * ASPECT));
        let painter = ui.painter();
        painter.rect_filled(picture, 6.0, colors.sunken);
        match (self.picture)(&entry.name) {
            Some(texture) => {
                let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
                painter.image(texture, picture, whole, Color32::WHITE);
            }
            None => {
                let font = FontSelection::Style(TextStyle::Small).resolve(ui.style());
                let place = picture.center();
                painter.text(
                    place,
                    Align2::CENTER_CENTER,
                    "scene file",
                    font,
                    colors.weak,
                );
            }
        }
        let is_open = entry.name == self.open;
        let stroke = if is_marked {
            Stroke::new(2.5, colors.accent)
        } else if response.hovered() {
            Stroke::new(1.5, colors.text)
        } else {
            Stroke::new(1.0, colors.line)
        };
        let corners = CornerRadius::same(3);
        painter.rect_stroke(picture, corners, stroke, StrokeKind::Outside);
        let color = if is_marked || is_open {
            colors.strong
        } else {
            colors.text
        };
        let text = if is_open {
            format!("⏵ {title}")
        } else {
            title.to_owned()
        };
        let text = WidgetText::from(RichText::new(text).color(color));
        let wrap = Some(bevy_egui::egui::TextWrapMode::Truncate);
        let galley = text.into_galley(ui, wrap, size.x, TextStyle::Body);
        let place = pos2(rect.left() + 2.0, picture.bottom() + 4.0);
        ui.painter().galley(place, galley, color);
        response
    }
}

/// Title of a group.
fn title(group: Option<Group>) -> &'static str {
    group.map_or(FILES, Group::title)
}

/// Reads the keys of the browser before the search field does. Returns whether Enter was pressed,
/// and the step of an arrow key.
fn keys(ui: &Ui, outcome: &mut Outcome) -> (bool, Option<Step>) {
    let pressed = |key| ui.input_mut(|input| input.consume_key(Modifiers::NONE, key));
    outcome.closes |= pressed(Key::Escape);
    let arrows = [
        (Key::ArrowLeft, Step::Left),
        (Key::ArrowRight, Step::Right),
        (Key::ArrowUp, Step::Up),
        (Key::ArrowDown, Step::Down),
    ];
    let step = arrows.into_iter().find(|(key, _)| pressed(*key));
    (pressed(Key::Enter), step.map(|(_, step)| step))
}

/// The title, the search field and the close button.
fn head(ui: &mut Ui, state: &mut CardState, outcome: &mut Outcome) {
    ui.horizontal(|ui| {
        ui.heading(RichText::new("Scenes").color(theme::of(ui).strong));
        ui.add_space(8.0);
        let buttons = 96.0;
        let field = TextEdit::singleline(&mut state.query)
            .hint_text("Search by name, title, description or effect")
            .desired_width(ui.available_width() - buttons);
        let field = ui.add(field);
        outcome
            .places
            .note("browser.search", &field, ui.clip_rect());
        if field.changed() {
            state.marked = 0;
            state.scrolls = true;
        }
        // All typing goes here while the browser is open.
        field.request_focus();
        let clears = ui
            .add_enabled(!state.query.is_empty(), Button::new("Clear"))
            .on_hover_text("Clear the search");
        outcome
            .places
            .note("browser.clear", &clears, ui.clip_rect());
        if clears.clicked() {
            state.query.clear();
        }
        let closes = ui.button("×").on_hover_text("Close (Esc)");
        outcome
            .places
            .note("browser.close", &closes, ui.clip_rect());
        outcome.closes |= closes.clicked();
    });
}

/// Shown when no scene matches.
fn nothing(ui: &mut Ui, state: &mut CardState, outcome: &mut Outcome) {
    ui.add_space(24.0);
    ui.vertical_centered(|ui| {
        let query = state.query.trim();
        let text = format!("No scene matches “{query}”.");
        ui.label(RichText::new(text).color(theme::of(ui).strong));
        ui.weak("The search compares names, titles, descriptions and effects.");
        let all = ui.button("Show all scenes");
        outcome
            .places
            .note("browser.show_all", &all, ui.clip_rect());
        if all.clicked() {
            *state = CardState::default();
        }
    });
}

/// The description of the marked scene.
fn details(ui: &mut Ui, entry: &SceneEntry) {
    let colors = theme::of(ui);
    ui.separator();
    let text = format!("{}  {}", entry.title, entry.note);
    let text = RichText::new(text).color(colors.text);
    ui.add(Label::new(text).wrap());
    let effects = match entry.effects.as_str() {
        "" => "Enter opens it".to_owned(),
        effects => format!("{effects} · Enter opens it"),
    };
    let effects = RichText::new(effects).small().color(colors.weak);
    ui.add(Label::new(effects).truncate());
}

/// The rows of the grid: a new one for each group.
fn rows(shown: &[&SceneEntry], columns: usize) -> Vec<Vec<usize>> {
    let mut rows: Vec<Vec<usize>> = Vec::new();
    for (index, entry) in shown.iter().enumerate() {
        match rows.last_mut() {
            Some(row) if row.len() < columns && shown[row[0]].group == entry.group => {
                row.push(index);
            }
            _ => rows.push(vec![index]),
        }
    }
    rows
}

/// The scene that an arrow key leads to.
fn moved(rows: &[Vec<usize>], marked: usize, step: Step) -> usize {
    let Some(row) = rows.iter().position(|row| row.contains(&marked)) else {
        return marked;
    };
    let column = marked - rows[row][0];
    let other = match step {
        Step::Left => return marked.saturating_sub(1),
        Step::Right => {
            let last = rows.last().and_then(|row| row.last());
            return last.map_or(marked, |last| (marked + 1).min(*last));
        }
        Step::Up => row.checked_sub(1),
        Step::Down => Some(row + 1),
    };
    let target = other.and_then(|row| rows.get(row));
    target.map_or(marked, |row| row[column.min(row.len() - 1)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries() -> Vec<SceneEntry> {
        let groups = [
            Group::Solids,
            Group::Solids,
            Group::Solids,
            Group::Cloth,
            Group::Cloth,
        ];
        let entry = |(n, group): (usize, Group)| {
            let name = format!("scene {n}");
            SceneEntry::new((&name, &name, ""), Some(group), &[])
        };
        groups.into_iter().enumerate().map(entry).collect()
    }

    #[test]
    fn a_group_begins_a_row() {
        let entries = entries();
        let shown: Vec<_> = entries.iter().collect();
        let expected = [vec![0, 1], vec![2], vec![3, 4]];
        assert_eq!(rows(&shown, 2), expected);
    }

    #[test]
    fn arrows_go_through_rows_of_different_length_and_stop_at_the_ends() {
        let rows = [vec![0, 1], vec![2], vec![3, 4]];
        assert_eq!(moved(&rows, 1, Step::Down), 2);
        assert_eq!(moved(&rows, 2, Step::Down), 3);
        assert_eq!(moved(&rows, 4, Step::Down), 4);
        assert_eq!(moved(&rows, 4, Step::Up), 2);
        assert_eq!(moved(&rows, 1, Step::Right), 2);
        assert_eq!(moved(&rows, 4, Step::Right), 4);
        assert_eq!(moved(&rows, 0, Step::Left), 0);
    }
}
