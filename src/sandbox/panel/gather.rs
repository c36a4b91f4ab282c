//! Builds the panel's model from the ECS, every frame.

use super::model::Additions;
use crate::sandbox::state::{selection::Selection, spawn::Spawn};
use bevy::prelude::*;

use super::{
    effective, energy,
    fractions::Fractions,
    history::{self, History},
    hud::HeadUp,
    model::{
        BodyEntry, BodyState, ClockModel, ContactModel, Done, EffectModel, FileModel, GrabModel,
        GroupModel, PanelModel, Parameter, StageModel, StoredEnergy,
    },
    reference_overlay,
    scene_defaults::{SceneDefaults, SceneSettings},
};
use crate::{
    effect::{
        BodyEmitter, Contact, Effect, EffectInfo, EffectRegistry, Emitter, ForceMask,
        ParameterInfo, Pressure, Scale, SelfContact, Tear,
    },
    sandbox::{
        lab::{plots::Plots, quarantine, throughput::Throughput},
        render::{material::SkinMaterial, quality::EffectiveQuality},
        state::{
            display::DisplaySettings,
            hands::Hands,
            keep::{RecentFiles, RecordingStatus},
            look::HiddenBody,
            presets::{Preset, Presets},
            search::PanelSearch,
            time::TimeView,
            view::{LastGrab, ViewSettings},
        },
        ui::{
            scale::InterfaceScale,
            track::{Spread, Track},
        },
    },
    scene::{Answer, CurrentScene, Material},
    simulation::{
        Asleep, BodyDensity, Pins, Profile, Quarantined, SETTINGS, SimulationClock,
        SimulationSettings, SoftBody, SolverThreads, Statistics, carried, plain::bodies_in_order,
        setting, system_names,
    },
    solver::{EffectStates, Particles, Settings, available, measure},
};

/// The model of the current state.
pub(super) fn model(world: &mut World) -> PanelModel {
    let bodies = bodies_in_order(world);
    let ticked = history::gather(world);
    let scope = world.resource::<Selection>().0.clone();
    let shown: Vec<Entity> = bodies
        .iter()
        .copied()
        .filter(|body| scope.contains(*body))
        .collect();
    if ticked {
        push_fractions(world);
        effective::gather(world, &shown);
        energy::gather(world);
    }
    let fractions = world.resource::<Fractions>();
    let registry = world.resource::<EffectRegistry>();
    let statistics = world.resource::<Statistics>();
    let effects = registry
        .iter()
        .map(|info| EffectModel {
            fraction: fractions.of(info.name),
            effective: effective::model(world, info.name, &shown),
            overpressure: overpressure(world, info.name, &shown),
            done: done(world, info.name, &shown),
            contacts: contacts(statistics, info.name),
            group: group(world, info.name, &shown),
            ..effect(world, info, &bodies, &shown)
        })
        .collect();
    let stages = fractions
        .parts()
        .filter(|name| registry.get(name).is_none())
        .filter_map(|name| {
            Some(StageModel {
                name,
                title: stage_title(name),
                fraction: fractions.of(name)?,
            })
        })
        .collect();
    let clock = world.resource::<SimulationClock>();
    let view = world.resource::<ViewSettings>();
    let scene = world.get_resource::<CurrentScene>();
    let text = |field: fn(&CurrentScene) -> &String| scene.map(field).cloned().unwrap_or_default();
    PanelModel {
        scene: text(|scene| &scene.name),
        scene_title: text(|scene| &scene.scene.title),
        scene_note: text(|scene| &scene.scene.look_at),
        file: file(world, scene),
        search: world.resource::<PanelSearch>().clone(),
        clock: ClockModel {
            paused: clock.paused,
            speed: clock.speed,
            time: clock.time(),
        },
        undo: world.resource::<TimeView>().undo.clone(),
        redo: world.resource::<TimeView>().redo.clone(),
        settings: settings(world),
        threads: threads(world),
        ms_per_tick: world
            .get_resource::<HeadUp>()
            .map_or(statistics.ms_per_tick, HeadUp::ms_per_tick),
        projections: world.resource::<Throughput>().per_second(),
        steps: system_names(world),
        bodies: bodies.iter().map(|body| entry(world, *body)).collect(),
        scope,
        effects,
        stages,
        history: world.resource::<History>().clone(),
        energy: energy::model(world),
        stored: StoredEnergy::from(world.resource::<Statistics>()),
        grabbed: grabbed(world),
        is_pinned: shown.iter().any(|body| {
            world
                .get::<Pins>(*body)
                .is_some_and(|pins| !pins.is_empty())
        }),
        additions: world.resource::<Additions>().0.clone(),
        spawn: world.resource::<Spawn>().clone(),
        hands: *world.resource::<Hands>(),
        materials: materials(world, &shown),
        material: material(world, &shown),
        presets: presets(world, &shown),
        wireframe: view.wireframe,
        contacts: view.contacts,
        tetrahedra: view.tetrahedra,
        answers: (scene.map(answers).unwrap_or_default(), view.answers),
        solver: view.solver,
        color: view.color,
        plots: world.get_resource().is_some_and(Plots::is_open),
        reference_overlay: reference_overlay::model(world),
        display: *world.resource::<DisplaySettings>(),
        automatic_scale: world.resource::<InterfaceScale>().automatic,
        quality: *world.resource::<EffectiveQuality>(),
    }
}

