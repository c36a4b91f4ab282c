//! Flow along a curve.

use super::law::{Force, ForceKind, Moment, Mote, approach};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{Coefficient, Finite, Length, Topology};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Air that flows along a cubic Bézier curve and towards it, and drags particles along:
/// dv/dt = c (u − v).
///
/// With the distance r from the nearest point of the curve and the radius R, the speed towards the
/// curve is that given times r/R within the radius, and that given outside, where the coupling c falls
/// with (R/r)². Beyond the end of the curve there is no force.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Stream {
    /// Start of the curve along x [m]; default 0.
    pub x0: Finite,
    /// Start along y [m]; default 0.
    pub y0: Finite,
    /// Start along z [m]; default 0.
    pub z0: Finite,
    /// First control point along x [m], towards which the curve begins; default 0.
    pub x1: Finite,
    /// First control point along y [m]; default 1.
    pub y1: Finite,
    /// First control point along z [m]; default 0.
    pub z1: Finite,
    /// Second control point along x [m], from which the curve ends; default 1.
    pub x2: Finite,
    /// Second control point along y [m]; default 1.
    pub y2: Finite,
    /// Second control point along z [m]; default 0.
    pub z2: Finite,
    /// End along x [m]; default 1.
    pub x3: Finite,
    /// End along y [m]; default 0.
    pub y3: Finite,
    /// End along z [m]; default 0.
    pub z3: Finite,
    /// Speed along the curve [m/s]; default 2.
    pub along: Finite,
    /// Speed towards the curve at the radius [m/s]; default 1.
    pub inward: Finite,
    /// Radius R [m]; default 0.2.
    pub radius: Length,
    /// Coupling c within the radius [1/s]; default 5.
    pub coupling: Coefficient,
}

impl Default for Stream {
    fn default() -> Self {
        Self {
            x0: Finite::ZERO,
            y0: Finite::ZERO,
            z0: Finite::ZERO,
            x1: Finite::ZERO,
            y1: Finite::of(1.0),
            z1: Finite::ZERO,
            x2: Finite::of(1.0),
            y2: Finite::of(1.0),
            z2: Finite::ZERO,
            x3: Finite::of(1.0),
            y3: Finite::ZERO,
            z3: Finite::ZERO,
            along: Finite::of(2.0),
            inward: Finite::of(1.0),
            radius: Length::of(0.2),
            coupling: Coefficient::of(5.0),
        }
    }
}

/// Parts of the curve among which the nearest is searched for.
const PARTS: usize = 16;

/// Newton iterations for the nearest point. The error of the nearest sample is at most half a part;
/// each iteration squares it.
const REFINEMENTS: usize = 3;

impl Stream {
    /// Control points [m].
    #[must_use]
    pub fn points(&self) -> [DVec3; 4] {
        [
            [self.x0, self.y0, self.z0],
            [self.x1, self.y1, self.z1],
            [self.x2, self.y2, self.z2],
            [self.x3, self.y3, self.z3],
        ]
        .map(Finite::vector)
    }

    /// Velocity of the air at a position [m/s], and the coupling there as a fraction of that within the
    /// radius; `None` beyond the end.
    #[must_use]
    pub fn air(&self, place: DVec3) -> Option<(DVec3, f64)> {
        let curve = Curve(self.points());
        let t = curve.nearest(place);
        let arm = place - curve.at(t);
        let direction = curve.direction(t);
        if t == 1.0 && arm.dot(direction) > 0.0 {
            return None;
        }
        let radius = f64::from(self.radius.get());
        let beyond = arm.length().max(radius);
        let [along, inward] = [self.along, self.inward].map(|speed| f64::from(speed.get()));
        let air = direction * along - arm * (inward / beyond);
        Some((air, radius * radius / (beyond * beyond)))
    }
}

/// A cubic Bézier curve by its control points.
struct Curve([DVec3; 4]);

impl Curve {
    fn at(&self, t: f64) -> DVec3 {
        let [a, b, c, d] = self.0;
        let s = 1.0 - t;
        a * (s * s * s) + b * (3.0 * s * s * t) + c * (3.0 * s * t * t) + d * (t * t * t)
    }

    /// First and second derivative.
    fn derivatives(&self, t: f64) -> [DVec3; 2] {
        let [a, b, c, d] = self.0;
        let s = 1.0 - t;
        let first = (b - a) * (3.0 * s * s) + (c - b) * (6.0 * s * t) + (d - c) * (3.0 * t * t);
        let second = (c - b * 2.0 + a) * (6.0 * s) + (d - c * 2.0 + b) * (6.0 * t);
        [first, second]
    }

    /// Direction of the curve, a unit vector; zero if it is a point.
    fn direction(&self, t: f64) -> DVec3 {
        // The derivative vanishes at an end that coincides with its control point.
        let [a, b, c, d] = self.0;
        let others = match t < 0.5 {
            true => [c - a, d - a],
            false => [d - b, d - a],
        };
        let all = [self.derivatives(t)[0], others[0], others[1]];
        let found = all.into_iter().find_map(DVec3::try_normalize);
        found.unwrap_or_default()
    }

    /// Parameter of the point nearest to a position, from 0 to 1.
    fn nearest(&self, place: DVec3) -> f64 {
        let samples = (0..=PARTS).map(|i| i as f64 / PARTS as f64);
        let distance = |t: f64| self.at(t).distance_squared(place);
        let mut t = samples.fold(0.0, |best, t| match distance(t) < distance(best) {
            true => t,
            false => best,
        });
        for _ in 0..REFINEMENTS {
            let [first, second] = self.derivatives(t);
            let arm = self.at(t) - place;
            let slope = first.length_squared() + arm.dot(second);
            // Not beside a farthest point, or a cusp.
            if slope > 0.0 {
                let next = (t - arm.dot(first) / slope).clamp(0.0, 1.0);
                if distance(next) <= distance(t) {
                    t = next;
                }
            }
        }
        t
    }
}

impl Force for Stream {
    const KIND: ForceKind = ForceKind::Stream;

    fn act(
        &self,
        topology: &Topology,
        moment: Moment,
        at: impl Fn(u32) -> Mote,
        mut push: impl FnMut(u32, DVec3),
    ) {
        let coupling = f64::from(self.coupling.get());
        for i in 0..topology.particles() as u32 {
            let mote = at(i);
            if let Some((air, part)) = self.air(mote.x) {
                let behind = air - moment.coasting(mote.v);
                push(i, behind * approach(coupling * part, &moment));
            }
        }
    }
}
