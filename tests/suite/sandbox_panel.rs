//! The panel, drawn and clicked without a window: a bare egui context, a plain model, and synthetic
//! pointer events.

use bevy_egui::egui::{
    Context, Event, FullOutput, Key, Modifiers, PointerButton, Pos2, RawInput, Rect, Shape, Vec2,
    ViewportId, ViewportInfo, pos2, vec2,
};
use pliant::{
    sandbox::{
        input::keys::{BINDINGS, GESTURES},
        lab::reference_overlay::distance::{Distance, Trail},
        panel::{
            Panel,
            energy::EnergyTrack,
            history::History,
            model::{
                Addition, BodyEntry, BodyState, ClockModel, Done, EffectModel, EffectiveModel,
                EnergyModel, FileModel, GrabModel, GroupModel, PanelModel, Parameter,
                ReferenceModel, StageModel, StoredEnergy,
            },
            show,
        },
        render::quality::EffectiveQuality,
        state::{
            color::ColorMode,
            display::{DisplaySettings, Theme},
            hands::{Hands, HandsChange, Shot},
            keep::{FileKind, KeepRequest, RecentFile},
            request::{Distortion, Request},
            search::PanelSearch,
            selection::Scope,
            spawn::{ColliderKind, Spawn, SpawnPlace},
            view::{SolverView, ViewSettings},
        },
        ui::{
            WidgetRects, area, theme,
            track::{Spread, Track},
        },
    },
    solver::{GroupName, advance::Stage},
};

const SIZES: [(Vec2, f32); 4] = [
    (Vec2::new(1280.0, 800.0), 1.0),
    (Vec2::new(900.0, 600.0), 1.0),
    (Vec2::new(1280.0, 800.0), 2.0),
    (Vec2::new(960.0, 540.0), 1.5),
];

/// The area beside a panel of 344 px.
pub fn beside_the_panel(context: &Context) -> Rect {
    let view = ViewSettings {
        panel_width: 344.0,
        ..ViewSettings::default()
    };
    area::free(context, &view)
}

fn parameter(name: &'static str, unit: &'static str, track: Track, value: f64) -> Parameter {
    Parameter {
        name,
        title: name,
        unit,
        help: "What it does.",
        track,
        value,
        spread: None,
        original: Some(value),
        choices: &[],
        changed: false,
        unusual: false,
    }
}

fn stretch() -> EffectModel {
    let logarithmic = |low, high| Track::new(low..=high, Spread::Logarithmic);
    let changed = Parameter {
        original: Some(1e-3),
        changed: true,
        ..parameter("damping", "s", logarithmic(1e-4, 1.0).with_zero(true), 1e-2)
    };
    EffectModel {
        name: "stretch",
        title: "Stretch",
        summary: "Edges resist a change of length.",
        words: "compliance Compliance".to_owned(),
        carriers: 2,
        carriers_shown: 2,
        elements: 1240,
        fraction: Some(0.4),
        note: None,
        effective: Some(EffectiveModel {
            effective: 4e-5,
            unit: "m/N",
            factor: Some(4.0),
            limited: true,
            substeps: Some(24),
        }),
        overpressure: Some((-20.0, 315.0)),
        done: Some(Done::Emitted {
            emitted: 123_456,
            waiting: 1000,
        }),
        contacts: None,
        group: Some(GroupModel {
            names: vec![GroupName::of("sail"), GroupName::of("tail")],
            chosen: Some(GroupName::of("tail")),
        }),
        switchable: true,
        parameters: vec![
            parameter(
                "compliance",
                "m/N",
                logarithmic(1e-8, 1e-1).with_zero(true),
                1e-5,
            ),
            changed,
        ],
    }
}

fn absent() -> EffectModel {
    EffectModel {
        name: "collide",
        title: "Collide",
        carriers: 0,
        carriers_shown: 0,
        elements: 0,
        fraction: None,
        note: None,
        effective: None,
        overpressure: None,
        done: Some(Done::Split(12_345)),
        contacts: None,
        group: None,
        parameters: Vec::new(),
        ..stretch()
    }
}

