//! The window: a studio to look at soft bodies, a hand to pull them, and a panel to turn what
//! they are made of.
//!
//! Two halves that share [`view`]: the picture and the hand ([`stage`], [`camera`], [`bodies`],
//! [`pointer`], [`drag`], …), and the words (panel, head-up line, keys, messages). Neither
//! touches the simulation but through [`Actions`](crate::simulation::Actions), its clock and
//! its settings.

pub mod accuracy;
pub mod answer;
pub mod arrival;
pub mod bodies;
pub mod camera;
pub mod colliders;
pub mod display;
pub mod drag;
pub mod drop;
pub mod frozen;
pub mod gallery;
pub mod ghost;
pub mod grounding;
pub mod help;
pub mod hud;
pub mod journal;
pub mod keys;
pub mod load;
pub mod material;
pub mod message;
pub mod orbit;
pub mod overlay;
pub mod panel;
pub mod pick;
pub mod picture;
pub mod pointer;
pub mod record;
pub mod resolution;
pub mod screenshot;
pub mod settings;
pub mod solver_view;
pub mod stage;
pub mod theme;
pub mod throughput;
pub mod view;
pub mod wires;

use crate::{
    SoftBodyPlugins,
    scene::registry::SCENES,
    simulation::{SimulationClock, SolverThreads},
    solver::Threads,
};
use bevy::{
    app::{AppExit, PluginGroupBuilder},
    prelude::*,
    render::renderer::RenderAdapterInfo,
    window::PresentMode,
};
use bevy_egui::EguiPlugin;
use display::NoDisplay;
use std::{
    panic::{self, AssertUnwindSafe},
    path::PathBuf,
    sync::{Arc, Mutex},
    time::Duration,
};

/// Real time that ticks may take of a frame before they are spread over several: with it a
/// frame stays under a thirtieth of a second whatever the physics costs.
const TICK_BUDGET: Duration = Duration::from_millis(16);

/// What the window opens with.
#[derive(Debug, Clone, Default)]
pub struct SandboxOptions {
    /// Name or path of the scene; the one of the last run, or the first there is, if none.
    pub scene: Option<String>,
    /// File for a line of JSON per event, for scripted tests of the real window.
    pub journal: Option<PathBuf>,
    /// File for a recording of what is done to the simulation.
    pub record: Option<PathBuf>,
    /// Neither read nor write what is kept between runs.
    pub no_settings: bool,
    /// Size of the window [px]; the one of the last run if none.
    pub size: Option<UVec2>,
    /// Threads to step bodies on; one on each core if none.
    pub threads: Option<Threads>,
}

/// Opens the window, and returns when it is closed.
///
/// # Errors
/// [`NoDisplay`] if no window can be opened here; nothing has been opened then.
pub fn run(options: &SandboxOptions) -> Result<AppExit, NoDisplay> {
    let reached = display::check()?;
    let mut app = quietly(|| build(options)).map_err(NoDisplay::Refused)?;
    drop(reached);
    Ok(app.run())
}

/// The sandbox as an app that is ready to run.
fn build(options: &SandboxOptions) -> App {
    let mut app = App::new();
    if !options.no_settings {
        app.add_plugins(settings::KeptSettingsPlugin);
    }
    let kept = app.world().get_resource::<settings::KeptSettings>();
    let size = options
        .size
        .or_else(|| kept?.size())
        .unwrap_or(UVec2::new(1280, 800));
    let first = options
        .scene
        .clone()
        .or_else(|| kept?.scene().map(str::to_owned));
    let window = Window {
        title: "Pliant".to_owned(),
        name: Some("pliant".to_owned()),
        resolution: (size.x, size.y).into(),
        present_mode: PresentMode::AutoVsync,
        ..default()
    };
    app.add_plugins(DefaultPlugins.set(WindowPlugin {
        primary_window: Some(window),
        ..default()
    }))
    .add_plugins(EguiPlugin::default())
    .insert_resource(
        options
            .threads
            .clone()
            .map_or_else(SolverThreads::default, SolverThreads),
    )
    // After everything that a hand can do in a frame, and before it is drawn: what the
    // pointer does is seen in the same frame. Not in a fixed schedule: the clock makes its
    // own ticks, and needs the real time of every frame to draw between them.
    .add_plugins(SoftBodyPlugins::new(PostUpdate))
    .add_plugins(SandboxPlugins)
    .add_plugins(load::LoadPlugin {
        first: first.unwrap_or_else(|| SCENES[0].name.to_owned()),
    })
    .add_systems(Startup, (spawn_camera, bound_ticks));
    if let Some(path) = options.journal.clone() {
        app.add_plugins(journal::JournalPlugin { path });
    }
    if let Some(path) = options.record.clone() {
        app.add_plugins(record::RecordPlugin { path });
    }
    app
}

/// Everything in the window but the simulation.
pub struct SandboxPlugins;

impl PluginGroup for SandboxPlugins {
    fn build(self) -> PluginGroupBuilder {
        PluginGroupBuilder::start::<Self>()
            .add(view::ViewPlugin)
            .add(stage::StagePlugin)
            .add(pointer::PointerPlugin)
            .add(drag::DragPlugin)
            .add(camera::CameraPlugin)
            .add(bodies::BodiesPlugin)
            .add(colliders::CollidersPlugin)
            .add(wires::WiresPlugin)
            .add(solver_view::SolverViewPlugin)
            .add(overlay::OverlayPlugin)
            .add(answer::AnswerPlugin)
            .add(screenshot::ScreenshotPlugin)
            .add(theme::ThemePlugin)
            .add(panel::PanelPlugin)
            .add(throughput::ThroughputPlugin)
            .add(resolution::ResolutionPlugin)
            .add(accuracy::AccuracyPlugin)
            .add(gallery::GalleryPlugin)
            .add(ghost::GhostPlugin)
            .add(ghost::form::GhostFormPlugin)
            .add(hud::HudPlugin)
            .add(message::MessagePlugin)
            .add(frozen::FrozenPlugin)
            .add(keys::KeysPlugin)
            .add(help::HelpPlugin)
            .add(arrival::ArrivalPlugin)
            .add(drop::DropPlugin)
    }
}

fn spawn_camera(mut commands: Commands, adapter: Res<RenderAdapterInfo>) {
    // Four samples a pixel cost a processor four times the work, and a graphics card next to none.
    let smoothing = if stage::is_software(&adapter) {
        Msaa::Off
    } else {
        Msaa::Sample4
    };
    commands.spawn((camera::OrbitCamera::default(), stage::lens(), smoothing));
}

fn bound_ticks(mut clock: ResMut<SimulationClock>) {
    clock.budget = Some(TICK_BUDGET);
}

/// Runs `build`, turning a panic into its message: window systems and drivers panic where they
/// could refuse, and nobody's first minute should end in a stack trace.
fn quietly<T>(build: impl FnOnce() -> T) -> Result<T, String> {
    let message = Arc::new(Mutex::new(String::new()));
    let heard = Arc::clone(&message);
    let usual = panic::take_hook();
    panic::set_hook(Box::new(move |info| {
        let text = info.payload_as_str().unwrap_or("unknown reason");
        if let Ok(mut message) = heard.lock() {
            *message = text.lines().next().unwrap_or(text).to_owned();
        }
    }));
    let built = panic::catch_unwind(AssertUnwindSafe(build));
    panic::set_hook(usual);
    built.map_err(|_| {
        message
            .lock()
            .map(|message| message.clone())
            .unwrap_or_default()
    })
}
