//! What the panel shows and what it asks for, as plain data.
//!
//! The panel is a function from a [`PanelModel`] to a picture and a list of [`Request`]s. It
//! holds no simulation state of its own, and nothing here knows the ECS, so that it can be drawn
//! and pressed in a test without a window.

use super::{energy::EnergyTrack, history::History};
use crate::{
    sandbox::{
        lab::reference_overlay::distance::Trail,
        state::{selection::Scope, view::SolverView},
        ui::track::Track,
    },
    scene::Material,
};
use bevy::prelude::{Deref, Resource};

/// Everything that the panel shows.
#[derive(Debug, Clone, Default)]
pub struct PanelModel {
    /// The scenes of the picker, in its order.
    pub scenes: Vec<SceneEntry>,
    /// Name of the scene that is open.
    pub scene: String,
    /// Title of the scene that is open.
    pub scene_title: String,
    /// What to look at in it.
    pub scene_note: String,
    /// The state of the clock.
    pub clock: ClockModel,
    /// The world's settings: substeps, iterations, rate, gravity.
    pub settings: Vec<Parameter>,
    /// How many threads bodies are stepped on; none where there is only one to have.
    pub threads: Option<Parameter>,
    /// Projections of constraints a second, while there are any.
    pub projections: Option<f64>,
    /// The steps of a substep that run, in their order.
    pub steps: Vec<&'static str>,
    /// The bodies, in the order of the scene.
    pub bodies: Vec<BodyEntry>,
    /// Whose parameters are shown.
    pub scope: Scope,
    /// Every effect that there is, present or not, in the order in which they are solved.
    pub effects: Vec<EffectModel>,
    /// What a tick spends outside the effects: prediction, contacts, statistics.
    pub stages: Vec<StageModel>,
    /// Where the time of the last ticks went.
    pub history: History,
    /// The energy ledger, while it is kept.
    pub energy: Option<EnergyModel>,
    /// The point that is or was held.
    pub grabbed: Option<GrabModel>,
    /// Whether a body of the scope has a pin.
    pub is_pinned: bool,
    /// What can be added: built-in primitives and meshes.
    pub additions: Vec<Addition>,
    /// The materials that the bodies of the scope can be made of.
    pub materials: Vec<&'static Material>,
    /// Whether the wireframe is drawn.
    pub wireframe: bool,
    /// Whether the tetrahedra are drawn.
    pub tetrahedra: bool,
    /// What the answers of the scene are called, and whether they are drawn; empty if it has none.
    pub answers: (String, bool),
    /// What of the solver is drawn.
    pub solver: SolverView,
    /// The reference overlay, if there is one.
    pub reference_overlay: Option<ReferenceModel>,
}

/// A line of the scene picker.
#[derive(Debug, Clone)]
pub struct SceneEntry {
    /// What it is opened by.
    pub name: String,
    /// What is shown.
    pub title: String,
    /// What to look at, for the tooltip.
    pub note: String,
}

/// The state of the simulation's clock.
#[derive(Debug, Clone, Default)]
pub struct ClockModel {
    /// Whether time stands.
    pub paused: bool,
    /// Simulated seconds per second of the wall clock.
    pub speed: f64,
    /// Simulated time [s].
    pub time: f64,
}

/// A number that can be moved.
#[derive(Debug, Clone)]
pub struct Parameter {
    /// Its name in scene files and `--set`.
    pub name: &'static str,
    /// Its name for people.
    pub title: &'static str,
    /// Its unit, empty for a pure number.
    pub unit: &'static str,
    /// What it does, for the tooltip.
    pub help: &'static str,
    /// The slider's range.
    pub track: Track,
    /// Its value; of the first body where they differ.
    pub value: f64,
    /// The least and greatest value over the bodies shown, where they differ.
    pub spread: Option<(f64, f64)>,
    /// The scene's value, where it has one and all bodies shown share it.
    pub original: Option<f64>,
    /// Names of its values, from the least of the track on; empty for a number.
    pub choices: &'static [&'static str],
    /// Whether any body shown differs from its scene.
    pub changed: bool,
}

/// A line of the list of bodies.
#[derive(Debug, Clone)]
pub struct BodyEntry {
    /// What it is asked for by.
    pub key: u64,
    /// Its name.
    pub name: String,
    /// How many particles it has.
    pub particles: usize,
    /// What it is doing.
    pub state: BodyState,
}

