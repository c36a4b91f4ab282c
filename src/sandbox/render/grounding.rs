//! What bodies take from the floor's light and give back: soft shade where they stand, tinted
//! by the light that comes through them.
//!
//! A shadow map knows the key light alone. Here every body is a ball to the floor, and the share
//! of the sky that a ball covers has a closed form; so the shade costs a few operations a pixel.

use crate::render::Drawn;
use crate::sandbox::render::material::SkinMaterial;
use bevy::{prelude::*, render::render_resource::ShaderType};

/// Bodies that shade the floor at most; of more, those nearest to the focus do.
pub const MOST: usize = 24;

/// Uniform part of `floor.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Default, ShaderType)]
pub struct Grounding {
    /// Centre [m] in xyz, radius [m] in w.
    pub balls: [Vec4; MOST],
    /// Colour of the light that comes through, linear sRGB; w is how much does.
    pub tints: [Vec4; MOST],
    /// How many there are.
    pub count: u32,
}

impl Grounding {
    /// The grounding by bodies around a focus [m].
    pub(in crate::sandbox) fn of(
        focus: Vec3,
        bodies: &Query<(&Drawn, &MeshMaterial3d<SkinMaterial>)>,
        materials: &Assets<SkinMaterial>,
    ) -> Self {
        let mut near: Vec<(f32, Vec4, Vec4)> = bodies
            .iter()
            .filter(|(drawn, _)| drawn.outline.closed)
            .filter_map(|(drawn, material)| {
                let ball = ball(drawn.low, drawn.high)?;
                let finish = materials.get(&material.0)?.finish;
                let distance = ball.truncate().distance_squared(focus);
                Some((distance, ball, finish.colour.extend(finish.translucency)))
            })
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near.truncate(MOST);
        let mut grounding = Self {
            count: near.len() as u32,
            ..default()
        };
        for (slot, &(_, ball, tint)) in near.iter().enumerate() {
            grounding.balls[slot] = ball;
            grounding.tints[slot] = tint;
        }
        grounding
    }
}

/// The ball of the same volume as a box's inscribed ellipsoid; `None` if the box is not finite.
fn ball(low: Vec3, high: Vec3) -> Option<Vec4> {
    let radius = ((high - low) / 2.0).element_product().cbrt();
    radius
        .is_finite()
        .then(|| low.midpoint(high).extend(radius))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_shades_like_the_ball_inside_it() {
        let ball = ball(Vec3::new(1.0, 0.0, 1.0), Vec3::new(3.0, 2.0, 3.0)).expect("finite");
        // A cube root of 1, within a rounding.
        assert!(ball.distance(Vec4::new(2.0, 1.0, 2.0, 1.0)) < 1e-6);
        assert_eq!(super::ball(Vec3::ZERO, Vec3::INFINITY), None);
    }
}
