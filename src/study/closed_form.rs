//! Closed forms that an answer is held against. Each says where it is from; none is a table of
//! numbers.

use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// What the continuum, or mathematics, says. Parameters are in SI units and above zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Reference {
    /// Nothing: there is only the converged answer on the same mesh. Springs and volumes have no
    /// Young's modulus, so most solids have no closed form.
    Twin,
    /// Nothing, but the answer tends to something as the mesh is refined: that of the finest mesh
    /// is what the others are held against, extrapolated where three levels show an order.
    FinestMesh,
    /// A conserved quantity: its drift is 0.
    Conserved,
    /// Stretch αmg of a spring under a weight [m] (Hooke).
    HangingMass {
        /// Mass [kg].
        mass: f64,
        /// Compliance [m/N].
        compliance: f64,
        /// Gravity [m/s²].
        gravity: f64,
    },
    /// Period 2π√(αm) of a mass on a spring [s].
    SpringPeriod {
        /// Mass [kg].
        mass: f64,
        /// Compliance [m/N].
        compliance: f64,
    },
    /// Energy that a mass on a spring loses in a period: none, as it is conserved. The discrete
    /// method keeps E₀(1 + ω²h²)⁻ⁿ, which is what is predicted.
    SpringEnergy {
        /// Mass [kg].
        mass: f64,
        /// Compliance [m/N].
        compliance: f64,
    },
    /// Period 4√(L/g) K(sin θ₀/2) of a pendulum of any amplitude [s] (Landau and Lifshitz,
    /// *Mechanics*, §11, problem 1).
    PendulumPeriod {
        /// Length [m].
        length: f64,
        /// Amplitude [degree], from 0 to below 180.
        amplitude: f64,
        /// Gravity [m/s²].
        gravity: f64,
    },
    /// Elongation αmgN(N+1)/2 of N alike springs and masses [m]: link k carries N − k + 1 weights.
    HangingChain {
        /// Links.
        links: u32,
        /// Mass of each [kg].
        mass: f64,
        /// Compliance of each link [m/N], from 0.
        compliance: f64,
        /// Gravity [m/s²].
        gravity: f64,
    },
    /// Elongation ρgL²/(2EA) of a bar under its own weight [m] (Timoshenko, *Strength of
    /// Materials*, part 1, §3).
    HangingBar {
        /// Mass per length [kg/m].
        density: f64,
        /// Length [m].
        length: f64,
        /// Axial stiffness EA [N].
        stiffness: f64,
        /// Gravity [m/s²].
        gravity: f64,
    },
    /// Elongation FL/(EA) of a bar that is pulled [m].
    PulledBar {
        /// Pulling mass [kg].
        mass: f64,
        /// Length [m].
        length: f64,
        /// Axial stiffness EA [N].
        stiffness: f64,
        /// Gravity [m/s²].
        gravity: f64,
    },
    /// Mean change of volume −ρgH/(2K) of a block in a box that fits, under its own weight, where
    /// only K resists: pressure is hydrostatic. To first order in it.
    ConfinedBlock {
        /// Density [kg/m³].
        density: f64,
        /// Height [m].
        height: f64,
        /// Bulk modulus [Pa].
        bulk_modulus: f64,
        /// Gravity [m/s²].
        gravity: f64,
    },
    /// Sag of an elastic catenary [m] whose length at rest is the distance of its ends, which are
    /// level (Irvine, *Cable Structures*, 1981, §1.4). As EA → ∞ it is straight.
    ElasticCatenary {
        /// Mass per length at rest [kg/m].
        density: f64,
        /// Length at rest, and distance of the ends [m].
        length: f64,
        /// Axial stiffness EA [N].
        stiffness: f64,
        /// Gravity [m/s²].
        gravity: f64,
    },
    /// How far the end of a strip hangs down [m] that is held level at the other and bends under its
    /// own weight, however far: the heavy elastica Bθ″ + w(L − s) cos θ = 0 (Wang, *A Critical Review
    /// of the Heavy Elastica*, 1986).
    HeavyElastica {
        /// Mass per area [kg/m²].
        density: f64,
        /// Length that is free [m].
        length: f64,
        /// Flexural rigidity B [N·m].
        stiffness: f64,
        /// Gravity [m/s²].
        gravity: f64,
    },
}

