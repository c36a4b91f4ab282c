//! The data that the panel shows, as plain types.
//!
//! The panel is a function from a [`PanelModel`] to a picture and a list of
//! [requests](crate::sandbox::state::request::Request). It holds no simulation state and does not
//! depend on the ECS, so that it can be drawn and pressed in a test without a window.

use super::{energy::EnergyTrack, history::History};
use crate::{
    sandbox::{
        lab::reference_overlay::distance::Trail,
        render::quality::EffectiveQuality,
        state::{
            color::ColorMode, display::DisplaySettings, hands::Hands, keep::RecentFile,
            search::PanelSearch, selection::Scope, spawn::Spawn, view::SolverView,
        },
        ui::track::Track,
    },
    scene::Material,
    simulation::Statistics,
    solver::{GroupName, effective::CLOSE},
};
use bevy::prelude::{Deref, Resource};

/// All data that the panel shows.
#[derive(Debug, Clone, Default)]
pub struct PanelModel {
    /// Name of the scene that is open.
    pub scene: String,
    /// Title of the scene that is open.
    pub scene_title: String,
    /// Description of the open scene.
    pub scene_note: String,
    /// The File menu.
    pub file: FileModel,
    /// The search of the panel.
    pub search: PanelSearch,
    /// State of the clock.
    pub clock: ClockModel,
    /// Title of the action that undo takes back; `None` without one.
    pub undo: Option<String>,
    /// Title of the action that redo repeats; `None` without one.
    pub redo: Option<String>,
    /// World settings: substeps, iterations, rate, gravity.
    pub settings: Vec<Parameter>,
    /// Number of solver threads; `None` if only one is available.
    pub threads: Option<Parameter>,
    /// Median time of the solver in the ticks of the last second [ms].
    pub ms_per_tick: f64,
    /// Constraint projections per second, if there are any.
    pub projections: Option<f64>,
    /// Active steps of a substep, in order.
    pub steps: Vec<&'static str>,
    /// Bodies, in the order of the scene.
    pub bodies: Vec<BodyEntry>,
    /// The selected bodies, whose parameters are shown.
    pub scope: Scope,
    /// All effects, present or not, in the order in which they are solved.
    pub effects: Vec<EffectModel>,
    /// Stages of a tick outside the effects: prediction, contacts, statistics.
    pub stages: Vec<StageModel>,
    /// Time of the last ticks by part.
    pub history: History,
    /// The energy of all bodies.
    pub stored: StoredEnergy,
    /// The energy ledger, while it is on.
    pub energy: Option<EnergyModel>,
    /// The point that is or was grabbed.
    pub grabbed: Option<GrabModel>,
    /// Whether a selected body has a pin.
    pub is_pinned: bool,
    /// Bodies that can be added: built-in primitives and meshes.
    pub additions: Vec<Addition>,
    /// The body to add, and its size.
    pub spawn: Spawn,
    /// How the pointer grabs, and what is shot.
    pub hands: Hands,
    /// Materials that can be applied to the selected bodies.
    pub materials: Vec<&'static Material>,
    /// The material of the selected bodies, if they have one and the same.
    pub material: Option<&'static Material>,
    /// Presets of the user that can be applied to the selected bodies: name and parameters as text.
    pub presets: Vec<(String, String)>,
    /// Whether the wireframe is drawn.
    pub wireframe: bool,
    /// Whether contact forces are drawn.
    pub contacts: bool,
    /// Whether the tetrahedra are drawn.
    pub tetrahedra: bool,
    /// Names of the analytic solutions of the scene, and whether they are drawn; empty if it has
    /// none.
    pub answers: (String, bool),
    /// The active solver view.
    pub solver: SolverView,
    /// The quantity by which bodies are colored.
    pub color: ColorMode,
    /// Whether the plots over time are open.
    pub plots: bool,
    /// The reference overlay, if it is on.
    pub reference_overlay: Option<ReferenceModel>,
    /// The display settings.
    pub display: DisplaySettings,
    /// Scale of the interface that is chosen automatically.
    pub automatic_scale: f32,
    /// The quality in which the picture is drawn.
    pub quality: EffectiveQuality,
}

