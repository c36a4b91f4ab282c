//! The journal: events of the window, one line of JSON each, for scripted tests and demos with a
//! real pointer.
//!
//! | event | when | fields |
//! |---|---|---|
//! | `ready` | the first scene is drawn | `width`, `height` [logical px], `scale` |
//! | `scene` | a scene was opened, or failed to open | `name`, `error` |
//! | `widget` | a widget appeared, moved or disappeared | `name`, `rect` [x, y, width, height] [px] or null |
//! | `body` | ten times per second | `name`, `screen` [x, y] [px] or null, `center` [m] |
//! | `action` | an action was carried out | `tick`, `action` |
//! | `tick` | ten times per second | the figures of the head-up line |
//! | `notice` | a message was shown | `text` |
//! | `closing` | the window closes | |
//!
//! Pixels are physical, from the upper left corner of the window, as pointer drivers expect them.

use super::idle::MaxWait;
use crate::sandbox::state::event::SceneLoaded;
use std::{
    collections::BTreeMap,
    fs::File,
    io::{BufWriter, Write},
    path::PathBuf,
    time::Duration,
};

use bevy::{
    app::AppExit,
    ecs::system::SystemParam,
    prelude::*,
    window::{ExitSystems, PrimaryWindow},
};
use bevy_egui::egui::Rect;
use serde_json::{Value, json};

use crate::{
    sandbox::{
        app::keep::KeepRects,
        lab::{
            ablation::AblationRects, accuracy::CardRects, gallery::GalleryRects, plots::PlotRects,
            quarantine::QuarantineRects,
        },
        panel::{
            PanelRects, browser::BrowserRects, first_steps::FirstStepRects,
            time_strip::TimeStripRects,
        },
        render::camera::OrbitCamera,
        render::coloring::LegendRects,
        ui::{WidgetRects, message::Notices},
    },
    scene::CurrentScene,
    simulation::{Action, Applied, Statistics},
    solver::Particles,
};

/// Lines per second for bodies and ticks.
const RATE: f32 = 10.0;
/// Number of frames before the window is assumed to be drawn.
const SETTLED: u32 = 5;

/// The open file.
#[derive(Resource, Debug)]
struct Journal {
    file: BufWriter<File>,
    places: BTreeMap<String, Rect>,
    notices: Vec<String>,
    frames: u32,
    seconds: f32,
}

impl Journal {
    /// Writes a line. A write error, such as a full disk, ends the journal but not the window.
    fn line(&mut self, value: &Value) {
        if let Err(error) = writeln!(self.file, "{value}") {
            warn!("cannot continue the journal: {error}");
        }
    }
}

/// Writes a journal to a new file, or replaces an existing one.
#[derive(Debug)]
pub struct JournalPlugin {
    /// The file.
    pub path: PathBuf,
}

impl Plugin for JournalPlugin {
    fn build(&self, app: &mut App) {
        let file = match File::create(&self.path) {
            Ok(file) => file,
            Err(error) => {
                let path = self.path.display();
                let mut notices = app.world_mut().get_resource_or_init::<Notices>();
                notices.error(format!("Cannot write the journal {path}: {error}"));
                return;
            }
        };
        // Bodies and ticks are written while nothing moves, too.
        app.insert_resource(MaxWait(Duration::from_secs_f32(1.0 / RATE)));
        app.insert_resource(Journal {
            file: BufWriter::new(file),
            places: BTreeMap::new(),
            notices: Vec::new(),
            frames: 0,
            seconds: 0.0,
        })
        .add_systems(
            Last,
            (
                write_ready,
                write_scenes,
                write_widgets,
                write_actions,
                write_notices,
                write_figures,
                write_end.after(ExitSystems),
            )
                .chain(),
        );
    }
}

fn write_ready(
    mut journal: ResMut<Journal>,
    window: Option<Single<&Window, With<PrimaryWindow>>>,
    scene: Option<Res<CurrentScene>>,
) {
    if scene.is_none() {
        return;
    }
    journal.frames = journal.frames.saturating_add(1);
    if let Some(window) = window
        && journal.frames == SETTLED
    {
        journal.line(&json!({
            "event": "ready",
            "width": window.width(),
            "height": window.height(),
            "scale": window.scale_factor(),
        }));
    }
}