/// The File menu.
fn file(world: &World, scene: Option<&CurrentScene>) -> FileModel {
    let path = scene.and_then(|scene| scene.path.as_ref());
    let own = path.filter(|path| path.extension().is_some_and(|ending| ending == "ron"));
    FileModel {
        recent: world.resource::<RecentFiles>().files().to_vec(),
        scene_file: own.map(|path| path.display().to_string()),
        records: world.resource::<RecordingStatus>().file.is_some(),
        films: world.resource::<ViewSettings>().films,
    }
}

/// Materials that can be applied to at least one of the bodies.
fn materials(world: &World, bodies: &[Entity]) -> Vec<&'static Material> {
    let can_be = |body: &Entity, material: &Material| {
        let topology = world.get::<SoftBody>(*body);
        topology.is_some_and(|topology| material.fits(topology.dimension))
    };
    let all = Material::all().iter();
    all.filter(|material| bodies.iter().any(|body| can_be(body, material)))
        .collect()
}

/// Presets of the user that can be applied to at least one of the bodies.
fn presets(world: &World, bodies: &[Entity]) -> Vec<(String, String)> {
    let can_be = |preset: &&Preset| {
        bodies.iter().any(|body| {
            let topology = world.get::<SoftBody>(*body);
            topology.is_some_and(|topology| topology.dimension == preset.dimension)
        })
    };
    let fitting = world.resource::<Presets>().iter().filter(can_be);
    fitting
        .map(|preset| {
            let text = preset.parameters.to_text();
            (preset.name.clone(), text.unwrap_or_default())
        })
        .collect()
}

/// The material that all of the bodies are made of.
fn material(world: &World, bodies: &[Entity]) -> Option<&'static Material> {
    let made_of = |body: &Entity| {
        let body = world.entity(*body);
        let effects = carried::effects(body);
        let density = body.get::<BodyDensity>()?.0;
        Material::all()
            .iter()
            .find(|material| material.describes(density, &effects))
    };
    let mut found = bodies.iter().map(made_of);
    let first = found.next()??;
    found.all(|other| other == Some(first)).then_some(first)
}

/// Names of the analytic solutions of a scene, without duplicates.
fn answers(scene: &CurrentScene) -> String {
    let mut names: Vec<_> = scene.scene.answers.iter().map(Answer::name).collect();
    names.dedup();
    names.join(", ")
}

/// The slider track of a parameter.
pub(in crate::sandbox) fn track(info: &ParameterInfo) -> Track {
    let range = info.range.0..=info.range.1;
    match info.scale {
        Scale::Linear => Track::new(range, Spread::Linear),
        Scale::Logarithmic => Track::new(range, Spread::Logarithmic),
        Scale::LogarithmicFromZero => Track::new(range, Spread::Logarithmic).with_zero(true),
        Scale::LogarithmicToInfinity => Track::new(range, Spread::Logarithmic).with_infinity(true),
    }
}