fn model() -> PanelModel {
    let whole = |high| Track::new(1.0..=high, Spread::Integer);
    let mut history = History::default();
    (0..50).for_each(|_| history.push([0.1; Stage::ALL.len() + 1]));
    let body = |key, name: &str, state| BodyEntry {
        key,
        name: name.to_owned(),
        particles: 343,
        inverted: 0,
        state,
        hidden: false,
        color: [240, 84, 60],
    };
    PanelModel {
        file: FileModel {
            recent: vec![RecentFile {
                path: "/home/me/Documents/Pliant/my cube.ron".into(),
                exists: true,
            }],
            scene_file: None,
            records: false,
            films: false,
        },
        is_pinned: true,
        search: PanelSearch::default(),
        scene: "jelly".to_owned(),
        scene_title: "jelly".to_owned(),
        scene_note: "A cube falls, wobbles, and comes to rest in the end.".to_owned(),
        clock: ClockModel {
            speed: 1.0,
            ..ClockModel::default()
        },
        undo: Some("Stretch compliance".to_owned()),
        redo: None,
        settings: vec![
            parameter("substeps", "", whole(100.0), 10.0),
            parameter(
                "gravity_y",
                "m/s²",
                Track::new(-20.0..=20.0, Spread::Linear),
                -9.81,
            ),
        ],
        bodies: vec![
            body(1, "cube", BodyState::Awake),
            body(2, "ball", BodyState::Asleep),
        ],
        scope: Scope::All,
        effects: vec![stretch(), absent()],
        history,
        stages: vec![StageModel {
            name: "presolve",
            title: "Presolve".to_owned(),
            fraction: 0.1,
        }],
        grabbed: Some(GrabModel {
            body: "cube".to_owned(),
            pinned: false,
        }),
        spawn: Spawn::default(),
        hands: Hands::default(),
        additions: vec![Addition {
            name: "box".to_owned(),
            title: "box".to_owned(),
            begins_group: false,
        }],
        wireframe: false,
        contacts: false,
        tetrahedra: false,
        materials: pliant::scene::Material::all().iter().collect(),
        material: None,
        presets: vec![("My jelly".to_owned(), "density: 2,".to_owned())],
        answers: ("heavy elastica".to_owned(), true),
        solver: SolverView::Partitions,
        color: ColorMode::Speed,
        plots: false,
        threads: Some(parameter("threads", "", whole(8.0), 2.0)),
        ms_per_tick: 0.48,
        projections: Some(212e6),
        steps: vec!["presolve", "stretch", "ground", "postsolve"],
        energy: Some(energy()),
        stored: StoredEnergy {
            kinetic: 1.5,
            potential: 20.0,
            elastic: 3.0,
            unresolved: 0.1,
        },
        reference_overlay: None,
        display: DisplaySettings::default(),
        automatic_scale: 1.0,
        quality: EffectiveQuality::High,
    }
}

fn energy() -> EnergyModel {
    let mut track = EnergyTrack::default();
    (0..500).for_each(|tick| track.push(vec![("Kinetic", tick as f32), ("Stretch", -1.0)]));
    EnergyModel {
        seconds: 8.3,
        held: vec![("Kinetic", 1.5, -0.5), ("Stretch", 2.0, 2.0)],
        rows: vec![
            ("Damping", "What it is.", -1.0),
            ("Hand", "What it is.", 2.5),
        ],
        change: 1.5,
        gap: 1e-9,
        track,
    }
}

/// Draws the panel repeatedly and clicks it. The model does not change, so a press that lasts two
/// frames makes two requests.
struct Pointer {
    context: Context,
    model: PanelModel,
    size: Vec2,
    scale: f32,
    frames: u32,
    places: WidgetRects,
    requests: Vec<Request>,
    refusals: Vec<String>,
}

impl Pointer {
    fn new(model: PanelModel, (size, scale): (Vec2, f32)) -> Self {
        let context = Context::default();
        theme::apply(&context, Theme::Dark);
        let mut pointer = Self {
            context,
            model,
            size,
            scale,
            frames: 0,
            places: WidgetRects::default(),
            requests: Vec::new(),
            refusals: Vec::new(),
        };
        // egui knows the position of a widget from the previous frame.
        for _ in 0..3 {
            pointer.draw(Vec::new());
        }
        pointer
    }

