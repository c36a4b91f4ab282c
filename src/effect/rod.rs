//! Rods: edges with stiffness against stretching, shear, bending and twist.

use super::{
    Effect, Figures, Parameter, Scale,
    elastic::{body_elements, body_figures},
    parameter,
};
use crate::{
    simulation::{Pins, SoftBody},
    solver::{
        BodyEffectKind, Curl, Damping, PoissonRatio, Rod, RodRadius, RodShape, SectionStiffness,
        Settings, TurnRate, Twist, YoungsModulus, advance::Stage,
    },
};
use bevy::prelude::*;
use std::f64::consts::PI;

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
            poisson_ratio: PoissonRatio, "Poisson's ratio ν", "",
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
            "Stiffness against bending of a section that is not a circle, such as a yarn. 0: from E and radius.",
            (1e-9, 1e4), Scale::LogarithmicFromZero
        ),
        parameter!(
            twisting_stiffness: SectionStiffness, "Twisting GJ", "N·m²",
            "Stiffness against twist of a section that is not a circle. 0: from E, ν and radius.",
            (1e-9, 1e4), Scale::LogarithmicFromZero
        ),
        parameter!(
            curl: Curl, "Curl", "× mesh",
            "Curvature at rest, relative to the curvature of the mesh: 0 is straight.",
            (0.0, 2.0), Scale::Linear
        ),
        parameter!(
            twist: Twist, "Twist", "rad/m",
            "Twist at rest: a curved rod becomes a helix, a closed one leaves its plane.",
            (-100.0, 100.0), Scale::Linear
        ),
        parameter!(
            turn_start: TurnRate, "Rotation rate, start", "rad/s",
            "Angular velocity about its axis of the clamped first segment of each chain. It winds a rod up.",
            (-100.0, 100.0), Scale::Linear
        ),
        parameter!(
            turn_end: TurnRate, "Rotation rate, end", "rad/s",
            "Angular velocity about its axis of the clamped last segment of each chain; with the same at the start, the rod turns as a shaft.",
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

    fn note(&self, body: &EntityRef, settings: &Settings) -> Option<String> {
        let topology = &body.get::<SoftBody>()?.0;
        let longest = topology.edges.rest_length.iter().copied();
        if self.twist.get().abs() * longest.fold(0.0, f32::max) > MAX_TURN {
            let text =
                "The twist is more than 0.5 rad per segment: use more segments, or less of it.";
            return Some(text.to_owned());
        }
        let rates = [self.turn_start, self.turn_end].map(|rate| f64::from(rate.get()));
        if !self.turns() {
            return None;
        }
        let substeps = f64::from(settings.substeps.get());
        let h = settings.tick_seconds() / substeps;
        if rates.iter().any(|rate| rate.abs() * h >= PI) {
            let text = "An end turns by more than half a turn per substep: use more substeps.";
            return Some(text.to_owned());
        }
        let pins = body.get::<Pins>().map_or(&[][..], |pins| pins);
        let is_pinned = |particle| pins.contains(&topology.numbering.vertex(particle));
        let shape = RodShape::of(topology).ok()?;
        if shape.roots(1).next().is_none() {
            let text = "Rings and branches have no ends to turn.";
            return Some(text.to_owned());
        }
        let clamped = shape.clamps(is_pinned);
        let is_free = |end: usize| rates[end] != 0.0 && !clamped[end];
        let (parameter, which) = match (is_free(0), is_free(1)) {
            (true, _) => ("Rotation rate, start", "first"),
            (false, true) => ("Rotation rate, end", "last"),
            (false, false) => return None,
        };
        let text = format!("“{parameter}” has no effect: pin the {which} two vertices of a chain.");
        Some(text)
    }

    fn elements(&self, body: &EntityRef) -> usize {
        body_elements(BodyEffectKind::Rod, body)
    }

    fn figures(&self, body: &EntityRef, h: f32) -> Figures {
        body_figures(BodyEffectKind::Rod, body, h)
    }
}
