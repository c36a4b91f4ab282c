//! How each action is undone: by setting the previous value while time goes on, by restoring the
//! whole state from before, or not by itself, as it is a part of another one.

use crate::{
    effect::{Effect, EffectRegistry, ForceMask},
    sandbox::panel::gather,
    simulation::{
        Action, BodyDensity, SimulationClock, SimulationSettings, SpawnOrder,
        plain::bodies_in_order, setting,
    },
    solver::{Collider, Path, deform::Deformation},
};
use bevy::prelude::*;

/// How an action is undone.
#[derive(Debug, Clone, PartialEq)]
pub enum Undoing {
    /// By these actions, in order, which set the previous values; time goes on.
    Values(Vec<Action<SpawnOrder>>),
    /// By restoring the whole state from before.
    State,
    /// With the action that it follows.
    Part,
}

/// Whether an effect is one of an app that is saved.
fn is_own(world: &World, effect: &str) -> bool {
    let registry = world.get_resource::<EffectRegistry>();
    registry.is_some_and(|registry| registry.own().names().any(|name| name == effect))
}

/// How an action is undone, and its title, such as “Stretch compliance”.
#[must_use]
pub fn undoing(world: &World, action: &Action) -> (Undoing, String) {
    match action {
        // Its component may have more than its parameters.
        Action::RemoveEffect { effect, .. } if is_own(world, effect) => {
            (Undoing::State, title(world, action))
        }
        Action::SetParameter { .. }
        | Action::SetForceGroup { .. }
        | Action::AddEffect { .. }
        | Action::RemoveEffect { .. }
        | Action::SetDensity { .. }
        | Action::SetSetting { .. } => {
            let values = inverse(world, action);
            (Undoing::Values(values), title(world, action))
        }
        Action::SetCollider { collider, .. } if moves(world, *collider) => {
            (Undoing::Part, String::new())
        }
        Action::Grab { .. }
        | Action::Brush { .. }
        | Action::GrabPins { .. }
        | Action::AddCollider { .. }
        | Action::SetCollider { .. }
        | Action::RemoveCollider { .. }
        | Action::Pin { .. }
        | Action::Unpin { .. }
        | Action::Control { .. }
        | Action::Cut { .. }
        | Action::Deform { .. }
        | Action::ResetShape { .. }
        | Action::Restore { .. }
        | Action::Spawn(_)
        | Action::Despawn { .. } => (Undoing::State, title(world, action)),
        Action::MoveGrab { .. } | Action::MovePins { .. } | Action::Release { .. } => {
            (Undoing::Part, String::new())
        }
    }
}

/// Simulated time after which a collider that was dragged is dragged anew [s].
const PAUSE: f64 = 0.25;

/// Whether a collider is being dragged.
fn moves(world: &World, collider: Entity) -> bool {
    let now = world.resource::<SimulationClock>().time();
    let found = world.get::<Collider>(collider).map(|it| &it.path);
    matches!(found, Some(Path::Glide { end, .. }) if now < end + PAUSE)
}

/// Actions that set the values back that an action sets; none for other actions.
#[must_use]
pub fn inverse(world: &World, action: &Action) -> Vec<Action<SpawnOrder>> {
    let found = match action {
        Action::SetSetting { name, .. } => {
            let settings = &world.resource::<SimulationSettings>().0;
            setting(settings, name).map(|value| {
                let name = name.clone();
                vec![Action::SetSetting { name, value }]
            })
        }
        Action::SetDensity { body, .. } => order(world, *body).and_then(|body_order| {
            let density = world.get::<BodyDensity>(*body)?.0;
            let body = body_order;
            Some(vec![Action::SetDensity { body, density }])
        }),
        Action::SetParameter {
            body,
            effect,
            parameter,
            ..
        } => value(world, *body, effect, parameter).map(|action| vec![action]),
        Action::SetForceGroup { body, .. } => group(world, *body).map(|action| vec![action]),
        Action::AddEffect { body, effect } if !carries(world, *body, effect) => order(world, *body)
            .map(|body| {
                let effect = effect.clone();
                vec![Action::RemoveEffect { body, effect }]
            }),
        Action::RemoveEffect { body, effect } if carries(world, *body, effect) => {
            with_parameters(world, *body, effect)
        }
        _ => None,
    };
    found.unwrap_or_default()
}

/// The action on the body with the spawn order; `None` if it does not exist.
#[must_use]
pub fn resolve(world: &mut World, action: Action<SpawnOrder>) -> Option<Action> {
    let bodies = bodies_in_order(world);
    action.renamed(|order| {
        let is_it = |body: &Entity| world.get::<SpawnOrder>(*body) == Some(&order);
        bodies.into_iter().find(is_it)
    })
}

/// Whether two actions set the same value.
#[must_use]
pub fn same_target(one: &Action<SpawnOrder>, other: &Action<SpawnOrder>) -> bool {
    match (one, other) {
        (Action::SetSetting { name: a, .. }, Action::SetSetting { name: b, .. }) => a == b,
        (Action::SetDensity { body: a, .. }, Action::SetDensity { body: b, .. }) => a == b,
        (
            Action::SetParameter {
                body,
                effect,
                parameter,
                ..
            },
            Action::SetParameter {
                body: other_body,
                effect: other_effect,
                parameter: other_parameter,
                ..
            },
        ) => (body, effect, parameter) == (other_body, other_effect, other_parameter),
        (Action::SetForceGroup { body: a, .. }, Action::SetForceGroup { body: b, .. }) => a == b,
        _ => false,
    }
}