/// What a body is doing.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum BodyState {
    /// It moves.
    #[default]
    Awake,
    /// It came to rest and is not stepped.
    Asleep,
    /// It diverged and is paused; the reason.
    Quarantined(String),
}

/// An effect, whether anything carries it or not.
#[derive(Debug, Clone)]
pub struct EffectModel {
    /// Its name in scene files.
    pub name: &'static str,
    /// Its name for people.
    pub title: &'static str,
    /// What it does, in a sentence.
    pub summary: &'static str,
    /// How many bodies of the scene carry it; at 0 it has no system in the schedule.
    pub carriers: usize,
    /// How many bodies of the scope carry it.
    pub carriers_shown: usize,
    /// How many constraints it solves in the scene.
    pub elements: usize,
    /// Its share of the time of a tick, 0 to 1, where it is measured.
    pub share: Option<f32>,
    /// Whether the panel may put it on bodies and take it off.
    pub switchable: bool,
    /// Its parameters, as the bodies of the scope have them; empty if none carries it.
    pub parameters: Vec<Parameter>,
    /// What a user should know of it on the bodies of the scope, in a sentence.
    pub note: Option<&'static str>,
    /// The compliance that the solver delivers, where it can be told.
    pub delivered: Option<DeliveredModel>,
    /// The least and the greatest overpressure of the bodies of the scope that it fills [Pa].
    pub overpressure: Option<(f64, f64)>,
    /// What the contacts of all bodies do: contacts that push, and crossings of surfaces.
    pub contacts: Option<(usize, usize)>,
}

/// The compliance that the solver delivers, beside the one that was asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct DeliveredModel {
    /// What it delivers, in `unit`.
    pub got: f64,
    /// The unit of a compliance of the effect.
    pub unit: &'static str,
    /// How many times softer than asked; none where rigid was asked for.
    pub factor: Option<f64>,
    /// Whether the solver and not the material limits the stiffness.
    pub limited: bool,
    /// Substeps a tick that would do, if any number would.
    pub substeps: Option<u32>,
}

/// The energy ledger of the scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EnergyModel {
    /// Simulated time that it covers [s].
    pub seconds: f64,
    /// What bodies hold: what it is called, how much now, and by how much that has changed [J].
    pub held: Vec<(&'static str, f64, f64)>,
    /// What it came from and went to: what that is called, what it means, how much [J].
    pub rows: Vec<(&'static str, &'static str, f64)>,
    /// By how much all that is held has changed [J].
    pub change: f64,
    /// What the rows leave unaccounted for, over the largest term.
    pub gap: f64,
    /// Kinetic, potential and elastic energy over the last ticks.
    pub track: EnergyTrack,
}

/// The reference overlay, and how far bodies are from it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReferenceModel {
    /// Distances over the last ticks; none before it has begun.
    pub trail: Trail,
    /// How many bodies had one when it began, and how many could.
    pub bodies: (usize, usize),
    /// How many were given up because they were no longer finite.
    pub lost: usize,
    /// Its substeps a tick; none before it has begun.
    pub substeps: Option<u32>,
    /// The bodies' substeps a tick.
    pub of: u32,
    /// Length of a tick [s].
    pub tick: f64,
    /// Root mean square distance at which it began [m].
    pub outset: f64,
    /// Whether the bodies wait for it.
    pub holds: bool,
    /// Why there is none although one is wanted.
    pub trouble: Option<String>,
}

/// A stage of the tick beside the effects.
#[derive(Debug, Clone)]
pub struct StageModel {
    /// What it is called in a profile.
    pub name: &'static str,
    /// Its name for people.
    pub title: String,
    /// Its share of the time of a tick, 0 to 1.
    pub share: f32,
}

/// The point that the pointer holds or held last.
#[derive(Debug, Clone)]
pub struct GrabModel {
    /// Name of the body.
    pub body: String,
    /// Whether the particle is pinned.
    pub pinned: bool,
}

/// What can be added to the scene, as the menu shows it.
#[derive(Resource, Debug, Clone, Default, Deref)]
pub struct Additions(pub Vec<Addition>);

/// Something that can be added to the scene.
#[derive(Debug, Clone)]
pub struct Addition {
    /// What it is asked for by.
    pub name: String,
    /// What is shown.
    pub title: String,
    /// Whether a line is drawn above it, where another kind begins.
    pub begins_group: bool,
}
