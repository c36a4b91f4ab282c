//! Random worlds, within the valid ranges of all parameters: the universal guarantees hold. See
//! [`fuzz_support`](crate::fuzz_support) for how to run more cases.

use crate::{
    fuzz_support::fuzz,
    support::{settings, topology},
};
use glam::{DVec3, UVec2, UVec3, Vec2, Vec3, Vec3Swizzles, Vec4};
use pliant::{
    mesh::Primitive,
    solver::{
        Body, Collide, Collider, ColliderShape, Compliance, Damping, Density, Effects, ElasticKind,
        Filling, Frequency, Friction, Ground, Height, Instructions, Path, Pose, Pressure,
        RegionSize, RestShape, Restitution, ShapeMatching, StickyGround, Stiffness, Stretch,
        Struts, Threads, VertexIndex, Volume, World,
        deform::{Deformation, deform},
        measure,
    },
};
use proptest::prelude::*;
use std::ops::Range;

/// A shape with few cells.
#[derive(Debug, Clone, Copy)]
enum Kind {
    Box,
    Sphere,
    Cloth { shear: bool },
    Rope,
}

/// A body; its lengths are in units of its own scale.
#[derive(Debug, Clone)]
struct Soft {
    kind: Kind,
    cells: u32,
    /// Its size [m].
    scale: f32,
    density: f32,
    stretch: Option<(f32, f32)>,
    volume: Option<(f32, f32)>,
    struts: Option<(f32, f32)>,
    /// Its filling: factor, and bulk modulus [Pa].
    filling: Option<(f32, f32)>,
    /// Its shape matching: frequency [Hz], size of regions and damping [s].
    matched: Option<(f32, f32, f32)>,
    /// Height of a ground below it, friction, restitution.
    ground: Option<(f32, f32, f32)>,
    sticky: bool,
    collide: bool,
    pins: Vec<u32>,
    deformation: Option<Deformation>,
    position: Vec3,
    velocity: Vec3,
    spin: Vec3,
}

/// A world.
#[derive(Debug, Clone)]
struct Wild {
    bodies: Vec<Soft>,
    /// Shape from 0 to 2, position and motion, in units of the first body's scale.
    colliders: Vec<(u8, Vec3, u8)>,
    gravity: Vec3,
    rate: f64,
    substeps: u32,
    iterations: u32,
}

impl Soft {
    fn shape(&self) -> RestShape {
        let (cells, scale) = (self.cells, self.scale);
        let primitive = match self.kind {
            Kind::Box => Primitive::Box {
                size: Vec3::new(1.0, 0.7, 0.8) * scale,
                cells: UVec3::splat(cells),
            },
            Kind::Sphere => Primitive::Sphere {
                radius: scale / 2.0,
                cells: 4,
            },
            Kind::Cloth { shear } => Primitive::Cloth {
                size: Vec2::splat(scale),
                cells: UVec2::splat(2 * cells),
                diagonals: Default::default(),
                shear,
            },
            Kind::Rope => Primitive::Rope {
                length: scale,
                segments: 4 * cells,
            },
        };
        primitive.build().expect("a sound shape").shape
    }