    /// Clicks the heading of a folded section, and waits until it is open.
    fn unfold(&mut self, section: &str) {
        assert_eq!(self.press_widget(section), []);
        for _ in 0..30 {
            self.draw(Vec::new());
        }
    }

    fn draw(&mut self, events: Vec<Event>) -> Vec<Shape> {
        let viewport = ViewportInfo {
            native_pixels_per_point: Some(self.scale),
            ..ViewportInfo::default()
        };
        let input = RawInput {
            screen_rect: Some(Rect::from_min_size(Pos2::ZERO, self.size)),
            time: Some(f64::from(self.frames) / 60.0),
            viewports: std::iter::once((ViewportId::ROOT, viewport)).collect(),
            events,
            ..RawInput::default()
        };
        self.frames += 1;
        let mut drawn = None;
        let output = self.context.run_ui(input, |ui| {
            drawn = Some(show(ui.ctx(), &self.model).0);
        });
        let panel: Panel = drawn.expect("run_ui draws at least once");
        self.places = panel.places().clone();
        self.requests.extend(panel.requests().iter().cloned());
        self.refusals.extend(panel.refusals().iter().cloned());
        let FullOutput { shapes, .. } = &output;
        let shapes = shapes.iter().map(|clipped| clipped.shape.clone()).collect();
        output.drop_without_applying_deltas();
        shapes
    }

    fn place(&self, name: &str) -> Rect {
        self.places
            .get(name)
            .unwrap_or_else(|| panic!("no widget {name}"))
    }

    fn press(&mut self, at: Pos2) {
        let button = |pressed| Event::PointerButton {
            pos: at,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        };
        self.draw(vec![Event::PointerMoved(at)]);
        self.draw(vec![button(true)]);
        self.draw(vec![button(false)]);
        self.draw(Vec::new());
    }

    fn press_widget(&mut self, name: &str) -> Vec<Request> {
        self.requests.clear();
        self.press(self.place(name).center());
        std::mem::take(&mut self.requests)
    }
}

fn panel_pointer() -> Pointer {
    Pointer::new(model(), SIZES[0])
}

#[test]
fn pressing_a_slider_requests_the_value_at_that_position() {
    let mut pointer = panel_pointer();
    let rail = pointer.place("stretch.compliance");
    pointer.requests.clear();
    pointer.press(pos2(rail.left() + 0.5 * rail.width(), rail.center().y));
    pointer.requests.dedup();
    let [
        Request::Parameter {
            effect: "stretch",
            parameter: "compliance",
            value: Some(value),
        },
    ] = pointer.requests[..]
    else {
        panic!("{:?}", pointer.requests);
    };
    // The middle of a logarithmic track from 1e-8 to 1e-1 is 3e-5, slightly less because of the
    // stop at 0.
    assert!((1e-5..1e-4).contains(&value), "{value}");
}

#[test]
fn the_entries_of_the_file_menu_request_what_they_say() {
    use KeepRequest::{OpenCard, PlainPicture, Record, Save, SaveAs};
    for (entry, request) in [
        ("file.open", Request::Keep(OpenCard)),
        ("file.save", Request::Keep(Save)),
        ("file.save_as", Request::Keep(SaveAs(FileKind::Scene))),
        ("file.snapshot", Request::Keep(SaveAs(FileKind::Snapshot))),
        ("file.record", Request::Keep(Record)),
        ("file.film", Request::Film),
        ("file.picture", Request::Screenshot),
        ("file.plain_picture", Request::Keep(PlainPicture)),
    ] {
        let mut pointer = panel_pointer();
        pointer.press_widget("file");
        assert_eq!(pointer.press_widget(entry), [request], "{entry}");
        pointer.draw(Vec::new());
        assert!(pointer.places.get(entry).is_none(), "the menu closes");
    }
}