fn entry(world: &World, body: Entity) -> BodyEntry {
    let entity = world.entity(body);
    let state = match entity.get::<Quarantined>() {
        Some(quarantine) => BodyState::Quarantined(quarantine::reason(quarantine)),
        None if entity.contains::<Asleep>() => BodyState::Asleep,
        None => BodyState::Awake,
    };
    BodyEntry {
        key: body.to_bits(),
        name: entity
            .get::<Name>()
            .map_or_else(|| body.to_string(), |name| name.to_string()),
        particles: entity.get::<SoftBody>().map_or(0, |body| body.particles()),
        inverted: inverted(world, entity),
        state,
        hidden: entity.contains::<HiddenBody>(),
        color: color(world, &entity),
    }
}

/// Number of inverted elements of a body, which are counted only if there are any.
fn inverted(world: &World, body: EntityRef) -> usize {
    let are_there = world.resource::<Statistics>().inverted > 0;
    let parts = body.get::<SoftBody>().zip(body.get::<Particles>());
    parts.filter(|_| are_there).map_or(0, |(body, particles)| {
        measure::inverted(body, &particles.positions)
    })
}

/// The note of an effect on several bodies: that of the first one, and whether others differ.
fn note_of(mut notes: impl Iterator<Item = String>) -> Option<String> {
    let first = notes.next()?;
    Some(match notes.any(|other| other != first) {
        true => format!("{first} Other bodies differ."),
        false => first,
    })
}

/// The drawn color of a body, sRGB; black before it is first drawn.
fn color(world: &World, body: &EntityRef) -> [u8; 3] {
    let materials = world.get_resource::<Assets<SkinMaterial>>();
    let skin = body.get::<MeshMaterial3d<SkinMaterial>>();
    let finish = materials.and_then(|all| Some(all.get(skin?)?.finish));
    let color = finish.map_or(Vec3::ZERO, |finish| finish.color);
    let [red, green, blue, _] = Color::linear_rgb(color.x, color.y, color.z)
        .to_srgba()
        .to_u8_array();
    [red, green, blue]
}

fn effect(world: &World, info: &EffectInfo, bodies: &[Entity], shown: &[Entity]) -> EffectModel {
    let carries = |body: &&Entity| (info.present)(&world.entity(**body));
    let carriers: Vec<Entity> = shown.iter().filter(carries).copied().collect();
    let parameters = info
        .parameters
        .iter()
        .enumerate()
        .filter_map(|(index, parameter)| {
            let values = carriers.iter().filter_map(|body| {
                let body = world.entity(*body);
                let value = (info.get)(&body, index)?;
                let original = body.get::<SceneDefaults>()?.get(info.name, parameter.name);
                Some((value, original))
            });
            let row = parameter_of(parameter, values)?;
            let matters = |body: &Entity| (info.matters)(parameter.name, &world.entity(*body));
            let is_default = row.spread.is_none() && parameter.default == Some(row.value);
            (!is_default || carriers.iter().any(matters)).then_some(row)
        })
        .collect();
    let settings = world.resource::<SimulationSettings>();
    EffectModel {
        name: info.name,
        title: info.title,
        summary: info.summary,
        words: words_of(info),
        carriers: bodies.iter().filter(carries).count(),
        carriers_shown: carriers.len(),
        elements: carriers
            .iter()
            .filter_map(|body| (info.elements)(&world.entity(*body)))
            .sum(),
        fraction: None,
        group: None,
        note: note_of(
            carriers
                .iter()
                .filter_map(|body| (info.note)(&world.entity(*body), settings)),
        ),
        effective: None,
        overpressure: None,
        done: None,
        contacts: None,
        switchable: info.insert_default.is_some(),
        parameters,
    }
}

fn words_of(info: &EffectInfo) -> String {
    let words = info.parameters.iter().flat_map(|it| [it.name, it.title]);
    words.collect::<Vec<_>>().join(" ")
}

fn contacts(statistics: &Statistics, effect: &str) -> Option<ContactModel> {
    let is_contact = [Contact::NAME, SelfContact::NAME].contains(&effect);
    let (acting, crossings) = statistics
        .contacts
        .zip(statistics.crossings)
        .filter(|_| is_contact)?;
    Some(ContactModel {
        acting,
        smallest_gap: statistics.smallest_gap,
        crossings,
    })
}

