//! Small scenes that go through all code that is not checked by the compiler: blocks of constraints in lanes, pieces of a
//! body on several threads, work lent to a thread pool. They are there to be run under Miri:
//! `cargo +nightly miri test -p pliant_solver --test memory`. What is computed, the tests of the program check.

use glam::{DVec3, UVec2, Vec2Swizzles, Vec3};
use pliant_solver::{
    Bend, Body, Collide, Collider, ColliderShape, Compliance, Contact, Damping, Density, Direct,
    Effects, Force, Grab, Ground, Instructions, IsometricBend, Iterations, Membrane, NeoHookean,
    ParticleIndex, Particles, Plasticity, Pose, Pressure, RestShape, Rod, SelfContact,
    ShapeMatching, SmoothingIterations, StickyGround, Stitch, StitchEnd, Stitches, StrainLimit,
    Stretch, Struts, Substeps, SurfacePoint, Tethers, Threads, Topology, VertexIndex, Volume,
    Weave, Wind, World,
    kernel::{
        Block, Blocks, Columns, Floats, Lanes, Projected, Vectors, difference, iterate, scaled,
    },
    topology::order::Elements,
};
use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
};

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
        ..RestShape::default()
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
        direct: Some(Direct),
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
    bodies[0].pins = [0].map(VertexIndex).to_vec();
    bodies[0].update_masses();
    let mut world = world(bodies.to_vec(), [2, 1]);
    world.tick();
    assert_finite(&world);
}

/// One per lane, with multipliers and without.
#[test]
fn copies_of_a_body() {
    let effects = Effects {
        stretch: Some(Stretch {
            damping: Damping::new(0.01).expect("positive"),
            ..Stretch::default()
        }),
        volume: Some(Volume::default()),
        ground: Some(Ground::default()),
        ..Effects::default()
    };
    let original = body(solid(), effects);
    let copies = (0..3).map(|number| {
        let mut copy = original.clone();
        copy.translate(Vec3::X * number as f32);
        copy
    });
    let mut world = world(copies.collect(), [2, 1]);
    let alone = world.bodies[0].states.bytes();
    world.tick();
    assert_finite(&world);
    let columns = world.bodies[0].states.bytes() - alone;
    assert!(columns >= 8 * 256, "they are in lanes: {columns} bytes");
}

/// Of one partition and of several, where particles stay in lanes and where they do not, and one that
/// diverges.
#[test]
fn strips_of_a_grid() {
    let damping = Damping::new(0.01).expect("positive");
    let in_the_air = Effects {
        stretch: Some(Stretch {
            damping,
            ..Stretch::default()
        }),
        membrane: Some(Membrane::default()),
        ..Effects::default()
    };
    let on_the_ground = Effects {
        ground: Some(Ground::default()),
        ..in_the_air
    };
    let edges_on_the_ground = Effects {
        membrane: None,
        ..on_the_ground
    };
    // Miri sees everything in lanes; elsewhere that depends on the instructions.
    let is_sure = cfg!(miri) || Instructions::default().name().starts_with("AVX");
    let (in_the_air, on_the_ground) = ((in_the_air, [2, 1]), (on_the_ground, [2, 2]));
    let cases = match cfg!(miri) {
        // It takes minutes for each, and longer with membranes.
        true => vec![
            (UVec2::new(4, 3), vec![in_the_air]),
            (UVec2::new(2, 31), vec![(edges_on_the_ground, [1, 1])]),
        ],
        false => vec![
            (UVec2::new(20, 20), vec![in_the_air, on_the_ground]),
            (UVec2::new(90, 24), vec![in_the_air, on_the_ground]),
        ],
    };
    for (cells, effects) in cases {
        let shape = body(sheet(cells), Effects::default());
        for (effects, times) in effects {
            let mut body = Body {
                effects,
                ..shape.clone()
            };
            assert!(body.topology.partitions.strips().is_some(), "it is a grid");
            let rows = body.topology.particles() * 4 * size_of::<f32>();
            let mut here = world(vec![body.clone()], times);
            let before = here.bodies[0].states.bytes();
            here.tick();
            assert_finite(&here);
            let columns = here.bodies[0].states.bytes() - before;
            assert!(
                columns >= rows || !is_sure,
                "they are in lanes: {columns} bytes"
            );
            if body.topology.partitions.count() > 1 {
                assert_same_on_two_threads(&here);
            }
            body.particles.set_velocity(3, Vec3::Y * 3e38);
            here.bodies = vec![body];
            here.tick();
            assert!(here.bodies[0].quarantine.is_some(), "it diverges");
        }
    }
}

/// Strips of another grid of as many particles; or they are not solved in strips.
#[test]
fn constraints_of_other_strips_are_refused() {
    let cells = match cfg!(miri) {
        true => UVec2::new(4, 3),
        false => UVec2::new(11, 4),
    };
    let [wide, long] = [cells, cells.yx()].map(|cells| {
        let effects = Effects {
            stretch: Some(Stretch::default()),
            ..Effects::default()
        };
        body(sheet(cells), effects)
    });
    let strips = [&wide, &long].map(|it| it.topology.partitions.strips());
    assert!(
        strips[0].is_some() && strips[1].is_some() && strips[0] != strips[1],
        "{strips:?}"
    );
    let mut mixed = wide.clone();
    let topology = Arc::make_mut(&mut mixed.topology);
    topology.partitions = Arc::clone(&long.topology.partitions);
    let mut mixed = world(vec![mixed], [1, 1]);
    let result = catch_unwind(AssertUnwindSafe(|| mixed.tick()));
    match result {
        Ok(()) => assert_finite(&mixed),
        Err(_) => assert!(Instructions::default().name() == "AVX-512" || cfg!(miri)),
    }
}