fn order(world: &World, body: Entity) -> Option<SpawnOrder> {
    world.get_entity(body).ok()?.get::<SpawnOrder>().copied()
}

fn carries(world: &World, body: Entity, effect: &str) -> bool {
    let info = world.resource::<EffectRegistry>().get(effect);
    let entity = world.get_entity(body);
    info.zip(entity.ok())
        .is_some_and(|(info, entity)| (info.present)(&entity))
}

/// The action that sets the current value of a parameter.
fn value(world: &World, body: Entity, effect: &str, parameter: &str) -> Option<Action<SpawnOrder>> {
    let info = world.resource::<EffectRegistry>().get(effect)?;
    let entity = world.get_entity(body).ok()?;
    Some(Action::SetParameter {
        value: (info.get)(&entity, info.parameter(parameter)?)?,
        body: order(world, body)?,
        effect: effect.to_owned(),
        parameter: parameter.to_owned(),
    })
}

/// The action that chooses the current group of the force mask.
fn group(world: &World, body: Entity) -> Option<Action<SpawnOrder>> {
    let mask = world.get_entity(body).ok()?.get::<ForceMask>()?;
    Some(Action::SetForceGroup {
        body: order(world, body)?,
        group: mask.group,
    })
}

/// Actions that add an effect again with all its current parameters.
fn with_parameters(world: &World, body: Entity, effect: &str) -> Option<Vec<Action<SpawnOrder>>> {
    let info = world.resource::<EffectRegistry>().get(effect)?;
    let add = Action::AddEffect {
        body: order(world, body)?,
        effect: effect.to_owned(),
    };
    let names = info.parameters.iter().map(|parameter| parameter.name);
    let set = names.filter_map(|parameter| value(world, body, effect, parameter));
    let group = (effect == ForceMask::NAME).then(|| group(world, body));
    Some(
        [add]
            .into_iter()
            .chain(set)
            .chain(group.flatten())
            .collect(),
    )
}

/// Title of an action.
fn title(world: &World, action: &Action) -> String {
    let info = |effect: &str| world.resource::<EffectRegistry>().get(effect);
    let effect_title = |effect: &str| info(effect).map_or(effect.to_owned(), |it| it.title.into());
    let name = |body: &Entity| {
        let entity = world.get_entity(*body).ok();
        let name = entity.and_then(|entity| entity.get::<Name>());
        name.map_or_else(|| "body".to_owned(), Name::to_string)
    };
    match action {
        Action::SetParameter {
            effect, parameter, ..
        } => {
            let found = info(effect).and_then(|it| it.parameters.get(it.parameter(parameter)?));
            let parameter = found.map_or(parameter.as_str(), |it| it.title);
            format!("{} {}", effect_title(effect), within(parameter))
        }
        Action::SetForceGroup { .. } => format!("{} group", ForceMask::TITLE),
        Action::SetSetting { name, .. } => gather::setting_title(name).unwrap_or(name).to_owned(),
        Action::AddEffect { effect, .. } => format!("Add {}", within(&effect_title(effect))),
        Action::RemoveEffect { effect, .. } => format!("Remove {}", within(&effect_title(effect))),
        Action::SetDensity { .. } => "Density".to_owned(),
        Action::Grab { body, .. } | Action::Brush { body, .. } => format!("Drag {}", name(body)),
        Action::GrabPins { .. } => "Drag pins".to_owned(),
        Action::MoveGrab { .. } | Action::MovePins { .. } | Action::Release { .. } => {
            "Drag".to_owned()
        }
        Action::AddCollider { .. } => "Add collider".to_owned(),
        Action::SetCollider { .. } => "Move collider".to_owned(),
        Action::RemoveCollider { .. } => "Delete collider".to_owned(),
        Action::Pin { .. } => "Pin".to_owned(),
        Action::Unpin { .. } => "Unpin".to_owned(),
        Action::Control { body, .. } => format!("Control {}", name(body)),
        Action::Cut { .. } => "Cut".to_owned(),
        Action::Deform { deformation, .. } => match deformation {
            Deformation::Squash(_) => "Squash",
            Deformation::Shuffle(_) => "Scramble",
            Deformation::Mirror => "Invert",
            _ => "Deform",
        }
        .to_owned(),
        Action::ResetShape { .. } => "Reset shape".to_owned(),
        Action::Restore { body } => format!("Restore {}", name(body)),
        Action::Spawn(new) => format!("Add {}", new.body.name),
        Action::Despawn { body } => format!("Delete {}", name(body)),
    }
}

/// A title within a sentence: in lower case, unless its first word is a name.
fn within(title: &str) -> String {
    let first = title.split(' ').next().unwrap_or_default();
    let is_name = first.contains(['\'', '’', '-']) || first.chars().skip(1).any(char::is_uppercase);
    let mut letters = title.chars();
    match letters.next() {
        Some(letter) if !is_name => letter.to_lowercase().chain(letters).collect(),
        _ => title.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn titles_within_a_sentence_keep_names() {
        assert_eq!(within("Compliance"), "compliance");
        assert_eq!(within("Young's modulus"), "Young's modulus");
        assert_eq!(within("Neo-Hookean"), "Neo-Hookean");
        assert_eq!(within("BDF2 order"), "BDF2 order");
    }
}
