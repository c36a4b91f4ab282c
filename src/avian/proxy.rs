//! Dynamic bodies of Avian's, and their proxies.

use super::{
    obstacle::pose,
    parts::{ProxyThickness, Represented, Represents, Unseen},
    surface::Colliders,
};
use crate::{
    effect::{Contact, ShapeMatching},
    simulation::{AddedMass, Asleep, SimulationSettings, SoftBody},
    solver::{
        Density, Fraction, Frequency, Friction, Mass, Particles, Pose, RestShape, Restitution,
        VertexIndex, measure,
    },
};
use avian3d::prelude::{
    AngularVelocity, ComputedAngularInertia, ComputedCenterOfMass, ComputedMass, Forces,
    LinearVelocity, Position, RigidBody, RigidBodyColliders, Rotation, Sleeping, SubstepCount,
    WriteRigidBodyForces,
};
use bevy::{
    math::{DMat3, DQuat, DVec3},
    prelude::*,
};

/// The proxy of a dynamic body.
#[derive(Component, Debug)]
pub(super) struct Proxy {
    /// Position of each particle in the frame of the body [m].
    rest: Vec<DVec3>,
    /// Mass [kg].
    mass: f64,
    /// State at the start of the tick.
    start: Momentum,
    /// Impulse [N·s] and angular impulse about the center of mass [N·m·s] of the last tick.
    impulse: Momentum,
    /// Three particles that are far apart.
    frame: [usize; 3],
}

impl Proxy {
    fn new(rest: Vec<DVec3>, mass: f64) -> Self {
        let farthest = |from: &dyn Fn(DVec3) -> f64| {
            let each = 0..rest.len();
            each.max_by(|&a, &b| from(rest[a]).total_cmp(&from(rest[b])))
                .unwrap_or(0)
        };
        let a = farthest(&|x| x.length_squared());
        let b = farthest(&|x| x.distance_squared(rest[a]));
        let c = farthest(&|x| (x - rest[a]).cross(x - rest[b]).length_squared());
        Self {
            frame: [a, b, c],
            mass,
            rest,
            start: Momentum::default(),
            impulse: Momentum::default(),
        }
    }

    /// Pose of the body.
    fn pose(&self, particles: &Particles) -> Pose {
        let axes = |[a, b, c]: [DVec3; 3]| {
            let x = (b - a).normalize();
            let z = x.cross(c - a).normalize();
            DMat3::from_cols(x, z.cross(x), z)
        };
        let rest = self.frame.map(|i| self.rest[i]);
        let now = self.frame.map(|i| particles.position(i));
        let rotation = axes(now) * axes(rest).transpose();
        let count = self.rest.len() as f64;
        let offsets = self.rest.iter().enumerate();
        let sum: DVec3 = offsets
            .map(|(i, &x)| particles.position(i) - rotation * x)
            .sum();
        Pose {
            rotation,
            translation: sum / count,
        }
    }
}

/// Linear and angular momentum.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Momentum {
    /// Point of reference of the angular momentum [m].
    about: DVec3,
    /// [kg·m/s]
    linear: DVec3,
    /// [kg·m²/s]
    angular: DVec3,
}

impl Momentum {
    /// Of particles, about a point.
    fn of(particles: &Particles, about: DVec3) -> Self {
        let linear = measure::momentum(particles);
        Self {
            about,
            linear,
            angular: measure::angular_momentum(particles) - about.cross(linear),
        }
    }
}

/// Distribution of the mass of a proxy: a surface and a point within, which have mass, center of
/// mass and trace of the tensor of inertia of the body.
struct Masses {
    /// Of the surface [kg/m²].
    density: f64,
    /// The point [m], and its mass [kg].
    middle: DVec3,
    added: f64,
}

/// Least fraction of the mass of a proxy in its surface or in its point, so that neither vanishes.
const MIN_PART: f64 = 1e-3;

