//! Grabs of points, patches and pins.

use super::{
    ActionError,
    perform::{body_mut, wake},
};
use crate::{
    simulation::{Pins, SimulationSettings, SoftBody},
    solver::{Grab, Hold, InvalidValue, Particles, SurfacePoint, VertexIndex},
};
use bevy::prelude::*;

/// Valid radii of a patch [m] and relative stiffnesses.
const RADII: std::ops::RangeInclusive<f32> = 0.0..=1000.0;
const STIFFNESSES: std::ops::RangeInclusive<f32> = 1e-3..=1e3;

/// Grabs a body at a point.
pub fn point(
    world: &mut World,
    body: Entity,
    point: SurfacePoint,
    target: Vec3,
) -> Result<(), ActionError> {
    let grab = grab(world, body, point, target)?;
    hold(world, body, grab)
}

/// Grabs a patch with a radius [m] around a point, with a relative stiffness.
pub fn patch(
    world: &mut World,
    body: Entity,
    (point, target): (SurfacePoint, Vec3),
    radius: f32,
    stiffness: f32,
) -> Result<(), ActionError> {
    let check = |quantity, value: f32, valid: &std::ops::RangeInclusive<f32>, text| {
        let is_valid = valid.contains(&value);
        let value = f64::from(value);
        is_valid
            .then_some(())
            .ok_or(ActionError::Value(InvalidValue {
                quantity,
                value,
                valid: text,
            }))
    };
    check("grab radius", radius, &RADII, "between 0 and 1000 m")?;
    check(
        "grab stiffness",
        stiffness,
        &STIFFNESSES,
        "between 0.001 and 1000",
    )?;
    let grab = grab(world, body, point, target)?.of_patch(radius, stiffness);
    hold(world, body, grab)
}

/// Grabs a pin and those that are connected to it.
pub fn pins(world: &mut World, body: Entity, vertex: VertexIndex) -> Result<(), ActionError> {
    let entity = body_mut(world, body)?;
    let Some((particles, topology)) = entity.get::<Particles>().zip(entity.get::<SoftBody>())
    else {
        return Err(ActionError::NoBody(body));
    };
    if !entity.get::<Pins>().is_some_and(|it| it.contains(&vertex)) {
        return Err(ActionError::NotPinned(vertex));
    }
    let particle = topology.numbering.particle(vertex);
    let target = particles.position(particle.index()).as_vec3();
    let point = SurfacePoint::new(&[(particle, 1.0)]).ok_or(ActionError::NotPinned(vertex))?;
    let grab = Grab {
        hold: Hold::Pins,
        ..grab(world, body, point, target)?
    };
    hold(world, body, grab)
}

/// Moves grabbed pins to a target [m] within a time [s].
pub fn move_pins(
    world: &mut World,
    body: Entity,
    target: Vec3,
    seconds: f32,
) -> Result<(), ActionError> {
    let tick = world.resource::<SimulationSettings>().tick_seconds() as f32;
    check_seconds(seconds)?;
    if !target.is_finite() {
        return Err(ActionError::Value(InvalidValue {
            quantity: "target of pins",
            value: f64::from(target.x + target.y + target.z),
            valid: "finite",
        }));
    }
    let mut entity = body_mut(world, body)?;
    if let Some(mut grab) = entity.get_mut::<Grab>()
        && grab.hold == Hold::Pins
    {
        grab.glide_to(target, seconds, tick);
    }
    Ok(())
}

/// Rejects times of a motion [s] that are negative or not finite.
pub fn check_seconds(seconds: f32) -> Result<(), ActionError> {
    let is_valid = seconds.is_finite() && seconds >= 0.0;
    is_valid
        .then_some(())
        .ok_or(ActionError::Value(InvalidValue {
            quantity: "time of the motion",
            value: seconds.into(),
            valid: "finite and at least 0 s",
        }))
}

fn grab(
    world: &mut World,
    body: Entity,
    point: SurfacePoint,
    target: Vec3,
) -> Result<Grab, ActionError> {
    let gravity = world.resource::<SimulationSettings>().gravity.length();
    let entity = body_mut(world, body)?;
    let Some((particles, topology)) = entity.get::<Particles>().zip(entity.get::<SoftBody>())
    else {
        return Err(ActionError::NoBody(body));
    };
    if !target.is_finite() || !point.fits(particles.len()) {
        return Err(ActionError::NoParticle {
            particle: point.nearest(),
            particles: particles.len(),
        });
    }
    let mass: f32 = particles
        .positions
        .iter()
        .filter(|x| x.w > 0.0)
        .map(|x| 1.0 / x.w)
        .sum();
    Ok(Grab::on(point, target, mass, topology.size, gravity))
}

fn hold(world: &mut World, body: Entity, grab: Grab) -> Result<(), ActionError> {
    let mut entity = body_mut(world, body)?;
    entity.insert(grab);
    wake(&mut entity);
    Ok(())
}
