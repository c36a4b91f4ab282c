//! Drawing of the references as translucent surfaces over their bodies.
//!
//! Bodies are drawn between their last two ticks, and references may be one tick behind. A
//! reference is therefore drawn with the particle offsets from its body at the last ticks that both
//! have completed: a visible distance existed at one and the same time.

use super::ReferenceOverlay;
use crate::{
    render::{Drawn, MeshSystems, place},
    sandbox::render::material::{ReferenceMaterial, Veil, linear},
    simulation::{BodySkin, SimulationClock, SoftBody},
};
use bevy::{
    camera::{
        primitives::Aabb,
        visibility::{NoAutoAabb, VisibilitySystems},
    },
    light::{NotShadowCaster, NotShadowReceiver},
    prelude::*,
};
use std::sync::Arc;

/// Color of all reference overlays, as 8-bit sRGB; not part of the palette of bodies.
pub const COLOR: [u8; 3] = [250, 252, 255];

/// Draws the reference overlays.
pub struct ReferenceFormPlugin;

impl Plugin for ReferenceFormPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(
            PostUpdate,
            (show, follow)
                .chain()
                .after(MeshSystems)
                .before(VisibilitySystems::VisibilityPropagate)
                .run_if(resource_exists::<ReferenceOverlay>.or_else(any_with_component::<Form>)),
        );
    }
}

/// The drawn reference of the body that is the parent of the entity.
#[derive(Component, Debug)]
struct Form {
    drawn: Drawn,
    /// The tick that was drawn last.
    tick: u64,
}

/// Creates surfaces for new references, and removes those of references that are gone.
fn show(
    mut commands: Commands,
    reference_overlay: Option<Res<ReferenceOverlay>>,
    bodies: Query<(&Drawn, &SoftBody)>,
    forms: Query<(Entity, &ChildOf), With<Form>>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<ReferenceMaterial>>,
) {
    let gaps = reference_overlay
        .as_ref()
        .and_then(|reference_overlay| reference_overlay.compared());
    let gaps = gaps.map_or(&[][..], |comparison| &comparison.gaps);
    for (form, parent) in &forms {
        if !gaps.iter().any(|(body, _)| *body == parent.parent()) {
            commands.entity(form).despawn();
        }
    }
    for &(body, _) in gaps {
        let Ok((drawn, topology)) = bodies.get(body) else {
            continue;
        };
        if forms.iter().any(|(_, parent)| parent.parent() == body) {
            continue;
        }
        let outline = Arc::clone(&drawn.outline);
        let veil = Veil {
            color: linear(COLOR),
            reach: topology.size / 2.0,
            closed: outline.closed.into(),
        };
        commands.spawn((
            ChildOf(body),
            Mesh3d(meshes.add(outline.mesh())),
            MeshMaterial3d(materials.add(ReferenceMaterial { veil })),
            Form {
                drawn: Drawn::new(outline),
                tick: u64::MAX,
            },
            // Visible even if the solver view hides the body.
            Visibility::Visible,
            (NotShadowCaster, NotShadowReceiver),
            (Aabb::default(), NoAutoAabb),
        ));
    }
}

/// Updates the surfaces to the positions of the references.
fn follow(
    reference_overlay: Option<Res<ReferenceOverlay>>,
    clock: Res<SimulationClock>,
    bodies: Query<(Ref<Drawn>, &SoftBody, Option<&BodySkin>)>,
    mut forms: Query<(&ChildOf, &mut Form, &Mesh3d, &mut Aabb)>,
    mut meshes: ResMut<Assets<Mesh>>,
) {
    let Some(reference_overlay) = reference_overlay else {
        return;
    };
    let tick = reference_overlay
        .compared()
        .map_or(u64::MAX, |comparison| comparison.tick);
    for (parent, mut form, mesh, mut bounds) in &mut forms {
        let body = parent.parent();
        let (Ok((drawn, topology, skin)), Some(gaps)) = (
            bodies.get(body),
            reference_overlay.gaps(body, clock.overstep()),
        ) else {
            continue;
        };
        if (!drawn.is_changed() && form.tick == tick) || drawn.particles.is_empty() {
            continue;
        }
        form.tick = tick;
        let gaps: Vec<Vec3> = gaps.collect();
        if gaps.len() != drawn.particles.len() {
            // The body was torn; its reference is about to end.
            continue;
        }
        let particles = drawn.particles.iter().zip(gaps);
        let particles = particles.map(|(x, gap)| *x + gap.extend(0.0));
        if !Arc::ptr_eq(&form.drawn.outline, &drawn.outline) {
            form.drawn = Drawn::new(Arc::clone(&drawn.outline));
            if let Some(mut mesh) = meshes.get_mut(&mesh.0) {
                *mesh = drawn.outline.mesh();
            }
        }
        place(&mut form.drawn, topology, skin, particles);
        if let Some(mut mesh) = meshes.get_mut(&mesh.0) {
            form.drawn.write(&mut mesh);
            *bounds = form.drawn.bounds();
        }
    }
}
