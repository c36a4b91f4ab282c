//! Topology: rejected input, elements that are skipped and counted, distribution of mass.

use crate::support::{assert_relative, body, chain, cube, pinned, tetrahedron, topology};
use glam::Vec3;
use pliant::solver::{RestShape, Topology, TopologyError, topology::Dimension};

fn error(change: impl FnOnce(&mut RestShape)) -> TopologyError {
    let mut shape = tetrahedron();
    change(&mut shape);
    Topology::new(shape).expect_err("a bad shape")
}

#[test]
fn invalid_shapes_are_refused_with_the_element_and_the_vertex() {
    assert_eq!(
        Topology::new(RestShape::default()),
        Err(TopologyError::Empty)
    );
    let message = error(|shape| shape.vertices[2].y = f32::NAN).to_string();
    assert!(
        message.contains("vertex 2") && message.contains("NaN"),
        "{message}"
    );
    let message = error(|shape| shape.edges[1] = [0, 9]).to_string();
    assert_eq!(message, "edge 1 refers to vertex 9; expected 0 to 3");
    let message = error(|shape| shape.tetrahedra[0] = [0, 1, 1, 3]).to_string();
    assert_eq!(message, "tetrahedron 0 refers to vertex 1 more than once");
    let message = error(|shape| shape.triangles[3] = [u32::MAX, 1, 2]).to_string();
    assert!(
        message.starts_with("triangle 3 refers to vertex 4294967295"),
        "{message}"
    );
}

#[test]
fn flat_elements_repeated_edges_and_unused_vertices_are_left_out_and_counted() {
    let mut shape = tetrahedron();
    shape
        .vertices
        .extend([Vec3::new(1.0, 1.0, 0.0), Vec3::splat(7.0)]);
    shape.tetrahedra.push([0, 1, 2, 4]);
    shape.edges.extend([[1, 0], [0, 1]]);
    let topology = topology(shape);
    assert_eq!(topology.tetrahedra.corners().len(), 1);
    assert_eq!(topology.edges.ends().len(), 6);
    assert_eq!(topology.left_out.flat_tetrahedra, 1);
    assert_eq!(topology.left_out.repeated_edges, 2);
    assert_eq!(topology.left_out.unused_vertices, 2);
}

#[test]
fn particles_that_no_element_uses_have_no_mass_and_do_not_move() {
    let mut shape = tetrahedron();
    shape.vertices.push(Vec3::splat(7.0));
    let body = body("with a stray", shape, 1000.0);
    assert_eq!(body.particles.positions[4].w, 0.0);
}

#[test]
fn the_masses_of_the_particles_add_up_to_that_of_the_body() {
    let mass = |body: &pliant::solver::Body| -> f64 {
        let positions = &body.particles.positions;
        positions.iter().map(|x| 1.0 / f64::from(x.w)).sum()
    };
    // Each particle's mass is rounded three times.
    let solid = body("cube", cube(0.5, 3), 1000.0);
    assert_eq!(solid.topology.dimension, Dimension::Solid);
    assert_relative(mass(&solid), 125.0, 3e-7, "mass of the cube");
    let mut sheet = tetrahedron();
    sheet.tetrahedra.clear();
    let sheet = body("sheet", sheet, 2.0);
    assert_eq!(sheet.topology.dimension, Dimension::Sheet);
    assert_relative(
        mass(&sheet),
        2.0 * (1.5 + 0.75_f64.sqrt()),
        3e-7,
        "mass of the sheet",
    );
    let rope = body("rope", chain(4, 0.5), 3.0);
    assert_eq!(rope.topology.dimension, Dimension::Line);
    assert_relative(mass(&rope), 6.0, 3e-7, "mass of the rope");
}

#[test]
fn unpinning_gives_a_particle_its_mass_back_to_the_bit() {
    let free = body("cube", cube(0.5, 1), 1000.0);
    let mut body = pinned(free.clone(), &[0, 3]);
    assert_eq!(body.particles.positions[3].w, 0.0);
    body.pins.clear();
    body.update_masses();
    assert_eq!(body.particles, free.particles);
}

#[test]
fn a_tetrahedron_given_inside_out_keeps_its_sign_and_is_content() {
    let mut shape = tetrahedron();
    shape.tetrahedra[0] = [0, 2, 1, 3];
    let mut body = body("inside out", shape, 1000.0);
    assert!(body.topology.tetrahedra.rest_volume[0] < 0.0);
    body.effects = crate::support::elastic();
    let mut world = crate::support::world(crate::support::settings(0.0, 60.0, 10, 1), body);
    let before = world.state_hash();
    world.tick();
    assert_eq!(
        world.state_hash(),
        before,
        "it is at rest in its rest shape"
    );
}
