//! The stress tests of the window, drawn and clicked without a window; and its background thread.

use crate::{
    recording_program::Folder,
    sandbox_panel::beside_the_panel,
    support::{cube, elastic_on_ground, settings, stretch, with},
};
use bevy_egui::egui::{
    Context, Event, Modifiers, PointerButton, Pos2, RawInput, Rect, Shape, Vec2,
};
use pliant::{
    recording::replay,
    sandbox::{
        lab::gallery::{
            Card, GalleryCommand, Line, News, On, Subject, Verdict, run_case, save, show,
            start_advice,
        },
        state::display::Theme,
        ui::{WidgetRects, theme},
    },
    solver::{Body, Threads, deform::deform},
    torture::{CASES, Case, Figure, Member},
};
use std::{path::PathBuf, thread, time::Duration};

fn verdict(value: f64) -> Verdict {
    Verdict {
        member: "cube3".to_owned(),
        members: 12,
        failed: usize::from(value > 1.0),
        expected_failed: 0,
        expected: None,
        advice: None,
        figures: vec![Figure::new(
            "distance to rest shape",
            value,
            1.0,
            "% of size",
        )],
        film: Vec::new(),
    }
}

fn card(shown: Option<Verdict>) -> Card {
    let line = |case: &Case| Line {
        title: case.title,
        about: case.about,
        any_body: case.any_body,
        verdicts: [None, Some((true, false))],
        running: None,
    };
    Card {
        this: Some("bunny".to_owned()),
        lines: CASES.iter().map(line).collect(),
        shown: shown.map(|verdict| (0, On::Own, verdict)),
        trouble: None,
    }
}

/// The request of the card when a widget is pressed, if one is named; the rectangles of its
/// widgets, and its texts.
fn drawn(
    card: &Card,
    size: Vec2,
    press: Option<&str>,
) -> (Vec<GalleryCommand>, WidgetRects, String) {
    let context = Context::default();
    theme::apply(&context, Theme::Dark);
    let mut places = WidgetRects::default();
    let mut commands = Vec::new();
    let mut words = String::new();
    let mut frame = |events: Vec<Event>, places: &mut WidgetRects| {
        let input = RawInput {
            screen_rect: Some(Rect::from_min_size(Pos2::ZERO, size)),
            events,
            ..RawInput::default()
        };
        let mut answer = None;
        let output = context.run_ui(input, |ui| {
            answer = Some(show(ui.ctx(), card, beside_the_panel(ui.ctx())))
        });
        let answer = answer.expect("run_ui draws at least once");
        *places = answer.places;
        commands.extend(answer.commands);
        words.clear();
        output
            .shapes
            .iter()
            .for_each(|clipped| collect(&clipped.shape, &mut words));
        output.drop_without_applying_deltas();
    };
    (0..3).for_each(|_| frame(Vec::new(), &mut places));
    if let Some(name) = press {
        let at = places
            .get(name)
            .unwrap_or_else(|| panic!("no widget {name}"));
        let button = |pressed| Event::PointerButton {
            pos: at.center(),
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        };
        frame(vec![Event::PointerMoved(at.center())], &mut places);
        frame(vec![button(true)], &mut places);
        frame(vec![button(false)], &mut places);
    }
    (commands, places, words)
}

fn collect(shape: &Shape, words: &mut String) {
    match shape {
        Shape::Vec(shapes) => shapes.iter().for_each(|shape| collect(shape, words)),
        Shape::Text(text) => {
            words.push_str(text.galley.text());
            words.push('\n');
        }
        _ => {}
    }
}

const LARGE: Vec2 = Vec2::new(1280.0, 800.0);

#[test]
fn every_button_of_the_gallery_makes_its_request() {
    let wanted = [
        ("gallery.0.this", GalleryCommand::Run(0, On::This)),
        ("gallery.0.own", GalleryCommand::Run(0, On::Own)),
        ("gallery.1", GalleryCommand::Look(1)),
        ("gallery.all", GalleryCommand::RunAll),
        ("gallery.close", GalleryCommand::Toggle),
    ];
    for (name, command) in wanted {
        assert_eq!(drawn(&card(None), LARGE, Some(name)).0, [command], "{name}");
    }
    let mut runs = card(None);
    runs.lines[0].running = Some(0.5);
    let (commands, ..) = drawn(&runs, LARGE, Some("gallery.all"));
    assert_eq!(commands, [GalleryCommand::Stop]);
    let nothing = Card {
        this: None,
        ..card(None)
    };
    assert_eq!(drawn(&nothing, LARGE, Some("gallery.0.this")).0, []);
}

