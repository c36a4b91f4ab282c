//! Struts: their positions, and that they keep a hollow body open.

use crate::support::{body, iterate, run, settings, stretch, with, world};
use pliant::{
    mesh::Primitive,
    solver::{
        Body, Compliance, Damping, Effects, RestShape, Struts,
        deform::{Deformation, deform},
        effects::Multipliers,
        measure, reference,
    },
};

fn sphere(cells: u32) -> RestShape {
    let balloon = Primitive::Balloon {
        radius: 0.25,
        cells,
    };
    balloon.build().expect("a sound sphere").shape
}

fn struts(compliance: f32) -> Struts {
    Struts {
        compliance: Compliance::new(compliance).expect("sound"),
        damping: Damping::new(0.01).expect("sound"),
    }
}

fn held(struts: Option<Struts>) -> Body {
    let effects = Effects {
        stretch: stretch(1e-3).map(|stretch| pliant::solver::Stretch {
            damping: Damping::new(0.01).expect("sound"),
            ..stretch
        }),
        struts,
        ..Effects::default()
    };
    with(body("ball", sphere(6), 0.5), effects)
}

/// A ray that is tilted by t from the normal of a sphere leaves it at an angle of 2t: a strut is 2R
/// cos t long, with t at most √3 · 0.1, except for the distance to the nearest vertex, which is
/// half an edge.
#[test]
fn struts_of_a_sphere_go_through_its_middle_once_from_each_vertex() {
    let ball = body("ball", sphere(8), 1.0);
    let (count, struts) = (ball.topology.particles(), ball.topology.struts());
    let found = struts.ends().len();
    assert!(found > count / 2 && found <= count, "{found} of {count}");
    let mut reached = vec![false; count];
    let edge = ball
        .topology
        .edges
        .rest_length
        .iter()
        .copied()
        .fold(0.0, f32::max);
    for (ends, &length) in struts.ends().zip(&struts.rest_length) {
        assert!(
            (0.5 * f32::cos(0.18) - edge..=0.5 + 1e-6).contains(&length),
            "{length} m"
        );
        for i in ends {
            reached[i as usize] = true;
        }
    }
    assert!(
        reached.iter().all(|reached| *reached),
        "each vertex has one"
    );
    assert_eq!(*struts, *body("again", sphere(8), 2.0).topology.struts());
}

/// The inward direction does not depend on the orientation of the triangles; an open surface has no
/// strut where a ray leaves through a hole.
#[test]
fn struts_are_inside_whichever_way_a_surface_faces() {
    let mut inwards = sphere(4);
    for triangle in &mut inwards.triangles {
        triangle.swap(0, 1);
    }
    let count = |shape: RestShape| body("ball", shape, 1.0).topology.struts().ends().len();
    assert_eq!(count(inwards), count(sphere(4)));
    let flat = Primitive::Cloth {
        size: glam::Vec2::ONE,
        cells: glam::UVec2::splat(4),
        diagonals: Default::default(),
        shear: false,
    };
    assert_eq!(count(flat.build().expect("sound").shape), 0);
}

#[test]
fn struts_equal_the_reference() {
    let effect = struts(1e-4);
    let mut fast = held(Some(effect));
    deform(&mut fast.particles, Deformation::Squash(0.7));
    let mut reference = reference::Body::of(&fast);
    reference.solve(&effect, f64::from(0.01_f32), true);
    iterate(&mut fast, &effect, 0.01, Multipliers::Unused);
    for (i, reference) in reference.x.iter().enumerate() {
        // At most a dozen struts per vertex, each of which rounds positions below 0.5 m by 3e-8 m,
        // and propagates errors of that size.
        let deviation = fast.particles.predicted(i).distance(*reference);
        assert!(deviation < 24.0 * 3e-8, "off by {deviation} m");
    }
}

/// C17.
#[test]
fn a_ball_with_struts_comes_back_from_half_its_height_and_one_without_does_not() {
    let deviation = [Some(struts(2e-3)), None].map(|struts| {
        let mut body = held(struts);
        deform(&mut body.particles, Deformation::Squash(0.5));
        let mut world = world(settings(0.0, 60.0, 20, 1), body);
        run(&mut world, 3.0);
        let body = &world.bodies[0];
        measure::shape_error(&body.topology, &body.particles.positions)
    });
    assert!(
        deviation[0] < 0.02,
        "with struts it is off by {}",
        deviation[0]
    );
    assert!(
        deviation[1] > 0.02,
        "without it is off by only {}",
        deviation[1]
    );
}
