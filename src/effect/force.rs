//! Force fields: uniform acceleration, point force, vortex, wind, drag.

use super::{Effect, Parameter, Scale, parameter};
use crate::solver::{
    Attract, Coefficient, Drag, Finite, Length, Uniform, Vortex, Wind, advance::Stage, force::Force,
};

/// Common code of all force fields.
macro_rules! force {
    () => {
        type State = ();
        const STAGE: Option<Stage> = Some(Stage::Force(<Self as Force>::KIND));

        fn when_added() -> Option<Self> {
            Some(Self::default())
        }
    };
}

impl Effect for Uniform {
    const NAME: &'static str = "uniform";
    const TITLE: &'static str = "Uniform acceleration";
    const SUMMARY: &'static str = "Constant acceleration in addition to gravity.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(x: Finite, "Acceleration x", "m/s²", "Acceleration along x.", (-20.0, 20.0), Scale::Linear),
        parameter!(y: Finite, "Acceleration y", "m/s²", "Acceleration along y (up). 9.81 cancels gravity.", (-20.0, 20.0), Scale::Linear),
        parameter!(z: Finite, "Acceleration z", "m/s²", "Acceleration along z.", (-20.0, 20.0), Scale::Linear),
    ];

    force!();
}

impl Effect for Attract {
    const NAME: &'static str = "attract";
    const TITLE: &'static str = "Point force";
    const SUMMARY: &'static str =
        "Attraction to a point, falling off with the square of the distance.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(x: Finite, "Position x", "m", "Position of the point along x.", (-3.0, 3.0), Scale::Linear),
        parameter!(y: Finite, "Position y", "m", "Position of the point along y (up).", (-3.0, 3.0), Scale::Linear),
        parameter!(z: Finite, "Position z", "m", "Position of the point along z.", (-3.0, 3.0), Scale::Linear),
        parameter!(
            strength: Finite, "Strength", "m³/s²",
            "Acceleration times squared distance, far outside the softening radius. Negative values repel.",
            (-50.0, 50.0), Scale::Linear
        ),
        parameter!(
            radius: Length, "Softening radius", "m",
            "The force stops growing at smaller distances.",
            (0.01, 3.0), Scale::Linear
        ),
    ];

    force!();
}

impl Effect for Vortex {
    const NAME: &'static str = "vortex";
    const TITLE: &'static str = "Vortex";
    const SUMMARY: &'static str = "Air rotating about a vertical axis drags the body along.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(x: Finite, "Position x", "m", "Position of the axis along x.", (-3.0, 3.0), Scale::Linear),
        parameter!(z: Finite, "Position z", "m", "Position of the axis along z.", (-3.0, 3.0), Scale::Linear),
        parameter!(
            turning: Finite, "Angular speed", "rad/s",
            "Angular speed of the air inside the core radius.",
            (-30.0, 30.0), Scale::Linear
        ),
        parameter!(
            radius: Length, "Core radius", "m",
            "Outside this radius the air speed decreases with the distance.",
            (0.01, 3.0), Scale::Linear
        ),
        parameter!(
            coupling: Coefficient, "Coupling", "1/s",
            "Rate at which particles approach the velocity of the air.",
            (0.0, 20.0), Scale::Linear
        ),
    ];

    force!();
}

impl Effect for Wind {
    const NAME: &'static str = "wind";
    const TITLE: &'static str = "Wind";
    const SUMMARY: &'static str = "Aerodynamic drag and lift on every triangle of the surface.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(x: Finite, "Velocity x", "m/s", "Mean wind velocity along x.", (-20.0, 20.0), Scale::Linear),
        parameter!(y: Finite, "Velocity y", "m/s", "Mean wind velocity along y (up).", (-20.0, 20.0), Scale::Linear),
        parameter!(z: Finite, "Velocity z", "m/s", "Mean wind velocity along z.", (-20.0, 20.0), Scale::Linear),
        parameter!(
            turbulence: Coefficient, "Gust speed", "m/s",
            "Largest gust speed along each axis. Gusts travel with the mean wind.",
            (0.0, 20.0), Scale::Linear
        ),
        parameter!(
            scale: Length, "Gust size", "m",
            "Distance between gusts.",
            (0.05, 5.0), Scale::Linear
        ),
        parameter!(
            density: Coefficient, "Air density", "kg/m³",
            "Density of the fluid: 1.2 for air, 1000 for water.",
            (0.0, 1000.0), Scale::Linear
        ),
        parameter!(
            drag: Coefficient, "Drag coeff. C_D", "",
            "Drag coefficient of a plate normal to the flow.",
            (0.0, 3.0), Scale::Linear
        ),
        parameter!(
            lift: Coefficient, "Lift coeff. C_L", "",
            "Lift coefficient of a plate inclined to the flow.",
            (0.0, 3.0), Scale::Linear
        ),
    ];

    force!();
}

impl Effect for Drag {
    const NAME: &'static str = "drag";
    const TITLE: &'static str = "Drag";
    const SUMMARY: &'static str = "Drag of a resting medium on every particle.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            linear: Coefficient, "Linear", "1/s",
            "Linear (viscous) drag coefficient: deceleration over speed.",
            (0.0, 20.0), Scale::Linear
        ),
        parameter!(
            quadratic: Coefficient, "Quadratic", "1/m",
            "Quadratic (inertial) drag coefficient ρC_D A/(2m): deceleration over squared speed.",
            (0.0, 20.0), Scale::Linear
        ),
    ];

    force!();
}
