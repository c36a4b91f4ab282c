//! Bodies that touch each other or themselves.

use super::{common::*, contact};
use crate::solver::{
    Collide, Contact, Damping, Grab, Ground, ParticleIndex, Path, RecoverySpeed, Rod, RodRadius,
    SelfContact, SurfacePoint, VertexIndex, YoungsModulus,
};
use glam::Vec3;
use std::f32::consts::TAU;

const MATERIALS: &[(f32, f32)] = &[(1e-5, 0.02), (0.0, 0.0), (1e-6, 0.02), (1e-4, 0.02)];
const SCALES: &[f32] = &[1.0, 1e-3, 0.1, 10.0, 1e3];
const STEPS: &[(u32, u32)] = &[(10, 1), (1, 1), (4, 1), (32, 1), (4, 4)];
const SOLIDS: &[Shape] = &[
    Shape::Cube(3),
    Shape::Cube(1),
    Shape::Ball(4),
    Shape::Ring(2),
];
const CLOTHS: &[Shape] = &[Shape::Cloth(10), Shape::Cloth(3), Shape::Cloth(20)];

const fn axes(shapes: &'static [Shape], mixtures: u32) -> Axes {
    Axes {
        scales: SCALES,
        materials: MATERIALS,
        steps: STEPS,
        seeds: &[1],
        mixtures,
        ..Axes::all(shapes)
    }
}

/// Gives all bodies contact with each other, and all but solids with themselves.
fn touching(world: &mut World) {
    for body in &mut world.bodies {
        body.effects.contact = Some(Contact::default());
        if body.topology.tetrahedra.corners().len() == 0 {
            body.effects.self_contact = Some(SelfContact::default());
        }
    }
}

fn on_ground(member: &Member, world: &mut World) -> Result<(), TortureError> {
    world.settings.set_gravity(member.gravity())?;
    for body in &mut world.bodies {
        body.effects.ground = Some(Ground::default());
    }
    Ok(())
}

pub const COLLIDE: Case = Case {
    name: "collide",
    title: "Two bodies at 300 m/s",
    about: "Two bodies of 1 m hit each other off-center at 300 m/s. Their surfaces never cross, and momentum is constant.",
    seconds: |_| 0.2,
    family: |times| {
        let cloths = axes(&[Shape::Cloth(3), Shape::Cloth(10)], 4);
        family::of(times, &[axes(SOLIDS, 4), cloths])
    },
    start: Start::Make(|member, world| {
        stand_up(member, &mut world.bodies[0]);
        add_copy(world, Vec3::new(1.6, 0.21, 0.13));
        let speed = 150.0 * member.scale;
        world.bodies[0].set_velocity(Vec3::X * speed);
        world.bodies[1].set_velocity(Vec3::NEG_X * speed);
        touching(world);
        Ok(())
    }),
    during: nothing,
    judge: |_| Ok(Vec::new()),
    outside: Outside::Nothing,
    any_body: false,
};

pub const FOLDED: Case = Case {
    name: "folded",
    title: "A falling cloth folds",
    about: "A cloth falls on its edge and folds over itself on the ground. It never crosses itself.",
    seconds: |_| 2.0,
    family: |times| axes(CLOTHS, 8).members(times),
    start: Start::Make(|member, world| {
        let s = member.scale;
        let body = &mut world.bodies[0];
        stand_up(member, body);
        // Leaning, so that it falls to one side.
        place(body, |x| {
            Vec4::new(x.x + 0.05 * x.y, x.y + 0.7 * s, x.z, x.w)
        });
        touching(world);
        on_ground(member, world)
    }),
    during: nothing,
    judge: |run| Ok(vec![edge_strain(&run.end.bodies[0], 0.2)]),
    outside: Outside::Nothing,
    any_body: false,
};

pub const TWISTED: Case = Case {
    name: "twisted",
    title: "Two turns of twist",
    about: "A cloth starts with two turns of twist and springs back. It never crosses itself, gains no energy, and keeps its momentum.",
    seconds: |_| 1.0,
    family: |times| axes(CLOTHS, 8).members(times),
    start: Start::Make(|member, world| {
        let size = member.scale;
        let body = &mut world.bodies[0];
        place(body, |x| {
            let angle = 2.0 * TAU * x.x / size;
            let (sin, cos) = (libm::sinf(angle), libm::cosf(angle));
            Vec4::new(x.x, cos * x.y - sin * x.z, sin * x.y + cos * x.z, x.w)
        });
        for body in &mut world.bodies {
            body.effects.self_contact = Some(SelfContact::default());
        }
        Ok(())
    }),
    during: nothing,
    judge: |_| Ok(Vec::new()),
    outside: Outside::Nothing,
    any_body: false,
};

