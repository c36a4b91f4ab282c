//! The recipes of `docs/choosing-parameters.md` in Rust: two seconds of each material.
//! `cargo run --release --example recipes`

use bevy::prelude::*;
use pliant::{
    effect::{Drag, Grains},
    mesh::{GrainRegion, Primitive},
    prelude::*,
    simulation::{AddedMass, tick},
    solver::{
        Coefficient, Cohesion, Collider, Damping, Filling, FlexuralRigidity, Frequency, Friction,
        GrainRolling, Mass, MembraneCompliance, PoissonRatio, RodRadius, RollingResistance,
        Substeps, Thickness, YoungsModulus,
    },
};
use std::f32::consts::FRAC_PI_2;

fn main() -> Result {
    jelly();
    rubber();
    silk();
    denim()?;
    rope();
    hair()?;
    balloon()?;
    sand()?;
    wet_sand()?;
    paper();
    tire()?;
    flesh()?;
    Ok(())
}

fn jelly() {
    let body = SoftBody::cuboid(Vec3::splat(0.1), UVec3::splat(5)) // m
        .at(Vec3::Y * 0.07)
        .density(Density::of(1020.0)); // kg/m³
    let effects = (
        NeoHookean {
            youngs_modulus: YoungsModulus::of(4.34e3), // Pa
            poisson_ratio: PoissonRatio::of(0.45),
            damping: Damping::of(0.003), // s
        },
        Ground {
            friction: Friction::of(0.8),
            ..default()
        },
    );
    run("jelly", [40, 1], body, effects, None);
}

fn rubber() {
    // Rows of three vertices along x, then along y, then along z: its lower and its upper end.
    let end = |row: u32| (0..3).flat_map(move |z| (0..3).map(move |x| 63 * z + 3 * row + x));
    let body = SoftBody::cuboid(Vec3::new(0.02, 0.2, 0.02), UVec3::new(2, 20, 2)) // m
        .at(Vec3::Y * 0.5)
        .density(Density::of(930.0)) // kg/m³
        .pinned(end(20));
    let effects = (
        NeoHookean {
            youngs_modulus: YoungsModulus::of(1.17e6), // Pa
            poisson_ratio: PoissonRatio::of(0.45),
            damping: Damping::of(0.02), // s
        },
        Direct,
    );
    let load = end(0).map(|vertex| (VertexIndex(vertex), Mass::of(1.0 / 9.0))); // kg
    let load = AddedMass(load.collect());
    run("rubber", [10, 1], body, (effects, load), None);
}

fn silk() {
    let body = SoftBody::cloth(Vec2::splat(0.4), UVec2::splat(12)) // m
        .at(Vec3::Y * 0.6)
        .density(Density::of(0.0347)) // kg/m²
        .pinned([0]);
    let effects = (
        Stretch::default(), // rigid
        Bend {
            stiffness: FlexuralRigidity::of(5.6e-7), // N·m
            ..default()
        },
        Tethers::default(),
        Drag {
            linear: Coefficient::of(4.0), // 1/s
            ..default()
        },
    );
    run("silk", [20, 1], body, effects, None);
}

fn denim() -> Result {
    let body = SoftBody::cloth(Vec2::splat(0.5), UVec2::splat(12)) // m
        .at(Vec3::Y * 0.42)
        .density(Density::of(0.324)); // kg/m²
    let effects = (
        Weave {
            warp: MembraneCompliance::of(1.64e-3), // m/N
            weft: MembraneCompliance::of(1.64e-3), // m/N
            bias: MembraneCompliance::of(1.1e-2),  // m/N
            ..default()
        },
        Bend {
            stiffness: FlexuralRigidity::of(6.4e-5), // N·m
            ..default()
        },
        Collide {
            friction: Friction::of(0.5),
            ..default()
        },
        SelfContact::default(),
        Drag {
            linear: Coefficient::of(4.0), // 1/s
            ..default()
        },
    );
    let ball = ball(0.12, 0.28)?;
    run("denim", [40, 1], body, effects, Some(ball));
    Ok(())
}

