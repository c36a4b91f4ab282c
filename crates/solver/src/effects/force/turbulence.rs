//! Turbulent air.

use super::{
    law::{Force, ForceKind, Moment, Mote, approach},
    noise::Noise,
};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{Coefficient, Length, Topology};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Air in random motion without a mean, which drags particles along: dv/dt = c (u − v). Unlike
/// [`Wind`](super::Wind) it acts on ropes and grains as well, and the shape of a body does not
/// matter.
///
/// u is value noise over the length and over a time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Turbulence {
    /// Largest speed along each axis [m/s]; default 3.
    pub speed: Coefficient,
    /// Size of eddies [m]; default 0.5.
    pub scale: Length,
    /// Rate at which they change [1/s]; default 1. 0 is a steady flow.
    pub rate: Coefficient,
    /// Coupling c [1/s]; default 2.
    pub coupling: Coefficient,
}

impl Default for Turbulence {
    fn default() -> Self {
        Self {
            speed: Coefficient::of(3.0),
            scale: Length::of(0.5),
            rate: Coefficient::of(1.0),
            coupling: Coefficient::of(2.0),
        }
    }
}

/// Distance of the noise of one moment from that of the next, in eddies: large, so that eddies
/// change rather than move.
const APART: f64 = 1e4;

impl Turbulence {
    /// Velocity of the air at a position and a time [m/s].
    #[must_use]
    pub fn air(&self, place: DVec3, time: f64) -> DVec3 {
        self.air_by(&mut Default::default(), place, time)
    }

    /// With the noise of the moment before and that of the moment after.
    fn air_by(&self, [noise, next]: &mut [Noise; 2], place: DVec3, time: f64) -> DVec3 {
        let place = place / f64::from(self.scale.get());
        let moment = time * f64::from(self.rate.get());
        let before = moment.floor();
        let t = moment - before;
        let at = |moment: f64| place + DVec3::Y * (moment * APART);
        let smooth = t * t * (3.0 - 2.0 * t);
        let eddies = noise.at(at(before)).lerp(next.at(at(before + 1.0)), smooth);
        eddies * f64::from(self.speed.get())
    }
}

impl Force for Turbulence {
    const KIND: ForceKind = ForceKind::Turbulence;

    fn act(
        &self,
        topology: &Topology,
        moment: Moment,
        at: impl Fn(u32) -> Mote,
        mut push: impl FnMut(u32, DVec3),
    ) {
        let fraction = approach(self.coupling.get().into(), &moment);
        let mut noise = Default::default();
        for i in 0..topology.particles() as u32 {
            let mote = at(i);
            let air = self.air_by(&mut noise, mote.x, moment.time);
            push(i, (air - moment.coasting(mote.v)) * fraction);
        }
    }
}