fn write_scenes(mut journal: ResMut<Journal>, mut loaded: MessageReader<SceneLoaded>) {
    for scene in loaded.read() {
        journal.line(&json!({"event": "scene", "name": scene.name, "error": scene.error}));
    }
}

/// Rectangles of all widgets.
#[derive(SystemParam)]
struct Rects<'w> {
    panel: Res<'w, PanelRects>,
    accuracy: Res<'w, CardRects>,
    ablation: Res<'w, AblationRects>,
    gallery: Res<'w, GalleryRects>,
    quarantine: Res<'w, QuarantineRects>,
    legend: Res<'w, LegendRects>,
    plots: Res<'w, PlotRects>,
    keep: Res<'w, KeepRects>,
    browser: Res<'w, BrowserRects>,
    first_steps: Res<'w, FirstStepRects>,
    time_strip: Res<'w, TimeStripRects>,
}

impl Rects<'_> {
    /// The rectangles of each card, and whether they have changed.
    fn all(&self) -> [(&WidgetRects, bool); 11] {
        [
            (&self.panel, self.panel.is_changed()),
            (&self.accuracy, self.accuracy.is_changed()),
            (&self.ablation, self.ablation.is_changed()),
            (&self.gallery, self.gallery.is_changed()),
            (&self.quarantine, self.quarantine.is_changed()),
            (&self.legend, self.legend.is_changed()),
            (&self.plots, self.plots.is_changed()),
            (&self.keep, self.keep.is_changed()),
            (&self.browser, self.browser.is_changed()),
            (&self.first_steps, self.first_steps.is_changed()),
            (&self.time_strip, self.time_strip.is_changed()),
        ]
    }
}

fn write_widgets(
    mut journal: ResMut<Journal>,
    rects: Rects,
    window: Option<Single<&Window, With<PrimaryWindow>>>,
) {
    let all = rects.all();
    let changed = all.iter().any(|(_, changed)| *changed);
    let (true, Some(window)) = (changed, window) else {
        return;
    };
    let scale = window.scale_factor();
    let now: BTreeMap<String, Rect> = all
        .iter()
        .flat_map(|(rects, _)| rects.iter())
        .map(|(name, rect)| (name.to_owned(), rect * scale))
        .collect();
    let before = std::mem::take(&mut journal.places);
    for name in before.keys().filter(|name| !now.contains_key(*name)) {
        journal.line(&json!({"event": "widget", "name": name, "rect": null}));
    }
    for (name, rect) in now
        .iter()
        .filter(|(name, rect)| before.get(*name) != Some(*rect))
    {
        let rect = [rect.min.x, rect.min.y, rect.width(), rect.height()];
        journal.line(&json!({"event": "widget", "name": name, "rect": rect}));
    }
    journal.places = now;
}

fn write_actions(
    mut journal: ResMut<Journal>,
    mut applied: MessageReader<Applied>,
    names: Query<&Name>,
) {
    for Applied { tick, action, .. } in applied.read() {
        let action = describe(action, |body| {
            names
                .get(body)
                .map_or_else(|_| body.to_string(), Name::to_string)
        });
        journal.line(&json!({"event": "action", "tick": tick, "action": action}));
    }
}

