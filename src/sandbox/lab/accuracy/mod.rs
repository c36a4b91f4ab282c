//! Accuracy vs. cost of the scene on screen: a card with a diagram that fills while the scene keeps
//! running.
//!
//! A background thread ([`measure`]) runs a copy of the current world for half a second at several
//! settings, and as an f64 reference with small steps. Each setting is a dot: the time of a tick,
//! and the distance to the reference. A click on a dot applies its setting to the scene.
//! Alternatively, for a goal in milliseconds or per cent, the thread searches for the setting that
//! meets it best.

mod card;
mod chart;
mod measure;

pub use card::{Card, show};
pub use chart::{Dot, Marker};
pub use measure::{News, Task, measure};

use crate::{
    sandbox::{
        lab::worker::Worker,
        state::{
            request::{Request, Requested},
            view::ViewSettings,
        },
        ui::{WidgetRects, area, format, message::Notices},
    },
    scene::CurrentScene,
    simulation::{SimulationSettings, plain},
    solver::{
        Threads,
        modes::{Modes, half_life},
    },
    study::{Choice, Goal, Setting},
};
use bevy::prelude::*;
use bevy_egui::{EguiContext, EguiPrimaryContextPass, PrimaryEguiContext};

/// A command to the card, from its own widgets or from a key.
#[derive(Message, Debug, Clone, Copy, PartialEq)]
pub enum AccuracyCommand {
    /// Opens the card, and measures if nothing has been measured; or closes it.
    Toggle,
    /// Measures the current scene.
    Measure,
    /// Stops measuring, and keeps the results so far.
    Stop,
    /// Finds a setting that meets a goal, and applies it.
    Reach(Goal),
    /// Sets the goals of the two buttons.
    Goals(Goals),
}

/// The goals in the card's two fields.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goals {
    /// Maximum time of a tick [ms]; default 1.
    pub milliseconds: f64,
    /// Maximum error [%]; default 1.
    pub percent: f64,
}

impl Default for Goals {
    fn default() -> Self {
        Self {
            milliseconds: 1.0,
            percent: 1.0,
        }
    }
}

/// State of the card, and measurements of the scene on screen.
#[derive(Resource, Debug, Default)]
pub struct Accuracy {
    open: bool,
    goals: Goals,
    worker: Option<Worker<News>>,
    /// Whether the worker searches for a goal, and will change the settings.
    searches: bool,
    /// Completed fraction of the measurement, from 0 to 1.
    progress: f32,
    dots: Vec<Dot>,
    /// Relative uncertainty of the reference.
    uncertainty: f64,
    modes: Option<Modes>,
    /// Result of the last search or the last error, and whether it is a failure.
    said: Option<(String, bool)>,
}

impl Accuracy {
    /// Whether its card is open.
    #[must_use]
    pub const fn is_open(&self) -> bool {
        self.open
    }

    /// Whether it measures.
    #[must_use]
    pub const fn is_measuring(&self) -> bool {
        self.worker.is_some()
    }
}

/// Widget rectangles of the card, for the journal.
#[derive(Resource, Debug, Default, Deref)]
pub struct CardRects(pub WidgetRects);

/// Shows the card.
pub struct AccuracyPlugin;

impl Plugin for AccuracyPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Accuracy>()
            .init_resource::<CardRects>()
            .init_resource::<Notices>()
            .add_message::<AccuracyCommand>()
            .add_systems(Update, (forget, carry_out, listen).chain())
            .add_systems(EguiPrimaryContextPass, card);
    }
}

/// Discards the measurements when the scene changes.
fn forget(scene: Option<Res<CurrentScene>>, mut accuracy: ResMut<Accuracy>) {
    if scene.is_some_and(|scene| scene.is_changed()) {
        *accuracy = Accuracy {
            open: accuracy.open,
            goals: accuracy.goals,
            ..default()
        };
    }
}

fn carry_out(world: &mut World) {
    let commands: Vec<_> = world
        .resource_mut::<Messages<AccuracyCommand>>()
        .drain()
        .collect();
    for command in commands {
        let mut accuracy = world.resource_mut::<Accuracy>();
        match command {
            AccuracyCommand::Toggle => {
                accuracy.open = !accuracy.open;
                // Nothing changes the settings once the card that announces it is closed.
                if !accuracy.open && accuracy.searches && accuracy.worker.take().is_some() {
                    accuracy.said = None;
                    let text = "Accuracy vs. cost: search stopped, settings unchanged";
                    world.resource_mut::<Notices>().info(text);
                    continue;
                }
                let begin = accuracy.open && accuracy.dots.is_empty() && accuracy.worker.is_none();
                if begin {
                    start(world, Task::Survey);
                }
            }
            AccuracyCommand::Measure => start(world, Task::Survey),
            AccuracyCommand::Stop => accuracy.worker = None,
            AccuracyCommand::Reach(goal) => start(world, Task::Reach(goal)),
            AccuracyCommand::Goals(goals) => accuracy.goals = goals,
        }
    }
}