fn rope() {
    let body = SoftBody::rope(2.0, 16) // m
        .rotated(Quat::from_rotation_z(-FRAC_PI_2)) // vertex 0 at the top
        .at(Vec3::Y * 2.0)
        .density(Density::of(0.065)) // kg/m
        .pinned([0]);
    let effects = (
        Stretch {
            axial_stiffness: Stiffness::of(1.96e4), // N
            damping: Damping::of(0.1),              // s
            ..default()
        },
        Direct,
    );
    let load = AddedMass(vec![(VertexIndex(16), Mass::of(80.0))]); // kg
    run("rope", [10, 1], body, (effects, load), None);
}

fn hair() -> Result {
    let [strands, segments] = [24, 12];
    let hair = Primitive::Hair {
        radius: 0.09,   // m
        coverage: 80.0, // °
        strands,
        length: 0.2, // m
        segments,
        curl: 0.0,
        turns: 0.0,
    };
    let roots = (0..strands).map(|strand| strand * (segments + 1));
    let body = SoftBody::primitive(&hair)?
        .at(Vec3::Y * 0.5)
        .density(Density::of(5.1e-6)) // kg/m
        .pinned(roots.flat_map(|root| [root, root + 1]));
    let effects = (
        Rod {
            youngs_modulus: YoungsModulus::of(3.89e9), // Pa
            radius: RodRadius::of(3.5e-5),             // m
            damping: Damping::of(0.01),                // s
            ..default()
        },
        Collide {
            friction: Friction::of(0.2),
            ..default()
        },
        Drag {
            linear: Coefficient::of(4.0), // 1/s
            ..default()
        },
    );
    let head = ball(0.088, 0.5)?;
    run("hair", [10, 1], body, effects, Some(head));
    Ok(())
}

fn balloon() -> Result {
    let balloon = Primitive::Balloon {
        radius: 0.15, // m
        cells: 4,
    };
    let body = SoftBody::primitive(&balloon)?
        .at(Vec3::Y * 0.2)
        .density(Density::of(0.2325)); // kg/m²
    let effects = (
        Membrane {
            youngs_modulus: YoungsModulus::of(1.17e6), // Pa
            poisson_ratio: PoissonRatio::of(0.499),
            thickness: Thickness::of(2.5e-4), // m
            ..default()
        },
        Bend {
            stiffness: FlexuralRigidity::of(2e-6), // N·m
            ..default()
        },
        Pressure {
            factor: Filling::of(1.35),              // × rest volume
            bulk_modulus: Stiffness::of(101_325.0), // Pa
        },
        Ground {
            friction: Friction::of(0.5),
            rolling_resistance: RollingResistance::of(0.05),
            ..default()
        },
        Drag {
            linear: Coefficient::of(2.0), // 1/s
            ..default()
        },
    );
    run("balloon", [70, 1], body, effects, None);
    Ok(())
}

/// A column of grains.
fn column() -> Result<SoftBodyBuilder> {
    let grains = Primitive::Grains {
        size: Vec3::new(0.12, 0.14, 0.12), // m
        region: GrainRegion::Cylinder,
        radius: 0.009, // m
        variation: 0.2,
    };
    let body = SoftBody::primitive(&grains)?;
    Ok(body.at(Vec3::Y * 0.071).density(Density::of(2650.0))) // kg/m³
}

fn sand() -> Result {
    let effects = (
        Grains {
            friction: Friction::of(0.5),
            rolling_resistance: GrainRolling::of(0.2),
            ..default()
        },
        Ground {
            friction: Friction::of(0.6),
            ..default()
        },
    );
    run("sand", [20, 4], column()?, effects, None);
    Ok(())
}

fn wet_sand() -> Result {
    let effects = (
        Grains {
            friction: Friction::of(0.5),
            cohesion: Cohesion::of(0.37), // N
            rolling_resistance: GrainRolling::of(0.2),
            ..default()
        },
        Ground {
            friction: Friction::of(0.6),
            ..default()
        },
    );
    run("wet sand", [20, 4], column()?, effects, None);
    Ok(())
}

