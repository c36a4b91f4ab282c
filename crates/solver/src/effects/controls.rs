//! What an app does to a body from outside: forces, impulses, targets of pins, grabs.
//!
//! They are effects that an app sets for a body, not part of a scene. Their parameters are lists, by points
//! and vertices; at the beginning of a tick these become [lists of particles](ByParticle), which act on few
//! particles at a time, in lanes or not.

use super::{
    external::{ExternalForce, ExternalImpulse},
    grabs::{Grabs, is_sound},
    pin_targets::PinTargets,
};
use crate::{
    SurfacePoint, Topology,
    kernel::{
        each::{ParticlePass, Singles, push_free},
        lanes::{Columns, Lanes, Vectors},
    },
};
use fearless_simd::prelude::*;
use glam::{DVec3, Vec3, Vec4};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// What an app does to a body; nothing by default.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Controls {
    /// A force, until it is changed or removed.
    pub force: Option<ExternalForce>,
    /// An impulse, which the next tick applies and removes.
    pub impulse: Option<ExternalImpulse>,
    /// Where pinned vertices move.
    pub targets: Option<PinTargets>,
    /// Several grabs.
    pub grabs: Option<Grabs>,
}

/// What acts on a body from outside, beside its effects.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Outside {
    /// It has stitches.
    pub stitched: bool,
    /// A force of an app pushes it.
    pub pushed: bool,
    /// An app moves its pins.
    pub steered: bool,
    /// An app grabs it at several points.
    pub grabbed: bool,
}

impl Controls {
    /// Whether an app does nothing to the body.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// What acts on a body, which may be `stitched`.
    #[must_use]
    pub fn outside(&self, stitched: bool) -> Outside {
        Outside {
            stitched,
            pushed: self.force.is_some(),
            steered: self.targets.is_some(),
            grabbed: self.grabs.is_some(),
        }
    }

    /// Whether it keeps the body from sleeping.
    pub(crate) fn hold_awake(&self) -> bool {
        self.impulse.is_some() || self.grabs.as_ref().is_some_and(|grabs| !grabs.is_empty())
    }

    /// Moves points to the particles of a body that was torn or renewed; those that are gone are removed.
    pub(crate) fn follow(&mut self, now: impl Fn(&SurfacePoint) -> Option<SurfacePoint>) {
        if let Some(force) = &mut self.force {
            force.follow(&now);
        }
        if let Some(impulse) = &mut self.impulse {
            impulse.follow(&now);
        }
        if let Some(grabs) = &mut self.grabs {
            grabs.follow(&now);
        }
    }

    /// Heap memory in bytes.
    pub(crate) fn bytes(&self) -> usize {
        let force = self.force.iter().map(|it| size_of_val(&it.points[..]));
        let impulse = self.impulse.iter().map(|it| size_of_val(&it.points[..]));
        let targets = self.targets.iter().map(|it| size_of_val(&it.0[..]));
        let grabs = self.grabs.iter().map(Grabs::bytes);
        let lists: usize = force.chain(impulse).chain(targets).chain(grabs).sum();
        size_of::<Self>() + lists
    }

    /// Whether all their points and vertices are those of a body, and all forces and grabs are finite.
    #[must_use]
    pub fn fit(&self, topology: &Topology) -> bool {
        let count = topology.particles();
        let force = self.force.iter().map(|it| (it.whole, &it.points[..]));
        let impulse = self.impulse.iter().map(|it| (it.whole, &it.points[..]));
        let mut pushes = force.chain(impulse);
        let targets = self.targets.iter().flat_map(|it| &it.0);
        let mut grabs = self.grabs.iter().flat_map(Grabs::iter);
        pushes.all(|(whole, points)| {
            let is_sound =
                |(point, push): &(SurfacePoint, Vec3)| point.fits(count) && push.is_finite();
            whole.is_finite() && points.iter().all(is_sound)
        }) && targets
            .into_iter()
            .all(|(vertex, _)| vertex.index() < count)
            && grabs.all(|grab| is_sound(grab, count) && (grab.from + grab.glide.goal).is_finite())
    }
}