    fn body(&self) -> Body {
        let density = Density::new(self.density).expect("in range");
        let mut body = Body::new("wild", topology(self.shape()), density);
        let compliant = |(compliance, damping): (f32, f32)| {
            let compliance = Compliance::new(compliance).expect("in range");
            (compliance, Damping::new(damping).expect("in range"))
        };
        body.effects = Effects {
            stretch: self
                .stretch
                .map(compliant)
                .map(|(compliance, damping)| Stretch {
                    compliance,
                    damping,
                    ..Stretch::default()
                }),
            volume: self
                .volume
                .map(compliant)
                .map(|(compliance, damping)| Volume {
                    compliance,
                    damping,
                    ..Volume::default()
                }),
            struts: self
                .struts
                .map(compliant)
                .map(|(compliance, damping)| Struts {
                    compliance,
                    damping,
                }),
            pressure: self.filling.map(|(factor, modulus)| Pressure {
                factor: Filling::new(factor).expect("in range"),
                bulk_modulus: Stiffness::new(modulus).expect("in range"),
            }),
            shape_matching: self
                .matched
                .map(|(frequency, region, damping)| ShapeMatching {
                    frequency: Frequency::new(frequency).expect("in range"),
                    region: RegionSize::new(region * self.scale).expect("in range"),
                    damping: Damping::new(damping).expect("in range"),
                }),
            ground: self.ground.map(|(below, friction, restitution)| Ground {
                height: Height::new((self.position.y - 1.0 - below) * self.scale).expect("sound"),
                friction: Friction::new(friction).expect("in range"),
                restitution: Restitution::new(restitution).expect("in range"),
                ..Ground::default()
            }),
            sticky_ground: self.sticky.then_some(StickyGround {
                height: Height::new((self.position.y - 1.2) * self.scale).expect("sound"),
            }),
            collide: self.collide.then(Collide::default),
            ..Effects::default()
        };
        let count = u32::try_from(body.particles.len()).expect("few");
        body.pins = self
            .pins
            .iter()
            .map(|pin| VertexIndex(pin % count))
            .collect();
        body.pins.sort_unstable();
        body.pins.dedup();
        body.update_masses();
        body.translate(self.position * self.scale);
        if let Some(deformation) = self.deformation {
            deform(&mut body.particles, deformation);
            body.tick_start.clone_from(&body.particles);
        }
        let middle = measure::center_of_mass(&body.particles).as_vec3();
        let particles = &mut body.particles;
        for i in 0..particles.len() {
            let x = particles.positions[i];
            if x.w > 0.0 {
                let turn = self.spin.cross(x.truncate() - middle);
                particles.set_velocity(i, self.velocity * self.scale + turn);
            }
        }
        body
    }
}

impl Wild {
    fn world(&self) -> World {
        let scale = self.bodies.first().map_or(1.0, |body| body.scale);
        let colliders = self.colliders.iter().map(|&(shape, place, path)| {
            let radius = 0.4 * scale;
            let shape = match shape {
                0 => ColliderShape::Sphere { radius },
                1 => ColliderShape::Box {
                    size: Vec3::new(1.0, 0.3, 0.8) * scale,
                },
                _ => ColliderShape::Capsule {
                    radius,
                    length: scale,
                },
            };
            let path = match path {
                0 => Path::Oscillate {
                    travel: place.yzx() * scale,
                    period: 0.3,
                },
                1 => Path::Line {
                    velocity: place.zxy() * scale,
                },
                2 => Path::Spin {
                    axis: place,
                    rate: 2.0,
                },
                _ => Path::Still,
            };
            Collider::moving(shape, Pose::at((place * scale).as_dvec3()), path).expect("sound")
        });
        let mut world = World {
            settings: settings(0.0, self.rate, self.substeps, self.iterations),
            bodies: self.bodies.iter().map(Soft::body).collect(),
            colliders: colliders.collect(),
            ..World::default()
        };
        world.settings.set_gravity(self.gravity).expect("finite");
        world
    }
}

/// A log-uniform number in a range of powers of ten.
fn power(powers: Range<f32>) -> impl Strategy<Value = f32> {
    powers.prop_map(|power| libm::powf(10.0, power))
}

