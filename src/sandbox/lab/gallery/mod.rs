//! The stress tests in the window: runs a case with one click, on its own family of bodies or on
//! the body on screen, and shows its figures.
//!
//! A case is run by [`torture`](crate::torture) on a separate thread, as `pliant torture` runs it.
//! On the body on screen, the case runs on a copy, alone, without gravity and ground. If the case
//! begins with a deformation, the body on screen is deformed in the same way to show its recovery.

mod card;
mod run;
mod verdict;

pub use card::{Card, Line, show};
pub use run::{News, Subject, run_case, save, start_advice};
pub use verdict::Verdict;

use crate::{
    output::free_path,
    sandbox::{
        lab::worker::Worker,
        state::{selection::Selection, view::ViewSettings},
        ui::{WidgetRects, area, message::Notices},
    },
    simulation::{Action, Actions, SimulationSettings, plain},
    solver::{Body, Settings},
    torture::{CASES, Case, Member},
};
use bevy::prelude::*;
use bevy_egui::{EguiContext, EguiPrimaryContextPass, PrimaryEguiContext};
use std::collections::BTreeMap;

/// Commands of the gallery.
#[derive(Message, Debug, Clone, Copy, PartialEq, Eq)]
pub enum GalleryCommand {
    /// Open or close the card.
    Toggle,
    /// Run a case, by its index in the table.
    Run(usize, On),
    /// Run every case on its own bodies, one after the other.
    RunAll,
    /// Stop the running case; existing results are kept.
    Stop,
    /// Show the figures and pictures of a case, by its index in the table.
    Look(usize),
    /// Find settings with which a case passes, by its index in the table.
    Advise(usize, On),
    /// Record the last run of a case on a body on screen, in a new file.
    Save(usize),
}

/// The subject of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum On {
    /// The body on screen.
    This,
    /// The case's own family.
    Own,
}

/// State of the gallery.
#[derive(Resource, Debug, Default)]
pub struct Gallery {
    open: bool,
    /// The running case, and its completed fraction from 0 to 1.
    running: Option<(usize, On, Worker<News>, f32)>,
    /// Cases that are run next.
    waiting: Vec<usize>,
    verdicts: BTreeMap<(usize, On), Verdict>,
    /// The bodies on which cases were last run, in their state before the run.
    subjects: BTreeMap<usize, (Body, Settings)>,
    /// The verdict that is shown in detail.
    looked_at: Option<(usize, On)>,
    /// Reason why a case could not be run.
    trouble: Option<String>,
}

impl Gallery {
    /// Whether its card is open.
    #[must_use]
    pub const fn is_open(&self) -> bool {
        self.open
    }

    /// Whether a case runs.
    #[must_use]
    pub const fn is_running(&self) -> bool {
        self.running.is_some()
    }
}

/// Rectangles of the card's widgets, for the journal.
#[derive(Resource, Debug, Default, Deref)]
pub struct GalleryRects(pub WidgetRects);

/// Shows the gallery.
pub struct GalleryPlugin;

impl Plugin for GalleryPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Gallery>()
            .init_resource::<GalleryRects>()
            .add_message::<GalleryCommand>()
            .add_systems(Update, (carry_out, listen).chain())
            .add_systems(EguiPrimaryContextPass, card);
    }
}

fn carry_out(world: &mut World) {
    let commands: Vec<_> = world
        .resource_mut::<Messages<GalleryCommand>>()
        .drain()
        .collect();
    for command in commands {
        let mut gallery = world.resource_mut::<Gallery>();
        match command {
            GalleryCommand::Toggle => gallery.open = !gallery.open,
            GalleryCommand::Run(case, on) => {
                gallery.waiting.clear();
                start(world, case, on);
            }
            GalleryCommand::RunAll => {
                gallery.waiting = (1..CASES.len()).rev().collect();
                start(world, 0, On::Own);
            }
            GalleryCommand::Advise(case, on) => {
                gallery.waiting.clear();
                advise(world, case, on);
            }
            GalleryCommand::Stop => {
                gallery.waiting.clear();
                gallery.running = None;
            }
            GalleryCommand::Save(number) => {
                let subject = gallery.subjects.get(&number).cloned();
                if let (Some((body, settings)), Some(case)) = (subject, CASES.get(number)) {
                    let name = format!("{}-{}", case.name, body.name);
                    let path = free_path(&name, "rec", |path| path.exists());
                    let done = save(case, body, settings, &path);
                    let mut notices = world.resource_mut::<Notices>();
                    let path = path.display();
                    match done {
                        Ok(()) => notices.info(format!(
                            "Saved {path}. Replay it with `pliant replay {path}`"
                        )),
                        Err(reason) => notices.error(format!("Cannot save {path}: {reason}")),
                    }
                }
            }
            GalleryCommand::Look(case) => {
                let seen = gallery.looked_at.map(|(case, _)| case);
                let known = [On::This, On::Own].map(|on| (case, on));
                let known = known
                    .into_iter()
                    .find(|key| gallery.verdicts.contains_key(key));
                gallery.looked_at = known.filter(|_| seen != Some(case));
            }
        }
    }
}