/// What has a state of the whole body, or of each particle, and passes that add up sums.
#[test]
fn effects_with_a_state() {
    let point = |particle| SurfacePoint::new(&[(ParticleIndex(particle), 1.0)]).expect("a point");
    let effects = Effects {
        stretch: Some(Stretch::default()),
        pressure: Some(Pressure::default()),
        collide: Some(Collide::default()),
        ground: Some(Ground::default()),
        grab: Some(Grab::on(point(0), Vec3::Y, 1.0, 0.1, 9.81)),
        ..Effects::default()
    };
    let mut shape = solid();
    let faces = [
        [0, 2, 1],
        [1, 2, 3],
        [4, 5, 6],
        [5, 7, 6],
        [0, 1, 4],
        [1, 5, 4],
    ];
    let others = [
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
        [1, 3, 5],
        [3, 7, 5],
    ];
    shape.triangles = [faces, others].concat();
    let mut body = body(shape, effects);
    let stitch = Stitch {
        point: point(7),
        to: StitchEnd::Point(point(1)),
        compliance: Compliance::default(),
        strength: Force::default(),
        broken: false,
    };
    body.stitches = Stitches::new(vec![stitch], 8).expect("a stitch");
    assert!(
        body.topology.enclosure().is_ok(),
        "there is something to fill"
    );
    let mut world = world(vec![body], [2, 2]);
    let ball = ColliderShape::Sphere { radius: 0.05 };
    world.colliders = vec![Collider::new(ball, Pose::at(DVec3::ZERO)).expect("a ball")];
    world.settings.smoothing_iterations = SmoothingIterations::new(1).expect("in range");
    world.tick();
    assert_finite(&world);
}

/// Constraints of an app's own that are not always on the same elements: no harm is done.
#[test]
fn kernels_of_an_app() {
    struct Odd<'a>(&'a [Topology; 2], AtomicUsize);

    impl Blocks<2, 1> for Odd<'_> {
        fn elements(&self) -> &Elements<2> {
            let turn = self.1.fetch_add(1, Ordering::Relaxed);
            &self.0[turn % 2].edges.elements
        }

        fn project<L: Lanes>(
            &self,
            _: L,
            _: &Block<2>,
            [a, b]: &[Columns<L>; 2],
            _: Option<&[Vectors<L>; 2]>,
            lambda: Option<[Floats<L>; 1]>,
        ) -> Projected<L, 2, 1> {
            let d = difference(b, a);
            Projected {
                moves: [scaled(&d, a[3]), scaled(&d, -b[3])],
                change: lambda.unwrap_or([d[0]]),
            }
        }
    }

    let shapes = [UVec2::new(1, 1), UVec2::new(5, 4)];
    let both = shapes.map(|cells| Topology::new(sheet(cells)).expect("a sound shape"));
    let mut particles = Particles::at_rest(both[0].rest.iter().copied());
    for first in 0..2 {
        let odd = Odd(&both, AtomicUsize::new(first));
        let swept = catch_unwind(AssertUnwindSafe(|| iterate(&odd, &mut particles)));
        // Those of the larger sheet do not fit, and are refused.
        assert!(swept.is_err() || particles.first_not_finite().is_none());
    }
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
    assert!(world.contacts().counts().near > 0, "they are near");
    assert_finite(&world);
}

/// Steps a world whose body is cut into pieces on one thread and on two.
fn assert_same_on_two_threads(world: &World) {
    let body = &world.bodies[0];
    let load = body.effects.load(&body.topology, 4);
    assert!(load.pieces > 1, "it is cut");
    let mut both = [1, 2].map(|count| World {
        threads: Threads::new(count).expect("two threads"),
        ..world.clone()
    });
    for world in &mut both {
        world.tick();
        assert_finite(world);
    }
    let [one, two] = &both;
    assert_eq!(one.bodies[0].particles, two.bodies[0].particles);
}

/// Strands in pieces of a body, and one that is longer than a piece, on two threads.
#[test]
fn rods_on_two_threads() {
    let (strands, nodes, long, substeps) = if cfg!(miri) {
        (14, 3, 24, 1)
    } else {
        (150, 30, 1500, 2)
    };
    let mut shape = RestShape::default();
    for (number, count) in std::iter::repeat_n(nodes, strands)
        .chain([long])
        .enumerate()
    {
        let first = shape.vertices.len() as u32;
        let place = |i| Vec3::new(i as f32 * 0.02, 0.0, number as f32 * 0.1);
        shape.vertices.extend((0..count).map(place));
        shape
            .edges
            .extend((first + 1..first + count).map(|i| [i - 1, i]));
    }
    let effects = Effects {
        rod: Some(Rod::default()),
        ..Effects::default()
    };
    assert_same_on_two_threads(&world(vec![body(shape, effects)], [substeps, 1]));
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
    assert_same_on_two_threads(&world(vec![body(sheet(cells), effects)], [4, 1]));
}
