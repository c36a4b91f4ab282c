//! Closed forms to which results are compared. Each names its source; none is a table of numbers.

use crate::solver::{
    Order,
    analytic::{Catenary, Elastica},
};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// The exact result for the continuum. Parameters are in SI units and positive.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Reference {
    /// No closed form: only the converged solution on the same mesh. Springs and volumes have no
    /// Young's modulus, so most solids have no closed form.
    #[serde(alias = "Twin")]
    Converged,
    /// No closed form, but results converge under mesh refinement: the others are compared with the
    /// finest mesh, extrapolated where three levels show an order of convergence.
    FinestMesh,
    /// A conserved quantity, whose drift is 0.
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
    /// Fraction of its energy that a mass on a spring loses per period: 0, as energy is conserved.
    /// The discrete method is predicted to keep E₀(1 + ω²h²)⁻ⁿ.
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
    /// Elongation αmgN(N+1)/2 of N identical springs and masses [m]: link k carries N − k + 1
    /// weights.
    HangingChain {
        /// Links.
        links: u32,
        /// Mass of each [kg].
        mass: f64,
        /// Compliance of each link [m/N], at least 0.
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
    /// Elongation FL/(EA) of a bar under tension [m].
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
    /// Change −νFb/(EA) of the width b of a bar under tension [m].
    NarrowedBar {
        /// Pulling mass [kg].
        mass: f64,
        /// Width b [m].
        width: f64,
        /// Poisson's ratio ν.
        poisson_ratio: f64,
        /// Axial stiffness EA [N].
        stiffness: f64,
        /// Gravity [m/s²].
        gravity: f64,
    },
    /// Mean volume change −ρgH/(2K) of a block in a tightly fitting box under its own weight, where
    /// only K resists: pressure is hydrostatic. First order. For a solid that also resists shear, K
    /// is the modulus of uniaxial strain, E(1 − ν)/((1 + ν)(1 − 2ν)).
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
    /// Sag of an elastic catenary [m] between level supports whose distance is its rest length
    /// (Irvine, *Cable Structures*, 1981, §1.4). As EA → ∞ it is straight.
    ElasticCatenary {
        /// Mass per rest length [kg/m].
        density: f64,
        /// Rest length, and distance of the supports [m].
        length: f64,
        /// Axial stiffness EA [N].
        stiffness: f64,
        /// Gravity [m/s²].
        gravity: f64,
    },
    /// Tip deflection of a slender cantilever under its own weight, ρgL⁴/(8EI) [m] (Euler and
    /// Bernoulli; Timoshenko, *Strength of Materials*, part 1). First order.
    ClampedBeam {
        /// Mass per length [kg/m].
        density: f64,
        /// Length [m].
        length: f64,
        /// Bending stiffness EI [N·m²].
        stiffness: f64,
        /// Gravity [m/s²].
        gravity: f64,
    },
    /// Tip deflection of a strip or rod that is clamped horizontally and bends under its own weight
    /// [m], for large deflections: the heavy elastica Bθ″ + w(L − s) cos θ = 0 (Wang, *A Critical
    /// Review of the Heavy Elastica*, 1986).
    HeavyElastica {
        /// Mass per area of a strip [kg/m²], or per length of a rod [kg/m].
        density: f64,
        /// Free length [m].
        length: f64,
        /// Flexural rigidity B of a strip [N·m], or EI of a rod [N·m²].
        stiffness: f64,
        /// Gravity [m/s²].
        gravity: f64,
    },
    /// Sideways deflection 2p√(EI/P) of the loaded end of a column that is clamped at its foot and has
    /// buckled [m], where K(p) = L√(P/EI) (Timoshenko and Gere, *Theory of Elastic Stability*, 1961,
    /// §2.7); 0 up to Euler's load π²EI/(4L²).
    BuckledColumn {
        /// Mass on its end [kg].
        mass: f64,
        /// Length L [m].
        length: f64,
        /// Flexural rigidity EI [N·m²].
        stiffness: f64,
        /// Gravity [m/s²].
        gravity: f64,
    },
    /// Deflection F ∫ (|m⊥|²/EI + m∥²/GJ) ds of the end of a helix that is clamped at its other end,
    /// along its axis under a weight F at its end [m], where m is the moment of a unit load at the end,
    /// across and along the rod (Castigliano). First order.
    HelixSpring {
        /// Mass at its end [kg].
        mass: f64,
        /// Radius of the helix [m].
        radius: f64,
        /// Its height [m].
        height: f64,
        /// Number of turns.
        turns: f64,
        /// Flexural rigidity EI [N·m²].
        bending: f64,
        /// Torsional rigidity GJ [N·m²].
        twisting: f64,
        /// Gravity [m/s²].
        gravity: f64,
    },
    /// Deflection Pa³/(3EI) + Pb³/(3EI) + Pa²b/(GJ) of the end of an L-shaped cantilever under a weight
    /// P across its plane [m]: the loaded arm of length a bends, and it bends and twists the clamped
    /// arm of length b (Timoshenko, *Strength of Materials*, part 1). First order.
    LBeam {
        /// Mass at its end [kg].
        mass: f64,
        /// Length a of the loaded arm [m], at least 0.
        loaded: f64,
        /// Length b of the clamped arm [m], at least 0.
        clamped: f64,
        /// Flexural rigidity EI [N·m²].
        bending: f64,
        /// Torsional rigidity GJ [N·m²].
        twisting: f64,
        /// Gravity [m/s²].
        gravity: f64,
    },
    /// Angle TL/(GJ) by which a rod twists under the torque T = mga of a weight at the end of a level
    /// arm [rad] (Saint-Venant; Timoshenko, *Strength of Materials*, part 1). First order.
    TwistedRod {
        /// Mass at the end of the arm [kg].
        mass: f64,
        /// Length a of the arm [m].
        arm: f64,
        /// Length L that twists [m].
        length: f64,
        /// Torsional rigidity GJ [N·m²].
        stiffness: f64,
        /// Gravity [m/s²].
        gravity: f64,
    },
    /// Distance that two weights, at opposite points of a level ring of a straight rod, sink below the
    /// pins at the points between them [m], where the rod is twisted against itself by a moment M:
    /// 8PR³/(π EI) · Σ 1/(n²(n² − 1 − m²)) over n = 2, 6, 10, …, with m = MR/EI. First order, from the
    /// equations of a rod without inertia of rotation (Goriely and Tabor, *Nonlinear dynamics of
    /// filaments*, 1997). It grows without limit at m = √3, the critical twist of Michell (1889);
    /// none from there on.
    TwistedRing {
        /// Mass of each of the two weights [kg].
        mass: f64,
        /// Radius R [m].
        radius: f64,
        /// Flexural rigidity EI [N·m²].
        bending: f64,
        /// Torsional rigidity GJ [N·m²].
        twisting: f64,
        /// Twist against the rest shape, M/(GJ) [rad/m].
        twist: f64,
        /// Gravity [m/s²].
        gravity: f64,
    },
    /// Distance ½g(sin θ − µ cos θ)t² that a block slides down a slope from rest [m] (Coulomb); 0
    /// where tan θ ≤ µ.
    SlidingBlock {
        /// Slope θ [degree], from 0 to 90.
        slope: f64,
        /// Coefficient of friction µ.
        friction: f64,
        /// Gravity [m/s²].
        gravity: f64,
        /// Time t [s].
        seconds: f64,
    },
    /// Distance ½g(M − m eᵠ)/(M + m eᵠ)·t², ϕ = µπ, that the heavier of two masses on a light rope
    /// over half a cylinder sinks from rest [m] (Euler and Eytelwein); 0 where M ≤ m eᵠ.
    Capstan {
        /// The heavier mass M [kg].
        heavy: f64,
        /// The lighter mass m [kg].
        light: f64,
        /// Coefficient of friction µ.
        friction: f64,
        /// Gravity [m/s²].
        gravity: f64,
        /// Time t [s].
        seconds: f64,
    },
    /// Time until a long cut runs through a strip of height H between grips that move apart at speed
    /// v [s]. Growing by da, it releases the energy of a piece Hda of the strip, Wt = ½Eε²t/(1 − ν²)
    /// per area as the width is held: ε = √(2G_c(1 − ν²)/(EtH)), whatever the length of the cut
    /// (Rivlin and Thomas, 1953).
    TornStrip {
        /// Toughness of the sheet G_c [J/m].
        toughness: f64,
        /// Young's modulus E [Pa].
        youngs_modulus: f64,
        /// Poisson's ratio ν.
        poisson_ratio: f64,
        /// Thickness t [m].
        thickness: f64,
        /// Height H [m].
        height: f64,
        /// Speed v [m/s].
        speed: f64,
    },
    /// Distance that the uppermost of some rigid bodies in a stack sinks [m]: 0. In each substep of
    /// length h, gravity moves the bodies by gh² before iterations balance their contacts.
    RigidStack {},
}

