//! A body with the mesh of a grid is stepped in strips, one per lane: with the bits of the same order
//! without lanes.

use crate::{
    all_effects::{self, samples},
    support::{
        body, chain, cube, damping, elastic_on_ground, pinned, random_vector, settings, state_bits,
        with,
    },
    support_app::deterministic,
};
use glam::{DVec3, UVec2, Vec2, Vec3};
use pliant::{
    mesh::Primitive,
    solver::{
        Body, Collide, Collider, ColliderShape, Controls, Effects, ElasticKind, ExternalForce,
        ExternalImpulse, Grab, Grabs, Ground, Height, Hold, Instructions, ParticleIndex, Particles,
        Path, PinTargets, Pose, Restitution, Settings, StickyGround, StrainLimit, Stretch,
        SurfacePoint, Threads, VertexIndex, Volume, World,
        advance::{Stage, StepContext, Watch},
        contact::{Swept, rotation},
        deform::Random,
        tick::{Member, Tick, Work},
    },
};

/// Steps bodies without lanes: a watch sees one task after the other.
#[derive(Debug)]
struct Bystander;

impl Watch for Bystander {
    fn observe(&self, _: Stage, work: &mut dyn FnMut()) {
        work();
    }
}

fn cloth(across: u32, along: u32) -> pliant::solver::RestShape {
    let cells = UVec2::new(across, along);
    Primitive::Cloth {
        size: cells.as_vec2() * Vec2::splat(0.05),
        cells,
        diagonals: Default::default(),
        shear: true,
    }
    .build()
    .expect("sound")
    .shape
}

/// Edges and tetrahedra, damped or not, in the air.
fn elastic(tau: f32) -> Effects {
    let plain = crate::support::elastic();
    let damping = damping(tau);
    Effects {
        stretch: plain.stretch.map(|it| Stretch { damping, ..it }),
        volume: plain.volume.map(|it| Volume { damping, ..it }),
        ..Effects::default()
    }
}

/// A body of strips, in motion, that hangs from a vertex.
fn moving(shape: pliant::solver::RestShape, density: f32, effects: Effects) -> Body {
    let mut body = pinned(with(body("grid", shape, density), effects), &[0]);
    let mut random = Random::new(7);
    for i in 1..body.particles.len() {
        body.particles
            .set_velocity(i, random_vector(&mut random, 0.5));
    }
    body.translate(Vec3::Y * 0.3);
    assert!(body.topology.partitions.strips().is_some(), "it is a grid");
    body
}

/// Performs ticks, in lanes unless they are watched.
fn run(
    body: &Body,
    settings: &Settings,
    (instructions, threads): (Instructions, usize),
    watch: Option<&dyn Watch>,
) -> Body {
    run_among(&[], body, settings, (instructions, threads), watch)
}

/// The same among colliders.
fn run_among(
    colliders: &[Collider],
    body: &Body,
    settings: &Settings,
    (instructions, threads): (Instructions, usize),
    watch: Option<&dyn Watch>,
) -> Body {
    let mut body = body.clone();
    let mut swept = Swept::default();
    let threads = Threads::new(threads).expect("a valid number of threads");
    for tick in 0..4 {
        let time = f64::from(tick) * settings.tick_seconds();
        swept.fill(colliders.iter(), settings, time);
        let context = StepContext {
            settings,
            time,
            swept: &swept,
            threads: &threads,
            instructions,
            watch,
        };
        let work = Work {
            keeps_multipliers: true,
            is_tracked: false,
            has_group: false,
        };
        let mut tick = Tick::default();
        let mut bodies = [Member::new(0, &mut body)];
        tick.begin(&mut bodies, work, &context);
        tick.advance(&mut bodies, &(0..settings.substeps.get()), work, &context);
    }
    body
}