/// An action as JSON, with names in place of entities.
fn describe(action: &Action, name: impl Fn(Entity) -> String) -> Value {
    match action {
        Action::Grab { body, target, .. } => {
            json!({"do": "grab", "body": name(*body), "target": target.to_array()})
        }
        Action::Brush {
            body,
            target,
            radius,
            ..
        } => {
            json!({"do": "grab", "body": name(*body), "target": target.to_array(), "radius": radius})
        }
        Action::GrabPins { body, vertex } => {
            json!({"do": "grab pins", "body": name(*body), "vertex": vertex})
        }
        Action::MovePins { body, target, .. } => {
            json!({"do": "move pins", "body": name(*body), "target": target.to_array()})
        }
        Action::AddCollider { pose, .. } => {
            json!({"do": "add collider", "position": pose.translation.to_array()})
        }
        Action::SetCollider { pose, .. } => {
            json!({"do": "set collider", "position": pose.translation.to_array()})
        }
        Action::RemoveCollider { .. } => json!({"do": "remove collider"}),
        Action::MoveGrab { body, target } => {
            json!({"do": "move", "body": name(*body), "target": target.to_array()})
        }
        Action::Release { body } => json!({"do": "release", "body": name(*body)}),
        Action::SetParameter {
            body,
            effect,
            parameter,
            value,
        } => json!({
            "do": "set",
            "body": name(*body),
            "parameter": format!("{effect}.{parameter}"),
            "value": number(*value),
        }),
        Action::SetForceGroup { body, group } => json!({
            "do": "set",
            "body": name(*body),
            "parameter": "force_mask.group",
            "value": group,
        }),
        Action::SetSetting {
            name: setting,
            value,
        } => {
            json!({"do": "set", "parameter": setting, "value": number(*value)})
        }
        Action::AddEffect { body, effect } => {
            json!({"do": "add effect", "body": name(*body), "effect": effect})
        }
        Action::RemoveEffect { body, effect } => {
            json!({"do": "remove effect", "body": name(*body), "effect": effect})
        }
        Action::SetDensity { body, density } => {
            json!({"do": "set", "body": name(*body), "parameter": "density", "value": f64::from(*density)})
        }
        Action::Pin { body, vertex } => {
            json!({"do": "pin", "body": name(*body), "vertex": vertex})
        }
        Action::Unpin { body, vertex } => {
            json!({"do": "unpin", "body": name(*body), "vertex": vertex})
        }
        Action::Control { body, .. } => json!({"do": "control", "body": name(*body)}),
        Action::Cut { body, .. } => json!({"do": "cut", "body": name(*body)}),
        Action::Deform { body, deformation } => {
            json!({"do": "deform", "body": name(*body), "how": format!("{deformation:?}")})
        }
        Action::Restore { body } => json!({"do": "restore", "body": name(*body)}),
        Action::Spawn(new) => json!({"do": "spawn", "body": new.body.name}),
        Action::ResetShape { body } => json!({"do": "reset shape", "body": name(*body)}),
        Action::Despawn { body } => json!({"do": "despawn", "body": name(*body)}),
    }
}

/// A number, or a string for values that JSON cannot represent.
fn number(value: f64) -> Value {
    if value.is_finite() {
        json!(value)
    } else {
        json!(value.to_string())
    }
}

fn write_notices(mut journal: ResMut<Journal>, notices: Res<Notices>) {
    let now: Vec<String> = notices.iter().map(|notice| notice.text.clone()).collect();
    let before = std::mem::take(&mut journal.notices);
    for text in now.iter().filter(|text| !before.contains(text)) {
        journal.line(&json!({"event": "notice", "text": text}));
    }
    journal.notices = now;
}

fn write_figures(
    mut journal: ResMut<Journal>,
    time: Res<Time<Real>>,
    statistics: Res<Statistics>,
    bodies: Query<(&Name, &Particles)>,
    camera: Single<(&Camera, &GlobalTransform), With<OrbitCamera>>,
    window: Option<Single<&Window, With<PrimaryWindow>>>,
) {
    journal.seconds += time.delta_secs();
    let (true, Some(window)) = (journal.seconds >= 1.0 / RATE, window) else {
        return;
    };
    journal.seconds = 0.0;
    let (camera, eye) = *camera;
    for (name, particles) in &bodies {
        let sum: Vec3 = particles.positions.iter().map(|x| x.truncate()).sum();
        let center = sum / particles.positions.len().max(1) as f32;
        let screen = camera
            .world_to_viewport(eye, center)
            .ok()
            .map(|place| (place * window.scale_factor()).to_array());
        journal.line(&json!({
            "event": "body",
            "name": name.as_str(),
            "screen": screen,
            "center": center.to_array(),
        }));
    }
    journal.line(&json!({
        "event": "tick",
        "tick": statistics.tick,
        "time": statistics.time,
        "ms_per_tick": statistics.ms_per_tick,
        "particles": statistics.particles,
        "constraints": statistics.constraint_count(),
        "energy_j": number(statistics.energy()),
        "unresolved_j": number(statistics.unresolved),
        "volume_error": statistics.volume_error.map(number),
        "residual": number(statistics.residual),
        "asleep": statistics.asleep,
        "finite": statistics.finite,
    }));
    if let Err(error) = journal.file.flush() {
        warn!("cannot continue the journal: {error}");
    }
}

fn write_end(mut journal: ResMut<Journal>, mut exits: MessageReader<AppExit>) {
    if exits.read().next().is_some() {
        journal.line(&json!({"event": "closing"}));
        if let Err(error) = journal.file.flush() {
            warn!("cannot continue the journal: {error}");
        }
    }
}
