//! Membranes and weaves: their strains and gradients, compared with the reference, with differences
//! and with the requested material.

use crate::support::{
    body, damping, iterate, pinned, random_vector, run, settings, state_bits, with, world,
};
use glam::{DVec3, UVec2, Vec2, Vec3};
use pliant::{
    mesh::Primitive,
    solver::{
        Body, Effects, Membrane, MembraneCompliance, PoissonRatio, RestShape, Thickness,
        VertexIndex, Weave, YoungsModulus,
        deform::Random,
        effects::{
            Multipliers,
            elastic::{Elastic, Point},
        },
        measure, reference,
    },
};

/// ```text
///    2        of the scale `size` [m]
///   /  \
///  0 ── 1
/// ```
fn triangle(size: f64) -> RestShape {
    let corners = [
        DVec3::ZERO,
        DVec3::new(1.0, 0.1, 0.0),
        DVec3::new(0.3, 0.9, 0.2),
    ];
    RestShape {
        vertices: corners.map(|x| (x * size).as_vec3()).to_vec(),
        edges: vec![[0, 1], [1, 2], [2, 0]],
        triangles: vec![[0, 1, 2]],
        ..RestShape::default()
    }
}

/// A flat cloth along x and z, rotated about y by this angle.
fn cloth(size: Vec2, cells: UVec2, degrees: f64) -> RestShape {
    let primitive = Primitive::Cloth {
        size,
        cells,
        diagonals: Default::default(),
        shear: false,
    };
    let mut shape = primitive.build().expect("sound").shape;
    for x in &mut shape.vertices {
        *x = (turn(degrees) * x.as_dvec3()).as_vec3();
    }
    shape
}

fn turn(degrees: f64) -> glam::DQuat {
    glam::DQuat::from_rotation_y(degrees.to_radians())
}

fn membrane(modulus: f32, ratio: f32) -> Membrane {
    Membrane {
        youngs_modulus: YoungsModulus::new(modulus).expect("sound"),
        poisson_ratio: PoissonRatio::new(ratio).expect("sound"),
        thickness: Thickness::new(1e-3).expect("sound"),
        damping: damping(0.02),
    }
}

fn weave(compliances: [f32; 3]) -> Weave {
    let [warp, weft, bias] = compliances.map(|c| MembraneCompliance::new(c).expect("sound"));
    Weave {
        warp,
        weft,
        bias,
        damping: damping(0.02),
    }
}

fn points(body: &Body, corners: [u32; 3], x: &[DVec3]) -> [Point; 3] {
    corners.map(|i| i as usize).map(|i| Point {
        x: x[i],
        w: body.particles.positions[i].w.into(),
        rest: body.topology.rest[i].as_dvec3(),
    })
}

fn places(body: &Body) -> Vec<DVec3> {
    let particles = &body.particles;
    (0..particles.len())
        .map(|i| particles.predicted(i))
        .collect()
}

fn corners(body: &Body) -> [u32; 3] {
    body.topology.facets().corners().next().expect("one")
}

fn gradients_are_differences<E: Elastic<3, 3>>(effect: &E) {
    const STEP: f64 = 1e-5;
    let mut random = Random::new(7);
    for _ in 0..300 {
        let body = body("triangle", triangle(1.0), 1.0);
        let mut x = places(&body);
        for x in &mut x {
            *x += random_vector(&mut random, 0.4).as_dvec3();
        }
        let corners = corners(&body);
        let rows = |x: &[DVec3]| effect.rows(&body.topology, 0, points(&body, corners, x));
        for (number, row) in rows(&x).iter().enumerate() {
            let (mut push, mut moment) = (DVec3::ZERO, DVec3::ZERO);
            for (&corner, gradient) in corners.iter().zip(row.gradients) {
                let corner = corner as usize;
                let expected = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| {
                    let at = |side: f64| {
                        let mut x = x.clone();
                        x[corner] += axis * (side * STEP);
                        rows(&x)[number].error
                    };
                    (at(1.0) - at(-1.0)) / (2.0 * STEP)
                });
                // A strain is of second order in positions, so that central differences are exact
                // except for rounding: 1e-16 over the step.
                let deviation = gradient.distance(DVec3::from_array(expected));
                assert!(deviation < 1e-9, "row {number}: off by {deviation}");
                push += gradient;
                moment += x[corner].cross(gradient);
            }
            assert!(push.length() < 1e-12 && moment.length() < 1e-12);
        }
    }
}

#[test]
fn strains_of_a_triangle_have_their_central_differences_for_gradients() {
    gradients_are_differences(&membrane(1e6, 0.3));
    gradients_are_differences(&weave([1e-3, 2e-3, 3e-3]));
}

