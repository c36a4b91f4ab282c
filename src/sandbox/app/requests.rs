//! Carries out the requests of the panel and the keys.
//!
//! Changes of the simulation go through [`Actions`], so that they happen between ticks and can be
//! recorded; the clock, the view and the picker are changed directly.

use bevy::prelude::*;

use super::{bodies::bodies, colliders, export, film, focus, import, keep, pins, presets, time};
use crate::{
    effect::{EffectRegistry, ForceMask},
    sandbox::{
        input::drag::Drag,
        lab::{
            ablation::{AblationCommand, AblationState},
            accuracy::{Accuracy, AccuracyCommand},
            gallery::{Gallery, GalleryCommand},
            plots::PlotCommand,
            reference_overlay::ReferenceCommand,
        },
        panel::{SceneDefaults, SceneSettings, energy, gather::track, show_held},
        state::{
            browser::Browser,
            color::{ColorMode, ColorScale},
            display::DisplaySettings,
            first_steps::FirstSteps,
            hands::Hands,
            request::{Distortion, Request, RequestSystems, Requested},
            search::PanelSearch,
            selection::{Scope, Selection},
            spawn::{self, Spawn},
            view::{LastGrab, SelectedCollider, SolverView, ViewCommand, ViewSettings},
        },
        ui::message::{Notices, capitalised},
    },
    scene::Material,
    simulation::{Action, Actions, SimulationClock, SoftBody, SolverThreads},
    solver::{GroupName, Threads, deform::Deformation},
};

/// Height after a squash, as a fraction of the height before.
const SQUASHED: f32 = 0.1;

/// Number of shuffles so far; the seed of the next one.
#[derive(Resource, Debug, Default)]
struct Shuffles(u32);

/// Carries out requests.
pub struct RequestsPlugin;

impl Plugin for RequestsPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Shuffles>()
            .init_resource::<Browser>()
            .init_resource::<SelectedCollider>()
            .init_resource::<Hands>()
            .add_message::<Requested>()
            .add_systems(
                Update,
                (carry_out, report_refusals)
                    .chain()
                    .after(show_held)
                    .in_set(RequestSystems),
            );
    }
}

/// Carries out all requests of this frame.
fn carry_out(world: &mut World) {
    let requests: Vec<Requested> = world
        .resource_mut::<Messages<Requested>>()
        .drain()
        .collect();
    for Requested(request) in requests {
        carry_out_one(world, request);
    }
}

/// Reports why actions were rejected.
fn report_refusals(mut actions: ResMut<Actions>, mut notices: ResMut<Notices>) {
    for error in actions.bypass_change_detection().take_errors() {
        notices.error(capitalised(&error.to_string()));
    }
}

/// A card of the lab. All share the same place on screen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum LabCard {
    Accuracy,
    Ablation,
    Gallery,
}

/// Opens or closes a card, and closes the others.
fn toggle(world: &mut World, card: LabCard) {
    let closes = |other, is_open: Option<bool>| card == other || is_open == Some(true);
    if closes(
        LabCard::Accuracy,
        world.get_resource().map(Accuracy::is_open),
    ) {
        world.write_message(AccuracyCommand::Toggle);
    }
    if closes(
        LabCard::Ablation,
        world.get_resource().map(AblationState::is_open),
    ) {
        world.write_message(AblationCommand::Toggle);
    }
    if closes(LabCard::Gallery, world.get_resource().map(Gallery::is_open)) {
        world.write_message(GalleryCommand::Toggle);
    }
}

