//! Color maps: perceptually even, and distinguishable with color blindness.
//!
//! - Sequential: viridis (van der Walt and Smith 2015, CC0), eleven colors.
//! - Diverging: straight lines in OKLab (Ottosson 2020) from a neutral white to blue and to a dark
//!   orange, which are even by construction.
//!
//! The shader interpolates between the same colors, linearly in linear sRGB.

use crate::sandbox::render::material::linear;
use bevy::{color::Oklaba, prelude::*};

/// Number of colors of a map.
pub const STOPS: usize = 11;

/// A color map, linear sRGB.
pub type Map = [Vec3; STOPS];

const VIRIDIS: [[u8; 3]; STOPS] = [
    [68, 1, 84],
    [72, 36, 117],
    [65, 68, 135],
    [53, 95, 141],
    [42, 120, 142],
    [33, 145, 140],
    [34, 168, 132],
    [68, 191, 112],
    [122, 209, 81],
    [189, 223, 38],
    [253, 231, 37],
];

const NEGATIVE: [u8; 3] = [8, 64, 168];
const NEUTRAL: [u8; 3] = [244, 244, 242];
const POSITIVE: [u8; 3] = [168, 52, 4];

/// The map of a quantity with or without sign.
#[must_use]
pub fn map(signed: bool) -> Map {
    if !signed {
        return VIRIDIS.map(linear);
    }
    let lab = |[red, green, blue]: [u8; 3]| Oklaba::from(Color::srgb_u8(red, green, blue));
    let (low, middle, high) = (lab(NEGATIVE), lab(NEUTRAL), lab(POSITIVE));
    std::array::from_fn(|stop| {
        let at = 2.0 * stop as f32 / (STOPS - 1) as f32 - 1.0;
        let color = middle.mix(if at < 0.0 { &low } else { &high }, at.abs());
        LinearRgba::from(color)
            .to_vec3()
            .clamp(Vec3::ZERO, Vec3::ONE)
    })
}

/// The color at a position of a map, 0 to 1, linear sRGB; positions beyond have those of the ends.
#[must_use]
pub fn color(map: &Map, at: f32) -> Vec3 {
    let place = at.clamp(0.0, 1.0) * (STOPS - 1) as f32;
    let first = (place as usize).min(STOPS - 2);
    map[first].lerp(map[first + 1], place - first as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lab(color: Vec3) -> Vec3 {
        let lab = Oklaba::from(LinearRgba::rgb(color.x, color.y, color.z));
        Vec3::new(lab.lightness, lab.a, lab.b)
    }

    /// Viridis is even in another space (CAM02-UCS): its steps in OKLab differ by up to 13 %.
    #[test]
    fn both_maps_have_steps_of_similar_size() {
        let assert_even = |map: &[Vec3], most: f32| {
            let pairs = map.windows(2);
            let steps: Vec<f32> = pairs
                .map(|pair| lab(pair[0]).distance(lab(pair[1])))
                .collect();
            let mean = steps.iter().sum::<f32>() / steps.len() as f32;
            let is_even = |step: &f32| *step < most * mean && *step * most > mean;
            assert!(steps.iter().all(is_even), "{steps:?}");
        };
        let both = map(true);
        assert_even(&both[..=STOPS / 2], 1.05);
        assert_even(&both[STOPS / 2..], 1.05);
        assert_even(&map(false), 1.15);
    }

    /// Lightness alone orders the values, so that no kind of color blindness confuses them.
    #[test]
    fn lightness_increases_along_the_sequential_map_and_towards_the_middle_of_the_diverging_one() {
        let lightness = |map: Map| map.map(|color| lab(color).x);
        assert!(lightness(map(false)).is_sorted());
        let both = lightness(map(true));
        assert!(both[..=STOPS / 2].is_sorted());
        assert!(both[STOPS / 2..].is_sorted_by(|a, b| a >= b));
    }

    /// Blue and yellow are what people with red-green blindness distinguish: OKLab's b.
    #[test]
    fn the_two_sides_of_the_diverging_map_differ_along_blue_and_yellow() {
        let map = map(true);
        let (low, high) = (lab(map[0]), lab(map[STOPS - 1]));
        assert!(high.z - low.z > 0.2, "{low} {high}");
    }

    #[test]
    fn colors_between_stops_are_interpolated_and_those_beyond_the_ends_are_the_ends() {
        let map = map(false);
        assert_eq!(color(&map, -1.0), map[0]);
        assert_eq!(color(&map, 2.0), map[STOPS - 1]);
        assert!(color(&map, 0.05).distance(map[0].midpoint(map[1])) < 1e-6);
    }
}