/// What the File menu shows.
#[derive(Debug, Clone, Default)]
pub struct FileModel {
    /// Files that were opened or saved, newest first.
    pub recent: Vec<RecentFile>,
    /// The scene file that is open; `None` for a built-in scene or a snapshot.
    pub scene_file: Option<String>,
    /// Whether a recording is under way.
    pub records: bool,
    /// Whether a film is taken.
    pub films: bool,
}

/// State of the simulation clock.
#[derive(Debug, Clone, Default)]
pub struct ClockModel {
    /// Whether the simulation is paused.
    pub paused: bool,
    /// Simulated seconds per real second.
    pub speed: f64,
    /// Simulated time [s].
    pub time: f64,
}

/// A number that can be edited.
#[derive(Debug, Clone)]
pub struct Parameter {
    /// Name in scene files and `--set`.
    pub name: &'static str,
    /// Title.
    pub title: &'static str,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
    /// Description, for the tooltip.
    pub help: &'static str,
    /// Slider track.
    pub track: Track,
    /// Value; that of the first body if they differ.
    pub value: f64,
    /// Minimum and maximum over the selected bodies, if they differ.
    pub spread: Option<(f64, f64)>,
    /// Scene default, if there is one and all selected bodies share it.
    pub original: Option<f64>,
    /// Names of its values, from the smallest of the track on; empty for a number.
    pub choices: &'static [&'static str],
    /// Whether any selected body differs from its scene default.
    pub changed: bool,
    /// Whether it is a setting that differs from the default of the program.
    pub unusual: bool,
}

/// An entry of the list of bodies.
#[derive(Debug, Clone)]
pub struct BodyEntry {
    /// Key of the body in requests.
    pub key: u64,
    /// Its name.
    pub name: String,
    /// Number of particles.
    pub particles: usize,
    /// Number of inverted elements.
    pub inverted: usize,
    /// State.
    pub state: BodyState,
    /// Whether it is hidden.
    pub hidden: bool,
    /// Its color, sRGB.
    pub color: [u8; 3],
}

/// State of a body.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum BodyState {
    /// Active.
    #[default]
    Awake,
    /// Asleep: at rest and not stepped.
    Asleep,
    /// In quarantine after divergence, with the reason.
    Quarantined(String),
}

/// An effect, whether any body carries it or not.
#[derive(Debug, Clone)]
pub struct EffectModel {
    /// Name in scene files.
    pub name: &'static str,
    /// Title.
    pub title: &'static str,
    /// Description, in one sentence.
    pub summary: &'static str,
    /// Names and titles of all of its parameters, for the search.
    pub words: String,
    /// Number of bodies that carry it; at 0 it has no system in the schedule.
    pub carriers: usize,
    /// Number of selected bodies that carry it.
    pub carriers_shown: usize,
    /// Number of its constraints on the selected bodies.
    pub elements: usize,
    /// Fraction of the time of a tick, 0 to 1, if measured.
    pub fraction: Option<f32>,
    /// Whether the panel may add it to bodies and remove it.
    pub switchable: bool,
    /// Parameters on the selected bodies; empty if none carries it.
    pub parameters: Vec<Parameter>,
    /// The group of vertices of the force masks, where a selected body has groups.
    pub group: Option<GroupModel>,
    /// Advice on the effect for the selected bodies, in one sentence.
    pub note: Option<String>,
    /// Effective compliance, if it can be determined.
    pub effective: Option<EffectiveModel>,
    /// Minimum and maximum overpressure of the selected bodies [Pa].
    pub overpressure: Option<(f64, f64)>,
    /// What the effect has done to the selected bodies so far.
    pub done: Option<Done>,
    /// Contacts of all bodies.
    pub contacts: Option<ContactModel>,
}

/// The choice of a group of vertices.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GroupModel {
    /// Groups of the selected bodies, each name once.
    pub names: Vec<GroupName>,
    /// The chosen one, empty for the whole body; `None` if bodies differ.
    pub chosen: Option<GroupName>,
}

/// What an effect has done to the selected bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Done {
    /// Grains that were emitted, and those that wait.
    Emitted {
        /// Number of grains that were emitted.
        emitted: u64,
        /// Number of grains that are due and find no place.
        waiting: u64,
    },
    /// Number of particles that were split.
    Split(usize),
}

