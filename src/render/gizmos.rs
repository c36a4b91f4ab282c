//! Debug drawing of soft bodies: particles, pins, constraints by color, contacts.

use super::{Drawn, MeshSystems};
use crate::{
    effect::{Stretch, Struts},
    simulation::{BodyContacts, Pins, SoftBody},
    solver::{Particles, topology::order::Elements},
};
use bevy::{color::Oklcha, prelude::*};

/// What [`SoftBodyGizmosPlugin`] draws.
///
/// ```no_run
/// use bevy::prelude::*;
/// use pliant::render::SoftBodyGizmos;
///
/// fn show_contacts(mut store: ResMut<GizmoConfigStore>) {
///     store.config_mut::<SoftBodyGizmos>().1.contacts = true;
/// }
/// ```
#[derive(Debug, Clone, Reflect, GizmoConfigGroup)]
pub struct SoftBodyGizmos {
    /// A cross for each particle; default on.
    pub particles: bool,
    /// A ball for each pin; default on.
    pub pins: bool,
    /// A line for each edge and strut that is solved, in the color of its group; default on.
    pub constraints: bool,
    /// A line for each contact that pushes, along its force and as long as an edge of the body, in
    /// the color of the [force](force_color); default on.
    pub contacts: bool,
}

impl Default for SoftBodyGizmos {
    fn default() -> Self {
        Self {
            particles: true,
            pins: true,
            constraints: true,
            contacts: true,
        }
    }
}

/// Draws soft bodies as lines over the scene, for debugging.
#[derive(Debug, Default)]
pub struct SoftBodyGizmosPlugin;

impl Plugin for SoftBodyGizmosPlugin {
    fn build(&self, app: &mut App) {
        app.init_gizmo_group::<SoftBodyGizmos>()
            .add_systems(PostUpdate, (bodies, contacts).after(MeshSystems));
    }
}

const PARTICLE: Color = Color::srgb(0.9, 0.9, 0.95);
const PIN: Color = Color::srgb(1.0, 0.65, 0.2);
/// Size of particles and pins as a fraction of the mean edge.
const SIZE: (f32, f32) = (0.1, 0.2);

fn bodies(
    mut gizmos: Gizmos<SoftBodyGizmos>,
    bodies: Query<(
        &SoftBody,
        &Particles,
        Option<&Drawn>,
        Option<&Pins>,
        Has<Stretch>,
        Has<Struts>,
    )>,
) {
    for (body, particles, drawn, pins, stretch, struts) in &bodies {
        // As drawn, between ticks; without a mesh as simulated.
        let drawn = drawn.filter(|drawn| drawn.particles.len() == particles.len());
        let at = |particle: usize| match drawn {
            Some(drawn) => drawn.particles[particle].truncate(),
            None => particles.position(particle).as_vec3(),
        };
        let mean = body.surface().mean_edge;
        let shows = gizmos.config_ext.clone();
        if shows.particles {
            for particle in 0..particles.len() {
                gizmos.cross(at(particle), SIZE.0 * mean, PARTICLE);
            }
        }
        if let Some(pins) = pins.filter(|_| shows.pins) {
            for &vertex in &pins.0 {
                let place = at(body.particle(vertex));
                gizmos.sphere(place, SIZE.1 * mean, PIN).resolution(8);
            }
        }
        if shows.constraints && stretch {
            lines(&mut gizmos, &body.edges.elements, at);
        }
        if shows.constraints && struts {
            lines(&mut gizmos, &body.struts().elements, at);
        }
    }
}

fn lines(gizmos: &mut Gizmos<SoftBodyGizmos>, elements: &Elements<2>, at: impl Fn(usize) -> Vec3) {
    for batch in elements.batches() {
        for (color, (_, group)) in elements.groups(batch).enumerate() {
            let color = match batch.partition() {
                Some(_) => distinct_color(color),
                // Shares particles with others, and is solved alone.
                None => Color::WHITE,
            };
            for ends in group {
                let [a, b] = ends.map(|end| at(end.particle() as usize));
                gizmos.line(a, b, color);
            }
        }
    }
}

fn contacts(
    mut gizmos: Gizmos<SoftBodyGizmos>,
    contacts: Option<Res<BodyContacts>>,
    bodies: Query<&SoftBody>,
) {
    let (true, Some(contacts)) = (gizmos.config_ext.contacts, contacts) else {
        return;
    };
    for contact in contacts.forces() {
        let mut touching = contact.bodies.into_iter().flatten();
        let Some(body) = touching.find_map(|body| bodies.get(body).ok()) else {
            continue;
        };
        let force = contact.normal * contact.normal_force + contact.friction;
        let along = force.normalize_or_zero() * body.surface().mean_edge;
        let color = force_color(force.length());
        gizmos.line(contact.point, contact.point + along, color);
    }
}

/// The color of a force [N]: blue at 1 mN and below, over green and yellow, to red at 1 kN and
/// above, logarithmic.
#[must_use]
pub fn force_color(force: f32) -> Color {
    let fraction = ((force.max(f32::MIN_POSITIVE).log10() + 3.0) / 6.0).clamp(0.0, 1.0);
    Color::hsl(240.0 * (1.0 - fraction), 0.9, 0.6)
}

/// A circle divided by the golden ratio: small multiples of it are far from each other [°].
const GOLDEN_ANGLE: f32 = 137.507_77;

/// The n-th of a sequence of colors in which neighbors differ in hue and in lightness.
#[must_use]
pub fn distinct_color(n: usize) -> Color {
    let hue = (n as f32 * GOLDEN_ANGLE).rem_euclid(360.0);
    let lightness = [0.72, 0.54, 0.86, 0.63][n % 4];
    Oklcha::lch(lightness, 0.17, hue).into()
}