/// Compares a body in lanes, with each set of instructions and on several threads, with the same
/// without. Returns whether it was in lanes with the best ones.
fn assert_equal(what: &str, body: &Body, settings: &Settings) -> bool {
    let best = (Instructions::default(), 1);
    let plain = run(body, settings, best, Some(&Bystander));
    for instructions in Instructions::all() {
        for threads in [1, 2, 3] {
            let lanes = run(body, settings, (instructions, threads), None);
            let what = format!("{what}, {}, {threads} threads", instructions.name());
            let bits = |particles: &Particles| state_bits(particles);
            assert_eq!(bits(&lanes.particles), bits(&plain.particles), "{what}");
            assert_eq!(lanes.states, plain.states, "{what}: multipliers");
            assert_eq!(lanes.quarantine, plain.quarantine, "{what}");
        }
    }
    // With other instructions only nearly full lanes pay.
    let may_stay = !Instructions::default().name().starts_with("AVX");
    may_stay || run(body, settings, best, None).states.bytes() > plain.states.bytes()
}

/// Each elastic effect, damped or not, with one iteration and with several; in the air, where
/// particles stay in lanes, and on the ground.
#[test]
fn strips_have_the_bits_of_the_same_order_without_lanes() {
    let mut in_lanes = Vec::new();
    for (name, _, sample) in samples() {
        let kind = ElasticKind::ALL.into_iter().find(|&kind| sample.has(kind));
        let Some(kind) = kind else { continue };
        let is_solid = matches!(kind, ElasticKind::Volume | ElasticKind::NeoHookean);
        let under = elastic(0.0);
        for (tau, iterations, on_ground) in [
            (0.0, 1, false),
            (0.0, 3, false),
            (0.01, 1, false),
            (0.01, 2, true),
            (0.0, 1, true),
        ] {
            let mut effects = Effects {
                stretch: elastic(tau).stretch,
                ground: elastic_on_ground().ground.filter(|_| on_ground),
                ..sample
            };
            if is_solid {
                effects.volume = sample.volume.or(under.volume);
            }
            let settings = settings(9.81, 60.0, 3, iterations);
            let shapes = match is_solid {
                true => vec![cube(0.4, 8), cube(1.0, 20)],
                false => vec![cloth(9, 7), cloth(20, 20), cloth(50, 45)],
            };
            for shape in shapes {
                let body = moving(shape, if is_solid { 1000.0 } else { 0.2 }, effects);
                let what = format!(
                    "{name} on {} particles, {iterations} iterations",
                    body.particles.len()
                );
                if assert_equal(&what, &body, &settings) {
                    in_lanes.push(name);
                }
            }
        }
    }
    in_lanes.dedup();
    for name in [
        "stretch",
        "volume",
        "neo_hookean",
        "bend",
        "isometric_bend",
        "membrane",
        "weave",
        "strain_limit",
    ] {
        assert!(in_lanes.contains(&name), "{name} is not among {in_lanes:?}");
    }
}

/// All elastic effects together, damped.
#[test]
fn all_elastic_effects_together() {
    let effects = all_effects::elastic(damping(0.01));
    for (shape, density) in [(cloth(20, 20), 0.2), (cube(0.4, 8), 1000.0)] {
        let body = moving(shape, density, effects);
        let settings = settings(9.81, 60.0, 3, 2);
        assert!(assert_equal("all", &body, &settings), "it is in lanes");
    }
}

