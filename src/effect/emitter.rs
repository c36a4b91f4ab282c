//! Emitters and sink: grains and bodies appear and disappear.

use super::{Effect, Parameter, Scale, parameter};
use crate::{
    simulation::SoftBody,
    solver::{
        Angle, BodyEmitter, Capacity, Coefficient, Emitter, Finite, Fraction, GrainRadius, Length,
        Lifetime, Seed, Settings, Sink, advance::Stage,
    },
};
use bevy::prelude::*;

impl Effect for Emitter {
    const NAME: &'static str = "emitter";
    const TITLE: &'static str = "Emitter";
    const SUMMARY: &'static str = "Grains flow out of a round opening.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            rate: Coefficient, "Rate", "1/s",
            "Grains per second. A grain that finds no free place waits.",
            (1.0, 10_000.0), Scale::LogarithmicFromZero
        ),
        parameter!(
            capacity: Capacity, "Capacity", "grains",
            "Largest number of grains of the body.",
            (1.0, 20_000.0), Scale::Logarithmic
        ),
        parameter!(
            lifetime: Lifetime, "Lifetime", "s",
            "Time after which a grain disappears. ∞: never.",
            (0.1, 100.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            speed: Coefficient, "Speed", "m/s", "Speed of the grains.",
            (0.0, 10.0), Scale::Linear
        ),
        parameter!(
            spread: Angle, "Spread", "°",
            "Largest angle between the directions of a grain and of the emitter.",
            (0.0, 180.0), Scale::Linear
        ),
        parameter!(
            opening: Coefficient, "Opening radius", "m", "Radius of the opening.",
            (0.0, 0.5), Scale::Linear
        ),
        parameter!(
            radius: GrainRadius, "Grain radius", "m", "Largest radius of a grain.",
            (0.002, 0.2), Scale::Logarithmic
        ),
        parameter!(
            variation: Fraction, "Radius variation", "",
            "Largest reduction of the radius: 0.2 is from 80 to 100 %. At least a tenth remains.",
            (0.0, 0.9), Scale::Linear
        ),
        parameter!(x: Finite, "Position x", "m", "Center of the opening along x.", (-3.0, 3.0), Scale::Linear),
        parameter!(y: Finite, "Position y", "m", "Center of the opening along y (up).", (-3.0, 3.0), Scale::Linear),
        parameter!(z: Finite, "Position z", "m", "Center of the opening along z.", (-3.0, 3.0), Scale::Linear),
        parameter!(toward_x: Finite, "Direction x", "", "Direction along x. Its length does not matter.", (-1.0, 1.0), Scale::Linear),
        parameter!(toward_y: Finite, "Direction y", "", "Direction along y (up).", (-1.0, 1.0), Scale::Linear),
        parameter!(toward_z: Finite, "Direction z", "", "Direction along z.", (-1.0, 1.0), Scale::Linear),
        parameter!(seed: Seed, "Seed", "", "Seed of the random numbers.", (0.0, 100.0), Scale::Linear),
    ];

    type State = ();
    const STAGES: &'static [Stage] = &[Stage::Renew];

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }

    fn unfit(body: &EntityRef, _: &Settings) -> Option<String> {
        let is_unfit = body.get::<SoftBody>()?.radii.is_empty();
        let reason = "it needs a body of grains, such as the primitive `Grains`; `body_emitter` emits \
                      copies of any body";
        is_unfit.then(|| reason.to_owned())
    }
}

impl Effect for BodyEmitter {
    const NAME: &'static str = "body_emitter";
    const TITLE: &'static str = "Body emitter";
    const SUMMARY: &'static str = "Emits copies of the body from a round opening.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            rate: Coefficient, "Rate", "1/s",
            "Copies per second. With contact, a copy waits until there is a free place.",
            (0.1, 100.0), Scale::LogarithmicFromZero
        ),
        parameter!(
            capacity: Capacity, "Capacity", "copies",
            "Largest number of copies at a time; while it is reached, none is emitted.",
            (1.0, 1000.0), Scale::Logarithmic
        ),
        parameter!(
            lifetime: Lifetime, "Lifetime", "s",
            "Time after which a copy disappears. ∞: never.",
            (0.1, 100.0), Scale::LogarithmicToInfinity
        ),
        parameter!(
            speed: Coefficient, "Speed", "m/s", "Speed of the copies.",
            (0.0, 10.0), Scale::Linear
        ),
        parameter!(
            spread: Angle, "Spread", "°",
            "Largest angle between the directions of a copy and of the emitter.",
            (0.0, 180.0), Scale::Linear
        ),
        parameter!(
            opening: Coefficient, "Opening radius", "m",
            "Radius of the opening. The centers of copies are distributed evenly over it.",
            (0.0, 2.0), Scale::Linear
        ),
        parameter!(x: Finite, "Position x", "m", "Center of the opening along x.", (-3.0, 3.0), Scale::Linear),
        parameter!(y: Finite, "Position y", "m", "Center of the opening along y (up).", (-3.0, 3.0), Scale::Linear),
        parameter!(z: Finite, "Position z", "m", "Center of the opening along z.", (-3.0, 3.0), Scale::Linear),
        parameter!(toward_x: Finite, "Direction x", "", "Direction along x. Its length does not matter.", (-1.0, 1.0), Scale::Linear),
        parameter!(toward_y: Finite, "Direction y", "", "Direction along y (up).", (-1.0, 1.0), Scale::Linear),
        parameter!(toward_z: Finite, "Direction z", "", "Direction along z.", (-1.0, 1.0), Scale::Linear),
        parameter!(seed: Seed, "Seed", "", "Seed of the random numbers.", (0.0, 100.0), Scale::Linear),
    ];

    type State = ();
    const STAGES: &'static [Stage] = &[Stage::Renew];

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }
}

impl Effect for Sink {
    const NAME: &'static str = "sink";
    const TITLE: &'static str = "Sink";
    const SUMMARY: &'static str = "Removes grains, and bodies by their center, inside a box.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(x: Finite, "Position x", "m", "Center of the box along x.", (-3.0, 3.0), Scale::Linear),
        parameter!(y: Finite, "Position y", "m", "Center of the box along y (up).", (-3.0, 3.0), Scale::Linear),
        parameter!(z: Finite, "Position z", "m", "Center of the box along z.", (-3.0, 3.0), Scale::Linear),
        parameter!(size_x: Length, "Size x", "m", "Size of the box along x.", (0.01, 10.0), Scale::Logarithmic),
        parameter!(size_y: Length, "Size y", "m", "Size of the box along y (up).", (0.01, 10.0), Scale::Logarithmic),
        parameter!(size_z: Length, "Size z", "m", "Size of the box along z.", (0.01, 10.0), Scale::Logarithmic),
    ];

    type State = ();
    const STAGES: &'static [Stage] = &[Stage::Renew];

    fn when_added() -> Option<Self> {
        Some(Self::default())
    }
}
