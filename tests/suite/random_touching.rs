//! Random worlds of bodies that touch, tear, and come and go: rods, grains, cloth and solids in each
//! other's way. The universal guarantees hold for them as for [those of a lone
//! body](crate::random_worlds).

use crate::{
    fuzz_support::fuzz,
    random_worlds::assert_deterministic,
    support::{body, settings, stretch, volume},
};
use glam::{DVec3, UVec2, UVec3, Vec2, Vec3, Vec4};
use pliant::{
    mesh::Primitive,
    solver::{
        Bend, Body, BreakingStrain, Collide, Collider, ColliderShape, Contact, Emitter, Force,
        GrainRolling, Grains, Ground, Membrane, NeoHookean, PieceSize, Pose, SelfContact, Sink,
        Tear, Toughness, Turbulence, VertexIndex, Wind, World,
    },
};
use proptest::prelude::*;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Rod,
    Hair,
    Grains,
    Springs,
    Membrane,
    Solid,
}

const KINDS: [Kind; 6] = [
    Kind::Rod,
    Kind::Hair,
    Kind::Grains,
    Kind::Springs,
    Kind::Membrane,
    Kind::Solid,
];

/// A body; lengths in m.
#[derive(Debug, Clone)]
struct Thing {
    kind: Kind,
    cells: u32,
    /// Power of ten of a compliance or of 1 over a modulus.
    softness: f32,
    touches_itself: bool,
    /// Powers of ten of the toughness and of the force, and the strain.
    tears: Option<(f32, f32, f32)>,
    /// Of grains: rolling resistance, rate of an emitter, and whether there is a sink.
    rolls: Option<f32>,
    emits: Option<f32>,
    sinks: bool,
    blown: Option<Vec3>,
    pins: Vec<u32>,
    position: Vec3,
    velocity: Vec3,
}

fn power(range: std::ops::Range<f32>) -> impl Strategy<Value = f32> {
    range
}