impl Reference {
    /// The exact value, if there is a closed form.
    #[must_use]
    pub fn value(&self) -> Option<f64> {
        Some(match *self {
            Self::Converged | Self::FinestMesh => return None,
            Self::Conserved | Self::SpringEnergy { .. } | Self::RigidStack {} => 0.0,
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
            Self::NarrowedBar {
                mass,
                width,
                poisson_ratio,
                stiffness,
                gravity,
            } => -poisson_ratio * mass * gravity * width / stiffness,
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
            } => Catenary {
                weight: density * gravity,
                length,
                stiffness,
                span: length,
                drop: 0.0,
            }
            .middle()?,
            Self::ClampedBeam {
                density,
                length,
                stiffness,
                gravity,
            } => density * gravity * length.powi(4) / (8.0 * stiffness),
            Self::HeavyElastica {
                density,
                length,
                stiffness,
                gravity,
            } => {
                let load = density * gravity * length.powi(3) / stiffness;
                -length * Elastica { load, clamp: 0.0 }.end()?[1]
            }
            Self::BuckledColumn {
                mass,
                length,
                stiffness,
                gravity,
            } => buckled(length * (mass * gravity / stiffness).sqrt()) * length,
            Self::HelixSpring {
                mass,
                radius,
                height,
                turns,
                bending,
                twisting,
                gravity,
            } => mass * gravity * helix([radius, height, turns], [bending, twisting]),
            Self::LBeam {
                mass,
                loaded,
                clamped,
                bending,
                twisting,
                gravity,
            } => {
                let bent = (loaded.powi(3) + clamped.powi(3)) / (3.0 * bending);
                mass * gravity * (bent + loaded * loaded * clamped / twisting)
            }
            Self::TwistedRod {
                mass,
                arm,
                length,
                stiffness,
                gravity,
            } => mass * gravity * arm * length / stiffness,
            Self::TwistedRing {
                mass,
                radius,
                bending,
                twisting,
                twist,
                gravity,
            } => {
                let moment = twisting * twist * radius / bending;
                mass * gravity * radius.powi(3) / bending * twisted_ring(moment)?
            }
            Self::SlidingBlock {
                slope,
                friction,
                gravity,
                seconds,
            } => {
                let (sin, cos) = slope.to_radians().sin_cos();
                0.5 * gravity * (sin - friction * cos).max(0.0) * seconds * seconds
            }
            Self::TornStrip {
                toughness,
                youngs_modulus,
                poisson_ratio,
                thickness,
                height,
                speed,
            } => {
                let stiffness = youngs_modulus * thickness / (1.0 - poisson_ratio * poisson_ratio);
                (2.0 * toughness / (stiffness * height)).sqrt() * height / speed
            }
            Self::Capstan {
                heavy,
                light,
                friction,
                gravity,
                seconds,
            } => {
                let held = light * (friction * PI).exp();
                0.5 * gravity * (heavy - held).max(0.0) / (heavy + held) * seconds * seconds
            }
        })
    }

    /// The value that the discrete method itself should give with substeps of `h` seconds, where a
    /// closed form is known. For a period [s]: 2πh/atan(ωh), and for BDF2 2πh/arg ξ with
    /// ξ = (2 + √(1 + 2iωh))/(3 − 2iωh), the root of (3 − 2iωh)ξ² − 4ξ + 1 near 1. For the fraction
    /// of energy lost per period: from E_n = E₀(1 + ω²h²)⁻ⁿ; none for BDF2, where the loss of the
    /// first substep, which is implicit Euler, dominates.
    #[must_use]
    pub fn predicted(&self, h: f64, order: Order) -> Option<f64> {
        match *self {
            Self::SpringPeriod { mass, compliance } => {
                let way = h / (compliance * mass).sqrt();
                let turn = match order.get() {
                    1 => way.atan(),
                    _ => {
                        let modulus = (1.0 + 4.0 * way * way).sqrt();
                        let root = [modulus + 1.0, modulus - 1.0].map(|it| (0.5 * it).sqrt());
                        root[1].atan2(2.0 + root[0]) + (2.0 * way).atan2(3.0)
                    }
                };
                Some(TAU * h / turn)
            }
            Self::SpringEnergy { .. } if order.get() != 1 => None,
            Self::SpringEnergy { mass, compliance } => {
                let omega = 1.0 / (compliance * mass).sqrt();
                let substeps = TAU / omega / h;
                Some(1.0 - (-substeps * (omega * omega * h * h).ln_1p()).exp())
            }
            _ => None,
        }
    }

    /// Its name in reports.
    #[must_use]
    pub const fn words(&self) -> &'static str {
        match self {
            Self::Converged => "converged solution on the same mesh",
            Self::FinestMesh => "limit of mesh refinement",
            Self::Conserved => "0 (conserved)",
            Self::HangingMass { .. } => "αmg",
            Self::SpringPeriod { .. } => "2π√(αm)",
            Self::SpringEnergy { .. } => "0 (energy is conserved)",
            Self::PendulumPeriod { .. } => "4√(L/g) K(sin θ₀/2)",
            Self::HangingChain { .. } => "αmgN(N+1)/2",
            Self::HangingBar { .. } => "ρgL²/(2EA)",
            Self::PulledBar { .. } => "FL/(EA)",
            Self::NarrowedBar { .. } => "−νFb/(EA)",
            Self::ConfinedBlock { .. } => "−ρgH/(2K)",
            Self::ElasticCatenary { .. } => "sag of an elastic catenary",
            Self::ClampedBeam { .. } => "ρgL⁴/(8EI)",
            Self::HeavyElastica { .. } => "heavy elastica",
            Self::BuckledColumn { .. } => "2p√(EI/P), K(p) = L√(P/EI)",
            Self::HelixSpring { .. } => "F ∫ (m⊥²/EI + m∥²/GJ) ds",
            Self::LBeam { .. } => "Pa³/(3EI) + Pb³/(3EI) + Pa²b/(GJ)",
            Self::TwistedRod { .. } => "TL/(GJ)",
            Self::TwistedRing { .. } => "8PR³/(π EI) Σ 1/(n²(n² − 1 − m²))",
            Self::SlidingBlock { .. } => "½g(sin θ − µ cos θ)t²",
            Self::Capstan { .. } => "½g(M − m eᵠ)/(M + m eᵠ)·t²",
            Self::TornStrip { .. } => "√(2G_c(1 − ν²)/(EtH))·H/v",
            Self::RigidStack {} => "0 (rigid)",
        }
    }
}

