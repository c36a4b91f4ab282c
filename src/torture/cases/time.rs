//! Long, short and unequal time steps; coming to rest; long runs.

use super::common::*;
use crate::solver::{
    Ground, Rate, RollingResistance, Substeps,
    deform::{Deformation, deform},
};
use glam::{DVec3, Vec3};

/// Distance of the center of mass of a falling body from the symplectic Euler solution, relative to
/// the distance that it fell; `rate` is the rate of each tick.
///
/// A displacement hv is rounded by up to εhv in each of n substeps, and the error persists as a
/// velocity: after n substeps it is at most εn‖y‖, as hvn²/2 is at most n times the distance
/// fallen.
pub fn fall(run: &Run, rate: impl Fn(u64) -> f64) -> Figure {
    let (start, end) = (&run.start.bodies[0], &run.end.bodies[0]);
    let gravity = f64::from(run.end.settings.gravity.y);
    let substeps = run.end.settings.substeps.get();
    let (mut v, mut y, mut n) = (0.0, 0.0, 0.0);
    for tick in 0..run.end.tick {
        let h = 1.0 / (rate(tick) * f64::from(substeps));
        for _ in 0..substeps {
            v += gravity * h;
            y += v * h;
            n += 1.0;
        }
    }
    let center = |body: &Body| measure::center_of_mass(&body.particles);
    let fallen = (center(end) - center(start)).y;
    let rounding = ROUNDING * n * y.abs();
    let off = (fallen - y).abs();
    Figure::new(
        "error of the fall",
        off / y.abs() * 100.0,
        (1e-4 + rounding / y.abs()) * 100.0,
        "%",
    )
}

/// The tick with ten times the duration.
const HITCH: u64 = 20;

fn rate_of(member: &Member, tick: u64) -> f64 {
    if member.variant == "hitch" && tick == HITCH {
        member.value / 10.0
    } else {
        member.value
    }
}

pub const STEPS: Case = Case {
    name: "steps",
    title: "Time steps and hitches",
    about: "A body falls with ticks of 1/10 to 1/1000 s, or with one tick ten times as long as the others: within 0.01 % of the discrete solution and f32 rounding, and with its rest shape within 1 %. Zero, negative and NaN steps are refused.",
    seconds: |_| 1.0,
    family: |times| {
        let members = |shapes| Axes {
            scales: &[1.0, 0.01, 100.0],
            materials: &[(0.0, 0.0), (1e-5, 0.02)],
            steps: &[(1, 1), (4, 1), (1, 4)],
            seeds: &[1],
            mixtures: 4,
            ..Axes::all(shapes)
        };
        let members = family::of(
            times,
            &[
                members(&[Shape::Cube(3), Shape::Cube(1), Shape::Ball(4)]),
                members(&[Shape::Cloth(10), Shape::Cloth(20)]),
                members(&[Shape::Rope(16), Shape::Rope(1)]),
            ],
        );
        let members = family::values(&members, &[10.0, 30.0, 60.0, 240.0, 1000.0]);
        family::variants(&members, &["even", "hitch"])
    },
    start: Start::Make(|member, world| {
        world.settings.rate = Rate::new(member.value)?;
        world.settings.set_gravity(member.gravity())?;
        Ok(())
    }),
    during: |member, world| {
        world.settings.rate = Rate::new(rate_of(member, world.tick))?;
        Ok(())
    },
    judge: |run| {
        let bad = [0.0, -60.0, f64::NAN, f64::INFINITY];
        let taken = bad.iter().filter(|&&rate| Rate::new(rate).is_ok()).count();
        let taken = taken + usize::from(Substeps::new(0).is_ok());
        let mut figures = vec![
            Figure::none("bad steps taken", taken, "values"),
            fall(run, |tick| rate_of(run.member, tick)),
        ];
        figures.extend(shape_figures(&run.end.bodies[0], 0.01));
        Ok(figures)
    },
    outside: Outside::Nothing,
    any_body: false,
};

