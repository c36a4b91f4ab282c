//! Plates, impacts, grabs, and bodies that start inside a collider.

use super::common::*;
use crate::solver::{
    Collide, Collider, ColliderShape, Grab, Ground, ParticleIndex, Path, Pose, SurfacePoint,
};
use glam::Vec3;

/// Largest penetration of a particle into a collider at the end [m].
fn deepest(world: &World) -> f64 {
    let inside = world.colliders.iter().flat_map(|collider| {
        let pose = collider.pose_at(world.time);
        let positions = world.bodies[0].particles.positions.iter();
        positions.map(move |x| -collider.shape.distance(pose.undo(x.truncate().as_dvec3())))
    });
    inside.fold(0.0, f64::max)
}

fn not_inside(run: &Run, limit: f64) -> Figure {
    let depth = deepest(&run.end) / f64::from(run.member.scale);
    Figure::new(
        "depth inside a collider",
        depth * 100.0,
        limit * 100.0,
        "% of size",
    )
}

/// A flat box perpendicular to an axis, whose inner face is at distance `far` from the center.
pub(super) fn plate(
    member: &Member,
    along: Vec3,
    far: f32,
    path: Path,
) -> Result<Collider, TortureError> {
    let s = member.scale;
    let size = (Vec3::splat(6.0) - along.abs() * 5.0) * s;
    let place = along * ((far + 0.5) * s);
    Ok(Collider::moving(
        ColliderShape::Box { size },
        Pose::at(place.as_dvec3()),
        path,
    )?)
}

const BLOBS: &[Shape] = &[
    Shape::Cube(3),
    Shape::Cube(1),
    Shape::Cube(5),
    Shape::Ball(4),
    Shape::Ball(6),
];

pub const PLATES: Case = Case {
    name: "plates",
    title: "Squeezed between plates",
    about: "Two plates press a soft incompressible body to half its height in 1 s and stay for 1 s. No particle penetrates them, and the volume stays within 5 %.",
    seconds: |_| 2.0,
    family: |times| {
        Axes {
            materials: &[(1e-3, 0.02), (1e-2, 0.02), (1e-4, 0.02), (1e-5, 0.02)],
            steps: &[(10, 1), (4, 1), (16, 1), (32, 1), (10, 4)],
            seeds: &[1],
            mixtures: 16,
            ..Axes::all(BLOBS)
        }
        .members(times)
    },
    start: Start::Make(|member, world| {
        world.bodies[0].effects.collide = Some(Collide::default());
        let to = |way: f32| {
            let half = Vec3::Y * (way * member.scale);
            Path::Stops {
                stops: vec![(0.0, Vec3::ZERO), (1.0, half)],
                repeat: false,
            }
        };
        world.colliders = vec![
            plate(member, Vec3::Y, 0.5, to(-0.25))?,
            plate(member, Vec3::NEG_Y, 0.5, to(0.25))?,
        ];
        Ok(())
    }),
    during: nothing,
    judge: |run| {
        let body = &run.end.bodies[0];
        let error = measure::volume_error(&body.topology, &body.particles.positions).abs();
        Ok(vec![
            not_inside(run, 1e-5),
            Figure::new("error of volume", error * 100.0, 5.0, "%"),
        ])
    },
    outside: Outside::Work,
    any_body: false,
};

/// Speed of the impact [lengths/s].
const BLOW: f32 = 300.0;

pub const STRUCK: Case = Case {
    name: "struck",
    title: "Impact at 300 m/s",
    about: "A plate hits a body at 300 body lengths per second. No particle passes the plate, and within 1 s the body returns to its rest shape within 1 %.",
    seconds: |_| 1.05,
    family: |times| {
        let members = |shapes| Axes {
            materials: &[(0.0, 0.0), (1e-6, 0.02), (1e-5, 0.02), (1e-4, 0.02)],
            seeds: &[1],
            mixtures: 12,
            ..Axes::all(shapes)
        };
        family::of(
            times,
            &[
                members(BLOBS),
                members(&[Shape::Cloth(10), Shape::Cloth(3), Shape::Cloth(20)]),
                members(&[Shape::Rope(16), Shape::Rope(1)]),
            ],
        )
    },
    start: Start::Make(|member, world| {
        let body = &mut world.bodies[0];
        stand_up(member, body);
        body.effects.collide = Some(Collide::default());
        let way = 6.0;
        let stops = vec![
            (0.0, Vec3::ZERO),
            (way / BLOW, Vec3::X * (way * member.scale)),
        ];
        let path = Path::Stops {
            stops,
            repeat: false,
        };
        world.colliders = vec![plate(member, Vec3::NEG_X, 3.0, path)?];
        Ok(())
    }),
    during: nothing,
    judge: |run| {
        let front = run.end.colliders[0].pose_at(run.end.time).translation.x
            + 0.5 * f64::from(run.member.scale);
        let positions = run.end.bodies[0].particles.positions.iter();
        let behind = positions
            .filter(|x| f64::from(x.x) < front - 1e-5 * front.abs())
            .count();
        let mut figures = vec![Figure::none(
            "particles behind the plate",
            behind,
            "particles",
        )];
        figures.extend(shape_figures(&run.end.bodies[0], 0.01));
        Ok(figures)
    },
    outside: Outside::Work,
    any_body: false,
};

