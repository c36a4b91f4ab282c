//! The heavy elastica (Wang, *A Critical Review of the Heavy Elastica*, 1986).

/// A strip that is held at one end and bends under its own weight, however far: Bθ″ + w(L − s) cos θ = 0.
/// Lengths are in shares of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elastica {
    /// wL³/B, with its weight by area w [N/m²], its length L [m] and its flexural rigidity B [N·m];
    /// above 0.
    pub load: f64,
    /// How steeply it rises where it is held [rad], between −π/2 and π/2.
    pub clamp: f64,
}

/// Steps along the strip.
const STEPS: u32 = 2000;

impl Elastica {
    /// Points of the strip, at equal parts of its length: how far along the level from where it is
    /// held, and how far above it, in lengths. At most as many parts as the strip has steps, 2000.
    #[must_use]
    pub fn points(&self, parts: u32) -> Vec<[f64; 2]> {
        let every = (STEPS / parts.max(1)).max(1);
        let mut points = vec![[0.0, 0.0]];
        self.shoot(self.curvature(), |step, [_, _, x, y]| {
            if (step + 1).is_multiple_of(every) {
                points.push([x, y]);
            }
        });
        points
    }

    /// Where its free end is, in lengths.
    #[must_use]
    pub fn end(&self) -> [f64; 2] {
        let [_, _, x, y] = self.shoot(self.curvature(), |_, _| ());
        [x, y]
    }

    /// The curvature where it is held with which there is none at the free end.
    fn curvature(&self) -> f64 {
        // It bends most at the clamp, by less than all its weight at its end would bend a straight one.
        let (mut low, mut high) = (-self.load, 0.0);
        for _ in 0..60 {
            let middle = f64::midpoint(low, high);
            if self.shoot(middle, |_, _| ())[1] < 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    }

    /// Angle, curvature, x and y at the free end, by Runge and Kutta's steps of fourth order; shows
    /// each step.
    fn shoot(&self, curvature: f64, mut see: impl FnMut(u32, [f64; 4])) -> [f64; 4] {
        let step = 1.0 / f64::from(STEPS);
        let rate = |s: f64, [angle, curvature, ..]: [f64; 4]| {
            let bends = self.load * (1.0 - s) * angle.cos();
            [curvature, bends, angle.cos(), angle.sin()]
        };
        let mut state = [self.clamp, curvature, 0.0, 0.0];
        for index in 0..STEPS {
            let s = f64::from(index) * step;
            let along =
                |k: [f64; 4], share: f64| std::array::from_fn(|i| state[i] + k[i] * (share * step));
            let k1 = rate(s, state);
            let k2 = rate(s + step / 2.0, along(k1, 0.5));
            let k3 = rate(s + step / 2.0, along(k2, 0.5));
            let k4 = rate(s + step, along(k3, 1.0));
            state = std::array::from_fn(|i| {
                state[i] + step / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i])
            });
            see(index, state);
        }
        state
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level(load: f64) -> [f64; 2] {
        Elastica { load, clamp: 0.0 }.end()
    }

    #[test]
    fn a_strip_that_hardly_bends_hangs_as_a_beam_and_one_that_bends_far_as_peirce_says() {
        // wL⁴/(8B), to first order in (wL³/B)², which is 1e-6 here.
        let [_, y] = level(1e-3);
        assert!((-y / (1e-3 / 8.0) - 1.0).abs() < 1e-5, "{y}");
        // Where the bending length c = (B/w)^(1/3) is half of what hangs over, the chord is 41.5° below
        // the level: the angle that testers of fabrics have.
        let angle = |load: f64| {
            let [x, y] = level(load);
            (-y).atan2(x)
        };
        assert!((angle(8.0).to_degrees() - 41.5).abs() < 0.05);
        // Peirce (1930): c = L (cos(θ/2)/(8 tan θ))^(1/3), a factor found by trial on the formula for
        // small angles, which the elastica leaves by 5 % at 62°.
        for load in [2.0, 8.0, 20.0] {
            let angle = angle(load);
            let peirce = f64::cbrt((angle / 2.0).cos() / (8.0 * angle.tan()));
            let off = peirce * f64::cbrt(load) - 1.0;
            assert!(off.abs() < 0.05, "{load}: {off}");
        }
    }

    #[test]
    fn a_stiff_strip_keeps_the_slope_of_its_clamp() {
        // It turns by at most wL³/(6B), 2e-4 here.
        for clamp in [-1.2_f64, 0.4, 1.0] {
            let [x, y] = Elastica { load: 1e-3, clamp }.end();
            assert!((y.atan2(x) - clamp).abs() < 2e-4);
        }
    }

    #[test]
    fn the_points_of_a_strip_are_as_far_apart_along_it_as_was_asked() {
        let strip = Elastica {
            load: 30.0,
            clamp: 0.5,
        };
        let points = strip.points(50);
        assert_eq!(points.len(), 51);
        assert_eq!(points[50], strip.end());
        for ends in points.windows(2) {
            // A chord is shorter than its arc by (κs)²/24: with κ below 15 and s = 0.02, 0.4 %.
            let long = (ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1]);
            assert!((0.9962..=1.000_001).contains(&(long * 50.0)), "{long}");
        }
    }
}
