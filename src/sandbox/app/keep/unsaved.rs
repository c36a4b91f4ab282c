//! What has changed since the scene was opened or saved: settings, bodies, their effects, densities,
//! pins, names and colors, and colliders. Motion does not count.

use crate::{
    scene::Look,
    simulation::{
        BodyDensity, Pins, SETTINGS, SimulationSettings, SpawnOrder,
        plain::{self, colliders_in_order, lasting_bodies},
        setting,
    },
    solver::{Collider, Density, Effects, Settings, VertexIndex},
};
use bevy::prelude::*;

/// The scene as it was opened or last saved.
#[derive(Resource, Debug, Default)]
pub struct Baseline {
    scene: Option<Editable>,
    /// Settings that were restored from the last run, which are kept anyway.
    restored: Vec<(String, f64)>,
}

/// What a user edits.
#[derive(Debug, Clone, PartialEq)]
struct Editable {
    settings: Settings,
    bodies: Vec<EditableBody>,
    colliders: Vec<(SpawnOrder, Collider)>,
}

#[derive(Debug, Clone, PartialEq)]
struct EditableBody {
    order: SpawnOrder,
    name: String,
    effects: Effects,
    density: Option<Density>,
    pins: Vec<VertexIndex>,
    color: Option<[u8; 3]>,
}

impl Baseline {
    /// Takes the scene as it is now as saved.
    pub fn take(world: &mut World) {
        let scene = Some(Editable::of(world));
        let mut baseline = world.get_resource_or_init::<Self>();
        baseline.scene = scene;
        baseline.restored.clear();
    }

    /// Notes that a setting is restored from the last run, which is no change.
    pub fn note_restored(&mut self, name: &str, value: f64) {
        self.restored.push((name.to_owned(), value));
    }

    /// What has changed, in words; empty if nothing has.
    #[must_use]
    pub fn changes(world: &mut World) -> Vec<String> {
        let now = Editable::of(world);
        let baseline = world.get_resource_or_init::<Self>();
        let Some(before) = &baseline.scene else {
            return Vec::new();
        };
        before.changes(&now, &baseline.restored)
    }
}

impl Editable {
    fn of(world: &mut World) -> Self {
        let bodies = lasting_bodies(world).into_iter().filter_map(|body| {
            let entity = world.entity(body);
            let mut pins = entity.get::<Pins>().map_or(Vec::new(), |it| it.0.clone());
            pins.sort_unstable();
            Some(EditableBody {
                order: *entity.get::<SpawnOrder>()?,
                name: entity.get::<Name>().map_or("", Name::as_str).to_owned(),
                effects: Effects {
                    grab: None,
                    ..plain::effects(entity)
                },
                density: entity.get::<BodyDensity>().map(|it| it.0),
                pins,
                color: entity.get::<Look>().and_then(|look| look.color),
            })
        });
        let bodies = bodies.collect();
        let colliders = colliders_in_order(world).into_iter().filter_map(|it| {
            let entity = world.entity(it);
            Some((
                *entity.get::<SpawnOrder>()?,
                entity.get::<Collider>()?.clone(),
            ))
        });
        Self {
            bodies,
            colliders: colliders.collect(),
            settings: **world.resource::<SimulationSettings>(),
        }
    }

    fn changes(&self, now: &Self, restored: &[(String, f64)]) -> Vec<String> {
        let mut changes = Vec::new();
        let settings = SETTINGS.iter().filter(|(name, ..)| {
            let value = setting(&now.settings, name);
            let is_restored = |(other, kept): &(String, f64)| other == name && Some(*kept) == value;
            value != setting(&self.settings, name) && !restored.iter().any(is_restored)
        });
        let settings = settings.count();
        let find =
            |bodies: &[EditableBody], order| bodies.iter().find(|it| it.order == order).cloned();
        let added = now
            .bodies
            .iter()
            .filter(|it| find(&self.bodies, it.order).is_none());
        let removed = self
            .bodies
            .iter()
            .filter(|it| find(&now.bodies, it.order).is_none());
        let (added, removed) = (added.count(), removed.count());
        let kept = || {
            let pairs = now.bodies.iter();
            pairs.filter_map(|it| Some((find(&self.bodies, it.order)?, it)))
        };
        let pins = kept()
            .filter(|(before, now)| before.pins != now.pins)
            .count();
        let bodies = kept().filter(|(before, now)| {
            (&before.name, before.effects, before.density, before.color)
                != (&now.name, now.effects, now.density, now.color)
        });
        let bodies = bodies.count();
        let colliders = usize::from(self.colliders != now.colliders);
        for (count, one, several) in [
            (settings, "1 setting changed", "settings changed"),
            (added, "1 body added", "bodies added"),
            (removed, "1 body removed", "bodies removed"),
            (
                bodies,
                "parameters of 1 body changed",
                "bodies with changed parameters",
            ),
            (pins, "pins of 1 body changed", "bodies with changed pins"),
            (colliders, "colliders changed", ""),
        ] {
            match count {
                0 => {}
                1 => changes.push(one.to_owned()),
                count => changes.push(format!("{count} {several}")),
            }
        }
        changes
    }
}
