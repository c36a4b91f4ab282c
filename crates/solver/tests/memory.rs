//! Small scenes that go through all code that is not checked by the compiler: blocks of constraints in lanes, pieces of a
//! body on several threads, work lent to a thread pool. They are there to be run under Miri:
//! `cargo +nightly miri test -p pliant_solver --test memory`. What is computed, the tests of the program check.

use glam::{UVec2, Vec3};
use pliant_solver::{
    Bend, Body, Contact, Density, Direct, Effects, Ground, IsometricBend, Iterations, Membrane,
    NeoHookean, Plasticity, RestShape, SelfContact, ShapeMatching, StickyGround, StrainLimit,
    Stretch, Struts, Substeps, Tethers, Threads, Topology, Volume, Weave, Wind, World,
};
use std::sync::Arc;

/// A sheet in the plane y = 0 with one diagonal in each cell.
fn sheet(cells: UVec2) -> RestShape {
    let (across, along) = (cells.x + 1, cells.y + 1);
    let at = |x: u32, z: u32| z * across + x;
    let vertices =
        (0..along).flat_map(|z| (0..across).map(move |x| Vec3::new(x as f32, 0.0, z as f32) * 0.1));
    let mut edges = Vec::new();
    let mut triangles = Vec::new();
    for z in 0..along {
        for x in 0..across {
            let here = at(x, z);
            if x < cells.x {
                edges.push([here, at(x + 1, z)]);
            }
            if z < cells.y {
                edges.push([here, at(x, z + 1)]);
            }
            if x < cells.x && z < cells.y {
                edges.push([here, at(x + 1, z + 1)]);
                triangles.push([here, at(x + 1, z + 1), at(x + 1, z)]);
                triangles.push([here, at(x, z + 1), at(x + 1, z + 1)]);
            }
        }
    }
    RestShape {
        vertices: vertices.collect(),
        edges,
        triangles,
        ..RestShape::default()
    }
}

/// Five tetrahedra that fill a box.
fn solid() -> RestShape {
    let vertices =
        (0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 0.1);
    let vertices: Vec<Vec3> = vertices.collect();
    let tetrahedra = [
        [0, 1, 2, 4],
        [3, 1, 7, 2],
        [5, 1, 4, 7],
        [6, 2, 7, 4],
        [1, 2, 4, 7],
    ];
    let tetrahedra = tetrahedra.map(|corners: [u32; 4]| {
        let [a, b, c, d] = corners.map(|i| vertices[i as usize]);
        match (b - a).cross(c - a).dot(d - a) > 0.0 {
            true => corners,
            false => [corners[0], corners[2], corners[1], corners[3]],
        }
    });
    let mut edges: Vec<[u32; 2]> = Vec::new();
    for corners in tetrahedra {
        for i in 0..4 {
            for j in 0..i {
                let (a, b) = (corners[i], corners[j]);
                let edge = [a.min(b), a.max(b)];
                if !edges.contains(&edge) {
                    edges.push(edge);
                }
            }
        }
    }
    RestShape {
        vertices,
        edges,
        tetrahedra: tetrahedra.to_vec(),
        triangles: Vec::new(),
    }
}

fn body(shape: RestShape, effects: Effects) -> Body {
    let topology = Arc::new(Topology::new(shape).expect("a sound shape"));
    let density = Density::new(1.0).expect("positive");
    Body {
        effects,
        ..Body::new("body", topology, density)
    }
}

fn world(bodies: Vec<Body>, [substeps, iterations]: [u32; 2]) -> World {
    let mut world = World {
        bodies,
        ..World::default()
    };
    world.settings.substeps = Substeps::new(substeps).expect("in range");
    world.settings.iterations = Iterations::new(iterations).expect("in range");
    world
}

fn assert_finite(world: &World) {
    for body in &world.bodies {
        assert_eq!(body.particles.first_not_finite(), None);
        assert!(body.quarantine.is_none());
    }
}

#[test]
fn effects_of_solids() {
    let springs = Effects {
        stretch: Some(Stretch::default()),
        volume: Some(Volume::default()),
        struts: Some(Struts::default()),
        ground: Some(Ground::default()),
        plasticity: Some(Plasticity::default()),
        ..Effects::default()
    };
    let material = Effects {
        neo_hookean: Some(NeoHookean::default()),
        shape_matching: Some(ShapeMatching::default()),
        ..Effects::default()
    };
    let direct = Effects {
        stretch: Some(Stretch::default()),
        volume: Some(Volume::default()),
        direct: Some(Direct::default()),
        ..Effects::default()
    };
    let bodies = [springs, material, direct].map(|effects| body(solid(), effects));
    let mut world = world(bodies.to_vec(), [2, 2]);
    world.tick();
    assert_finite(&world);
}

#[test]
fn effects_of_sheets() {
    let cloth = Effects {
        stretch: Some(Stretch::default()),
        bend: Some(Bend::default()),
        strain_limit: Some(StrainLimit::default()),
        tethers: Some(Tethers::default()),
        wind: Some(Wind::default()),
        ..Effects::default()
    };
    let material = Effects {
        membrane: Some(Membrane::default()),
        isometric_bend: Some(IsometricBend::default()),
        sticky_ground: Some(StickyGround::default()),
        ..Effects::default()
    };
    let weave = Effects {
        weave: Some(Weave::default()),
        ..Effects::default()
    };
    let mut bodies = [cloth, material, weave].map(|effects| body(sheet(UVec2::new(4, 3)), effects));
    bodies[0].pins = vec![0];
    bodies[0].update_masses();
    let mut world = world(bodies.to_vec(), [2, 1]);
    world.tick();
    assert_finite(&world);
}

#[test]
fn bodies_that_touch() {
    let effects = Effects {
        stretch: Some(Stretch::default()),
        contact: Some(Contact::default()),
        self_contact: Some(SelfContact::default()),
        ..Effects::default()
    };
    let mut bodies = [(); 2].map(|()| body(sheet(UVec2::new(2, 2)), effects));
    bodies[1].translate(Vec3::Y * 0.01);
    let mut world = world(bodies.to_vec(), [2, 1]);
    world.threads = Threads::new(2).expect("two threads");
    world.tick();
    assert!(world.contacts.counts().near > 0, "they are near");
    assert_finite(&world);
}

/// A body that is cut into pieces, on two threads: the same bits as on one.
#[test]
fn a_body_on_two_threads() {
    let effects = Effects {
        stretch: Some(Stretch::default()),
        ground: Some(Ground::default()),
        ..Effects::default()
    };
    let cells = if cfg!(miri) {
        UVec2::new(15, 7)
    } else {
        UVec2::new(90, 24)
    };
    let one = world(vec![body(sheet(cells), effects)], [4, 1]);
    let load = effects.load(&one.bodies[0].topology, 4);
    assert!(load.pieces > 1, "it is cut");
    let mut both = [1, 2].map(|count| World {
        threads: Threads::new(count).expect("two threads"),
        ..one.clone()
    });
    for world in &mut both {
        world.tick();
        assert_finite(world);
    }
    let [one, two] = &both;
    assert_eq!(one.bodies[0].particles, two.bodies[0].particles);
}