#[test]
fn the_left_end_of_a_compliance_is_rigid() {
    let mut pointer = panel_pointer();
    let rail = pointer.place("stretch.compliance");
    pointer.press(pos2(rail.left() + 2.0, rail.center().y));
    pointer.requests.dedup();
    assert_eq!(
        pointer.requests,
        [Request::Parameter {
            effect: "stretch",
            parameter: "compliance",
            value: Some(0.0),
        }]
    );
}

/// Compliance and substeps are in sight whatever is folded or scrolled, and are not shown twice; of the
/// other settings, those that a scene changes.
#[test]
fn compliance_and_substeps_stand_above_everything_that_scrolls() {
    let shown = |pointer: &Pointer, name: &str| pointer.places.get(name).is_some();
    for size in SIZES {
        let pointer = Pointer::new(model(), size);
        let [compliance, substeps, accuracy, bodies] = [
            "stretch.compliance",
            "world.substeps",
            "accuracy",
            "section.bodies",
        ]
        .map(|name| pointer.place(name));
        assert!(compliance.bottom() <= substeps.top() && substeps.bottom() <= accuracy.top());
        assert!(accuracy.bottom() <= bodies.top());
        assert!(!shown(&pointer, "world.gravity_y"), "it is folded");
    }
    // The first screen has all bodies and the first effects.
    let pointer = panel_pointer();
    assert!(shown(&pointer, "effect.stretch") && shown(&pointer, "stretch.damping"));
    let mut heavy = model();
    heavy.settings[1].unusual = true;
    assert!(shown(&Pointer::new(heavy, SIZES[0]), "world.gravity_y"));
    // Nothing selected has a compliance.
    let mut rigid = model();
    rigid.effects.remove(0);
    assert!(shown(&Pointer::new(rigid, SIZES[0]), "world.substeps"));
}

#[test]
fn the_slider_of_threads_ranges_from_one_to_one_per_core() {
    let mut pointer = panel_pointer();
    pointer.unfold("section.world");
    let rail = pointer.place("world.threads");
    for (x, count) in [(rail.left() + 2.0, 1.0), (rail.right() - 2.0, 8.0)] {
        pointer.requests.clear();
        pointer.press(pos2(x, rail.center().y));
        pointer.requests.dedup();
        assert_eq!(pointer.requests, [Request::Threads(Some(count))]);
    }
}

#[test]
fn with_a_single_available_thread_the_panel_says_so() {
    let one = PanelModel {
        threads: None,
        ..model()
    };
    let mut pointer = Pointer::new(one, SIZES[0]);
    pointer.unfold("section.world");
    let shapes = pointer.draw(Vec::new());
    let mut texts = Vec::new();
    collect_texts(&shapes, &mut texts);
    assert!(pointer.places.get("world.threads").is_none());
    assert!(
        texts.iter().any(|text| text.contains("One thread")),
        "{texts:?}"
    );
}

#[test]
fn the_projections_a_second_are_shown_with_their_unit_while_there_are_any() {
    let shown = |projections| {
        let panel = PanelModel {
            projections,
            ..model()
        };
        let mut pointer = Pointer::new(panel, SIZES[0]);
        pointer.unfold("section.world");
        let mut texts = Vec::new();
        collect_texts(&pointer.draw(Vec::new()), &mut texts);
        texts
    };
    let figure = |texts: &[String]| texts.iter().any(|text| text.contains("M/s"));
    assert!(shown(Some(212.34e6)).iter().any(|text| text == "212 M/s"));
    assert!(!figure(&shown(None)), "nothing is solved");
}

#[test]
fn a_number_can_be_typed_with_its_unit() {
    let mut pointer = panel_pointer();
    let entry = pointer.place("stretch.compliance.entry");
    pointer.press(entry.center());
    pointer.draw(vec![Event::Text("2.5e-6 m/N".to_owned())]);
    let key = |pressed| Event::Key {
        key: Key::Enter,
        physical_key: None,
        pressed,
        repeat: false,
        modifiers: Modifiers::NONE,
    };
    pointer.draw(vec![key(true)]);
    pointer.draw(vec![key(false)]);
    assert_eq!(
        pointer.requests,
        [Request::Parameter {
            effect: "stretch",
            parameter: "compliance",
            value: Some(2.5e-6),
        }]
    );
}