/// Distance of the fast kernel from the reference after an iteration over a strained, mirrored or
/// collapsed triangle, relative to its size.
fn distance_from_reference<E: Elastic<3, 3> + Into<Effects>>(
    effect: &E,
    size: f64,
    change: impl Fn(DVec3) -> DVec3,
) -> f64 {
    let mut body = body("triangle", triangle(size), 1.0);
    body.effects = (*effect).into();
    for x in &mut body.particles.positions {
        *x = change(x.truncate().as_dvec3() / size).as_vec3().extend(x.w)
            * Vec3::splat(size as f32).extend(1.0);
    }
    body.particles.settle();
    let mut reference = reference::Body::of(&body);
    reference.solve(effect, 0.01, true);
    iterate(&mut body, effect, 0.01, Multipliers::Unused);
    let both = places(&body).into_iter().zip(&reference.x);
    both.map(|(fast, reference)| {
        assert!(fast.is_finite() && reference.is_finite());
        assert!(fast.length() < 10.0 * size, "thrown to {fast}");
        fast.distance(*reference) / size
    })
    .fold(0.0, f64::max)
}

#[test]
fn triangles_equal_the_reference_and_stay_finite_when_they_collapse() {
    let mut random = Random::new(8);
    for size in [1e-3, 1.0, 1e3] {
        for _ in 0..100 {
            let [a, b, c] = [(); 3].map(|()| random_vector(&mut random, 0.4).as_dvec3());
            let change = |x: DVec3| x + a * x.x + b * x.y + c * x.z;
            let soft = membrane((1e4 / size) as f32, 0.3);
            for deviation in [
                distance_from_reference(&soft, size, change),
                distance_from_reference(&membrane(f32::INFINITY, 0.3), size, change),
                distance_from_reference(&weave([1e-3, 1e-2, 1e-1]), size, change),
                distance_from_reference(&weave([0.0; 3]), size, change),
            ] {
                // Positions near the size are accurate to a relative 6e-8, strains to a few times
                // that, through sums of a dozen terms and the elimination.
                assert!(deviation < 2e-5, "{size}: off by {deviation}");
            }
        }
        for squash in [
            DVec3::X,
            DVec3::Y,
            DVec3::ZERO,
            DVec3::splat(1e-5),
            -DVec3::ONE,
        ] {
            for effect in [membrane(f32::INFINITY, 0.3), membrane(1e4, 0.45)] {
                distance_from_reference(&effect, size, |x| x * squash);
            }
            distance_from_reference(&weave([0.0; 3]), size, |x| x * squash);
        }
    }
}

/// Strain over tension [m/N] and Poisson's ratio in the middle of a strip at rest that its weight
/// pulls lengthwise, `degrees` from the warp; and its elongation [m].
fn pulled<E: Elastic<3, 3> + Into<Effects>>(effect: &E, degrees: f64, cells: UVec2) -> [f64; 3] {
    const TENSION: f64 = 1.0;
    let body = body("strip", cloth(Vec2::new(1.0, 0.25), cells, degrees), 1.0);
    let along = turn(degrees) * DVec3::X;
    let across = turn(degrees) * DVec3::Z;
    let rest: Vec<DVec3> = body.topology.rest.iter().map(|x| x.as_dvec3()).collect();
    let near = |x: f64, to: f64| (x - to).abs() < 1e-5;
    let pins: Vec<u32> = (0..rest.len() as u32)
        .filter(|&i| {
            near(
                rest[body.topology.particle(VertexIndex(i))].dot(along),
                -0.5,
            )
        })
        .collect();
    let body = with(pinned(body, &pins), (*effect).into());
    let mut world = world(settings(0.0, 60.0, 10, 4), body);
    // In the middle of 1 m of 1 kg/m², half of it pulls.
    let gravity = (along * (2.0 * TENSION)).as_vec3();
    world.settings.set_gravity(gravity).expect("sound");
    let mut reference = reference::World::of(&world);
    reference.keeps_multipliers = true;
    for _ in 0..180 {
        reference.tick();
    }
    let body = &reference.bodies[0];
    let speed = body.v.iter().map(|v| v.length()).fold(0.0, f64::max);
    // A motion that decays over 0.02 s is then 2e-7 m from rest, compared with the measured
    // millimeter.
    assert!(speed < 1e-5, "it still moves at {speed} m/s");
    let mean = |place: f64, of: &dyn Fn(usize) -> f64| {
        let there: Vec<f64> = (0..rest.len())
            .filter(|&i| near(rest[i].dot(along), place))
            .map(of)
            .collect();
        there.iter().sum::<f64>() / there.len() as f64
    };
    let gone = |place: f64| mean(place, &|i| (body.x[i] - rest[i]).dot(along));
    let strain = (gone(0.25) - gone(-0.25)) / 0.5;
    // Over the width, the mean displacement of a point at 1/2 from the middle: by least squares.
    let moment = |x: &[DVec3]| mean(0.0, &|i| x[i].dot(across) * rest[i].dot(across));
    let narrowing = 1.0 - moment(&body.x) / moment(&rest);
    [strain / TENSION, narrowing / strain, gone(0.5)]
}