fn on_ground(member: &Member, world: &mut World, above: f32) -> Result<(), TortureError> {
    let body = &mut world.bodies[0];
    let low = body
        .particles
        .positions
        .iter()
        .map(|x| x.y)
        .fold(f32::INFINITY, f32::min);
    let up = above * member.scale - low;
    place(body, |x| Vec4::new(x.x, x.y + up, x.z, x.w));
    body.effects.ground = Some(Ground::default());
    world.settings.set_gravity(member.gravity())?;
    Ok(())
}

/// Maximum distance between the final shapes with `divisors[0]` and `divisors[1]` times fewer
/// substeps from the same start, relative to the size of the body.
fn apart(run: &Run, divisors: [u32; 2]) -> Result<f64, TortureError> {
    let of = |divisor: u32| -> Result<Vec<DVec3>, TortureError> {
        let mut world = run.start.clone();
        let substeps = run.member.substeps / divisor;
        world.settings.substeps = Substeps::new(substeps)?;
        catch_up(&mut world, &run.end);
        let particles = &world.bodies[0].particles;
        Ok((0..particles.len())
            .map(|i| particles.position(i))
            .collect())
    };
    let [fine, coarse] = [of(divisors[0])?, of(divisors[1])?];
    let pairs = fine.iter().zip(&coarse);
    let most = pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    Ok(most / f64::from(run.member.scale))
}

pub const FINE: Case = Case {
    name: "fine",
    title: "Many substeps",
    about: "With 100 to 1000 substeps per tick, a body falls freely for 0.5 s, within 0.02 % of the discrete solution, or cloth or rope hangs by one side and swings. The swing converges: halving the number of substeps changes it by less than halving it again, or by 10⁻⁵ of the size.",
    seconds: |_| 0.5,
    family: |times| {
        let members = |shapes| Axes {
            scales: &[1.0, 0.01, 100.0],
            materials: &[(1e-4, 0.0), (0.0, 0.0)],
            steps: &[(400, 1), (100, 1), (200, 1), (1000, 1)],
            seeds: &[1],
            mixtures: 2,
            ..Axes::all(shapes)
        };
        let members = family::of(
            times,
            &[
                members(&[Shape::Cube(3)]),
                members(&[Shape::Cloth(10)]),
                members(&[Shape::Rope(16)]),
            ],
        );
        let mut members = family::variants(&members, &["falls", "swings"]);
        members.retain(|member| member.variant == "falls" || !is_solid(member));
        members
    },
    start: Start::Make(|member, world| {
        if member.variant == "swings" {
            let end = -0.4999 * member.scale;
            pin(&mut world.bodies[0], |x| x.x <= end);
        }
        Ok(world.settings.set_gravity(member.gravity())?)
    }),
    during: nothing,
    judge: |run| {
        if run.member.variant == "falls" {
            let figure = fall(run, |_| 60.0);
            return Ok(vec![Figure {
                limit: 0.02,
                ..figure
            }]);
        }
        let (half, quarter) = (apart(run, [1, 2])?, apart(run, [2, 4])?);
        Ok(vec![Figure::new(
            "difference from half the substeps",
            half * 100.0,
            quarter.max(1e-5) * 100.0,
            "% of size",
        )])
    },
    outside: Outside::Nothing,
    any_body: false,
};

/// Time to come to rest [s]. A mass m on springs of compliance α and damping τ loses its speed as
/// e^(−t/(2mα/τ)): with edges of 1 mm/N and τ = 0.05 s, the softest motion of 1000 kg on the four
/// corners of a cube takes at least 10 s for each factor e.
fn settling(member: &Member) -> f64 {
    if is_solid(member) && member.compliance >= 1e-3 {
        60.0
    } else {
        10.0
    }
}

