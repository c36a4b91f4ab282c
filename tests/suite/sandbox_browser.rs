//! The scene browser, drawn and used without a window.

use bevy_egui::egui::{
    Context, Event, Key, Modifiers, PointerButton, Pos2, RawInput, Rect, TextureId, Vec2, vec2,
};
use pliant::{
    sandbox::{
        panel::browser::{
            card::{Card, CardState, Outcome},
            catalog::SceneEntry,
        },
        state::display::Theme,
        ui::theme,
    },
    scene::registry::{Group, SCENES},
};

fn entries() -> Vec<SceneEntry> {
    let mut entries: Vec<SceneEntry> = SCENES
        .iter()
        .map(|scene| {
            let effects: &[(&str, &str)] = match scene.group {
                Group::Balloons => &[("pressure", "Pressure")],
                _ => &[],
            };
            let texts = (scene.name, scene.name, "What to look at.");
            SceneEntry::new(texts, Some(scene.group), effects)
        })
        .collect();
    entries.sort_by_key(|entry| entry.group);
    let file = ("/home/me/my cloth.ron", "My cloth", "A file.");
    entries.push(SceneEntry::new(file, None, &[]));
    entries
}

struct Browser {
    context: Context,
    size: Vec2,
    entries: Vec<SceneEntry>,
    open: &'static str,
    state: Option<CardState>,
    last: Outcome,
}

impl Browser {
    fn new(size: Vec2, open: &'static str) -> Self {
        let context = Context::default();
        theme::apply(&context, Theme::Dark);
        let mut browser = Self {
            context,
            size,
            entries: entries(),
            open,
            state: None,
            last: Outcome::default(),
        };
        for _ in 0..4 {
            browser.draw(Vec::new());
        }
        browser
    }

    fn draw(&mut self, events: Vec<Event>) {
        let input = RawInput {
            screen_rect: Some(Rect::from_min_size(Pos2::ZERO, self.size)),
            events,
            ..RawInput::default()
        };
        let mut outcome = None;
        let output = self.context.run_ui(input, |ui| {
            let card = Card {
                entries: &self.entries,
                open: self.open,
                picture: &|_| Some(TextureId::default()),
            };
            let state = self.state.get_or_insert_with(|| CardState::at(&card));
            outcome = Some(card.draw(ui.ctx(), state));
        });
        output.drop_without_applying_deltas();
        self.last = outcome.expect("run_ui draws at least once");
    }

    fn key(&mut self, key: Key) {
        self.draw(vec![Event::Key {
            key,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers: Modifiers::NONE,
        }]);
    }

    fn press(&mut self, name: &str) {
        let at = self.last.places.get(name).expect(name).center();
        let button = |pressed| Event::PointerButton {
            pos: at,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        };
        self.draw(vec![Event::PointerMoved(at)]);
        self.draw(vec![button(true)]);
        self.draw(vec![button(false)]);
    }

    fn tiles(&self) -> Vec<String> {
        let names = self.last.places.iter().map(|(name, _)| name);
        let tiles = names.filter_map(|name| name.strip_prefix("browser.scene."));
        tiles.map(str::to_owned).collect()
    }
}

const SIZES: [Vec2; 2] = [vec2(1280.0, 800.0), vec2(900.0, 600.0)];

#[test]
fn the_browser_opens_at_the_open_scene_and_enter_opens_the_marked_one() {
    for size in SIZES {
        let mut browser = Browser::new(size, "sticky");
        let open = browser.last.places.get("browser.scene.sticky");
        let open = open.expect("it is scrolled into view");
        let window = Rect::from_min_size(Pos2::ZERO, size);
        assert!(window.contains_rect(open), "{open:?}");
        browser.key(Key::ArrowLeft);
        assert_eq!(browser.last.chosen, None);
        browser.key(Key::Enter);
        // The scene before it in its group.
        assert_eq!(browser.last.chosen.as_deref(), Some("bounce"));
        assert!(browser.last.closes);
    }
}

#[test]
fn typing_searches_at_once_and_finds_effects_too() {
    let mut browser = Browser::new(SIZES[0], "bunny");
    browser.draw(vec![Event::Text("pressure".to_owned())]);
    browser.draw(Vec::new());
    assert_eq!(browser.tiles(), ["balloon", "struts"]);
    browser.key(Key::ArrowRight);
    browser.key(Key::Enter);
    assert_eq!(browser.last.chosen.as_deref(), Some("struts"));
}

#[test]
fn a_search_without_result_says_so_and_can_be_cleared() {
    let mut browser = Browser::new(SIZES[1], "bunny");
    browser.draw(vec![Event::Text("no such scene".to_owned())]);
    browser.draw(Vec::new());
    assert_eq!(browser.tiles(), Vec::<String>::new());
    browser.key(Key::Enter);
    assert_eq!(browser.last.chosen, None, "there is nothing to open");
    browser.press("browser.show_all");
    browser.draw(Vec::new());
    assert!(browser.tiles().len() > 3);
}

#[test]
fn a_group_is_shown_alone_and_files_have_one_of_their_own() {
    let mut browser = Browser::new(SIZES[0], "bunny");
    browser.press("browser.group.your files");
    browser.draw(Vec::new());
    assert_eq!(browser.tiles(), ["/home/me/my cloth.ron"]);
    browser.press("browser.scene./home/me/my cloth.ron");
    assert_eq!(
        browser.last.chosen.as_deref(),
        Some("/home/me/my cloth.ron")
    );
}

#[test]
fn escape_the_button_and_a_press_beside_the_card_close_it() {
    let mut browser = Browser::new(SIZES[0], "bunny");
    browser.key(Key::Escape);
    assert!(browser.last.closes && browser.last.chosen.is_none());
    let mut browser = Browser::new(SIZES[0], "bunny");
    browser.press("browser.close");
    assert!(browser.last.closes);
}

#[test]
fn nothing_of_the_browser_sticks_out_of_the_window() {
    for size in SIZES {
        for scale in [1.0, 2.0] {
            let size = size / scale;
            let browser = Browser::new(size, "heap");
            let window = Rect::from_min_size(Pos2::ZERO, size);
            assert!(
                browser.tiles().len() >= 2,
                "{size:?}: {:?}",
                browser.tiles()
            );
            for (name, rect) in browser.last.places.iter() {
                assert!(window.contains_rect(rect), "{name} {rect:?} at {size:?}");
            }
        }
    }
}

#[test]
fn every_group_has_scenes() {
    for group in Group::ALL {
        let count = SCENES.iter().filter(|scene| scene.group == group).count();
        assert!(count > 0, "{}", group.title());
    }
}