impl Reference {
    /// What it says, if there is a closed form.
    #[must_use]
    pub fn value(&self) -> Option<f64> {
        Some(match *self {
            Self::Twin | Self::FinestMesh => return None,
            Self::Conserved | Self::SpringEnergy { .. } => 0.0,
            Self::HangingMass {
                mass,
                compliance,
                gravity,
            } => compliance * mass * gravity,
            Self::SpringPeriod { mass, compliance } => TAU * (compliance * mass).sqrt(),
            Self::PendulumPeriod {
                length,
                amplitude,
                gravity,
            } => {
                let modulus = (amplitude.to_radians() / 2.0).sin();
                4.0 * (length / gravity).sqrt() * elliptic_k(modulus)
            }
            Self::HangingChain {
                links,
                mass,
                compliance,
                gravity,
            } => {
                let links = f64::from(links);
                compliance * mass * gravity * links * (links + 1.0) / 2.0
            }
            Self::HangingBar {
                density,
                length,
                stiffness,
                gravity,
            } => density * gravity * length * length / (2.0 * stiffness),
            Self::PulledBar {
                mass,
                length,
                stiffness,
                gravity,
            } => mass * gravity * length / stiffness,
            Self::ConfinedBlock {
                density,
                height,
                bulk_modulus,
                gravity,
            } => -density * gravity * height / (2.0 * bulk_modulus),
            Self::ElasticCatenary {
                density,
                length,
                stiffness,
                gravity,
            } => catenary_sag(density * gravity, length, stiffness),
            Self::HeavyElastica {
                density,
                length,
                stiffness,
                gravity,
            } => -length * elastica_end(density * gravity * length.powi(3) / stiffness).1,
        })
    }

    /// What the discrete method itself should give with substeps of `h` seconds, if a closed form
    /// tells: for a period [s], 2πh/atan(ωh); for the share of energy lost in a period, as
    /// E_n = E₀(1 + ω²h²)⁻ⁿ has it.
    #[must_use]
    pub fn predicted(&self, h: f64) -> Option<f64> {
        match *self {
            Self::SpringPeriod { mass, compliance } => {
                let omega = 1.0 / (compliance * mass).sqrt();
                Some(TAU * h / (omega * h).atan())
            }
            Self::SpringEnergy { mass, compliance } => {
                let omega = 1.0 / (compliance * mass).sqrt();
                let substeps = TAU / omega / h;
                Some(1.0 - (-substeps * (omega * omega * h * h).ln_1p()).exp())
            }
            _ => None,
        }
    }

    /// What reports call it.
    #[must_use]
    pub const fn words(&self) -> &'static str {
        match self {
            Self::Twin => "the converged answer of the same mesh",
            Self::FinestMesh => "the answer that the meshes tend to",
            Self::Conserved => "0, as it is conserved",
            Self::HangingMass { .. } => "αmg",
            Self::SpringPeriod { .. } => "2π√(αm)",
            Self::SpringEnergy { .. } => "0, as energy is conserved",
            Self::PendulumPeriod { .. } => "4√(L/g) K(sin θ₀/2)",
            Self::HangingChain { .. } => "αmgN(N+1)/2",
            Self::HangingBar { .. } => "ρgL²/(2EA)",
            Self::PulledBar { .. } => "FL/(EA)",
            Self::ConfinedBlock { .. } => "−ρgH/(2K)",
            Self::ElasticCatenary { .. } => "the sag of an elastic catenary",
            Self::HeavyElastica { .. } => "the heavy elastica",
        }
    }
}

/// Complete elliptic integral of the first kind K(k) by the arithmetic-geometric mean (Abramowitz
/// and Stegun, 17.6.1): π / (2 agm(1, √(1−k²))).
fn elliptic_k(k: f64) -> f64 {
    let (mut a, mut b) = (1.0, (1.0 - k * k).sqrt());
    // Digits double in each round, from any start: 64 are more than enough.
    for _ in 0..64 {
        (a, b) = ((a + b) / 2.0, (a * b).sqrt());
    }
    PI / (2.0 * a)
}

