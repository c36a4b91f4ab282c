//! Cost and benefit of each effect: a card with what every effect of the scene on screen costs, and
//! what one would see without it.
//!
//! A background thread runs copies of the current state with and without each effect, see
//! [`ablation`], while the scene keeps running. A button removes an effect.

mod card;

pub use card::{Answer, Card, show};

use crate::{
    ablation::{self, Ablation, Options},
    recording::{About, Snapshot},
    sandbox::{
        lab::worker::Worker,
        state::{request::Requested, view::ViewSettings},
        ui::{WidgetRects, area},
    },
    scene::{BuiltScene, CurrentScene},
    solver::Threads,
};
use bevy::prelude::*;
use bevy_egui::{EguiContext, EguiPrimaryContextPass, PrimaryEguiContext};
use std::ops::ControlFlow;

/// Simulated time of each run [s].
const SECONDS: f64 = 1.0;

/// A command to the card.
#[derive(Message, Debug, Clone, Copy, PartialEq, Eq)]
pub enum AblationCommand {
    /// Opens the card, and measures if nothing has been measured; or closes it.
    Toggle,
    /// Measures the current state.
    Measure,
    /// Stops measuring.
    Stop,
}

/// Messages of the thread.
#[derive(Debug)]
enum News {
    /// Completed fraction, from 0 to 1.
    Progress(f32),
    /// The result.
    Measured(Ablation),
    /// Reason why nothing could be measured.
    Failed(String),
}

/// State of the card.
#[derive(Resource, Debug, Default)]
pub struct AblationState {
    open: bool,
    worker: Option<Worker<News>>,
    progress: f32,
    measured: Option<Ablation>,
    failure: Option<String>,
}

impl AblationState {
    /// Whether its card is open.
    #[must_use]
    pub const fn is_open(&self) -> bool {
        self.open
    }

    /// Whether it measures.
    #[must_use]
    pub const fn is_running(&self) -> bool {
        self.worker.is_some()
    }
}

/// Widget rectangles of the card, for the journal.
#[derive(Resource, Debug, Default, Deref)]
pub struct AblationRects(pub WidgetRects);

/// Shows the card.
pub struct AblationPlugin;

impl Plugin for AblationPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<AblationState>()
            .init_resource::<AblationRects>()
            .add_message::<AblationCommand>()
            .add_systems(Update, (forget, carry_out, listen).chain())
            .add_systems(EguiPrimaryContextPass, card);
    }
}

/// Discards the measurements when the scene changes.
fn forget(scene: Option<Res<CurrentScene>>, mut state: ResMut<AblationState>) {
    if scene.is_some_and(|scene| scene.is_changed()) {
        *state = AblationState {
            open: state.open,
            ..default()
        };
    }
}

fn carry_out(world: &mut World) {
    let commands: Vec<_> = world
        .resource_mut::<Messages<AblationCommand>>()
        .drain()
        .collect();
    for command in commands {
        let mut state = world.resource_mut::<AblationState>();
        match command {
            AblationCommand::Toggle => {
                state.open = !state.open;
                if state.open && state.measured.is_none() && state.worker.is_none() {
                    start(world);
                }
            }
            AblationCommand::Measure => start(world),
            AblationCommand::Stop => state.worker = None,
        }
    }
}

/// Starts a thread with a copy of the current state.
fn start(world: &mut World) {
    let scene = world.get_resource::<CurrentScene>();
    let about = scene.map(About::from).unwrap_or_default();
    let started = Snapshot::take(world, about)
        .map_err(|error| error.to_string())
        .and_then(|snapshot| {
            let work = move |reporter: &_| measure(&snapshot.built, reporter);
            Worker::start("cost of effects", work)
                .map_err(|error| format!("Cannot start the measurement thread: {error}"))
        });
    let mut state = world.resource_mut::<AblationState>();
    state.progress = 0.0;
    state.failure = None;
    match started {
        Ok(worker) => state.worker = Some(worker),
        Err(reason) => state.failure = Some(reason),
    }
}

fn measure(built: &BuiltScene, reporter: &crate::sandbox::lab::worker::Reporter<News>) {
    let options = Options {
        seconds: SECONDS,
        // The scene on screen keeps running on its own threads.
        threads: Some(Threads::default()),
        ..default()
    };
    let measured = ablation::run(built, &options, |fraction| {
        match reporter.tell(News::Progress(fraction as f32)) {
            true => ControlFlow::Continue(()),
            false => ControlFlow::Break(()),
        }
    });
    // A stopped thread reports nothing.
    let _ = match measured {
        Ok(Some(ablation)) => reporter.tell(News::Measured(ablation)),
        Ok(None) => false,
        Err(error) => reporter.tell(News::Failed(error.to_string())),
    };
}

/// Receives the messages of the thread.
fn listen(mut state: ResMut<AblationState>) {
    let Some(worker) = &state.worker else {
        return;
    };
    for news in worker.news() {
        match news {
            News::Progress(fraction) => state.progress = fraction,
            News::Measured(ablation) => {
                state.measured = Some(ablation);
                state.worker = None;
            }
            News::Failed(reason) => {
                state.failure = Some(reason);
                state.worker = None;
            }
        }
    }
}

fn card(world: &mut World) -> Result {
    let state = world.resource::<AblationState>();
    let mut places = WidgetRects::default();
    if state.open {
        let model = Card {
            measured: state.measured.clone(),
            progress: state.is_running().then_some(state.progress),
            failure: state.failure.clone(),
        };
        let context = world
            .query_filtered::<&mut EguiContext, With<PrimaryEguiContext>>()
            .single_mut(world)?
            .get_mut()
            .clone();
        let free = area::free(&context, world.resource::<ViewSettings>());
        let answer = show(&context, &model, free);
        places = answer.places;
        for command in answer.commands {
            world.write_message(command);
        }
        for request in answer.requests {
            world.write_message(Requested(request));
        }
    }
    let mut known = world.resource_mut::<AblationRects>();
    if known.0 != places {
        known.0 = places;
    }
    Ok(())
}