/// Ground and colliders act on particles that stay in lanes for a tick: on none, on some, on all; moved
/// and rough, with bounces, with several iterations, and where forces of contacts are measured.
#[test]
fn contacts_of_bodies_in_lanes_are_those_without() {
    let below = |depth: f32| Height::of(0.3 - depth);
    let ball = ColliderShape::Sphere { radius: 0.1 };
    let slab = ColliderShape::Box {
        size: Vec3::new(0.4, 0.2, 9.0),
    };
    let at = |x: f64, y: f64| Pose {
        rotation: rotation(DVec3::Z, 0.4),
        translation: DVec3::new(x, y, 0.0),
    };
    let shaken = Path::Oscillate {
        travel: Vec3::new(0.1, 0.2, 0.0),
        period: 0.07,
    };
    let moving_ball = Collider::moving(ball, at(0.2, 0.15), shaken).expect("sound");
    let colliders = [
        moving_ball,
        Collider::new(slab, at(-0.3, 0.1)).expect("sound"),
    ];
    let mut touched = [0; 3];
    for (depth, bounce, iterations, recorded) in [
        (9.0, 0.0, 1, false),
        (0.02, 0.0, 1, false),
        (0.0, 0.0, 1, false),
        (-0.02, 0.0, 1, false),
        (0.01, 0.5, 1, false),
        (0.01, 0.0, 3, false),
        (0.01, 0.0, 1, true),
    ] {
        // What bounces changes carries, which damped constraints read.
        let tau = if bounce > 0.0 { 0.01 } else { 0.0 };
        let restitution = Restitution::of(bounce);
        let ground = Ground {
            height: below(depth),
            restitution,
            ..Ground::default()
        };
        let on_ground = Effects {
            ground: Some(ground),
            ..Effects::default()
        };
        let sticks = Effects {
            sticky_ground: Some(StickyGround {
                height: below(depth),
            }),
            ..Effects::default()
        };
        let collides = Effects {
            collide: Some(Collide {
                restitution,
                ..Collide::default()
            }),
            ..on_ground
        };
        let kinds = [on_ground, sticks, collides].into_iter().enumerate();
        for ((kind, contact), shape) in kinds.flat_map(|kind| {
            [cloth(20, 20), cloth(50, 45), cube(0.4, 8)].map(|shape| (kind, shape))
        }) {
            let is_sheet = shape.tetrahedra.is_empty();
            let elastic = elastic(tau);
            let effects = Effects {
                stretch: elastic.stretch,
                volume: elastic.volume.filter(|_| !is_sheet),
                ..contact
            };
            let mut body = moving(shape, if is_sheet { 0.2 } else { 1000.0 }, effects);
            body.states.records_contacts = recorded;
            let settings = settings(9.81, 60.0, 5, iterations);
            let best = (Instructions::default(), 1);
            let plain = run_among(&colliders, &body, &settings, best, Some(&Bystander));
            let mut free = body.clone();
            free.effects = Effects {
                stretch: effects.stretch,
                volume: effects.volume,
                ..Effects::default()
            };
            let free = run(&free, &settings, best, None);
            touched[kind] +=
                usize::from(state_bits(&plain.particles) != state_bits(&free.particles));
            for instructions in Instructions::all() {
                for threads in [1, 2] {
                    let with = (instructions, threads);
                    let lanes = run_among(&colliders, &body, &settings, with, None);
                    let what = format!("{contact:?}, {}, {threads} threads", instructions.name());
                    assert_eq!(lanes.particles, plain.particles, "{what}");
                    assert_eq!(state_bits(&lanes.particles), state_bits(&plain.particles));
                    assert_eq!(lanes.states.surface_forces(), plain.states.surface_forces());
                }
            }
        }
    }
    assert!(
        touched.iter().all(|it| *it >= 9),
        "{touched:?} bodies touched something"
    );
}