/// Minimum and maximum overpressure [Pa] of the selected bodies after the last substep.
fn overpressure(world: &World, effect: &str, shown: &[Entity]) -> Option<(f64, f64)> {
    if effect != Pressure::NAME {
        return None;
    }
    let h = world.resource::<SimulationSettings>().substep_seconds();
    let all = shown.iter().filter_map(|body| {
        let body = world.entity(*body);
        body.get::<Pressure>()?;
        body.get::<EffectStates>()?.others.pressure.overpressure(h)
    });
    all.map(|pressure| (pressure, pressure))
        .reduce(|(low, high), (one, _)| (low.min(one), high.max(one)))
}

/// The groups of the selected bodies that carry a force mask; `None` if they have none.
fn group(world: &World, effect: &str, shown: &[Entity]) -> Option<GroupModel> {
    if effect != ForceMask::NAME {
        return None;
    }
    let (mut names, mut chosen) = (Vec::new(), Vec::new());
    for body in shown {
        let body = world.entity(*body);
        let Some((mask, topology)) = body.get::<ForceMask>().zip(body.get::<SoftBody>()) else {
            continue;
        };
        chosen.push(mask.group);
        for name in topology.groups.names() {
            if !names.contains(name) {
                names.push(*name);
            }
        }
    }
    let first = chosen.first().copied();
    // Also a group that no body has can be replaced by the whole body.
    let any = !names.is_empty() || chosen.iter().any(|group| !group.is_empty());
    any.then(|| GroupModel {
        names,
        chosen: first.filter(|first| chosen.iter().all(|it| it == first)),
    })
}

/// What the effect has done to the selected bodies that carry it.
fn done(world: &World, effect: &str, shown: &[Entity]) -> Option<Done> {
    let bodies = shown.iter().map(|body| world.entity(*body));
    match effect {
        Emitter::NAME | BodyEmitter::NAME => {
            let emits = |body: &EntityRef| match effect {
                Emitter::NAME => body.contains::<Emitter>(),
                _ => body.contains::<BodyEmitter>(),
            };
            let own = bodies.filter(emits);
            let each = own.filter_map(|body| {
                let emission = &body.get::<Particles>()?.emission;
                let flow = match effect {
                    Emitter::NAME => emission.grains,
                    _ => emission.copies,
                };
                Some((flow.emitted(), flow.waiting()))
            });
            let sum = each.reduce(|all, one| (all.0 + one.0, all.1 + one.1));
            sum.map(|(emitted, waiting)| Done::Emitted { emitted, waiting })
        }
        Tear::NAME => {
            let own = bodies.filter(EntityRef::contains::<Tear>);
            let each = own.filter_map(|body| Some(body.get::<SoftBody>()?.splits()));
            each.reduce(|all, one| all + one).map(Done::Split)
        }
        _ => None,
    }
}

/// The row of a parameter, from the value and scene default of each body.
fn parameter_of(
    info: &ParameterInfo,
    values: impl Iterator<Item = (f64, Option<f64>)>,
) -> Option<Parameter> {
    let values: Vec<_> = values.collect();
    let &(value, original) = values.first()?;
    let (low, high) = values.iter().fold((value, value), |(low, high), (v, _)| {
        (low.min(*v), high.max(*v))
    });
    Some(Parameter {
        name: info.name,
        title: info.title,
        unit: info.unit,
        help: info.help,
        track: track(info),
        value,
        spread: (low < high).then_some((low, high)),
        original: original.filter(|_| values.iter().all(|(_, other)| *other == original)),
        choices: &[],
        changed: values
            .iter()
            .any(|(value, original)| original.is_some_and(|original| original != *value)),
        unusual: false,
    })
}

/// World settings in the order of their rows.
const ROWS: [&str; 10] = [
    "substeps",
    "iterations",
    "smoothing_iterations",
    "collision_iterations",
    "order",
    "keep_spin",
    "rate",
    "gravity_x",
    "gravity_y",
    "gravity_z",
];

fn settings(world: &World) -> Vec<Parameter> {
    let now = &world.resource::<SimulationSettings>().0;
    let scene = &world.resource::<SceneSettings>().0;
    let row = |name: &&'static str| {
        let (_, unit, _) = SETTINGS.iter().find(|(other, ..)| other == name)?;
        let (title, help, track) = words(name)?;
        let choices = choices(name);
        let value = setting(now, name)?;
        let original = setting(scene, name)?;
        Some(Parameter {
            name,
            title,
            unit,
            help,
            track,
            value,
            spread: None,
            original: Some(original),
            choices,
            changed: value != original,
            unusual: Some(value) != setting(&Settings::default(), name),
        })
    };
    ROWS.iter().filter_map(row).collect()
}