#[test]
fn a_typed_word_changes_nothing_and_says_why() {
    for (typed, reason) in [
        ("many", "not a number"),
        ("nan", "not a number"),
        ("1/0", "zero"),
    ] {
        let mut pointer = panel_pointer();
        pointer.press(pointer.place("world.substeps.entry").center());
        pointer.draw(vec![Event::Text(typed.to_owned())]);
        // A click elsewhere ends the text input.
        pointer.press(pos2(100.0, 100.0));
        assert_eq!(pointer.requests, []);
        let [message] = pointer.refusals.as_slice() else {
            panic!("{typed}: {:?}", pointer.refusals);
        };
        assert!(message.contains(reason), "{message}");
    }
}

#[test]
fn a_group_of_vertices_is_chosen_where_there_are_any() {
    for (line, name) in [("sail", GroupName::of("sail")), ("", GroupName::default())] {
        let mut pointer = panel_pointer();
        pointer.press_widget("force_mask.group");
        let asked = pointer.press_widget(&format!("force_mask.group.{line}"));
        assert_eq!(asked, [Request::ForceGroup(name)], "{line}");
    }
    let mut without = model();
    without.effects[0].group = None;
    let pointer = Pointer::new(without, SIZES[0]);
    assert!(pointer.places.get("force_mask.group").is_none());
}

#[test]
fn the_reset_of_a_changed_parameter_requests_the_scenes_value() {
    let mut pointer = panel_pointer();
    let requested = pointer.press_widget("stretch.damping.reset");
    assert_eq!(
        requested,
        [Request::Parameter {
            effect: "stretch",
            parameter: "damping",
            value: None,
        }]
    );
    // An unchanged parameter has no reset button.
    assert_eq!(pointer.press_widget("stretch.compliance.reset"), []);
}

#[test]
fn every_button_makes_its_request() {
    let wanted = [
        ("pause", Request::Pause(true)),
        ("step", Request::Step),
        ("step_back", Request::StepBack),
        ("undo", Request::Undo),
        ("restart", Request::Restart),
        ("scene.next", Request::NextScene),
        ("scene.previous", Request::PreviousScene),
        ("squash", Request::Distort(Distortion::Squash)),
        ("shuffle", Request::Distort(Distortion::Shuffle)),
        ("mirror", Request::Distort(Distortion::Mirror)),
        ("reset_shape", Request::Distort(Distortion::RestShape)),
        ("plots", Request::Plots),
        ("pin", Request::Pin(true)),
        ("unpin_all", Request::UnpinAll),
        (
            "use_substeps",
            Request::Setting {
                name: "substeps",
                value: Some(24.0),
            },
        ),
        (
            "world.order.BDF2",
            Request::Setting {
                name: "order",
                value: Some(2.0),
            },
        ),
        ("wireframe", Request::Wireframe(true)),
        ("tetrahedra", Request::Tetrahedra(true)),
        ("contacts", Request::Contacts(true)),
        ("accuracy", Request::Accuracy),
        ("energy.keep", Request::Ledger(false)),
        ("energy.anew", Request::Ledger(true)),
        ("reference_overlay", Request::ReferenceOverlay),
        ("frame", Request::FrameAll),
        ("screenshot", Request::Screenshot),
        ("help", Request::Help),
        (
            "effect.stretch",
            Request::Effect {
                effect: "stretch",
                on: false,
            },
        ),
        (
            "effect.collide",
            Request::Effect {
                effect: "collide",
                on: true,
            },
        ),
    ];
    // Tall enough for all sections, without scrolling.
    let (size, scale) = SIZES[0];
    let mut panel = model();
    panel.settings.push(Parameter {
        choices: &["Euler", "BDF2"],
        ..parameter("order", "", Track::new(1.0..=2.0, Spread::Integer), 1.0)
    });
    let mut pointer = Pointer::new(panel, (size + Vec2::new(0.0, 320.0), scale));
    pointer.unfold("section.world");
    for (name, request) in wanted {
        assert_eq!(pointer.press_widget(name), [request], "{name}");
    }
    // The grabbed body has no pins to remove.
    assert_eq!(pointer.press_widget("unpin"), []);
}