impl Masses {
    /// For a surface and the mass [kg], center of mass [m] and trace of inertia about it [kg·m²].
    fn of(
        vertices: &[Vec3],
        triangles: &[[u32; 3]],
        (mass, center, inertia): (f64, DVec3, f64),
    ) -> Self {
        let (mut area, mut sum, mut squares) = (0.0, DVec3::ZERO, 0.0);
        for triangle in triangles {
            let x = triangle.map(|v| vertices[v as usize].as_dvec3());
            let part = (x[1] - x[0]).cross(x[2] - x[0]).length() / 6.0;
            for x in x {
                area += part;
                sum += x * part;
                // The trace of the inertia of a point is twice m r².
                squares += 2.0 * part * x.distance_squared(center);
            }
        }
        let fraction = (inertia / (mass / area * squares)).clamp(MIN_PART, 1.0 - MIN_PART);
        let added = (1.0 - fraction) * mass;
        Self {
            density: fraction * mass / area,
            middle: center + (center - sum / area) * (fraction * mass / added),
            added,
        }
    }
}

/// Change of an impulse below which a sleeping body is not woken, as a fraction of it.
const MAX_CHANGE: f64 = 0.05;

/// Spawns proxies of dynamic bodies.
pub(super) fn spawn(
    bodies: Query<
        (
            Entity,
            &RigidBody,
            &RigidBodyColliders,
            &ComputedMass,
            &ComputedCenterOfMass,
            &ComputedAngularInertia,
            Option<&avian3d::prelude::Friction>,
            Option<&avian3d::prelude::Restitution>,
        ),
        (Without<Represented>, Without<Unseen>),
    >,
    mut colliders: Colliders,
    thickness: Res<ProxyThickness>,
    mut commands: Commands,
) {
    for (entity, kind, of_body, mass, center, inertia, friction, restitution) in &bodies {
        if !kind.is_dynamic() || mass.value() <= 0.0 {
            continue;
        }
        let Some((mut vertices, triangles)) = colliders.surface(entity, of_body) else {
            continue;
        };
        let inertia = inertia.value();
        let trace = f64::from(inertia.m00 + inertia.m11 + inertia.m22);
        let Masses {
            density,
            middle,
            added,
        } = Masses::of(
            &vertices,
            &triangles,
            (mass.value().into(), center.0.as_dvec3(), trace),
        );
        let last = vertices.len() as u32;
        vertices.push(middle.as_vec3());
        let shape = RestShape {
            vertices: vertices.clone(),
            triangles,
            ..RestShape::default()
        };
        let parts = Density::new(density as f32)
            .and_then(|density| Ok((density, Mass::new(added as f32)?)))
            .map_err(|error| error.to_string());
        let body = parts.and_then(|(density, added)| {
            let builder = SoftBody::shape(shape).density(density);
            let body = builder.try_build().map_err(|error| error.to_string())?;
            Ok((body, AddedMass(vec![(VertexIndex(last), added)])))
        });
        let body = match body {
            Ok(body) => body,
            Err(error) => {
                warn!("soft bodies do not touch body {entity} of avian3d: {error}");
                commands.entity(entity).insert(Unseen);
                continue;
            }
        };
        let friction = friction.copied().unwrap_or_default();
        let restitution = restitution.copied().unwrap_or_default();
        let contact = Contact {
            thickness: thickness.0,
            friction: Friction::new(friction.static_coefficient).unwrap_or_default(),
            kinetic_fraction: Fraction::new(
                (friction.dynamic_coefficient / friction.static_coefficient).min(1.0),
            )
            .unwrap_or_default(),
            restitution: Restitution::new(restitution.coefficient).unwrap_or_default(),
            ..default()
        };
        let mut rest = vec![DVec3::ZERO; vertices.len()];
        for (x, v) in vertices.iter().zip(0..) {
            rest[body.0.0.0.particle(VertexIndex(v))] = x.as_dvec3();
        }
        let rigid = ShapeMatching {
            frequency: Frequency::of(f32::INFINITY),
            ..default()
        };
        commands.spawn((
            body,
            rigid,
            contact,
            Proxy::new(rest, mass.value().into()),
            Represents(entity),
        ));
    }
}

