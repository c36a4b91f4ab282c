//! The body builder: its results, and rejected input.

use crate::support_app::ticks;
use bevy::prelude::*;
use pliant::{
    SoftBodyPlugins,
    prelude::*,
    solver::{RestShape, TopologyError, VertexIndex, topology::Dimension},
};
use std::panic::catch_unwind;

#[test]
fn each_kind_of_body_has_its_dimension_and_a_density_of_its_own() {
    let bodies = [
        (
            SoftBody::cuboid(Vec3::ONE, UVec3::ONE),
            Dimension::Solid,
            1000.0,
        ),
        (SoftBody::sphere(0.5, 4), Dimension::Solid, 1000.0),
        (
            SoftBody::cloth(Vec2::ONE, UVec2::splat(3)),
            Dimension::Sheet,
            0.3,
        ),
        (SoftBody::rope(1.0, 4), Dimension::Line, 0.1),
    ];
    for (body, dimension, density) in bodies {
        let (body, found, pins) = body.build();
        assert_eq!(body.dimension, dimension);
        assert_eq!(found.get(), density, "{dimension:?}");
        assert!(pins.is_empty());
    }
}

#[test]
fn a_body_is_where_it_was_put_and_its_pins_hold_it() {
    let upright = Quat::from_rotation_z(std::f32::consts::FRAC_PI_2);
    let rope = SoftBody::rope(1.0, 4)
        .rotated(upright)
        .at(Vec3::Y * 3.0)
        .density(Density::of(0.2))
        .pinned([4]);
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, SoftBodyPlugins::default()));
    let body = app
        .world_mut()
        .spawn((rope.build(), Stretch::default()))
        .id();
    ticks(&mut app, 60);
    let particles = app.world().get::<Particles>(body).expect("a body");
    // It was along x, and its last vertex is now at the top.
    let at = |vertex: u32| {
        let body = app.world().get::<SoftBody>(body).expect("a body");
        particles
            .position(body.particle(VertexIndex(vertex)))
            .as_vec3()
    };
    assert!(at(4).distance(Vec3::Y * 3.5) < 1e-6, "{}", at(4));
    assert!(at(0).y < 3.0, "what hangs upside down falls: {}", at(0));
    assert_eq!(
        app.world().get::<BodyDensity>(body).expect("a body").get(),
        0.2
    );
}

/// Ends that are the same point but for rounding are one vertex.
#[test]
fn a_closed_curve_is_a_ring() {
    let corners = [Vec3::X, Vec3::Y, Vec3::NEG_X, Vec3::NEG_Y];
    let closed = CubicCardinalSpline::new_catmull_rom(corners);
    let closed = closed.to_curve_cyclic().expect("four points");
    let circle = FunctionCurve::new(Interval::UNIT, |t: f32| {
        let (sin, cos) = (std::f32::consts::TAU * t).sin_cos();
        Vec3::new(cos, 0.0, sin)
    });
    let rings = [
        (SoftBody::curve(&closed, 24), 24),
        (SoftBody::curve(&circle, 24), 24),
        (SoftBody::curve(&circle, 1), 3),
    ];
    for (ring, segments) in rings {
        let (body, ..) = ring.build();
        assert_eq!(body.particles(), segments);
        let mut meeting = vec![0; segments];
        let ends: Vec<[u32; 2]> = body.edges.ends().collect();
        assert_eq!(ends.len(), segments);
        ends.iter()
            .flatten()
            .for_each(|&end| meeting[end as usize] += 1);
        assert!(meeting.iter().all(|&edges| edges == 2), "{meeting:?}");
        assert!(body.edges.rest_length.iter().all(|&length| length > 0.1));
    }
    let arc = FunctionCurve::new(Interval::UNIT, |t: f32| {
        let (sin, cos) = (6.2 * t).sin_cos();
        Vec3::new(cos, 0.0, sin)
    });
    for segments in [1, 2, 24] {
        let (body, ..) = SoftBody::curve(&arc, segments).build();
        assert_eq!(body.particles(), segments as usize + 1);
        assert_eq!(body.edges.ends().len(), segments as usize);
    }
}

#[test]
fn an_invalid_size_is_named() {
    let refused = |make: fn() -> SoftBodyBuilder| {
        let message = catch_unwind(make).expect_err("no body");
        message
            .downcast_ref::<String>()
            .cloned()
            .expect("a message")
    };
    let message = refused(|| SoftBody::rope(-1.0, 4));
    assert!(
        message.contains("length") && message.contains("-1"),
        "{message}"
    );
    let message = refused(|| SoftBody::cloth(Vec2::ONE, UVec2::ZERO));
    assert!(message.contains("cells"), "{message}");
    let empty = SoftBody::shape(RestShape::default()).try_build();
    assert_eq!(empty.err(), Some(TopologyError::Empty));
}

#[test]
fn a_value_in_code_is_checked_and_a_constant_by_the_compiler() {
    const SOFT: Compliance = Compliance::of(1e-4);
    assert_eq!(Compliance::new(1e-4), Ok(SOFT));
    let message = catch_unwind(|| pliant::solver::Friction::of(-0.5)).expect_err("it is refused");
    let message = message.downcast_ref::<&str>().expect("a message");
    assert_eq!(*message, "friction must be between 0 and 100");
}
