//! Ambient shading of the floor by bodies: a soft occlusion shadow, tinted by transmitted light.
//!
//! A shadow map only covers the key light. Here every body is approximated by a ball, for which the
//! covered fraction of the sky has a closed form, so that the shading costs a few operations per
//! pixel.

use crate::render::Drawn;
use crate::sandbox::{render::material::SkinMaterial, state::look::HiddenBody};
use bevy::{prelude::*, render::render_resource::ShaderType};

/// Maximum number of bodies that shade the floor; those nearest to the focus are chosen.
pub const MAX_BODIES: usize = 24;

/// Uniform part of `floor.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Default, ShaderType)]
pub struct Grounding {
    /// Center [m] in xyz, radius [m] in w.
    pub balls: [Vec4; MAX_BODIES],
    /// Color of the transmitted light, linear sRGB; its fraction in w.
    pub tints: [Vec4; MAX_BODIES],
    /// Number of balls.
    pub count: u32,
}

impl Grounding {
    /// Shading by the bodies nearest to a focus [m].
    pub(in crate::sandbox) fn of(
        focus: Vec3,
        bodies: &Query<(&Drawn, &MeshMaterial3d<SkinMaterial>), Without<HiddenBody>>,
        materials: &Assets<SkinMaterial>,
    ) -> Self {
        let mut near: Vec<(f32, Vec4, Vec4)> = bodies
            .iter()
            .filter(|(drawn, _)| drawn.outline.closed)
            .filter_map(|(drawn, material)| {
                let ball = ball(drawn.low, drawn.high)?;
                let finish = materials.get(&material.0)?.finish;
                let distance = ball.truncate().distance_squared(focus);
                Some((distance, ball, finish.color.extend(finish.translucency)))
            })
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near.truncate(MAX_BODIES);
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

/// The ball with the volume of the inscribed ellipsoid of a box; `None` if the box is not finite.
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
        // A cube root of 1, up to rounding.
        assert!(ball.distance(Vec4::new(2.0, 1.0, 2.0, 1.0)) < 1e-6);
        assert_eq!(super::ball(Vec3::ZERO, Vec3::INFINITY), None);
    }
}
