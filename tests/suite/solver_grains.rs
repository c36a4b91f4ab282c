//! Grains: contact with each other, with other bodies, with the ground and with colliders.

use crate::support::{body, pinned, settings, stretch, with, world as world_of};
use glam::{DVec3, Vec3, Vec3Swizzles, Vec4Swizzles};
use pliant::{
    mesh::{GrainRegion, Primitive},
    solver::{
        Body, Cohesion, Collide, Collider, ColliderShape, Contact, Effects, Friction, Grains,
        Ground, Pose, RestShape, Settings, Topology, TopologyError, World, reference,
    },
};

const RADIUS: f32 = 0.01;
const GRAVITY: f64 = 9.81;

fn grains(friction: f64) -> Option<Grains> {
    Some(Grains {
        friction: Friction::try_from(friction).expect("valid"),
        ..Grains::default()
    })
}

/// Grains of equal radius at these places [m], of 1000 kg/m³.
fn at(places: &[Vec3]) -> Body {
    let shape = RestShape {
        vertices: places.to_vec(),
        radii: vec![RADIUS; places.len()],
        ..RestShape::default()
    };
    let effects = Effects {
        grains: grains(0.5),
        ..Effects::default()
    };
    with(body("grains", shape, 1000.0), effects)
}

fn floor() -> Option<Ground> {
    Some(Ground::default())
}

fn world(gravity: f64, substeps: u32, iterations: u32, body: Body) -> World {
    world_of(settings(gravity, 60.0, substeps, iterations), body)
}

fn momentum(world: &World) -> (DVec3, f64) {
    let particles = world.bodies.iter().map(|body| &body.particles);
    let each = particles.flat_map(|particles| {
        (0..particles.len()).map(|i| {
            let mass = 1.0 / f64::from(particles.positions[i].w);
            particles.velocity_f64(i) * mass
        })
    });
    let each: Vec<DVec3> = each.collect();
    (each.iter().sum(), each.iter().map(|p| p.length()).sum())
}

/// Runs and fails if a body diverges.
fn run(world: &mut World, seconds: f64) {
    for _ in 0..(seconds * 60.0).round() as u32 {
        world.tick();
        assert!(world.bodies.iter().all(|it| it.quarantine.is_none()));
    }
}

#[test]
fn the_mass_of_a_grain_is_that_of_a_ball() {
    let body = at(&[Vec3::ZERO]);
    let expected = 1000.0 * 4.0 / 3.0 * std::f64::consts::PI * f64::from(RADIUS).powi(3);
    let found = 1.0 / f64::from(body.particles.positions[0].w);
    assert!((found / expected - 1.0).abs() < 1e-6, "{found} {expected}");
}

#[test]
fn two_grains_that_collide_stay_together_with_their_momentum() {
    let mut body = at(&[Vec3::ZERO, Vec3::X * 0.05]);
    body.particles.set_velocity(0, Vec3::X * 2.0);
    let mut world = world(0.0, 10, 1, body);
    let (before, scale) = momentum(&world);
    run(&mut world, 0.2);
    let particles = &world.bodies[0].particles;
    let distance = particles.position(0).distance(particles.position(1));
    // Rounding of the positions, 1e-6 of 0.2 m, and they do not bounce.
    assert!((distance - 0.02).abs() < 1e-6, "{distance}");
    let [a, b] = [0, 1].map(|i| particles.velocity(i));
    assert!(
        (a - Vec3::X).length() < 1e-3 && (b - Vec3::X).length() < 1e-3,
        "{a} {b}"
    );
    let (after, _) = momentum(&world);
    assert!((after - before).length() < 1e-5 * scale);
}

/// Closed system (C13): a cloud of grains that collide at 3 m/s.
#[test]
fn a_colliding_cloud_keeps_its_momentum() {
    let shape = Primitive::Grains {
        size: Vec3::splat(0.25),
        region: GrainRegion::Ball,
        radius: RADIUS,
        variation: 0.5,
    };
    let mut body = body("cloud", shape.build().expect("valid").shape, 1000.0);
    body.effects.grains = grains(0.5);
    for i in 0..body.particles.len() {
        let inwards = -body.particles.position(i).as_vec3() * 30.0;
        body.particles.set_velocity(i, inwards + Vec3::Y);
    }
    let mut world = world(0.0, 10, 2, body);
    let (before, scale) = momentum(&world);
    run(&mut world, 0.5);
    let (after, _) = momentum(&world);
    // Each impulse is the same for both grains up to the rounding of their displacements, 6e-8 of
    // some millimeters in a substep of 3 m/s: 1e-6 of the momentum if all add up.
    assert!((after - before).length() < 1e-6 * scale, "{before} {after}");
}

