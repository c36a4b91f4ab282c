//! What is framed when a scene opens and by “frame all”: points of bodies and colliders, and the
//! ground below bodies that fall. Plain functions.

use crate::{
    scene::{BuiltScene, Region},
    solver::{Body, Collider, ColliderShape, Pose},
};
use bevy::prelude::*;

/// Colliders up to this size, in sizes of all bodies together, are framed. Larger ones are
/// surroundings.
const SURROUNDINGS: f32 = 2.0;
/// The ground up to this distance below a body is framed, in sizes of all bodies together.
const FALL: f32 = 3.0;
/// Space around single bodies that are framed, in their size.
const CLOSE_UP: f32 = 0.15;

/// Points that are framed [m].
#[derive(Debug, Clone, PartialEq)]
pub struct Subject {
    /// The points.
    pub points: Vec<Vec3>,
    low: Vec3,
    high: Vec3,
}

impl Default for Subject {
    fn default() -> Self {
        Self {
            points: Vec::new(),
            low: Vec3::INFINITY,
            high: Vec3::NEG_INFINITY,
        }
    }
}

impl Subject {
    /// The bodies and colliders of a scene in their current state.
    #[must_use]
    pub fn of(built: &BuiltScene) -> Self {
        let mut all = Self::default();
        for body in &built.world.bodies {
            all.add(positions(body));
        }
        all.add_colliders(&built.world.colliders, built.world.time);
        all
    }

    /// The same with the motion to come: the ground below bodies that can fall on it, and the region
    /// that the scene names.
    #[must_use]
    pub fn with_motion(built: &BuiltScene) -> Self {
        let mut all = Self::of(built);
        let bodies = built.world.bodies.iter();
        let falling = bodies.filter(|body| body.pins.is_empty());
        for (body, height) in falling.filter_map(|body| Some((body, ground(body)?))) {
            let mut own = Self::default();
            own.add(positions(body));
            all.add_fall(own.low, own.high, height);
        }
        if let Some(Region { low, high }) = built.frame {
            all.add(corners(low, high));
        }
        all
    }

    /// Adds the points of a body. Points that are not finite are left out.
    pub fn add(&mut self, points: impl IntoIterator<Item = Vec3>) {
        for point in points.into_iter().filter(|point| point.is_finite()) {
            self.low = self.low.min(point);
            self.high = self.high.max(point);
            self.points.push(point);
        }
    }

    /// Adds colliders at a simulated time [s], except those that are much larger than the bodies.
    pub fn add_colliders<'a>(
        &mut self,
        colliders: impl IntoIterator<Item = &'a Collider>,
        time: f64,
    ) {
        let limit = SURROUNDINGS * self.size();
        for collider in colliders {
            let outline = outline(&collider.shape, &collider.pose_at(time));
            let mut own = Self::default();
            own.add(outline);
            if self.points.is_empty() || own.size() <= limit {
                self.points.extend(own.points);
            }
        }
    }

    /// Adds space around the points, so that single bodies are seen with what is beside them.
    pub fn add_surroundings(&mut self) {
        if !self.points.is_empty() {
            let room = Vec3::splat(CLOSE_UP * self.size());
            let box_around = corners(self.low - room, self.high + room);
            self.points.extend(box_around);
        }
    }

    /// Adds the ground at a height below a box [m], unless it is far below.
    fn add_fall(&mut self, low: Vec3, high: Vec3, ground: f32) {
        if (0.0..=FALL * self.size()).contains(&(low.y - ground)) {
            let below = corners(low.with_y(ground), high.with_y(ground));
            self.points.extend(below);
        }
    }

    /// Whether it reaches below a height [m].
    pub(super) fn reaches_below(&self, height: f32) -> bool {
        self.points.iter().any(|point| point.y < height)
    }

    /// Diagonal of the bounding box of the bodies [m].
    fn size(&self) -> f32 {
        (self.high - self.low).max(Vec3::ZERO).length()
    }
}

fn positions(body: &Body) -> impl Iterator<Item = Vec3> + '_ {
    body.particles.positions.iter().map(|x| x.truncate())
}

/// Height of the ground of a body [m].
pub(super) fn ground(body: &Body) -> Option<f32> {
    let effects = &body.effects;
    let ground = effects.ground.map(|ground| ground.height.get());
    ground.or(effects.sticky_ground.map(|ground| ground.height.get()))
}

fn corners(low: Vec3, high: Vec3) -> [Vec3; 8] {
    std::array::from_fn(|i| {
        let pick = |bit: usize, low: f32, high: f32| if i & bit == 0 { low } else { high };
        Vec3::new(
            pick(1, low.x, high.x),
            pick(2, low.y, high.y),
            pick(4, low.z, high.z),
        )
    })
}

/// Points on the surface of a shape [m].
fn outline(shape: &ColliderShape, pose: &Pose) -> Vec<Vec3> {
    let local: Vec<Vec3> = match shape {
        ColliderShape::Sphere { radius } => ball(*radius, 0.0).collect(),
        ColliderShape::Box { size } => corners(-*size / 2.0, *size / 2.0).to_vec(),
        ColliderShape::Capsule { radius, length } => {
            let ends = [length / 2.0, -length / 2.0];
            ends.into_iter().flat_map(|y| ball(*radius, y)).collect()
        }
        ColliderShape::Mesh(mesh) => mesh.vertices().to_vec(),
    };
    let place = |point: Vec3| (pose.rotation * point.as_dvec3() + pose.translation).as_vec3();
    local.into_iter().map(place).collect()
}

/// Points on a ball at a height: their outline is within 4 % of its radius, seen from anywhere.
fn ball(radius: f32, height: f32) -> impl Iterator<Item = Vec3> {
    const RINGS: usize = 9;
    const AROUND: usize = 16;
    (0..=RINGS).flat_map(move |ring| {
        (0..AROUND).map(move |step| {
            let polar = std::f32::consts::PI * ring as f32 / RINGS as f32;
            let turn = std::f32::consts::TAU * step as f32 / AROUND as f32;
            let side = polar.sin();
            let unit = Vec3::new(side * turn.cos(), polar.cos(), side * turn.sin());
            radius * unit + height * Vec3::Y
        })
    })
}
