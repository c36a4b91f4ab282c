//! Every fast kernel against the twin, on random elements: one substep of one sweep of each.
//!
//! The worlds hold many elements that share no particle, with random masses, places and speeds,
//! some pinned, and some degenerate. A single operation in f32 is off by ε = 2⁻²⁴ of its result;
//! what follows from that for a kernel is told where it is allowed.

use crate::support::{random_vector, stretch, volume, world};
use glam::{DVec3, Vec3};
use pliant::solver::{
    Body, Collide, Collider, ColliderShape, Damping, Density, Friction, Grab, Ground, Mass, Path,
    Pose, RestShape, Restitution, StickyGround, SurfacePoint, Topology, World,
    contact::pose::rotation, deform::Random, reference,
};
use std::sync::Arc;

const EPSILON: f64 = 1.0 / (1 << 24) as f64;

/// Places, elements and masses at random: `count` elements of `N` corners each, in a cube of 2 m.
fn random_body<const N: usize>(count: u32, seed: u32) -> Body {
    let mut random = Random::new(seed);
    let element = |i: u32| std::array::from_fn::<u32, N, _>(|k| i * N as u32 + k as u32);
    let vertices: Vec<Vec3> = (0..count * N as u32)
        .map(|_| random_vector(&mut random, 1.0))
        .collect();
    let mut shape = RestShape {
        vertices,
        ..RestShape::default()
    };
    for i in 0..count {
        let corners = element(i);
        match N {
            2 => shape.edges.push([corners[0], corners[1]]),
            4 => shape.tetrahedra.push(std::array::from_fn(|k| corners[k])),
            _ => {}
        }
    }
    let topology = Arc::new(Topology::new(shape).expect("sound"));
    let mut body = Body::new("random", topology, Density::new(1e-9).expect("sound"));
    for particle in 0..count * N as u32 {
        let mass = 0.1 + 10.0 * random.next() * random.next();
        body.added_mass
            .push((particle, Mass::new(mass).expect("sound")));
        if random.next() < 0.1 {
            body.pins.push(particle);
        }
    }
    body.update_masses();
    for v in &mut body.particles.velocities {
        *v = random_vector(&mut random, 20.0).extend(0.0);
    }
    body
}

/// The state after a substep, of the fast solver and of the twin: (x, x̂), (v, v̂).
fn step(mut world: World) -> Vec<[(DVec3, DVec3); 2]> {
    let mut twin = reference::World::of(&world);
    world.tick();
    twin.tick();
    assert!(world.bodies[0].quarantine.is_none());
    let (fast, twin) = (&world.bodies[0].particles, &twin.bodies[0]);
    (0..fast.len())
        .map(|i| {
            let x = fast.positions[i].truncate().as_dvec3();
            let v = fast.velocities[i].truncate().as_dvec3();
            [(x, twin.x[i]), (v, twin.v[i])]
        })
        .collect()
}

fn settings(rate: f64) -> pliant::solver::Settings {
    crate::support::settings(9.81, rate, 1, 1)
}

/// Fails if particle `i` is off by more than `tolerance` [m], or its velocity by twice that over
/// a substep.
#[track_caller]
fn assert_near(state: &[[(DVec3, DVec3); 2]], i: usize, tolerance: f64, rate: f64) {
    let [(x, expected_x), (v, expected_v)] = state[i];
    let error = x.distance(expected_x);
    assert!(
        error <= tolerance,
        "particle {i} at {x} instead of {expected_x}: {error} > {tolerance}"
    );
    let error = v.distance(expected_v);
    let tolerance = 2.0 * tolerance * rate + 2.0 * EPSILON * expected_v.length();
    assert!(
        error <= tolerance,
        "particle {i} at {v} instead of {expected_v} m/s: {error} > {tolerance}"
    );
}

#[test]
fn presolve_and_postsolve_equal_the_twin() {
    for rate in [60.0, 6000.0] {
        let state = step(world(settings(rate), random_body::<1>(1000, 1)));
        for i in 0..state.len() {
            // Three operations on numbers below 2 m, and 1/rate as an f32.
            assert_near(&state, i, 8.0 * EPSILON, rate);
        }
    }
}