/// Complete elliptic integral of the first kind K(k) by the arithmetic-geometric mean (Abramowitz
/// and Stegun, 17.6.1): π / (2 agm(1, √(1−k²))).
fn elliptic_k(k: f64) -> f64 {
    let (mut a, mut b) = (1.0, (1.0 - k * k).sqrt());
    // The number of correct digits doubles in each round, from any start: 64 rounds are more than
    // enough.
    for _ in 0..64 {
        (a, b) = ((a + b) / 2.0, (a * b).sqrt());
    }
    PI / (2.0 * a)
}

/// Sideways deflection of a buckled column over its length, under a load with `reach` = L√(P/EI).
fn buckled(reach: f64) -> f64 {
    if reach <= PI / 2.0 {
        return 0.0;
    }
    // K grows from π/2 at 0 without limit. Each halving adds a binary digit.
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..64 {
        let middle = (low + high) / 2.0;
        match elliptic_k(middle) < reach {
            true => low = middle,
            false => high = middle,
        }
    }
    2.0 * low / reach
}

/// Deflection of the end of a helix of this radius, height [m] and number of turns per force along its
/// axis [m/N], for the rigidities EI and GJ [N·m²].
fn helix([radius, height, turns]: [f64; 3], [bending, twisting]: [f64; 2]) -> f64 {
    /// Even; the error of Simpson's rule decreases with its fourth power.
    const PARTS: u32 = 20_000;
    let angle = TAU * turns;
    let length = (angle * radius).hypot(height);
    let at = |part: f64| {
        let (sin, cos) = (angle * part).sin_cos();
        DVec3::new(radius * cos, -height * part, radius * sin)
    };
    let end = at(1.0);
    let flexibility = |part: f64| {
        let (sin, cos) = (angle * part).sin_cos();
        let along = DVec3::new(-radius * angle * sin, -height, radius * angle * cos);
        let along = along.normalize_or_zero();
        let moment = (end - at(part)).cross(DVec3::Y);
        let twisted = moment.dot(along);
        let bent = moment.length_squared() - twisted * twisted;
        bent / bending + twisted * twisted / twisting
    };
    let sum: f64 = (0..=PARTS)
        .map(|index| {
            let weight = match index {
                0 | PARTS => 1.0,
                _ if index % 2 == 1 => 4.0,
                _ => 2.0,
            };
            weight * flexibility(f64::from(index) / f64::from(PARTS))
        })
        .sum();
    length * sum / (3.0 * f64::from(PARTS))
}

