//! External forces compared with closed forms, in the fast solver and in the reference.

use crate::support::{
    self, assert_relative, body, body_of_masses, chain, pinned, settings, stretch, with, world,
};
use glam::{DVec3, UVec2, Vec2, Vec3};
use pliant::{
    mesh::Primitive,
    solver::{
        Attract, Axis, Body, Coefficient, Drag, Effects, Finite, Length, Stream, Stretch,
        Turbulence, Uniform, Vortex, Wind, World,
        ledger::{self, Ledger},
        reference,
    },
};

fn finite(value: f32) -> Finite {
    Finite::new(value).expect("sound")
}

fn coefficient(value: f32) -> Coefficient {
    Coefficient::new(value).expect("sound")
}

/// Two unconnected particles a nanometer apart, without gravity.
fn free(effects: impl Into<Effects>, speed: Vec3) -> World {
    let mut body = with(body_of_masses(chain(1, 1e-9), &[1.0, 1.0]), effects.into());
    body.set_velocity(speed);
    world(settings(0.0, 60.0, 10, 1), body)
}

/// Position and velocity of the first particle after some ticks, of the fast solver and of the
/// reference.
fn after(mut world: World, ticks: u32) -> [(DVec3, DVec3); 2] {
    let mut reference = reference::World::of(&world);
    for _ in 0..ticks {
        world.tick();
        reference.tick();
    }
    let particles = &world.bodies[0].particles;
    [
        (particles.position(0), particles.velocity_f64(0)),
        (reference.bodies[0].x[0], reference.bodies[0].v[0]),
    ]
}

#[test]
fn a_uniform_force_gives_its_exact_acceleration() {
    let force = Uniform {
        x: finite(3.0),
        y: finite(-4.0),
        z: finite(0.5),
    };
    // v = (x − p)/h is rounded by half an ulp of x over h, 7e-5 m/s beyond a meter: a random walk
    // of 600 such steps reaches 2e-3 m/s, and rarely three times that. In f64 a step is 1e-13 m/s.
    let tolerances = [6e-3, 1e-10];
    for ((place, speed), tolerance) in after(free(force, Vec3::ZERO), 60)
        .into_iter()
        .zip(tolerances)
    {
        let expected = DVec3::new(3.0, -4.0, 0.5);
        assert!(speed.distance(expected) < tolerance, "{speed}");
        // y = ½at² of symplectic Euler is ½at²(1 + 1/n) with n = 600 substeps per second.
        let expected = expected * (0.5 * (1.0 + 1.0 / 600.0));
        assert!(place.distance(expected) < tolerance, "{place}");
    }
}

#[test]
fn linear_drag_decays_as_an_exponential_and_quadratic_drag_ends_at_its_terminal_speed() {
    let drag = Drag {
        linear: coefficient(2.0),
        quadratic: coefficient(0.0),
    };
    for (_, speed) in after(free(drag, Vec3::X * 5.0), 60) {
        // Implicit: (1 + ch)⁻ⁿ = e^(−ct)(1 + c²th/2), larger by 1/300.
        assert_relative(speed.x, 5.0 * f64::exp(-2.0), 4e-3, "speed");
    }
    let effects = Effects {
        drag: Some(Drag {
            linear: coefficient(0.0),
            quadratic: coefficient(2.0),
        }),
        ..Effects::default()
    };
    let mut world = free(effects, Vec3::ZERO);
    world.settings = settings(9.81, 60.0, 10, 1);
    for (_, speed) in after(world, 60) {
        // √(g/k), whatever h; after a second it is reached to 1 − tanh √(gk) = 3e-4, and f32 rounds a
        // fall of two meters as above.
        let expected = (9.81 / 2.0_f64).sqrt();
        assert_relative(-speed.y, expected, 2e-3, "terminal speed");
    }
}