fn carry_out_one(world: &mut World, request: Request) {
    let scope = world.resource::<Selection>().0.clone();
    match request {
        Request::OpenScene(name) => command(world, ViewCommand::LoadScene(name)),
        Request::Browser => {
            let mut browser = world.resource_mut::<Browser>();
            browser.open = !browser.open;
        }
        Request::Search(text) => world.resource_mut::<PanelSearch>().text = text,
        Request::FocusSearch => {
            world.resource_mut::<ViewSettings>().panel_visible = true;
            let mut search = world.resource_mut::<PanelSearch>();
            (search.open, search.focus) = (true, true);
        }
        Request::CloseSearch => *world.resource_mut::<PanelSearch>() = PanelSearch::default(),
        Request::NextScene => command(world, ViewCommand::NextScene),
        Request::PreviousScene => command(world, ViewCommand::PreviousScene),
        Request::Restart => command(world, ViewCommand::Restart),
        Request::FrameAll => command(world, ViewCommand::FrameAll),
        Request::Frame(bodies) => focus::frame(world, &bodies),
        Request::FocusSelected => focus::selected(world),
        Request::Follow => focus::follow(world),
        Request::Screenshot => command(world, ViewCommand::Screenshot),
        Request::Keep(request) => keep::carry_out(world, request),
        Request::Film => film::toggle(world),
        Request::Accuracy => toggle(world, LabCard::Accuracy),
        Request::Ablation => toggle(world, LabCard::Ablation),
        Request::Gallery => toggle(world, LabCard::Gallery),
        Request::Ledger(on) => energy::keep(world, on),
        Request::ReferenceOverlay => {
            world.write_message(ReferenceCommand::Toggle);
        }
        Request::ReferenceAgain => {
            world.write_message(ReferenceCommand::Again);
        }
        Request::Pause(paused) => world.resource_mut::<SimulationClock>().paused = paused,
        Request::Step => time::step(world),
        Request::StepBack => time::step_back(world),
        Request::Scrub(seconds) => time::scrub(world, seconds),
        Request::Undo => {
            time::undo(world);
        }
        Request::Redo => {
            time::redo(world);
        }
        Request::Speed(speed) => {
            if (0.0..=100.0).contains(&speed) {
                world.resource_mut::<SimulationClock>().speed = speed;
            } else {
                let text = format!("Speed is {speed}, but must be between 0 and 100");
                world.resource_mut::<Notices>().error(text);
            }
        }
        Request::Setting { name, value } => setting(world, name, value),
        Request::Threads(count) => threads(world, count.unwrap_or(0.0)),
        Request::Parameter {
            effect,
            parameter,
            value,
        } => parameter_of(world, &scope, effect, parameter, |_, original| {
            value.or(original)
        }),
        Request::ForceGroup(group) => force_group(world, &scope, group),
        Request::Soften { scope, softer } => soften(world, &scope, softer),
        Request::Show(scope) => world.resource_mut::<Selection>().0 = scope,
        Request::Effect { effect, on } => switch(world, &scope, effect, on),
        Request::Material(name) => make_of(world, &scope, name),
        Request::Preset(name) => presets::apply(world, &scope, &name),
        Request::SavePreset(name) => presets::save(world, &scope, &name),
        Request::DeletePreset(name) => presets::delete(world, &name),
        Request::Duplicate => super::bodies::duplicate(world, &scope),
        Request::Hide(hidden) => super::bodies::hide(world, &scope, hidden),
        Request::Rename { key, name } => super::bodies::rename(world, key, &name),
        Request::Color(color) => super::bodies::color(world, &scope, color),
        Request::CopyParameters => super::bodies::copy(world, &scope),
        Request::PasteParameters => super::bodies::paste(world, &scope),
        Request::Distort(distortion) => distort(world, &scope, distortion),
        Request::SpawnBody(name) => world.resource_mut::<Spawn>().body = name,
        Request::SpawnSize(size) => spawn_size(world, size),
        Request::Spawn(place) => import::spawn(world, place),
        Request::AddCollider(kind) => colliders::add(world, kind),
        Request::SpawnOnClick(on) => world.resource_mut::<Spawn>().on_click = on,
        Request::Rain(on) => world.resource_mut::<Spawn>().rains = on,
        Request::Restore(key) => {
            if let Some(body) = Entity::try_from_bits(key) {
                push(world, Action::Restore { body });
            }
        }
        Request::Remove => remove(world, &scope),
        Request::Pin(pinned) => pins::pin_grabbed(world, pinned),
        Request::PinVertex {
            body,
            vertex,
            pinned,
        } => pins::pin(world, body, vertex, pinned),
        Request::UnpinAll => {
            let bodies = bodies(world, &scope);
            pins::unpin_all(world, bodies);
        }
        Request::Hands(change) => {
            let changed = world.resource_mut::<Hands>().change(change);
            if let Err(error) = changed {
                world.resource_mut::<Notices>().error(error);
            }
        }
        Request::Contacts(on) => world.resource_mut::<ViewSettings>().contacts = on,
        Request::Wireframe(on) => world.resource_mut::<ViewSettings>().wireframe = on,
        Request::Tetrahedra(on) => world.resource_mut::<ViewSettings>().tetrahedra = on,
        Request::Answers(on) => world.resource_mut::<ViewSettings>().answers = on,
        Request::SolverView(view) => world.resource_mut::<ViewSettings>().solver = view,
        Request::ColorMode(color) => {
            let mut view = world.resource_mut::<ViewSettings>();
            view.color = color;
            if color != ColorMode::Off {
                view.solver = SolverView::Off;
            }
            world.resource_mut::<ColorScale>().fixed = None;
        }
        Request::ColorRange(range) => color_range(world, range),
        Request::Plots => {
            world.write_message(PlotCommand::Toggle);
        }
        Request::ExportPlots => export::plots(world),
        Request::Help => world.resource_mut::<ViewSettings>().help_visible = true,
        Request::FirstSteps => world.resource_mut::<FirstSteps>().again(),
        Request::Display(change) => world.resource_mut::<DisplaySettings>().change(change),
    }
}

