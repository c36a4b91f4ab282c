//! The heavy elastica (Wang, *A Critical Review of the Heavy Elastica*, 1986).

/// A strip clamped at one end that bends under its own weight by any amount:
/// Bθ″ + w(L − s) cos θ = 0. Lengths are fractions of its length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elastica {
    /// wL³/B, with the weight per area w [N/m²], the length L [m] and the flexural rigidity B
    /// [N·m]; above 0.
    pub load: f64,
    /// Slope at the clamp [rad], between −π/2 and 1: a steeper strip may fall to either side.
    pub clamp: f64,
}

/// Number of intervals of the discretization.
const PARTS: usize = 2000;
/// Factor by which the load is ramped up in each stage, so that Newton's method stays on the branch
/// of the hanging strip: large loads have other solutions, which oscillate.
const GROWTH: f64 = 4.0;
/// Largest load: the bend has the length √(B/(wL)), six intervals.
const MAX_LOAD: f64 = 1e5;
/// Maximum number of Newton steps per load.
const MAX_STEPS: u32 = 100;

impl Elastica {
    /// Points at equal intervals of the length, at most 2000: horizontal distance from the clamp
    /// and height above it, in lengths. `None` if the load is not a number above 0, or so large
    /// that the bend at the clamp is not resolved.
    #[must_use]
    pub fn points(&self, parts: usize) -> Option<Vec<[f64; 2]>> {
        let every = (PARTS / parts.max(1)).max(1);
        Some(self.places()?.step_by(every).collect())
    }

    /// Position of the free end, in lengths; `None` under the same conditions as
    /// [`points`](Self::points).
    #[must_use]
    pub fn end(&self) -> Option<[f64; 2]> {
        self.places()?.last()
    }

    /// All points, from the clamp to the free end.
    fn places(&self) -> Option<impl Iterator<Item = [f64; 2]>> {
        let known = self.load > 0.0 && self.load <= MAX_LOAD && self.clamp.is_finite();
        if !known {
            return None;
        }
        let angles = self.angles();
        let mut place = [0.0, 0.0];
        Some((0..=PARTS).map(move |index| {
            if let Some(before) = index.checked_sub(1) {
                let [a, b] = [angles[before], angles[index]];
                place[0] += 0.5 * (a.cos() + b.cos()) / PARTS as f64;
                place[1] += 0.5 * (a.sin() + b.sin()) / PARTS as f64;
            }
            place
        }))
    }

    /// θ at the points, by central differences: Newton's method on
    /// θ₋ − 2θ + θ₊ = h²(wL³/B)(1 − s) cos θ, with zero curvature at the free end.
    fn angles(&self) -> Vec<f64> {
        let mut angles = vec![self.clamp; PARTS + 1];
        let mut load = self.load.min(1.0);
        loop {
            // About five steps are enough; below this the changes are rounding errors.
            for _ in 0..MAX_STEPS {
                if change(&mut angles, load) < 1e-11 {
                    break;
                }
            }
            if load >= self.load {
                return angles;
            }
            load = (load * GROWTH).min(self.load);
        }
    }
}

/// One Newton step, by elimination in a tridiagonal system; returns its size [rad].
fn change(angles: &mut [f64], load: f64) -> f64 {
    let step = 1.0 / PARTS as f64;
    // Superdiagonal entry and right-hand side of each row after elimination of the rows before it.
    let mut rows = vec![(0.0, 0.0); PARTS + 1];
    for index in 1..=PARTS {
        let weight = step * step * load * (1.0 - index as f64 * step);
        let (sin, cos) = angles[index].sin_cos();
        let (below, above) = if index == PARTS {
            (2.0, 0.0)
        } else {
            (1.0, 1.0)
        };
        let next = angles[(index + 1).min(PARTS)];
        let error = below * angles[index - 1] - 2.0 * angles[index] + above * next - weight * cos;
        let pivot = weight * sin - 2.0 - below * rows[index - 1].0;
        rows[index] = (above / pivot, (-error - below * rows[index - 1].1) / pivot);
    }
    let (mut moved, mut farthest) = (0.0, 0.0_f64);
    for (angle, (above, right)) in angles.iter_mut().zip(rows).skip(1).rev() {
        moved = right - above * moved;
        *angle += moved;
        farthest = farthest.max(moved.abs());
    }
    farthest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level(load: f64) -> [f64; 2] {
        Elastica { load, clamp: 0.0 }.end().expect("a sound load")
    }

    #[test]
    fn a_load_that_makes_no_sense_has_no_strip() {
        for load in [0.0, -1.0, 1e300, f64::INFINITY, f64::NAN] {
            assert_eq!(Elastica { load, clamp: 0.0 }.end(), None, "{load}");
        }
    }

    #[test]
    fn a_strip_that_hardly_bends_hangs_as_a_beam_and_one_that_bends_far_as_peirce_says() {
        // wL⁴/(8B), to first order in (wL³/B)², which is 1e-6 here, and in the square of an
        // interval.
        let [_, y] = level(1e-3);
        assert!((-y / (1e-3 / 8.0) - 1.0).abs() < 1e-5, "{y}");
        // Where the bending length c = (B/w)^(1/3) is half of the overhang, the chord is 41.5°
        // below the horizontal: the angle used in fabric testing.
        let angle = |load: f64| {
            let [x, y] = level(load);
            (-y).atan2(x)
        };
        assert!((angle(8.0).to_degrees() - 41.5).abs() < 0.05);
        // Peirce (1930): c = L (cos(θ/2)/(8 tan θ))^(1/3), an empirical factor on the formula for
        // small angles, which deviates from the elastica by 5 % at 62°.
        for load in [2.0, 8.0, 20.0] {
            let angle = angle(load);
            let peirce = f64::cbrt((angle / 2.0).cos() / (8.0 * angle.tan()));
            let off = peirce * f64::cbrt(load) - 1.0;
            assert!(off.abs() < 0.05, "{load}: {off}");
        }
    }

    #[test]
    fn a_strip_under_a_large_load_hangs_straight_down_but_for_its_bend_at_the_clamp() {
        for load in [100.0, 160.0, 560.0, 2000.0, 4000.0] {
            let [x, y] = level(load);
            // It turns down within a few bending lengths (B/w)^(1/3), independent of the far half:
            // the weight below pulls with wL, so √(B/(wL)) = load^(−1/2) is the length of the bend.
            let bend = load.powf(-0.5);
            assert!(x > 0.5 * bend && x < 2.5 * bend, "{load}: {x}");
            assert!(y < -1.0 + 2.5 * bend, "{load}: {y}");
        }
    }

    #[test]
    fn a_stiff_strip_keeps_the_slope_of_its_clamp() {
        // Its rotation is at most wL³/(6B), 2e-4 here.
        for clamp in [-1.2_f64, 0.4, 1.0] {
            let [x, y] = Elastica { load: 1e-3, clamp }.end().expect("sound");
            assert!((y.atan2(x) - clamp).abs() < 2e-4);
        }
    }

    #[test]
    fn the_points_of_a_strip_have_the_requested_distance_along_it() {
        let strip = Elastica {
            load: 30.0,
            clamp: 0.5,
        };
        let points = strip.points(50).expect("sound");
        assert_eq!(points.len(), 51);
        assert_eq!(Some(points[50]), strip.end());
        for ends in points.windows(2) {
            // A chord is shorter than its arc by (κs)²/24: with κ below 15 and s = 0.02, 0.4 %.
            let long = (ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1]);
            assert!((0.9962..=1.000_001).contains(&(long * 50.0)), "{long}");
        }
    }
}