#[test]
fn a_grain_rests_on_the_ground_and_against_colliders_at_its_radius() {
    let mut grain = at(&[Vec3::new(0.0, 0.05, 0.0)]);
    grain.effects.ground = floor();
    grain.effects.collide = Some(Collide::default());
    for shape in [
        ColliderShape::Box {
            size: Vec3::splat(0.2),
        },
        ColliderShape::Sphere { radius: 0.1 },
        ColliderShape::Capsule {
            radius: 0.1,
            length: 0.2,
        },
    ] {
        let mut grain = grain.clone();
        grain.particles.set_velocity(0, Vec3::X);
        let mut world = world(GRAVITY, 10, 1, grain);
        let place = Pose {
            translation: DVec3::new(0.2, 0.02, 0.0),
            ..Pose::default()
        };
        world.colliders = vec![Collider::new(shape.clone(), place).expect("valid")];
        run(&mut world, 1.0);
        let found = world.bodies[0].particles.position(0);
        // The ball and the capsule end 0.1 m around (0.2, 0.02); the grain touches them at its height.
        let height = f64::from(RADIUS);
        let side = 0.2
            - match shape {
                ColliderShape::Box { .. } => 0.1 + height,
                _ => {
                    let reach = 0.1 + height;
                    (reach * reach - 0.01 * 0.01).sqrt()
                }
            };
        // A micrometer: ε of the positions, and what rounding makes of a resting contact.
        assert!((found.y - height).abs() < 2e-6, "{shape:?}: {found}");
        assert!(found.x <= side + 2e-6, "{shape:?}: {found} beyond {side}");
        assert!(found.x > side - 0.05, "{shape:?}: {found} stopped early");
    }
}

/// A fast grain does not pass a thin wall, and is not held up beside it.
#[test]
fn a_fast_grain_is_stopped_by_a_thin_box_and_passes_beside_it() {
    // The wall ends at 0.1 m; at 0.109 m the grain would graze its edge.
    for (height, passes) in [(0.0, false), (0.095, false), (0.111, true)] {
        let mut grain = at(&[Vec3::new(-1.0, height, 0.0)]);
        grain.effects.collide = Some(Collide::default());
        grain.particles.set_velocity(0, Vec3::X * 60.0);
        let mut world = world(0.0, 4, 1, grain);
        let size = Vec3::new(0.004, 0.2, 0.2);
        let wall = Collider::new(ColliderShape::Box { size }, Pose::default());
        world.colliders = vec![wall.expect("valid")];
        run(&mut world, 0.1);
        let found = world.bodies[0].particles.position(0);
        assert_eq!(found.x > 1.0, passes, "at {height}: {found}");
    }
}

fn pile(friction: f64, cohesion: f64) -> World {
    let shape = Primitive::Grains {
        size: Vec3::new(0.24, 0.4, 0.24),
        region: GrainRegion::Cylinder,
        radius: RADIUS,
        variation: 0.2,
    };
    let mut sand = body("sand", shape.build().expect("valid").shape, 1600.0);
    sand.translate(Vec3::Y * 0.2);
    sand.effects.grains = Some(Grains {
        cohesion: Cohesion::try_from(cohesion).expect("valid"),
        ..grains(friction).expect("some")
    });
    sand.effects.ground = floor();
    let mut world = world(GRAVITY, 20, 4, sand);
    world.sleep.enabled = true;
    world
}

/// Slope of a cone with the moments of these grains [°].
fn slope(world: &World) -> f64 {
    let positions = &world.bodies[0].particles.positions;
    let count = positions.len() as f64;
    let center = positions
        .iter()
        .map(|x| x.truncate().as_dvec3())
        .sum::<DVec3>()
        / count;
    let from_axis = |x: &glam::Vec4| (x.xz().as_dvec2() - center.xz()).length();
    let radius = positions.iter().map(from_axis).sum::<f64>() / count;
    // tan θ = 2⟨z⟩/⟨ρ⟩, with the lowest grains at the height of their radius.
    (2.0 * (center.y - 0.9 * f64::from(RADIUS)) / radius)
        .atan()
        .to_degrees()
}