/// The row of the number of threads, if there is a choice.
fn threads(world: &World) -> Option<Parameter> {
    let cores = available();
    (cfg!(feature = "parallel") && cores > 1).then(|| Parameter {
        name: "threads",
        title: "Threads",
        unit: "",
        help: "Solver threads, at most one per core. The result is bit-identical for any number; \
               only the time of a tick changes.",
        track: Track::new(1.0..=cores as f64, Spread::Integer),
        value: world.resource::<SolverThreads>().count() as f64,
        spread: None,
        original: None,
        choices: &[],
        changed: false,
        unusual: false,
    })
}

/// Names of the values of a setting, from the smallest on; empty for a number.
fn choices(setting: &str) -> &'static [&'static str] {
    match setting {
        "order" => &["Euler", "BDF2"],
        "keep_spin" => &["Off", "On"],
        _ => &[],
    }
}

/// Title of a setting.
pub(in crate::sandbox) fn setting_title(setting: &str) -> Option<&'static str> {
    words(setting).map(|(title, ..)| title)
}

/// Title, description and slider track of a setting.
fn words(setting: &str) -> Option<(&'static str, &'static str, Track)> {
    let gravity = Track::new(-20.0..=20.0, Spread::Linear);
    Some(match setting {
        "substeps" => (
            "Substeps",
            "Substeps per tick. More substeps make stiff bodies more accurate; the cost is \
             proportional to their number.",
            Track::new(1.0..=100.0, Spread::Integer),
        ),
        "iterations" => (
            "Iterations",
            "Constraint iterations: passes over all constraints per substep. More iterations help \
             at large step sizes; for stiff bodies, more substeps are cheaper.",
            Track::new(1.0..=50.0, Spread::Integer),
        ),
        "order" => (
            "Integrator",
            "Implicit Euler damps oscillations numerically. BDF2 has much less numerical damping; \
             it takes several times as long, and restarts at contacts.",
            Track::new(1.0..=2.0, Spread::Integer),
        ),
        "keep_spin" => (
            "Keep angular momentum",
            "Internal forces do not rotate a body without pins. Off, rotation decays by a fraction \
             2πhω per revolution, and balls on level ground roll away.",
            Track::new(0.0..=1.0, Spread::Integer),
        ),
        "smoothing_iterations" => (
            "Smoothing",
            "Smoothing iterations: averaged (Jacobi) passes after the constraint iterations of a \
             substep. They distribute the error of conflicting constraints evenly.",
            Track::new(0.0..=50.0, Spread::Integer),
        ),
        "collision_iterations" => (
            "Collision passes",
            "Passes over ground and colliders per substep, distributed evenly over the iterations. \
             0: automatic, one after each iteration. Fewer passes are cheaper; more passes resolve \
             bodies squeezed between two colliders.",
            Track::new(0.0..=50.0, Spread::Integer),
        ),
        "rate" => (
            "Tick rate",
            "Ticks per second of simulated time.",
            Track::new(10.0..=240.0, Spread::Integer),
        ),
        "gravity_x" => ("Gravity x", "Gravity along x (right).", gravity),
        "gravity_y" => ("Gravity y", "Gravity along y (up). Earth: -9.81.", gravity),
        "gravity_z" => (
            "Gravity z",
            "Gravity along z (towards the viewer).",
            gravity,
        ),
        _ => return None,
    })
}

fn grabbed(world: &World) -> Option<GrabModel> {
    let grab = world.resource::<LastGrab>().0?;
    let body = world.get_entity(grab.body).ok()?;
    Some(GrabModel {
        body: body.get::<Name>()?.to_string(),
        pinned: body.get::<Pins>()?.contains(&grab.vertex),
    })
}

/// Adds the tick that has just ended.
fn push_fractions(world: &mut World) {
    let profile = world.resource::<Profile>();
    let (parts, tick) = (profile.parts().to_vec(), profile.tick());
    let by_part = profile.by_part;
    let mut fractions = world.resource_mut::<Fractions>();
    if by_part && !parts.is_empty() {
        fractions.push(&parts, tick);
    } else {
        fractions.clear();
    }
}

fn stage_title(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().chain(letters).collect()
    })
}