pub const SETTLES: Case = Case {
    name: "settles",
    title: "Settling",
    about: "A body dropped onto the ground from half its length is asleep and slower than a thousandth of its length per second within 10 s, or within 60 s for edge compliances of 1 mm/N or more. Balls have a rolling resistance of 0.05: without one, nothing but the impacts of faces stops them.",
    seconds: settling,
    family: |times| {
        let members = |shapes| Axes {
            scales: &[1.0, 0.1, 10.0],
            mixtures: 12,
            seeds: &[1],
            ..Axes::all(shapes)
        };
        family::of(
            times,
            &[
                members(&[
                    Shape::Cube(3),
                    Shape::Cube(1),
                    Shape::Ball(4),
                    Shape::Ring(4),
                    Shape::Bar(8),
                    Shape::Cube(5),
                ]),
                members(&[Shape::Cloth(10), Shape::Cloth(3), Shape::Cloth(20)]),
                members(&[Shape::Rope(16), Shape::Rope(1), Shape::Rope(64)]),
            ],
        )
    },
    start: Start::Make(|member, world| {
        world.sleep.enabled = true;
        world.sleep.speed *= member.scale;
        on_ground(member, world, 0.5)?;
        let ground = world.bodies[0].effects.ground.as_mut();
        if let (Shape::Ball(_), Some(ground)) = (member.shape, ground) {
            ground.rolling_resistance = RollingResistance::new(0.05)?;
        }
        Ok(())
    }),
    during: nothing,
    judge: |run| {
        let body = &run.end.bodies[0];
        let speed = measure::rms_speed(&body.particles) / f64::from(run.member.scale);
        Ok(vec![
            Figure::new("speed, over its length", speed * 1e3, 1.0, "10⁻³/s"),
            Figure::none("bodies awake", usize::from(!body.asleep), "bodies"),
        ])
    },
    outside: Outside::Nothing,
    any_body: false,
};

/// Simulated time before creep is measured [s].
const TO_REST: f64 = 20.0;

pub const HOUR: Case = Case {
    name: "hour",
    title: "Long run",
    about: "A hanging or resting body creeps by less than a millionth of its length in an hour (a minute with --quick). For a spinning body, the figures give the angular momentum lost per revolution.",
    seconds: |member| member.value,
    family: |_| {
        let mut members = Vec::new();
        for shape in [Shape::Cube(2), Shape::Cloth(4), Shape::Rope(8)] {
            for (compliance, damping) in [(0.0, 0.0), (1e-4, 0.02)] {
                for variant in ["hanging", "lying", "spinning"] {
                    let member = Member {
                        compliance,
                        damping,
                        variant,
                        ..Member::of(shape)
                    };
                    members.push(Member {
                        value: 60.0,
                        ..member
                    });
                    members.push(Member {
                        value: 3600.0,
                        quick: false,
                        ..member
                    });
                }
            }
        }
        members
    },
    start: Start::Make(|member, world| {
        match member.variant {
            "lying" => on_ground(member, world, 0.0)?,
            "hanging" => {
                let body = &mut world.bodies[0];
                stand_up(member, body);
                pin_top(body);
                world.settings.set_gravity(member.gravity())?;
            }
            _ => {
                let body = &mut world.bodies[0];
                deform(&mut body.particles, Deformation::Scale(1.0));
                for i in 0..body.particles.len() {
                    let x = body.particles.positions[i];
                    let turned = Vec3::new(-x.z, 0.0, x.x) * SPIN;
                    body.particles.set_velocity(i, turned);
                }
                return Ok(());
            }
        }
        while world.time < TO_REST {
            world.tick();
        }
        (world.time, world.tick) = (0.0, 0);
        Ok(())
    }),
    during: nothing,
    judge: |run| {
        let (start, end) = (&run.start.bodies[0], &run.end.bodies[0]);
        if run.member.variant == "spinning" {
            let spin = |body: &Body| measure::angular_momentum(&body.particles).length();
            let turns = f64::from(SPIN) / std::f64::consts::TAU * run.end.time;
            let lost = (1.0 - spin(end) / spin(start)) / turns;
            return Ok(vec![Figure::new(
                "spin lost",
                lost * 100.0,
                f64::INFINITY,
                "% a turn",
            )]);
        }
        let places = start
            .particles
            .positions
            .iter()
            .zip(&end.particles.positions);
        let ways = places.map(|(a, b)| f64::from((*b - *a).truncate().length()));
        let creep = ways.fold(0.0, f64::max) / f64::from(run.member.scale);
        Ok(vec![Figure::new(
            "creep, over its length",
            creep * 1e6,
            1.0,
            "10⁻⁶",
        )])
    },
    outside: Outside::Nothing,
    any_body: false,
};

/// Angular speed [rad/s].
const SPIN: f32 = 6.0;