/// Contacts of all bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactModel {
    /// Number of contacts with a force.
    pub acting: usize,
    /// Smallest distance of two surfaces [m], if any are near each other.
    pub smallest_gap: Option<f64>,
    /// Number of surface crossings.
    pub crossings: usize,
}

/// Effective compliance, relative to the requested compliance.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectiveModel {
    /// Effective compliance in `unit`.
    pub effective: f64,
    /// Unit of the effect's compliance.
    pub unit: &'static str,
    /// Ratio of effective to requested compliance; `None` if the requested compliance is 0.
    pub factor: Option<f64>,
    /// Whether the stiffness is limited by the solver and not by the material.
    pub limited: bool,
    /// Substeps per tick that would reach the requested compliance, if any number would.
    pub substeps: Option<u32>,
}

/// The energy of all bodies.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StoredEnergy {
    /// Kinetic energy [J].
    pub kinetic: f64,
    /// Potential energy of gravity, zero at height 0 [J].
    pub potential: f64,
    /// Elastic energy that the solver holds: that of the material which it effectively simulates
    /// [J].
    pub elastic: f64,
    /// What the requested material would store at the same strain beyond that [J].
    pub unresolved: f64,
}

impl StoredEnergy {
    /// Kinetic, potential and held elastic energy [J].
    #[must_use]
    pub fn sum(&self) -> f64 {
        self.kinetic + self.potential + self.elastic
    }

    /// Whether the unresolved part is a substantial one of the elastic energy: a tenth, as where an
    /// effective compliance is said to differ from the requested one.
    #[must_use]
    pub fn is_unresolved(&self) -> bool {
        self.unresolved > (CLOSE - 1.0) * self.elastic
    }
}

impl From<&Statistics> for StoredEnergy {
    fn from(statistics: &Statistics) -> Self {
        Self {
            kinetic: statistics.kinetic,
            potential: statistics.potential,
            elastic: statistics.elastic_sum() - statistics.unresolved,
            unresolved: statistics.unresolved,
        }
    }
}

/// The energy ledger of the scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EnergyModel {
    /// Simulated time that it covers [s].
    pub seconds: f64,
    /// Stored energy: label, current value, and change [J].
    pub held: Vec<(&'static str, f64, f64)>,
    /// Sources and sinks: label, description, and energy [J].
    pub rows: Vec<(&'static str, &'static str, f64)>,
    /// Total change of the stored energy [J].
    pub change: f64,
    /// Energy that the rows do not account for, relative to the largest term.
    pub gap: f64,
    /// Kinetic, potential and elastic energy over the last ticks.
    pub track: EnergyTrack,
}

/// The reference overlay, and the distance of the bodies from it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReferenceModel {
    /// Distances over the last ticks; empty before it has started.
    pub trail: Trail,
    /// Number of bodies with a reference at the start, and number that could have had one.
    pub bodies: (usize, usize),
    /// Number of references that were removed because they diverged.
    pub lost: usize,
    /// Its substeps per tick; `None` before it has started.
    pub substeps: Option<u32>,
    /// Substeps per tick of the bodies.
    pub of: u32,
    /// Length of a tick [s].
    pub tick: f64,
    /// Root mean square distance at the start [m].
    pub outset: f64,
    /// Whether the simulation waits for the reference.
    pub holds: bool,
    /// Reason why there is no reference although the overlay is on.
    pub trouble: Option<String>,
}

/// A stage of a tick other than the effects.
#[derive(Debug, Clone)]
pub struct StageModel {
    /// Name in the profile.
    pub name: &'static str,
    /// Title.
    pub title: String,
    /// Fraction of the time of a tick, 0 to 1.
    pub fraction: f32,
}

/// The point that is or was last grabbed.
#[derive(Debug, Clone)]
pub struct GrabModel {
    /// Name of the body.
    pub body: String,
    /// Whether the particle is pinned.
    pub pinned: bool,
}

/// Bodies that can be added to the scene, as shown in the menu.
#[derive(Resource, Debug, Clone, Default, Deref)]
pub struct Additions(pub Vec<Addition>);

/// A body that can be added to the scene.
#[derive(Debug, Clone)]
pub struct Addition {
    /// Name in requests.
    pub name: String,
    /// Title.
    pub title: String,
    /// Whether a separator is drawn above it, before another kind.
    pub begins_group: bool,
}
