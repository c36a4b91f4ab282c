//! Rods: edges with stiffness against stretching, shear, bending and twist.

use super::{
    Effect, Figures, Parameter, Scale,
    elastic::{body_elements, body_figures},
    parameter,
};
use crate::{
    simulation::SoftBody,
    solver::{
        BodyEffectKind, Curl, Damping, PoissonRatio, Rod, RodRadius, RodShape, SectionStiffness,
        Settings, Twist, YoungsModulus, advance::Stage,
    },
};
use bevy::prelude::*;

/// Largest twist of a segment [rad] at which joints are as stiff as they should be, within 5 %.
const MAX_TURN: f32 = 0.5;

impl Effect for Rod {
    const NAME: &'static str = "rod";
    const TITLE: &'static str = "Rod";
    const SUMMARY: &'static str =
        "Edges resist stretching, shear, bending and twist. Solved directly.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            youngs_modulus: YoungsModulus, "Young's modulus", "Pa",
            "Stiffness of the material: rubber 1e6, nylon 3e9, steel 2e11 Pa.",
            (1e3, 1e12), Scale::LogarithmicToInfinity
        ),
        parameter!(
            poisson_ratio: PoissonRatio, "Poisson's ratio", "",
            "Transverse contraction over axial extension; it gives the stiffness against twist, G = E/(2(1 + ν)).",
            (0.0, 0.499), Scale::Linear
        ),
        parameter!(
            radius: RodRadius, "Radius", "m",
            "Radius of the circular section. Stiffness against bending and twist grows with its fourth power; the mass does not change.",
            (1e-4, 0.1), Scale::Logarithmic
        ),
        parameter!(
            bending_stiffness: SectionStiffness, "Bending EI", "N·m²",
            "Stiffness against bending of a section that is not a circle, such as a yarn; 0 is that of a circle.",
            (1e-9, 1e4), Scale::LogarithmicFromZero
        ),
        parameter!(
            twisting_stiffness: SectionStiffness, "Twisting GJ", "N·m²",
            "Stiffness against twist of a section that is not a circle; 0 is that of a circle.",
            (1e-9, 1e4), Scale::LogarithmicFromZero
        ),
        parameter!(
            curl: Curl, "Curl", "× mesh",
            "Curvature at rest, relative to that of the mesh: 0 is straight.",
            (0.0, 2.0), Scale::Linear
        ),
        parameter!(
            twist: Twist, "Twist", "rad/m",
            "Twist at rest: a curved rod becomes a helix, a closed one leaves its plane.",
            (-100.0, 100.0), Scale::Linear
        ),
        parameter!(
            damping: Damping, "Damping", "s",
            "Damping time constant of all deformation. 0 leaves only numerical damping.",
            (1e-4, 1.0), Scale::LogarithmicFromZero
        ),
    ];

    type State = ();
    const STAGES: &'static [Stage] = &[Stage::Body(BodyEffectKind::Rod)];

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }

    fn unfit(body: &EntityRef, _: &Settings) -> Option<String> {
        let topology = &body.get::<SoftBody>()?.0;
        RodShape::of(topology)
            .err()
            .map(|reason| reason.to_string())
    }

    fn note(&self, body: &EntityRef, _: &Settings) -> Option<String> {
        let edges = &body.get::<SoftBody>()?.0.edges;
        let longest = edges.rest_length.iter().copied().fold(0.0, f32::max);
        (self.twist.get().abs() * longest > MAX_TURN).then(|| {
            "The twist is more than 0.5 rad per segment: use more segments, or less of it."
                .to_owned()
        })
    }

    fn elements(&self, body: &EntityRef) -> usize {
        body_elements(BodyEffectKind::Rod, body)
    }

    fn figures(&self, body: &EntityRef, h: f32) -> Figures {
        body_figures(BodyEffectKind::Rod, body, h)
    }
}