pub const PINCHED: Case = Case {
    name: "pinched",
    title: "Two bodies between plates",
    about: "Two plates press two bodies that lie on each other to six tenths of their height in 1 s and stay for 1 s. Their surfaces never cross.",
    seconds: |_| 2.0,
    family: |times| axes(SOLIDS, 8).members(times),
    start: Start::Make(|member, world| {
        let s = member.scale;
        add_copy(world, Vec3::new(0.1, 1.05, 0.05));
        touching(world);
        for body in &mut world.bodies {
            body.effects.collide = Some(Collide::default());
        }
        let inwards = |way: f32| Path::Stops {
            stops: vec![(0.0, Vec3::ZERO), (1.0, Vec3::Y * (way * s))],
            repeat: false,
        };
        world.colliders = vec![
            contact::plate(member, Vec3::NEG_Y, 0.51, inwards(0.4))?,
            contact::plate(member, Vec3::Y, 1.57, inwards(-0.4))?,
        ];
        Ok(())
    }),
    during: nothing,
    judge: |_| Ok(Vec::new()),
    outside: Outside::Work,
    any_body: false,
};

pub const OVERLAPPING: Case = Case {
    name: "overlapping",
    title: "Bodies that start in each other",
    about: "Two bodies start halfway in each other, with a recovery speed of half a body length per second. Within 2 s their surfaces no longer cross, and they part at less than twice that speed.",
    seconds: |_| 2.0,
    family: |times| {
        Axes {
            scales: &[1.0, 0.1, 10.0],
            ..axes(SOLIDS, 8)
        }
        .members(times)
    },
    start: Start::Make(|member, world| {
        add_copy(world, Vec3::new(0.5, 0.17, 0.11));
        touching(world);
        for body in &mut world.bodies {
            if let Some(contact) = &mut body.effects.contact {
                contact.recovery_speed = RecoverySpeed::new(0.5 * member.scale)?;
            }
        }
        Ok(())
    }),
    during: nothing,
    judge: |run| {
        let scale = f64::from(run.member.scale);
        let speeds = run.end.bodies.iter();
        let speeds = speeds.map(|body| measure::rms_speed(&body.particles) / scale);
        Ok(vec![
            Figure::none("crossings", run.end.crossings(), "crossings"),
            Figure::new(
                "speed, over the length",
                speeds.fold(0.0, f64::max),
                1.0,
                "1/s",
            ),
        ])
    },
    outside: Outside::Work,
    any_body: false,
};

/// Bodies of a stack.
const STACKED: u8 = 4;

pub const STACK: Case = Case {
    name: "stack",
    title: "A stack",
    about: "Four bodies stand on each other for 3 s. Their surfaces never cross, and each still stands above the one below it.",
    seconds: |_| 3.0,
    family: |times| axes(&[Shape::Cube(3), Shape::Cube(1), Shape::Cube(2)], 8).members(times),
    start: Start::Make(|member, world| {
        let s = member.scale;
        let thickness = 0.1 * world.bodies[0].topology.surface().mean_edge / s;
        place(&mut world.bodies[0], |x| {
            Vec4::new(x.x, x.y + 0.5 * s, x.z, x.w)
        });
        for place in 1..STACKED {
            add_copy(world, Vec3::Y * ((1.0 + thickness) * f32::from(place)));
        }
        touching(world);
        on_ground(member, world)
    }),
    during: nothing,
    judge: |run| {
        let middles = run.end.bodies.iter();
        let middles: Vec<_> = middles
            .map(|body| measure::center_of_mass(&body.particles))
            .collect();
        let scale = f64::from(run.member.scale);
        let fallen = middles.windows(2).filter(|pair| {
            let offset = (pair[1] - pair[0]) / scale;
            offset.y < 0.2 || offset.x.abs().max(offset.z.abs()) > 0.5
        });
        Ok(vec![Figure::none(
            "fallen bodies",
            fallen.count(),
            "bodies",
        )])
    },
    outside: Outside::Nothing,
    any_body: false,
};