#[test]
fn a_point_pulls_as_plummer_says_and_a_particle_circles_it() {
    // A circle of one meter about a point of strength s, softened by r: v² = s/(1 + r²)^(3/2).
    let point = Attract {
        x: finite(0.0),
        y: finite(0.0),
        z: finite(0.0),
        strength: finite(10.0),
        radius: Length::new(0.3).expect("sound"),
    };
    let speed = (10.0 / 1.09_f64.powf(1.5)).sqrt();
    let mut world = free(point, Vec3::Z * speed as f32);
    world.bodies[0].translate(Vec3::X);
    let mut reference = reference::World::of(&world);
    for _ in 0..300 {
        world.tick();
        reference.tick();
        let fast = world.bodies[0].particles.position(0);
        for place in [fast, reference.bodies[0].x[0]] {
            // Symplectic Euler follows an ellipse that deviates by at most hv/2 = 2.5e-3 m.
            assert!((place.length() - 1.0).abs() < 6e-3, "{place}");
        }
    }
}

#[test]
fn a_vortex_takes_particles_along_at_its_own_speed_within_and_slower_outside() {
    let vortex = Vortex {
        turning: finite(4.0),
        radius: Length::new(0.5).expect("sound"),
        coupling: coefficient(50.0),
        ..Vortex::default()
    };
    assert_eq!(vortex.air(DVec3::new(0.25, 3.0, 0.0)), DVec3::Z * -1.0);
    assert_eq!(vortex.air(DVec3::new(0.0, 0.0, 1.0)), DVec3::X * 1.0);
    let mut world = free(vortex, Vec3::ZERO);
    world.bodies[0].translate(Vec3::X * 0.25);
    for (place, speed) in after(world, 20) {
        // It lags by 1/c = 0.02 s of its rotation, inclined by 8 %, and drifts outwards at
        // u²/(rc) = 0.08 m/s.
        assert_relative(
            speed.length(),
            4.0 * place.length(),
            0.03,
            "speed of the air",
        );
    }
}

fn sail(wind: Wind, gravity: f64) -> World {
    let cloth = Primitive::Cloth {
        size: Vec2::ONE,
        cells: UVec2::splat(2),
        diagonals: pliant::mesh::Diagonals::default(),
        shear: false,
    };
    let shape = cloth.build().expect("sound").shape;
    let effects = Effects {
        wind: Some(wind),
        stretch: stretch(1e-6),
        ..Effects::default()
    };
    let body = with(body("sail", shape, 0.5), effects);
    world(settings(gravity, 60.0, 10, 1), body)
}

#[test]
fn a_level_sheet_falls_at_the_speed_at_which_drag_bears_its_weight() {
    let still = Wind {
        x: finite(0.0),
        ..Wind::default()
    };
    let mut world = sail(still, 9.81);
    let mut reference = reference::World::of(&world);
    for _ in 0..60 {
        world.tick();
        reference.tick();
    }
    // ½ρC_D A v² = mg. Corners of one triangle and of two carry the same fraction of their mass, so
    // that the sheet stays level. After a second the terminal speed is reached to
    // 1 − tanh(g/v_t) = 1e-3.
    let expected = (2.0 * 0.5 * 9.81 / (1.2 * 1.2_f64)).sqrt();
    let particles = &world.bodies[0].particles;
    let momentum = pliant::solver::measure::momentum(particles).y / 0.5;
    assert_relative(-momentum, expected, 0.01, "terminal speed");
    let fast = particles.velocity_f64(4).y;
    assert_relative(fast, reference.bodies[0].v[4].y, 1e-3, "as the reference");
}

#[test]
fn wind_pushes_a_sheet_across_it_with_its_drag_and_not_one_along_it() {
    let up = Wind {
        x: finite(0.0),
        y: finite(3.0),
        ..Wind::default()
    };
    let mut world = sail(up, 0.0);
    world.tick();
    // F = ½ρC_D A u² on half a kilogram for 1/60 s; the sheet reaches up to 4 % of the wind speed.
    let expected = 0.5 * 1.2 * 1.2 * 9.0 / 0.5 / 60.0;
    let momentum = pliant::solver::measure::momentum(&world.bodies[0].particles) / 0.5;
    assert_relative(momentum.y, expected, 0.1, "speed after a tick");
    let mut world = sail(Wind::default(), 0.0);
    world.tick();
    let still = pliant::solver::measure::momentum(&world.bodies[0].particles);
    assert_eq!(still, DVec3::ZERO);
}

