//! A sample of every effect in the table: an effect without a sample does not compile.

use crate::support::{body, cube, pinned, stretch, volume, with};
use glam::{UVec2, UVec3, Vec2, Vec3};
use pliant::{
    mesh::Primitive,
    solver::{
        Attract, Axis, Bend, Body, BodyEmitter, BreakingStrain, Coefficient, Collide, Compliance,
        Contact, Creep, Damping, Direct, Drag, Effects, Emitter, Finite, FlexuralRigidity,
        ForceMask, Fraction, Frequency, Friction, Grab, GrainRolling, Grains, Ground,
        IsometricBend, Membrane, MembraneCompliance, NeoHookean, ParticleIndex, Plasticity,
        Pressure, RestShape, Rod, SectionStiffness, SelfContact, ShapeMatching, Sink, Slack,
        StickyGround, Stiffness, Strain, StrainLimit, Stream, Stretch, Struts, SurfacePoint, Tear,
        Tethers, Thickness, Turbulence, Uniform, Volume, Vortex, Weave, Wind, Yield, YoungsModulus,
    },
};

/// What an effect acts on.
pub enum On {
    Solid,
    Sheet,
    Shell,
    /// Open chains.
    Chain,
    /// Grains that touch.
    Grains,
}

/// An effect with parameters whose action is visible.
pub trait Sample {
    const ON: On;
    fn sample(damping: Damping) -> Self;
}

macro_rules! samples {
    ($($effect:ident on $shape:ident { $($field:ident: $value:expr),* $(; $damping:ident)? })*) => {
        $(impl Sample for $effect {
            const ON: On = On::$shape;

            #[allow(clippy::needless_update, reason = "some have no other fields")]
            fn sample(_damping: Damping) -> Self {
                Self {
                    $($field: $value,)*
                    $($damping: _damping,)?
                    ..Self::default()
                }
            }
        })*
    };
}

fn of<T: TryFrom<f64>>(value: f64) -> T {
    T::try_from(value).ok().expect("in range")
}

samples! {
    Uniform on Solid { x: of::<Finite>(2.0) }
    Attract on Solid { x: of::<Finite>(1.0), strength: of::<Finite>(3.0) }
    Vortex on Solid { turning: of::<Finite>(3.0), coupling: of::<Coefficient>(2.0) }
    Axis on Solid { around: of::<Finite>(4.0) }
    Stream on Solid { along: of::<Finite>(1.0) }
    Turbulence on Solid { speed: of::<Coefficient>(5.0) }
    Wind on Sheet { z: of::<Finite>(6.0), turbulence: of::<Coefficient>(0.5) }
    Drag on Solid { linear: of::<Coefficient>(1.5) }
    ForceMask on Solid { high_y: of::<Fraction>(0.6), fade: of::<Fraction>(0.3) }
    Stretch on Sheet { compliance: of::<Compliance>(1e-5); damping }
    Bend on Sheet { stiffness: of::<FlexuralRigidity>(1e-3); damping }
    IsometricBend on Sheet { stiffness: of::<FlexuralRigidity>(1e-3); damping }
    Volume on Solid { compliance: of::<Compliance>(1e-6); damping }
    NeoHookean on Solid { youngs_modulus: of::<YoungsModulus>(2e5); damping }
    Membrane on Sheet { youngs_modulus: of::<YoungsModulus>(1e6), thickness: of::<Thickness>(1e-3); damping }
    Weave on Sheet { bias: of::<MembraneCompliance>(1e-2); damping }
    Struts on Shell { compliance: of::<Compliance>(1e-3); damping }
    StrainLimit on Sheet { limit: of::<Strain>(0.01) }
    ShapeMatching on Solid { frequency: of::<Frequency>(8.0); damping }
    Pressure on Shell { bulk_modulus: of::<Stiffness>(1e5) }
    Rod on Chain { youngs_modulus: of::<YoungsModulus>(1e7), bending_stiffness: of::<SectionStiffness>(0.1), twisting_stiffness: of::<SectionStiffness>(0.05); damping }
    Grains on Grains { friction: of::<Friction>(0.3), rolling_resistance: of::<GrainRolling>(0.05) }
    Tethers on Sheet { slack: of::<Slack>(0.01) }
    Contact on Solid {}
    SelfContact on Sheet {}
    Ground on Solid {}
    StickyGround on Solid {}
    Collide on Solid {}
    Plasticity on Solid { stretch_yield: of::<Yield>(0.02), creep: of::<Creep>(5.0) }
    Tear on Solid { strain: of::<BreakingStrain>(10.0) }
    Emitter on Grains { rate: of::<Coefficient>(0.0) }
    BodyEmitter on Solid { rate: of::<Coefficient>(0.0) }
    Sink on Grains { y: of::<Finite>(-1000.0) }
}

impl Sample for Direct {
    const ON: On = On::Solid;

    fn sample(_: Damping) -> Self {
        Self
    }
}

impl Sample for Grab {
    const ON: On = On::Solid;

