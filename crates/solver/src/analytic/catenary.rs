//! The elastic catenary (Irvine, *Cable Structures*, 1981, §1.4).

/// A cable that hangs between two points under its own weight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Catenary {
    /// Weight per rest length [N/m], above 0.
    pub weight: f64,
    /// Rest length [m], above 0.
    pub length: f64,
    /// Axial stiffness EA [N], above 0; ∞ is inextensible.
    pub stiffness: f64,
    /// Horizontal distance from the beginning to the end [m], above 0.
    pub span: f64,
    /// Vertical distance of the end below the beginning [m].
    pub drop: f64,
}

/// Bisection steps: more than the bits of a double.
const HALVINGS: u32 = 60;

impl Catenary {
    /// Points at equal intervals of the rest length, as the horizontal distance from the beginning
    /// and the distance below it [m]. `None` if there is no such cable: an inextensible one that is
    /// shorter than the distance of its ends.
    #[must_use]
    pub fn points(&self, parts: u32) -> Option<Vec<[f64; 2]>> {
        let (level, upright) = self.pulls()?;
        let at = |part: u32| {
            self.at(
                self.length * f64::from(part) / f64::from(parts),
                level,
                upright,
            )
        };
        Some((0..=parts).map(at).collect())
    }

    /// Depth of the middle of its length below the beginning [m].
    #[must_use]
    pub fn middle(&self) -> Option<f64> {
        let (level, upright) = self.pulls()?;
        Some(self.at(self.length / 2.0, level, upright)[1])
    }

    /// Position of the point at rest length `s` along the cable, for the given horizontal and
    /// vertical forces at its beginning [N]:
    ///
    /// x = Hs/EA + (H/w)[asinh(V/H) − asinh((V − ws)/H)],
    /// y = (s/EA)(V − ws/2) + (1/w)[√(H² + V²) − √(H² + (V − ws)²)].
    fn at(&self, s: f64, level: f64, upright: f64) -> [f64; 2] {
        let left = upright - self.weight * s;
        let x = level * s / self.stiffness
            + level / self.weight * ((upright / level).asinh() - (left / level).asinh());
        // Difference of the roots without cancellation.
        let roots = level.hypot(upright) + level.hypot(left);
        let y =
            s / self.stiffness * (upright - self.weight * s / 2.0) + s * (upright + left) / roots;
        [x, y]
    }

    /// Forces at the beginning for which the end is in the right place, by bisection: the end moves
    /// down as V grows, and away as H grows.
    fn pulls(&self) -> Option<(f64, f64)> {
        let apart = self.span.hypot(self.drop);
        let sound = [self.weight, self.length, self.stiffness, self.span];
        if sound.iter().any(|&number| number.is_nan() || number <= 0.0)
            || !(self.weight.is_finite() && self.length.is_finite() && apart.is_finite())
            || (self.stiffness.is_infinite() && self.length <= apart)
        {
            return None;
        }
        let upright = |level: f64| {
            let low = |upright| self.at(self.length, level, upright)[1] - self.drop;
            halve(self.weight * self.length, low)
        };
        let far = |level: f64| self.at(self.length, level, upright(level))[0] - self.span;
        // Horizontal forces of any size are within a few powers of e of the weight.
        let pull = |power: f64| self.weight * self.length * power.exp();
        let level = pull(halve(1.0, |power| far(pull(power))));
        Some((level, upright(level)))
    }
}

/// Root of an increasing function, starting from an estimate of its magnitude.
fn halve(scale: f64, function: impl Fn(f64) -> f64) -> f64 {
    let mut reach = scale;
    for _ in 0..HALVINGS {
        if function(-reach) < 0.0 && function(reach) > 0.0 {
            break;
        }
        reach *= 2.0;
    }
    let (mut low, mut high) = (-reach, reach);
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(low, high);
        if function(middle) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    f64::midpoint(low, high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stiff_cable_sags_as_a_parabola_does() {
        // wL²/(8H) with H from EA (strain = 8 s²/(3 L²)): s³ = 3wL⁴/(64 EA), to first order in
        // (s/L)², which is 2e-4 here.
        let cable = Catenary {
            weight: 1.0,
            length: 1.0,
            stiffness: 20_000.0,
            span: 1.0,
            drop: 0.0,
        };
        let parabola = f64::cbrt(3.0 / (64.0 * cable.stiffness));
        let sag = cable.middle().expect("there is one");
        assert!((sag / parabola - 1.0).abs() < 1e-3, "{sag} and {parabola}");
    }

    #[test]
    fn a_cable_that_does_not_stretch_is_a_hyperbolic_cosine() {
        // y = a cosh(x/a) between level ends 2 m apart with a = 1: half the length is sinh 1, and
        // the depth is cosh 1 − 1.
        let cable = Catenary {
            weight: 3.0,
            length: 2.0 * 1.0_f64.sinh(),
            stiffness: f64::INFINITY,
            span: 2.0,
            drop: 0.0,
        };
        let sag = cable.middle().expect("there is one");
        assert!((sag - (1.0_f64.cosh() - 1.0)).abs() < 1e-12, "{sag}");
        let too_short = Catenary { span: 2.5, ..cable };
        assert_eq!(too_short.points(10), None);
    }

    #[test]
    fn a_cable_between_uneven_ends_meets_both_and_is_as_long_as_its_tension_makes_it() {
        for (span, drop, stiffness) in [
            (0.7, 0.5, 50.0),
            (0.2, -0.9, 5.0),
            (1.4, 0.1, f64::INFINITY),
            (3.0, 2.0, 30.0),
        ] {
            let cable = Catenary {
                weight: 2.0,
                length: 1.5,
                stiffness,
                span,
                drop,
            };
            let points = cable.points(3000).expect("there is one");
            let [first, last] = [points[0], points[3000]];
            assert_eq!(first, [0.0, 0.0]);
            assert!((last[0] - span).hypot(last[1] - drop) < 1e-9, "{last:?}");
            // Every piece carries T = √(H² + (V − ws)²) and has the length l(1 + T/EA). H is
            // constant. A chord is shorter than its arc by (κl)²/24, and κ is at most w/H.
            let (level, upright) = cable.pulls().expect("there is one");
            for (part, ends) in points.windows(2).enumerate() {
                let long = (ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1]);
                let s = 1.5 * (part as f64 + 0.5) / 3000.0;
                let tension = level.hypot(upright - 2.0 * s);
                let expected = 1.5 / 3000.0 * (1.0 + tension / stiffness);
                let bend = 2.0 * expected / level;
                let off = (long / expected - 1.0).abs();
                assert!(off < 1e-9 + bend * bend / 8.0, "{part}: {off}");
            }
        }
    }
}