fn command(world: &mut World, command: ViewCommand) {
    world.write_message(command);
}

fn push(world: &mut World, action: Action) {
    world.resource_mut::<Actions>().push(action);
}

fn setting(world: &mut World, name: &'static str, value: Option<f64>) {
    let original = crate::simulation::setting(&world.resource::<SceneSettings>().0, name);
    if let Some(value) = value.or(original) {
        let name = name.to_owned();
        push(world, Action::SetSetting { name, value });
    }
}

/// Sets a parameter on the bodies of a scope that carry the effect. `choose` maps the current value
/// and the scene default of each body to the new value.
fn parameter_of(
    world: &mut World,
    scope: &Scope,
    effect: &'static str,
    parameter: &'static str,
    choose: impl Fn(f64, Option<f64>) -> Option<f64>,
) {
    for body in bodies(world, scope) {
        let registry = world.resource::<EffectRegistry>();
        let entity = world.entity(body);
        let value = registry
            .get(effect)
            .and_then(|info| (info.get)(&entity, info.parameter(parameter)?));
        let original = entity
            .get::<SceneDefaults>()
            .and_then(|scene_defaults| scene_defaults.get(effect, parameter));
        let chosen =
            value.and_then(|value| choose(value, original).filter(|chosen| *chosen != value));
        if let Some(value) = chosen {
            push(
                world,
                Action::SetParameter {
                    body,
                    effect: effect.to_owned(),
                    parameter: parameter.to_owned(),
                    value,
                },
            );
        }
    }
}

/// Chooses the group of the force masks of the bodies of a scope that have it.
fn force_group(world: &mut World, scope: &Scope, group: GroupName) {
    for body in bodies(world, scope) {
        let entity = world.entity(body);
        let mask = entity.get::<ForceMask>();
        let has = |topology: &SoftBody| group.is_empty() || topology.groups.contains(group);
        let fits = entity.get::<SoftBody>().is_some_and(has);
        if fits && mask.is_some_and(|mask| mask.group != group) {
            push(world, Action::SetForceGroup { body, group });
        }
    }
}

/// Sets the number of solver threads, from the next tick on. Not an [`Action`], as it does not
/// change the results.
fn threads(world: &mut World, count: f64) {
    let threads = if count >= 0.0 && count.fract() == 0.0 {
        Threads::new(count as usize).map_err(|error| error.to_string())
    } else {
        Err(format!(
            "threads is {count}, but must be a whole number, or 0 for one per core"
        ))
    };
    match threads {
        Ok(threads) => world.insert_resource(SolverThreads(threads)),
        Err(error) => world.resource_mut::<Notices>().error(capitalised(&error)),
    }
}