/// Moves proxies to their bodies.
pub(super) fn begin_tick(
    bodies: Query<(
        &Position,
        &Rotation,
        &LinearVelocity,
        &AngularVelocity,
        &ComputedCenterOfMass,
        Has<Sleeping>,
    )>,
    mut proxies: Query<(Entity, &Represents, &mut Proxy, &mut Particles, Has<Asleep>)>,
    mut commands: Commands,
) {
    for (entity, represents, mut proxy, mut particles, is_asleep) in &mut proxies {
        let Ok((position, rotation, linear, angular, center, sleeps)) = bodies.get(represents.0)
        else {
            continue;
        };
        if is_asleep && sleeps {
            continue;
        }
        let pose = pose(position, rotation);
        let center = pose.apply(center.0.as_dvec3());
        let (linear, angular) = (linear.0.as_dvec3(), angular.0.as_dvec3());
        for (i, rest) in proxy.rest.iter().enumerate() {
            let x = pose.apply(*rest);
            particles.set_position(i, x);
            particles.set_velocity(i, (linear + angular.cross(x - center)).as_vec3());
        }
        proxy.start = Momentum::of(&particles, center);
        if is_asleep {
            commands.entity(entity).remove::<Asleep>();
        }
    }
}

/// Passes the impulses of contacts on to the bodies.
pub(super) fn end_tick(
    mut bodies: Query<(Forces, Has<Sleeping>)>,
    mut proxies: Query<(&Represents, &mut Proxy, &Particles, Has<Asleep>)>,
    settings: Res<SimulationSettings>,
) {
    let dt = settings.0.tick_seconds();
    let gravity = settings.0.gravity.as_dvec3();
    for (represents, mut proxy, particles, is_asleep) in &mut proxies {
        let Ok((mut body, sleeps)) = bodies.get_mut(represents.0) else {
            continue;
        };
        let last = proxy.impulse;
        if !is_asleep {
            let (start, mut impulse) = (proxy.start, Momentum::of(particles, proxy.start.about));
            let weight = gravity * (proxy.mass * dt);
            let arm = measure::center_of_mass(particles) - start.about;
            impulse.linear -= start.linear + weight;
            impulse.angular -= start.angular + arm.cross(weight);
            proxy.impulse = impulse;
        }
        // While a proxy sleeps, the last impulse goes on holding its body.
        let Momentum {
            linear, angular, ..
        } = proxy.impulse;
        let is_same = linear.distance(last.linear) <= MAX_CHANGE * last.linear.length();
        if sleeps && is_same {
            continue;
        }
        body.apply_linear_impulse(linear.as_vec3());
        body.apply_angular_impulse(angular.as_vec3());
    }
}

/// Impulses below this fraction of the weight over a tick leave a body where it is.
const MIN_IMPULSE: f64 = 1e-6;

/// Places bodies that are touched so that their next step ends at the pose of their proxies:
/// contacts correct positions without velocity.
pub(super) fn place(
    mut bodies: Query<
        (
            &mut Position,
            &mut Rotation,
            &LinearVelocity,
            &AngularVelocity,
            &ComputedCenterOfMass,
        ),
        Without<Sleeping>,
    >,
    proxies: Query<(&Represents, &Proxy, &Particles), Without<Asleep>>,
    settings: Res<SimulationSettings>,
    substeps: Res<SubstepCount>,
) {
    let dt = settings.0.tick_seconds();
    let gravity = settings.0.gravity.as_dvec3();
    let count = f64::from(substeps.0.max(1));
    for (represents, proxy, particles) in &proxies {
        let weight = proxy.mass * gravity.length() * dt;
        if proxy.impulse.linear.length() <= MIN_IMPULSE * weight {
            continue;
        }
        let Ok((mut position, mut rotation, linear, angular, center)) =
            bodies.get_mut(represents.0)
        else {
            continue;
        };
        let pose = proxy.pose(particles);
        let center = center.0.as_dvec3();
        // What the next step adds, by semi-implicit Euler.
        let fall = gravity * (dt * dt * (count + 1.0) / (2.0 * count));
        let shift = linear.0.as_dvec3() * dt + fall;
        let turn = DQuat::from_scaled_axis(angular.0.as_dvec3() * dt);
        let before = turn.inverse() * DQuat::from_mat3(&pose.rotation);
        let middle = pose.apply(center) - shift;
        position.0 = (middle - before * center).as_vec3();
        rotation.0 = before.normalize().as_quat();
    }
}