/// A vector with coordinates up to `most` in magnitude.
fn vector(most: f32) -> impl Strategy<Value = Vec3> {
    let one = move || -most..most;
    (one(), one(), one()).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

/// Ranges of the parameters of a world.
#[derive(Debug, Clone, Copy)]
struct Reach {
    /// Powers of ten of compliances and of their scale-free part, of densities and of sizes.
    compliance: (f32, f32),
    density: (f32, f32),
    scale: (f32, f32),
    /// Longest damping [s].
    damping: f32,
    /// Whether bodies start deformed, are pinned, or touch grounds and colliders.
    held: bool,
}

/// The full ranges of a scene file.
const ALL: Reach = Reach {
    compliance: (-12.0, 12.0),
    density: (-9.0, 9.0),
    scale: (-6.0, 6.0),
    damping: 1000.0,
    held: true,
};

/// The ranges of the panel's sliders, for free bodies in their rest shape.
const FREE: Reach = Reach {
    compliance: (-8.0, -1.0),
    density: (1.0, 4.0),
    scale: (-1.0, 0.5),
    damping: 0.03,
    held: false,
};

fn soft(reach: Reach) -> impl Strategy<Value = Soft> {
    let elastic = move || {
        let compliance = prop_oneof![
            1 => Just(0.0_f32),
            2 => power(reach.compliance.0..reach.compliance.1),
        ];
        (
            compliance,
            prop_oneof![2 => Just(0.0_f32), 1 => 0.0..reach.damping],
        )
    };
    let kind = prop_oneof![
        2 => Just(Kind::Box),
        1 => Just(Kind::Sphere),
        2 => any::<bool>().prop_map(|shear| Kind::Cloth { shear }),
        1 => Just(Kind::Rope),
    ];
    let made = (
        kind,
        1..4_u32,
        power(reach.scale.0..reach.scale.1),
        power(reach.density.0..reach.density.1),
        prop::option::weighted(0.9, elastic()),
        prop::option::weighted(0.7, elastic()),
    );
    let deformation = prop_oneof![
        (0.0..3.0_f32).prop_map(Deformation::Squash),
        any::<u32>().prop_map(Deformation::Shuffle),
        Just(Deformation::Mirror),
        (0.0..10.0_f32).prop_map(Deformation::Scale),
    ];
    let chance = 0.4;
    let friction = prop_oneof![0.0..2.0_f32, Just(100.0)];
    let modulus = prop_oneof![1 => Just(f32::INFINITY), 3 => power(-5.9..12.0)];
    let frequency = prop_oneof![1 => Just(f32::INFINITY), 3 => power(-5.9..6.0)];
    let region = prop_oneof![1 => Just(f32::INFINITY), 2 => power(-2.0..0.5)];
    let shaken = prop_oneof![2 => Just(0.0_f32), 1 => 0.0..reach.damping];
    let matched = (frequency, region, shaken);
    let inside = (
        prop::option::weighted(chance, elastic()),
        prop::option::weighted(chance, (power(-2.9..2.9), modulus)),
        prop::option::weighted(chance / 2.0, matched),
    );
    let inside = if reach.held {
        inside.boxed()
    } else {
        Just((None, None, None)).boxed()
    };
    let held = (
        prop::option::weighted(chance, (0.0..1.0_f32, friction, 0.0..=1.0_f32)),
        prop::bool::weighted(chance / 4.0),
        prop::bool::weighted(chance),
        prop::option::weighted(chance, prop::collection::vec(any::<u32>(), 1..4)),
        prop::option::weighted(chance / 2.0, deformation),
        inside,
    );
    let moved = (vector(3.0), vector(5.0), vector(6.0));
    (made, held, moved).prop_map(
        move |(
            (kind, cells, scale, density, stretch, volume),
            (ground, sticky, collide, pins, deformation, (struts, filling, matched)),
            (position, velocity, spin),
        )| Soft {
            kind,
            cells,
            scale,
            density,
            stretch,
            volume,
            struts,
            filling,
            matched,
            ground: ground.filter(|_| reach.held),
            sticky: sticky && reach.held,
            collide,
            pins: pins.filter(|_| reach.held).unwrap_or_default(),
            deformation: deformation.filter(|_| reach.held),
            position,
            velocity,
            spin,
        },
    )
}

fn wild(reach: Reach) -> impl Strategy<Value = Wild> {
    let colliders = if reach.held { 0..3_usize } else { 0..1 };
    let rate = if reach.held { -1.0..6.0_f32 } else { 1.5..2.4 };
    let gravity = prop_oneof![
        1 => Just(Vec3::ZERO),
        2 => Just(Vec3::new(0.0, -9.81, 0.0)),
        1 => vector(20.0),
    ];
    (
        prop::collection::vec(soft(reach), 1..4),
        prop::collection::vec((0..3_u8, vector(3.0), 0..5_u8), colliders),
        gravity,
        power(rate),
        1..9_u32,
        1..5_u32,
    )
        .prop_map(
            |(bodies, colliders, gravity, rate, substeps, iterations)| Wild {
                bodies,
                colliders,
                gravity,
                rate: f64::from(rate),
                substeps,
                iterations,
            },
        )
}

fn pinned(world: &World) -> Vec<Vec<(usize, Vec4)>> {
    let of = |body: &Body| {
        let positions = body.particles.positions.iter().copied().enumerate();
        positions.filter(|(_, x)| x.w == 0.0).collect()
    };
    world.bodies.iter().map(of).collect()
}

/// Number of ticks that are checked.
const TICKS: usize = 20;

/// A world has the same state after these ticks on any number of threads, and with the least instructions.
pub fn assert_deterministic(start: &World, ticks: usize, expected: u64) {
    let assert_same = |mut again: World, what: &str| {
        (0..ticks).for_each(|_| again.tick());
        assert_eq!(again.state_hash(), expected, "{what}");
    };
    for count in [1, 2, 8] {
        let threads = Threads::new(count).expect("they can be had");
        let again = World {
            threads,
            ..start.clone()
        };
        assert_same(again, &format!("{count} threads"));
    }
    let instructions = Instructions::all().pop().expect("there is one at least");
    let again = World {
        instructions,
        ..start.clone()
    };
    assert_same(again, "least instructions");
}

/// For any valid scene: after every tick each body is finite, or is in quarantine at its last
/// finite state and reported; pinned particles have not moved by a bit; and the run is
/// bit-identical when repeated, on any number of threads and with any instruction set.
#[test]
fn any_world_stays_finite_or_is_quarantined_keeps_its_pins_and_is_deterministic() {
    fuzz("any world", 400, &wild(ALL), |wild| {
        let start = wild.world();
        let pins = pinned(&start);
        let mut world = start.clone();
        for tick in 1..=TICKS {
            world.tick();
            for (body, pins) in world.bodies.iter().zip(&pins) {
                let columns = body.particles.columns().into_iter();
                let mut state = columns.flat_map(|(_, column)| column);
                assert!(state.all(|v| v.is_finite()), "not finite after tick {tick}");
                for &(particle, place) in pins {
                    let now = body.particles.positions[particle];
                    assert_eq!(now, place, "pin {particle} after tick {tick}");
                }
                if let Some(quarantine) = &body.quarantine {
                    assert!(quarantine.vertex.index() < body.particles.len());
                    assert!(!quarantine.stage.is_empty() && body.particles.is_still());
                }
            }
        }
        assert_deterministic(&start, TICKS, world.state_hash());
    });
}

/// Half an ulp of 1 in f32: a number x is rounded by at most this times |x|.
const ROUNDING: f64 = 1.0 / 16_777_216.0;

/// Change of the mean velocity of a body by rounding in n substeps [m/s]. Positions are accurate to
/// f64; a displacement u is rounded by up to ε|u|, which changes a velocity by ε|u|/h, where
/// `speed` is the largest |u|/h. The prediction rounds a particle in uniform motion in the same way
/// in every substep: n times √3 of that, for the three coordinates. Each of the k projections of a
/// particle in a substep rounds it in a random direction: for N particles and n substeps these add
/// up like √(3kn/N), and four times that is not exceeded by chance.
fn drift(world: &World, body: &Body, substeps: f64, speed: f64) -> f64 {
    let kick = ROUNDING * speed;
    let particles = body.particles.len() as f64;
    let topology = &body.topology;
    let corners = body
        .effects
        .stretch
        .map_or(0, |_| 2 * topology.edges.ends().len())
        + body
            .effects
            .volume
            .map_or(0, |_| 4 * topology.tetrahedra.corners().len());
    let moves = corners as f64 / particles * f64::from(world.settings.iterations.get());
    kick * (3.0_f64.sqrt() * substeps + 4.0 * (3.0 * moves * substeps / particles).sqrt())
}

/// Errors of a free body, each relative to its limit: change of momentum, and gain of energy. Both
/// must be at most 1.
#[derive(Debug, Clone, Copy, Default)]
struct Worst {
    momentum: f64,
    energy: f64,
}

/// Runs a body alone. Its momentum must be the initial momentum plus the impulse of gravity, its
/// energy at most the initial energy plus 1 % of the largest kinetic energy, each except for
/// rounding.
fn alone(wild: &Wild, soft: &Soft) -> Worst {
    let mut world = Wild {
        bodies: vec![soft.clone()],
        ..wild.clone()
    }
    .world();
    world.sleep.enabled = false;
    let gravity = world.settings.gravity;
    let figures = |world: &World| {
        let particles = &world.bodies[0].particles;
        let potential = measure::gravitational_energy(particles, gravity);
        let energy = measure::kinetic_energy(particles) + potential;
        (measure::momentum(particles), energy)
    };
    let positions = world.bodies[0].particles.positions.iter();
    let mass: f64 = positions.map(|x| 1.0 / f64::from(x.w)).sum();
    let (momentum, energy) = figures(&world);
    let h = world.settings.substep_seconds();
    let turned = f64::from(soft.spin.length()) * h;
    let tau = ElasticKind::ALL.into_iter();
    let tau = tau.filter_map(|kind| world.bodies[0].effects.damping(kind));
    let gamma = tau.map(|tau| f64::from(tau.get())).fold(0.0, f64::max) / h;
    let (mut speed, mut fastest) = (0.0_f64, 0.0_f64);
    let mut worst = Worst::default();
    for tick in 1..=TICKS {
        world.tick();
        let body = &world.bodies[0];
        if body.quarantine.is_some() {
            return Worst {
                momentum: f64::INFINITY,
                energy: f64::INFINITY,
            };
        }
        let particles = &body.particles;
        let ways = particles.displacements.iter();
        let largest = ways.fold(0.0_f32, |most, u| most.max(u.truncate().length()));
        speed = speed.max(f64::from(largest / particles.substep_seconds()));
        let (now, more) = figures(&world);
        let substeps = tick as f64 * f64::from(wild.substeps);
        let fallen: DVec3 = gravity.as_dvec3() * world.time;
        fastest = fastest.max(measure::rms_speed(&body.particles));
        // The change of velocity by gravity, and the velocity itself, are rounded as well.
        let steps = ROUNDING * (fastest + fallen.length()) * substeps;
        let drift = drift(&world, body, substeps, speed) + steps;
        let deviation = ((now - momentum) / mass - fallen).length();
        worst.momentum = worst.momentum.max(deviation / drift);
        // A rotation by φ in a substep is followed to first order: with its angular momentum kept, the body
        // may contract and turn faster by φ² of its energy, and by γφ² where its strains are damped over
        // τ = γh. More substeps make both small.
        let rotation = fastest * fastest * mass * 0.5 * turned * turned * (1.0 + gamma);
        let allowed =
            0.005 * mass * fastest * fastest + rotation + mass * (fastest * drift + drift * drift);
        worst.energy = worst.energy.max((more - energy) / allowed);
    }
    worst
}

/// A free body of any parameters keeps its momentum, and it gains no energy.
#[test]
fn a_free_body_keeps_its_momentum_and_gains_no_energy() {
    fuzz("free bodies", 1500, &wild(FREE), |wild| {
        for soft in &wild.bodies {
            let Worst { momentum, energy } = alone(&wild, soft);
            assert!(
                momentum <= 1.0,
                "momentum is off by {momentum} of what f32 allows"
            );
            assert!(energy <= 1.0, "it gained {energy} of what may be");
        }
    });
}

/// Incompressible volumes whose damping lasts many substeps, in a cube that falls freely from rest:
/// when their damping acted after the undamped edges, it fluttered from rounding.
#[test]
fn a_rigid_volume_that_is_damped_for_many_substeps_does_not_flutter() {
    for damping in [0.003, 0.013_579_568, 0.1, 1.0, 1000.0] {
        let soft = Soft {
            cells: 3,
            density: 10.0,
            volume: Some((0.0, damping)),
            ..block()
        };
        let wild = Wild {
            gravity: Vec3::new(0.0, -9.81, 0.0),
            rate: 188.278_411_865_234_38,
            substeps: 7,
            ..lone(&soft)
        };
        let energy = alone(&wild, &soft).energy;
        assert!(energy <= 1.0, "τ = {damping} s gives {energy}");
    }
}

/// A block at rest, rigid, and free.
fn block() -> Soft {
    Soft {
        kind: Kind::Box,
        cells: 1,
        scale: 1.0,
        density: 1000.0,
        stretch: Some((0.0, 0.0)),
        volume: Some((0.0, 0.0)),
        struts: None,
        filling: None,
        matched: None,
        ground: None,
        sticky: false,
        collide: false,
        pins: Vec::new(),
        deformation: None,
        position: Vec3::ZERO,
        velocity: Vec3::ZERO,
        spin: Vec3::ZERO,
    }
}

/// A world with a single body.
fn lone(soft: &Soft) -> Wild {
    Wild {
        bodies: vec![soft.clone()],
        colliders: Vec::new(),
        gravity: Vec3::NEG_Y,
        rate: 60.0,
        substeps: 1,
        iterations: 1,
    }
}

/// A generated world has the requested parameters: otherwise the tests above would be void.
#[test]
fn random_worlds_contain_every_effect_pins_and_colliders() {
    let seen = std::cell::RefCell::new([0_usize; 8]);
    fuzz("what there is", 200, &wild(ALL), |wild| {
        let world = wild.world();
        let mut seen = seen.borrow_mut();
        seen[0] += world.colliders.len();
        for body in &world.bodies {
            let effects = &body.effects;
            seen[1] += usize::from(!body.pins.is_empty());
            seen[2] += usize::from(effects.stretch.is_some());
            seen[3] += usize::from(
                effects.volume.is_some() && body.topology.tetrahedra.corners().len() > 0,
            );
            seen[4] += usize::from(effects.ground.is_some());
            seen[5] += usize::from(effects.collide.is_some());
            seen[6] += usize::from(effects.sticky_ground.is_some());
            seen[7] += usize::from(effects.shape_matching.is_some());
        }
    });
    let seen = seen.into_inner();
    assert!(seen.iter().all(|count| *count > 0), "{seen:?}");
}

/// Settings at both limits of their ranges step a body, or leave it unchanged.
#[test]
fn limits_of_every_setting_can_be_stepped() {
    let held = Soft {
        ground: Some((0.0, 0.5, 0.0)),
        pins: vec![0],
        ..block()
    };
    for rate in [0.1, 1e6] {
        for (substeps, iterations) in [(1, 1), (10_000, 1), (1, 10_000)] {
            let wild = Wild {
                rate,
                substeps,
                iterations,
                ..lone(&held)
            };
            let mut world = wild.world();
            world.tick();
            let body = &world.bodies[0];
            let finite = body.particles.positions.iter().all(|x| x.is_finite());
            let settings = world.settings;
            assert!(finite && body.quarantine.is_none(), "{settings:?}");
        }
    }
}
