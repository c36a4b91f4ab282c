//! The window: a view of soft bodies that can be dragged with the mouse, and a panel that edits
//! their parameters.
//!
//! - [`state`]: shared state: view, selection, requests, events.
//! - [`ui`]: theme, widgets, messages.
//! - [`render`]: the picture. [`view`](state::view) selects what is shown.
//! - [`input`]: keys, pointer, dragging.
//! - [`lab`]: the instruments.
//! - [`panel`]: the panel and the head-up line.
//! - [`app`]: start-up, loading, saved settings and output files.
//!
//! They act on the simulation only through [`Actions`](crate::simulation::Actions), its clock and
//! its settings.

#[doc(hidden)]
pub mod app;
#[doc(hidden)]
pub mod input;
#[doc(hidden)]
pub mod lab;
#[doc(hidden)]
pub mod panel;
#[doc(hidden)]
pub mod render;
#[doc(hidden)]
pub mod state;
#[doc(hidden)]
pub mod ui;

use self::{app::display::NoDisplay, lab::reference_overlay::ReferenceOverlay};
use crate::{
    SoftBodyPlugins,
    effect::OwnEffects,
    scene::registry::SCENES,
    simulation::{EnergyLedger, SimulationClock, SolverThreads},
    solver::Threads,
};
use bevy::{
    app::{AppExit, PluginGroupBuilder},
    log::{Level, LogPlugin},
    prelude::*,
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

/// Minimum time budget for ticks per frame; longer ticks are spread over several frames. With fast
/// rendering, a frame stays below 1/30 s at any cost of a tick.
const MIN_TICK_BUDGET: Duration = Duration::from_millis(16);

/// Maximum time budget. With slow rendering, ticks may take half of the frame time up to this
/// limit, so that the simulation does not wait for rendering.
const MAX_TICK_BUDGET: Duration = Duration::from_millis(100);

/// Real time for which an action waits for the end of a tick. With the rest of a frame's budget,
/// an action takes effect within 100 ms plus the time of one substep.
const PATIENCE: Duration = Duration::from_millis(40);

/// Options of the window.
#[derive(Debug, Clone, Default)]
pub struct SandboxOptions {
    /// Name or path of the scene; `None` for that of the last run, or the default scene.
    pub scene: Option<String>,
    /// Effects of an app, besides those of the crate.
    pub own_effects: OwnEffects,
    /// Output file for events, one line of JSON each, for scripted tests of the real window.
    pub journal: Option<PathBuf>,
    /// Output file for a recording of the actions on the simulation.
    pub record: Option<PathBuf>,
    /// Do not load or save settings.
    pub no_settings: bool,
    /// Size of the window [px]; `None` for that of the last run.
    pub size: Option<UVec2>,
    /// Solver threads; `None` for one per core.
    pub threads: Option<Threads>,
}

/// Opens the window, and returns when it is closed.
///
/// # Errors
/// [`NoDisplay`] if no window can be opened; nothing has been opened in this case.
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
    app.add_plugins(
        DefaultPlugins
            .set(WindowPlugin {
                primary_window: Some(window),
                // Unsaved changes are asked about first.
                close_when_requested: false,
                ..default()
            })
            // What concerns the user; `RUST_LOG=info` shows the messages of Bevy and the driver.
            .set(LogPlugin {
                level: Level::ERROR,
                filter: "pliant=warn".to_owned(),
                ..default()
            }),
    )
    .add_plugins(EguiPlugin {
        // With an array of textures, a software renderer samples all of them for each pixel.
        bindless_mode_array_size: None,
    })
    .insert_resource(
        options
            .threads
            .clone()
            .map_or_else(SolverThreads::default, SolverThreads),
    )
    // After all input of a frame and before drawing, so that the pointer takes effect in the same
    // frame. Not in a fixed schedule: the clock generates the ticks, and needs the real time of
    // every frame to interpolate between them.
    .add_plugins(SoftBodyPlugins::new(PostUpdate))
    .add_plugins(SandboxPlugins)
    .add_plugins(app::load::LoadPlugin {
        first: first.unwrap_or_else(|| SCENES[0].name.to_owned()),
    })
    .add_systems(Startup, spawn_camera)
    .add_systems(First, bound_ticks.after(TimeSystems));
    options.own_effects.add_to(&mut app);
    if let Some(path) = options.journal.clone() {
        app.add_plugins(app::journal::JournalPlugin { path })
            .insert_resource(app::keep::closing::Scripted(true));
    }
    if let Some(path) = options.record.clone() {
        app.add_plugins(app::keep::recording::RecordPlugin { path });
    }
    app::executors::choose(&mut app);
    app
}