/// A slope is stable up to arctan µ, and somewhat steeper, as grains that do not roll interlock: by 5°
/// with µ = 0.1 to 9° with µ = 0.3 where this was measured, with other radii and gaps.
#[test]
fn a_column_collapses_into_a_pile_with_the_slope_of_its_friction_and_sleeps() {
    for friction in [0.1, 0.2, 0.3_f64] {
        let mut world = pile(friction, 0.0);
        run(&mut world, 8.0);
        let found = slope(&world) - friction.atan().to_degrees();
        assert!((0.0..12.0).contains(&found), "µ {friction}: {found}° more");
        assert!(world.bodies[0].asleep, "µ {friction}");
        let overlap = worst_overlap(&world.bodies[0]);
        // (N − 1)gh² below fourteen layers, at 1/1200 s: 0.09 mm with one iteration, and a pile has
        // half of the layers; twice as much for the grains that carry more than their share.
        assert!(overlap < 1.8e-4, "overlap of {overlap} m");
    }
}

#[test]
fn grains_without_friction_spread_and_sticky_ones_stand() {
    let mut world = pile(0.0, 0.0);
    run(&mut world, 4.0);
    let smooth = slope(&world);
    assert!(smooth < 5.0, "{smooth}°");
    // A hundred times the weight of a grain.
    let weight = 1600.0 * 4.2e-6 * GRAVITY;
    let mut world = pile(0.3, 100.0 * weight);
    let before = slope(&world);
    run(&mut world, 4.0);
    let sticky = slope(&world);
    // It settles by its gaps, a tenth of its height.
    assert!(sticky > 60.0, "{before}° → {sticky}°");
}

fn worst_overlap(body: &Body) -> f64 {
    let (x, radii) = (&body.particles.positions, &body.topology.radii);
    let mut worst = 0.0_f32;
    for i in 0..x.len() {
        for j in 0..i {
            let overlap = radii[i] + radii[j] - (x[i] - x[j]).truncate().length();
            worst = worst.max(overlap);
        }
    }
    worst.into()
}

/// A column of ten equal grains, which one iteration leaves with the overlap of Gauss–Seidel.
#[test]
fn the_overlap_of_a_column_is_bounded_by_what_an_iteration_leaves() {
    let places: Vec<Vec3> = (0..10)
        .map(|i| Vec3::Y * (RADIUS * (2 * i + 1) as f32))
        .collect();
    for iterations in [1, 10] {
        let mut column = at(&places);
        column.effects.ground = floor();
        let mut world = world(GRAVITY, 10, iterations, column);
        run(&mut world, 2.0);
        let top = world.bodies[0].particles.position(9).y;
        let sunk = f64::from(19.0 * RADIUS) - top;
        let per_contact = GRAVITY / 600.0 / 600.0;
        // Solved from the top down, the top sinks by (N − 1)(N + 2)/2 times gh².
        let most = 54.0 * per_contact / f64::from(iterations);
        assert!(
            (-1e-6..most).contains(&sunk),
            "{iterations}: {sunk} of {most}"
        );
    }
}

#[test]
fn cohesion_carries_a_grain_up_to_its_force() {
    let mass = 1000.0 * 4.0 / 3.0 * std::f64::consts::PI * f64::from(RADIUS).powi(3);
    for (part, holds) in [(1.05, true), (0.95, false)] {
        let mut pair = pinned(at(&[Vec3::ZERO, Vec3::Y * (-2.0 * RADIUS)]), &[0]);
        let cohesion = Cohesion::try_from(part * mass * GRAVITY).expect("valid");
        pair.effects.grains = Some(Grains {
            cohesion,
            ..Grains::default()
        });
        let mut world = world(GRAVITY, 10, 4, pair);
        run(&mut world, 1.0);
        let height = world.bodies[0].particles.position(1).y;
        assert_eq!(height > -0.021, holds, "{part}: {height}");
    }
}