/// Distance over which the end of the rope is pulled, in lengths, and speed [lengths/s].
const PULLED: (f32, f32) = (1.6, 0.5);

/// Particles at the two ends of the knotted rope, in the order of its file.
fn ends(body: &Body) -> [ParticleIndex; 2] {
    let last = body.topology.particles() as u32 - 1;
    [0, last].map(|vertex| body.topology.numbering.particle(VertexIndex(vertex)))
}

/// Pins one end of the rope.
fn pin_first(world: &mut World) {
    let body = &mut world.bodies[0];
    let [first, _] = ends(body);
    body.pins = vec![body.topology.vertex(first.index())];
    body.update_masses();
}

/// Pulls the other end away.
fn pull_last(member: &Member, world: &mut World) {
    let (far, speed) = PULLED;
    let time = (world.time + world.settings.tick_seconds()) as f32;
    let body = &mut world.bodies[0];
    let [_, last] = ends(body);
    let way = Vec3::X * (member.scale * (speed * time).min(far));
    let target = body.topology.rest[last.index()] + way;
    let gravity = 9.81 * member.scale;
    let mass = 100.0 * member.scale * Kind::Rope.density();
    body.effects.grab = SurfacePoint::new(&[(last, 1.0)])
        .map(|point| Grab::on(point, target, mass, member.scale, gravity));
}

/// Distance of the ends of the rope over its length: it does not pass through itself.
fn straightness(run: &Run) -> Figure {
    let body = &run.end.bodies[0];
    let at = |i: ParticleIndex| body.particles.position(i.index());
    let [first, last] = ends(body).map(at);
    let edges = body.topology.edges.ends();
    let length = edges.map(|[a, b]| {
        body.particles
            .position(a as usize)
            .distance(body.particles.position(b as usize))
    });
    let straight = first.distance(last) / length.sum::<f64>();
    Figure::new(
        "distance of the ends, over the length",
        straight * 100.0,
        98.0,
        "%",
    )
}

pub const KNOT: Case = Case {
    name: "knot",
    title: "A knot is pulled tight",
    about: "One end of a rope with an overhand knot is pinned, the other is pulled away until the knot is tight. The rope does not pass through itself: the ends stay closer than its length, by the length in the knot.",
    seconds: |_| 4.0,
    family: |times| {
        Axes {
            materials: &[(1e-4, 0.02), (1e-5, 0.02), (1e-3, 0.05)],
            ..axes(&[Shape::Knot], 6)
        }
        .members(times)
    },
    start: Start::Make(|_, world| {
        touching(world);
        pin_first(world);
        Ok(())
    }),
    during: |member, world| {
        pull_last(member, world);
        Ok(())
    },
    judge: |run| Ok(vec![straightness(run)]),
    outside: Outside::Work,
    any_body: false,
};

pub const HAIR_KNOT: Case = Case {
    name: "hair_knot",
    title: "A knot in a hair",
    about: "The same with a rod, which resists bending and twist and touches itself at its radius. It does not pass through itself.",
    seconds: |_| 4.0,
    family: |times| {
        Axes {
            materials: &[(0.0, 0.02)],
            // The radius of a rod is at most 1 m.
            scales: &[1.0, 1e-3, 0.1, 10.0, 100.0],
            ..axes(&[Shape::Knot], 6)
        }
        .members(times)
    },
    start: Start::Make(|member, world| {
        touching(world);
        pin_first(world);
        let effects = &mut world.bodies[0].effects;
        // With the mass of the rope per length, bending waves of all lengths move alike.
        effects.rod = Some(Rod {
            youngs_modulus: YoungsModulus::new(1e6)?,
            radius: RodRadius::new(4e-3 * member.scale)?,
            damping: Damping::new(member.damping)?,
            ..Rod::default()
        });
        effects.stretch = None;
        Ok(())
    }),
    during: |member, world| {
        pull_last(member, world);
        Ok(())
    },
    judge: |run| Ok(vec![straightness(run)]),
    outside: Outside::Work,
    any_body: false,
};
