//! Values by particle, and their way to the drawn surface.

use crate::{
    mesh::Skin,
    sandbox::state::color::ColorMode,
    simulation::SoftBody,
    solver::{
        EffectStates, Effects, Particles,
        field::{self, Principal},
    },
};

/// What the values of a body are computed from.
pub struct Source<'a> {
    /// Its mesh.
    pub body: &'a SoftBody,
    /// Its state.
    pub particles: &'a Particles,
    /// Its effects.
    pub effects: &'a Effects,
    /// The states of its effects.
    pub states: &'a EffectStates,
    /// Length of a substep [s], for positions and for compliances.
    pub h: (f64, f64),
}

/// Values of a quantity by particle [SI], without contacts between bodies; NaN where it is not
/// defined.
pub fn measure(mode: ColorMode, source: &Source, out: &mut Vec<f32>) {
    let Source {
        body, particles, ..
    } = *source;
    let positions = &particles.positions;
    match mode {
        ColorMode::Off => out.clear(),
        ColorMode::Tension => field::strain(body, positions, Principal::Largest, out),
        ColorMode::Compression => field::strain(body, positions, Principal::Smallest, out),
        ColorMode::VolumeChange => field::volume_change(body, positions, out),
        ColorMode::Speed => field::speed(particles, out),
        ColorMode::ConstraintError => {
            let effects = (source.effects, source.states);
            field::constraint_error(effects, body, particles, source.h.1 as f32, out);
        }
        ColorMode::ContactForce => {
            let h = particles.history.seconds(source.h.0);
            field::contact_force(particles, source.states, h as f32, out);
        }
    }
}

/// Values at the points of the drawn surface, from values by particle. A point of a skin has the
/// interpolated value of its tetrahedron; where it lies outside, no value beyond those of the
/// corners.
pub fn at_points(values: &[f32], body: &SoftBody, skin: Option<&Skin>) -> Vec<f32> {
    let Some(skin) = skin else {
        return values.to_vec();
    };
    let of_anchor = |anchor: &crate::mesh::Anchor| {
        let corners = anchor.vertices.map(|vertex| values[body.particle(vertex)]);
        let weighted = corners.iter().zip(anchor.weights);
        let acting = weighted.filter(|(_, weight)| *weight != 0.0);
        let (mut sum, mut low, mut high) = (0.0, f32::INFINITY, f32::NEG_INFINITY);
        for (&value, weight) in acting {
            sum += value * weight;
            (low, high) = (low.min(value), high.max(value));
        }
        // NaN stays NaN.
        if sum.is_nan() || low > high {
            f32::NAN
        } else {
            sum.clamp(low, high)
        }
    };
    skin.anchors.iter().map(of_anchor).collect()
}

/// Fraction of the values that the automatic range contains.
pub const CONTAINED: f32 = 0.98;

/// The range that contains [`CONTAINED`] of the values [SI], which are reordered: from 0, or about 0
/// for a signed quantity. `least` is its minimum extent on one side.
pub fn automatic(sizes: &mut [f32], signed: bool, least: f32) -> (f32, f32) {
    let most = match sizes.len() {
        0 => least,
        count => {
            let place = ((count as f32 * CONTAINED).ceil() as usize).clamp(1, count) - 1;
            let (_, size, _) = sizes.select_nth_unstable_by(place, f32::total_cmp);
            size.max(least)
        }
    };
    (if signed { -most } else { 0.0 }, most)
}

/// Moves a range towards another one within `seconds` of real time: quickly if it grows, slowly if
/// it shrinks, so that it does not flicker.
pub fn follow(range: (f32, f32), goal: (f32, f32), seconds: f32) -> (f32, f32) {
    /// Time constants of growth and of shrinking [s].
    const TIMES: (f32, f32) = (0.1, 1.5);
    let toward = |now: f32, goal: f32| {
        let time = if goal.abs() > now.abs() {
            TIMES.0
        } else {
            TIMES.1
        };
        let next = goal + (now - goal) * (-seconds / time).exp();
        // The last half per cent at once: otherwise it would change for ever.
        if (next - goal).abs() <= 0.005 * goal.abs() {
            goal
        } else {
            next
        }
    };
    (toward(range.0, goal.0), toward(range.1, goal.1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        mesh::{Anchor, Primitive},
        solver::{Topology, VertexIndex},
    };
    use bevy::math::{UVec3, Vec3};
    use std::sync::Arc;

    fn block() -> SoftBody {
        let (size, cells) = (Vec3::ONE, UVec3::ONE);
        let shape = Primitive::Box { size, cells }.build().expect("sound").shape;
        SoftBody(Arc::new(Topology::new(shape).expect("sound")))
    }

    #[test]
    fn a_point_of_a_skin_has_the_value_between_its_corners_and_none_beyond_them() {
        let body = block();
        let anchor = |weights| Anchor {
            vertices: [0, 1, 2, 3].map(VertexIndex),
            weights,
        };
        let skin = Skin {
            triangles: Vec::new(),
            anchors: vec![
                anchor([0.5, 0.5, 0.0, 0.0]),
                anchor([2.0, -1.0, 0.0, 0.0]),
                anchor([0.5, 0.0, 0.5, 0.0]),
            ],
        };
        let mut values = vec![0.0; body.particles()];
        let at = |vertex| body.particle(VertexIndex(vertex));
        (values[at(0)], values[at(1)], values[at(2)]) = (3.0, 1.0, f32::NAN);
        let points = at_points(&values, &body, Some(&skin));
        assert_eq!(points[..2], [2.0, 3.0]);
        assert!(points[2].is_nan());
    }

    #[test]
    fn the_automatic_range_leaves_out_two_per_cent_and_is_symmetric_for_signed_quantities() {
        let mut sizes: Vec<f32> = (1..=100).map(|i| i as f32).collect();
        assert_eq!(automatic(&mut sizes, false, 0.1), (0.0, 98.0));
        assert_eq!(automatic(&mut sizes, true, 0.1), (-98.0, 98.0));
        assert_eq!(automatic(&mut [1e-9; 5], false, 0.1), (0.0, 0.1));
        assert_eq!(automatic(&mut [], true, 0.1), (-0.1, 0.1));
    }

    #[test]
    fn the_range_grows_quickly_shrinks_slowly_and_arrives() {
        let grown = follow((0.0, 1.0), (0.0, 2.0), 0.1).1;
        let shrunk = follow((0.0, 2.0), (0.0, 1.0), 0.1).1;
        assert!(grown - 1.0 > 0.5 && 2.0 - shrunk < 0.1, "{grown} {shrunk}");
        let mut range = (-2.0, 2.0);
        for _ in 0..1000 {
            range = follow(range, (-1.0, 1.0), 1.0 / 60.0);
        }
        assert_eq!(range, (-1.0, 1.0));
    }
}