fn paper() {
    let clamped = (0..7).flat_map(|row| [17 * row, 17 * row + 1]);
    let body = SoftBody::cloth(Vec2::new(0.16, 0.06), UVec2::new(16, 6)) // m
        .at(Vec3::Y * 0.3)
        .density(Density::of(0.088)) // kg/m²
        .pinned(clamped);
    let effects = (
        Membrane {
            youngs_modulus: YoungsModulus::of(2.92e9), // Pa
            poisson_ratio: PoissonRatio::of(0.3),
            thickness: Thickness::of(1.1e-4), // m
            ..default()
        },
        Bend {
            stiffness: FlexuralRigidity::of(3.6e-4), // N·m
            damping: Damping::of(0.02),              // s
        },
        Direct,
        Drag {
            linear: Coefficient::of(2.0), // 1/s
            ..default()
        },
    );
    run("paper", [10, 1], body, effects, None);
}

fn tire() -> Result {
    let tire = Primitive::Torus {
        major: 0.24, // m
        minor: 0.08, // m
        cells: 2,
    };
    let body = SoftBody::primitive(&tire)?
        .rotated(Quat::from_rotation_x(FRAC_PI_2)) // its axis along z
        .at(Vec3::Y * 0.32)
        .density(Density::of(406.0)); // kg/m³
    let effects = (
        ShapeMatching {
            frequency: Frequency::of(30.0), // Hz
            damping: Damping::of(0.005),    // s
            ..default()
        },
        Ground {
            friction: Friction::of(0.8),
            rolling_resistance: RollingResistance::of(0.0125),
            ..default()
        },
    );
    run("tire", [20, 1], body, effects, None);
    Ok(())
}

fn flesh() -> Result {
    let limb = Primitive::Cylinder {
        radius: 0.06, // m
        height: 0.12, // m
        cells: 6,
    };
    let limb = limb.build()?.shape;
    let bone: Vec<u32> = (0..)
        .zip(&limb.vertices)
        .filter(|(_, x)| x.x.abs().max(x.z.abs()) < 0.021) // m
        .map(|(vertex, _)| vertex)
        .collect();
    let body = SoftBody::shape(limb)
        .rotated(Quat::from_rotation_z(FRAC_PI_2)) // its axis along x
        .at(Vec3::Y * 0.3)
        .density(Density::of(1060.0)) // kg/m³
        .pinned(bone);
    let effects = NeoHookean {
        youngs_modulus: YoungsModulus::of(3e3), // Pa
        poisson_ratio: PoissonRatio::of(0.45),
        damping: Damping::of(0.005), // s
    };
    run("flesh", [20, 1], body, effects, None);
    Ok(())
}

/// A rigid ball at a height [m].
fn ball(radius: f32, height: f32) -> Result<Collider> {
    let place = Pose::at((Vec3::Y * height).as_dvec3());
    Ok(Collider::new(ColliderShape::Sphere { radius }, place)?)
}

/// Steps a body for two seconds and prints where it is then.
fn run(
    name: &str,
    [substeps, iterations]: [u32; 2],
    body: SoftBodyBuilder,
    effects: impl Bundle,
    collider: Option<Collider>,
) {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, SoftBodyPlugins::default()));
    let mut settings = app.world_mut().resource_mut::<SimulationSettings>();
    settings.substeps = Substeps::of(substeps);
    settings.iterations = Iterations::of(iterations);
    if let Some(collider) = collider {
        app.world_mut().spawn(collider);
    }
    let body = app.world_mut().spawn((body.build(), effects)).id();
    (0..120).for_each(|_| tick(app.world_mut()));
    let particles = app
        .world()
        .get::<Particles>(body)
        .expect("a body has particles");
    let positions: Vec<_> = (0..particles.len())
        .map(|i| particles.position(i))
        .collect();
    assert!(positions.iter().all(|x| x.is_finite()), "{name} diverged");
    let heights = || positions.iter().map(|x| x.y);
    let low = heights().fold(f64::INFINITY, f64::min);
    let high = heights().fold(f64::NEG_INFINITY, f64::max);
    println!("{name}: {low:.3} to {high:.3} m above the ground after 2 s");
}