/// The pointer and an app act on bodies that stay in lanes: a force on the whole and at points, pins that move, a
/// grab of a point, of a patch and of pins, one and several; each alone, all together, and on the ground.
#[test]
fn what_the_pointer_and_an_app_do_leaves_bodies_in_lanes() {
    let point = |terms: &[(u32, f32)]| {
        let terms: Vec<_> = terms.iter().map(|&(i, b)| (ParticleIndex(i), b)).collect();
        SurfacePoint::new(&terms).expect("a point")
    };
    let grab = |terms: &[(u32, f32)], hold| Grab {
        hold,
        ..Grab::on(point(terms), Vec3::new(0.3, 0.5, 0.1), 0.1, 1.0, 9.81)
    };
    let patch = Hold::Patch { radius: 0.2 };
    let one = grab(&[(40, 0.25), (41, 0.75)], Hold::Point);
    let force = ExternalForce::on_whole(Vec3::new(0.3, 0.1, -0.2));
    let pushes = ExternalForce::at(point(&[(30, 0.5), (90, 0.5)]), Vec3::X)
        .and_at(point(&[(90, 1.0)]), Vec3::Y);
    let targets = PinTargets::of(VertexIndex(0), Vec3::new(0.05, 0.4, 0.0))
        .and(VertexIndex(0), Vec3::new(0.02, 0.35, 0.0));
    let several = Grabs::new([
        one,
        grab(&[(77, 1.0)], patch),
        grab(&[(0, 1.0)], Hold::Pins),
    ]);
    let all = Controls {
        force: Some(pushes.clone().and_at(point(&[(3, 1.0)]), Vec3::Z)),
        targets: Some(targets.clone()),
        grabs: Some(several.clone()),
        impulse: Some(ExternalImpulse::on_whole(Vec3::X * 0.1)),
    };
    let cases = [
        (
            None,
            Controls {
                force: Some(force),
                ..Controls::default()
            },
        ),
        (
            None,
            Controls {
                force: Some(pushes),
                ..Controls::default()
            },
        ),
        (
            None,
            Controls {
                targets: Some(targets),
                ..Controls::default()
            },
        ),
        (
            None,
            Controls {
                grabs: Some(several),
                ..Controls::default()
            },
        ),
        (Some(one), Controls::default()),
        (Some(grab(&[(77, 1.0)], patch)), all.clone()),
        (Some(grab(&[(0, 1.0)], Hold::Pins)), all),
    ];
    for (case, (grab, controls)) in cases.into_iter().enumerate() {
        for (shape, density) in [
            (cloth(20, 20), 0.2),
            (cloth(50, 45), 0.2),
            (cube(0.4, 8), 1000.0),
        ] {
            let is_sheet = shape.tetrahedra.is_empty();
            let elastic = elastic(if case % 2 == 0 { 0.0 } else { 0.01 });
            let effects = Effects {
                stretch: elastic.stretch,
                volume: elastic.volume.filter(|_| !is_sheet),
                ground: elastic_on_ground().ground.filter(|_| case > 4),
                grab,
                ..Effects::default()
            };
            let mut body = moving(shape, density, effects);
            let settings = settings(9.81, 60.0, 4, 1 + case as u32 % 3);
            let best = (Instructions::default(), 1);
            let free = run(
                &Body {
                    effects: Effects {
                        grab: None,
                        ..effects
                    },
                    ..body.clone()
                },
                &settings,
                best,
                None,
            );
            *body.control() = controls.clone();
            let acted = run(&body, &settings, best, None);
            assert_ne!(
                state_bits(&acted.particles),
                state_bits(&free.particles),
                "case {case}"
            );
            assert!(
                assert_equal(&format!("case {case}"), &body, &settings),
                "it is in lanes"
            );
        }
    }
}

/// One effect fills the lanes, another does not and is solved between, without lanes.
#[test]
fn effects_in_lanes_and_others_take_turns() {
    let (_, _, bend) = samples()
        .into_iter()
        .find(|(name, ..)| *name == "bend")
        .expect("a sample");
    for (tau, iterations) in [(0.0, 1), (0.02, 3)] {
        let effects = Effects {
            bend: bend.bend,
            strain_limit: Some(StrainLimit::default()),
            ..elastic(tau)
        };
        // The folds of the surface of a solid do not repeat as its cells do.
        let body = moving(cube(1.0, 20), 1000.0, effects);
        let settings = settings(9.81, 60.0, 4, iterations);
        assert!(assert_equal("both", &body, &settings), "it is in lanes");
    }
}

/// Far too fast: a particle diverges in the middle of a tick, in one partition and in several.
#[test]
fn divergence_in_lanes_is_that_without() {
    for cells in [20, 60] {
        for on_ground in [false, true] {
            let effects = match on_ground {
                true => elastic_on_ground(),
                false => elastic(0.0),
            };
            let effects = Effects {
                volume: None,
                ..effects
            };
            let mut body = moving(cloth(cells, cells), 0.2, effects);
            let middle = body.particles.len() / 2;
            body.particles.set_velocity(middle, Vec3::Y * 3e38);
            let settings = settings(9.81, 60.0, 4, 1);
            let best = (Instructions::default(), 1);
            let [lanes, plain] = [None, Some(&Bystander as &dyn Watch)]
                .map(|watch| run(&body, &settings, best, watch));
            assert!(lanes.quarantine.is_some(), "it diverges");
            assert_eq!(lanes.quarantine, plain.quarantine);
            assert_eq!(state_bits(&lanes.particles), state_bits(&plain.particles));
        }
    }
}