#[test]
fn a_membrane_that_is_pulled_gives_back_its_modulus_and_poissons_ratio() {
    for ratio in [0.0, 0.3, 0.45] {
        let [compliance, found, _] = pulled(&membrane(1e6, ratio), 0.0, UVec2::new(16, 4));
        // The influence of the clamp extends over one width, a quarter of the way to the middle;
        // Green's strain differs by 1.5 times the strain of 0.001.
        assert!(
            (compliance / 1e-3 - 1.0).abs() < 0.01,
            "1/(Et) is {compliance}"
        );
        assert!(
            (found - f64::from(ratio)).abs() < 0.01,
            "ν is {found}, not {ratio}"
        );
    }
}

#[test]
fn a_weave_has_the_requested_compliance_along_warp_weft_and_bias() {
    let cells = UVec2::new(16, 4);
    let threads = weave([1e-3, 2e-3, 4e-3]);
    for (degrees, expected) in [(0.0, 1e-3), (90.0, 2e-3)] {
        let [found, ratio, _] = pulled(&threads, degrees, cells);
        // As above.
        assert!(
            (found / expected - 1.0).abs() < 0.01,
            "at {degrees}°: {found}"
        );
        assert!(
            ratio.abs() < 0.01,
            "threads do not pull each other in: {ratio}"
        );
    }
    // A quarter of 1 + 1 + 8; threads that rotate towards the load narrow the strip by 6/10 of
    // that, which the clamps restrict over more of its length.
    let [found, ratio, _] = pulled(&weave([1e-3, 1e-3, 8e-3]), 45.0, cells);
    assert!((found / 2.5e-3 - 1.0).abs() < 0.05, "at 45°: {found}");
    assert!((ratio - 0.6).abs() < 0.03, "at 45°: {ratio}");
}

#[test]
fn a_finer_mesh_gives_no_other_stiffness() {
    let longer = [(4, 1), (8, 2), (16, 4)].map(|(x, y)| {
        let [.., longer] = pulled(&membrane(1e6, 0.0), 0.0, UVec2::new(x, y));
        longer
    });
    // ρgL²/(2Et) is 1 mm, at ν = 0, where the clamp has no influence; Green's strain reduces it by
    // 0.2 %.
    for longer in longer {
        assert!((longer / 1e-3 - 1.0).abs() < 0.005, "{longer}");
    }
}

#[test]
fn a_sheet_in_its_rest_shape_does_not_move_by_a_bit() {
    let sphere = Primitive::Sphere {
        radius: 0.5,
        cells: 6,
    };
    for shape in [
        cloth(Vec2::ONE, UVec2::splat(9), 33.0),
        RestShape {
            tetrahedra: Vec::new(),
            ..sphere.build().expect("sound").shape
        },
    ] {
        for effects in [
            Effects::from(membrane(1e6, 0.3)),
            Effects::from(weave([0.0; 3])),
        ] {
            let body = with(body("sheet", shape.clone(), 1.0), effects);
            let before = state_bits(&body.particles);
            let mut world = world(settings(0.0, 60.0, 10, 2), body);
            run(&mut world, 0.5);
            assert_eq!(before, state_bits(&world.bodies[0].particles));
        }
    }
}

#[test]
fn triangles_that_collapsed_to_a_point_open_again() {
    for effects in [
        Effects::from(membrane(1e5, 0.3)),
        Effects::from(weave([1e-2; 3])),
    ] {
        let mut body = with(
            body("sheet", cloth(Vec2::ONE, UVec2::splat(8), 0.0), 1.0),
            effects,
        );
        for x in &mut body.particles.positions {
            *x = Vec3::ZERO.extend(x.w);
        }
        let energy = |body: &Body| {
            let at = |i: u32| body.particles.position(i as usize);
            measure::elastic_energies(&effects, &body.topology, |i| (at(i), 1.0))
        };
        let before = energy(&body);
        let mut world = world(settings(0.0, 60.0, 20, 1), body);
        run(&mut world, 2.0);
        let body = &world.bodies[0];
        assert!(body.quarantine.is_none());
        // Triangles have recovered, except for the energy of fewer than two of the 128: without bending,
        // the direction of folds is undetermined, and some lock each other in the plane.
        let fraction = energy(body) / before;
        assert!(
            fraction < 2.0 / 128.0,
            "{fraction} of {before} J is left: {effects:?}"
        );
    }
}
