//! Shared helpers of the suite: the smallest shapes, bodies with given masses, worlds.

use glam::{UVec3, Vec3, Vec4};
use pliant::{
    mesh::Primitive,
    solver::{
        Body, BodyEffectKind, Compliance, Damping, Density, Effects, Ground, Instructions,
        Iterations, Mass, Particles, Rate, RestShape, Settings, Stretch, Substeps, Topology,
        VertexIndex, Volume, World,
        advance::{Stage, StepContext},
        deform::Random,
        effects::{
            Multipliers,
            elastic::{self, Elastic},
        },
        measure, reference,
    },
};
use std::sync::Arc;

/// Gravity in closed forms [m/s²].
pub const G: f64 = 9.81;

/// ```text
/// 0 ── 1 ── 2 ── …   downwards, each `link` long
/// ```
pub fn chain(links: usize, link: f32) -> RestShape {
    let index = |i: usize| u32::try_from(i).expect("short chains");
    RestShape {
        vertices: (0..=links)
            .map(|i| Vec3::new(0.0, -(i as f32) * link, 0.0))
            .collect(),
        edges: (0..links).map(|i| [index(i), index(i + 1)]).collect(),
        ..RestShape::default()
    }
}

/// ```text
///      3        corners of a unit cube at 0 and along x, y, z:
///      | 2      V = 1/6 m³, and all six edges
///      |/
///      0───1
/// ```
pub fn tetrahedron() -> RestShape {
    RestShape {
        vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
        edges: vec![[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]],
        tetrahedra: vec![[0, 1, 2, 3]],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        ..RestShape::default()
    }
}

/// A solid cube of the given side [m] around the origin, divided into `cells` along each axis.
pub fn cube(side: f32, cells: u32) -> RestShape {
    Primitive::Box {
        size: Vec3::splat(side),
        cells: UVec3::splat(cells),
    }
    .build()
    .expect("a sound box")
    .shape
}

/// One particle, at the origin.
pub fn point() -> RestShape {
    RestShape {
        vertices: vec![Vec3::ZERO],
        ..RestShape::default()
    }
}

/// The topology of a valid shape.
pub fn topology(shape: RestShape) -> Arc<Topology> {
    Arc::new(Topology::new(shape).expect("a sound shape"))
}

/// A body of the given density.
pub fn body(name: &str, shape: RestShape, density: f32) -> Body {
    let density = Density::new(density).expect("a sound density");
    Body::new(name, topology(shape), density)
}

/// A body whose particles have the given masses [kg]. Its required density is minimal: 1e-9 kg/m,
/// below the rounding of a mass of 0.02 kg.
pub fn body_of_masses(shape: RestShape, masses: &[f32]) -> Body {
    let mut body = body("masses", shape, 1e-9);
    for (particle, &mass) in (0..).zip(masses) {
        let mass = Mass::new(mass).expect("a sound mass");
        body.added_mass.push((VertexIndex(particle), mass));
    }
    body.update_masses();
    body
}

/// The body with these particles pinned.
pub fn pinned(mut body: Body, pins: &[u32]) -> Body {
    body.pins = pins.iter().copied().map(VertexIndex).collect();
    body.update_masses();
    body
}

/// The body with effects.
pub fn with(mut body: Body, effects: Effects) -> Body {
    body.effects = effects;
    body
}

/// Edges of compliance `compliance` [m/N].
pub fn stretch(compliance: f32) -> Option<Stretch> {
    Some(Stretch {
        compliance: Compliance::new(compliance).expect("a sound compliance"),
        ..Stretch::default()
    })
}

/// Tetrahedra of compliance `compliance` [m⁵/N].
pub fn volume(compliance: f32) -> Option<Volume> {
    Some(Volume {
        compliance: Compliance::new(compliance).expect("a sound compliance"),
        ..Volume::default()
    })
}

/// A damping time constant `tau` [s].
pub fn damping(tau: f32) -> Damping {
    Damping::new(tau).expect("a sound damping")
}

/// Rigid edges and volumes: a soft body as in Ten Minute Physics.
pub fn elastic() -> Effects {
    Effects {
        stretch: stretch(0.0),
        volume: volume(0.0),
        ..Effects::default()
    }
}

/// The same on a ground at height 0 with its default friction.
pub fn elastic_on_ground() -> Effects {
    Effects {
        ground: Some(Ground::default()),
        ..elastic()
    }
}

