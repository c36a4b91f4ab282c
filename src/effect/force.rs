//! Forces from outside: uniform, point, vortex, wind, drag.

use super::{Effect, Parameter, Scale, parameter};
use crate::solver::{
    Attract, Coefficient, Drag, Finite, Length, Uniform, Vortex, Wind, advance::Stage, force::Force,
};

/// What all forces have in common.
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
    const TITLE: &'static str = "Uniform force";
    const SUMMARY: &'static str = "The same acceleration everywhere, on top of gravity.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(x: Finite, "Along x", "m/s²", "Acceleration along x.", (-20.0, 20.0), Scale::Linear),
        parameter!(y: Finite, "Up", "m/s²", "Acceleration upwards; 9.81 floats.", (-20.0, 20.0), Scale::Linear),
        parameter!(z: Finite, "Along z", "m/s²", "Acceleration along z.", (-20.0, 20.0), Scale::Linear),
    ];

    force!();
}

impl Effect for Attract {
    const NAME: &'static str = "attract";
    const TITLE: &'static str = "Point force";
    const SUMMARY: &'static str = "A point pulls, less with the square of the distance.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(x: Finite, "Place x", "m", "Where the point is along x.", (-3.0, 3.0), Scale::Linear),
        parameter!(y: Finite, "Place y", "m", "How high the point is.", (-3.0, 3.0), Scale::Linear),
        parameter!(z: Finite, "Place z", "m", "Where the point is along z.", (-3.0, 3.0), Scale::Linear),
        parameter!(
            strength: Finite, "Strength", "m³/s²",
            "The acceleration at a metre, far beyond the radius; negative pushes away.",
            (-50.0, 50.0), Scale::Linear
        ),
        parameter!(
            radius: Length, "Radius", "m",
            "Nearer than this the pull no longer grows.",
            (0.01, 3.0), Scale::Linear
        ),
    ];

    force!();
}

impl Effect for Vortex {
    const NAME: &'static str = "vortex";
    const TITLE: &'static str = "Vortex";
    const SUMMARY: &'static str = "Air turns about an upright axis and takes the body along.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(x: Finite, "Axis x", "m", "Where the axis is along x.", (-3.0, 3.0), Scale::Linear),
        parameter!(z: Finite, "Axis z", "m", "Where the axis is along z.", (-3.0, 3.0), Scale::Linear),
        parameter!(
            turning: Finite, "Turning", "rad/s",
            "How fast the air turns within the radius.",
            (-30.0, 30.0), Scale::Linear
        ),
        parameter!(
            radius: Length, "Radius", "m",
            "Outside, the air is slower with the distance.",
            (0.01, 3.0), Scale::Linear
        ),
        parameter!(
            coupling: Coefficient, "Coupling", "1/s",
            "How fast particles come up to the speed of the air.",
            (0.0, 20.0), Scale::Linear
        ),
    ];

    force!();
}

impl Effect for Wind {
    const NAME: &'static str = "wind";
    const TITLE: &'static str = "Wind";
    const SUMMARY: &'static str = "Wind blows on the surface: drag and lift of every triangle.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(x: Finite, "Wind x", "m/s", "Mean wind along x.", (-20.0, 20.0), Scale::Linear),
        parameter!(y: Finite, "Wind y", "m/s", "Mean wind upwards.", (-20.0, 20.0), Scale::Linear),
        parameter!(z: Finite, "Wind z", "m/s", "Mean wind along z.", (-20.0, 20.0), Scale::Linear),
        parameter!(
            turbulence: Coefficient, "Gusts", "m/s",
            "Largest gust along each axis; gusts pass by with the mean wind.",
            (0.0, 20.0), Scale::Linear
        ),
        parameter!(
            scale: Length, "Size of gusts", "m",
            "How far apart gusts are.",
            (0.05, 5.0), Scale::Linear
        ),
        parameter!(
            density: Coefficient, "Density of air", "kg/m³",
            "1.2 for air; 1000 for water.",
            (0.0, 1000.0), Scale::Linear
        ),
        parameter!(
            drag: Coefficient, "Drag C_D", "",
            "Drag coefficient of a plate across the flow.",
            (0.0, 3.0), Scale::Linear
        ),
        parameter!(
            lift: Coefficient, "Lift C_L", "",
            "Lift coefficient of a plate aslant in the flow.",
            (0.0, 3.0), Scale::Linear
        ),
    ];

    force!();
}

impl Effect for Drag {
    const NAME: &'static str = "drag";
    const TITLE: &'static str = "Drag";
    const SUMMARY: &'static str = "A medium at rest brakes every particle.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            linear: Coefficient, "Linear", "1/s",
            "Share of the speed that is lost in a second, as of something small in something thick.",
            (0.0, 20.0), Scale::Linear
        ),
        parameter!(
            quadratic: Coefficient, "Quadratic", "1/m",
            "ρC_D A/(2m): the same for a metre a second more, as of something large in something thin.",
            (0.0, 20.0), Scale::Linear
        ),
    ];

    force!();
}