#[test]
fn gusts_are_smooth_repeat_and_stay_within_their_strength() {
    let gusts = Wind {
        turbulence: coefficient(2.0),
        ..Wind::default()
    };
    let mean = DVec3::X * 5.0;
    let mut most: f64 = 0.0;
    for step in 0..2000 {
        let place = DVec3::new(0.013, 0.029, -0.017) * f64::from(step);
        let gust = gusts.air(place, 0.0) - mean;
        most = most.max(gust.abs().max_element());
        let near = gusts.air(place + DVec3::splat(1e-6), 0.0) - mean;
        // The slope of 3t² − 2t³ is at most 1.5, of values 2 apart, over 0.5 m, on three axes.
        assert!(gust.distance(near) < 1e-6 * 3.0 * 1.5 * 4.0 * 2.0 * 3.0);
        // Frozen turbulence: the gusts here are 5 m downwind after a second.
        let later = gusts.air(place + mean, 1.0) - mean;
        assert!(gust.distance(later) < 1e-9);
    }
    assert!((1.0..=2.0).contains(&most), "{most}");
}

#[test]
fn the_ledger_includes_the_work_of_forces() {
    let effects = Effects {
        uniform: Some(Uniform {
            x: finite(2.0),
            ..Uniform::default()
        }),
        wind: Some(Wind::default()),
        drag: Some(Drag::default()),
        vortex: Some(Vortex::default()),
        attract: Some(Attract::default()),
        stretch: stretch(1e-4),
        ..Effects::default()
    };
    let mut world = sail(Wind::default(), 9.81);
    world.bodies[0].effects = effects;
    let energy = |body: &Body| {
        let (topology, particles) = (&body.topology, &body.particles);
        let at = |i: u32| particles.position(i as usize);
        pliant::solver::measure::kinetic_energy(particles)
            + pliant::solver::measure::gravitational_energy(particles, Vec3::Y * -9.81)
            + pliant::solver::measure::elastic_energies(&effects, topology, |i| (at(i), 1.0))
    };
    let start = energy(&world.bodies[0]);
    let mut total = Ledger::default();
    let swept = pliant::solver::contact::Swept::default();
    for _ in 0..30 {
        let settings = world.settings;
        let body = &mut world.bodies[0];
        let context = pliant::solver::advance::StepContext {
            settings: &settings,
            time: 0.0,
            swept: &swept,
            threads: &pliant::solver::Threads::default(),
            instructions: pliant::solver::Instructions::default(),
            watch: None,
        };
        body.begin_tick(true);
        let substeps = 0..settings.substeps.get();
        total += ledger::advance(&mut body.stepper(), substeps, &context).expect("finite");
    }
    let change = energy(&world.bodies[0]) - start;
    assert!(total.forces.abs() > 0.1, "they worked: {} J", total.forces);
    // Velocities after forces are rounded by a relative 6e-8, and the largest row is derived from
    // them.
    let largest = total
        .rows()
        .iter()
        .fold(0.0_f64, |most, (_, row)| most.max(row.abs()));
    assert!(
        (total.sum() - change).abs() < 1e-7 * largest,
        "{total:?}, but {change} J"
    );
}

