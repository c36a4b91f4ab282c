//! Draws the window only on demand while nothing moves: when the simulation is paused or all bodies
//! sleep, the camera is at rest, and no job runs in the background.
//!
//! Input wakes the window at once. Short delays that egui asks for, as for a tooltip, are kept.

use crate::{
    sandbox::{
        app::{import::Imports, load::Opening},
        lab::{
            ablation::AblationState, accuracy::Accuracy, gallery::Gallery,
            reference_overlay::ReferenceOverlay,
        },
        render::{camera::OrbitCamera, quality::EffectiveQuality},
        state::{activity::Activity, view::ViewSettings},
        ui::message::Notices,
    },
    scene::CurrentScene,
    simulation::{Active, SimulationClock, SoftBody},
    solver::{Collider, Path},
};
use bevy::{
    ecs::system::SystemParam,
    prelude::*,
    window::WindowEvent,
    winit::{UpdateMode, WinitSettings},
};
use bevy_egui::{
    EguiFullOutput, EguiInput, EguiPostUpdateSet, EguiPreUpdateSet, PrimaryEguiContext,
    egui::{Event, Modifiers},
};
use std::time::Duration;

/// Time for which every frame is drawn after input: longer than any animation that it starts.
const AFTER_INPUT: Duration = Duration::from_millis(700);
/// The same after a scene is opened or the quality of the picture changes, as shaders are compiled
/// meanwhile.
const AFTER_LOADING: Duration = Duration::from_secs(3);
/// Time between frames while the clock runs and all bodies sleep, short enough for it to keep up,
/// and while something ends after a time: a message, or a delay of egui.
const SOON: Duration = Duration::from_millis(200);

/// Maximum time between frames; default 2 s.
#[derive(Resource, Debug, Clone, Copy)]
pub struct MaxWait(pub Duration);

impl Default for MaxWait {
    fn default() -> Self {
        Self(Duration::from_secs(2))
    }
}

/// Draws on demand.
pub struct IdlePlugin;

impl Plugin for IdlePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Activity>()
            .init_resource::<MaxWait>()
            .add_systems(PreUpdate, notice_input)
            .add_systems(
                PreUpdate,
                drop_repeated_modifiers
                    .after(EguiPreUpdateSet::ProcessInput)
                    .before(EguiPreUpdateSet::BeginPass),
            )
            .add_systems(
                PostUpdate,
                choose_mode
                    .after(EguiPostUpdateSet::EndPass)
                    .before(EguiPostUpdateSet::ProcessOutput),
            );
    }
}

/// How urgently the next frame is needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Next {
    /// Something moves.
    Now,
    /// Within [`SOON`].
    Soon,
    /// Only on demand.
    OnDemand,
}

/// What can move without input.
#[derive(SystemParam)]
struct Moving<'w, 's> {
    clock: Res<'w, SimulationClock>,
    awake: Query<'w, 's, (), (With<SoftBody>, Active)>,
    colliders: Query<'w, 's, &'static Collider>,
    camera: Query<'w, 's, &'static OrbitCamera>,
    opening: Option<Res<'w, Opening>>,
    imports: Res<'w, Imports>,
    accuracy: Res<'w, Accuracy>,
    ablation: Res<'w, AblationState>,
    view: Res<'w, ViewSettings>,
    gallery: Res<'w, Gallery>,
    overlay: Option<Res<'w, ReferenceOverlay>>,
    notices: Res<'w, Notices>,
}

impl Moving<'_, '_> {
    fn next(&self) -> Next {
        let clock = &self.clock;
        let collider_moves = self.colliders.iter().any(|it| it.path != Path::Still);
        let simulation_moves =
            !clock.paused && (!self.awake.is_empty() || collider_moves) || clock.mid_tick();
        let camera_moves = self.camera.iter().any(|camera| camera.now != camera.goal);
        let job_runs = self.opening.as_ref().is_some_and(|it| it.is_pending())
            || self.imports.pending() > 0
            || self.accuracy.is_measuring()
            || self.ablation.is_running()
            || self.view.films
            || self.gallery.is_running()
            || self.overlay.is_some();
        if simulation_moves || camera_moves || job_runs {
            Next::Now
        } else if !clock.paused || self.notices.iter().next().is_some() {
            Next::Soon
        } else {
            Next::OnDemand
        }
    }
}

/// Draws for a while after any input, and while a button or key is held.
fn notice_input(
    mut events: MessageReader<WindowEvent>,
    buttons: Res<ButtonInput<MouseButton>>,
    keys: Res<ButtonInput<KeyCode>>,
    scene: Option<Res<CurrentScene>>,
    quality: Option<Res<EffectiveQuality>>,
    mut activity: ResMut<Activity>,
) {
    let is_input = |event: &WindowEvent| !matches!(event, WindowEvent::RequestRedraw(_));
    let is_held = buttons.get_pressed().next().is_some() || keys.get_pressed().next().is_some();
    if events.read().any(is_input) || is_held {
        activity.draw_for(AFTER_INPUT);
    }
    if scene.is_some_and(|it| it.is_changed()) || quality.is_some_and(|it| it.is_changed()) {
        activity.draw_for(AFTER_LOADING);
    }
}

/// Drops modifiers that have not changed: `bevy_egui` reports them in every frame, and egui asks for
/// another frame after any event.
fn drop_repeated_modifiers(
    mut inputs: Query<&mut EguiInput, With<PrimaryEguiContext>>,
    mut last: Local<Modifiers>,
) {
    for mut input in &mut inputs {
        input.events.retain(|event| match event {
            Event::ModifiersChanged(now) => std::mem::replace(&mut *last, *now) != *now,
            _ => true,
        });
    }
}

/// The time after which egui wants to be drawn again.
fn delay_of_egui(outputs: &Query<&EguiFullOutput>) -> Duration {
    let outputs = outputs.iter().filter_map(|output| output.0.as_ref());
    let viewports = outputs.flat_map(|output| output.viewport_output.values());
    let delays = viewports.map(|viewport| viewport.repaint_delay);
    delays.min().unwrap_or(Duration::MAX)
}

fn choose_mode(
    moving: Moving,
    egui: Query<&EguiFullOutput>,
    max_wait: Res<MaxWait>,
    mut activity: ResMut<Activity>,
    winit: Option<ResMut<WinitSettings>>,
) {
    let delay = delay_of_egui(&egui);
    let by_egui = match delay {
        _ if delay < SOON => Next::Now,
        _ if delay < max_wait.0 => Next::Soon,
        _ => Next::OnDemand,
    };
    let next = if activity.is_requested() {
        Next::Now
    } else {
        moving.next().min(by_egui)
    };
    if activity.is_idle() != (next != Next::Now) {
        activity.set_idle(next != Next::Now);
    }
    let Some(mut winit) = winit else {
        return;
    };
    let wanted = settings(next, max_wait.0);
    // A change of the mode draws a frame.
    let modes = |it: &WinitSettings| (it.focused_mode, it.unfocused_mode);
    if modes(&winit) != modes(&wanted) {
        *winit = wanted;
    }
}

/// Settings of the event loop until the next frame.
fn settings(next: Next, max_wait: Duration) -> WinitSettings {
    let wait = match next {
        Next::Now => return WinitSettings::game(),
        Next::Soon => SOON.min(max_wait),
        Next::OnDemand => max_wait,
    };
    // Motion of the pointer elsewhere on the screen does not matter.
    let mode = UpdateMode::reactive_low_power(wait);
    WinitSettings {
        focused_mode: mode,
        unfocused_mode: mode,
    }
}