fn vector(most: f32) -> impl Strategy<Value = Vec3> {
    let one = move || -most..most;
    (one(), one(), one()).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

fn thing() -> impl Strategy<Value = Thing> {
    let made = (
        prop::sample::select(KINDS.to_vec()),
        1..5_u32,
        power(-9.0..-2.0),
        any::<bool>(),
    );
    let tears = (power(-4.0..4.0), power(-3.0..4.0), 0.02..2.0_f32);
    let changes = (
        prop::option::of(tears),
        prop::option::of(0.0..1.0_f32),
        prop::option::of(power(0.0..5.0)),
        any::<bool>(),
        prop::option::weighted(0.3, vector(30.0)),
        prop::collection::vec(any::<u32>(), 0..3),
    );
    (made, changes, vector(0.4), vector(6.0)).prop_map(
        |(
            (kind, cells, softness, touches_itself),
            (tears, rolls, emits, sinks, blown, pins),
            position,
            velocity,
        )| Thing {
            kind,
            cells,
            softness,
            touches_itself,
            tears,
            rolls,
            emits,
            sinks,
            blown,
            pins,
            position,
            velocity,
        },
    )
}

impl Thing {
    fn body(&self) -> Body {
        let cells = self.cells;
        let (primitive, density) = match self.kind {
            Kind::Rod => {
                let (length, segments) = (0.6, 4 * cells);
                (Primitive::Rope { length, segments }, 0.1)
            }
            Kind::Hair => {
                let hair = Primitive::Hair {
                    radius: 0.1,
                    coverage: 90.0,
                    strands: 3 * cells,
                    length: 0.2,
                    segments: 6,
                    curl: 0.0,
                    turns: 0.0,
                };
                (hair, 1e-3)
            }
            Kind::Grains => {
                let grains = Primitive::Grains {
                    size: Vec3::splat(0.06 * cells as f32),
                    region: Default::default(),
                    radius: 0.02,
                    variation: 0.3,
                };
                (grains, 1500.0)
            }
            Kind::Springs | Kind::Membrane => {
                let cloth = Primitive::Cloth {
                    size: Vec2::splat(0.5),
                    cells: UVec2::splat(3 * cells),
                    diagonals: Default::default(),
                    shear: self.kind == Kind::Springs,
                };
                (cloth, 0.2)
            }
            Kind::Solid => {
                let (size, cells) = (Vec3::splat(0.3), UVec3::splat(cells));
                (Primitive::Box { size, cells }, 800.0)
            }
        };
        let shape = primitive.build().expect("a sound shape").shape;
        let mut body = body("thing", shape, density);
        let soft = libm::powf(10.0, self.softness);
        let modulus = f64::from(1e-2 / soft);
        let effects = &mut body.effects;
        match self.kind {
            Kind::Rod | Kind::Hair => {
                effects.rod = Some(pliant::solver::Rod {
                    youngs_modulus: modulus.max(1e3).try_into().expect("in range"),
                    radius: 2e-3.try_into().expect("in range"),
                    ..Default::default()
                });
            }
            Kind::Grains => {
                effects.grains = Some(Grains {
                    rolling_resistance: GrainRolling::of(self.rolls.unwrap_or(f32::INFINITY)),
                    ..Grains::default()
                });
                effects.emitter = self.emits.map(|rate| Emitter {
                    rate: f64::from(libm::powf(10.0, rate))
                        .try_into()
                        .expect("in range"),
                    capacity: 200.0.try_into().expect("in range"),
                    lifetime: 0.2.try_into().expect("in range"),
                    radius: 0.02.try_into().expect("in range"),
                    y: 0.3.try_into().expect("in range"),
                    ..Emitter::default()
                });
                effects.sink = self.sinks.then(|| Sink {
                    y: (-0.2).try_into().expect("in range"),
                    ..Sink::default()
                });
            }
            Kind::Springs => {
                effects.stretch = stretch(soft);
                effects.bend = Some(Bend::default());
            }
            Kind::Membrane => effects.membrane = Some(Membrane::default()),
            Kind::Solid if self.touches_itself => effects.neo_hookean = Some(NeoHookean::default()),
            Kind::Solid => {
                effects.stretch = stretch(soft);
                effects.volume = volume(0.0);
            }
        }
        effects.contact = Some(Contact::default());
        effects.collide = Some(Collide::default());
        effects.ground = Some(Ground {
            height: (-1.0).try_into().expect("in range"),
            ..Ground::default()
        });
        if self.kind != Kind::Grains {
            effects.self_contact = self.touches_itself.then(SelfContact::default);
            effects.tear = self.tears.map(|(toughness, force, strain)| Tear {
                toughness: Toughness::of(libm::powf(10.0, toughness)),
                force: Force::of(libm::powf(10.0, force)),
                strain: BreakingStrain::of(strain),
                smallest_piece: PieceSize::of(1),
            });
        }
        if let Some(wind) = self.blown {
            effects.wind = Some(Wind {
                x: f64::from(wind.x).try_into().expect("finite"),
                z: f64::from(wind.z).try_into().expect("finite"),
                ..Wind::default()
            });
            effects.turbulence = Some(Turbulence::default());
        }
        // Grains are numbered anew when one disappears.
        if self.kind != Kind::Grains {
            let count = u32::try_from(body.particles.len()).expect("few");
            let pins = self.pins.iter().map(|pin| VertexIndex(pin % count));
            body.pins = pins.collect();
            body.pins.sort_unstable();
            body.pins.dedup();
        }
        body.update_masses();
        body.translate(self.position);
        body.set_velocity(self.velocity);
        body
    }
}

fn world(things: &[Thing], rate: f64, substeps: u32, iterations: u32) -> World {
    let ball = ColliderShape::Sphere { radius: 0.2 };
    let ball = Collider::new(ball, Pose::at(DVec3::new(0.1, -0.6, 0.0))).expect("sound");
    World {
        settings: settings(9.81, rate, substeps, iterations),
        bodies: things.iter().map(Thing::body).collect(),
        colliders: vec![ball],
        ..World::default()
    }
}

/// Vertices and positions of the pins.
fn pinned(body: &Body) -> Vec<(VertexIndex, Vec4)> {
    let at = |&pin: &VertexIndex| body.particles.positions[body.topology.particle(pin)];
    body.pins.iter().map(|pin| (*pin, at(pin))).collect()
}

const TICKS: usize = 15;

/// What happened in a set of random worlds, so that it is known to be one of touching and tearing
/// bodies.
#[derive(Debug, Default, Clone, Copy)]
struct Seen {
    kinds: [usize; KINDS.len()],
    touched: usize,
    torn: usize,
    emitted: usize,
}

/// After every tick each body is finite, or in quarantine; pins have not moved by a bit; and the run is
/// bit-identical on any number of threads and with any instruction set.
#[test]
fn bodies_that_touch_tear_and_come_stay_finite_and_are_deterministic() {
    let seen = std::cell::Cell::new(Seen::default());
    let worlds = (
        prop::collection::vec(thing(), 2..5),
        30.0..240.0_f64,
        1..9_u32,
        1..4_u32,
    );
    fuzz(
        "touching worlds",
        40,
        &worlds,
        |(things, rate, substeps, iterations)| {
            let start = world(&things, rate, substeps, iterations);
            let pins: Vec<_> = start.bodies.iter().map(pinned).collect();
            let mut world = start.clone();
            let mut now = seen.get();
            for tick in 1..=TICKS {
                world.tick();
                now.touched += usize::from(!world.contacts().touching().is_empty());
                for (body, pins) in world.bodies.iter().zip(&pins) {
                    let columns = body.particles.columns().into_iter();
                    let mut state = columns.flat_map(|(_, column)| column);
                    assert!(state.all(|v| v.is_finite()), "not finite after tick {tick}");
                    assert_eq!(&pinned(body), pins, "pins after tick {tick}");
                }
            }
            for ((thing, first), last) in things.iter().zip(&start.bodies).zip(&world.bodies) {
                let kind = KINDS.iter().position(|kind| *kind == thing.kind);
                now.kinds[kind.expect("one of them")] += 1;
                now.torn += last.topology.splits();
                let has_more = last.particles.len() != first.particles.len();
                now.emitted += usize::from(thing.kind == Kind::Grains && has_more);
            }
            seen.set(now);
            assert_deterministic(&start, TICKS, world.state_hash());
        },
    );
    let seen = seen.get();
    let all = seen.kinds.iter().all(|count| *count > 0);
    assert!(
        all && seen.touched > 100 && seen.torn > 100 && seen.emitted > 5,
        "{seen:?}"
    );
}