#[test]
fn stretch_equals_the_twin() {
    for (compliance, tau, rate) in [(0.0, 0.0, 600.0), (1e-4, 0.0, 60.0), (1e-6, 0.01, 6000.0)] {
        let mut body = random_body::<2>(1000, 2);
        body.effects.stretch = stretch(compliance);
        if let Some(stretch) = &mut body.effects.stretch {
            stretch.damping = Damping::new(tau).expect("sound");
        }
        // A tenth have their ends in one place; particles that are pinned stay there too.
        for i in (0..2000).step_by(20) {
            body.particles.positions[i + 1] = body.particles.positions[i]
                .truncate()
                .extend(body.particles.positions[i + 1].w);
            body.particles.velocities[i + 1] = body.particles.velocities[i];
            if body
                .pins
                .iter()
                .any(|&pin| pin as usize == i || pin as usize == i + 1)
            {
                body.particles.velocities[i] *= 0.0;
                body.particles.velocities[i + 1] *= 0.0;
            }
        }
        let start: Vec<Vec3> = body
            .particles
            .positions
            .iter()
            .map(|x| x.truncate())
            .collect();
        let ends = body.topology.edges.ends.clone();
        let moving: Vec<bool> = body.particles.positions.iter().map(|x| x.w > 0.0).collect();
        let state = step(world(settings(rate), body));
        for [a, b] in ends.map_ends() {
            if start[a] == start[b] && moving[a] != moving[b] {
                // One end falls and the other is pinned: the direction hangs on the last bit.
                continue;
            }
            // Places below 3 m are off by 4ε after the prediction, their difference by 8ε; divided
            // by its length, that turns the direction along which the ends go by ‖Δx‖.
            let length = state[a][0].1.distance(state[b][0].1).max(1e-2);
            let moved = 2.0 * 3.0;
            let before = f64::from(start[a].distance(start[b])).clamp(1e-2, 4.0);
            let tolerance = 16.0 * EPSILON * (1.0 + moved / length.min(before));
            assert_near(&state, a, tolerance, rate);
            assert_near(&state, b, tolerance, rate);
        }
    }
}

trait Ends {
    fn map_ends(&self) -> Vec<[usize; 2]>;
}

impl Ends for Vec<[u32; 2]> {
    fn map_ends(&self) -> Vec<[usize; 2]> {
        self.iter().map(|ends| ends.map(|i| i as usize)).collect()
    }
}

#[test]
fn volume_equals_the_twin() {
    for (compliance, tau, rate) in [(0.0, 0.0, 600.0), (1e-6, 0.0, 60.0), (1e-9, 0.01, 6000.0)] {
        let mut body = random_body::<4>(500, 3);
        body.effects.volume = volume(compliance);
        if let Some(volume) = &mut body.effects.volume {
            volume.damping = Damping::new(tau).expect("sound");
        }
        for v in &mut body.particles.velocities {
            *v *= 0.05;
        }
        let tetrahedra = body.topology.tetrahedra.clone();
        // Every tenth is in one point, and does not move.
        for corners in tetrahedra.corners.iter().step_by(10) {
            for &i in corners {
                let w = body.particles.positions[i as usize].w;
                body.particles.positions[i as usize] = Vec3::splat(0.5).extend(w);
                body.particles.velocities[i as usize] *= 0.0;
            }
        }
        let pinned: Vec<bool> = body
            .particles
            .positions
            .iter()
            .map(|x| x.w == 0.0)
            .collect();
        let state = step(world(settings(rate), body));
        for (index, corners) in tetrahedra.corners.iter().enumerate() {
            let pins = corners.iter().filter(|&&i| pinned[i as usize]).count();
            if index % 10 == 0 && pins > 0 {
                // Pins and falling corners: whether a gradient is left hangs on the last bits.
                continue;
            }
            // V and its gradients are sums of products of lengths below 4 m, each a dozen
            // operations: off by 2⁶ε m³ and 2⁴ε m². The step is C/‖∇C‖ with ‖∇C‖ ≥ 0.1 |V₀|^(2/3),
            // so it is off by (2⁶ + 2⁴ C/‖∇C‖)ε/‖∇C‖.
            let gradient = 0.1 * f64::from(tetrahedra.gradient_scale[index]).sqrt();
            let error = f64::from(tetrahedra.rest_volume[index].abs()) + 1.0;
            let tolerance = EPSILON * (64.0 + 16.0 * error / gradient) / gradient;
            for &i in corners {
                assert_near(&state, i as usize, tolerance.min(1e-3), rate);
            }
        }
    }
}