#[test]
fn the_gallery_fits_every_window_and_shows_the_result_of_a_case() {
    for size in [(1280.0, 800.0), (900.0, 600.0), (700.0, 500.0)] {
        let size = Vec2::from(size);
        let (_, places, _) = drawn(&card(Some(verdict(0.2))), size, None);
        let whole = places.get("gallery").expect("the card");
        assert!(
            Rect::from_min_size(Pos2::ZERO, size).contains_rect(whole),
            "{size:?}"
        );
    }
    let (.., words) = drawn(&card(Some(verdict(0.2))), LARGE, None);
    assert!(
        words.contains("all 12 pass. Closest to its limit: cube3"),
        "{words}"
    );
    let figure = "distance to rest shape: 0.2 % of size (limit 1)";
    assert!(words.contains(figure), "{words}");
    let expected = Verdict {
        expected_failed: 2,
        ..verdict(0.2)
    };
    let (.., words) = drawn(&card(Some(expected)), LARGE, None);
    assert!(
        words.contains("10 of 12 pass, 2 are known failures"),
        "{words}"
    );
    let (.., words) = drawn(&card(Some(verdict(3.0))), LARGE, None);
    assert!(words.contains("unexpected failures: 1 of 12"), "{words}");
    let pressed = drawn(&card(Some(verdict(3.0))), LARGE, Some("gallery.advise")).0;
    assert_eq!(pressed, [GalleryCommand::Advise(0, On::Own)]);
    let advised = Verdict {
        advice: Some("passes at 20×1".to_owned()),
        ..verdict(3.0)
    };
    let (_, places, words) = drawn(&card(Some(advised)), LARGE, None);
    assert!(words.contains("It passes at 20×1."), "{words}");
    assert!(places.get("gallery.advise").is_none());
}

fn soft_cube() -> Body {
    let mut effects = elastic_on_ground();
    effects.stretch = stretch(1e-6);
    with(crate::support::body("cube", cube(0.5, 3), 1000.0), effects)
}

fn ended(case: &'static Case, subject: Subject) -> Verdict {
    let worker = run_case(case, subject).expect("a thread");
    for _ in 0..6000 {
        for news in worker.news() {
            if let News::Ended(outcome) = news {
                return outcome.expect("it can be run");
            }
        }
        thread::sleep(Duration::from_millis(10));
    }
    panic!("{} does not end within a minute", case.name);
}

#[test]
fn a_case_is_run_on_a_given_body_and_on_its_own() {
    let case = Case::named("squashed").expect("a case");
    let subject = Subject::This(Box::new(soft_cube()), settings(9.81, 60.0, 10, 1));
    let verdict = ended(case, subject);
    assert!(verdict.passed(), "{verdict:?}");
    assert_eq!((verdict.members, verdict.film.len()), (1, 3));
    let flat = verdict.film[0].lines.len();
    assert!(flat > 50, "{flat} edges");
    let own = ended(Case::named("edge").expect("a case"), Subject::Own);
    assert!(own.members > 1 && own.failed == 0, "{own:?}");
}

/// The gallery saves the world that it judged; it replays to the same hash.
#[test]
fn a_run_on_a_given_body_is_saved_as_a_recording_that_replays() {
    let case = Case::named("mirrored").expect("a case");
    let folder = Folder::new("gallery");
    let path = PathBuf::from(folder.file("mirrored.rec"));
    save(case, soft_cube(), settings(9.81, 60.0, 10, 1), &path).expect("it can be saved");
    let replay = replay(&path, &Threads::default(), |_| ()).expect("it can be replayed");
    assert!(replay.difference.is_none(), "{replay:?}");
    assert_eq!(replay.ticks, 300, "five seconds");
    let nowhere = PathBuf::from(folder.file("no such folder/a.rec"));
    let error = save(case, soft_cube(), settings(9.81, 60.0, 10, 1), &nowhere);
    assert!(error.is_err_and(|reason| reason.contains("no such folder")));
}

/// The judged body matches the displayed one: the action on the body on screen puts it into the
/// state in which the case starts the copy.
#[test]
fn the_displayed_body_starts_in_the_state_of_the_judged_one() {
    let settings = settings(0.0, 60.0, 10, 1);
    let deformed = CASES.iter().filter_map(|case| {
        let how = case.deformation(&Member::given(&soft_cube(), settings))?;
        Some((case, how))
    });
    let mut count = 0;
    for (case, how) in deformed {
        let mut seen = soft_cube();
        deform(&mut seen.particles, how);
        let mut judged = pliant::solver::World {
            bodies: vec![soft_cube()],
            ..pliant::solver::World::default()
        };
        let member = Member::given(&judged.bodies[0], settings);
        case.begin(&member, &mut judged).expect("it can begin");
        let judged = &judged.bodies[0].particles;
        assert_eq!(seen.particles.positions, judged.positions, "{}", case.name);
        count += 1;
    }
    assert!(count >= 5, "{count}");
}

#[test]
fn passing_settings_are_searched_on_a_thread() {
    let case = Case::named("plates").expect("a case");
    let member = "cube3,compliance=1e-4,damping=0.02".to_owned();
    let worker = start_advice(case, Subject::Own, member).expect("a thread");
    for _ in 0..6000 {
        for news in worker.news() {
            if let News::Advised(words) = news {
                let words = words.expect("it can be run");
                assert!(words.contains("passes at 80×1"), "{words}");
                return;
            }
        }
        thread::sleep(Duration::from_millis(10));
    }
    panic!("no advice in a minute");
}
