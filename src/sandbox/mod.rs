//! The window: a studio to look at soft bodies, a hand to pull them, and a panel to turn what
//! they are made of.
//!
//! - [`state`] is what the rooms share: what is shown, selected, asked for.
//! - [`ui`] is the kit: theme, widgets, messages.
//! - [`render`] is the picture. [`view`](state::view) says what is shown.
//! - [`input`] has keys, pointer, drag.
//! - [`lab`] has the instruments.
//! - [`panel`] is the panel and the head-up line.
//! - [`app`] has what the window opens with, loads, keeps and writes down.
//!
//! None of them touches the simulation but through [`Actions`](crate::simulation::Actions), its clock and
//! its settings.

pub mod app;
pub mod input;
pub mod lab;
pub mod panel;
pub mod render;
pub mod state;
pub mod ui;

use self::app::display::NoDisplay;
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
    time::TimeSystems,
    window::PresentMode,
};
use bevy_egui::EguiPlugin;
use std::{
    panic::{self, AssertUnwindSafe},
    path::PathBuf,
    sync::{Arc, Mutex},
    time::Duration,
};

/// Real time that ticks may take of a frame before they are spread over several: where pictures are fast, a frame stays
/// under a thirtieth of a second whatever the physics costs.
const MIN_TICK_BUDGET: Duration = Duration::from_millis(16);

/// Where pictures are slow, ticks may take half of the time, up to this, so that the physics does not wait for pictures.
const MAX_TICK_BUDGET: Duration = Duration::from_millis(100);

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
    let reached = app::display::check()?;
    let mut app = quietly(|| build(options)).map_err(NoDisplay::Refused)?;
    drop(reached);
    Ok(app.run())
}

/// The sandbox as an app that is ready to run.
fn build(options: &SandboxOptions) -> App {
    let mut app = App::new();
    if !options.no_settings {
        app.add_plugins(app::settings::KeptSettingsPlugin);
    }
    let kept = app.world().get_resource::<app::settings::KeptSettings>();
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
    .add_plugins(app::load::LoadPlugin {
        first: first.unwrap_or_else(|| SCENES[0].name.to_owned()),
    })
    .add_systems(Startup, spawn_camera)
    .add_systems(First, bound_ticks.after(TimeSystems));
    if let Some(path) = options.journal.clone() {
        app.add_plugins(app::journal::JournalPlugin { path });
    }
    if let Some(path) = options.record.clone() {
        app.add_plugins(app::record::RecordPlugin { path });
    }
    app
}

/// Everything in the window but the simulation.
pub struct SandboxPlugins;

impl PluginGroup for SandboxPlugins {
    fn build(self) -> PluginGroupBuilder {
        PluginGroupBuilder::start::<Self>()
            .add(state::view::ViewPlugin)
            .add(render::stage::StagePlugin)
            .add(input::pointer::PointerPlugin)
            .add(input::drag::DragPlugin)
            .add(input::steer::SteerPlugin)
            .add(input::spring::SpringPlugin)
            .add(render::camera::CameraPlugin)
            .add(render::bodies::BodiesPlugin)
            .add(render::colliders::CollidersPlugin)
            .add(render::wires::WiresPlugin)
            .add(render::solver_view::SolverViewPlugin)
            .add(render::overlay::OverlayPlugin)
            .add(lab::answer::AnswerPlugin)
            .add(app::screenshot::ScreenshotPlugin)
            .add(app::report::ReportPlugin)
            .add(ui::theme::ThemePlugin)
            .add(panel::PanelPlugin)
            .add(app::requests::RequestsPlugin)
            .add(lab::throughput::ThroughputPlugin)
            .add(lab::resolution::ResolutionPlugin)
            .add(lab::accuracy::AccuracyPlugin)
            .add(lab::gallery::GalleryPlugin)
            .add(lab::reference_overlay::ReferenceOverlayPlugin)
            .add(lab::reference_overlay::form::ReferenceFormPlugin)
            .add(panel::hud::HudPlugin)
            .add(ui::message::MessagePlugin)
            .add(lab::quarantine::QuarantinePlugin)
            .add(input::keys::KeysPlugin)
            .add(panel::help::HelpPlugin)
            .add(app::import::ImportPlugin)
            .add(app::drop::DropPlugin)
    }
}

fn spawn_camera(mut commands: Commands, adapter: Res<RenderAdapterInfo>) {
    // Four samples a pixel cost a processor four times the work, and a graphics card next to none.
    let smoothing = if render::stage::is_software(&adapter) {
        Msaa::Off
    } else {
        Msaa::Sample4
    };
    commands.spawn((
        render::camera::OrbitCamera::default(),
        render::stage::lens(),
        smoothing,
    ));
}

fn bound_ticks(mut clock: ResMut<SimulationClock>, time: Res<Time<Real>>) {
    let half = time.delta() / 2;
    clock.budget = Some(half.clamp(MIN_TICK_BUDGET, MAX_TICK_BUDGET));
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