#[test]
fn grab_equals_the_twin() {
    for seed in 0..200 {
        let mut random = Random::new(seed);
        let mut body = random_body::<1>(12, seed);
        let terms: Vec<(u32, f32)> = (0..12).map(|i| (i, random.next() + 0.01)).collect();
        let point = SurfacePoint::new(&terms).expect("sound");
        let target = random_vector(&mut random, 3.0);
        let mut grab = Grab::on(point, target, 10.0, 1.0, 9.81);
        grab.from = random_vector(&mut random, 3.0);
        body.effects.grab = Some(grab);
        let state = step(world(settings(600.0), body));
        for i in 0..12 {
            // Twelve terms below 2 m are off by 2⁵ε; the distance to the target is of the order
            // of a metre.
            assert_near(&state, i, 128.0 * EPSILON, 600.0);
        }
    }
}

fn surface(friction: f32, restitution: f32) -> (Friction, Restitution) {
    let friction = Friction::new(friction).expect("sound");
    (friction, Restitution::new(restitution).expect("sound"))
}

#[test]
fn both_grounds_equal_the_twin() {
    for (mu, e, rate) in [(0.5, 0.0, 60.0), (0.3, 0.7, 600.0), (0.0, 1.0, 6000.0)] {
        let (friction, restitution) = surface(mu, e);
        let mut body = random_body::<1>(1000, 4);
        body.effects.ground = Some(Ground {
            height: 0.125,
            friction,
            restitution,
        });
        let mut sticky = body.clone();
        sticky.effects.ground = None;
        sticky.effects.sticky_ground = Some(StickyGround { height: 0.125 });
        for body in [body, sticky] {
            let state = step(world(settings(rate), body));
            for i in 0..state.len() {
                // A dozen operations on lengths below 2 m.
                assert_near(&state, i, 32.0 * EPSILON, rate);
            }
        }
    }
}

#[test]
fn colliders_equal_the_twin() {
    let shapes = [
        ColliderShape::Sphere { radius: 0.7 },
        ColliderShape::Box {
            size: Vec3::new(1.0, 0.8, 1.3),
        },
        ColliderShape::Capsule {
            radius: 0.4,
            length: 0.9,
        },
    ];
    let paths = [
        Path::Still,
        Path::Line {
            velocity: Vec3::new(3.0, 5.0, -4.0),
        },
        Path::Spin {
            axis: Vec3::new(1.0, 1.0, 2.0),
            rate: 2.0,
        },
    ];
    for (k, shape) in (0..).zip(shapes) {
        for path in &paths {
            let mut body = random_body::<1>(2000, 5 + k);
            let (friction, restitution) = surface(0.4, 0.5);
            body.effects.collide = Some(Collide {
                friction,
                restitution,
            });
            let pose = Pose {
                rotation: rotation(DVec3::new(0.3, 1.0, 0.2), 0.7).as_mat3(),
                translation: Vec3::new(0.1, -0.2, 0.05),
            };
            let mut world = world(settings(60.0), body);
            world.colliders = vec![Collider::moving(shape, pose, path.clone()).expect("sound")];
            let state = step(world);
            for i in 0..state.len() {
                // Into the collider's frame and back: three dozen operations on lengths below 2 m;
                // a grazing particle meets a round shape at a place known to √ε only.
                assert_near(&state, i, 2.0_f64.powi(-16), 60.0);
            }
        }
    }
}

#[test]
fn many_substeps_of_everything_stay_near_the_twin() {
    let mut body = crate::support::body("cube", crate::support::cube(0.5, 2), 1000.0);
    body.effects = crate::support::elastic_on_ground();
    body.effects.stretch = stretch(1e-6);
    body.translate(Vec3::new(0.0, 0.5, 0.0));
    body.set_velocity(Vec3::new(0.5, 0.0, 0.1));
    let mut world = world(crate::support::settings(9.81, 60.0, 5, 2), body);
    let mut twin = reference::World::of(&world);
    for _ in 0..60 {
        world.tick();
        twin.tick();
    }
    // Contact makes neighbouring states part; a millimetre in a second of a bounce of half a metre.
    for (x, expected) in world.bodies[0]
        .particles
        .positions
        .iter()
        .zip(&twin.bodies[0].x)
    {
        let error = x.truncate().as_dvec3().distance(*expected);
        assert!(error < 1e-3, "{x} instead of {expected}");
    }
}
