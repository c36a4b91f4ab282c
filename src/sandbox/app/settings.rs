//! Settings that are kept between runs: window size, scene, view options, and world settings that
//! differ from the scene defaults.
//!
//! A small file in the user's preferences folder, written shortly after a change and when the
//! window closes. Its content is validated like any other input: values that the scene or the
//! solver rejects are ignored.

use crate::sandbox::state::event::SceneLoaded;
use std::time::Duration;

use bevy::{
    app::AppExit,
    prelude::*,
    settings::{
        ReflectSettingsGroup, SaveSettingsDeferred, SaveSettingsSync, SettingsGroup, SettingsPlugin,
    },
    window::{ExitSystems, PrimaryWindow},
};

use crate::{
    sandbox::{
        app::keep::unsaved::Baseline,
        panel::SceneSettings,
        state::{
            display::{DisplayChange, DisplaySettings, Quality, Side, Theme},
            first_steps::FirstSteps,
            keep::RecentFiles,
            view::ViewSettings,
        },
    },
    scene::CurrentScene,
    simulation::{Action, Actions, SETTINGS, SimulationClock, SimulationSettings, setting},
};

/// Valid window sizes [logical px]; others are ignored.
const SIZES: std::ops::RangeInclusive<u32> = 320..=16_384;

/// The kept settings.
#[derive(Resource, SettingsGroup, Reflect, Debug, Clone, PartialEq)]
#[reflect(Resource, SettingsGroup, Default)]
#[settings_group(group = "sandbox")]
pub struct KeptSettings {
    /// Width of the window [logical px].
    pub width: u32,
    /// Height of the window [logical px].
    pub height: u32,
    /// Name or path of the scene; empty for the default scene.
    pub scene: String,
    /// World settings that differ from the scene defaults, as `name=value`.
    pub changes: Vec<String>,
    /// Simulated seconds per second.
    pub speed: f64,
    /// Whether the panel is shown.
    pub panel: bool,
    /// Whether the wireframe is drawn.
    pub wireframe: bool,
    /// Whether the tetrahedra are drawn.
    pub tetrahedra: bool,
    /// Quality of the picture: `auto`, `low` or `high`.
    pub quality: String,
    /// Scale of the interface; 0 for automatic.
    pub scale: f32,
    /// Colors of the interface: `dark` or `light`.
    pub theme: String,
    /// Side of the panel: `left` or `right`.
    pub panel_side: String,
    /// Width of the panel [logical px].
    pub panel_width: f32,
    /// Whether the first steps have been shown.
    pub first_steps_done: bool,
    /// Paths of the files that were opened last, newest first.
    pub recent: Vec<String>,
}

impl Default for KeptSettings {
    fn default() -> Self {
        Self {
            width: 1280,
            height: 800,
            scene: String::new(),
            changes: Vec::new(),
            speed: 1.0,
            panel: true,
            wireframe: false,
            tetrahedra: false,
            quality: word(&QUALITIES, Quality::Auto),
            scale: 0.0,
            theme: word(&THEMES, Theme::Dark),
            panel_side: word(&SIDES, Side::Right),
            panel_width: DisplaySettings::default().panel_width,
            first_steps_done: false,
            recent: Vec::new(),
        }
    }
}

const QUALITIES: [(&str, Quality); 3] = [
    ("auto", Quality::Auto),
    ("low", Quality::Low),
    ("high", Quality::High),
];
const THEMES: [(&str, Theme); 2] = [("dark", Theme::Dark), ("light", Theme::Light)];
const SIDES: [(&str, Side); 2] = [("left", Side::Left), ("right", Side::Right)];

/// The word for a value.
fn word<T: PartialEq>(words: &[(&str, T)], value: T) -> String {
    let found = words.iter().find(|(_, other)| *other == value);
    found.map_or_else(String::new, |(word, _)| (*word).to_owned())
}

/// The value of a word; the default for an unknown one.
fn value<T: Copy + Default>(words: &[(&str, T)], word: &str) -> T {
    let found = words.iter().find(|(other, _)| *other == word);
    found.map_or_else(T::default, |(_, value)| *value)
}

impl KeptSettings {
    /// The kept window size [logical px], if it is valid.
    pub fn size(&self) -> Option<UVec2> {
        let sensible = SIZES.contains(&self.width) && SIZES.contains(&self.height);
        sensible.then_some(UVec2::new(self.width, self.height))
    }

    /// The kept display settings; the default for what is not valid.
    pub fn display(&self) -> DisplaySettings {
        let mut display = DisplaySettings::default();
        let scale = (self.scale > 0.0).then_some(self.scale);
        for change in [
            DisplayChange::Quality(value(&QUALITIES, &self.quality)),
            DisplayChange::Scale(scale),
            DisplayChange::Theme(value(&THEMES, &self.theme)),
            DisplayChange::Side(value(&SIDES, &self.panel_side)),
            DisplayChange::PanelWidth(self.panel_width),
        ] {
            display.change(change);
        }
        display
    }

    /// The kept scene, if there is one.
    pub fn scene(&self) -> Option<&str> {
        (!self.scene.is_empty()).then_some(self.scene.as_str())
    }
}

/// Loads the kept settings at once, so that the window can be opened with them, and saves changes.
/// To be added before the window is created.
pub struct KeptSettingsPlugin;