/// Starts to run a case on a thread.
fn start(world: &mut World, number: usize, on: On) {
    let Some(case) = CASES.get(number) else {
        return;
    };
    let subject = match on {
        On::Own => Subject::Own,
        On::This => {
            let Some(entity) = subject(world) else {
                world.resource_mut::<Gallery>().trouble =
                    Some("No body to test: add one to the scene first.".to_owned());
                return;
            };
            let settings = **world.resource::<SimulationSettings>();
            let Some(body) = plain::body(world.entity(entity)) else {
                return;
            };
            if let Some(deformation) = case.deformation(&Member::given(&body, settings)) {
                let action = Action::Deform {
                    body: entity,
                    deformation,
                };
                world.resource_mut::<Actions>().push(action);
            }
            let subjects = &mut world.resource_mut::<Gallery>().subjects;
            subjects.insert(number, (body.clone(), settings));
            Subject::This(Box::new(body), settings)
        }
    };
    let begun = run_case(case, subject);
    let mut gallery = world.resource_mut::<Gallery>();
    gallery.trouble = None;
    match begun {
        Ok(worker) => gallery.running = Some((number, on, worker, 0.0)),
        Err(error) => gallery.trouble = Some(format!("Cannot start the test thread: {error}")),
    }
}

/// Starts to find settings with which a failed case passes.
fn advise(world: &mut World, number: usize, on: On) {
    let mut gallery = world.resource_mut::<Gallery>();
    let (Some(case), Some(verdict)) = (CASES.get(number), gallery.verdicts.get(&(number, on)))
    else {
        return;
    };
    let member = verdict.member.clone();
    let subject = match (on, gallery.subjects.get(&number)) {
        (On::Own, _) => Subject::Own,
        (On::This, Some((body, settings))) => Subject::This(Box::new(body.clone()), *settings),
        (On::This, None) => return,
    };
    match start_advice(case, subject, member) {
        Ok(worker) => gallery.running = Some((number, on, worker, 0.0)),
        Err(error) => gallery.trouble = Some(format!("Cannot start the test thread: {error}")),
    }
}

/// The body that is selected in the panel, or else the first one.
fn subject(world: &mut World) -> Option<Entity> {
    let scope = world.resource::<Selection>().0.clone();
    let bodies = plain::bodies_in_order(world);
    bodies.into_iter().find(|body| scope.contains(*body))
}

/// Receives messages of the thread, and starts the next waiting case.
fn listen(world: &mut World) {
    let mut gallery = world.resource_mut::<Gallery>();
    let Some((case, on, worker, progress)) = &mut gallery.running else {
        return;
    };
    let (case, on) = (*case, *on);
    let mut last = None;
    for news in worker.news() {
        match news {
            News::Progress(done) => *progress = done,
            news => last = Some(news),
        }
    }
    let Some(last) = last else {
        return;
    };
    gallery.running = None;
    match last {
        News::Ended(Ok(verdict)) => {
            gallery.verdicts.insert((case, on), verdict);
            gallery.looked_at = Some((case, on));
        }
        News::Advised(Ok(words)) => {
            if let Some(verdict) = gallery.verdicts.get_mut(&(case, on)) {
                verdict.advice = Some(words);
            }
        }
        News::Ended(Err(reason)) | News::Advised(Err(reason)) => gallery.trouble = Some(reason),
        News::Progress(_) => {}
    }
    if let Some(next) = gallery.waiting.pop() {
        start(world, next, On::Own);
    }
}

/// Stores the widget rectangles if they have changed.
fn note(world: &mut World, places: WidgetRects) {
    let mut known = world.resource_mut::<GalleryRects>();
    if known.0 != places {
        known.0 = places;
    }
}

fn card(world: &mut World) -> Result {
    if !world.resource::<Gallery>().open {
        note(world, WidgetRects::default());
        return Ok(());
    }
    let this = subject(world).map(|body| {
        let name = world.get::<Name>(body);
        name.map_or_else(|| body.to_string(), |name| name.to_string())
    });
    let gallery = world.resource::<Gallery>();
    let line = |(number, case): (usize, &'static Case)| Line {
        title: case.title,
        about: case.about,
        any_body: case.any_body,
        verdicts: [On::This, On::Own].map(|on| {
            let verdict = gallery.verdicts.get(&(number, on))?;
            Some((verdict.passed(), verdict.expected.is_some()))
        }),
        running: gallery
            .running
            .as_ref()
            .filter(|(running, ..)| *running == number)
            .map(|(.., progress)| *progress),
    };
    let model = Card {
        this,
        lines: CASES.iter().enumerate().map(line).collect(),
        shown: gallery.looked_at.and_then(|(case, on)| {
            let verdict = gallery.verdicts.get(&(case, on))?;
            Some((case, on, verdict.clone()))
        }),
        trouble: gallery.trouble.clone(),
    };
    let context = world
        .query_filtered::<&mut EguiContext, With<PrimaryEguiContext>>()
        .single_mut(world)?
        .get_mut()
        .clone();
    let free = area::free(&context, world.resource::<ViewSettings>());
    let answer = show(&context, &model, free);
    note(world, answer.places);
    for command in answer.commands {
        world.write_message(command);
    }
    Ok(())
}
