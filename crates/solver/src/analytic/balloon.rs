//! A spherical skin filled with a gas or a liquid (Young 1805, Laplace 1806).

/// A filled sphere without other loads; small changes of its thickness are neglected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Balloon {
    /// Radius R₀ at rest [m], above 0.
    pub radius: f64,
    /// f, the free volume of the filling over the rest volume, above 0.
    pub factor: f64,
    /// Bulk modulus K of the filling [Pa], above 0: its overpressure is K (f V₀/V − 1). ∞ keeps its
    /// volume.
    pub bulk_modulus: f64,
    /// Et/(1 − ν) of a skin of Saint Venant–Kirchhoff material [N/m], from 0.
    pub membrane: f64,
    /// Stiffness k of a skin of springs [N/m], from 0, which stores ½k(s − 1)² per rest area for
    /// each of two directions: √3 over their compliance for a lattice of equilateral triangles.
    pub lattice: f64,
}

/// Bisection steps: more than the bits of a double.
const HALVINGS: u32 = 60;

impl Balloon {
    /// Equilibrium radius [m].
    #[must_use]
    pub fn filled_radius(&self) -> f64 {
        self.radius * self.stretch()
    }

    /// Equilibrium overpressure [Pa]: 2σ/R.
    #[must_use]
    pub fn overpressure(&self) -> f64 {
        let stretch = self.stretch();
        2.0 * self.tension(stretch) / (self.radius * stretch)
    }

    /// Tension σ of the skin [N/m] at the stretch `s`: the stored energy grows by 2σ s ds per rest
    /// area.
    fn tension(&self, s: f64) -> f64 {
        0.5 * self.membrane * (s * s - 1.0) + self.lattice * (s - 1.0) / s
    }

    /// Equilibrium stretch s: where K (f/s³ − 1) is 2σ/R.
    fn stretch(&self) -> f64 {
        let own = self.factor.cbrt();
        if self.bulk_modulus.is_infinite() {
            return own;
        }
        // The filling alone would have `own`, the skin alone 1.
        let (mut low, mut high) = (own.min(1.0), own.max(1.0));
        for _ in 0..HALVINGS {
            let s = 0.5 * (low + high);
            let pushed = self.bulk_modulus * (self.factor / s.powi(3) - 1.0);
            if pushed > 2.0 * self.tension(s) / (self.radius * s) {
                low = s;
            } else {
                high = s;
            }
        }
        0.5 * (low + high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BALLOON: Balloon = Balloon {
        radius: 0.1,
        factor: 1.5,
        bulk_modulus: 101_325.0,
        membrane: 600.0,
        lattice: 0.0,
    };

    #[test]
    fn what_pushes_is_what_holds() {
        for lattice in [0.0, 900.0] {
            let balloon = Balloon { lattice, ..BALLOON };
            let ratio = (balloon.filled_radius() / balloon.radius).powi(3);
            let pushed = balloon.bulk_modulus * (balloon.factor / ratio - 1.0);
            assert!((pushed / balloon.overpressure() - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn tension_is_the_slope_of_what_is_stored() {
        // Per rest area: a membrane stores ¼ Et/(1 − ν) (s² − 1)², springs k (s − 1)².
        let stored =
            |s: f64| 0.25 * BALLOON.membrane * (s * s - 1.0).powi(2) + 300.0 * (s - 1.0).powi(2);
        let balloon = Balloon {
            lattice: 300.0,
            ..BALLOON
        };
        for s in [0.9, 1.0, 1.3] {
            let slope = (stored(s + 1e-6) - stored(s - 1e-6)) / 2e-6;
            assert!((slope - 2.0 * balloon.tension(s) * s).abs() < 1e-5 * 600.0);
        }
    }

    #[test]
    fn a_skin_without_stiffness_gives_way_and_a_stiff_one_does_not() {
        let soft = Balloon {
            membrane: 0.0,
            ..BALLOON
        };
        assert!((soft.filled_radius() / 0.1 - 1.5_f64.cbrt()).abs() < 1e-12);
        let stiff = Balloon {
            membrane: 1e12,
            ..BALLOON
        };
        assert!((stiff.filled_radius() / 0.1 - 1.0).abs() < 1e-6);
        let liquid = Balloon {
            bulk_modulus: f64::INFINITY,
            ..stiff
        };
        assert!((liquid.filled_radius() / 0.1 - 1.5_f64.cbrt()).abs() < 1e-12);
    }
}
