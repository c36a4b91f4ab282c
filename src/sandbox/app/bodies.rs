//! Operations on the selected bodies: duplicate, hide, rename, color, copy and paste of parameters.
//!
//! What changes the simulation goes through [`Actions`]; names and colors are not part of it, and
//! are kept in snapshots.

use crate::{
    effect::{EffectRegistry, ForceMask, OwnEffects},
    sandbox::{
        render::{camera::OrbitCamera, free_area::FreeArea},
        state::{
            look::HiddenBody,
            selection::{Scope, Selection},
            view::ViewSettings,
        },
        ui::message::{Notices, capitalised},
    },
    scene::{BodyParameters, Look, SceneEffects},
    simulation::{
        Action, Actions, BodyDensity, BodySkin, NewBody, SoftBody, carried, end_tick,
        plain::{self, bodies_in_order},
    },
    solver::{Body, GroupName, Particles, StitchEnd, Stitches, topology::bounds},
};
use bevy::{math::bounding::Aabb3d, prelude::*, window::PrimaryWindow};
use bevy_egui::EguiClipboard;
use std::sync::Arc;

/// Gap between a body and its copy, as a fraction of the width of all copied bodies.
const GAP: f32 = 0.1;
/// Number of places beside the originals that are tried.
const PLACES: u32 = 12;

/// The bodies of a scope, in order.
pub fn bodies(world: &mut World, scope: &Scope) -> Vec<Entity> {
    let mut bodies = bodies_in_order(world);
    bodies.retain(|body| scope.contains(*body));
    bodies
}

/// Adds copies of the bodies of a scope beside them, in their current shape, and selects them.
pub fn duplicate(world: &mut World, scope: &Scope) {
    // Bodies are added between ticks: first ends a tick that is spread over frames.
    end_tick(world);
    let originals = bodies(world, scope);
    if originals.is_empty() {
        world
            .resource_mut::<Notices>()
            .info("Nothing to duplicate: the scene has no bodies");
        return;
    }
    let offset = offset(world, &originals);
    let mut copies = Vec::new();
    for original in originals {
        let entity = world.entity(original);
        let Some(body) = plain::body(entity) else {
            continue;
        };
        let skin = entity.get::<BodySkin>().map(|skin| Arc::clone(&skin.0));
        let own = own_effects(world).of_entity(&entity);
        let look = entity.get::<Look>().copied().unwrap_or_default();
        let name = free_name(world, &body.name);
        let body = copy_of(body, name, offset);
        let new = NewBody { body, skin, own };
        let mut actions = world.resource_mut::<Actions>();
        actions.push(Action::Spawn(Arc::new(new)));
        Actions::apply(world);
        if let Some(&copy) = bodies_in_order(world).last() {
            world.entity_mut(copy).insert(look);
            copies.push(copy);
        }
    }
    world.resource_mut::<Selection>().0 = Scope::of(copies.iter().map(|copy| copy.to_bits()));
    let text = match copies.as_slice() {
        [one] => format!("Added {}", name_of(world, *one)),
        _ => format!("Added {} bodies", copies.len()),
    };
    world.resource_mut::<Notices>().info(text);
}

/// A copy of a body that is awake and free of grabs and of stitches to colliders, which would pull
/// it back.
fn copy_of(body: Body, name: String, offset: Vec3) -> Body {
    let kept = body.stitches.all().iter();
    let kept = kept.filter(|stitch| matches!(stitch.to, StitchEnd::Point(_)));
    let stitches = Stitches::new(kept.copied().collect(), body.particles.len());
    let mut copy = Body {
        name,
        stitches: stitches.unwrap_or_default(),
        asleep: false,
        quarantine: None,
        ..body
    };
    copy.effects.grab = None;
    // One that an emitter did not make is not removed by it.
    let emission = &mut copy.particles.emission;
    if let Some(source) = emission.source() {
        emission.forget_body(source);
    }
    copy.translate(offset);
    copy
}