#[test]
fn the_reference_overlay_has_a_section_while_there_is_one() {
    let mut trail = Trail::default();
    (0..50).for_each(|_| {
        trail.push(Distance {
            rms: 1.25e-3,
            largest: 4e-3,
            rms_fraction: 0.0025,
            largest_fraction: 0.008,
        });
    });
    assert!(
        panel_pointer()
            .places
            .get("reference_overlay.plot")
            .is_none()
    );
    let reference_overlay = ReferenceModel {
        trail,
        bodies: (1, 1),
        substeps: Some(80),
        of: 10,
        tick: 1.0 / 60.0,
        holds: true,
        ..ReferenceModel::default()
    };
    let with_reference_overlay = PanelModel {
        reference_overlay: Some(reference_overlay),
        ..model()
    };
    let mut pointer = Pointer::new(with_reference_overlay, SIZES[0]);
    let mut texts = Vec::new();
    collect_texts(&pointer.draw(Vec::new()), &mut texts);
    for words in ["1.25 mm  ·  0.25 %", "4 mm  ·  0.8 %", "peak 4 mm"] {
        assert!(texts.iter().any(|text| text == words), "{texts:?}");
    }
    for words in ["80 substeps of 208 µs", "waiting for the reference"] {
        assert!(texts.iter().any(|text| text.contains(words)), "{texts:?}");
    }
    assert!(pointer.place("reference_overlay.plot").width() > 200.0);
    assert_eq!(
        pointer.press_widget("reference_overlay.again"),
        [Request::ReferenceAgain]
    );
}

#[test]
fn quarantined_bodies_are_named_and_one_button_restores_all_that_are_shown() {
    let mut frozen = model();
    for key in 3..=6 {
        frozen.bodies.push(BodyEntry {
            hidden: false,
            color: [0; 3],
            key,
            name: format!("cube {key}"),
            inverted: 0,
            particles: 8,
            state: BodyState::Quarantined("non-finite state of vertex 3 after stretch".to_owned()),
        });
    }
    let mut pointer = Pointer::new(frozen, SIZES[0]);
    let mut texts = Vec::new();
    collect_texts(&pointer.draw(Vec::new()), &mut texts);
    let said = texts.join("\n");
    assert!(
        said.contains("cube 3 diverged and is paused: non-finite state"),
        "{said}"
    );
    assert!(said.contains("and 2 more"), "{said}");
    let mut requested = pointer.press_widget("thaw");
    // The model does not change, so a press that lasts two frames makes two requests.
    requested.truncate(4);
    let all: Vec<_> = (3..=6).map(Request::Restore).collect();
    assert_eq!(requested, all);
}

#[test]
fn the_pickers_open_and_choose() {
    let mut pointer = panel_pointer();
    assert_eq!(pointer.press_widget("scene"), [Request::Browser]);
    assert_eq!(pointer.press_widget("coloring"), []);
    assert_eq!(
        pointer.press_widget("solver.lanes"),
        [Request::SolverView(SolverView::Lanes)]
    );
    assert_eq!(pointer.press_widget("coloring"), []);
    assert_eq!(
        pointer.press_widget("color.tension"),
        [Request::ColorMode(ColorMode::Tension)]
    );
    // The model shows the constraints.
    assert_eq!(pointer.press_widget("coloring"), []);
    assert_eq!(
        pointer.press_widget("color.off"),
        [
            Request::ColorMode(ColorMode::Off),
            Request::SolverView(SolverView::Off)
        ]
    );
    assert_eq!(pointer.press_widget("scope"), []);
    assert_eq!(
        pointer.press_widget("scope.ball"),
        [Request::Show(Scope::key(2))]
    );
    assert_eq!(pointer.press_widget("spawn"), []);
    assert_eq!(
        pointer.press_widget("spawn.box"),
        [Request::SpawnBody("box".to_owned())]
    );
    assert_eq!(
        pointer.press_widget("spawn.add"),
        [Request::Spawn(SpawnPlace::Above)]
    );
    assert_eq!(
        pointer.press_widget("spawn.click"),
        [Request::SpawnOnClick(true)]
    );
    assert_eq!(pointer.press_widget("spawn.rain"), [Request::Rain(true)]);
    let chosen = HandsChange::Shot(Shot::Chosen);
    assert_eq!(
        pointer.press_widget("shot.chosen"),
        [Request::Hands(chosen)]
    );
    assert_eq!(
        pointer.press_widget("collider.box"),
        [Request::AddCollider(ColliderKind::Box)]
    );
}