/// u at the radius, halfway to it and at twice the radius, and the approach of a free particle to
/// a steady flow: 1 − v/u = (1 + ch)⁻ⁿ after n substeps.
#[test]
fn an_axis_flow_has_its_speeds_at_the_radius_and_takes_particles_along() {
    let flow = Axis {
        x: finite(1.0),
        toward_x: finite(2.0),
        toward_y: finite(0.0),
        along: finite(4.0),
        around: finite(3.0),
        inward: finite(1.0),
        radius: Length::new(0.5).expect("sound"),
        ..Axis::default()
    };
    let at = |r: f64| flow.air(DVec3::new(7.0, r, 0.0));
    let [half, whole, twice] = [0.25, 0.5, 1.0].map(at);
    assert!(
        whole.distance(DVec3::new(4.0, -1.0, 3.0)) < 1e-12,
        "{whole}"
    );
    assert!(half.distance(DVec3::new(4.0, -0.5, 1.5)) < 1e-12, "{half}");
    assert!(
        twice.distance(DVec3::new(1.0, -0.5, 1.5)) < 1e-12,
        "{twice}"
    );
    // A direction of length 0 is up.
    let up = Axis {
        toward_y: finite(0.0),
        ..Axis::default()
    };
    assert_eq!(up.air(DVec3::ZERO), DVec3::Y * 2.0);
    let mut jet = free(
        Axis {
            around: finite(0.0),
            inward: finite(0.0),
            ..Axis::default()
        },
        Vec3::ZERO,
    );
    jet.settings.substeps = pliant::solver::Substeps::new(10).expect("sound");
    let expected = 2.0 * (1.0 - 1.0 / libm::pow(1.0 + 2.0 / 600.0, 600.0));
    // The rounding of the velocity, as for the uniform force.
    for ((_, speed), tolerance) in after(jet, 60).into_iter().zip([6e-3, 1e-10]) {
        assert!((speed.y - expected).abs() < tolerance, "{speed} {expected}");
    }
}

/// Along a straight line it has the speeds of an axis; on an arc, the flow follows the tangent; a
/// particle that was carried along leaves at the end.
#[test]
fn a_stream_flows_along_its_curve_and_ends() {
    let line = Stream {
        x1: finite(1.0),
        y1: finite(0.0),
        x2: finite(2.0),
        y2: finite(0.0),
        x3: finite(3.0),
        along: finite(4.0),
        radius: Length::new(0.5).expect("sound"),
        ..Stream::default()
    };
    let at = |x: f64, r: f64| line.air(DVec3::new(x, r, 0.0));
    // Nearest points are found to the rounding of t, by Newton's method on a straight line.
    for (r, inward, coupling) in [(0.25, 0.5, 1.0), (0.5, 1.0, 1.0), (1.0, 1.0, 0.25)] {
        let (air, part) = at(1.37, r).expect("beside the curve");
        let expected = DVec3::new(4.0, -inward, 0.0);
        assert!(air.distance(expected) < 1e-9, "{air} at {r}");
        assert!((part - coupling).abs() < 1e-9, "{part} at {r}");
    }
    assert_eq!(at(3.1, 0.1), None, "beyond the end");
    let (drawn, _) = at(-0.2, 0.0).expect("before the start");
    assert!(drawn.x > 4.0, "drawn in at the start: {drawn}");
    // A straight line without handles has the same flow, and the same end.
    let bare = Stream {
        x1: finite(0.0),
        x2: finite(3.0),
        ..line
    };
    let (air, _) = bare.air(DVec3::ZERO).expect("at the start");
    assert!(air.distance(DVec3::X * 4.0) < 1e-9, "{air}");
    assert_eq!(bare.air(DVec3::X * 3.1), None, "beyond the end");
    // A quarter circle of radius 1 about the origin, to 3e-4 (the usual handles of 0.5523).
    let arc = Stream {
        x0: finite(1.0),
        x1: finite(1.0),
        y1: finite(0.552_285),
        x2: finite(0.552_285),
        y2: finite(1.0),
        x3: finite(0.0),
        y3: finite(1.0),
        along: finite(2.0),
        ..Stream::default()
    };
    for angle in [0.1, 0.5, 0.785, 1.2, 1.5_f64] {
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        let (air, _) = arc.air(DVec3::new(cos, sin, 0.0)).expect("on the curve");
        // The radial part is at most 3e-4 m off the curve over the radius of 0.2 m.
        let expected = DVec3::new(-sin, cos, 0.0) * 2.0;
        assert!(air.distance(expected) < 6e-3, "{air} at {angle}");
    }
    // A free particle approaches the speed, and keeps it once it has left: 3 m are passed after
    // 0.95 s, by x = ut − u(1 − e^(−ct))/c.
    let mut carried = free(line, Vec3::ZERO);
    carried.settings.substeps = pliant::solver::Substeps::new(10).expect("sound");
    let speeds = after(carried, 90);
    for (x, v) in speeds {
        assert!(x.x > 3.0, "it has left: {x}");
        // 4(1 − e^(−4.75)) = 3.965 m/s; by implicit Euler (1 + ch)⁻ⁿ is 2 % more than e^(−ct).
        assert!((v.x - 3.965).abs() < 0.002, "{v}");
    }
}

