//! Force fields: uniform acceleration, point force, vortex, axis flow, curve flow, turbulence, wind,
//! drag.

use super::{Effect, Parameter, Scale, parameter};
use crate::solver::{
    Attract, Axis, Coefficient, Drag, Finite, Length, Stream, Turbulence, Uniform, Vortex, Wind,
    advance::Stage, effects::force::Force,
};

/// Common code of all force fields.
macro_rules! force {
    () => {
        type State = ();
        const STAGES: &'static [Stage] = &[Stage::Force(<Self as Force>::KIND)];

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

impl Effect for Axis {
    const NAME: &'static str = "axis";
    const TITLE: &'static str = "Axis flow";
    const SUMMARY: &'static str =
        "Air that flows along, around and towards an axis drags the body along.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(x: Finite, "Position x", "m", "A point of the axis along x.", (-3.0, 3.0), Scale::Linear),
        parameter!(y: Finite, "Position y", "m", "A point of the axis along y (up).", (-3.0, 3.0), Scale::Linear),
        parameter!(z: Finite, "Position z", "m", "A point of the axis along z.", (-3.0, 3.0), Scale::Linear),
        parameter!(toward_x: Finite, "Direction x", "", "Direction of the axis along x. Its length does not matter.", (-1.0, 1.0), Scale::Linear),
        parameter!(toward_y: Finite, "Direction y", "", "Direction of the axis along y (up).", (-1.0, 1.0), Scale::Linear),
        parameter!(toward_z: Finite, "Direction z", "", "Direction of the axis along z.", (-1.0, 1.0), Scale::Linear),
        parameter!(along: Finite, "Speed along", "m/s", "Speed of the air along the axis.", (-20.0, 20.0), Scale::Linear),
        parameter!(around: Finite, "Speed around", "m/s", "Speed of the air around the axis, at the radius.", (-20.0, 20.0), Scale::Linear),
        parameter!(inward: Finite, "Speed inward", "m/s", "Speed of the air towards the axis, at the radius. Negative values blow outward.", (-20.0, 20.0), Scale::Linear),
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

impl Effect for Stream {
    const NAME: &'static str = "stream";
    const TITLE: &'static str = "Curve flow";
    const SUMMARY: &'static str =
        "Air that flows along a curve and towards it drags the body along.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(x0: Finite, "Start x", "m", "Start of the curve, along x.", (-3.0, 3.0), Scale::Linear),
        parameter!(y0: Finite, "Start y", "m", "Start of the curve, along y (up).", (-3.0, 3.0), Scale::Linear),
        parameter!(z0: Finite, "Start z", "m", "Start of the curve, along z.", (-3.0, 3.0), Scale::Linear),
        parameter!(x1: Finite, "Control point 1 x", "m", "Control point 1 (start tangent), along x.", (-3.0, 3.0), Scale::Linear),
        parameter!(y1: Finite, "Control point 1 y", "m", "Control point 1 (start tangent), along y (up).", (-3.0, 3.0), Scale::Linear),
        parameter!(z1: Finite, "Control point 1 z", "m", "Control point 1 (start tangent), along z.", (-3.0, 3.0), Scale::Linear),
        parameter!(x2: Finite, "Control point 2 x", "m", "Control point 2 (end tangent), along x.", (-3.0, 3.0), Scale::Linear),
        parameter!(y2: Finite, "Control point 2 y", "m", "Control point 2 (end tangent), along y (up).", (-3.0, 3.0), Scale::Linear),
        parameter!(z2: Finite, "Control point 2 z", "m", "Control point 2 (end tangent), along z.", (-3.0, 3.0), Scale::Linear),
        parameter!(x3: Finite, "End x", "m", "End of the curve, along x.", (-3.0, 3.0), Scale::Linear),
        parameter!(y3: Finite, "End y", "m", "End of the curve, along y (up).", (-3.0, 3.0), Scale::Linear),
        parameter!(z3: Finite, "End z", "m", "End of the curve, along z.", (-3.0, 3.0), Scale::Linear),
        parameter!(along: Finite, "Speed along", "m/s", "Speed of the air along the curve.", (-20.0, 20.0), Scale::Linear),
        parameter!(inward: Finite, "Speed inward", "m/s", "Speed of the air towards the curve, from the radius on. Negative values blow outward.", (-20.0, 20.0), Scale::Linear),
        parameter!(
            radius: Length, "Core radius", "m",
            "Outside this radius the coupling decreases with the square of the distance.",
            (0.01, 3.0), Scale::Linear
        ),
        parameter!(
            coupling: Coefficient, "Coupling", "1/s",
            "Rate at which particles approach the velocity of the air, within the radius.",
            (0.0, 20.0), Scale::Linear
        ),
    ];

    force!();
}

impl Effect for Turbulence {
    const NAME: &'static str = "turbulence";
    const TITLE: &'static str = "Turbulence";
    const SUMMARY: &'static str = "Air in random motion drags every particle along.";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        parameter!(
            speed: Coefficient, "Speed", "m/s",
            "Largest speed of the air along each axis.",
            (0.0, 20.0), Scale::Linear
        ),
        parameter!(
            scale: Length, "Eddy size", "m",
            "Distance between eddies.",
            (0.05, 5.0), Scale::Linear
        ),
        parameter!(
            rate: Coefficient, "Rate", "1/s",
            "Rate at which eddies change. 0: a steady flow.",
            (0.0, 20.0), Scale::Linear
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
