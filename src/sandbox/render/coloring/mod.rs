//! Bodies colored by a quantity, for example by strain.
//!
//! Values by particle are computed after each tick, carried to the vertices of the drawn surface,
//! and written to a second pair of texture coordinates of its mesh; the material turns them into
//! colors. While it is off, no mesh has that attribute and no system here runs.

pub mod legend;
pub mod map;
pub mod values;

pub use legend::LegendRects;

use bevy::{ecs::entity::EntityHashSet, prelude::*};
use bevy_egui::EguiPrimaryContextPass;

use crate::{
    render::{Drawn, MeshSystems},
    sandbox::{
        render::material::SkinMaterial,
        state::{
            color::{ColorMode, ColorScale, Quantity, place, shade},
            request::Requested,
            view::{SolverView, ViewSettings},
        },
    },
    simulation::{
        BodyContacts, BodySkin, RecordContacts, SimulationClock, SimulationSettings, SoftBody,
        carried::Carried,
    },
    solver::{EffectStates, Particles},
};
use values::Source;

/// Place of a vertex without a value; the shader draws it in gray.
const UNDEFINED: [f32; 2] = [-1e4, -1e4];
/// Bound of the places of values far beyond the range.
const FAR: f32 = 50.0;

/// Colors the bodies.
pub struct ColoringPlugin;

impl Plugin for ColoringPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<ViewSettings>()
            .init_resource::<ColorScale>()
            .init_resource::<LegendRects>()
            .init_resource::<RecordContacts>()
            .add_message::<Requested>()
            .add_systems(
                Update,
                record_contacts.run_if(resource_changed::<ViewSettings>),
            )
            .add_systems(
                PostUpdate,
                (
                    measure.run_if(is_on.and_then(not(mid_tick))),
                    (scale, paint, dress).chain().run_if(is_on),
                    clear.run_if(not(is_on)),
                )
                    .chain()
                    .after(MeshSystems)
                    .run_if(is_on.or_else(any_with_component::<Values>)),
            )
            .add_systems(
                EguiPrimaryContextPass,
                legend::show.run_if(is_on.or_else(legend::is_noted)),
            );
    }
}

/// Whether bodies are drawn, and colored.
fn is_on(view: Res<ViewSettings>) -> bool {
    view.color != ColorMode::Off && view.solver == SolverView::Off
}

fn mid_tick(clock: Res<SimulationClock>) -> bool {
    clock.mid_tick()
}

/// Values of a body.
#[derive(Component, Debug, Default)]
struct Values {
    mode: ColorMode,
    /// By particle [SI]; NaN where the quantity is not defined.
    particles: Vec<f32>,
    /// The range for which the mesh was colored last.
    painted: Option<(f32, f32)>,
}

/// Contact forces of ground and colliders are recorded while they are shown, and while an app wants
/// them.
fn record_contacts(
    view: Res<ViewSettings>,
    mut record: ResMut<RecordContacts>,
    mut is_ours: Local<bool>,
) {
    let is_shown = view.color == ColorMode::ContactForce;
    if is_shown && !record.0 {
        (record.0, *is_ours) = (true, true);
    } else if !is_shown && *is_ours {
        (record.0, *is_ours) = (false, false);
    }
}

/// Computes the values of bodies that have moved, and of all after a change of the quantity.
fn measure(
    mut commands: Commands,
    view: Res<ViewSettings>,
    settings: Res<SimulationSettings>,
    contacts: Res<BodyContacts>,
    mut bodies: Query<
        (
            Entity,
            &SoftBody,
            Ref<Particles>,
            &EffectStates,
            Carried,
            Option<&mut Values>,
        ),
        With<Drawn>,
    >,
) {
    let h = settings.substep_seconds();
    let h = (h, settings.method.compliant_seconds(h));
    let mut moved = EntityHashSet::default();
    for (entity, body, particles, states, carried, values) in &mut bodies {
        let is_current = values.as_ref().is_some_and(|it| it.mode == view.color);
        if is_current && !particles.is_changed() {
            continue;
        }
        let source = Source {
            body,
            particles: &particles,
            effects: &carried.effects(),
            states,
            h,
        };
        // A new body has its values from the next frame on.
        let Some(mut values) = values else {
            commands.entity(entity).insert(Values::default());
            continue;
        };
        values.mode = view.color;
        values.painted = None;
        values::measure(view.color, &source, &mut values.particles);
        moved.insert(entity);
    }
    if view.color != ColorMode::ContactForce {
        return;
    }
    // Forces between bodies, on those whose values are new.
    for (entity, particle, force) in contacts.particle_forces() {
        if moved.contains(&entity)
            && let Ok((.., Some(mut values))) = bodies.get_mut(entity)
            && let Some(value) = values.particles.get_mut(particle)
        {
            *value += force as f32;
        }
    }
}

