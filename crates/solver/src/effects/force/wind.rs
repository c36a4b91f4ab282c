//! Wind on surfaces: drag and lift of every triangle.

use super::{
    law::{Force, ForceKind, Load, Moment, Mote},
    noise::Noise,
};
#[cfg(feature = "bevy")]
use crate::reflection::*;
use crate::{Coefficient, Finite, Length, Topology};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Wind on the surface of the body: cloth, and the boundary of a solid. Ropes are not affected.
///
/// The force on a triangle of area A and leeward normal n, in air with the relative velocity u, is
///
/// F = ½ρA (u·n) ((C_D − C_L) u + C_L ‖u‖ n),
///
/// as for the plates of Ling, Damodaran and Gay (*Aerodynamic Force Models for Animating Cloth
/// Motion in Air Flow*, 1996): C_D across the flow, and lift for oblique plates.
///
/// ```
/// use pliant_solver::{Coefficient, Finite, Wind};
///
/// // A breeze along z with gusts of half its speed.
/// let breeze = Wind {
///     x: Finite::of(0.0),
///     z: Finite::of(4.0), // m/s
///     turbulence: Coefficient::of(2.0), // m/s
///     ..Wind::default()
/// };
/// # assert_ne!(breeze, Wind::default());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(
    feature = "bevy",
    derive(Component, Reflect),
    reflect(Component, Debug, Default, PartialEq, Serialize, Deserialize),
    type_path = "pliant::effect"
)]
pub struct Wind {
    /// Mean wind along x [m/s]; default 5.
    pub x: Finite,
    /// Mean wind along y [m/s]; default 0.
    pub y: Finite,
    /// Mean wind along z [m/s]; default 0.
    pub z: Finite,
    /// Largest gust along each axis [m/s]; default 0. Gusts are frozen in the air and move with the
    /// mean wind (Taylor's hypothesis).
    pub turbulence: Coefficient,
    /// Gust size [m]; default 0.5.
    pub scale: Length,
    /// Air density ρ [kg/m³]; default 1.2.
    pub density: Coefficient,
    /// Drag coefficient C_D of a plate across the flow; default 1.2.
    pub drag: Coefficient,
    /// Lift coefficient C_L; default 0.6.
    pub lift: Coefficient,
}

impl Default for Wind {
    fn default() -> Self {
        Self {
            x: Finite::of(5.0),
            y: Finite::ZERO,
            z: Finite::ZERO,
            turbulence: Coefficient::default(),
            scale: Length::of(0.5),
            density: Coefficient::of(1.2),
            drag: Coefficient::of(1.2),
            lift: Coefficient::of(0.6),
        }
    }
}

impl Wind {
    /// Velocity of the air at a position and a time [m/s].
    #[must_use]
    pub fn air(&self, place: DVec3, time: f64) -> DVec3 {
        self.air_by(&mut Noise::default(), place, time)
    }

    fn air_by(&self, noise: &mut Noise, place: DVec3, time: f64) -> DVec3 {
        let mean = Finite::vector([self.x, self.y, self.z]);
        let gusts = f64::from(self.turbulence.get());
        if gusts == 0.0 {
            return mean;
        }
        mean + noise.at((place - mean * time) / f64::from(self.scale.get())) * gusts
    }
}

impl Force for Wind {
    const KIND: ForceKind = ForceKind::Wind;

    fn act(
        &self,
        topology: &Topology,
        moment: Moment,
        at: impl Fn(u32) -> Mote,
        loads: &mut Vec<Load>,
        mut push: impl FnMut(u32, DVec3),
    ) {
        let (drag, lift) = (f64::from(self.drag.get()), f64::from(self.lift.get()));
        let half_density = 0.5 * f64::from(self.density.get());
        let mut noise = Noise::default();
        loads.clear();
        loads.resize(topology.particles(), Load::default());
        for &corners in topology.triangles.iter() {
            let [a, b, c] = corners.map(&at);
            let across = (b.x - a.x).cross(c.x - a.x);
            let twice_area = across.length();
            if twice_area == 0.0 {
                continue;
            }
            let normal = across / twice_area;
            let wind = self.air_by(&mut noise, (a.x + b.x + c.x) / 3.0, moment.time);
            let u = wind - (a.v + b.v + c.v) / 3.0;
            let speed = u.length();
            let into = u.dot(normal);
            let normal = if into < 0.0 { -normal } else { normal };
            let pressed = half_density * 0.5 * twice_area * into.abs();
            let force = pressed * ((drag - lift) * u + (lift * speed) * normal);
            let load = Load {
                force: force / 3.0,
                stiffness: pressed * drag.max(lift) / 3.0,
            };
            for i in corners {
                loads[i as usize].force += load.force;
                loads[i as usize].stiffness += load.stiffness;
            }
        }
        for (i, load) in (0..).zip(loads) {
            // Implicit, so that it is stable for any wind and light cloth, in the change of the velocity by
            // the force and by gravity.
            let response = moment.h * at(i).w;
            let fall = moment.gravity * moment.h;
            let change = load.force - fall * load.stiffness;
            push(i, change * (response / (1.0 + load.stiffness * response)));
        }
    }
}