/// A translation that puts copies of bodies beside them where no other body is, if possible where
/// they are seen [m].
fn offset(world: &mut World, originals: &[Entity]) -> Vec3 {
    let view = world.get_resource::<ViewSettings>().cloned();
    let mut windows = world.query_filtered::<&Window, With<PrimaryWindow>>();
    let window = windows.single(world).ok().map(Window::size);
    let area = window.map(|size| FreeArea::new(&view.unwrap_or_default(), size));
    let mut cameras = world.query::<&OrbitCamera>();
    let orbit = cameras.iter(world).next().map(|camera| camera.goal);
    let right = orbit.map_or(Vec3::X, |orbit| orbit.transform().right().as_vec3());
    let right = if right.x.abs() >= right.z.abs() {
        Vec3::X * right.x.signum()
    } else {
        Vec3::Z * right.z.signum()
    };
    let near = right.cross(Vec3::Y);
    let is_seen = |point: Vec3| match (orbit, area) {
        (Some(orbit), Some(area)) => area
            .project(orbit.seen(point))
            .is_some_and(|at| area.clear.contains(at)),
        _ => true,
    };
    let mut all = world.query::<(Entity, &Particles)>();
    let boxes: Vec<(Entity, Aabb3d)> = all
        .iter(world)
        .map(|(entity, particles)| {
            let (low, high) = bounds(particles.positions.iter().map(|x| x.truncate()));
            (entity, Aabb3d::from_min_max(low, high))
        })
        .collect();
    let (own, others): (Vec<_>, Vec<_>) = boxes
        .into_iter()
        .partition(|(entity, _)| originals.contains(entity));
    let own: Vec<Aabb3d> = own.into_iter().map(|(_, shape)| shape).collect();
    let mut others: Vec<Aabb3d> = others.into_iter().map(|(_, shape)| shape).collect();
    others.extend(&own);
    let ways = [right, -right, near, -near, Vec3::Y];
    beside(&own, &others, &ways, is_seen)
}

/// A multiple of the width of `own` along one of some axes by which `own` can be moved without meeting
/// `others`, where its center is seen if possible; the first multiple along the first axis if there
/// is none.
fn beside(
    own: &[Aabb3d],
    others: &[Aabb3d],
    axes: &[Vec3],
    is_seen: impl Fn(Vec3) -> bool,
) -> Vec3 {
    use bevy::math::bounding::IntersectsVolume;
    let low = own.iter().map(|it| it.min).reduce(|a, b| a.min(b));
    let high = own.iter().map(|it| it.max).reduce(|a, b| a.max(b));
    let (Some(low), Some(high)) = (low, high) else {
        return Vec3::ZERO;
    };
    let (size, center) = (Vec3::from(high - low), Vec3::from(low.midpoint(high)));
    let step = |axis: Vec3| {
        let width = (size * axis).length().max(0.1 * size.max_element());
        axis * width * (1.0 + GAP)
    };
    let free = |offset: &Vec3| {
        own.iter().all(|shape| {
            let (low, high) = (
                shape.min + Vec3A::from(*offset),
                shape.max + Vec3A::from(*offset),
            );
            let moved = Aabb3d {
                min: low,
                max: high,
            };
            !others.iter().any(|other| moved.intersects(other))
        })
    };
    let places = (1..=PLACES).flat_map(|n| axes.iter().map(move |&axis| (axis, n)));
    let places = places.map(|(axis, n)| step(axis) * n as f32).filter(free);
    let mut seen = places.clone().filter(|&offset| is_seen(center + offset));
    let mut places = places;
    seen.next()
        .or_else(|| places.next())
        .or_else(|| axes.first().map(|&axis| step(axis)))
        .unwrap_or_default()
}

/// Hides or shows the bodies of a scope. They are simulated all the same.
pub fn hide(world: &mut World, scope: &Scope, hidden: bool) {
    for body in bodies(world, scope) {
        let mut entity = world.entity_mut(body);
        if hidden {
            entity.insert(HiddenBody);
        } else {
            entity.remove::<HiddenBody>();
        }
    }
}

/// Renames a body.
pub fn rename(world: &mut World, key: u64, wanted: &str) {
    let wanted = wanted.trim();
    let Some(body) = Entity::try_from_bits(key).filter(|it| world.get::<SoftBody>(*it).is_some())
    else {
        return;
    };
    if wanted == name_of(world, body) {
        return;
    }
    let mut names = world.query::<(Entity, &Name)>();
    let taken = names
        .iter(world)
        .any(|(other, name)| other != body && name.as_str() == wanted);
    let reason = if wanted.is_empty() {
        Some("Name is empty: a body needs a name".to_owned())
    } else if taken {
        let free = free_name(world, wanted);
        Some(format!(
            "Name “{wanted}” is taken by another body: use “{free}”, for example"
        ))
    } else {
        None
    };
    match reason {
        Some(reason) => world.resource_mut::<Notices>().warn(reason),
        None => {
            world.entity_mut(body).insert(Name::new(wanted.to_owned()));
        }
    }
}