/// Duration of the grab [s].
const HELD: f64 = 1.0;

/// Linear drag in which the body comes to rest afterwards [1/s].
const MEDIUM: f32 = 10.0;

/// Grab target, in lengths: back and forth at 50 lengths per second; or a jump of ten lengths and
/// back, six times per second.
fn pull_target(member: &Member, time: f64) -> Vec3 {
    let time = time as f32;
    if member.variant == "teleported" {
        let away = (time * 12.0) as u32 % 2;
        return Vec3::new(10.0 * away as f32, 0.0, 0.0);
    }
    let period = 0.2;
    let phase = (time / period).fract();
    let there = if phase < 0.5 { phase } else { 1.0 - phase };
    Vec3::new(50.0 * period * there, 5.0 * there, 0.0)
}

pub const DRAGGED: Case = Case {
    name: "dragged",
    title: "Fast drag and teleport",
    about: "A body of 1 m is dragged to and fro at 50 m/s for 1 s, or the grab point jumps by 10 m. 1 s after release, with linear drag of 10/s, the body returns to its rest shape within 1 %. (Without drag it may keep rotating, which stretches it.)",
    seconds: |_| 2.0,
    family: |times| {
        let members = |shapes| Axes {
            scales: &[1.0, 0.1, 10.0],
            materials: &[(0.0, 0.0), (1e-6, 0.02), (1e-5, 0.02), (1e-4, 0.02)],
            seeds: &[1],
            mixtures: 8,
            ..Axes::all(shapes)
        };
        let members = family::of(
            times,
            &[
                members(BLOBS),
                members(&[Shape::Cloth(10), Shape::Cloth(3), Shape::Cloth(20)]),
                members(&[Shape::Rope(16), Shape::Rope(1)]),
            ],
        );
        family::variants(&members, &["dragged", "teleported"])
    },
    start: Start::Make(nothing),
    during: |member, world| {
        let (time, tick) = (world.time, world.settings.tick_seconds());
        let body = &mut world.bodies[0];
        if time > HELD {
            body.effects.grab = None;
            return medium(world, MEDIUM);
        }
        let target = |body: &Body| {
            let first = body.topology.rest[0];
            first + pull_target(member, time + tick) * member.scale
        };
        let goal = target(body);
        if body.effects.grab.is_none() && time == 0.0 {
            let masses = body.particles.positions.iter().map(|x| 1.0 / x.w);
            let gravity = 9.81 * member.scale;
            body.effects.grab = SurfacePoint::new(&[(ParticleIndex(0), 1.0)])
                .map(|point| Grab::on(point, goal, masses.sum(), member.scale, gravity));
        }
        if let Some(grab) = &mut body.effects.grab {
            grab.target = goal;
        }
        Ok(())
    },
    judge: |run| Ok(shape_figures(&run.end.bodies[0], 0.01)),
    outside: Outside::Work,
    any_body: false,
};

pub const OVERLAP: Case = Case {
    name: "overlap",
    title: "Initial overlap",
    about: "A body starts with its lower half below the ground, or with a ball or a box inside it. Within 1 s the overlap is resolved, at a speed below 2 body lengths per second.",
    seconds: |_| 1.0,
    family: |times| {
        let members = Axes {
            materials: &[(0.0, 0.0), (1e-6, 0.02), (1e-5, 0.02), (1e-4, 0.02)],
            seeds: &[1],
            mixtures: 8,
            ..Axes::all(BLOBS)
        };
        family::variants(&members.members(times), &["ground", "ball", "box"])
    },
    start: Start::Make(|member, world| {
        let s = member.scale;
        let body = &mut world.bodies[0];
        if member.variant == "ground" {
            body.effects.ground = Some(Ground::default());
            return Ok(());
        }
        body.effects.collide = Some(Collide::default());
        let shape = if member.variant == "ball" {
            ColliderShape::Sphere { radius: 0.3 * s }
        } else {
            ColliderShape::Box {
                size: Vec3::splat(0.5 * s),
            }
        };
        let pose = Pose::at((Vec3::new(0.05, -0.4, 0.1) * s).as_dvec3());
        world.colliders = vec![Collider::new(shape, pose)?];
        Ok(())
    }),
    during: nothing,
    judge: |run| {
        let body = &run.end.bodies[0];
        let scale = f64::from(run.member.scale);
        let lowest = body
            .particles
            .positions
            .iter()
            .map(|x| x.y)
            .fold(f32::INFINITY, f32::min);
        let inside = match run.member.variant {
            "ground" => f64::from(-lowest).max(0.0) / scale,
            _ => deepest(&run.end) / scale,
        };
        let speed = measure::rms_speed(&body.particles) / scale;
        Ok(vec![
            Figure::new("depth inside", inside * 100.0, 0.01, "% of size"),
            Figure::new("speed, over its length", speed, 2.0, "1/s"),
        ])
    },
    outside: Outside::Work,
    any_body: false,
};