fn color_range(world: &mut World, range: Option<(f32, f32)>) {
    let is_valid = |&(low, high): &(f32, f32)| low.is_finite() && high.is_finite() && low < high;
    if range.as_ref().is_none_or(is_valid) {
        world.resource_mut::<ColorScale>().fixed = range;
    } else {
        let text = "The color range is unchanged: its start must be below its end";
        world.resource_mut::<Notices>().warn(text);
    }
}

fn spawn_size(world: &mut World, size: f64) {
    let size = size as f32;
    if spawn::SIZES.contains(&size) {
        world.resource_mut::<Spawn>().size = size;
    } else {
        let (min, max) = spawn::SIZES.into_inner();
        let text = format!("Size is {size} m, but must be between {min} and {max} m");
        world.resource_mut::<Notices>().error(text);
    }
}

fn soften(world: &mut World, scope: &Scope, softer: bool) {
    let (effect, parameter) = ("stretch", "compliance");
    let track = world
        .resource::<EffectRegistry>()
        .get(effect)
        .and_then(|info| Some(track(info.parameters.get(info.parameter(parameter)?)?)));
    if let Some(track) = track {
        parameter_of(world, scope, effect, parameter, |value, _| {
            Some(track.step(value, softer))
        });
    }
}

fn switch(world: &mut World, scope: &Scope, effect: &'static str, on: bool) {
    let Some(present) = world
        .resource::<EffectRegistry>()
        .get(effect)
        .map(|info| info.present)
    else {
        return;
    };
    for body in bodies(world, scope) {
        if present(&world.entity(body)) == on {
            continue;
        }
        let effect = effect.to_owned();
        let action = if on {
            Action::AddEffect { body, effect }
        } else {
            Action::RemoveEffect { body, effect }
        };
        push(world, action);
    }
}

fn make_of(world: &mut World, scope: &Scope, name: &str) {
    let Some(material) = Material::find(name) else {
        return;
    };
    let title = format!("Material {}", material.name);
    world.resource_mut::<time::History>().label(title);
    for body in bodies(world, scope) {
        let topology = world.get::<SoftBody>(body);
        if !topology.is_some_and(|topology| material.fits(topology.dimension)) {
            continue;
        }
        match material.actions(body) {
            Ok(actions) => actions.into_iter().for_each(|action| push(world, action)),
            Err(error) => {
                let error = capitalised(&error.to_string());
                world.resource_mut::<Notices>().error(error);
            }
        }
    }
}

fn distort(world: &mut World, scope: &Scope, distortion: Distortion) {
    for body in bodies(world, scope) {
        let deformation = match distortion {
            Distortion::RestShape => {
                push(world, Action::ResetShape { body });
                continue;
            }
            Distortion::Squash => Deformation::Squash(SQUASHED),
            Distortion::Shuffle => {
                let mut shuffles = world.resource_mut::<Shuffles>();
                shuffles.0 += 1;
                Deformation::Shuffle(shuffles.0)
            }
            Distortion::Mirror => Deformation::Mirror,
        };
        push(world, Action::Deform { body, deformation });
    }
}

fn remove(world: &mut World, scope: &Scope) {
    if colliders::remove_selected(world) {
        return;
    }
    let grabbed = world.resource::<LastGrab>().0.map(|grab| grab.body);
    // A body that was grabbed is selected, unless others were chosen in the panel since.
    let grabbed = grabbed.filter(|body| scope.contains(*body));
    let several = scope.keys().count() > 1;
    let bodies: Vec<Entity> = match grabbed.filter(|_| !several) {
        Some(body) => vec![body],
        None => scope.keys().filter_map(Entity::try_from_bits).collect(),
    };
    if bodies.is_empty() {
        let text =
            "Nothing to delete: grab a body, select one in the panel, or click a collider first";
        world.resource_mut::<Notices>().info(text);
    }
    for body in bodies {
        // Releases the grab before the body is removed.
        if let Some(mut drag) = world.get_resource_mut::<Drag>() {
            drag.held = drag.held.filter(|held| held.body != body);
        }
        push(world, Action::Despawn { body });
    }
}