/// Colors the bodies of a scope, sRGB.
pub fn color(world: &mut World, scope: &Scope, color: [u8; 3]) {
    for body in bodies(world, scope) {
        let look = world.get::<Look>(body).copied().unwrap_or_default();
        world.entity_mut(body).insert(Look {
            color: Some(color),
            ..look
        });
    }
}

/// The parameters of a body, if it is there; or what is wrong with one of its effects.
pub fn parameters(world: &World, body: Entity) -> Option<Result<BodyParameters, String>> {
    let entity = world.get_entity(body).ok()?;
    let density = entity.get::<BodyDensity>()?.0;
    let own = own_effects(world).of_body(&entity);
    let own = own.map_err(|(effect, error)| format!("{effect}: {error}"));
    Some(own.map(|own| BodyParameters {
        density: Some(density),
        effects: SceneEffects {
            own,
            ..carried::effects(entity).into()
        },
    }))
}

/// The effects of the app that are saved.
pub fn own_effects(world: &World) -> OwnEffects {
    let registry = world.get_resource::<EffectRegistry>();
    registry.map_or_else(OwnEffects::default, EffectRegistry::own)
}

/// Puts the parameters of the first body of a scope on the clipboard.
pub fn copy(world: &mut World, scope: &Scope) {
    let Some(body) = bodies(world, scope).first().copied() else {
        return;
    };
    let text = parameters(world, body).map(|parameters| {
        let text = parameters?.to_text();
        text.map_err(|error| error.to_string())
    });
    let name = name_of(world, body);
    match text {
        Some(Ok(text)) => {
            if let Some(mut clipboard) = world.get_resource_mut::<EguiClipboard>() {
                clipboard.set_text(&text);
            }
            world.resource_mut::<Notices>().info(format!(
                "Copied the parameters of {name}: paste them on other bodies, or into a scene file"
            ));
        }
        Some(Err(error)) => {
            let text = format!("Cannot copy the parameters of {name}: {error}");
            world.resource_mut::<Notices>().error(text);
        }
        None => {}
    }
}

/// Applies the parameters on the clipboard to the bodies of a scope.
pub fn paste(world: &mut World, scope: &Scope) {
    let clipboard = world.get_resource_mut::<EguiClipboard>();
    let text = clipboard.and_then(|mut clipboard| clipboard.get_text());
    let Some(text) = text.filter(|text| !text.trim().is_empty()) else {
        let text =
            "Nothing to paste: the clipboard has no text. Copy the parameters of a body first";
        world.resource_mut::<Notices>().info(text);
        return;
    };
    match BodyParameters::parse_with("clipboard", &text, &own_effects(world)) {
        Ok(parameters) => apply(world, scope, &parameters),
        Err(error) => {
            let text = format!(
                "Cannot paste: {error}. Expected the fields density and effects of a body in a \
                 scene file"
            );
            world.resource_mut::<Notices>().error(text);
        }
    }
}

/// Gives the bodies of a scope these parameters. Effects that the panel cannot switch, such as
/// stitches, stay.
pub fn apply(world: &mut World, scope: &Scope, parameters: &BodyParameters) {
    for body in bodies(world, scope) {
        let mut parameters = parameters.clone();
        let mask = parameters.effects.force_mask.map(|mask| mask.group);
        let topology = world.entity(body).get::<SoftBody>();
        if let Some((group, topology)) = mask.zip(topology)
            && !group.is_empty()
            && !topology.groups.contains(group)
        {
            // A mask of the whole body would let the forces act everywhere.
            parameters.effects.force_mask = None;
            let name = name_of(world, body);
            report(
                world,
                &format!("“{name}” has no group “{group}”: it gets no force mask"),
            );
        }
        let actions = actions(world, body, &parameters);
        let mut pending = world.resource_mut::<Actions>();
        for action in actions {
            pending.push(action);
        }
    }
}