#[test]
fn radius_and_stiffness_of_the_grab_are_set_in_the_panel() {
    let mut pointer = panel_pointer();
    let mut requested = pointer.press_widget("hands.radius");
    requested.dedup();
    let [Request::Hands(HandsChange::Radius(radius))] = requested[..] else {
        panic!("{requested:?}");
    };
    // The middle of a slider from 0 to 2 m, to the pixel.
    assert!((radius - 1.0).abs() < 0.05, "{radius}");
    let rail = pointer.place("hands.stiffness");
    pointer.requests.clear();
    pointer.press(pos2(rail.left() + 0.75 * rail.width(), rail.center().y));
    pointer.requests.dedup();
    let [Request::Hands(HandsChange::Stiffness(stiffness))] = pointer.requests[..] else {
        panic!("{:?}", pointer.requests);
    };
    // Three quarters of the four decades from 0.01 to 100 are 10. The rail ends a handle radius inside
    // the widget, so that three quarters of the widget are more, but less than half a decade.
    assert!((10.0..30.0).contains(&stiffness), "{stiffness}");
}

#[test]
fn nothing_in_the_panel_overlaps_and_nothing_sticks_out() {
    for size in SIZES {
        let pointer = Pointer::new(model(), size);
        let covered = show_width(&pointer);
        let panel = Rect::from_min_max(pos2(size.0.x - covered, 0.0), size.0.to_pos2());
        let places: Vec<_> = pointer.places.iter().collect();
        assert!(places.len() > 20, "{size:?}: {}", places.len());
        for (index, (name, rect)) in places.iter().enumerate() {
            assert!(panel.contains_rect(*rect), "{name} {rect:?} in {panel:?}");
            for (other, other_rect) in &places[index + 1..] {
                // Neighbors may touch; half a pixel is rounding.
                let common = rect.shrink(0.5).intersect(*other_rect);
                assert!(!common.is_positive(), "{name} and {other} at {size:?}");
            }
        }
    }
}

fn show_width(pointer: &Pointer) -> f32 {
    let mut width = 0.0;
    let input = RawInput {
        screen_rect: Some(Rect::from_min_size(Pos2::ZERO, pointer.size)),
        ..RawInput::default()
    };
    let output = pointer
        .context
        .run_ui(input, |ui| width = show(ui.ctx(), &pointer.model).1);
    output.drop_without_applying_deltas();
    width
}

#[test]
fn a_slider_is_wide_enough_for_the_pointer_in_the_smallest_window() {
    let pointer = Pointer::new(model(), (vec2(900.0, 600.0), 1.0));
    // Eight decades in fewer than 60 px would be too fine to aim at.
    assert!(pointer.place("stretch.compliance").width() >= 60.0);
}

#[test]
fn every_letter_that_the_panel_shows_is_in_the_font() {
    let mut pointer = panel_pointer();
    let shapes = pointer.draw(Vec::new());
    let mut texts = Vec::new();
    collect_texts(&shapes, &mut texts);
    assert!(texts.iter().any(|text| text.contains("m/N")), "{texts:?}");
    let font = bevy_egui::egui::FontId::proportional(13.0);
    for text in texts {
        assert!(
            pointer
                .context
                .fonts_mut(|fonts| fonts.has_glyphs(&font, &text)),
            "{text:?}"
        );
    }
}

#[test]
fn every_letter_of_the_help_is_in_the_font() {
    let pointer = panel_pointer();
    let font = bevy_egui::egui::FontId::proportional(13.0);
    let keys = BINDINGS
        .iter()
        .flat_map(|binding| [binding.cap, binding.text]);
    let gestures = GESTURES
        .iter()
        .flat_map(|(gesture, text)| [*gesture, *text]);
    for text in keys.chain(gestures) {
        assert!(
            pointer
                .context
                .fonts_mut(|fonts| fonts.has_glyphs(&font, text)),
            "{text:?}"
        );
    }
}