/// Distance that opposite weights sink on a ring whose radius, weight and flexural rigidity are 1, for a
/// twisting moment; none from Michell's critical twist on.
fn twisted_ring(moment: f64) -> Option<f64> {
    /// Terms fall with n⁻⁴: what is left out is less than 1e-12 of the sum.
    const TERMS: u32 = 5000;
    let term = |index: u32| {
        let square = f64::from(4 * index + 2).powi(2);
        1.0 / (square * (square - 1.0 - moment * moment))
    };
    let below = moment * moment < 3.0;
    below.then(|| 8.0 / PI * (0..TERMS).rev().map(term).sum::<f64>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_sinks_without_limit_at_michells_twist() {
        // Between a pin and a weight, ζ⁗ + ζ″ = 0 with ζ′ = 0 at both and a shear force P/2:
        // P/2 (2 − π/2). What the series leaves out is 1e-12 of it.
        let found = twisted_ring(0.0).expect("no twist");
        assert!((found / (1.0 - PI / 4.0) - 1.0).abs() < 1e-11, "{found}");
        // Close to the critical twist the first term is nearly all: 8/π / (4 (3 − m²)), and others are
        // less than 1e-8 of it.
        let close = twisted_ring((3.0 - 1e-6_f64).sqrt()).expect("below");
        assert!((close / (2e6 / PI) - 1.0).abs() < 1e-8, "{close}");
        assert_eq!(twisted_ring(3.0_f64.sqrt() + 1e-9), None);
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
        // K(sin 45°) = 1.8540746773 from tables, accurate to the last digit.
        let large = pendulum(90.0).value().expect("closed form");
        assert!((large * 9.81_f64.sqrt() / 4.0 - 1.854_074_677_3).abs() < 1e-10);
    }

    #[test]
    fn a_column_stands_below_eulers_load_and_bends_far_above_it() {
        use std::f64::consts::FRAC_PI_2;
        assert_eq!(buckled(0.999 * FRAC_PI_2), 0.0);
        // Near the load, K = π/2 (1 + p²/4): p = 2√ε at (1 + ε) π/2, and the deflection 8√ε/π.
        let small = buckled(FRAC_PI_2 * (1.0 + 1e-6));
        assert!((small / (8e-3 / PI) - 1.0).abs() < 1e-5, "{small}");
        // Timoshenko and Gere, table 2-4: at a slope of 60°, P/P_E = 1.152 and x/l = 0.593; at 140°,
        // 2.541 and 0.750.
        for (load, expected) in [(1.152_f64, 0.593), (2.541, 0.750)] {
            let found = buckled(FRAC_PI_2 * load.sqrt());
            // P/P_E is rounded by 5e-4, at a slope of at most 2; the table by 5e-4.
            assert!((found - expected).abs() < 1.5e-3, "{load}: {found}");
        }
    }

    #[test]
    fn a_flat_helix_of_a_quarter_turn_is_a_curved_beam() {
        // A flat quarter ring, loaded across its plane at its end: with the angle φ from the end, the
        // moments are R sin φ across and R(1 − cos φ) along the rod (Timoshenko, *Strength of
        // Materials*, part 1, §80). R³(π/4 / EI + (3π/4 − 2) / GJ).
        let found = helix([0.5, 0.0, 0.25], [3.0, 2.0]);
        let expected = 0.125 * (PI / 4.0 / 3.0 + (0.75 * PI - 2.0) / 2.0);
        assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
    }

    #[test]
    fn an_l_shaped_beam_is_two_cantilevers_and_a_twisted_rod() {
        let (mass, gravity, bending, twisting) = (0.4, 9.81, 3.0, 2.0);
        let beam = |[loaded, clamped]: [f64; 2]| {
            let beam = Reference::LBeam {
                mass,
                loaded,
                clamped,
                bending,
                twisting,
                gravity,
            };
            beam.value().expect("closed form")
        };
        // Without one of its arms it is a straight cantilever, PL³/(3EI). Rounding.
        let straight = mass * gravity * 0.125 / (3.0 * bending);
        for arms in [[0.5, 0.0], [0.0, 0.5]] {
            assert!((beam(arms) / straight - 1.0).abs() < 1e-14, "{arms:?}");
        }
        // What the twist of the clamped arm adds is its angle times the loaded arm.
        let (arm, length) = (0.3, 0.7);
        let rod = Reference::TwistedRod {
            mass,
            arm,
            length,
            stiffness: twisting,
            gravity,
        };
        let angle = rod.value().expect("closed form");
        let bent = beam([arm, 0.0]) + beam([0.0, length]);
        let found = (beam([arm, length]) - bent) / arm;
        // Rounding of a difference of numbers of twice its size.
        assert!((found / angle - 1.0).abs() < 1e-14, "{found} {angle}");
    }

    #[test]
    fn the_discrete_oscillator_tends_to_the_continuous_one() {
        let period = Reference::SpringPeriod {
            mass: 1.0,
            compliance: 0.02,
        };
        let (exact, discrete) = (period.value(), period.predicted(1e-5, Order::default()));
        let (exact, discrete) = (exact.expect("given"), discrete.expect("given"));
        // (ωh)²/3 = 2e-9, and rounding.
        assert!((discrete / exact - 1.0).abs() < 1e-8);
        let second = period
            .predicted(1e-5, Order::new(2).expect("there are two"))
            .expect("given");
        assert!((second / exact - 1.0).abs() < 1e-8);
        let energy = Reference::SpringEnergy {
            mass: 1.0,
            compliance: 0.02,
        };
        // Lost fraction of energy per period: 2πωh = 4e-4 to first order.
        let lost = energy.predicted(1e-5, Order::default()).expect("given");
        assert!((lost / (TAU * 1e-5 / 0.02_f64.sqrt()) - 1.0).abs() < 1e-3);
    }
}