/// Sag in the middle of a cable of weight `w` [N/m], with H from x(L₀) = L₀ by bisection:
///
/// HL₀/EA + (2H/w) asinh(wL₀/2H) = L₀,
/// sag = wL₀²/(8EA) + (H/w)(√(1 + (wL₀/2H)²) − 1).
fn catenary_sag(w: f64, length: f64, stiffness: f64) -> f64 {
    let half = w * length / 2.0;
    let span = |h: f64| h * length / stiffness + 2.0 * h / w * (half / h).asinh();
    // Under H = EA alone the cable would be twice as long as its span.
    let (mut low, mut high) = (0.0, stiffness);
    for _ in 0..200 {
        let middle = (low + high) / 2.0;
        if span(middle) < length {
            low = middle;
        } else {
            high = middle;
        }
    }
    let h = high;
    w * length * length / (8.0 * stiffness) + h / w * ((1.0 + (half / h).powi(2)).sqrt() - 1.0)
}

/// Where the free end of a heavy elastica of length 1 is, (x, y), for wL³/B: by shooting for the
/// curvature at the clamp with which there is none at the end, each shot by Runge and Kutta's
/// fourth-order steps.
fn elastica_end(load: f64) -> (f64, f64) {
    const STEPS: u32 = 2000;
    let step = 1.0 / f64::from(STEPS);
    let rate = |s: f64, [angle, curvature, ..]: [f64; 4]| {
        let bends = load * (1.0 - s) * angle.cos();
        [curvature, bends, angle.cos(), angle.sin()]
    };
    let shoot = |curvature: f64| {
        let mut state = [0.0, curvature, 0.0, 0.0];
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
        }
        state
    };
    // It bends most at the clamp, by less than all its weight at its end would bend a straight one.
    let (mut low, mut high) = (-load, 0.0);
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if shoot(middle)[1] < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let [_, _, x, y] = shoot(high);
    (x, y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_strip_that_hardly_bends_hangs_as_a_beam_and_one_that_bends_far_as_peirce_says() {
        // wL⁴/(8B), to first order in (wL³/B)², which is 1e-6 here.
        let (_, y) = elastica_end(1e-3);
        assert!((-y / (1e-3 / 8.0) - 1.0).abs() < 1e-5, "{y}");
        // Where the bending length c = (B/w)^(1/3) is half of what hangs over, the chord is 41.5° below
        // the level: the angle that testers of fabrics have.
        let angle = |load: f64| {
            let (x, y) = elastica_end(load);
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
    fn a_small_swing_takes_the_time_of_a_small_swing() {
        let pendulum = |amplitude| Reference::PendulumPeriod {
            length: 1.0,
            amplitude,
            gravity: 9.81,
        };
        let small = pendulum(0.01).value().expect("closed form");
        // T = T₀(1 + θ₀²/16 + …), and θ₀²/16 is 2e-9.
        assert!((small / (TAU / 9.81_f64.sqrt()) - 1.0).abs() < 1e-8);
        // K(sin 45°) = 1.8540746773, as tables have it, to their last digit.
        let large = pendulum(90.0).value().expect("closed form");
        assert!((large * 9.81_f64.sqrt() / 4.0 - 1.854_074_677_3).abs() < 1e-10);
    }

    #[test]
    fn a_stiff_cable_sags_as_a_parabola_does() {
        // wL²/(8H) with H from EA (strain = 8 s²/(3 L²)): s³ = 3wL⁴/(64 EA), to first order in
        // (s/L)², which is 2e-4 here.
        let (w, length, stiffness) = (1.0, 1.0, 20_000.0);
        let parabola = f64::cbrt(3.0 * w * length * length * length * length / (64.0 * stiffness));
        let sag = catenary_sag(w, length, stiffness);
        assert!((sag / parabola - 1.0).abs() < 1e-3, "{sag} and {parabola}");
    }

    #[test]
    fn the_discrete_oscillator_tends_to_the_continuous_one() {
        let period = Reference::SpringPeriod {
            mass: 1.0,
            compliance: 0.02,
        };
        let (exact, discrete) = (period.value(), period.predicted(1e-5));
        let (exact, discrete) = (exact.expect("given"), discrete.expect("given"));
        // (ωh)²/3 = 2e-9, and rounding.
        assert!((discrete / exact - 1.0).abs() < 1e-8);
        let energy = Reference::SpringEnergy {
            mass: 1.0,
            compliance: 0.02,
        };
        // 2πωh = 4e-4 of it a period, to first order.
        let lost = energy.predicted(1e-5).expect("given");
        assert!((lost / (TAU * 1e-5 / 0.02_f64.sqrt()) - 1.0).abs() < 1e-3);
    }
}