/// Bounded, without a mean, continuous in space and time, and steady at the rate 0.
#[test]
fn turbulence_is_bounded_smooth_and_without_a_mean() {
    let flow = Turbulence::default();
    let (mut sum, mut count) = (DVec3::ZERO, 0.0);
    for i in 0..40_000 {
        let t = f64::from(i);
        let place = DVec3::new(0.37 * t, 0.11 * t, -0.23 * t);
        let time = 0.013 * t;
        let air = flow.air(place, time);
        assert!(air.abs().max_element() <= 3.0);
        let near = flow.air(place + DVec3::splat(1e-6), time + 1e-6);
        // The slope of the noise is at most 1.5 × 2 per eddy of 0.5 m along each axis, and in time.
        assert!(near.distance(air) < 1e-4);
        (sum, count) = (sum + air, count + 1.0);
    }
    // The standard error of a mean of uniform numbers up to 3, smoothed: below 3/√(3 · 40 000).
    assert!((sum / count).abs().max_element() < 4.0 * 3.0 / f64::sqrt(3.0 * count));
    let steady = Turbulence {
        rate: coefficient(0.0),
        ..flow
    };
    assert_eq!(steady.air(DVec3::ONE, 0.0), steady.air(DVec3::ONE, 9.0));
}

/// A force that depends on the velocity balances gravity exactly at the terminal speed, with 1 substep
/// of a tick as with 20: where the air has the velocity u and the coupling c, a body ends at u + g/c.
/// In f64, which has no rounding to speak of: e^(−ct) of the difference is left.
#[test]
fn terminal_speeds_do_not_depend_on_substeps() {
    let gravity = 9.81;
    let coupling = coefficient(20.0);
    let none = finite(0.0);
    let axis = Axis {
        along: finite(3.0),
        around: none,
        inward: none,
        radius: Length::of(1e6),
        coupling,
        ..Axis::default()
    };
    // Within its radius the stream has the speed along its curve, down along a line.
    let stream = Stream {
        x0: none,
        y0: finite(1e5),
        z0: none,
        x1: none,
        y1: finite(1e5 / 3.0),
        z1: none,
        x2: none,
        y2: finite(-1e5 / 3.0),
        z2: none,
        x3: none,
        y3: finite(-1e5),
        z3: none,
        along: finite(2.0),
        inward: none,
        radius: Length::of(1e5),
        coupling,
    };
    let vortex = Vortex {
        turning: none,
        coupling,
        ..Vortex::default()
    };
    let still = Turbulence {
        speed: coefficient(0.0),
        coupling,
        ..Turbulence::default()
    };
    let linear = Drag {
        linear: coupling,
        quadratic: coefficient(0.0),
    };
    let quadratic = Drag {
        linear: coefficient(0.0),
        quadratic: coefficient(2.0),
    };
    let both = Drag {
        linear: coefficient(3.0),
        quadratic: coefficient(2.0),
    };
    let fall = gravity / 20.0;
    let cases: [(&str, Effects, f64); 6] = [
        ("linear drag", linear.into(), -fall),
        ("quadratic drag", quadratic.into(), -(gravity / 2.0).sqrt()),
        // 2s² + 3s = g.
        (
            "both",
            both.into(),
            -(-3.0 + (9.0 + 8.0 * gravity).sqrt()) / 4.0,
        ),
        ("axis", axis.into(), 3.0 - fall),
        ("stream", stream.into(), -2.0 - fall),
        ("turbulence", still.into(), -fall),
    ];
    for (name, effects, expected) in cases {
        for substeps in [1, 3, 20] {
            let mut world = free(effects, Vec3::ZERO);
            world.settings = settings(gravity, 60.0, substeps, 1);
            let [_, (_, speed)] = after(world, 240);
            let off = (speed.y - expected).abs();
            assert!(off < 1e-5 * expected.abs(), "{name}, {substeps}: {speed}");
        }
    }
    // A vortex takes nothing along its axis.
    let mut world = free(vortex, Vec3::ZERO);
    world.settings = settings(gravity, 60.0, 3, 1);
    let [_, (_, speed)] = after(world, 60);
    assert_relative(speed.y, -gravity, 1e-6, "m/s");
    // A level sheet in wind: ½ρC_D A v² = mg, whatever the substeps.
    for substeps in [1, 3, 20] {
        let wind = Wind {
            x: none,
            ..Wind::default()
        };
        let mut world = sail(wind, gravity);
        world.settings = settings(gravity, 60.0, substeps, 1);
        let mut reference = reference::World::of(&world);
        (0..600).for_each(|_| reference.tick());
        let speeds = reference.bodies[0].v.iter().zip(&reference.bodies[0].w);
        let mass: f64 = reference.bodies[0].w.iter().map(|w| 1.0 / w).sum();
        let speed = speeds.map(|(v, w)| v.y / w).sum::<f64>() / mass;
        let area = 1.0;
        let expected = -(2.0 * mass * gravity / (1.2 * 1.2 * area)).sqrt();
        assert_relative(speed, expected, 1e-4, "m/s");
    }
}