/// All plugins of the window except the simulation.
pub struct SandboxPlugins;

impl PluginGroup for SandboxPlugins {
    fn build(self) -> PluginGroupBuilder {
        PluginGroupBuilder::start::<Self>()
            .add(state::view::ViewPlugin)
            .add(render::stage::StagePlugin)
            .add(render::quality::QualityPlugin)
            .add(render::reduced::ReducedPlugin)
            .add(render::readiness::ReadinessPlugin)
            .add(input::pointer::PointerPlugin)
            .add(input::drag::DragPlugin)
            .add(input::steer::SteerPlugin)
            .add(input::spring::SpringPlugin)
            .add(input::scissors::ScissorsPlugin)
            .add(input::gizmo::GizmoPlugin)
            .add(render::camera::CameraPlugin)
            .add(render::bodies::BodiesPlugin)
            .add(render::colliders::CollidersPlugin)
            .add(render::wires::WiresPlugin)
            .add(render::contacts::ContactsPlugin)
            .add(render::solver_view::SolverViewPlugin)
            .add(render::coloring::ColoringPlugin)
            .add(render::inverted::InvertedPlugin)
            .add(render::overlay::OverlayPlugin)
            .add(render::openings::OpeningsPlugin)
            .add(render::marks::MarksPlugin)
            .add(render::pin_marks::PinMarksPlugin)
            .add(lab::answer::AnswerPlugin)
            .add(app::screenshot::ScreenshotPlugin)
            .add(app::plain_picture::PlainPicturePlugin)
            .add(app::film::FilmPlugin)
            .add(app::report::ReportPlugin)
            .add(ui::theme::ThemePlugin)
            .add(ui::paint::PaintPlugin)
            .add(ui::scale::ScalePlugin)
            .add(panel::PanelPlugin)
            .add(app::time::TimePlugin)
            .add(app::requests::RequestsPlugin)
            .add(lab::throughput::ThroughputPlugin)
            .add(lab::resolution::ResolutionPlugin)
            .add(lab::accuracy::AccuracyPlugin)
            .add(lab::ablation::AblationPlugin)
            .add(lab::gallery::GalleryPlugin)
            .add(lab::plots::PlotsPlugin)
            .add(lab::reference_overlay::ReferenceOverlayPlugin)
            .add(lab::reference_overlay::form::ReferenceFormPlugin)
            .add(panel::hud::HudPlugin)
            .add(ui::message::MessagePlugin)
            .add(lab::quarantine::QuarantinePlugin)
            .add(input::keys::KeysPlugin)
            .add(panel::help::HelpPlugin)
            .add(panel::first_steps::FirstStepsPlugin)
            .add(panel::browser::BrowserPlugin)
            .add(app::import::ImportPlugin)
            .add(app::spawn::SpawnPlugin)
            .add(app::drop::DropPlugin)
            .add(app::keep::KeepPlugin)
            .add(app::idle::IdlePlugin)
    }
}

fn spawn_camera(mut commands: Commands) {
    commands.spawn((
        render::camera::OrbitCamera::default(),
        render::stage::lens(),
    ));
}

fn bound_ticks(
    mut clock: ResMut<SimulationClock>,
    time: Res<Time<Real>>,
    ledger: Res<EnergyLedger>,
    overlay: Option<Res<ReferenceOverlay>>,
) {
    let half = time.delta() / 2;
    clock.budget = Some(half.clamp(MIN_TICK_BUDGET, MAX_TICK_BUDGET));
    // The budget bounds whole ticks as well.
    clock.limit = None;
    // Both compare whole ticks.
    let whole_ticks = ledger.on || overlay.is_some();
    clock.patience = (!whole_ticks).then_some(PATIENCE);
}

/// Runs `build` and converts a panic into its message, as window systems and drivers may panic
/// instead of returning an error.
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