impl Plugin for KeptSettingsPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<KeptSettings>()
            .add_plugins(SettingsPlugin::new("pliant"))
            .add_systems(Startup, (restore_view, super::presets::load))
            .add_systems(Update, restore_world)
            .add_systems(Last, (keep, save_at_the_end.after(ExitSystems)).chain());
    }
}

fn restore_view(
    kept: Res<KeptSettings>,
    mut view: ResMut<ViewSettings>,
    mut clock: ResMut<SimulationClock>,
    mut display: ResMut<DisplaySettings>,
    mut steps: ResMut<FirstSteps>,
    mut recent: ResMut<RecentFiles>,
) {
    *recent = RecentFiles::of(&kept.recent);
    *display = kept.display();
    if !kept.first_steps_done {
        steps.again();
    }
    view.panel_visible = kept.panel;
    view.wireframe = kept.wireframe;
    view.tetrahedra = kept.tetrahedra;
    if (0.001..=100.0).contains(&kept.speed) {
        clock.speed = kept.speed;
    }
}

/// Restores the world settings of the last run, if the first scene is the same.
fn restore_world(
    mut loaded: MessageReader<SceneLoaded>,
    kept: Res<KeptSettings>,
    mut actions: ResMut<Actions>,
    mut baseline: ResMut<Baseline>,
    mut done: Local<bool>,
) {
    let Some(scene) = loaded.read().last().filter(|_| !*done) else {
        return;
    };
    *done = true;
    if scene.error.is_some() || kept.scene() != Some(scene.name.as_str()) {
        return;
    }
    for (name, value) in kept.changes.iter().filter_map(|change| parse(change)) {
        baseline.note_restored(name, value);
        let name = name.to_owned();
        actions.push(Action::SetSetting { name, value });
    }
}

fn keep(
    mut kept: ResMut<KeptSettings>,
    window: Option<Single<&Window, With<PrimaryWindow>>>,
    scene: Option<Res<CurrentScene>>,
    view: Res<ViewSettings>,
    clock: Res<SimulationClock>,
    settings: Res<SimulationSettings>,
    original: Res<SceneSettings>,
    (display, steps, recent): (Res<DisplaySettings>, Res<FirstSteps>, Res<RecentFiles>),
    mut commands: Commands,
) {
    let (Some(window), Some(scene)) = (window, scene) else {
        return;
    };
    let changes = SETTINGS
        .iter()
        .filter_map(|(name, ..)| {
            let value = setting(&settings, name)?;
            (value != setting(&original, name)?).then(|| format!("{name}={value}"))
        })
        .collect();
    let now = KeptSettings {
        // The scale of the interface does not change the size of the window.
        width: (window.physical_width() as f32 / window.resolution.base_scale_factor()).round()
            as u32,
        height: (window.physical_height() as f32 / window.resolution.base_scale_factor()).round()
            as u32,
        scene: scene.name.clone(),
        changes,
        speed: clock.speed,
        panel: view.panel_visible,
        wireframe: view.wireframe,
        tetrahedra: view.tetrahedra,
        quality: word(&QUALITIES, display.quality),
        scale: display.scale.unwrap_or(0.0),
        theme: word(&THEMES, display.theme),
        panel_side: word(&SIDES, display.side),
        panel_width: display.panel_width,
        first_steps_done: steps.now().is_none(),
        recent: recent.paths(),
    };
    if kept.set_if_neq(now) {
        commands.queue(SaveSettingsDeferred(Duration::from_secs(1)));
    }
}

/// Saves pending changes when the window closes.
fn save_at_the_end(mut exits: MessageReader<AppExit>, mut commands: Commands) {
    if exits.read().next().is_some() {
        commands.queue(SaveSettingsSync::IfChanged);
    }
}

/// Parses a kept change.
fn parse(change: &str) -> Option<(&str, f64)> {
    let (name, value) = change.split_once('=')?;
    let value: f64 = value.parse().ok()?;
    value.is_finite().then_some((name, value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_that_no_window_has_is_not_believed() {
        let kept = |width, height| KeptSettings {
            width,
            height,
            ..default()
        };
        assert_eq!(kept(900, 600).size(), Some(UVec2::new(900, 600)));
        assert_eq!(kept(0, 600).size(), None);
        assert_eq!(kept(900, u32::MAX).size(), None);
    }

    #[test]
    fn display_settings_read_back_and_nonsense_is_the_default() {
        let kept = KeptSettings {
            quality: "low".to_owned(),
            scale: 1.5,
            theme: "light".to_owned(),
            panel_side: "left".to_owned(),
            panel_width: 400.0,
            ..default()
        };
        let display = DisplaySettings {
            quality: Quality::Low,
            scale: Some(1.5),
            theme: Theme::Light,
            side: Side::Left,
            panel_width: 400.0,
        };
        assert_eq!(kept.display(), display);
        let nonsense = KeptSettings {
            quality: "best".to_owned(),
            scale: f32::NAN,
            theme: String::new(),
            panel_side: "top".to_owned(),
            panel_width: f32::NAN,
            ..default()
        };
        assert_eq!(nonsense.display(), DisplaySettings::default());
    }

    #[test]
    fn changes_read_back_and_nonsense_is_left_out() {
        assert_eq!(parse("substeps=20"), Some(("substeps", 20.0)));
        assert_eq!(parse("gravity_y=-3.5"), Some(("gravity_y", -3.5)));
        for nonsense in ["", "substeps", "substeps=", "substeps=many", "rate=NaN"] {
            assert_eq!(parse(nonsense), None, "{nonsense}");
        }
    }
}