/// Follows the values with the automatic range.
fn scale(
    view: Res<ViewSettings>,
    time: Res<Time<Real>>,
    bodies: Query<&Values>,
    mut scale: ResMut<ColorScale>,
    mut sizes: Local<Vec<f32>>,
    mut of: Local<ColorMode>,
) {
    let Some(quantity) = view.color.quantity() else {
        return;
    };
    sizes.clear();
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    let defined = bodies.iter().flat_map(|it| &it.particles);
    for &value in defined.filter(|value| value.is_finite()) {
        sizes.push(value.abs());
        (low, high) = (low.min(value), high.max(value));
    }
    let goal = values::automatic(&mut sizes, quantity.signed, quantity.least);
    if sizes.is_empty() && bodies.iter().any(|it| it.mode != view.color) {
        // New bodies, whose values come with the next frame.
        return;
    }
    let is_new = *of != view.color;
    *of = view.color;
    let automatic = match is_new {
        true => goal,
        false => values::follow(scale.automatic, goal, time.delta_secs()),
    };
    let next = ColorScale {
        automatic,
        extremes: (low <= high).then_some((low, high)),
        ..*scale
    };
    scale.set_if_neq(next);
}

/// Writes the values to the meshes of bodies where they, or the range, have changed.
fn paint(
    view: Res<ViewSettings>,
    scale: Res<ColorScale>,
    mut bodies: Query<(&SoftBody, Option<&BodySkin>, &Drawn, &Mesh3d, &mut Values)>,
    mut meshes: ResMut<Assets<Mesh>>,
) {
    let Some(quantity) = view.color.quantity() else {
        return;
    };
    let range = scale.range();
    for (body, skin, drawn, mesh, mut values) in &mut bodies {
        if values.painted == Some(range) || values.particles.len() != body.particles() {
            continue;
        }
        values.painted = Some(range);
        let skin = skin.map(|skin| &*skin.0);
        let points = values::at_points(&values.particles, body, skin);
        let places: Vec<[f32; 2]> = points
            .iter()
            .map(|&value| coordinates(value, range, &quantity))
            .collect();
        if let Some(mut mesh) = meshes.get_mut(&mesh.0) {
            let coordinates = drawn.copies();
            let coordinates: Vec<[f32; 2]> = coordinates
                .iter()
                .map(|&point| places[point as usize])
                .collect();
            mesh.insert_attribute(Mesh::ATTRIBUTE_UV_1, coordinates);
        }
    }
}

/// Coordinates of a value for the shader: its position in the color map, and in the range.
fn coordinates(value: f32, range: (f32, f32), quantity: &Quantity) -> [f32; 2] {
    if !value.is_finite() {
        return UNDEFINED;
    }
    let both = [shade(value, range, quantity.signed), place(value, range)];
    both.map(|place| place.clamp(-FAR, FAR))
}

/// Gives the color map to the materials.
fn dress(
    view: Res<ViewSettings>,
    bodies: Query<&MeshMaterial3d<SkinMaterial>, With<Values>>,
    mut materials: ResMut<Assets<SkinMaterial>>,
) {
    let Some(quantity) = view.color.quantity() else {
        return;
    };
    let map = map::map(quantity.signed).map(|color| color.extend(1.0));
    for material in &bodies {
        let is_worn = |it: &SkinMaterial| it.finish.map == map;
        if materials.get(&material.0).is_some_and(|it| !is_worn(it))
            && let Some(mut material) = materials.get_mut(&material.0)
        {
            material.finish.map = map;
        }
    }
}

/// Removes the values.
fn clear(
    mut commands: Commands,
    bodies: Query<(Entity, &Mesh3d), With<Values>>,
    mut meshes: ResMut<Assets<Mesh>>,
) {
    for (entity, mesh) in &bodies {
        if let Some(mut mesh) = meshes.get_mut(&mesh.0) {
            mesh.remove_attribute(Mesh::ATTRIBUTE_UV_1);
        }
        commands.entity(entity).remove::<Values>();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_beyond_the_range_looks_like_something_within_it() {
        let quantity = ColorMode::Tension.quantity().expect("it is a quantity");
        let at = |value| coordinates(value, (-0.1, 0.1), &quantity);
        assert_eq!(at(0.0), [0.5, 0.5]);
        assert!(at(0.1)[1] <= 1.0 && at(-0.1)[1] >= 0.0);
        assert!(at(0.11)[1] > 1.0 && at(-0.11)[1] < 0.0);
        assert!(at(1e30)[1] > 1.0 && at(-1e30)[1] < 0.0);
        assert_eq!(at(f32::NAN), UNDEFINED);
    }
}