/// Settings with gravity along −y [m/s²].
pub fn settings(gravity: f64, rate: f64, substeps: u32, iterations: u32) -> Settings {
    let mut settings = Settings {
        rate: Rate::new(rate).expect("a sound rate"),
        substeps: Substeps::new(substeps).expect("a sound number of substeps"),
        iterations: Iterations::new(iterations).expect("a sound number of iterations"),
        ..Settings::default()
    };
    settings
        .set_gravity(Vec3::new(0.0, -gravity as f32, 0.0))
        .expect("a sound gravity");
    settings
}

/// A world of one body with sleeping disabled.
pub fn world(settings: Settings, body: Body) -> World {
    let mut world = World {
        settings,
        bodies: vec![body],
        ..World::default()
    };
    world.sleep.enabled = false;
    world
}

/// Runs ticks for `seconds`.
pub fn run(world: &mut World, seconds: f64) {
    let ticks = (seconds * world.settings.rate.get()).round() as usize;
    for _ in 0..ticks {
        world.tick();
    }
}

/// Position of a particle of the first body [m].
pub fn position(world: &World, particle: usize) -> Vec3 {
    world.bodies[0].particles.positions[particle].truncate()
}

/// Strain of each edge of a body.
pub fn edge_strains(body: &Body) -> impl Iterator<Item = f64> {
    let errors = measure::edge_errors(&body.topology, &body.particles.positions);
    let lengths = &body.topology.edges.rest_length;
    errors
        .zip(lengths)
        .map(|(error, &length)| error / f64::from(length))
}

/// Root mean square strain of the edges of a body.
pub fn rms_strain(body: &Body) -> f64 {
    let squares = edge_strains(body).map(|strain| strain * strain);
    (squares.sum::<f64>() / body.topology.edges.rest_length.len() as f64).sqrt()
}

/// A random vector with coordinates between −`half` and `half`.
pub fn random_vector(random: &mut Random, half: f32) -> Vec3 {
    let mut coordinate = || (2.0 * random.next() - 1.0) * half;
    Vec3::new(coordinate(), coordinate(), coordinate())
}

/// The bits of a column, for exact comparisons.
pub fn bits(column: &[Vec4]) -> Vec<[u32; 4]> {
    column
        .iter()
        .map(|x| x.to_array().map(f32::to_bits))
        .collect()
}

/// The bits of a whole state, column by column.
pub fn state_bits(particles: &Particles) -> [Vec<[u32; 4]>; 3] {
    particles.columns().map(|(_, column)| bits(column))
}

/// Positions after the iterations of a substep [m], rounded as positions are, with inverse masses.
pub fn predicted(particles: &Particles) -> Vec<Vec4> {
    let each = (0..).zip(&particles.positions);
    each.map(|(i, x)| particles.predicted(i).as_vec3().extend(x.w))
        .collect()
}

/// Fails unless `value` is within `tolerance` of `expected`, relative to it.
#[track_caller]
pub fn assert_relative(value: f64, expected: f64, tolerance: f64, what: &str) {
    let error = (value / expected - 1.0).abs();
    assert!(
        error <= tolerance,
        "{what} is {value}, expected {expected} within {tolerance} of it, but is off by {error}"
    );
}

/// Fails unless all particles of the reference are within `tolerance` [m] of those of the solver.
#[track_caller]
pub fn assert_follows(exact: &reference::World, fast: &World, tolerance: f64) {
    for (body, exact) in fast.bodies.iter().zip(&exact.bodies) {
        for (i, x) in exact.x.iter().enumerate() {
            let off = body.particles.position(i).distance(*x);
            assert!(
                off <= tolerance,
                "{}, tick {}, particle {i}: off by {off} m",
                body.name,
                fast.tick
            );
        }
    }
}

/// One iteration over all constraints of an effect of a body, with substeps of `h` seconds. It
/// displaces particles: `predicted` returns their positions afterwards.
pub fn iterate<const N: usize, const M: usize, E: Elastic<N, M>>(
    body: &mut Body,
    effect: &E,
    h: f32,
    multipliers: Multipliers,
) {
    let particles = body.particles.as_part();
    elastic::iterate(effect, &body.topology, h, particles, multipliers);
}

/// A pass of an effect without elements over a body, in a substep of `h` seconds without gravity.
pub fn act(body: &mut Body, kind: BodyEffectKind, h: f64, iteration: u32) {
    let settings = settings(0.0, 1.0 / h, 1, 16);
    let plain = World::default();
    let context = StepContext {
        settings: &settings,
        time: 0.0,
        swept: &plain.swept,
        threads: &plain.threads,
        instructions: Instructions::default(),
        watch: None,
    };
    let step = settings.substep(0);
    let done = body
        .stepper()
        .stage(Stage::Body(kind), &step, iteration, &context);
    done.expect("only the last stage looks for what is not finite");
}