/// Grains on a rope, on grains of another body, and on cloth.
#[test]
fn grains_lie_on_other_bodies() {
    let contact = Some(Contact {
        thickness: 0.01_f64.try_into().expect("valid"),
        ..Contact::default()
    });
    let under = |shape: RestShape, pins: &[u32], density: f32| {
        let effects = Effects {
            stretch: stretch(0.0),
            contact,
            ..Effects::default()
        };
        with(pinned(body("under", shape, density), pins), effects)
    };
    let rope = RestShape {
        vertices: vec![Vec3::X * -0.03, Vec3::X * 0.03],
        edges: vec![[0, 1]],
        ..RestShape::default()
    };
    let cloth = RestShape {
        vertices: vec![
            Vec3::new(-0.05, 0.0, -0.05),
            Vec3::new(0.05, 0.0, -0.05),
            Vec3::new(0.0, 0.0, 0.07),
        ],
        edges: vec![[0, 1], [1, 2], [0, 2]],
        triangles: vec![[0, 2, 1]],
        ..RestShape::default()
    };
    let ball = RestShape {
        vertices: vec![Vec3::ZERO],
        radii: vec![0.02],
        ..RestShape::default()
    };
    let cases = [
        ("a rope", rope, &[0, 1][..], 0.005),
        ("cloth", cloth, &[0, 1, 2][..], 0.005),
        ("a grain", ball, &[0][..], 0.02),
    ];
    for (name, shape, pins, half) in cases {
        let mut grain = at(&[Vec3::new(0.0, 0.1, 0.0)]);
        grain.effects.contact = contact;
        let mut world = world(GRAVITY, 10, 2, under(shape, pins, 1.0));
        world.bodies.push(grain);
        run(&mut world, 1.0);
        let height = world.bodies[1].particles.position(0).y;
        // It lies exactly above the middle. gh² is 3e-5 m, and one contact is solved exactly.
        let expected = half + f64::from(RADIUS);
        assert!(
            (height - expected).abs() < 2e-6,
            "{name}: {height} for {expected}"
        );
    }
}

/// A converged solution does not depend on the order of the contacts.
#[test]
fn the_reference_agrees_on_a_small_heap() {
    let places = [
        Vec3::new(0.0, 0.01, 0.0),
        Vec3::new(0.021, 0.01, 0.0),
        Vec3::new(0.01, 0.01, 0.019),
        Vec3::new(0.0105, 0.028, 0.0063),
    ];
    // With friction, forces in a heap are not unique: the upper grain slides on fixed ones.
    for (friction, pins) in [(0.0, &[][..]), (0.2, &[0, 1, 2][..])] {
        let mut heap = pinned(at(&places), pins);
        heap.effects.grains = grains(friction);
        heap.effects.ground = Some(Ground {
            friction: Friction::NONE,
            ..Ground::default()
        });
        let settings: Settings = settings(GRAVITY, 60.0, 10, 60);
        let mut world = world_of(settings, heap.clone());
        let mut reference = reference::World::of(&world_of(settings, heap));
        for _ in 0..6 {
            world.tick();
            reference.tick();
        }
        for (i, expected) in reference.bodies[0].x.iter().enumerate() {
            let found = world.bodies[0].particles.position(i);
            // 60 iterations leave 1e-3 of what a tick moves, 2.7 mm.
            let off = found.distance(*expected);
            assert!(off < 3e-6, "{friction}, {i}: {found} {expected}");
        }
    }
}

#[test]
fn shapes_of_grains_are_checked() {
    let shape = |radii: &[f32], edges: &[[u32; 2]]| RestShape {
        vertices: vec![Vec3::ZERO, Vec3::X],
        radii: radii.to_vec(),
        edges: edges.to_vec(),
        ..RestShape::default()
    };
    let refused = |radii, edges| Topology::new(shape(radii, edges)).expect_err("invalid");
    assert_eq!(
        refused(&[1.0], &[]),
        TopologyError::Radii {
            radii: 1,
            vertices: 2
        }
    );
    let found = refused(&[1.0, 0.0], &[]).to_string();
    assert_eq!(found, "vertex 1 has the radius 0; expected 1e-6 to 1e3 m");
    assert!(Topology::new(shape(&[1.0, f32::NAN], &[])).is_err());
    assert_eq!(
        refused(&[1.0, 1.0], &[[0, 1]]),
        TopologyError::GrainsWithElements(1)
    );
    let sound = Topology::new(shape(&[1.0, 2.0], &[])).expect("sound");
    let again = sound.rest_shape();
    assert_eq!((again.radii, sound.size), (vec![1.0, 2.0], 5.0));
}