/// Root mean square distance of a hanging cloth from the reference after 10 ticks [m], where it is `x` meters
/// from the origin.
fn off_after_ten_ticks(effects: Effects, x: f32) -> f64 {
    let cloth = Primitive::Cloth {
        size: Vec2::ONE,
        cells: UVec2::splat(20),
        diagonals: Default::default(),
        shear: true,
    };
    let shape = cloth.build().expect("a cloth").shape;
    let effects = Effects {
        stretch: Some(Stretch {
            damping: support::damping(0.02),
            ..stretch(1e-5).expect("edges")
        }),
        ..effects
    };
    let mut cloth = pinned(with(body("cloth", shape, 0.2), effects), &[0, 20]);
    cloth.translate(Vec3::new(x, 1.0, 0.0));
    let mut fast = world(settings(9.81, 60.0, 10, 1), cloth);
    let mut exact = reference::World::of(&fast);
    for _ in 0..10 {
        fast.tick();
        exact.tick();
    }
    let particles = &fast.bodies[0].particles;
    let all = (0..).zip(&exact.bodies[0].x);
    let sum: f64 = all
        .map(|(i, x)| particles.position(i).distance_squared(*x))
        .sum();
    (sum / particles.len() as f64).sqrt()
}

/// Single precision in a field adds no more than some roundings of a displacement: the error is at most ten
/// times that without a field, also far from the origin. The cloth moves by up to 2 m/s under the fastest
/// field and by 1 m/s without, and a rounding is amplified in proportion to its speed and to its strain.
#[test]
fn fields_in_single_precision_follow_the_reference() {
    let wind = Wind::default();
    let gusts = Wind {
        turbulence: coefficient(2.0),
        ..wind
    };
    let uniform = Uniform {
        x: finite(3.0),
        ..Uniform::default()
    };
    let drag = Drag {
        linear: coefficient(20.0),
        quadratic: coefficient(1.0),
    };
    let attract = Attract {
        x: finite(5.0),
        ..Attract::default()
    };
    let fields: [(&str, Effects); 8] = [
        ("uniform", uniform.into()),
        ("attract", attract.into()),
        ("vortex", Vortex::default().into()),
        ("axis", Axis::default().into()),
        ("drag of 1/s", Drag::default().into()),
        ("drag of 20/s and 1/m", drag.into()),
        ("wind", wind.into()),
        ("wind with gusts", gusts.into()),
    ];
    for x in [0.0, 100.0] {
        let without = off_after_ten_ticks(Effects::default(), x);
        println!("at {x} m without a field: {without:.1e} m");
        assert!(without > 1e-9, "the fast solver rounds: {without}");
        for (name, effects) in fields {
            let off = off_after_ten_ticks(effects, x);
            println!("at {x} m with {name}: {off:.1e} m");
            assert!(off < 10.0 * without, "{name} at {x} m: {off} m");
        }
    }
}