    fn sample(_: Damping) -> Self {
        let point = SurfacePoint::new(&[(ParticleIndex(0), 0.25), (ParticleIndex(1), 0.75)])
            .expect("sound");
        Self::on(point, Vec3::new(0.0, 2.0, 0.0), 60.0, 0.4, 9.81)
    }
}

/// A shape with many elements of every kind that it supports.
pub fn shape(on: &On) -> (RestShape, f32) {
    let built = |primitive: Primitive| primitive.build().expect("sound").shape;
    match on {
        On::Solid => (cube(0.4, 2), 1000.0),
        On::Sheet => {
            let sheet = Primitive::Cloth {
                size: Vec2::splat(0.5),
                cells: UVec2::splat(6),
                diagonals: Default::default(),
                shear: true,
            };
            (built(sheet), 0.2)
        }
        On::Shell => {
            let radius = 0.25;
            (built(Primitive::Sphere { radius, cells: 4 }), 0.3)
        }
        On::Chain => {
            let rope = Primitive::Rope {
                length: 0.5,
                segments: 12,
            };
            (built(rope), 0.1)
        }
        On::Grains => {
            let side = 0.06;
            // Pairs that push each other apart and meet no other one: whatever the order of the
            // contacts, the result is the same.
            let places = (0..64).map(|i| {
                let pair = UVec3::new(i / 2 % 4, i / 8 % 4, i / 32).as_vec3() * (12.0 * side);
                pair + Vec3::X * ((i % 2) as f32 * 0.98 * side)
            });
            let grains = RestShape {
                vertices: places.collect(),
                radii: vec![0.5 * side; 64],
                ..RestShape::default()
            };
            (grains, 1000.0)
        }
    }
}

macro_rules! each {
    (
        { $($first:ident { $($kind1:ident $field1:ident $(($($numbers:tt)*))? $does1:literal;)* })* }
        $stitches:ident $stitched:ident
        { $($second:ident { $($kind2:ident $field2:ident $does2:literal;)* })* }
        $grab:ident $grabbed:ident
        { $($third:ident { $($kind3:ident $field3:ident $does3:literal;)* })* }
    ) => {
        each! {
            $($($kind1 $field1,)*)* $($($kind2 $field2,)*)* $grab $grabbed, $($($kind3 $field3,)*)*
        }
    };
    ($($kind:ident $field:ident,)*) => {
        /// A sample of each effect, with its name and what it acts on.
        pub fn samples() -> Vec<(&'static str, On, Effects)> {
            vec![$((
                stringify!($field),
                <$kind as Sample>::ON,
                Effects {
                    $field: Some(<$kind as Sample>::sample(Damping::default())),
                    ..Effects::default()
                },
            ),)*]
        }

        /// Fills absent effects with those of another body.
        fn over(effects: Effects, under: Effects) -> Effects {
            Effects {
                $($field: effects.$field.or(under.$field),)*
            }
        }
    };
}

pliant::solver::effects!(each);

macro_rules! elastic {
    (
        {
            forces { $($force:tt)* }
            masks { $($mask:tt)* }
            solvers { $($solver:tt)* }
            elastic { $($effect:ident $field:ident ($corners:literal, $rows:literal) $does:literal;)* }
            $($others:tt)*
        }
        $($rest:tt)*
    ) => {
        /// A sample of all elastic effects together.
        pub fn elastic(damping: Damping) -> Effects {
            Effects {
                $($field: Some(<$effect as Sample>::sample(damping)),)*
                ..Effects::default()
            }
        }
    };
}

pliant::solver::effects!(elastic);

/// Place of a body on the ground [m], in rows of 24. Gusts and rounding depend on it.
pub fn place(index: usize) -> Vec3 {
    let (row, column) = ((index + 22) / 24, (index + 22) % 24);
    Vec3::new(2.0 * column as f32, 0.0, -5.0 * row as f32)
}

/// A body for each effect, two meters apart; two touching bodies for contact.
pub fn bodies() -> Vec<Body> {
    let mut bodies = Vec::new();
    let mut all = samples();
    // At the end, as what comes after another body has another place.
    all.sort_by_key(|(.., effects)| effects.force_mask.is_some());
    for (name, on, effects) in all {
        let under = Effects {
            stretch: stretch(1e-5),
            volume: volume(1e-5),
            ground: Some(Ground::default()),
            // What a mask limits.
            uniform: effects
                .force_mask
                .map(|_| Uniform::sample(Damping::default())),
            ..Effects::default()
        };
        let (shape, density) = shape(&on);
        let of_place = |height: f32| {
            let mut body = with(body(name, shape.clone(), density), over(effects, under));
            if matches!(on, On::Sheet) {
                body = pinned(body, &[0]);
            }
            body.translate(place(bodies.len()) + Vec3::Y * height);
            body
        };
        let pair = [of_place(0.5), of_place(1.0)];
        let count = if effects.contact.is_some() { 2 } else { 1 };
        bodies.extend(pair.into_iter().take(count));
    }
    bodies
}