/// Actions that give a body these parameters.
fn actions(world: &World, body: Entity, parameters: &BodyParameters) -> Vec<Action> {
    let mut actions = Vec::new();
    if let Some(density) = parameters.density {
        actions.push(Action::SetDensity { body, density });
    }
    let mut sample = World::new();
    let mut sample = sample.spawn_empty();
    carried::insert_effects(&mut sample, &(&parameters.effects).into());
    let own = parameters.effects.own.iter();
    own.for_each(|effect| effect.insert(&mut sample));
    let sample = EntityRef::from(&sample);
    let entity = world.entity(body);
    for info in world.resource::<EffectRegistry>().iter() {
        let (has, wants) = ((info.present)(&entity), (info.present)(&sample));
        let effect = info.name.to_owned();
        if has && !wants && info.insert_default.is_some() {
            actions.push(Action::RemoveEffect { body, effect });
        }
    }
    for info in world.resource::<EffectRegistry>().iter() {
        if !(info.present)(&sample) {
            continue;
        }
        let effect = info.name.to_owned();
        if !(info.present)(&entity) {
            actions.push(Action::AddEffect {
                body,
                effect: effect.clone(),
            });
        }
        for (index, parameter) in info.parameters.iter().enumerate() {
            let wanted = (info.get)(&sample, index);
            if let Some(value) = wanted.filter(|_| wanted != (info.get)(&entity, index)) {
                actions.push(Action::SetParameter {
                    body,
                    effect: effect.clone(),
                    parameter: parameter.name.to_owned(),
                    value,
                });
            }
        }
    }
    let group = |body: &EntityRef| {
        body.get::<ForceMask>()
            .map_or(GroupName::default(), |it| it.group)
    };
    if sample.contains::<ForceMask>() && group(&sample) != group(&entity) {
        let group = group(&sample);
        actions.push(Action::SetForceGroup { body, group });
    }
    actions
}

/// Reports an error of the user's input.
pub fn report(world: &mut World, error: &impl ToString) {
    let text = capitalised(&error.to_string());
    world.resource_mut::<Notices>().error(text);
}

/// Name of a body.
pub fn name_of(world: &World, body: Entity) -> String {
    world
        .get::<Name>(body)
        .map_or_else(|| body.to_string(), Name::to_string)
}

/// The name, with a number appended if it is taken. A number at its end is counted on.
pub fn free_name(world: &mut World, wanted: &str) -> String {
    let taken: Vec<String> = world
        .query::<&Name>()
        .iter(world)
        .map(Name::to_string)
        .collect();
    numbered(wanted, |name| taken.iter().any(|other| other == name))
}

fn numbered(wanted: &str, taken: impl Fn(&str) -> bool) -> String {
    if !taken(wanted) {
        return wanted.to_owned();
    }
    let stem = match wanted.rsplit_once(' ') {
        Some((stem, number)) if number.parse::<u32>().is_ok() => stem,
        _ => wanted,
    };
    (2_u32..)
        .map(|number| format!("{stem} {number}"))
        .find(|name| !taken(name))
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_bunny_has_a_name_of_its_own() {
        let there = ["bunny", "bunny 2"];
        let taken = |name: &str| there.contains(&name);
        assert_eq!(numbered("bunny", taken), "bunny 3");
        assert_eq!(numbered("bunny 2", taken), "bunny 3");
        assert_eq!(numbered("rope", taken), "rope");
    }

    #[test]
    fn copies_stand_beside_the_originals_where_nothing_is() {
        let cube =
            |x: f32| Aabb3d::from_min_max(Vec3::new(x, 0.0, 0.0), Vec3::new(x + 1.0, 1.0, 1.0));
        let own = [cube(0.0)];
        let first = beside(&own, &own, &[Vec3::X], |_| true);
        assert!(
            (first - Vec3::new(1.1, 0.0, 0.0)).length() < 1e-6,
            "{first}"
        );
        let blocked = beside(&own, &[cube(0.0), cube(1.5)], &[Vec3::X], |_| true);
        assert!((blocked.x - 3.3).abs() < 1e-5, "{blocked}");
        let ways = [Vec3::X, Vec3::NEG_X];
        let left = beside(&own, &[cube(0.0), cube(1.5)], &ways, |_| true);
        assert!((left.x + 1.1).abs() < 1e-6, "{left}");
        let seen = beside(&own, &[cube(0.0)], &ways, |center| center.x > 2.0);
        assert!((seen.x - 2.2).abs() < 1e-6, "{seen}");
    }
}