fn collect_texts(shapes: &[Shape], texts: &mut Vec<String>) {
    for shape in shapes {
        match shape {
            Shape::Text(text) => texts.push(text.galley.text().to_owned()),
            Shape::Vec(shapes) => collect_texts(shapes, texts),
            _ => {}
        }
    }
}

#[test]
fn a_scene_without_bodies_can_be_shown_and_makes_no_request() {
    let empty = PanelModel {
        bodies: Vec::new(),
        effects: vec![absent()],
        grabbed: None,
        is_pinned: false,
        ..model()
    };
    let mut pointer = Pointer::new(empty, SIZES[0]);
    for name in [
        "squash",
        "shuffle",
        "mirror",
        "pin",
        "unpin",
        "unpin_all",
        "effect.collide",
    ] {
        assert_eq!(pointer.press_widget(name), [], "{name}");
    }
}

#[test]
fn a_search_of_the_panel_shows_only_what_matches_and_says_when_nothing_does() {
    let searched = |text: &str| {
        let search = PanelSearch {
            text: text.to_owned(),
            open: true,
            focus: false,
        };
        Pointer::new(PanelModel { search, ..model() }, SIZES[0])
    };
    let has = |pointer: &Pointer, name: &str| pointer.places.get(name).is_some();
    let pointer = searched("gravity");
    assert!(has(&pointer, "world.gravity_y.entry"));
    assert!(!has(&pointer, "world.iterations.entry") && !has(&pointer, "effect.stretch"));
    let pointer = searched("STRETCH");
    assert!(has(&pointer, "effect.stretch") && !has(&pointer, "world.gravity_y.entry"));
    let pointer = searched("theme");
    assert!(has(&pointer, "settings.dark") && !has(&pointer, "settings.low"));
    let pointer = searched("grab radius");
    assert!(has(&pointer, "hands.radius") && !has(&pointer, "effect.stretch"));
    let pointer = searched("duplicate");
    assert!(has(&pointer, "edit") && !has(&pointer, "effect.stretch"));
    let mut pointer = searched("zzz");
    assert!(!has(&pointer, "effect.stretch") && !has(&pointer, "squash"));
    let cleared = pointer.press_widget("search.clear");
    assert_eq!(cleared, [Request::CloseSearch]);
}

#[test]
fn typing_into_the_search_asks_for_it_and_the_key_puts_the_cursor_there() {
    let mut pointer = panel_pointer();
    assert_eq!(pointer.press_widget("search.open"), [Request::FocusSearch]);
    (pointer.model.search.open, pointer.model.search.focus) = (true, true);
    pointer.draw(Vec::new());
    pointer.model.search.focus = false;
    pointer.requests.clear();
    pointer.draw(vec![Event::Text("damp".to_owned())]);
    assert_eq!(pointer.requests, [Request::Search("damp".to_owned())]);
}

#[test]
fn the_selection_is_edited_by_buttons_and_menus() {
    let mut pointer = panel_pointer();
    assert_eq!(pointer.press_widget("edit"), []);
    assert_eq!(pointer.press_widget("duplicate"), [Request::Duplicate]);
    assert_eq!(pointer.press_widget("hide"), [Request::Hide(true)]);
    let color = pointer.press_widget("edit.color.1");
    assert_eq!(color, [Request::Color([0, 158, 142])]);
    let copied = pointer.press_widget("edit.copy");
    assert_eq!(copied, [Request::CopyParameters]);
}

#[test]
fn presets_of_the_user_are_below_the_materials_and_can_be_deleted() {
    let mut pointer = panel_pointer();
    assert_eq!(pointer.press_widget("material"), []);
    assert_eq!(
        pointer.press_widget("preset.My jelly.delete"),
        [Request::DeletePreset("My jelly".to_owned())]
    );
    assert_eq!(
        pointer.press_widget("preset.My jelly"),
        [Request::Preset("My jelly".to_owned())]
    );
}