/// The controls in a tick, by the numbers of the particles on which they act, in ascending order.
#[derive(Debug, Clone, Default)]
pub(crate) struct ByParticle {
    /// Acceleration of the free particles [m/s²].
    whole: DVec3,
    /// Accelerations of single particles [m/s²].
    pushes: Vec<(u32, DVec3)>,
    /// Targets of pins at the end of the tick [m].
    targets: Vec<(u32, DVec3)>,
}

impl ByParticle {
    /// Finds them at the beginning of a tick, for a body with these positions [m] and inverse masses [1/kg].
    pub fn update(&mut self, controls: Option<&Controls>, topology: &Topology, positions: &[Vec4]) {
        self.whole = DVec3::ZERO;
        self.pushes.clear();
        self.targets.clear();
        let Some(controls) = controls else {
            return;
        };
        if let Some(force) = &controls.force {
            self.whole = force.acceleration(positions);
            let pushes = force.pushes(positions);
            self.pushes.extend(pushes.map(|(i, push)| (i as u32, push)));
            self.pushes.sort_by_key(|(i, _)| *i);
        }
        if let Some(targets) = &controls.targets {
            let targets = targets.of_pins(topology, |i| positions[i].w == 0.0);
            self.targets
                .extend(targets.map(|(i, target)| (i as u32, target)));
            // The last one of a vertex counts.
            self.targets.reverse();
            self.targets.sort_by_key(|(i, _)| *i);
            self.targets.dedup_by_key(|(i, _)| *i);
        }
    }

    /// Whether a force acts.
    pub fn push(&self) -> bool {
        self.whole != DVec3::ZERO || !self.pushes.is_empty()
    }

    /// Whether a force acts on single ones of some particles.
    pub fn push_single(&self, particles: &Range<usize>) -> bool {
        within(&self.pushes, particles).next().is_some()
    }

    /// Pushes single ones of some particles, which are these `singles`, for `h` seconds.
    pub fn push_singles(
        &self,
        particles: &Range<usize>,
        singles: &mut (impl Singles + ?Sized),
        h: f32,
    ) {
        let h = f64::from(h);
        for (i, push) in within(&self.pushes, particles) {
            singles.accelerate(i, push * (h * h));
        }
    }

    /// The displacement of all free particles in `h` seconds [m].
    pub fn push_of_all(&self, h: f32) -> PushAll {
        let h = f64::from(h);
        PushAll((self.whole * (h * h)).as_vec3())
    }

    /// Moves the pins among some particles, which are these `singles`, by their part of the way in a substep, with
    /// the number of the substep and their count.
    pub fn move_pins(
        &self,
        particles: &Range<usize>,
        singles: &mut (impl Singles + ?Sized),
        (substep, substeps): (u32, u32),
    ) {
        let left = f64::from(substeps - substep);
        for (i, target) in within(&self.targets, particles) {
            let way = target - singles.single(i).start;
            singles.shift(i, way / left);
        }
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.pushes[..]) + size_of_val(&self.targets[..])
    }
}

/// Those of a list, in ascending order, that are about some particles, by their numbers among these.
fn within<'a>(
    all: &'a [(u32, DVec3)],
    particles: &Range<usize>,
) -> impl Iterator<Item = (usize, DVec3)> + use<'a> {
    let first = particles.start;
    let place = |end: usize| all.partition_point(|(i, _)| (*i as usize) < end);
    let some = &all[place(first)..place(particles.end)];
    some.iter()
        .map(move |(i, value)| (*i as usize - first, *value))
}

/// A displacement of all free particles [m], as by gravity.
#[derive(Clone, Copy)]
pub(crate) struct PushAll(pub Vec3);

impl ParticlePass for PushAll {
    #[inline(always)]
    fn act<L: Lanes>(
        &self,
        simd: L,
        position: &Columns<L>,
        moved: &mut Vectors<L>,
        carry: &mut Vectors<L>,
    ) -> u64 {
        let free = position[3].simd_gt(simd.number(0.0));
        if !free.any_true() {
            return 0;
        }
        let Vec3 { x, y, z } = self.0;
        let by = [simd.number(x), simd.number(y), simd.number(z)];
        push_free::<L>(free, by, moved, carry)
    }
}