/// Starts a thread with a copy of the world.
fn start(world: &mut World, task: Task) {
    let mut copy = plain::capture(world);
    // The scene on screen keeps running on its own threads.
    copy.threads = Threads::default();
    let searches = matches!(task, Task::Reach(_));
    let begun = measure(copy, task);
    let mut accuracy = world.resource_mut::<Accuracy>();
    accuracy.searches = searches;
    accuracy.said = None;
    accuracy.progress = 0.0;
    match begun {
        Ok(worker) => {
            accuracy.worker = Some(worker);
            // The previous measurements started from another state.
            accuracy.dots.clear();
        }
        Err(error) => {
            accuracy.said = Some((
                format!("Cannot start the measurement thread: {error}"),
                true,
            ))
        }
    }
}

/// Receives the messages of the thread.
fn listen(
    mut accuracy: ResMut<Accuracy>,
    settings: Res<SimulationSettings>,
    mut requests: MessageWriter<Requested>,
    mut notices: ResMut<Notices>,
) {
    let Some(worker) = &accuracy.worker else {
        return;
    };
    for news in worker.news() {
        match news {
            News::Progress(fraction) => accuracy.progress = fraction,
            News::Modes(modes) => accuracy.modes = Some(modes),
            News::Point(point) => {
                let dot = Dot::new(&point, settings.rate.get());
                accuracy.uncertainty = point.uncertainty;
                let place = accuracy
                    .dots
                    .iter()
                    .position(|other| other.setting == dot.setting);
                match place {
                    Some(place) => accuracy.dots[place] = dot,
                    None => accuracy.dots.push(dot),
                }
            }
            News::Chosen(choice) => {
                if let Some(choice) = &choice {
                    for (name, value) in [
                        ("substeps", choice.setting.substeps),
                        ("iterations", choice.setting.iterations),
                    ] {
                        requests.write(Requested(Request::Setting {
                            name,
                            value: Some(f64::from(value)),
                        }));
                    }
                }
                if let Some(choice) = &choice {
                    let Setting {
                        substeps,
                        iterations,
                        ..
                    } = choice.setting;
                    notices.info(format!(
                        "Accuracy vs. cost: set substeps to {substeps} and iterations to {iterations}"
                    ));
                }
                let words = choice.map_or_else(|| (NOTHING.to_owned(), true), |it| words(&it));
                accuracy.said = Some(words);
            }
            News::Ended => {
                accuracy.worker = None;
                return;
            }
            News::Failed(reason) => accuracy.said = Some((reason, true)),
        }
    }
}

const NOTHING: &str = "No setting meets the goal: the body diverged at all of them.";

/// A choice as text, and whether the goal was missed.
fn words(choice: &Choice) -> (String, bool) {
    let Choice {
        setting,
        error,
        met,
        ..
    } = choice;
    let verdict = if *met {
        "Selected"
    } else {
        "Goal not reachable; closest setting"
    };
    let text = format!(
        "{verdict}: {} × {}, error {} %. {}",
        setting.substeps,
        setting.iterations,
        format(error * 100.0, 2),
        choice.reason
    );
    (text, !met)
}

/// Stores the widget rectangles if they have changed.
fn note(world: &mut World, places: WidgetRects) {
    let mut known = world.resource_mut::<CardRects>();
    if known.0 != places {
        known.0 = places;
    }
}

fn card(world: &mut World) -> Result {
    let accuracy = world.resource::<Accuracy>();
    if !accuracy.open {
        note(world, WidgetRects::default());
        return Ok(());
    }
    let settings = world.resource::<SimulationSettings>();
    let model = Card {
        dots: accuracy.dots.clone(),
        here: (settings.substeps.get(), settings.iterations.get()),
        progress: accuracy.worker.is_some().then_some(accuracy.progress),
        said: accuracy.said.clone(),
        uncertainty: accuracy.uncertainty,
        goals: accuracy.goals,
        half_lives: accuracy.modes.map(|modes| {
            let of = |omega| half_life(omega, settings.substep_seconds());
            (of(modes.stiffest), modes.softest.map(of))
        }),
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
    if let Some((substeps, iterations)) = answer.pressed {
        for (name, value) in [("substeps", substeps), ("iterations", iterations)] {
            let value = Some(f64::from(value));
            world.write_message(Requested(Request::Setting { name, value }));
        }
    }
    Ok(())
}