/// The state that a failed tick is left in, before it is restored: positions are finite, and the
/// failing particle is the same.
#[test]
fn a_failed_tick_leaves_the_state_of_the_substep_before() {
    let mut body = moving(
        cloth(20, 20),
        0.2,
        Effects {
            volume: None,
            ..elastic(0.0)
        },
    );
    body.particles.set_velocity(200, Vec3::Y * 3e38);
    let settings = settings(9.81, 60.0, 4, 1);
    let world = World::default();
    let [lanes, plain] = [None, Some(&Bystander as &dyn Watch)].map(|watch| {
        let mut body = body.clone();
        body.begin_tick(true);
        let context = StepContext {
            settings: &settings,
            time: 0.0,
            swept: &world.swept,
            threads: &world.threads,
            instructions: world.instructions,
            watch,
        };
        let error = body.stepper().advance(0..4, &context);
        (error.expect_err("it diverges"), body)
    });
    assert_eq!(lanes.0, plain.0);
    assert!(lanes.1.particles.positions.iter().all(|p| p.is_finite()));
    // Where a displacement is not a number, its bits mean nothing.
    let numbers = |body: &Body| {
        let [positions, displacements, carry] = state_bits(&body.particles);
        let finite = |bits: &u32| f32::from_bits(*bits).is_finite();
        let displacements = displacements.as_flattened().iter().filter(|it| finite(it));
        (positions, displacements.copied().collect::<Vec<_>>(), carry)
    };
    assert_eq!(numbers(&lanes.1), numbers(&plain.1));
}

/// Stages one by one, threads, Bevy and snapshots agree with whole ticks; also of a sheet of which
/// many phases are in work at once.
#[test]
fn stages_threads_and_snapshots_agree() {
    for effects in [elastic_on_ground(), elastic(0.01)] {
        let cube = moving(cube(0.4, 8), 1000.0, effects);
        let sheet = Effects {
            volume: None,
            ..effects
        };
        let large = moving(cloth(95, 95), 0.2, sheet);
        assert!(large.topology.partitions.count() > 16);
        let cloth = moving(cloth(47, 47), 0.2, sheet);
        let world = World {
            settings: settings(9.81, 60.0, 5, 1),
            bodies: vec![cube, cloth, large],
            ..World::default()
        };
        deterministic(world, 20);
    }
}

/// Whatever the size, constraints that are solved together share no particle, and each is solved.
#[test]
fn patterns_cover_all_constraints_of_grids() {
    for shape in [
        cloth(3, 3),
        cloth(7, 100),
        cloth(100, 7),
        cloth(64, 64),
        cube(0.4, 8),
        cube(0.4, 16),
    ] {
        let (edges, tetrahedra) = (shape.edges.len(), shape.tetrahedra.len());
        let body = body("grid", shape, 1.0);
        let topology = &body.topology;
        let elements = &topology.edges.elements;
        let mut seen = 0;
        for batch in elements.batches() {
            for (_, group) in elements.groups(batch) {
                let mut all: Vec<u32> = group.iter().flatten().map(|it| it.particle()).collect();
                let count = all.len();
                all.sort_unstable();
                all.dedup();
                assert_eq!(all.len(), count, "a color has each particle once");
                seen += group.len();
            }
        }
        assert_eq!(seen, edges);
        assert_eq!(topology.tetrahedra.corners().len(), tetrahedra);
    }
}

/// A grid of a few cells, a rope and a filled surface are not cut into strips, as few lanes would be
/// used.
#[test]
fn bodies_without_patterns_are_not_cut_into_strips() {
    let bunny = pliant::scene::asset::load("bunny").expect("built in");
    let options = pliant::mesh::BuildOptions {
        cells: Some(5),
        ..Default::default()
    };
    let bunny = pliant::mesh::build(bunny, &options).expect("sound").shape;
    for shape in [cube(0.4, 1), chain(64, 0.1), bunny] {
        let body = body("no grid", shape, 1.0);
        assert_eq!(body.topology.partitions.strips(), None);
    }
}
